"""The simulated worlds by name."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np

from covista_clients.simulation.arena import ROVERS_PER_COURT, arena
from covista_clients.simulation.building import assemble
from covista_clients.simulation.designs import Design, boxes, corner, facade, shelf
from covista_clients.simulation.vantage import viewpoints
from covista_clients.simulation.world import World

__all__ = ["WORLDS", "build", "viewpoints"]

_DESIGNS: Mapping[str, Callable[[np.random.Generator, int], Design]] = {
    "corner": lambda rng, _: corner(rng),
    "boxes": lambda rng, _: boxes(rng),
    "shelf": lambda rng, _: shelf(rng),
    "wall": lambda rng, _: facade(rng),
    "arena": arena,
}
WORLDS = tuple(_DESIGNS)


def build(name: str, seed: int = 0, robots: int = ROVERS_PER_COURT) -> World:
    """The world of that name; the arena has room for `robots`. Raises ValueError for a name it does not know."""
    if name not in _DESIGNS:
        raise ValueError(f"there is no world {name!r}, but {', '.join(WORLDS)}")
    shape, texture = np.random.default_rng([seed, WORLDS.index(name)]).spawn(2)
    design = _DESIGNS[name](shape, robots)
    facets, atlas = assemble(design.panels, design.solids, texture)
    return World(name, seed, facets, atlas, design.courts)

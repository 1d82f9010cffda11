"""Who looks at what, scene by scene: rovers of one court share sights, split up, join others, and regroup."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from covista_clients.simulation.lattice import Lattice, Node, nearest_free, place
from covista_clients.simulation.vantage import vantage
from covista_clients.simulation.world import Court, Floats

Indices = NDArray[np.int64]
_WATCHERS_PER_SIGHT = 3
_CANDIDATES = 4
_RESTLESS = 0.5


@dataclass(frozen=True, slots=True)
class Scene:
    """What each rover of a court looks at (an index of the open sights), and from which lattice point."""

    sights: tuple[int, ...]
    places: tuple[Node, ...]


@dataclass(frozen=True, slots=True, eq=False)
class Stage:
    """A court ready to play on."""

    court: Court
    grid: Lattice
    sights: Floats


def opening(stage: Stage, rovers: int, rng: np.random.Generator) -> Scene:
    """The first scene: groups of about three, each at a sight of its own."""
    return _placed(stage, _regroup(stage, rovers, rng), None, rng)


def following(stage: Stage, scene: Scene, number: int, rng: np.random.Generator) -> Scene:
    """The scene after `scene`: in turn groups split, groups merge, all regroup."""
    change = (_split, _merge, None)[(number - 1) % 3]
    watched = np.array(scene.sights)
    after = change(stage, watched, rng) if change else _regroup(stage, len(watched), rng)
    return _placed(stage, after, scene, rng)


def _regroup(stage: Stage, rovers: int, rng: np.random.Generator) -> Indices:
    groups = max(1, rovers // _WATCHERS_PER_SIGHT)
    chosen = np.empty(0, int)
    for _ in range(groups):
        chosen = np.append(chosen, _fresh(stage, chosen, rng))
    return chosen[rng.permutation(rovers) % groups]


def _split(stage: Stage, watched: Indices, rng: np.random.Generator) -> Indices:
    """From every group somebody leaves, and those meet at another sight."""
    after = watched.copy()
    fresh = _fresh(stage, watched, rng)
    for value in np.unique(watched):
        members = rng.permutation(np.flatnonzero(watched == value))
        after[members[: max(1, len(members) // _WATCHERS_PER_SIGHT)]] = fresh
    return after


def _merge(stage: Stage, watched: Indices, rng: np.random.Generator) -> Indices:
    """The smallest group joins another."""
    values, counts = np.unique(watched, return_counts=True)
    smallest = values[counts.argmin()]
    others = values[values != smallest]
    goal = rng.choice(others) if len(others) else _fresh(stage, values, rng)
    return np.where(watched == smallest, goal, watched)


def _fresh(stage: Stage, watched: Indices, rng: np.random.Generator) -> int:
    """A sight that nobody watches, far from those watched."""
    unwatched = np.setdiff1d(np.arange(len(stage.sights)), watched)
    if not len(unwatched):
        return int(rng.integers(len(stage.sights)))
    drawn = rng.permutation(unwatched)[:_CANDIDATES]
    apart = np.linalg.norm(stage.sights[drawn, None, :2] - stage.sights[None, watched, :2], axis=2)
    return int(drawn[apart.min(axis=1, initial=np.inf).argmax()])


def _placed(stage: Stage, watched: Indices, before: Scene | None, rng: np.random.Generator) -> Scene:
    """Who changes the sight finds a place, apart from all; of the others half do, and half stay."""
    restless = rng.random(len(watched)) < _RESTLESS
    staying = [before is not None and before.sights[k] == sight and not restless[k] for k, sight in enumerate(watched)]
    places = list(before.places) if before else [(0, 0)] * len(watched)
    taken = [place(stage.grid, node) for node, stays in zip(places, staying, strict=True) if stays]
    for k, sight in enumerate(watched):
        if not staying[k]:
            spot = vantage(stage.court, stage.sights[sight], rng, np.array(taken).reshape(-1, 2))
            places[k] = nearest_free(stage.grid, spot)
            taken.append(place(stage.grid, places[k]))
    return Scene(tuple(int(sight) for sight in watched), tuple(places))

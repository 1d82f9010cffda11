"""A planted swarm as the station would know it: positions, and overlaps that are off, or not known at all."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from covista_service.evaluation.planted.layout import KINDS, Labels, Layout, all_apart, all_in_one, planted
from covista_service.evaluation.planted.views import frustum_overlap, overlap
from covista_service.perception.camera import Floats

Story = Literal["ground", "wall", "corridor", "terrain", "one", "apart", "rendered"]
STORIES: tuple[Story, ...] = (*KINDS, "one", "apart")
# Numbers of robots, least and largest, of the classes of size.
CLASSES = ((6, 12), (13, 30), (31, 80), (81, 200))
# Swarms that are one group, or none.
_WHOLE = (6, 60)
# A block of seeds has every kind in every class of size, one swarm that is one group, and one of loners.
BLOCK = len(KINDS) * len(CLASSES) + 2


@dataclass(frozen=True, slots=True, eq=False)
class Swarm:
    """Robots to be grouped, and how they belong together in truth.

    `positions_m` (N, 3). `overlap` (N, N), row i: share of i's image seen by j, NaN where nobody has compared the
    two, 1 on the diagonal. `sharing` (N, N): do two have map points in common? False where nobody has compared them.
    `truth` (N,) labels. `kind` is the scene, or `one`, `apart` or `rendered`.
    """

    positions_m: Floats
    overlap: Floats
    sharing: NDArray[np.bool_]
    truth: Labels
    kind: Story
    seed: int

    def __len__(self) -> int:
        return len(self.truth)


@dataclass(frozen=True, slots=True, eq=False)
class Planting:
    """A swarm with its true overlaps (N, N), and those that poses and median depths predict, `frustum` (N, N)."""

    positions_m: Floats
    overlap: Floats
    frustum: Floats
    truth: Labels
    kind: Story
    seed: int


@dataclass(frozen=True, slots=True)
class Disturbance:
    """What stands between true overlaps and those that a station has.

    `noise`: standard deviation of the error of each q. `unknown`: the largest share of pairs that nobody has compared;
    the share is drawn for each swarm. `bias`: standard deviation of a factor that each robot puts on all its q.
    `predicted`: unknown pairs have the frustum's value with an error of `predicted_noise` instead.
    """

    noise: float = 0.05
    unknown: float = 0.3
    bias: float = 0.0
    predicted: bool = False
    predicted_noise: float = 0.15


def plant(seed: int, largest: int = CLASSES[-1][1]) -> Planting:
    """The swarm of a seed: its kind and class of size follow from the seed's place in its block."""
    rng = np.random.default_rng(seed)
    place = seed % BLOCK
    if place >= BLOCK - 2:
        kind, story = KINDS[int(rng.integers(len(KINDS)))], STORIES[len(KINDS) + place - (BLOCK - 2)]
        count = _between(rng, _WHOLE)
        layout = (all_in_one if story == "one" else all_apart)(rng, kind, count)
        return _known(layout, story, seed)
    kind = KINDS[place % len(KINDS)]
    least, most = CLASSES[place // len(KINDS)]
    most = largest if place // len(KINDS) == len(CLASSES) - 1 else most
    return _known(planted(rng, kind, _between(rng, (min(least, most), most))), kind, seed)


def disturbed(known: Planting, disturbance: Disturbance) -> Swarm:
    """The same swarm with errors, the same for the same seed."""
    rng = np.random.default_rng([known.seed, 1])
    count = len(known.truth)
    noise = rng.normal(size=(count, count))
    hidden = _mirrored(rng.random((count, count))) < rng.uniform(0, disturbance.unknown)
    factor = np.exp(disturbance.bias * rng.normal(size=count))
    measured = np.clip(known.overlap * np.outer(factor, factor) + disturbance.noise * noise, 0, 1)
    filling = (
        np.clip(known.frustum + disturbance.predicted_noise * noise * (known.frustum > 0), 0, 1)
        if disturbance.predicted
        else np.full_like(measured, np.nan)
    )
    overlap = np.where(hidden, filling, measured)
    np.fill_diagonal(overlap, 1.0)
    # Points that both see are in both maps, however far off a measured share of the image may be.
    common = (known.overlap > 0) & (known.overlap.T > 0)
    sharing = common & ~(hidden | hidden.T) | np.eye(count, dtype=np.bool_)
    return Swarm(known.positions_m, overlap, sharing, known.truth, known.kind, known.seed)


def _known(layout: Layout, kind: Story, seed: int) -> Planting:
    scene, views = layout.scene, layout.views
    return Planting(views.centres_m, overlap(scene, views), frustum_overlap(scene, views), layout.truth, kind, seed)


def _between(rng: np.random.Generator, bounds: tuple[int, int]) -> int:
    """A number of robots, every size's logarithm as likely as another's."""
    least, most = bounds
    return int(np.clip(np.floor(np.exp(rng.uniform(np.log(least), np.log(most + 1)))), least, most))


def _mirrored(matrix: Floats) -> Floats:
    upper = np.triu(matrix, 1)
    return upper + upper.T

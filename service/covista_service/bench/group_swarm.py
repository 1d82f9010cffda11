"""A swarm to group: planted groups at constant density, however many robots there are."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.distance import cdist

from covista_service.grouping import similarity
from covista_service.grouping.affinity import Affinity
from covista_service.grouping.k_means import Labels
from covista_service.grouping.similarity import Floats

ALPHA = 0.5
# Group by group at random; what each looks at lies that far from the next.
_SIZES = (2, 9)
_APART_M = 10.0
_SCATTER_M = 1.5
# So far robots stand from what they look at. What two look at must be closer than that for them to share anything: a
# robot has a dozen such neighbours.
_STAND_M = 3.0
_REACH_M = 10.0
_NOISE = 0.05


@dataclass(frozen=True, slots=True, eq=False)
class Swarm:
    """Positions and what robots look at (N, 3), metres; the noise of overlaps (N, N); the planted groups (N,)."""

    position_m: Floats
    target_m: Floats
    noise: Floats
    groups: Labels

    def __len__(self) -> int:
        return len(self.groups)

    @property
    def robots(self) -> list[str]:
        """Ids, in order."""
        return [f"r{row:05d}" for row in range(len(self))]

    @property
    def distance_m(self) -> Floats:
        """How far robots stand from each other (N, N)."""
        return np.asarray(cdist(self.position_m, self.position_m), np.float64)

    @property
    def overlap(self) -> Floats:
        """Row i: share of i's image that j sees (N, N): the less, the farther apart what they look at."""
        shared = 1 - cdist(self.target_m, self.target_m) / _REACH_M
        result: Floats = np.where(shared > 0, np.clip(shared + self.noise, 0.0, 1.0), 0.0)
        np.fill_diagonal(result, 1.0)
        return result

    def similarity(self) -> Floats:
        """Eqs. 15 and 16 (N, N), as by default."""
        return similarity.matrix(self.distance_m, self.overlap, ALPHA, "shared")

    def after(self, robot: int) -> Swarm:
        """The same swarm when a robot (its row) has gone over to the nearest other group."""
        away_m = np.linalg.norm(self.target_m - self.target_m[robot], axis=1)
        host = int(np.where(self.groups == self.groups[robot], np.inf, away_m).argmin())
        step_m = self.target_m[host] - self.target_m[robot]
        moved = np.eye(len(self))[robot][:, None] * step_m
        groups = self.groups.copy()
        groups[robot] = self.groups[host]
        return Swarm(self.position_m + moved, self.target_m + moved, self.noise, groups)


def plant(count: int, seed: int = 1) -> Swarm:
    """A swarm of `count` robots, the same for the same seed; as many robots per square metre whatever the count."""
    random = np.random.default_rng((seed, count))
    sizes = random.integers(*_SIZES, count)
    groups = np.repeat(np.arange(count), sizes)[:count]
    planted = int(groups.max()) + 1
    side = int(np.ceil(np.sqrt(planted)))
    field = random.permutation(side**2)[:planted]
    centre_m = _APART_M * (np.stack(np.divmod(field, side), axis=1) + random.uniform(-0.2, 0.2, (planted, 2)))
    target_m = np.zeros((count, 3))
    target_m[:, :2] = centre_m[groups] + random.normal(0.0, _SCATTER_M, (count, 2))
    angle = random.uniform(0, 2 * np.pi, count)
    stand_m = _STAND_M * np.stack([np.cos(angle), np.sin(angle), np.full(count, 0.3)], axis=1)
    # Robots come in no order.
    order: NDArray[np.intp] = random.permutation(count)
    noise = random.normal(0.0, _NOISE, (count, count))
    return Swarm((target_m + stand_m)[order], target_m[order], noise, groups[order])


def affinity(swarm: Swarm, known: NDArray[np.bool_] | None = None) -> Affinity:
    """What the station holds of a swarm; `known` (N, N): of which pairs it knows the overlap, None: of all."""
    held, robots, overlap = Affinity(), swarm.robots, swarm.overlap.tolist()
    for robot, place in zip(robots, swarm.position_m, strict=True):
        held.add(robot, place)
    rows, columns = np.nonzero(np.tril(np.ones((len(swarm), len(swarm)), np.bool_) if known is None else known, -1))
    for i, j in zip(rows.tolist(), columns.tolist(), strict=True):
        held.see(robots[i], robots[j], overlap[i][j], overlap[j][i])
    return held

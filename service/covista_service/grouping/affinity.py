"""The distances and overlaps of all robots, kept up to date row by row."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from covista_service.grouping import similarity as eqs
from covista_service.grouping.similarity import Floats, Sigma

_FIRST_ROOM = 16


class Affinity:
    """Positions, distances and overlaps of robots. One robot's news costs one row, whatever came before.

    Matrices are answered with rows and columns in the order of `robots` (sorted by id), as copies.
    """

    def __init__(self) -> None:
        self._slot: dict[str, int] = {}
        self._position_m = np.zeros((_FIRST_ROOM, 3))
        self._distance_m = np.zeros((_FIRST_ROOM, _FIRST_ROOM))
        self._overlap = np.full((_FIRST_ROOM, _FIRST_ROOM), np.nan)

    @property
    def robots(self) -> tuple[str, ...]:
        """Ids, sorted."""
        return tuple(sorted(self._slot))

    def __contains__(self, robot: object) -> bool:
        return robot in self._slot

    def __len__(self) -> int:
        return len(self._slot)

    def add(self, robot: str, position_m: Sequence[float] | Floats) -> None:
        """Let a robot in at `position_m` (3,), its overlaps unknown; raises ValueError if it is there already."""
        if robot in self._slot:
            raise ValueError(f"{robot} is there already")
        slot = len(self._slot)
        if slot == len(self._position_m):
            self._grow()
        self._slot[robot] = slot
        self._overlap[slot, : slot + 1] = self._overlap[: slot + 1, slot] = np.nan
        self._overlap[slot, slot] = 1.0
        self.move(robot, position_m)

    def remove(self, robot: str) -> None:
        """Forget a robot: the last slot moves into its place."""
        slot = self._slot.pop(robot)
        last = len(self._slot)
        if slot == last:
            return
        self._slot[next(name for name, held in self._slot.items() if held == last)] = slot
        self._position_m[slot] = self._position_m[last]
        for matrix in (self._distance_m, self._overlap):
            corner = matrix[last, last]
            matrix[slot, :last] = matrix[last, :last]
            matrix[:last, slot] = matrix[:last, last]
            matrix[slot, slot] = corner

    def move(self, robot: str, position_m: Sequence[float] | Floats) -> None:
        """Set a robot's position (3,) in metres."""
        slot, count = self._slot[robot], len(self._slot)
        self._position_m[slot] = position_m
        row = np.sqrt(np.square(self._position_m[:count] - self._position_m[slot]).sum(axis=1))
        self._distance_m[slot, :count] = self._distance_m[:count, slot] = row

    def see(self, a: str, b: str, q_a: float | None, q_b: float | None) -> None:
        """Set the share `q_a` of a's image that b sees, and `q_b` of b's that a sees; None where unknown."""
        i, j = self._slot[a], self._slot[b]
        self._overlap[i, j] = np.nan if q_a is None else q_a
        self._overlap[j, i] = np.nan if q_b is None else q_b

    @property
    def distance_m(self) -> Floats:
        """|r_i - r_j| (N, N) in metres."""
        return self._read(self._distance_m)

    @property
    def overlap(self) -> Floats:
        """Row i: share of i's image seen by j, (N, N); 1 on the diagonal, NaN where unknown."""
        return self._read(self._overlap)

    def closeness(self, sigma: Sigma = "std") -> Floats:
        """d_ij of Eq. 15, (N, N)."""
        return eqs.closeness(self.distance_m, sigma)

    def similarity(self, alpha: float, sigma: Sigma = "std") -> Floats:
        """s_ij of Eq. 16, (N, N)."""
        return eqs.similarity(self.overlap, self.closeness(sigma), alpha)

    def _read(self, matrix: Floats) -> Floats:
        order: NDArray[np.intp] = np.array([self._slot[robot] for robot in self.robots], np.intp)
        picked: Floats = matrix[np.ix_(order, order)]
        return picked

    def _grow(self) -> None:
        old, room = len(self._position_m), 2 * len(self._position_m)
        self._position_m = np.concatenate([self._position_m, np.zeros((old, 3))])
        for name in ("_distance_m", "_overlap"):
            larger = np.full((room, room), np.nan)
            larger[:old, :old] = getattr(self, name)
            setattr(self, name, larger)

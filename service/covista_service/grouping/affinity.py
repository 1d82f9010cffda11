"""The squared distances and overlaps of all robots, kept up to date row by row."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from covista_service.compiled import compiled
from covista_service.grouping import similarity as eqs
from covista_service.grouping.similarity import Floats, Sigma

_FIRST_ROOM = 16
# There is more room made by a quarter: pairs without robots take memory too, and are never given back.
_ROOM_SHARE = 4
# Columns whose distances are summed together.
_BLOCK = 32
# Farther than this no robot of a swarm is from the origin, and squares keep clear of overflow.
FARTHEST_M = 1e12


class Affinity:
    """Positions and overlaps of robots. One robot's news costs one row, whatever came before.

    What follows from all rows (closeness, similarity, their range sigma) is computed when it is read. Rows of the
    matrices are in the order of `robots` (sorted by id); they are copies.

    For the standard deviation of all distances, each row keeps the sums of its distances and of their squares by
    blocks of 32 columns. News of a robot sums up afresh its own row and, in all other rows, the one block that it
    stands in: nothing is ever added to or taken from a sum, so no error can gather, however long a swarm lives.

    `smoothing` is the weight of a pair's newest overlap in what similarity is made from; 1 takes each as it comes, and
    forgets what was before.
    """

    def __init__(self, smoothing: float = 1.0) -> None:
        self._smoothing = _checked_weight(smoothing)
        self._slot: dict[str, int] = {}
        self._position_m = np.zeros((_FIRST_ROOM, 3))
        # Beyond the last slot all is 0, so that blocks can be summed up whole.
        self._squared_m2 = np.zeros((_FIRST_ROOM, _FIRST_ROOM))
        self._overlap = np.full((_FIRST_ROOM, _FIRST_ROOM), np.nan)
        self._mutual = np.full((_FIRST_ROOM, _FIRST_ROOM), np.nan)
        # Pairs whose mutual overlap rests on one measurement.
        self._once = np.zeros((_FIRST_ROOM, _FIRST_ROOM), np.bool_)
        self._sums_m = np.zeros((_FIRST_ROOM, _blocks(_FIRST_ROOM), 2))

    @property
    def smoothing(self) -> float:
        """Weight of a pair's newest overlap."""
        return self._smoothing

    @smoothing.setter
    def smoothing(self, weight: float) -> None:
        self._smoothing = _checked_weight(weight)
        if weight == 1:
            self._mutual = (self._overlap + self._overlap.T) / 2

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
        place = _checked(robot, position_m)
        slot = len(self._slot)
        if slot == len(self._position_m):
            self._make_room(slot + slot // _ROOM_SHARE)
        self._slot[robot] = slot
        for matrix in (self._overlap, self._mutual):
            matrix[slot, : slot + 1] = matrix[: slot + 1, slot] = np.nan
            matrix[slot, slot] = 1.0
        self._once[slot] = self._once[:, slot] = False
        self._put(slot, place)

    def remove(self, robot: str) -> None:
        """Forget a robot: the last slot moves into its place."""
        slot = self._slot.pop(robot)
        last = len(self._slot)
        if slot != last:
            self._slot[next(name for name, held in self._slot.items() if held == last)] = slot
            self._position_m[slot] = self._position_m[last]
            for matrix in (self._overlap, self._mutual, self._once):
                corner = matrix[last, last]
                matrix[slot, :last] = matrix[last, :last]
                matrix[:last, slot] = matrix[:last, last]
                matrix[slot, slot] = corner
        self._squared_m2[last] = self._squared_m2[:, last] = 0.0
        _sum_block(self._squared_m2, last // _BLOCK, self._sums_m)
        if slot != last:
            self._put(slot, self._position_m[slot])

    def move(self, robot: str, position_m: Sequence[float] | Floats) -> None:
        """Set a robot's position (3,) in metres; ValueError where it is not three finite numbers below 10^12."""
        self._put(self._slot[robot], _checked(robot, position_m))

    def see(
        self,
        a: str,
        b: str,
        q_a: float | None,
        q_b: float | None,
        *,
        again: bool = False,
        moved: bool = False,
    ) -> float | None:
        """Set the share `q_a` of a's image that b sees, and `q_b` of b's that a sees; None where unknown.

        `again`: the same two pictures as before, read anew. They take the place of the last reading. `moved`: what has
        changed since the last reading is where the two stand. That is known and not measured, so it is not smoothed.
        What comes of it is their mutual overlap, smoothed. Raises ValueError for a robot and itself, and for a share
        that is none.
        """
        i, j = self._slot[a], self._slot[b]
        if i == j:
            raise ValueError(f"{a} shares all of its view with itself")
        for q in (q_a, q_b):
            if q is not None and not 0 <= q <= 1:
                raise ValueError(f"a share lies from 0 to 1, that of {a} and {b} does not: {q}")
        # Numbers of Python's own: an array's cost three times as much here.
        seen, seeing = (math.nan if q is None else float(q) for q in (q_a, q_b))
        former = (self._overlap.item(i, j) + self._overlap.item(j, i)) / 2
        self._overlap[i, j], self._overlap[j, i] = seen, seeing
        mutual, held = (seen + seeing) / 2, self._mutual.item(i, j)
        # NaN in the one or the other: there is nothing to smooth.
        fresh = math.isnan(held + mutual)
        same = again or moved
        if self._smoothing != 1 and not fresh and not (same and self._once[i, j]):
            weight = 1.0 if moved else self._smoothing
            held += weight * (mutual - (former if same else held))
            mutual = min(max(held, 0.0), 1.0)
        self._once[i, j] = self._once[j, i] = fresh or (same and bool(self._once[i, j]))
        self._mutual[i, j] = self._mutual[j, i] = mutual
        return None if math.isnan(mutual) else mutual

    def see_row(self, robot: str, others: Sequence[str], q: Floats, *, again: bool = False) -> None:
        """`see` for a robot and many others at once.

        `q` (n, 2) are the shares of its image that each of them sees, and of theirs that it sees; NaN where unknown.
        Raises ValueError as `see` does.
        """
        i, js = self._slot[robot], np.array([self._slot[other] for other in others], np.intp)
        if (js == i).any():
            raise ValueError(f"{robot} shares all of its view with itself")
        if ((q < 0) | (q > 1)).any():
            raise ValueError(f"a share lies from 0 to 1, those of {robot} do not")
        former = (self._overlap[i, js] + self._overlap[js, i]) / 2
        self._overlap[i, js], self._overlap[js, i] = q[:, 0], q[:, 1]
        mutual, held, once = q.sum(axis=1) / 2, self._mutual[i, js], self._once[i, js]
        fresh = np.isnan(held + mutual)
        if self._smoothing != 1:
            smooth = ~fresh & ~(once if again else False)
            drawn = held + self._smoothing * (mutual - (former if again else held))
            mutual = np.where(smooth, np.minimum(np.maximum(drawn, 0.0), 1.0), mutual)
        self._once[i, js] = self._once[js, i] = fresh | (again & once)
        self._mutual[i, js] = self._mutual[js, i] = mutual

    @property
    def squared_m2(self) -> Floats:
        """|r_i - r_j|^2 (N, N) in square metres."""
        return self._read(self._squared_m2)

    @property
    def distance_m(self) -> Floats:
        """|r_i - r_j| (N, N) in metres."""
        return np.sqrt(self.squared_m2)

    @property
    def overlap(self) -> Floats:
        """Row i: share of i's image seen by j, (N, N), as last told; 1 on the diagonal, NaN where unknown."""
        return self._read(self._overlap)

    @property
    def mutual(self) -> Floats:
        """(q_ij + q_ji)/2 (N, N), smoothed; NaN where unknown."""
        return self._read(self._mutual)

    def sigma_m(self, sigma: Sigma = "shared") -> float:
        """The range of Eq. 15 in metres: see `similarity.sigma_m`."""
        count = len(self._slot)
        if sigma == "std":
            total, squares = (self._sums_m[:count].sum(axis=(0, 1)) / 2).tolist()
            return eqs.spread_m(count * (count - 1) // 2, total, squares)
        if sigma == "shared":
            return eqs.shared_sigma_m(self._squared_m2[:count, :count], self._mutual[:count, :count])
        return eqs.check_sigma_m(sigma)

    def closeness(self, sigma: Sigma = "shared") -> Floats:
        """d_ij of Eq. 15, (N, N)."""
        return eqs.closeness(self.distance_m, self.sigma_m(sigma))

    def similarity(self, alpha: float, sigma: Sigma = "shared") -> Floats:
        """s_ij of Eq. 16, (N, N)."""
        self._sort()
        count = len(self._slot)
        mutual, squared_m2 = self._mutual[:count, :count], self._squared_m2[:count, :count]
        return eqs.similarity(mutual, squared_m2, alpha, self.sigma_m(sigma))

    def _put(self, slot: int, position_m: Floats) -> None:
        self._position_m[slot] = position_m
        _renew(self._position_m, len(self._slot), slot, self._squared_m2, self._sums_m)

    def _read(self, matrix: Floats) -> Floats:
        self._sort()
        count = len(self._slot)
        return matrix[:count, :count].copy()

    def _sort(self) -> None:
        """Bring slots into the order of ids, once after robots have come or gone, so that reading is copying."""
        order: NDArray[np.intp] = np.array([self._slot[robot] for robot in self.robots], np.intp)
        count = len(order)
        if np.array_equal(order, np.arange(count)):
            return
        self._slot = {robot: slot for slot, robot in enumerate(self.robots)}
        self._position_m[:count] = self._position_m[order]
        for matrix in (self._squared_m2, self._overlap, self._mutual, self._once):
            matrix[:count, :count] = matrix[np.ix_(order, order)]
        for block in range(_blocks(count)):
            _sum_block(self._squared_m2, block, self._sums_m)

    def _make_room(self, room: int) -> None:
        old = len(self._position_m)
        self._position_m = np.concatenate([self._position_m, np.zeros((room - old, 3))])
        for name, fill in (("_squared_m2", 0.0), ("_overlap", np.nan), ("_mutual", np.nan), ("_once", False)):
            larger = np.full((room, room), fill)
            larger[:old, :old] = getattr(self, name)
            setattr(self, name, larger)
        sums = np.zeros((room, _blocks(room), 2))
        sums[:old, : _blocks(old)] = self._sums_m
        self._sums_m = sums


def _checked(robot: str, position_m: Sequence[float] | Floats) -> Floats:
    place = np.asarray(position_m, np.float64)
    # NaN is not less than anything.
    if place.shape != (3,) or not (np.abs(place) < FARTHEST_M).all():
        raise ValueError(f"a position is three finite numbers below {FARTHEST_M:g} m, that of {robot} is {position_m}")
    return place


def _checked_weight(smoothing: float) -> float:
    if not 0 < smoothing <= 1:
        raise ValueError(f"the weight of the newest overlap is more than 0 and at most 1, not {smoothing}")
    return smoothing


def _blocks(count: int) -> int:
    return -(-count // _BLOCK)


@compiled
def _renew(position_m: Floats, count: int, slot: int, squared_m2: Floats, sums_m: Floats) -> None:
    """Distances of one robot to all others, and all sums that they enter."""
    for j in range(count):
        square = 0.0
        for axis in range(3):
            square += (position_m[slot, axis] - position_m[j, axis]) ** 2
        squared_m2[slot, j] = squared_m2[j, slot] = square
    for block in range(-(-count // _BLOCK)):
        _sum(squared_m2, slot, block, sums_m)
    for row in range(count):
        _sum(squared_m2, row, slot // _BLOCK, sums_m)


@compiled
def _sum_block(squared_m2: Floats, block: int, sums_m: Floats) -> None:
    for row in range(len(squared_m2)):
        _sum(squared_m2, row, block, sums_m)


@compiled
def _sum(squared_m2: Floats, row: int, block: int, sums_m: Floats) -> None:
    """Sum up distances and their squares of a row over one block."""
    total, squares = 0.0, 0.0
    for column in range(block * _BLOCK, min((block + 1) * _BLOCK, squared_m2.shape[1])):
        total += np.sqrt(squared_m2[row, column])
        squares += squared_m2[row, column]
    sums_m[row, block, 0] = total
    sums_m[row, block, 1] = squares

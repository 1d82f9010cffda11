"""What a station does with a swarm to group, as calls to time."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from itertools import cycle

import numpy as np

from covista_service.bench.group_swarm import ALPHA, Swarm, affinity, plant
from covista_service.grouping.affinity import Affinity
from covista_service.grouping.hysteresis import HysteresisOptions, weigh
from covista_service.grouping.selection import Criterion, SelectionOptions, choose, contributions
from covista_service.station.groups import Groups
from covista_service.station.options import StationOptions

Call = Callable[[], object]
# Whose news it is, one robot after the other; and how many neighbours tell of an overlap with it.
_NEWS = 5
_NEIGHBOURS = 30


@cache
def swarm_of(count: int) -> Swarm:
    """The swarm of so many robots."""
    return plant(count)


@cache
def affinity_of(count: int) -> Affinity:
    """What the station holds of the swarm of so many robots, all overlaps known."""
    return affinity(swarm_of(count))


def regrouping(count: int, criterion: Criterion) -> Call:
    """Groups and their number, nothing to start from."""
    S, options = swarm_of(count).similarity(), SelectionOptions(criterion=criterion)
    return lambda: choose(S, options)


def regrouping_after_news(count: int) -> list[Call]:
    """The same by gain from the last labels, each after another robot has gone over to the nearest other group."""
    swarm, options = swarm_of(count), SelectionOptions(criterion="gain")
    last = choose(swarm.similarity(), options).labels

    def after(robot: int) -> Call:
        S = swarm.after(robot).similarity()
        return lambda: choose(S, options, last)

    return [after(robot) for robot in range(min(_NEWS, count))]


def moving(count: int) -> Call:
    """The pose of one robot after the other."""
    swarm, held = swarm_of(count), affinity_of(count)
    robots = cycle(zip(swarm.robots, swarm.position_m, strict=True))

    def move() -> None:
        held.move(*next(robots))

    return move


def seeing(count: int) -> Call:
    """The overlaps of one robot after the other with its neighbours."""
    swarm, held = swarm_of(count), affinity_of(count)
    robots, overlap = swarm.robots, swarm.overlap
    near = swarm.distance_m.argsort(axis=1)[:, 1 : _NEIGHBOURS + 1]
    news = cycle(
        [(robots[i], robots[j], float(overlap[i, j]), float(overlap[j, i])) for j in near[i].tolist()]
        for i in range(min(_NEWS, count))
    )

    def see() -> None:
        for pair in next(news):
            held.see(*pair)

    return see


def reading(held: Affinity) -> Call:
    """The similarity matrix."""
    return lambda: held.similarity(ALPHA, "shared")


def weighing(count: int) -> Call:
    """Hysteresis where the groups proposed are those on show."""
    S, robots, options = swarm_of(count).similarity(), swarm_of(count).robots, SelectionOptions()
    labels = choose(S, options).labels
    named = np.array(robots)
    shown = {f"g{label}": frozenset(named[labels == label].tolist()) for label in range(int(labels.max()) + 1)}
    weighed = HysteresisOptions()
    return lambda: weigh(shown, robots, labels, contributions(S, options), 0, weighed)


def evaluating(count: int) -> Call:
    """A whole evaluation of the station: similarity, groups, hysteresis, labels; one robot has moved since the last."""
    swarm = swarm_of(count)
    robots, overlap = swarm.robots, swarm.overlap.tolist()
    held = Groups(StationOptions())
    for robot, place in zip(robots, swarm.position_m, strict=True):
        held.place(robot, place)
    for j in range(count):
        for i in range(j):
            held.see((robots[i], robots[j]), (overlap[i][j], overlap[j][i]))
    held.evaluate((), 0, 0, at_once=True)
    places = cycle(zip(robots, swarm.position_m, strict=True))

    def evaluate() -> None:
        held.place(*next(places))
        held.evaluate((), 0, 0, at_once=True)

    return evaluate

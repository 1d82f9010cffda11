"""What grouping costs, by the number of robots: time and memory."""

from __future__ import annotations

import tracemalloc
from collections.abc import Iterator, Mapping
from itertools import chain

import numpy as np

from covista_service.bench import group_calls
from covista_service.bench.group import REPORTED
from covista_service.bench.group_calls import Call, affinity_of
from covista_service.bench.group_swarm import ALPHA
from covista_service.bench.row import Row, alternately_ms, median, spread
from covista_service.bench.threads import one_thread
from covista_service.grouping.affinity import Affinity
from covista_service.grouping.selection import Criterion, SelectionOptions, choose

COUNTS, LONG_COUNTS = (5, 10, 20, 50, 100, 200, 500, 1000), (5, 10, 20, 50, 100, 200, 500, 1000, 2000)
# Criteria that look at eigenvectors, or values, for each number of groups: measured up to so many robots.
SLOW: tuple[Criterion, ...] = ("silhouette", "fiedler", "paper")
SLOW_UP_TO, LONG_SLOW_UP_TO = 100, 200
_ROUNDS, _LONG_ROUNDS = 5, 15
_MB = 1e6


def rows(long: bool) -> Iterator[Row]:
    """`group/cost_*_n5` and so on: a regrouping by each criterion, by gain also from the last labels after one's news.

    `read` is the similarity matrix, `row` one pose. `memory_held_n*` are the arrays of what the station holds of a
    swarm, by their sizes; `memory_regroup_n*` is the peak above that while the matrix is read and groups are chosen by
    adaptive, as tracemalloc traces it (compiled loops included). All on one core, all with no mark.
    """
    rounds = _LONG_ROUNDS if long else _ROUNDS
    with one_thread():
        for count in LONG_COUNTS if long else COUNTS:
            for case, calls in _calls(count, LONG_SLOW_UP_TO if long else SLOW_UP_TO).items():
                times = list(chain(*alternately_ms(calls, rounds)))
                yield _row(f"cost_{case}_n{count}", "ms", median(times), spread(times))
            yield _row(f"memory_held_n{count}", "MB", _held_bytes(affinity_of(count)) / _MB)
            yield _row(f"memory_regroup_n{count}", "MB", _peak_bytes(affinity_of(count)) / _MB)


def _calls(count: int, slow_up_to: int) -> Mapping[str, list[Call]]:
    slow = SLOW if count <= slow_up_to else ()
    return {
        "adaptive": [group_calls.regrouping(count, "adaptive")],
        "gain": [group_calls.regrouping(count, "gain")],
        "gain_warm": group_calls.regrouping_after_news(count),
        "read": [group_calls.reading(affinity_of(count))],
        "row": [group_calls.moving(count)],
        **{criterion: [group_calls.regrouping(count, criterion)] for criterion in slow},
    }


def _row(case: str, unit: str, figure: float, quartiles: float | None = None) -> Row:
    return Row("group", case, figure, quartiles, unit, None, None, REPORTED, True)


def _held_bytes(affinity: Affinity) -> int:
    return sum(each.nbytes for each in vars(affinity).values() if isinstance(each, np.ndarray))


def _peak_bytes(affinity: Affinity) -> int:
    tracemalloc.start()
    try:
        choose(affinity.similarity(ALPHA, "shared"), SelectionOptions())
        return tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()

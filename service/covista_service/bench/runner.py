"""The benchmarks by name."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from itertools import chain

from covista_service.bench import (
    dashboard,
    dense,
    group,
    group_costs,
    history,
    ingest,
    latency,
    memory,
    overload,
    planes,
    predict_planes,
    predict_poses,
    predict_surfaces,
    rest,
    restart,
    scale,
    soak,
    sse,
    surface,
    survey,
)
from covista_service.bench.row import Row

Bench = Callable[[bool], Iterator[Row]]
# What makes up each of them, in order.
BENCHES: Mapping[str, Sequence[Bench]] = {
    "survey": (survey.rows, surface.rows, dense.rows),
    "planes": (planes.rows,),
    "predict": (predict_planes.rows, predict_surfaces.rows, predict_poses.rows),
    "group": (group.rows, group_costs.rows),
    "latency": (latency.rows,),
    "ingest": (ingest.rows,),
    "scale": (scale.rows,),
    "memory": (memory.rows,),
    "overload": (overload.rows,),
    "rest": (rest.rows,),
    "history": (history.rows,),
    "restart": (restart.rows,),
    "sse": (sse.rows,),
    "dashboard": (dashboard.rows,),
    "soak": (soak.rows,),
}
# What takes long, or needs more than others, and so runs only when it is named.
ON_REQUEST = frozenset({"dashboard", "soak"})


class UnknownBenchError(ValueError):
    """A name that no benchmark has."""


def run(names: Sequence[str], long: bool) -> Iterator[Row]:
    """Rows of the benchmarks named, without a name of all but those `ON_REQUEST`; a name is `bench` or `bench/case`.

    A bench ends when all cases asked for are there. Raises UnknownBenchError: for a bench before anything runs, for a
    case when its bench is through.
    """
    asked = {name: set[str]() for name in BENCHES if name not in ON_REQUEST} if not names else _by_bench(names)
    for bench, cases in asked.items():
        absent = set(cases)
        for row in chain.from_iterable(part(long) for part in BENCHES[bench]):
            if not cases or row.case in absent:
                yield row
            absent.discard(row.case)
            if cases and not absent:
                break
        if absent:
            raise UnknownBenchError(f"benchmark {bench} has no case {min(absent)!r}")


def _by_bench(names: Sequence[str]) -> dict[str, set[str]]:
    """Cases asked for of each bench; none stands for all."""
    asked: dict[str, set[str]] = {}
    for name in names:
        bench, _, case = name.partition("/")
        if bench not in BENCHES:
            raise UnknownBenchError(f"there is no benchmark {bench!r}, but {', '.join(BENCHES)}")
        if not case:
            asked[bench] = set()
        elif asked.get(bench, {case}):
            asked.setdefault(bench, set()).add(case)
    return asked

"""The benchmarks by name."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from itertools import chain

from covista_service.bench import dense, latency, survey
from covista_service.bench.row import Row

Bench = Callable[[bool], Iterator[Row]]


def together(*benches: Bench) -> Bench:
    """One bench of several, one after the other."""
    return lambda long: chain.from_iterable(bench(long) for bench in benches)


BENCHES: Mapping[str, Bench] = {"survey": together(survey.rows, dense.rows), "latency": latency.rows}


class UnknownBenchError(ValueError):
    """A name that no benchmark has."""


def run(names: Sequence[str], long: bool) -> Iterator[Row]:
    """Rows of the benchmarks named, of all without a name; a name is `bench` or `bench/case`.

    Raises UnknownBenchError: for a bench before anything runs, for a case when its bench is through.
    """
    asked = {name: set[str]() for name in BENCHES} if not names else _by_bench(names)
    for bench, cases in asked.items():
        found = [row for row in BENCHES[bench](long) if not cases or row.case in cases]
        absent = cases - {row.case for row in found}
        if absent:
            raise UnknownBenchError(f"benchmark {bench} has no case {min(absent)!r}")
        yield from found


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

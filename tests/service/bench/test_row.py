from __future__ import annotations

from collections.abc import Iterator

import pytest
from covista_service.bench import runner
from covista_service.bench.row import Row, alternately_ms, median, spread


def row(bench: str, case: str) -> Row:
    return Row(bench, case, 1.0, 0.1, "ms", None, None, "<= 2 ms", True)


@pytest.fixture
def benches(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(
        runner,
        "BENCHES",
        {
            "survey": (
                lambda long: iter([row("survey", "cold_500")]),
                lambda long: iter([row("survey", "cold_1000")]),
            ),
            "latency": (lambda long: iter([row("latency", "p50")]),),
        },
    )


@pytest.mark.usefixtures("benches")
@pytest.mark.parametrize(
    ("names", "cases"),
    [
        ((), ["cold_500", "cold_1000", "p50"]),
        (("latency",), ["p50"]),
        (("survey/cold_500",), ["cold_500"]),
        (("survey/cold_500", "survey"), ["cold_500", "cold_1000"]),
        (("survey", "survey/cold_500"), ["cold_500", "cold_1000"]),
    ],
)
def test_names_choose_benches_and_cases(names: tuple[str, ...], cases: list[str]) -> None:
    assert [each.case for each in runner.run(names, long=False)] == cases


def test_a_bench_ends_when_all_cases_asked_for_are_there(monkeypatch: pytest.MonkeyPatch) -> None:
    def never(long: bool) -> Iterator[Row]:
        raise AssertionError("nobody asked for more")

    monkeypatch.setattr(runner, "BENCHES", {"survey": (lambda long: iter([row("survey", "cold_500")]), never)})
    assert [each.case for each in runner.run(("survey/cold_500",), long=False)] == ["cold_500"]


@pytest.mark.usefixtures("benches")
@pytest.mark.parametrize("name", ["speed", "survey/warm"])
def test_a_name_that_nothing_has_is_refused(name: str) -> None:
    with pytest.raises(runner.UnknownBenchError):
        list(runner.run((name,), long=False))


def test_calls_take_turns_after_a_round_that_does_not_count() -> None:
    calls: list[str] = []
    times = alternately_ms([lambda: calls.append("a"), lambda: calls.append("b")], rounds=3)
    assert calls == ["a", "b"] * 4
    assert [len(taken) for taken in times] == [3, 3]


def test_median_and_distance_of_the_quartiles() -> None:
    assert median([3.0, 1.0, 2.0]) == 2.0
    assert spread([0.0, 1.0, 2.0, 3.0, 4.0]) == 2.0
    assert set(row("survey", "x").as_json()) == {
        "bench", "case", "median", "spread", "unit", "peer", "peer_median", "mark", "holds",
    }  # fmt: skip

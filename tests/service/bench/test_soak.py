from __future__ import annotations

import json
from pathlib import Path

import pytest
import typer
from covista_schemas.errors import CovistaError
from covista_service.bench import runner, soak
from covista_service.bench.command import bench
from covista_service.bench.rig import LoadError
from covista_service.bench.soak import Soaked
from covista_service.bench.soak_accounts import Accounts, accounts_of
from covista_service.bench.soak_books import Sent
from covista_service.bench.soak_judge import LIMITS, Judged, seen_in
from covista_service.bench.soak_plot import Panel, drawn
from covista_service.bench.soak_station import Look, quantile_s
from covista_service.bench.trend import trend_of

INF = float("inf")


def look(at_s: float, *counts: float, resident_mb: float = 300.0) -> Look:
    """A station with keyframes in buckets up to .1, .2 and any number of seconds."""
    buckets = tuple(zip((0.1, 0.2, INF), counts or (0, 0, 0), strict=True))
    return Look(at_s, resident_mb, 60, 30, 4.0, 1.0, 12, 9, buckets)


def test_a_latency_lies_within_its_bucket_and_is_of_the_keyframes_between_two_looks() -> None:
    before, after = look(0, 10, 10, 10), look(1, 20, 30, 30)
    assert quantile_s(before, after, 0.25) == pytest.approx(0.05)
    assert quantile_s(before, after, 0.75) == pytest.approx(0.15)
    assert quantile_s(before, after, 1.0) == pytest.approx(0.2)
    assert quantile_s(after, after, 0.5) is None
    assert quantile_s(before, look(1, 10, 10, 11), 0.5) == 0.2


SAMPLES = {
    "covista_messages_total{fate=received,topic=keyframe}": 10.0,
    "covista_messages_total{fate=received,topic=pose}": 100.0,
    "covista_messages_total{fate=used,topic=keyframe}": 6.0,
    "covista_messages_total{fate=used,topic=pose}": 50.0,
    "covista_messages_total{fate=replaced,topic=pose}": 10.0,
    "covista_messages_total{fate=duplicate,topic=keyframe}": 1.0,
    "covista_dropped_total{reason=malformed,topic=keyframe}": 3.0,
    "covista_dropped_total{reason=malformed,topic=pose}": 40.0,
    "covista_messages_waiting{topic=keyframe}": 0.0,
    "covista_messages_missing{topic=pose}": 5.0,
}
# 110 received, of which 1 is a duplicate and 43 are garbage; 5 are missing.
HEARD = 110 - 1 - 43 + 5


def test_accounts_add_up_to_what_was_sent_or_say_how_many_messages_do_not() -> None:
    assert accounts_of(SAMPLES, Sent(HEARD, HEARD, 43)).unaccounted == 0
    assert accounts_of(SAMPLES, Sent(HEARD - 3, HEARD + 3, 43)).unaccounted == 0
    assert accounts_of(SAMPLES, Sent(HEARD + 1, HEARD + 1, 43)).unaccounted == 1
    assert accounts_of(SAMPLES, Sent(HEARD - 2, HEARD - 2, 43)).unaccounted == 2
    lost = SAMPLES | {"covista_messages_total{fate=used,topic=pose}": 49.0}
    assert accounts_of(lost, Sent(HEARD, HEARD, 43)).unaccounted == 1


def enter(soaked: Soaked, growth_mb_per_s: float = 0.0) -> None:
    """A soak of half an hour, a look every ten seconds."""
    soaked.looks += [
        look(t, 6 * t, 7 * t, 7 * t, resident_mb=300 + growth_mb_per_s * t + 0.01 * (t % 3)) for t in range(0, 1800, 10)
    ]
    soaked.accounts, soaked.happened, soaked.status = Accounts(10, 10, 0, 0, 0, Sent(10, 10)), {"kill": 3}, 0
    soaked.compared = 4


@pytest.fixture
def out(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv(soak.OUT, str(tmp_path / "out"))
    return tmp_path / "out"


@pytest.mark.parametrize(("growth_mb_per_s", "holds"), [(0.0, True), (0.5, False)])
def test_what_grows_is_found_and_the_rest_is_flat(
    out: Path, monkeypatch: pytest.MonkeyPatch, growth_mb_per_s: float, holds: bool
) -> None:
    monkeypatch.setattr(soak, "_soak", lambda soaked, seconds, out: enter(soaked, growth_mb_per_s))
    rows = {row.case: row for row in soak.rows(True)}
    assert rows.keys() > LIMITS.keys()
    assert rows["resident"].holds is holds
    assert all(row.holds for case, row in rows.items() if case != "resident")
    told = json.loads((out / "soak.json").read_text())
    assert (len(told["looks"]), len(told["rows"])) == (180, len(rows))
    assert (out / "soak.png").read_bytes().startswith(b"\x89PNG")


def test_of_a_few_minutes_accounts_alone_are_judged(out: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(soak, "_soak", lambda soaked, seconds, out: enter(soaked, 0.5))
    cases = {row.case for row in soak.rows(False)}
    assert cases.isdisjoint(LIMITS)
    assert {"unaccounted", "lost_unkilled", "died_unasked", "received", "compared"} < cases


@pytest.mark.parametrize(
    ("changed", "case"),
    [
        ({"off": 1}, "lost_unkilled"),
        ({"compared": 0}, "compared"),
        ({"died": 1}, "died_unasked"),
        ({"tracebacks": 1}, "tracebacks"),
        ({"status": None}, "status"),
        ({"happened": {}}, "happened"),
        ({"accounts": Accounts(0, 0, 0, 0, 0, Sent())}, "received"),
        ({"accounts": Accounts(10, 9, 0, 0, 0, Sent(10, 10))}, "unaccounted"),
    ],
)
def test_what_must_not_be_fails_the_command_and_is_written_down(
    out: Path, monkeypatch: pytest.MonkeyPatch, changed: dict[str, object], case: str
) -> None:
    def broken(soaked: Soaked, seconds: float, out: Path | None) -> None:
        enter(soaked)
        for name, value in changed.items():
            setattr(soaked, name, value)

    monkeypatch.setattr(soak, "_soak", broken)
    bench(["soak"])
    with pytest.raises(typer.Exit) as ended:
        bench(["soak"], strict=True)
    assert ended.value.exit_code == 1
    told = json.loads((out / "soak.json").read_text())["rows"]
    assert [row["case"] for row in told if not row["holds"]] == [case]


def test_a_soak_of_which_all_holds_does_not_fail_the_command(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(soak, "_soak", lambda soaked, seconds, out: enter(soaked))
    bench(["soak"], strict=True)


def test_a_soak_that_breaks_leaves_what_it_has_seen(out: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def broken(soaked: Soaked, seconds: float, out: Path | None) -> None:
        soaked.looks += [look(t) for t in range(5)]
        raise LoadError("the station does not tell its metrics")

    monkeypatch.setattr(soak, "_soak", broken)
    with pytest.raises(typer.Exit):
        bench(["soak"])
    told = json.loads((out / "soak.json").read_text())
    assert (len(told["looks"]), told["rows"], told["accounts"]) == (5, [], None)
    assert (out / "soak.png").exists()


def test_latencies_are_of_a_minute_each() -> None:
    seen = seen_in([look(t, 6 * t, 7 * t, 7 * t) for t in range(610)])
    assert len(seen["p50"].points) == len(seen["p50"].beside) == 10
    assert all(0 < value <= 200 for _, value in seen["p99"].points)


def test_a_panel_is_drawn_with_and_without_a_trend() -> None:
    points = [(float(t), 3.0) for t in range(20)]
    files = Judged("files", trend_of(points), LIMITS["files"])
    assert drawn([Panel("files", points, files), Panel("robots", points)]).startswith(b"\x89PNG")


@pytest.mark.parametrize("minutes", ["0", "nan", "half"])
def test_a_time_that_is_none_is_refused(monkeypatch: pytest.MonkeyPatch, minutes: str) -> None:
    monkeypatch.setenv(soak.MINUTES, minutes)
    with pytest.raises(CovistaError, match=soak.MINUTES):
        list(soak.rows(False))


def test_it_runs_only_when_it_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(runner, "BENCHES", {"soak": (lambda long: iter([1 / 0]),), "sse": ()})
    assert list(runner.run((), long=False)) == []
    with pytest.raises(ZeroDivisionError):
        list(runner.run(("soak",), long=False))

from __future__ import annotations

import json
from pathlib import Path

import pytest
from covista_schemas.errors import CovistaError
from covista_service.bench import runner, soak
from covista_service.bench.memory import trend_of
from covista_service.bench.soak import Accounts, Soaked, accounts_of, series_of
from covista_service.bench.soak_plot import Panel, drawn
from covista_service.bench.soak_rover import Told
from covista_service.bench.soak_station import Look, quantile_s
from covista_service.bench.soak_swarm import LAST_S, Sent, bounds

INF = float("inf")


def look(at_s: float, *counts: float, resident_mb: float = 300.0) -> Look:
    """A station with keyframes in buckets up to .1, .2 and any number of seconds."""
    buckets = tuple(zip((0.1, 0.2, INF), counts or (0, 0, 0), strict=True))
    return Look(at_s, resident_mb, 60, 30, 4.0, 1.0, 12, buckets)


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


def test_a_boot_that_left_in_order_has_sent_what_it_says_and_one_that_was_killed_nearly_that() -> None:
    told = [(at_s, Told(round(at_s), round(2 * at_s))) for at_s in (8.0, 9.5, 9.9)]
    least, most = bounds(told, 10.0)
    assert least == 24
    assert most >= 30
    assert bounds([*told, (10.0, Told(11, 21, over=True))], 10.0) == (32, 32)
    assert bounds([], LAST_S / 2)[0] == 0


def soaked(growth_mb_per_s: float = 0.0) -> Soaked:
    looks = tuple(
        look(t, 6 * t, 7 * t, 7 * t, resident_mb=300 + growth_mb_per_s * t + 0.01 * (t % 3)) for t in range(120)
    )
    return Soaked(looks, Accounts(10, 10, 0, 0, 0, Sent(10, 10)), {"kill": 3}, 0, 0)


@pytest.mark.parametrize(("growth_mb_per_s", "holds"), [(0.0, True), (0.5, False)])
def test_what_grows_is_found_and_the_rest_is_flat(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, growth_mb_per_s: float, holds: bool
) -> None:
    monkeypatch.setattr(soak, "_soaked", lambda seconds, out: soaked(growth_mb_per_s))
    monkeypatch.setenv(soak.OUT, str(tmp_path / "out"))
    rows = {row.case: row for row in soak.rows(False)}
    assert rows["resident"].holds is holds
    assert all(row.holds for case, row in rows.items() if case != "resident")
    told = json.loads((tmp_path / "out" / "soak.json").read_text())
    assert len(told["looks"]) == 120
    assert (tmp_path / "out" / "soak.png").read_bytes().startswith(b"\x89PNG")


def test_latencies_are_of_ten_seconds_each() -> None:
    series = series_of(soaked().looks)
    assert len(series["p50 ms"]) == 11
    assert all(0 < value <= 200 for _, value in series["p99 ms"])


def test_a_panel_is_drawn_with_and_without_a_trend() -> None:
    points = [(float(t), 3.0) for t in range(20)]
    assert drawn([Panel("files", points, trend_of(points)), Panel("robots", points)]).startswith(b"\x89PNG")


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

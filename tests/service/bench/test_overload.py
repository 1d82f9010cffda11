from __future__ import annotations

import pytest
from covista_schemas.reports import Counters, RobotReport
from covista_service.bench.load import Sent
from covista_service.bench.overload import SHORT, Ordeal, astray, recovery_s, rows_of
from covista_service.bench.prober import Answers

from tests.clients.ground import report_on

IN_TIME = 500.0


def every_100_ms(until_s: float, late_until_s: float) -> list[tuple[float, float]]:
    return [(100 + 0.1 * k, 2000.0 if 0.1 * k < late_until_s else 50.0) for k in range(round(10 * until_s))]


@pytest.mark.parametrize(("late_until_s", "expected"), [(0.0, 0.0), (0.4, 0.0), (1.0, 1.0), (2.7, 3.0), (4.9, None)])
def test_a_station_has_recovered_when_most_keyframes_are_in_time_again(
    late_until_s: float, expected: float | None
) -> None:
    assert recovery_s(every_100_ms(5.0, late_until_s), 100.0, 5.0, IN_TIME) == expected


def test_one_late_keyframe_is_not_a_relapse() -> None:
    latencies = [*every_100_ms(5.0, 1.0), (104.5, 3000.0)]
    assert recovery_s(latencies, 100.0, 5.0, IN_TIME) == 1.0


def test_a_second_without_keyframes_in_the_groups_is_late() -> None:
    latencies = [each for each in every_100_ms(5.0, 0.0) if not 102 <= each[0] < 103]
    assert recovery_s(latencies, 100.0, 5.0, IN_TIME) == 3.0
    assert recovery_s([], 100.0, 5.0, IN_TIME) is None


def test_what_arrived_before_the_end_is_no_news() -> None:
    late_before = [(90 + 0.1 * k, 9000.0) for k in range(100)]
    assert recovery_s([*late_before, *every_100_ms(5.0, 0.0)], 100.0, 5.0, IN_TIME) == 0.0


def report(keyframes: Counters, poses: Counters) -> RobotReport:
    return report_on("b1", keyframes=keyframes, poses=poses)


def test_what_is_on_an_account_is_not_astray() -> None:
    keyframes = Counters(received=7, used=3, replaced=2, duplicate=1, waiting=1, missing=4)
    poses = Counters(received=5, used=3, dropped={"bad_pose": 2})
    assert astray([report(keyframes, poses)] * 2, Sent(22, 10, 0.0)) == 0


@pytest.mark.parametrize(
    ("keyframes", "poses", "expected"),
    [
        (Counters(received=9, used=9), Counters(received=10, used=10), 1),
        (Counters(received=11, used=11), Counters(received=10, used=10), 1),
        (Counters(received=10, used=10), Counters(received=10, used=7), 3),
        (Counters(received=8, used=8, missing=2), Counters(), 10),
    ],
)
def test_what_has_no_fate_or_never_came_is_astray(keyframes: Counters, poses: Counters, expected: int) -> None:
    assert astray([report(keyframes, poses)], Sent(10, 10, 0.0)) == expected


@pytest.mark.parametrize(("sent_per_s", "holds"), [(200.0, True), (180.0, True), (170.0, False), (40.0, False)])
def test_an_overload_that_was_none_shows_nothing(sent_per_s: float, holds: bool) -> None:
    answers = Answers((10.0, 20.0), 0)
    found = Ordeal(40.0, sent_per_s, answers, answers, None, 0, 0, 1.0)
    rows = {row.case: row for row in rows_of(found, SHORT)}
    assert rows["sent"].holds is holds
    assert (rows["recovery"].median, rows["recovery"].holds) == (SHORT.after_s, False)

from __future__ import annotations

import pytest
from covista_service.bench.rig import Window
from covista_service.bench.scale import Size, against


def window(surveys: int, cpu_s: float, regrouping_s: float = 0.0) -> Window:
    return Window(
        seconds=2.0,
        keyframes=10,
        poses=0,
        behind_s=0.0,
        surveys=surveys + 6,
        sweeps=6,
        cpu_s=cpu_s,
        regrouping_s=regrouping_s,
        latencies_ms=(40.0, 60.0, 50.0),
        turns_ms=(1.0,),
    )


def size(robots: int, surveys: int, cpu_s: float, regrouping_s: float = 0.0, *, settled: bool = True) -> Size:
    each = window(surveys, cpu_s, regrouping_s)
    return Size(robots, settled, (each, each, each), each)


def test_work_is_counted_by_keyframe_and_regrouping_apart() -> None:
    measured = size(50, 40, 1.5, 0.5)
    assert measured.surveys == [4.0] * 3
    assert measured.sweeps == [3.0] * 3
    assert measured.cpu_ms == pytest.approx([100.0] * 3)
    assert measured.regrouping_ms == pytest.approx([50.0] * 3)
    assert measured.latency_ms(0.5) == [50.0] * 3
    assert measured.saturated.surveyed_per_s == 1.5


@pytest.mark.parametrize(
    ("surveys", "cpu_s", "holds"),
    [(40, 1.0, (True, True)), (47, 1.9, (True, True)), (49, 2.1, (False, False)), (31, 0.1, (False, True))],
)
def test_the_largest_swarm_is_held_against_the_smallest(surveys: int, cpu_s: float, holds: tuple[bool, bool]) -> None:
    found = list(against(size(1000, surveys, cpu_s), size(50, 40, 1.0)))
    assert [row.case for row in found] == ["surveys", "cpu"]
    assert tuple(row.holds for row in found) == holds
    assert found[0].median == pytest.approx(surveys / 40)
    assert found[1].median == pytest.approx(cpu_s)


def test_what_a_station_was_behind_with_says_nothing() -> None:
    found = against(size(1000, 40, 1.0, settled=False), size(50, 40, 1.0))
    assert not any(row.holds for row in found)

import json
from datetime import UTC, datetime, timedelta, timezone

import pytest
from covista_schemas.reports import (
    GroupBounds,
    GroupsReport,
    LiveSettings,
    OwnGroupReport,
    PairSummary,
    Score,
    time_of,
)
from hypothesis import given
from hypothesis import strategies as st
from pydantic import ValidationError

from tests.schemas.strategies import times_ns


def own_group(**changed: object) -> OwnGroupReport:
    values = {"robot": "r1", "label": "g1", "robots": ["r1", "r2"], "revision": 3, "time": time_of(0)}
    return OwnGroupReport.model_validate(values | changed)


@given(times_ns)
def test_time_is_utc_to_the_microsecond(time_ns: int) -> None:
    time = time_of(time_ns)
    assert time.tzinfo is UTC
    since = time - datetime(1970, 1, 1, tzinfo=UTC)
    assert since // timedelta(microseconds=1) == time_ns // 1000


def test_times_are_told_in_utc() -> None:
    noon_in_delhi = datetime(2026, 1, 1, 12, tzinfo=timezone(timedelta(hours=5, minutes=30)))
    assert json.loads(own_group(time=noon_in_delhi).model_dump_json())["time"] == "2026-01-01T06:30:00Z"


def test_readers_pass_over_what_later_stations_say() -> None:
    report = GroupsReport(
        revision=1,
        time=time_of(0),
        groups=[],
        ungrouped=[],
        criterion="fiedler",
        scores=[Score(groups=1, score=0.5)],
        settings=LiveSettings(),
    )
    later = json.loads(report.model_dump_json())
    later |= {"mood": "good"}
    later["settings"] |= {"weather": "fine"}
    assert GroupsReport.read(json.dumps(later)) == report
    # What people set is read strictly: a slip of the pen is not passed over.
    with pytest.raises(ValidationError):
        LiveSettings.model_validate(later["settings"])


def test_no_number_that_is_not_finite_leaves() -> None:
    for bad in (float("nan"), float("inf")):
        with pytest.raises(ValidationError):
            Score(groups=1, score=bad)


def test_ids_and_shares_are_what_they_say() -> None:
    with pytest.raises(ValidationError):
        own_group(robot="r1\n")
    pair = {"a": "r1", "b": "r2", "overlap_b": None, "found_by": "image", "outcome": "measured", "inliers": 9}
    pair |= {"pose_source": None, "age_s": None, "keyframes": None}
    assert PairSummary.model_validate(pair | {"overlap_a": 1.0}).overlap_a == 1
    with pytest.raises(ValidationError):
        PairSummary.model_validate(pair | {"overlap_a": 1.1})


@given(st.one_of(st.just("auto"), st.integers(1, 100), st.just({"min": 2, "max": 5})))
def test_settings_come_back_as_they_went(groups: object) -> None:
    settings = LiveSettings.model_validate({"groups": groups, "sigma": 2.5, "alpha": 0.25})
    assert LiveSettings.model_validate_json(settings.model_dump_json()) == settings


@pytest.mark.parametrize(
    "wrong",
    [
        {"alpha": 1.5},
        {"groups": 0},
        {"groups": {"min": 3, "max": 2}},
        {"sigma": 0},
        {"criterion": "x"},
        {"colour": 1},
        {"grouping": "x"},
        {"min_group_size": 0},
        {"hysteresis": {"gain": -1}},
        {"hysteresis": {"smoothing": 0}},
        {"hysteresis": {"x": 1}},
    ],
)
def test_settings_that_make_no_sense_are_refused(wrong: dict[str, object]) -> None:
    with pytest.raises(ValidationError):
        LiveSettings.model_validate(wrong)


def test_bounds_may_be_equal() -> None:
    assert GroupBounds(min=3, max=3)

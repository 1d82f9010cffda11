"""What is worth a line, at which level, and whom it is about."""

import logging

import pytest
from covista_schemas.reports import EventKind
from covista_service.station.events import (
    Event,
    FeaturesExtracted,
    Happened,
    KeyframeId,
    MessageDropped,
    MessagesReceived,
    SurveyDone,
    Tick,
    TokenSeen,
)
from covista_service.telemetry.journal import note_effect, note_event

from tests.service.station.scenes import FEATURES, comparison

R1, R2 = KeyframeId("r1", "b0", 3), KeyframeId("r2", "b1", 4)
DROPPED = MessageDropped("r1", "pose", "bad_pose", "pose: no pose given", 0, counted=False, count=7)


@pytest.fixture
def heard(caplog: pytest.LogCaptureFixture) -> pytest.LogCaptureFixture:
    caplog.set_level(logging.DEBUG, "covista_service.station")
    return caplog


def told(heard: pytest.LogCaptureFixture) -> list[tuple[int, str, dict]]:
    return [(record.levelno, record.msg, record.fields) for record in heard.records]


def test_a_dropped_message_is_a_warning_with_robot_and_reason(heard: pytest.LogCaptureFixture) -> None:
    note_event(DROPPED)
    note_event(FeaturesExtracted(R1, None, None, "bad_image", "image: cannot be decoded"))
    fields = {"robot": "r1", "topic": "pose", "reason": "bad_pose", "count": 7, "said": "pose: no pose given"}
    other = {"robot": "r1", "topic": "keyframe", "reason": "bad_image", "count": 1, "said": "image: cannot be decoded"}
    assert told(heard) == [(logging.WARNING, "dropped", fields), (logging.WARNING, "dropped", other)]


def test_a_survey_is_for_who_looks_closely(heard: pytest.LogCaptureFixture) -> None:
    note_event(SurveyDone(R1, R2, comparison(9)))
    note_event(SurveyDone(R1, R2, None, "surveying a pair failed: MemoryError"))
    levels = {record.levelno for record in heard.records}
    assert levels == {logging.DEBUG}
    assert [record.fields["pair"] for record in heard.records] == ["r1/r2", "r1/r2"]
    assert [record.fields["outcome"] for record in heard.records] == [str(comparison(9).outcome), "failed"]
    assert heard.records[0].fields["keyframes"] == "b0/3 b1/4"


@pytest.mark.parametrize(
    "event",
    [
        Tick(),
        TokenSeen("r1", "b0"),
        MessagesReceived("r1", "pose", (("b0", 0),), None, 0),
        FeaturesExtracted(R1, FEATURES),
    ],
)
def test_what_goes_well_is_no_line(event: Event, heard: pytest.LogCaptureFixture) -> None:
    note_event(event)
    assert told(heard) == []


@pytest.mark.parametrize(
    ("kind", "level"),
    [
        (EventKind.STATUS, logging.INFO),
        (EventKind.SETTINGS, logging.INFO),
        (EventKind.WARNING, logging.WARNING),
        (EventKind.JOIN, logging.DEBUG),
        (EventKind.LEAVE, logging.DEBUG),
        (EventKind.SPLIT, logging.DEBUG),
        (EventKind.MERGE, logging.DEBUG),
        (EventKind.MOVED, logging.DEBUG),
    ],
)
@pytest.mark.parametrize(
    ("robots", "whom"),
    [((), {}), (("a",), {"robot": "a"}), (("a", "b"), {"pair": "a/b"}), (("a", "b", "c"), {"robots": 3})],
)
def test_what_happened_has_its_level_and_whom_it_is_about(
    kind: EventKind, level: int, robots: tuple[str, ...], whom: dict, heard: pytest.LogCaptureFixture
) -> None:
    note_effect(Happened(kind, 0, "something", robots))
    assert told(heard) == [(level, str(kind), {**whom, "said": "something"})]


def test_a_revision_of_the_groups_is_a_short_line_however_many_robots_there_are(
    heard: pytest.LogCaptureFixture,
) -> None:
    everyone = tuple(f"r{number}" for number in range(1000))
    note_effect(Happened(EventKind.GROUPS, 0, ", ".join(everyone), everyone, ("g1", "g2"), 6, 7))
    assert told(heard) == [(logging.INFO, "groups", {"revision": 7, "groups": 2, "robots": 1000})]


def test_every_kind_of_event_is_told(heard: pytest.LogCaptureFixture) -> None:
    for kind in EventKind:
        note_effect(Happened(kind, 0, "something"))
    assert {record.msg for record in heard.records} == {str(kind) for kind in EventKind}

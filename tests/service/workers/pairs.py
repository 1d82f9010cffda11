"""Keyframes as they arrive, and pairs of them to survey."""

from covista_service.link.mailbox import Letter, Mailboxes
from covista_service.link.translate import events_of
from covista_service.perception.camera import View
from covista_service.station.events import Keyframe, KeyframeArrived, SurveyPair

from tests.service.wall import keyframe_bytes


def arrived(data: bytes, robot: str) -> Keyframe:
    """A keyframe on the wire, as the station takes it in."""
    boxes = Mailboxes()
    boxes.put(Letter(robot, "keyframe", "b0", 0, data, 0))
    (mail,), _ = boxes.drain(1, 0)
    event = list(events_of(mail))[-1]
    assert isinstance(event, KeyframeArrived)
    return event.keyframe


def pair(distance_m: float = 1.0) -> SurveyPair:
    """Two robots so far beside each other, before one wall."""
    first, second = arrived(keyframe_bytes("r1"), "r1"), arrived(keyframe_bytes("r2", distance_m), "r2")
    assert first.features is not None
    assert second.features is not None
    return SurveyPair(
        first.id,
        second.id,
        View(first.camera, first.pose, first.features),
        View(second.camera, second.pose, second.features),
    )

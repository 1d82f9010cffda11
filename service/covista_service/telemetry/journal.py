"""What the loop hears and what follows from it, as lines of the log: nothing here decides anything."""

from __future__ import annotations

import logging

from covista_schemas.reports import EventKind

from covista_service.station.events import (
    Effect,
    Event,
    FeaturesExtracted,
    Happened,
    KeyframeArrived,
    MessageDropped,
    MessagesReceived,
    PoseArrived,
    SurveyDone,
    TokenLost,
    TokenSeen,
)
from covista_service.telemetry.logs import about

# Of the station, which has no log of its own: it only says what happens.
log = logging.getLogger("covista_service.station")


def note_event(event: Event) -> None:
    """Warn of a message that cannot be used; tell of a survey."""
    match event:
        case MessageDropped():
            fields = about(robot=event.robot, topic=event.topic, reason=event.code, count=event.count, said=event.text)
            log.warning("dropped", extra=fields)
        case FeaturesExtracted(features=None):
            name = event.keyframe
            fields = about(robot=name.robot, topic="keyframe", reason=event.code, count=1, said=event.problem)
            log.warning("dropped", extra=fields)
        case SurveyDone() if log.isEnabledFor(logging.DEBUG):
            first, second = event.first, event.second
            outcome = "failed" if event.found is None else event.found.outcome
            keyframes = f"{first.boot}/{first.sequence} {second.boot}/{second.sequence}"
            pair = f"{first.robot}/{second.robot}"
            log.debug("surveyed", extra=about(pair=pair, outcome=outcome, keyframes=keyframes))


def note_effect(effect: Effect) -> None:
    """Tell of presence, of new revisions of the groups, and of what is amiss."""
    match effect:
        case Happened(kind=EventKind.GROUPS):
            # The text names every robot.
            counts = {"groups": len(effect.labels), "robots": len(effect.robots)}
            log.info("groups", extra=about(revision=effect.revision_after, **counts))
        case Happened(kind=EventKind.WARNING):
            log.warning("warning", extra=about(**_whom(effect), said=effect.text))
        case Happened(kind=EventKind.STATUS | EventKind.SETTINGS):
            log.info(str(effect.kind), extra=about(**_whom(effect), said=effect.text))
        case Happened():
            log.debug(str(effect.kind), extra=about(**_whom(effect), said=effect.text))


def robot_of(event: Event) -> str | None:
    """The robot whose message it is, if it is one's."""
    match event:
        case KeyframeArrived(keyframe):
            return keyframe.id.robot
        case MessagesReceived() | MessageDropped() | PoseArrived() | TokenSeen() | TokenLost():
            return event.robot
    return None


def _whom(effect: Happened) -> dict[str, object]:
    match effect.robots:
        case ():
            return {}
        case (robot,):
            return {"robot": robot}
        case (first, second):
            return {"pair": f"{first}/{second}"}
        case robots:
            return {"robots": len(robots)}

"""Every key expression of Covista: built here, parsed here.

Inbound `covista/{site}/robots/{robot}/keyframe | pose | alive/{boot}`; outbound `covista/{site}/station/...`.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from enum import StrEnum

from covista_schemas.errors import KeyExpressionError

ROOT = "covista"
ID_PATTERN = r"[a-z0-9][a-z0-9_-]{0,62}"
_ID = re.compile(ID_PATTERN)


class RobotTopic(StrEnum):
    """What a robot publishes under its own id."""

    KEYFRAME = "keyframe"
    POSE = "pose"
    ALIVE = "alive"


@dataclass(frozen=True, slots=True)
class RobotKey:
    """A parsed inbound key; `boot` is given for liveliness tokens only."""

    site: str
    robot: str
    topic: RobotTopic
    boot: str | None = None


@dataclass(frozen=True, slots=True)
class StationQuery:
    """A parsed key that a queryable of the station answers, e.g. ("pairs", ("r1", "r2"))."""

    noun: str
    ids: tuple[str, ...]


def check_id(value: str, what: str = "id") -> str:
    """Return `value` if it is a valid robot, boot or site id, else raise KeyExpressionError."""
    if not _ID.fullmatch(value):
        raise KeyExpressionError(f"{what} {value[:80]!r} does not match {ID_PATTERN}")
    return value


def keyframe(site: str, robot: str) -> str:
    """Key that a robot publishes its keyframes on."""
    return _robot(site, robot, RobotTopic.KEYFRAME)


def pose(site: str, robot: str) -> str:
    """Key that a robot publishes its poses on."""
    return _robot(site, robot, RobotTopic.POSE)


def alive(site: str, robot: str, boot: str) -> str:
    """Liveliness token of one boot of a robot; tokens are reference-counted, so a reboot needs a key of its own."""
    return f"{_robot(site, robot, RobotTopic.ALIVE)}/{check_id(boot, 'boot')}"


def robot_prefix(site: str, robot: str) -> str:
    """What all keys begin with that a robot says something on."""
    return f"{ROOT}/{check_id(site, 'site')}/robots/{check_id(robot, 'robot')}"


def every(site: str, topic: RobotTopic) -> str:
    """Subscription to one topic of all robots of a site."""
    tail = "/*" if topic is RobotTopic.ALIVE else ""
    return f"{ROOT}/{check_id(site, 'site')}/robots/*/{topic}{tail}"


def groups(site: str) -> str:
    """Where the station publishes the whole grouping; a queryable stands there too."""
    return f"{_station(site)}/groups"


def own_group(site: str, robot: str) -> str:
    """Where the station publishes one robot's own group."""
    return f"{robot_report(site, robot)}/group"


def events(site: str) -> str:
    """Where the station publishes events."""
    return f"{_station(site)}/events"


def similarity(site: str) -> str:
    """Queryable of the similarity matrix."""
    return f"{_station(site)}/similarity"


def pair(site: str, a: str, b: str) -> str:
    """Queryable of one pair."""
    return f"{_station(site)}/pairs/{check_id(a, 'robot')}/{check_id(b, 'robot')}"


def robot_report(site: str, robot: str) -> str:
    """Queryable of one robot."""
    return f"{_station(site)}/robots/{check_id(robot, 'robot')}"


def queryables(site: str) -> tuple[str, ...]:
    """The key expressions of the station's queryables."""
    station = _station(site)
    return tuple(f"{station}/{tail}" for tail in ("groups", "similarity", "pairs/*/*", "robots/*"))


def parse_robot_key(key: str) -> RobotKey:
    """Take an inbound key apart, or raise KeyExpressionError."""
    match key.split("/"):
        case [root, site, "robots", robot, RobotTopic.KEYFRAME | RobotTopic.POSE as topic] if root == ROOT:
            return RobotKey(check_id(site, "site"), check_id(robot, "robot"), RobotTopic(topic))
        case [root, site, "robots", robot, RobotTopic.ALIVE, boot] if root == ROOT:
            return RobotKey(check_id(site, "site"), check_id(robot, "robot"), RobotTopic.ALIVE, check_id(boot, "boot"))
    raise KeyExpressionError(f"{key[:200]!r} is not a key that a robot publishes on")


def parse_station_query(site: str, key: str) -> StationQuery:
    """Take the key of a query to the station apart, or raise KeyExpressionError; ids are not checked."""
    prefix = f"{_station(site)}/"
    match key.removeprefix(prefix).split("/") if key.startswith(prefix) else []:
        case ["groups" | "similarity" as noun]:
            return StationQuery(noun, ())
        case ["pairs", a, b]:
            return StationQuery("pairs", (a, b))
        case ["robots", robot]:
            return StationQuery("robots", (robot,))
    raise KeyExpressionError(f"{key[:200]!r} is not a key that the station answers on")


def _robot(site: str, robot: str, topic: RobotTopic) -> str:
    return f"{robot_prefix(site, robot)}/{topic}"


def _station(site: str) -> str:
    return f"{ROOT}/{check_id(site, 'site')}/station"

"""Who may say and hear what on zenoh, by the common name of the certificate: zenoh's access control, written out.

A rule lets a message pass if one of its keys includes all of the message's key, in that direction. A verbatim chunk
such as @adv, under which late and missed messages are asked for, is included by itself alone.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from covista_schemas import keys
from covista_schemas.keys import RobotTopic

# Egress is what the station sends, ingress what comes in.
IN, OUT = "ingress", "egress"
_ASKED = ["query", "liveliness_query", "declare_subscriber", "declare_liveliness_subscriber"]
_ALL = [
    *_ASKED,
    "put",
    "delete",
    "reply",
    "declare_queryable",
    "liveliness_token",
]


def access_control(site: str, robots: Iterable[str], stations: Iterable[str]) -> dict[str, Any]:
    """What zenoh is to be configured with: `robots` speak for themselves, `stations` do all, others nothing."""
    rules: list[dict[str, Any]] = [_rule("all", [IN, OUT], _ALL, ["**", "**/@adv/**"]), *_for_every_robot(site)]
    subjects = [{"id": "stations", "cert_common_names": sorted(stations)}]
    policies = [{"rules": ["all"], "subjects": ["stations"]}]
    names = sorted(robots)
    if names:
        subjects.append({"id": "robots", "cert_common_names": names})
        policies.append({"rules": [rule["id"] for rule in rules[1:]], "subjects": ["robots"]})
    for robot in names:
        own = _for_itself(site, robot)
        rules += own
        subjects.append({"id": f"robot {robot}", "cert_common_names": [robot]})
        policies.append({"rules": [rule["id"] for rule in own], "subjects": [f"robot {robot}"]})
    return {
        "enabled": True,
        "default_permission": "deny",
        "rules": rules,
        "subjects": subjects,
        "policies": policies,
    }


def _for_every_robot(site: str) -> list[dict[str, Any]]:
    """What is meant for all: the groups, events, answers, and that there is a station that listens."""
    told = _with_late([keys.groups(site), keys.events(site)])
    every = [keys.every(site, topic) for topic in RobotTopic]
    asked = list(keys.queryables(site))
    return [
        _rule("hear", [IN], _ASKED, told),
        _rule("told", [OUT], ["put", "reply", "declare_queryable", "liveliness_token"], told),
        _rule("ask", [IN], ["query"], asked),
        _rule("answered", [OUT], ["reply", "declare_queryable"], asked),
        # Without this a publisher of a robot never sends.
        _rule("heard", [OUT], ["declare_subscriber", "declare_liveliness_subscriber"], every),
    ]


def _for_itself(site: str, robot: str) -> list[dict[str, Any]]:
    said = [keys.keyframe(site, robot), keys.pose(site, robot)]
    alive = [f"{keys.robot_prefix(site, robot)}/{RobotTopic.ALIVE}/*"]
    told = _with_late([keys.own_group(site, robot)])
    return [
        _rule(f"say {robot}", [IN], ["put"], said),
        _rule(f"alive {robot}", [IN], ["liveliness_token"], alive),
        _rule(f"hear {robot}", [IN], _ASKED, told),
        _rule(f"told {robot}", [OUT], ["put", "reply", "declare_queryable", "liveliness_token"], told),
    ]


def _with_late(told: list[str]) -> list[str]:
    return told + [f"{key}/@adv/**" for key in told]


def _rule(name: str, flows: list[str], messages: list[str], key_exprs: list[str]) -> dict[str, Any]:
    return {"id": name, "permission": "allow", "flows": flows, "messages": messages, "key_exprs": key_exprs}

"""How the station is, in plain words: what needs attention first, what was dropped and why, what waits."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any, NamedTuple

from covista_schemas.reports import Health, PartHealth, Status

from covista_service.dashboard.checkup import Checkup
from covista_service.dashboard.health_counts import MB, counts, facts, several, waiting
from covista_service.dashboard.reasons import TROUBLES, UNTOLD
from covista_service.station.census import Census
from covista_service.station.ledger import Counts
from covista_service.station.snapshot import RobotView

_CLOCK_OFF_S = 10.0
# Poses that so many keyframes in a row say are off.
_DISAGREEING = 3
# Of 256 MiB that may wait, and of the news that one database can be behind.
_MUCH_MAIL_BYTES, _MUCH_NEWS = 128 * 2**20, 500
_MOST_NAMED = 5
_WORST = ("stopping", "degraded", "starting", "ready")


class PartWords(NamedTuple):
    """A part of the station for people: its name, what stops without it, what to do."""

    title: str
    means: str
    todo: str


PARTS: Mapping[str, PartWords] = {
    "link": PartWords(
        "Radio link (zenoh)",
        "Robots may not be heard, and may not hear their groups.",
        "See that the port or the router can be reached, and what the log says of the link.",
    ),
    "workers": PartWords(
        "Workers",
        "Pictures are compared more slowly, or not yet.",
        "Loading takes some seconds after a start. If a cluster is away, bring it back; the station returns to it.",
    ),
    "store": PartWords(
        "Database",
        "Groups go on as before; the history may get a gap, and settings may not outlast a restart.",
        "See that the database can be reached and its disk has room.",
    ),
    "loop": PartWords(
        "Main loop",
        "Nothing new is computed: what all pages show is old.",
        "If it lasts longer than a minute, read the log and start the station again.",
    ),
    "access": PartWords(
        "Access",
        "New tokens are not known yet, and revoked ones still let people in.",
        "See that the database of the tokens can be reached.",
    ),
}


def told(checkup: Checkup) -> dict[str, Any]:
    """All that the page needs; rates it computes itself, from two answers."""
    return {
        "status": checkup.health.status,
        "sentence": sentence(checkup.health),
        "attention": list(attention(checkup)),
        "parts": parts(checkup.health),
        "robots": presence(checkup.census),
        "fates": [_fates(topic, counts) for topic, counts in checkup.census.accounts.items()],
        "counts": list(counts(checkup)),
        "waiting": list(waiting(checkup)),
        "latency": _latency(checkup),
        "turns_s": checkup.timings.turns_s,
        "facts": list(facts(checkup)),
        "odd_robots": odd_robots(checkup.robots),
    }


def sentence(health: Health) -> str:
    """The first line, as far as parts go."""
    off = [_title(name) for name, part in health.parts.items() if part.status != "ready"]
    match health.status:
        case "ready":
            return "Every part of the station works."
        case "degraded":
            return f"The station goes on, but something is wrong: {', '.join(off)}."
        case "starting":
            return f"The station is starting: {', '.join(off)}."
        case _:
            return "The station is stopping, or has stopped working."


def attention(checkup: Checkup) -> Iterator[dict[str, Any]]:
    """What somebody should look at now, the worst first."""
    for each in parts(checkup.health):
        if each["status"] != "ready":
            said = f": {each['detail']}" if each["detail"] else ""
            level = "warn" if each["status"] == "starting" else "bad"
            yield _need(
                f"part/{each['name']}",
                level,
                f"{each['title']} is {each['status']}{said}. {each['means']}",
                each["todo"],
            )
    yield from _overfull(checkup)
    yield from _amiss(checkup.robots)
    if not checkup.robots:
        yield _need(
            "robots", "note", "No robot has been heard yet.", "See that rovers are on and connect to this station."
        )


def _overfull(checkup: Checkup) -> Iterator[dict[str, Any]]:
    vitals = checkup.vitals
    if vitals.mail.payload_bytes > _MUCH_MAIL_BYTES:
        says = f"{vitals.mail.payload_bytes / MB:.0f} MB of mail wait unopened: more comes than the station can take."
        yield _need("mail", "warn", says, "Have robots send less often, or give the station more workers.")
    for name, sink in vitals.sinks.items():
        if sink.waiting > _MUCH_NEWS:
            says = f"{sink.waiting} entries wait for {name}."
            yield _need(f"news/{name}", "warn", says, TROUBLES.get(name, UNTOLD).todo)
    if checkup.pages > 0.9 * checkup.most_pages:
        says = f"{checkup.pages} of {checkup.most_pages} pages are open; soon nobody can open another."
        yield _need("pages", "warn", says, "Close pages that nobody reads.")


def _amiss(robots: Sequence[RobotView]) -> Iterator[dict[str, Any]]:
    off = sorted(view.id for view in robots if _has_clock_off(view))
    if off:
        yield _need(
            "clocks",
            "warn",
            f"{_robots(off)} a clock that is off by more than {_CLOCK_OFF_S:.0f} s.",
            "Groups are right all the same, for times of arrival count. Set the clock, so that logs can be compared.",
            off,
        )
    wrong = sorted(view.id for view in robots if _has_pose_off(view))
    if wrong:
        yield _need(
            "poses",
            "warn",
            f"{_robots(wrong)} poses that keep disagreeing with the pictures; the station corrects them.",
            "Look at the localisation, and at how the camera is mounted.",
            wrong,
        )


def parts(health: Health) -> list[dict[str, Any]]:
    """The parts, the worst first; what a ready one means and wants is left out."""
    ordered = sorted(health.parts.items(), key=lambda item: _WORST.index(item[1].status))
    return [_part(name, part) for name, part in ordered]


def _part(name: str, part: PartHealth) -> dict[str, Any]:
    words = PARTS.get(name, PartWords(name, "", "See the log."))
    ready = part.status == "ready"
    return {
        "name": name,
        "title": words.title,
        "status": part.status,
        "detail": part.detail,
        "means": "" if ready else words.means,
        "todo": "" if ready else words.todo,
    }


def presence(census: Census) -> str:
    """Who is there, as a sentence."""
    total = sum(census.robots.values())
    if not total:
        return "No robot has been heard yet."
    some = ", ".join(f"{census.robots[status]} {status}" for status in Status if census.robots.get(status))
    return f"{several(total, 'robot')} ({some}){_grouped(census, total)}"


def _grouped(census: Census, total: int) -> str:
    poseless, absent = census.ungrouped.get("no_pose", 0), sum(census.ungrouped.values())
    untold = f" {poseless} {'has' if poseless == 1 else 'have'} told no pose yet." if poseless else ""
    if not census.groups:
        return f", in no group.{untold}"
    groups = several(census.groups, "group")
    return f", {total - absent} of them in {groups}.{untold}" if absent else f" in {groups}."


def odd_robots(robots: Sequence[RobotView]) -> list[dict[str, Any]]:
    """Robots with a clock that is off, or poses that pictures have corrected, those with most first."""
    found = [view for view in robots if _has_clock_off(view) or _has_pose_off(view)]
    return [
        {
            "robot": view.id,
            "clock_s": round(view.clock_offset_s, 1)
            if _has_clock_off(view) and view.clock_offset_s is not None
            else None,
            "off_deg": round(view.correction.deg, 1) if view.correction else None,
            "off_m": round(view.correction.m, 2) if view.correction else None,
        }
        for view in sorted(found, key=lambda view: (-abs(view.clock_offset_s or 0), view.id))
    ]


def _latency(checkup: Checkup) -> dict[str, Any]:
    timings, summary = checkup.timings, checkup.summary
    return {
        "p50_ms": summary.latency_p50_ms,
        "p99_ms": summary.latency_p99_ms,
        "sum_s": timings.latency_sum_s,
        "count": timings.latencies,
        "slow": timings.latencies - timings.within_half_s,
    }


def _fates(topic: str, account: Counts) -> dict[str, Any]:
    return {
        "topic": topic,
        "received": account.received,
        "used": account.used,
        "replaced": account.replaced,
        "duplicate": account.duplicate,
        "waiting": account.waiting,
        "dropped": sum(account.dropped.values()),
        "missing": account.missing,
    }


def _need(key: str, level: str, says: str, todo: str, robots: Sequence[str] = ()) -> dict[str, Any]:
    """One that needs somebody; `key` stays the same while it lasts, whatever numbers it says."""
    return {"key": key, "level": level, "says": says, "todo": todo, "robots": robots[:_MOST_NAMED]}


def _has_clock_off(view: RobotView) -> bool:
    return abs(view.clock_offset_s or 0) > _CLOCK_OFF_S


def _has_pose_off(view: RobotView) -> bool:
    return view.correction is not None and view.correction.disagreeing >= _DISAGREEING


def _title(name: str) -> str:
    return PARTS[name].title if name in PARTS else name


def _robots(names: Sequence[str]) -> str:
    """Some of them by name, as who has something."""
    if len(names) == 1:
        return f"{names[0]} has"
    if len(names) <= _MOST_NAMED:
        return f"{', '.join(names[:-1])} and {names[-1]} have"
    return f"{', '.join(names[:_MOST_NAMED])} and {len(names) - _MOST_NAMED} more have"

"""What went wrong and why, what waits, and what else there is to count: numbers of the station with their meaning."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from covista_service.dashboard.checkup import Checkup
from covista_service.dashboard.reasons import (
    ACCESS_REFUSED,
    DROPPED,
    GIVEN_UP,
    LINK_REFUSED,
    TROUBLES,
    TURNED_AWAY,
    UNTOLD,
    Words,
)
from covista_service.station.ledger import Counts
from covista_service.station.snapshot import RobotView
from covista_service.telemetry import WORKER_FAILED

MB = 1e6
_MOST_CONCERNED = 3


def several(count: int, one: str, more: str = "") -> str:
    """A number of things: 1 group, 2 groups."""
    return f"{count} {one if count == 1 else more or f'{one}s'}"


def counts(checkup: Checkup) -> Iterator[dict[str, Any]]:
    """Everything that went wrong since the start, by reason, with who is most concerned."""
    for topic, account in checkup.census.accounts.items():
        for reason, total in account.dropped.items():
            most = most_concerned(checkup.robots, topic, reason)
            yield _count(f"Dropped a {topic}", reason, total, DROPPED, most)
        most = _most({view.id: _account(view, topic).missing for view in checkup.robots})
        yield _count(f"{topic.capitalize()} lost on the way", "missing", account.missing, TROUBLES, most)
    vitals, crew = checkup.vitals, checkup.vitals.crew
    work = {"lost": crew.lost, "retried": crew.retried, "overdue": crew.overdue, "given_up": crew.given_up}
    failed = {WORKER_FAILED: checkup.summary.outcomes.get(WORKER_FAILED, 0)}
    news = {name: sink.lost for name, sink in vitals.sinks.items()}
    for about, of, words in (
        ("Turned away on zenoh", vitals.turned_away, TURNED_AWAY),
        ("Not let in on zenoh", vitals.link_refused, LINK_REFUSED),
        ("Not let in here", checkup.refused, ACCESS_REFUSED),
        ("Client given up", checkup.given_up, GIVEN_UP),
        ("Error of the station", checkup.timings.faults, TROUBLES),
        ("Trouble with workers", work | failed, TROUBLES),
        ("News lost", news, TROUBLES),
    ):
        for reason, total in of.items():
            yield _count(about, reason, total, words)


def most_concerned(robots: Sequence[RobotView], topic: str, reason: str) -> list[tuple[str, int]]:
    """The robots with most messages dropped for a reason, those with most first; three at most."""
    return _most({view.id: _account(view, topic).dropped.get(reason, 0) for view in robots})


def waiting(checkup: Checkup) -> Iterator[dict[str, Any]]:
    """What waits now, and what for."""
    mail, load, crew = checkup.vitals.mail, checkup.census.workload, checkup.vitals.crew
    extracted = sum(account.waiting for account in checkup.census.accounts.values())
    said = f"Messages not opened yet, {mail.payload_bytes / MB:.1f} MB; robots with such: {mail.robots}."
    yield _waits("mail", "Mail", mail.messages, said)
    yield _waits("open", "Messages in work", extracted, "Opened, and not decided yet: features are being extracted.")
    yield _waits("jobs", "Jobs under way", checkup.summary.under_way, f"{crew.capacity} of them can run at a time.")
    for queue, count in load.waiting.items():
        yield _waits(f"pairs.{queue}", f"Pairs: {queue}", count, _QUEUES.get(queue, "Wait for a survey."))
    yield _waits(
        "forecasts", "New poses", load.forecasts_waiting, "Robots that moved and whose overlaps are to be read anew."
    )
    for name, sink in checkup.vitals.sinks.items():
        yield _waits(f"news.{name}", f"News for {name}", sink.waiting, "Events and groups that are still to be told.")


_QUEUES: Mapping[str, str] = {
    "fresh": "Robots with a new keyframe, to be compared with others.",
    "moved": "Robots that have moved, to be compared with others.",
    "regular": "Pairs that are looked at from time to time.",
    "sweep": "Pairs that hardly see anything in common, looked at when there is time.",
}


def facts(checkup: Checkup) -> Iterator[tuple[str, str]]:
    """What else an operator may ask: name and words."""
    crew, census, store = checkup.vitals.crew, checkup.census, checkup.vitals.sinks.get("history")
    yield "Workers", _workers(checkup)
    if store is not None:
        yield (
            "Database",
            f"{several(store.told, 'entry', 'entries')} given to it, {store.waiting} waiting, {store.lost} lost.",
        )
    compared = f"{several(checkup.summary.surveys, 'pair')} compared since the start"
    yield "Surveys", f"{compared}, {census.workload.outdated} overtaken by newer keyframes."
    yield "Kept", f"Keyframes of {several(census.keyframes, 'robot')}, records of {several(census.pairs, 'pair')}."
    sessions = f"{several(checkup.vitals.sessions, 'session')} on zenoh"
    listeners = f"{several(checkup.listeners, 'listener')} to events over REST"
    yield "Who listens", f"{sessions}, {listeners}, {checkup.pages} of at most {checkup.most_pages} pages open."
    if checkup.timings.memory_bytes is not None:
        yield "Memory", f"{checkup.timings.memory_bytes / MB:.0f} MB in the station's own process."
    if crew.shipped_bytes:
        again = f", {several(crew.shipped_again, 'time')} again" if crew.shipped_again else ""
        yield "Sent to workers", f"{crew.shipped_bytes / MB:.0f} MB of features{again}."


def _workers(checkup: Checkup) -> str:
    crew = checkup.vitals.crew
    said = [f"{several(crew.capacity, 'job')} at a time, {crew.kind}"]
    said += [] if crew.warm else ["still loading compiled code"]
    said += [each for each in (crew.fallback, crew.remark) if each is not None]
    return f"{'; '.join(said)}."


def _count(
    about: str, reason: str, total: int, words: Mapping[str, Words], robots: Sequence[tuple[str, int]] = ()
) -> dict[str, Any]:
    said = words.get(reason, UNTOLD)
    return {
        "key": f"{about}/{reason}",
        "about": about,
        "reason": reason,
        "total": total,
        **said._asdict(),
        "robots": robots,
    }


def _waits(key: str, name: str, value: int, means: str) -> dict[str, Any]:
    return {"key": key, "name": name, "value": value, "means": means}


def _account(view: RobotView, topic: str) -> Counts:
    return view.keyframes if topic == "keyframe" else view.poses


def _most(of: Mapping[str, int]) -> list[tuple[str, int]]:
    found = [(robot, count) for robot, count in of.items() if count]
    return sorted(found, key=lambda each: (-each[1], each[0]))[:_MOST_CONCERNED]

"""Every question that a station answers over HTTP, with a typed answer."""

from __future__ import annotations

import threading
import weakref
from collections.abc import Callable, Iterator, Mapping
from datetime import UTC, datetime
from pathlib import Path
from types import TracebackType
from typing import Any, Literal, Protocol, Self, TypeVar
from urllib.parse import quote

import httpx
import numpy as np
from covista_schemas.errors import ApiError
from covista_schemas.reports import (
    EventKind,
    EventsHistory,
    Group,
    GroupsHistory,
    GroupsReport,
    Health,
    LiveSettings,
    PairHistory,
    PairReport,
    PairsReport,
    Report,
    RobotReport,
    RobotsReport,
    RobotTrack,
    SimilarityReport,
)
from numpy.typing import NDArray
from pydantic import ValidationError
from pydantic_core import to_jsonable_python

from covista_clients.mission_control.connection import Connection, Parameters
from covista_clients.mission_control.events import Events
from covista_clients.mission_control.matrices import MatrixName, read_matrix

_R = TypeVar("_R", bound=Report)
_V1 = "/api/v1"
# Settings by name, or a model of them of which what was set counts.
Changes = Mapping[str, object] | Report | None


class Page(Protocol):
    """What a list is told in."""

    @property
    def next(self) -> str | None:
        """Cursor of the next page; None on the last."""


_P = TypeVar("_P", bound=Page)


class MissionControl:
    """Asks a station about robots, pairs and groups; use it as a context manager, or close it.

    Every question raises ApiError where the station answers with a problem, or does not answer; where it is about
    access UnauthorizedError, ForbiddenError or TooManyError. What only asks is asked again when a connection fails or
    the station cannot answer for the moment, all within `timeout_s`; what changes something is sent once. May be used
    from several threads.
    """

    def __init__(
        self,
        url: str = "http://127.0.0.1:8000",
        token: str | None = None,
        *,
        timeout_s: float = 10.0,
        verify: str | Path | bool = True,
        transport: httpx.BaseTransport | None = None,
    ) -> None:
        """`verify` is a PEM file of the authorities to trust under https, where the system's are not enough."""
        self._connection = Connection(url, token, timeout_s=timeout_s, verify=verify, transport=transport)
        self._kept: dict[str, tuple[str, Report]] = {}
        self._lock = threading.Lock()
        self._streams: weakref.WeakSet[Events] = weakref.WeakSet()

    def robots(self, *, limit: int | None = None, cursor: str | None = None) -> RobotsReport:
        """All robots, or a page of them."""
        return self._ask(RobotsReport, "/robots", {"limit": limit, "cursor": cursor})

    def robot(self, robot: str) -> RobotReport:
        """One robot."""
        return self._ask(RobotReport, f"/robots/{_part(robot)}")

    def forget(self, robot: str) -> None:
        """Have the station forget a robot; one that sends again is a new one."""
        self._connection.change("DELETE", f"{_V1}/robots/{_part(robot)}", well=204)

    def track(
        self,
        robot: str,
        since: datetime | None = None,
        until: datetime | None = None,
        *,
        limit: int | None = None,
        cursor: str | None = None,
    ) -> RobotTrack:
        """Where a robot was, a page at a time."""
        return self._ask(RobotTrack, f"/robots/{_part(robot)}/track", _span(since, until, limit, cursor))

    def pairs(
        self,
        robot: str | None = None,
        min_overlap: float | None = None,
        *,
        limit: int | None = None,
        cursor: str | None = None,
    ) -> PairsReport:
        """Pairs, each once; those of one robot, or of a least overlap in either image, where asked; all, or a page."""
        asked: Parameters = {"robot": robot, "min_overlap": min_overlap, "limit": limit, "cursor": cursor}
        return self._ask(PairsReport, "/pairs", asked)

    def pair(self, a: str, b: str) -> PairReport:
        """One pair in full, in the order asked."""
        return self._ask(PairReport, f"/pairs/{_part(a)}/{_part(b)}")

    def pair_history(
        self,
        a: str,
        b: str,
        since: datetime | None = None,
        until: datetime | None = None,
        *,
        limit: int | None = None,
        cursor: str | None = None,
    ) -> PairHistory:
        """The overlap of a pair over time, a page at a time."""
        return self._ask(PairHistory, f"/pairs/{_part(a)}/{_part(b)}/history", _span(since, until, limit, cursor))

    def overlay(self, a: str, b: str, side: Literal["a", "b"] = "a") -> bytes:
        """A PNG of one side's keyframe with the common field drawn in."""
        return self._connection.get(f"{_V1}/pairs/{_part(a)}/{_part(b)}/overlay.png", {"side": side}).content

    def similarity(self) -> SimilarityReport:
        """The similarity matrix, and what it is made of; not sent again while it stands."""
        return self._ask_once(SimilarityReport, "/similarity")

    def similarity_matrix(self, matrix: MatrixName = "similarity") -> tuple[list[str], NDArray[np.float64]]:
        """The robots, and one matrix (N, N) in their order; NaN is unknown. Far faster than a report of many."""
        headers = {"Accept": "application/x-npy"}
        response = self._connection.get(f"{_V1}/similarity", {"matrix": matrix}, headers=headers)
        return read_matrix(response)

    def groups(self) -> GroupsReport:
        """The grouping in force; not sent again while it stands."""
        return self._ask_once(GroupsReport, "/groups")

    def group(self, label: str) -> Group:
        """One group."""
        return self._ask(Group, f"/groups/{_part(label)}")

    def groups_at(self, time: datetime) -> GroupsReport:
        """The grouping that was in force at a moment."""
        return self._ask(GroupsReport, "/groups/at", {"time": _moment(time)})

    def groups_history(
        self,
        since: datetime | None = None,
        until: datetime | None = None,
        *,
        limit: int | None = None,
        cursor: str | None = None,
    ) -> GroupsHistory:
        """Revisions of the groups, a page at a time."""
        return self._ask(GroupsHistory, "/groups/history", _span(since, until, limit, cursor))

    def preview(self, changes: Changes = None, /, **more: object) -> GroupsReport:
        """The groups that there would be with other settings, such as `alpha=0.7`; changes nothing."""
        response = self._connection.compute(f"{_V1}/groups/preview", _body(changes, more))
        return _read(GroupsReport, response)

    def settings(self) -> LiveSettings:
        """The settings in force of those that can change while the station runs."""
        return self._ask(LiveSettings, "/settings")

    def patch_settings(self, changes: Changes = None, /, **more: object) -> LiveSettings:
        """Change settings, such as `alpha=0.7, hysteresis={"gain": 0.1}`; the others stay. Returns those in force."""
        return _read(LiveSettings, self._connection.change("PATCH", f"{_V1}/settings", _body(changes, more)))

    def events(self, last_event_id: int | str | None = None) -> Events:
        """Events live, and before them those after `last_event_id`: an iterator that connects again by itself."""
        stream = Events(self._connection, last_event_id)
        with self._lock:
            self._streams.add(stream)
        return stream

    def events_history(
        self,
        since: datetime | None = None,
        until: datetime | None = None,
        *,
        kind: EventKind | str | list[EventKind] | list[str] | None = None,
        robot: str | None = None,
        limit: int | None = None,
        cursor: str | None = None,
    ) -> EventsHistory:
        """Events that were, of these kinds and of this robot where asked, a page at a time."""
        kinds = None if kind is None else [str(each) for each in ([kind] if isinstance(kind, str) else kind)]
        asked = {**_span(since, until, limit, cursor), "kind": kinds, "robot": robot}
        return self._ask(EventsHistory, "/events/history", asked)

    def pages(self, ask: Callable[..., _P], *named: object, **asked: object) -> Iterator[_P]:
        """The pages of a list, each fetched when it is its turn: `control.pages(control.track, "r1", limit=100)`."""
        cursor: str | None = None
        while True:
            page = ask(*named, **asked, cursor=cursor)
            yield page
            if page.next is None:
                return
            if page.next == cursor:
                raise ApiError("the station's list has no end", detail=f"cursor {cursor} leads to itself")
            cursor = page.next

    def health(self) -> Health:
        """Whether the station runs."""
        return self._ask_health("/healthz")

    def ready(self) -> Health:
        """Whether the station is of use, part by part; not an error where it is not."""
        return self._ask_health("/readyz")

    def metrics(self) -> str:
        """What the station counts, in Prometheus' format."""
        return self._connection.get("/metrics").text

    def close(self) -> None:
        """Close the connections; iterators over events come to their end."""
        with self._lock:
            streams = list(self._streams)
        for stream in streams:
            stream.close()
        self._connection.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def _ask(self, report: type[_R], path: str, parameters: Parameters | None = None) -> _R:
        return _read(report, self._connection.get(_V1 + path, parameters))

    def _ask_once(self, report: type[_R], path: str) -> _R:
        """As `_ask`; what was sent before and still stands is taken from memory."""
        tag, known = self._kept.get(path, (None, None))
        headers = {"Accept": "application/json"} | ({"If-None-Match": tag} if tag else {})
        response = self._connection.get(_V1 + path, headers=headers, well=(200, 304) if tag else (200,))
        if response.status_code == 304 and isinstance(known, report):
            return known
        read = _read(report, response)
        if new := response.headers.get("ETag"):
            self._kept[path] = new, read
        return read

    def _ask_health(self, path: str) -> Health:
        # 503 is an answer here, with the same model.
        return _read(Health, self._connection.get(path, well=(200, 503)))


def _part(name: str) -> str:
    """One part of a path: what a person typed may hold anything."""
    return quote(name, safe="")


def _span(
    since: datetime | None, until: datetime | None, limit: int | None, cursor: str | None
) -> dict[str, str | int | float | list[str] | None]:
    start, end = (None if time is None else _moment(time) for time in (since, until))
    return {"from": start, "to": end, "limit": limit, "cursor": cursor}


def _moment(time: datetime) -> str:
    """RFC 3339; a time without a zone is UTC, as in reports."""
    return (time.astimezone(UTC) if time.tzinfo else time.replace(tzinfo=UTC)).isoformat()


def _body(changes: Changes, more: Mapping[str, object]) -> Any:
    given = changes.model_dump(exclude_unset=True) if isinstance(changes, Report) else changes or {}
    return to_jsonable_python({**given, **more})


def _read(report: type[_R], response: httpx.Response) -> _R:
    try:
        return report.read(response.content)
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        detail = f"{'.'.join(str(part) for part in first['loc'])}: {first['msg']}"
        raise ApiError(f"{response.url} does not answer as a station does", detail=detail) from error

"""What routes are given: the parts of the station, and its snapshot."""

from __future__ import annotations

import asyncio
import hashlib
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Annotated, NotRequired, TypedDict

from covista_schemas.keys import ID_PATTERN
from covista_schemas.reports import Health, Report
from fastapi import Depends, Path, Request, Response

from covista_service.access import Gate
from covista_service.answers.past import Archive
from covista_service.answers.texts import Texts
from covista_service.api.delivery import deliver
from covista_service.api.outgoing import Outgoing
from covista_service.api.stream import Stream
from covista_service.loop import Loop
from covista_service.loop.rooms import Room
from covista_service.loop.vitals import Vitals
from covista_service.station.census import Census
from covista_service.station.snapshot import Snapshot
from covista_service.telemetry import Telemetry

JSON = "application/json"


@dataclass(frozen=True, slots=True, eq=False)
class Parts:
    """What the routes need of the station. `name` changes with each start, so that no answer is mistaken for newer.

    `gate` says who may ask. `flush` waits so many seconds at most until what was told is in the history, and says
    whether it is.
    """

    loop: Loop
    telemetry: Telemetry
    health: Callable[[], Health]
    vitals: Callable[[], Vitals]
    name: str
    gate: Gate
    archive: Archive
    flush: Callable[[float], bool]
    stream: Stream
    # Looks at once at who is to be let in on zenoh.
    renew: Callable[[], None] = lambda: None
    outgoing: Outgoing = field(default_factory=Outgoing)
    texts: Texts = field(default_factory=Texts)
    readers: Room = field(default_factory=lambda: Room(at_once=3, waiting=200))
    previews: Room = field(default_factory=lambda: Room(at_once=1, waiting=20))
    # Who changes settings begins with those that the one before has left.
    setting: asyncio.Lock = field(default_factory=asyncio.Lock)


class State(TypedDict):
    """The application's state, as yielded by its lifespan; what is not ours comes and goes with it."""

    parts: Parts
    dashboard: NotRequired[object]


def parts_of(request: Request) -> Parts:
    """The parts of the station."""
    state: State = request.scope["state"]
    return state["parts"]


PartsNow = Annotated[Parts, Depends(parts_of)]


async def snapshot_of(parts: PartsNow) -> Snapshot:
    """The station now. Asynchronous, so that it runs in the loop's own thread; the answer is built in another."""
    return parts.loop.snapshot()


async def census_of(parts: PartsNow) -> Census:
    """The station now in numbers; asynchronous as above."""
    return parts.loop.census()


CensusNow = Annotated[Census, Depends(census_of)]
SnapshotNow = Annotated[Snapshot, Depends(snapshot_of)]
RobotPath = Annotated[str, Path(pattern=f"^{ID_PATTERN}$", description="Id of a robot.", examples=["r1"])]


def asker_of(request: Request) -> str | None:
    """Name of the token of whoever asks; None where nobody needs one."""
    by = request.scope.get("covista.by")
    return by if isinstance(by, str) else None


AskerNow = Annotated[str | None, Depends(asker_of)]


def answer(report: Report, outgoing: Outgoing | None = None) -> Response:
    """A report as it is: it was checked when it was made. One that may be large wants `outgoing`."""
    text = report.model_dump_json()
    return Response(text, media_type=JSON) if outgoing is None else deliver(text.encode(), outgoing, JSON)


def answer_unless_known(request: Request, tag: str | bytes, build: Callable[[], Response]) -> Response:
    """304 for who has this version already (RFC 9110, If-None-Match), else what `build` makes, with its tag."""
    return tagged(Response(status_code=304) if is_known(request, tag) else build(), tag)


def is_known(request: Request, tag: str | bytes) -> bool:
    """Does who asks say that they have this version already?"""
    known = [each.strip().removeprefix("W/") for each in request.headers.get("if-none-match", "").split(",")]
    return _etag(tag) in known or known == ["*"]


def tagged(response: Response, tag: str | bytes) -> Response:
    """The answer, with its version."""
    response.headers["ETag"] = _etag(tag)
    response.headers["Vary"] = "Accept"
    return response


def _etag(tag: str | bytes) -> str:
    content = tag.encode() if isinstance(tag, str) else tag
    return f'"{hashlib.blake2s(content, digest_size=12).hexdigest()}"'

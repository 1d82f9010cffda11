"""What the pages are given of the station."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Annotated, NotRequired, TypedDict

from covista_schemas.reports import Health
from fastapi import Depends, Request

from covista_service.access import Gate
from covista_service.answers.past import Archive
from covista_service.dashboard.frames import Frames
from covista_service.dashboard.looks import Looks
from covista_service.dashboard.recent_moments import RecentMoments
from covista_service.dashboard.rounds import Rounds
from covista_service.loop import Loop
from covista_service.loop.rooms import Room
from covista_service.loop.vitals import Vitals
from covista_service.telemetry import Telemetry


@dataclass(frozen=True, slots=True, eq=False)
class Sources:
    """The station as REST has it too; `name` changes with each start.

    `listeners` counts who hears events over REST, `given_up` clients that were turned away there, by reason;
    `readers` read the archive in threads.
    """

    name: str
    loop: Loop
    telemetry: Telemetry
    health: Callable[[], Health]
    vitals: Callable[[], Vitals]
    gate: Gate
    archive: Archive
    readers: Room = field(default_factory=lambda: Room(at_once=2, waiting=20))
    moments: RecentMoments = field(default_factory=RecentMoments)
    frames: Frames = field(default_factory=Frames)
    listeners: Callable[[], int] = lambda: 0
    given_up: Callable[[], Mapping[str, int]] = dict
    rounds: Rounds = field(default_factory=Rounds)
    looks: Looks = field(default_factory=Looks)
    # One picture is drawn at a time: who waits for the same finds it there.
    drawing: Room = field(default_factory=lambda: Room(at_once=1, waiting=50))


class State(TypedDict):
    """The part of the application's state that is ours."""

    dashboard: NotRequired[Sources]


def sources_of(request: Request) -> Sources:
    """The station behind the page that asks."""
    state: State = request.scope["state"]
    return state["dashboard"]


SourcesNow = Annotated[Sources, Depends(sources_of)]

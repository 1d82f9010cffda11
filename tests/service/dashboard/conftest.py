"""What the pages' scripts ask for, from a scene's station with a history in a file."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from datetime import datetime, timedelta
from pathlib import Path
from typing import Any

import pytest
from covista_schemas.reports import Group, GroupsReport, LiveSettings, Ungrouped, time_of
from covista_service.dashboard import data, data_past, data_robot
from covista_service.dashboard.sources import Sources
from covista_service.store.database import open_engine
from covista_service.store.migrations import upgrade
from covista_service.store.rows import Entry, write
from covista_service.store.tables import gaps
from sqlalchemy import Engine, insert

from tests.service.api.conftest import Desk
from tests.service.station.scenes import START_NS

Standing = Mapping[str, Sequence[str]]


def at(seconds: float) -> datetime:
    return time_of(START_NS) + timedelta(seconds=seconds)


def us(seconds: float) -> int:
    return START_NS // 1000 + round(seconds * 1e6)


def ns(seconds: float) -> int:
    return 1000 * us(seconds)


def ms(seconds: float) -> int:
    return us(seconds) // 1000


def groups(revision: int, seconds: float, standing: Standing, gone: Sequence[str] = ()) -> GroupsReport:
    """Who stood with whom from then on, by labels."""
    return GroupsReport(
        revision=revision,
        time=at(seconds),
        groups=[Group(label=label, robots=list(robots)) for label, robots in standing.items()],
        ungrouped=[Ungrouped(robot=robot, reason="gone") for robot in gone],
        criterion="adaptive",
        scores=[],
        settings=LiveSettings(),
    )


@dataclass
class PagesDesk(Desk):
    """A desk that answers the pages too, and whose history one writes."""

    engine: Engine = field(init=False)

    def __post_init__(self) -> None:
        super().__post_init__()
        self.engine = open_engine(self.database)
        with self.engine.begin() as connection:
            upgrade(connection)
        for part in (data, data_past, data_robot):
            self.app.include_router(part.router, prefix="/dashboard")
        parts = self.parts
        self.sources = Sources(
            parts.name, parts.loop, parts.telemetry, parts.health, parts.vitals, parts.gate, parts.archive
        )

    async def _stateful(self, scope: dict[str, Any], receive: Any, send: Any) -> None:
        scope["state"] = {"parts": self.parts, "dashboard": self.sources}
        await self.app(scope, receive, send)

    def write(self, *entries: Entry) -> None:
        with self.engine.begin() as connection:
            write(connection, entries)

    def write_gap(self, since_s: float, until_s: float, reason: str) -> None:
        row = {"since_us": us(since_s), "until_us": us(until_s), "lost": 1, "reason": reason}
        with self.engine.begin() as connection:
            connection.execute(insert(gaps), row)

    def data(self, path: str) -> Any:
        """What a page is told."""
        response = self.ask(f"/dashboard/data{path}")
        assert response.status_code == 200, response.text
        return response.json()

    def close(self) -> None:
        self.archive.close()
        self.engine.dispose()


@pytest.fixture
def pages_desk(tmp_path: Path) -> Iterator[PagesDesk]:
    desk = PagesDesk(database=f"sqlite:///{tmp_path / 'covista.db'}")
    yield desk
    desk.close()

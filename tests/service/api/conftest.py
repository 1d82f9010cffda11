import asyncio
import json
from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Any

import httpx
import pytest
from covista_schemas.reports import Health, PartHealth
from covista_service.access import Gate, Keyring
from covista_service.api import rest
from covista_service.api.deps import Parts
from covista_service.api.stream import Stream
from covista_service.link.mailbox import Depths
from covista_service.loop import CrewStatus, Loop, SinkStatus
from covista_service.loop.vitals import Vitals
from covista_service.station.events import Event
from covista_service.store.archive import Archive
from covista_service.telemetry import Telemetry

from tests.service.hands import Hands
from tests.service.station.scenes import Scene


class Silence:
    """A source that nothing comes from."""

    def attach(self, wake: object) -> None:
        pass

    def drain(self, limit: int, now_ns: int) -> tuple[Iterable[Event], int | None]:
        return (), None


def open_gate(*, any_host: bool) -> Gate:
    """A gate of a station without tokens."""
    keyring = Keyring()
    keyring.take([])
    return Gate(keyring, any_host=any_host)


@dataclass
class Desk:
    """The REST interface of a scene's station, without a network."""

    scene: Scene = field(default_factory=Scene)
    vitals: Vitals = field(
        default_factory=lambda: Vitals(
            mail=Depths(robots=3, messages=4, payload_bytes=5),
            crew=CrewStatus(
                "threads", 2, fallback="no scheduler", lost=1, retried=6, overdue=2, given_up=3, shipped_bytes=4
            ),
            sinks={"zenoh": SinkStatus(7, 8, 9), "history": SinkStatus(10, 11, 12)},
            turned_away={"wrong_key": 2},
            link_refused={"unlisted": 3},
            sessions=13,
        )
    )
    health: Health = field(default_factory=lambda: Health(status="ready", parts={"link": PartHealth(status="ready")}))

    # Nobody keeps a history there.
    database: str = "sqlite:////nowhere/covista.db"
    gate: Gate = field(default_factory=lambda: open_gate(any_host=True))

    def __post_init__(self) -> None:
        self.app = rest.build()
        telemetry = Telemetry()
        loop = Loop(self.scene.station, Silence(), Hands(), [], telemetry, clock=lambda: self.scene.now_ns)
        self.archive = Archive(self.database)
        self.parts = Parts(
            loop,
            telemetry,
            lambda: self.health,
            lambda: self.vitals,
            "test",
            self.gate,
            archive=self.archive,
            flush=lambda _: True,
            stream=Stream(),
        )

    async def _stateful(self, scope: dict[str, Any], receive: Any, send: Any) -> None:
        scope["state"] = {"parts": self.parts}
        await self.app(scope, receive, send)

    def ask(self, path: str, method: str = "GET", content: str | None = None, **headers: str) -> httpx.Response:
        """One request, while the station turns."""

        async def asking() -> httpx.Response:
            transport = httpx.ASGITransport(self._stateful, raise_app_exceptions=False)
            async with httpx.AsyncClient(transport=transport, base_url="http://station") as client:
                turning = asyncio.create_task(self._turn())
                try:
                    return await client.request(method, path, headers=headers, content=content)
                finally:
                    turning.cancel()

        return asyncio.run(asking())

    async def _turn(self) -> None:
        while True:
            if self.parts.loop._wanted:
                self.parts.loop.turn()
            await asyncio.sleep(0)

    def send(self, method: str, path: str, body: object, **headers: str) -> httpx.Response:
        """One request with a body."""
        headers = {"content-type": "application/json"} | headers
        return self.ask(f"/api/v1{path}", method, body if isinstance(body, str) else json.dumps(body), **headers)

    def get(self, path: str, **headers: str) -> httpx.Response:
        """One question to the API."""
        return self.ask(f"/api/v1{path}", **headers)


@pytest.fixture(scope="module")
def desk() -> Desk:
    """Two robots that see the same, and one that has sent no keyframe."""
    desk = Desk()
    desk.scene.send("r1")
    desk.scene.send("r2")
    desk.scene.settle()
    desk.scene.send_pose("r4", desk.scene.keyframe("r4").pose)
    desk.scene.settle()
    return desk

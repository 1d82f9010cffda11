"""Clients and listeners of an audience, at a real server."""

import asyncio
import time
from collections.abc import AsyncIterator
from datetime import UTC, datetime

import uvicorn
from covista_schemas.reports import EventKind, EventReport
from covista_service.bench.audience import Attended, Audience, AudienceOptions
from starlette.applications import Starlette
from starlette.requests import Request
from starlette.responses import PlainTextResponse, Response, StreamingResponse
from starlette.routing import Route

DEADLINE_S = 10.0


class House:
    """A server that answers "/good" with 200 and "/bad" with 503, and tells of events."""

    def __init__(self) -> None:
        self.asked = 0
        self.followers = 0
        self.news = asyncio.Event()
        routes = [Route("/good", self._good), Route("/bad", self._bad), Route("/api/v1/events", self._events)]
        config = uvicorn.Config(Starlette(routes=routes), port=0, lifespan="off", log_config=None, http="h11")
        self._server = uvicorn.Server(config)
        self._serving: asyncio.Task[None] | None = None

    async def open(self) -> str:
        self._serving = asyncio.create_task(self._server._serve())
        async with asyncio.timeout(DEADLINE_S):
            while not self._server.started:
                await asyncio.sleep(0.01)
        return f"http://127.0.0.1:{self._server.servers[0].sockets[0].getsockname()[1]}"

    async def close(self) -> None:
        self._server.should_exit = self._server.force_exit = True
        assert self._serving is not None
        await self._serving

    async def _good(self, request: Request) -> Response:
        self.asked += 1
        return PlainTextResponse("good" * 50_000)

    async def _bad(self, request: Request) -> Response:
        return PlainTextResponse("bad", 503)

    async def _events(self, request: Request) -> Response:
        self.followers += 1
        return StreamingResponse(self._tell(), media_type="text/event-stream")

    async def _tell(self) -> AsyncIterator[str]:
        yield ": hello\n\n"
        await self.news.wait()
        for number, kind in enumerate((EventKind.GROUPS, EventKind.WARNING), 7):
            report = EventReport(id=number, event=kind, time=datetime.now(UTC), text="data: groups")
            yield f"id: {number}\nevent: {kind}\ndata: {report.model_dump_json()}\n\n"
        await asyncio.sleep(DEADLINE_S)


def attend(options: AudienceOptions, enough: int) -> tuple[Attended, Attended, House]:
    """What was seen until so many answers were asked for, or events heard of, and since."""

    async def attending() -> tuple[Attended, Attended, House]:
        house = House()
        url = await house.open()
        audience = Audience(AudienceOptions(url, options.paths, options.clients, options.period_s, options.listeners))
        task = asyncio.create_task(audience.attend())
        try:
            async with asyncio.timeout(DEADLINE_S):
                await audience.listening.wait()
                house.news.set()
                while house.asked < enough and sum(audience._heard.values()) < enough:
                    await asyncio.sleep(0.01)
            return audience.told(), audience.told(), house
        finally:
            task.cancel()
            await asyncio.wait([task])
            await house.close()

    return asyncio.run(attending())


def test_every_client_asks_for_every_path_and_what_fails_is_counted() -> None:
    begun_s = time.monotonic()
    seen, since, house = attend(AudienceOptions("", ("/good", "/bad"), clients=3, period_s=0.1), enough=12)
    assert len(seen.times_ms["/good"]) >= 9
    assert abs(len(seen.times_ms["/good"]) - len(seen.times_ms["/bad"])) <= 3
    assert seen.failures == len(seen.times_ms["/bad"])
    assert all(0 < each < DEADLINE_S * 1e3 for times in seen.times_ms.values() for each in times)
    assert time.monotonic() - begun_s >= 0.2
    assert not since.times_ms["/good"]
    assert house.followers == 0


def test_every_listener_hears_of_changes_of_the_groups_alone() -> None:
    seen, since, house = attend(AudienceOptions("", listeners=5), enough=5)
    assert house.followers == 5
    assert seen.heard == {7: 5}
    assert len(seen.delays_ms) == 5
    assert all(0 <= each < DEADLINE_S * 1e3 for each in seen.delays_ms)
    assert (seen.failures, since.heard) == (0, {})

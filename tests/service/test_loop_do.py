"""What somebody wants done, in the loop's own thread: each once, in order, and heard of."""

import asyncio
from collections import deque
from collections.abc import Awaitable, Callable, Iterable, Iterator
from contextlib import suppress

import pytest
from covista_service.loop import Loop, News, Sink
from covista_service.station.events import Event, ForgetRobot, SettingsGiven
from covista_service.station.options import StationOptions
from covista_service.station.station import Station
from covista_service.telemetry import Telemetry

from tests.service.deadline import DEADLINE_S
from tests.service.hands import Hands


class Quiet:
    """A source that nothing comes from, or mail that cannot be opened."""

    def __init__(self) -> None:
        self.broken = False

    def attach(self, wake: Callable[[], None]) -> None:
        pass

    def drain(self, limit: int, now_ns: int) -> tuple[Iterable[Event], int | None]:
        return self._opened(), None

    def _opened(self) -> Iterator[Event]:
        if self.broken:
            raise ZeroDivisionError
        yield from ()


class Notebook:
    def __init__(self) -> None:
        self.news: list[News] = []

    def take(self, news: News) -> None:
        self.news.append(news)


class Broken:
    def take(self, news: News) -> None:
        raise OSError("no pen")


class Restless(deque):
    """Workers append to it whenever somebody looks."""

    def __iter__(self) -> Iterator[Event]:
        raise RuntimeError("deque mutated during iteration")


class Desk:
    """A loop that is turned by hand."""

    def __init__(self, *sinks: Sink) -> None:
        self.source, self.telemetry, self.station = Quiet(), Telemetry(), Station()
        self.notebook = Notebook()
        self.loop = Loop(self.station, self.source, Hands(), [*sinks, self.notebook], self.telemetry)
        self.wanted: list[Event] = []
        receive = self.station.receive

        def heard(event: Event, now_ns: int) -> list:
            if isinstance(event, SettingsGiven | ForgetRobot):
                self.wanted.append(event)
            return receive(event, now_ns)

        self.station.receive = heard  # type: ignore[method-assign]


def given(text: str) -> SettingsGiven:
    return SettingsGiven(StationOptions().grouping, text, patch={"text": text})


def through(scenario: Callable[[], Awaitable[None]]) -> None:
    async def timed() -> None:
        async with asyncio.timeout(DEADLINE_S):
            await scenario()

    asyncio.run(timed())


async def begun(desk: Desk, *events: Event) -> list[asyncio.Task[None]]:
    """All of these wanted, in order, and no turn yet."""
    tasks = [asyncio.create_task(desk.loop.do(event)) for event in events]
    await asyncio.sleep(0)
    return tasks


async def cancelled(task: asyncio.Task[None]) -> None:
    task.cancel()
    with suppress(asyncio.CancelledError):
        await task


def test_what_is_wanted_is_done_once_and_in_order_and_the_sinks_have_heard_of_it() -> None:
    async def scenario() -> None:
        tasks = await begun(desk, given("a"), ForgetRobot("r1"), given("b"))
        desk.loop.turn()
        await asyncio.gather(*tasks)
        desk.loop.turn()

    desk = Desk()
    through(scenario)
    assert desk.wanted == [given("a"), ForgetRobot("r1"), given("b")]
    assert desk.notebook.news[0].patch == {"text": "b"}


def test_workers_that_report_meanwhile_are_in_nobody_s_way() -> None:
    async def scenario() -> None:
        desk.loop._results = Restless()
        (task,) = await begun(desk, given("a"))
        desk.loop.turn()
        await task

    desk = Desk()
    through(scenario)
    assert desk.wanted == [given("a")]


def test_who_waits_no_more_takes_back_what_it_wanted_and_not_what_another_wants_likewise() -> None:
    async def scenario() -> None:
        tasks = await begun(desk, given("a"), given("b"), given("a"))
        await cancelled(tasks[2])
        desk.loop.turn()
        await asyncio.gather(*tasks[:2])

    desk = Desk()
    through(scenario)
    assert desk.wanted == [given("a"), given("b")]


def test_a_sink_that_fails_keeps_news_from_nobody(caplog: pytest.LogCaptureFixture) -> None:
    async def scenario() -> None:
        (task,) = await begun(desk, given("a"))
        desk.loop.turn()
        await task

    desk = Desk(Broken())
    through(scenario)
    assert [news.patch for news in desk.notebook.news] == [{"text": "a"}]
    assert desk.telemetry.registry.get_sample_value("covista_faults_total", {"where": "sink"}) == 1
    assert "no pen" in caplog.text


def test_mail_that_cannot_be_opened_leaves_nobody_waiting_for_what_was_done() -> None:
    async def scenario() -> None:
        (task,) = await begun(desk, given("a"))
        with pytest.raises(ZeroDivisionError):
            desk.loop.turn()
        await task

    desk = Desk()
    desk.source.broken = True
    through(scenario)
    assert desk.wanted == [given("a")]
    assert [news.patch for news in desk.notebook.news] == [{"text": "a"}]


def test_news_that_cannot_be_made_is_told_to_who_waits(monkeypatch: pytest.MonkeyPatch) -> None:
    async def scenario() -> None:
        (task,) = await begun(desk, given("a"))
        with monkeypatch.context() as bug:
            bug.setattr(desk.station, "snapshot", lambda now_ns: 1 / 0)
            with pytest.raises(ZeroDivisionError):
                desk.loop.turn()
        with pytest.raises(ZeroDivisionError):
            await task

    desk = Desk()
    through(scenario)


def test_what_the_station_fails_at_is_wanted_again_by_nobody() -> None:
    """What comes after it in the same turn is done all the same."""

    async def scenario() -> None:
        receive = desk.station.receive

        def buggy(event: Event, now_ns: int) -> list:
            effects = receive(event, now_ns)
            if event == given("a"):
                raise ZeroDivisionError
            return effects

        desk.station.receive = buggy  # type: ignore[method-assign]
        tasks = await begun(desk, given("a"), given("b"))
        desk.loop.turn()
        await asyncio.gather(*tasks)

    desk = Desk()
    through(scenario)
    assert desk.wanted == [given("a"), given("b")]

import asyncio
import time
from collections.abc import Awaitable, Callable, Iterable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import suppress

import pytest
from covista_schemas.codec import BAD_IMAGE
from covista_schemas.errors import DecodeError
from covista_schemas.reports import EventKind, FoundBy
from covista_service.link.inbox import Inbox
from covista_service.link.mailbox import Letter, Mailboxes
from covista_service.loop import TICK_S, Loop, News
from covista_service.station.events import Event, MessagesReceived, SurveyPair, TokenSeen
from covista_service.station.station import Station
from covista_service.telemetry import WORKER_FAILED, Telemetry

from tests.service.deadline import DEADLINE_S
from tests.service.hands import Hands
from tests.service.wall import keyframe_bytes, overlap, picture_bytes, pose_bytes


class Notebook:
    """A sink that remembers."""

    def __init__(self) -> None:
        self.news: list[News] = []

    def take(self, news: News) -> None:
        self.news.append(news)


class Desk:
    """A loop with mailboxes before it and a notebook behind it; time is an argument."""

    def __init__(self, **options: int) -> None:
        self.now_ns = 1_700_000_000_000_000_000
        self.mailboxes = Mailboxes()
        self.hands = Hands()
        self.notebook = Notebook()
        self.telemetry = Telemetry()
        self.station = Station()
        self.loop = Loop(
            self.station,
            Inbox(self.mailboxes),
            self.hands,
            [self.notebook],
            self.telemetry,
            clock=lambda: self.now_ns,
            **options,
        )

    def put(self, data: bytes, robot: str, sequence: int = 0) -> None:
        self.mailboxes.put(Letter(robot, "keyframe", "b0", sequence, data, self.now_ns))

    def wait(self) -> None:
        """Let so much time pass that every robot has its turn again."""
        self.now_ns += 100_000_000

    def settle(self) -> None:
        for _ in range(10):
            self.loop.turn()


def test_keyframes_become_overlaps_groups_and_news() -> None:
    desk = Desk(next_event=100)
    desk.put(keyframe_bytes("r1", 0.0), "r1")
    desk.put(keyframe_bytes("r2", 1.0), "r2")
    desk.settle()
    pair = desk.loop.snapshot().pair("r1", "r2")
    assert pair.found_by is FoundBy.IMAGE
    assert pair.overlap_a == pytest.approx(overlap(1.0), abs=0.05)
    assert any(news.groups_changed and set(news.robots) == {"r1", "r2"} for news in desk.notebook.news)
    numbers = [event.id for news in desk.notebook.news for event in news.events]
    assert numbers == list(range(100, 100 + len(numbers)))
    assert EventKind.GROUPS in [event.event for news in desk.notebook.news for event in news.events]
    summary = desk.telemetry.summary()
    assert (summary.surveys, summary.under_way, summary.keyframes_received) == (1, 0, 2)
    assert summary.outcomes == {"measured": 1}


def sample(desk: Desk, name: str, **labels: str) -> float | None:
    return desk.telemetry.registry.get_sample_value(name, labels)


def test_jobs_and_stages_are_timed() -> None:
    desk = Desk()
    desk.put(picture_bytes("r1"), "r1")
    desk.put(keyframe_bytes("r2", 1.0), "r2")
    desk.put(keyframe_bytes("r3", 0.0), "r3")
    desk.settle()
    done = {kind: sample(desk, "covista_job_seconds_count", kind=kind) for kind in ("extract", "compare", "build")}
    assert done["extract"] == 1
    assert done["compare"] == desk.telemetry.summary().surveys > 0
    assert done["build"] == sample(desk, "covista_reading_seconds_count")
    assert sample(desk, "covista_regroup_seconds_count") == 10


def test_latency_runs_from_arrival_to_the_groups_with_a_survey_of_it() -> None:
    desk = Desk()
    desk.put(keyframe_bytes("r1", 0.0), "r1")
    desk.put(keyframe_bytes("r2", 1.0), "r2")
    desk.now_ns += 280_000_000
    desk.settle()
    # What comes within 20 ms of an evaluation waits for the next.
    assert desk.telemetry.summary().latency_p50_ms is None
    desk.now_ns += 20_000_000
    desk.settle()
    assert desk.telemetry.summary().latency_p50_ms == pytest.approx(300)
    assert desk.telemetry.summary().latency_p99_ms == pytest.approx(300)


@pytest.mark.parametrize(
    ("failure", "code"),
    [(DecodeError(BAD_IMAGE, "image", "cannot be decoded"), BAD_IMAGE), (MemoryError("much"), WORKER_FAILED)],
)
def test_a_failed_extraction_drops_its_keyframe_alone(failure: Exception, code: str) -> None:
    desk = Desk()
    desk.hands.failure = failure
    desk.put(picture_bytes("r1"), "r1")
    desk.settle()
    robot = desk.loop.snapshot().robots["r1"]
    assert robot.keyframes.dropped == {code: 1}
    assert robot.last_problem is not None
    assert str(failure) in robot.last_problem
    desk.hands.failure = None
    desk.wait()
    desk.put(picture_bytes("r1", sequence=1), "r1", 1)
    desk.settle()
    assert desk.loop.snapshot().robots["r1"].keyframes.used == 1


def test_a_crew_that_cannot_take_a_job_gives_it_back(monkeypatch: pytest.MonkeyPatch) -> None:
    """Nothing stays in flight for ever: with a crew that can, the next keyframes are surveyed."""

    def refuse(job: SurveyPair) -> Future:
        raise OSError("no more processes")

    desk = Desk()
    with monkeypatch.context() as broken:
        broken.setattr(desk.hands, "survey", refuse)
        for turn in range(4):
            desk.put(keyframe_bytes("r1", 0.0, sequence=turn), "r1", turn)
            desk.put(keyframe_bytes("r2", 1.0, sequence=turn), "r2", turn)
            desk.settle()
            desk.wait()
    assert desk.telemetry.summary().under_way == 0
    desk.put(keyframe_bytes("r1", 0.0, sequence=4), "r1", 4)
    desk.settle()
    assert desk.loop.snapshot().pair("r1", "r2").found_by is FoundBy.IMAGE


def test_workers_come_and_go() -> None:
    """Never more is under way than they can take, from the next turn on; what is under way is let be."""
    desk = Desk()
    held: list[Future] = []

    def take(job: SurveyPair) -> Future:
        held.append(Future())
        return held[-1]

    desk.hands.survey = take  # type: ignore[method-assign]
    for number in range(8):
        desk.put(keyframe_bytes(f"r{number}", 0.1 * number), f"r{number}")
    desk.settle()
    assert len(held) == desk.station.options.capacity == 2
    desk.hands.capacity = 5
    desk.settle()
    assert len(held) == 5
    desk.hands.capacity = 1
    for done in held[:4]:
        done.set_exception(ValueError("singular"))
        desk.settle()
    assert len(held) == 5
    held[4].set_exception(ValueError("singular"))
    desk.settle()
    assert len(held) == 6


def test_a_failed_survey_is_counted_and_survived(caplog: pytest.LogCaptureFixture) -> None:
    desk = Desk()
    desk.hands.failure = ValueError("singular")
    desk.put(keyframe_bytes("r1", 0.0), "r1")
    desk.put(keyframe_bytes("r2", 1.0), "r2")
    desk.settle()
    assert desk.telemetry.summary().outcomes == {WORKER_FAILED: 1}
    failed = [record.fields for record in caplog.records if record.levelname == "ERROR"]
    assert {"job": "surveying a pair", "pair": "r1/r2"} in failed
    assert all(each.keys() & {"pair", "robots"} for each in failed)
    assert desk.loop.snapshot().pair("r1", "r2").compared is None


def test_a_bug_that_one_event_brings_to_light_does_not_stop_the_others(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    desk = Desk()
    receive = desk.station.receive

    def buggy(event: Event, now_ns: int) -> list:
        if isinstance(event, MessagesReceived) and event.robot == "r1":
            raise ZeroDivisionError
        return receive(event, now_ns)

    monkeypatch.setattr(desk.station, "receive", buggy)
    desk.mailboxes.put(Letter("r1", "pose", "b0", 0, pose_bytes("r1"), desk.now_ns))
    desk.mailboxes.put(Letter("r2", "pose", "b0", 0, pose_bytes("r2"), desk.now_ns))
    desk.settle()
    assert desk.loop.snapshot().robots["r2"].poses.used == 1
    assert "ZeroDivisionError" in caplog.text
    assert sample(desk, "covista_faults_total", where="station") == 1
    assert {record.fields["robot"] for record in caplog.records} == {"r1"}


@pytest.mark.parametrize(
    ("where", "what"), [("_groups", "evaluate"), ("_keyframes", "due"), ("_pairs", "expire"), ("_roster", "lapsed")]
)
def test_a_part_of_a_tick_that_fails_keeps_no_job_from_the_workers(
    where: str, what: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    desk = Desk()

    def broken(*arguments: object, **options: object) -> None:
        raise ZeroDivisionError

    with monkeypatch.context() as bug:
        bug.setattr(getattr(desk.station, where), what, broken)
        desk.put(picture_bytes("r1"), "r1")
        desk.settle()
        assert sample(desk, "covista_job_seconds_count", kind="extract") == 1
        desk.wait()
        desk.put(keyframe_bytes("r1", 0.0, sequence=1), "r1", 1)
        desk.put(keyframe_bytes("r2", 1.0), "r2")
        desk.settle()
        assert desk.telemetry.summary().outcomes == {"measured": 1}
        assert desk.loop.snapshot().pair("r1", "r2").found_by is FoundBy.IMAGE
        assert desk.telemetry.summary().under_way == 0
    desk.wait()
    desk.settle()
    assert [len(group.robots) for group in desk.loop.snapshot().groups.groups] == [2]
    assert (sample(desk, "covista_faults_total", where="station") or 0) >= 3


def test_a_crew_that_cannot_say_how_it_is_costs_no_message(monkeypatch: pytest.MonkeyPatch) -> None:
    desk = Desk()
    desk.put(keyframe_bytes("r1", 0.0), "r1")

    def broken() -> None:
        raise ConnectionError

    with monkeypatch.context() as bug:
        bug.setattr(desk.hands, "status", broken)
        with pytest.raises(ConnectionError):
            desk.loop.turn()
    desk.settle()
    assert desk.loop.snapshot().robots["r1"].keyframes.used == 1


def test_a_crowd_is_taken_in_by_batches() -> None:
    desk = Desk()
    for number in range(100):
        desk.mailboxes.token(f"r{number}", "b0", True, desk.now_ns)
    assert desk.loop.turn()
    assert len(desk.loop.snapshot().robots) < 100
    while desk.loop.turn():
        pass
    assert len(desk.loop.snapshot().robots) == 100


class Spring:
    """A source that gives one event per wake-up."""

    def __init__(self) -> None:
        self.wake: Callable[[], None] = lambda: None
        self.waiting: list[Event] = []
        self.next_ns: int | None = None
        self.drained = 0

    def attach(self, wake: Callable[[], None]) -> None:
        self.wake = wake

    def drain(self, limit: int, now_ns: int) -> tuple[Iterable[Event], int | None]:
        self.drained += 1
        taken, self.waiting = self.waiting, []
        next_ns, self.next_ns = self.next_ns, None
        return taken, next_ns


async def until(look: Callable[[], bool]) -> None:
    async with asyncio.timeout(DEADLINE_S):
        while not look():
            await asyncio.sleep(0.005)


def running(scenario: Callable[[Loop, Spring], Awaitable[None]], telemetry: Telemetry | None = None) -> Loop:
    """Run a scenario beside a running loop."""
    spring = Spring()
    loop = Loop(Station(), spring, Hands(), [], telemetry or Telemetry())

    async def together() -> None:
        task = asyncio.create_task(loop.run())
        await scenario(loop, spring)
        task.cancel()
        with suppress(asyncio.CancelledError):
            await task

    asyncio.run(together())
    return loop


def test_turns_are_timed() -> None:
    telemetry = Telemetry()

    def turns() -> float:
        return telemetry.registry.get_sample_value("covista_turn_seconds_count") or 0.0

    async def scenario(loop: Loop, spring: Spring) -> None:
        await until(lambda: loop.running)
        for turned in range(1, 4):
            before = turns()
            spring.waiting.append(TokenSeen(f"r{turned}", "b0"))
            spring.wake()
            await until(lambda seen=before: turns() > seen)

    running(scenario, telemetry)
    assert turns() >= 3


def test_a_source_that_fails_once_is_asked_again(caplog: pytest.LogCaptureFixture) -> None:
    async def scenario(loop: Loop, spring: Spring) -> None:
        drain, spring.drain = spring.drain, broken
        await asyncio.sleep(0)
        spring.wake()
        await until(lambda: "OSError" in caplog.text)
        spring.drain = drain
        spring.waiting.append(TokenSeen("r1", "b0"))
        spring.wake()
        await until(lambda: "r1" in loop.snapshot().robots)

    def broken(limit: int, now_ns: int) -> tuple[Iterable[Event], int | None]:
        raise OSError

    running(scenario)


def test_what_falls_due_later_is_fetched_then_without_a_wake_up() -> None:
    async def scenario(loop: Loop, spring: Spring) -> None:
        await asyncio.sleep(0)
        spring.next_ns = time.time_ns() + 30_000_000
        spring.wake()
        await until(lambda: spring.next_ns is None)
        drained, spring.waiting = spring.drained, [TokenSeen("r1", "b0")]
        async with asyncio.timeout(TICK_S / 2):
            await until(lambda: "r1" in loop.snapshot().robots)
        assert spring.drained > drained

    running(scenario)


def test_a_robot_in_a_hurry_has_its_turns_and_another_its_own() -> None:
    desk = Desk()
    for sequence in range(60):
        desk.put(keyframe_bytes("r1", 0.0, sequence=sequence), "r1", sequence)
        if sequence % 20 == 7:
            desk.put(keyframe_bytes("r2", 1.0, sequence=sequence // 20), "r2", sequence // 20)
            desk.loop.turn()
            assert desk.loop.snapshot().robots["r2"].keyframes.received == sequence // 20 + 1
        desk.now_ns += 10_000_000
        desk.loop.turn()
    desk.wait()
    desk.settle()
    hurry, steady = (desk.loop.snapshot().robots[robot].keyframes for robot in ("r1", "r2"))
    assert (hurry.received, steady.received) == (60, 3)
    assert steady.used == 3
    assert hurry.used + hurry.replaced == 60
    assert hurry.used <= 600 / 50 + 2


@pytest.fixture
def other_thread() -> Iterator[ThreadPoolExecutor]:
    with ThreadPoolExecutor(1) as executor:
        yield executor


def test_other_threads_wake_and_ask(other_thread: ThreadPoolExecutor) -> None:
    async def scenario(loop: Loop, spring: Spring) -> None:
        await asyncio.sleep(0)
        spring.waiting.append(TokenSeen("r1", "b0"))
        await asyncio.wrap_future(other_thread.submit(spring.wake))
        await until(lambda: "r1" in loop.snapshot().robots)
        snapshot = await asyncio.wrap_future(other_thread.submit(loop.ask))
        assert "r1" in snapshot.robots

    running(scenario)


def test_after_the_end_nobody_waits() -> None:
    async def scenario(loop: Loop, spring: Spring) -> None:
        await asyncio.sleep(0)

    loop = running(scenario)
    loop.wake()
    with pytest.raises(TimeoutError):
        loop.ask()


def test_before_the_start_nobody_answers() -> None:
    desk = Desk()
    with pytest.raises(TimeoutError):
        desk.loop.ask(timeout_s=0.01)

"""The task itself."""

from __future__ import annotations

import asyncio
import itertools
import logging
import time
from collections import deque
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import Future
from contextlib import nullcontext, suppress
from typing import TypeVar

from covista_schemas.errors import DecodeError

from covista_service.answers import event_report, live_settings
from covista_service.loop.courtesy import give_way
from covista_service.loop.parties import Built, Crew, Extraction, News, Sink, Source
from covista_service.perception.comparison import Comparison
from covista_service.station.census import Census
from covista_service.station.events import (
    BuildSurfaces,
    Effect,
    Event,
    ExtractFeatures,
    FeaturesExtracted,
    GroupsChanged,
    GroupsEvaluated,
    Happened,
    InterruptedTickError,
    Keyframe,
    KeyframeArrived,
    MessageDropped,
    MessagesReceived,
    PoseArrived,
    SettingsGiven,
    SurfacesBuilt,
    SurveyDone,
    SurveyPair,
    Tick,
)
from covista_service.station.snapshot import Snapshot
from covista_service.station.station import Station
from covista_service.telemetry import WORKER_FAILED, JobKind, Stage, Telemetry, about
from covista_service.telemetry.journal import note_effect, note_event, robot_of

TICK_S = 0.25
# While news of keyframes waits to be evaluated.
SOON_S = 0.02
# Whoever wants something done waits so long for a turn.
DO_TIMEOUT_S = 5.0
# Mail of so many robots is opened before workers' results and other tasks get their turn.
BATCH = 32
_NS_PER_S = 1e9
# What takes the station long enough to be timed.
_STAGES: Mapping[type[Event], Stage] = {Tick: "regroup", SurfacesBuilt: "reading"}
_UNTIMED = nullcontext()
_T = TypeVar("_T")
log = logging.getLogger(__name__)


class Loop:
    """Owns the station. `run` is the task; `snapshot` is for its thread, `ask` for all others."""

    def __init__(
        self,
        station: Station,
        source: Source,
        crew: Crew,
        sinks: Sequence[Sink],
        telemetry: Telemetry,
        *,
        next_event: int = 1,
        clock: Callable[[], int] = time.time_ns,
    ) -> None:
        self._station = station
        self._source = source
        self._crew = crew
        self._sinks = sinks
        self._telemetry = telemetry
        self._event_ids = itertools.count(next_event)
        self._clock = clock
        self._results: deque[Event] = deque()
        # What somebody wants done, and who waits for it. Only the loop's own thread sees it.
        self._wanted: list[tuple[Event, asyncio.Future[None]]] = []
        self._awake = asyncio.Event()
        self._asyncio: asyncio.AbstractEventLoop | None = None
        self._turned_ns = clock()
        self._next_ns: int | None = None
        self._capacity = station.options.capacity

    async def run(self) -> None:
        """Turn until cancelled: when there is something to do, and every quarter of a second."""
        self._asyncio = asyncio.get_running_loop()
        self._source.attach(self.wake)
        while True:
            with suppress(TimeoutError):
                async with asyncio.timeout(self._rest_s()):
                    await self._awake.wait()
            self._awake.clear()
            begun_s = time.perf_counter()
            try:
                with self._telemetry.timed("turn"):
                    more = self.turn()
                if more:
                    self._awake.set()
            except Exception:
                # The swarm is better served by a station that lost one batch than by none.
                self._telemetry.fault("loop")
                log.exception("a turn failed; going on")
            await give_way(time.perf_counter() - begun_s, self._telemetry.is_asked)

    def turn(self) -> bool:
        """Take in one batch and act on it; True if there is more to take in."""
        began_ns, self._next_ns = self._clock(), None
        # Before anything is taken in: a crew that cannot tell must not cost a batch.
        self._resize()
        events, self._next_ns = self._source.drain(BATCH, began_ns)
        effects, done = list[Effect](), list[tuple[Event, asyncio.Future[None]]]()
        try:
            for event in itertools.chain(self._reported(), self._asked(done), events, (Tick(),)):
                effects += self._receive(event)
        finally:
            self._conclude(effects, done)
        self._turned_ns = self._clock()
        return bool(self._results or self._wanted) or (self._next_ns is not None and self._next_ns <= began_ns)

    def wake(self) -> None:
        """Have a turn soon; from any thread, at any time."""
        if self._asyncio is not None:
            try:
                self._asyncio.call_soon_threadsafe(self._awake.set)
            except RuntimeError:
                log.debug("woken after the end")

    async def do(self, event: Event) -> None:
        """Have the station take in an event of one's own; returns once it has, and the sinks have heard of it.

        Only in the loop's own thread. Raises TimeoutError where no turn comes; then nothing comes of the event either.
        """
        done: asyncio.Future[None] = asyncio.get_running_loop().create_future()
        wanted = (event, done)
        self._wanted.append(wanted)
        self._awake.set()
        try:
            await asyncio.wait_for(done, DO_TIMEOUT_S)
        finally:
            # What was not taken in must not be done when nobody waits for it any more. An equal event is another's.
            self._wanted = [each for each in self._wanted if each is not wanted]

    def snapshot(self) -> Snapshot:
        """The station as it is; only in the loop's own thread."""
        return self._station.snapshot(self._clock())

    def census(self) -> Census:
        """The station in numbers; only in the loop's own thread."""
        return self._station.census()

    def ask(self, timeout_s: float = 1.0) -> Snapshot:
        """The station as it is, for other threads. Raises TimeoutError, also when the loop is not running."""
        answer: Future[Snapshot] = Future()
        try:
            if self._asyncio is not None:
                self._asyncio.call_soon_threadsafe(lambda: answer.set_result(self.snapshot()))
        except RuntimeError as error:
            raise TimeoutError("the station has ended") from error
        return answer.result(timeout_s)

    @property
    def running(self) -> bool:
        """Has it begun?"""
        return self._asyncio is not None

    def silent_s(self) -> float:
        """Seconds since the last turn."""
        return (self._clock() - self._turned_ns) / _NS_PER_S

    def _rest_s(self) -> float:
        """How long to rest until something is to be done, unless somebody wakes it."""
        rest_s = SOON_S if self._station.waits else TICK_S
        if self._next_ns is None:
            return rest_s
        return min(rest_s, max(0.0, (self._next_ns - self._clock()) / _NS_PER_S))

    def _resize(self) -> None:
        """Workers come and go: never more is under way than they can take."""
        capacity = self._crew.status().capacity
        if capacity != self._capacity:
            self._capacity = capacity
            self._station.resize(capacity)

    def _reported(self) -> Iterator[Event]:
        """What workers have found until now."""
        for _ in range(len(self._results)):
            yield self._results.popleft()

    def _asked(self, done: list[tuple[Event, asyncio.Future[None]]]) -> Iterator[Event]:
        """What is wanted; it is `done` then."""
        while self._wanted:
            done.append(self._wanted.pop(0))
            yield done[-1][0]

    def _conclude(self, effects: Sequence[Effect], done: Sequence[tuple[Event, asyncio.Future[None]]]) -> None:
        """Tell the sinks, and whoever waits that it is done: or that nobody was told of it."""
        waiting = [each for _, each in done if not each.done()]
        try:
            self._tell(effects, [event for event, _ in done if isinstance(event, SettingsGiven)])
        except Exception as error:
            for each in waiting:
                each.set_exception(error)
            raise
        for each in waiting:
            each.set_result(None)

    def _receive(self, event: Event) -> Sequence[Effect]:
        self._count(event)
        stage = _STAGES.get(type(event))
        try:
            with self._telemetry.timed(stage) if stage else _UNTIMED:
                effects = self._station.receive(event, self._clock())
        except Exception as failure:
            # A bug that one robot's message brings to light must not silence the swarm.
            self._telemetry.fault("station")
            log.exception(
                "the station failed; going on", extra=about(event=type(event).__name__, robot=robot_of(event))
            )
            effects = failure.effects if isinstance(failure, InterruptedTickError) else []
        for effect in effects:
            note_effect(effect)
            self._act(effect)
        return effects

    def _count(self, event: Event) -> None:
        match event:
            case MessagesReceived():
                self._telemetry.received(event.topic, len(event.sequences))
                return
            case PoseArrived() | KeyframeArrived():
                # Counted when they were announced.
                return
            case MessageDropped(counted=False):
                self._telemetry.received(event.topic, event.count)
            case FeaturesExtracted():
                self._telemetry.ended("extract")
            case SurveyDone():
                self._telemetry.ended("compare")
                self._telemetry.surveyed(event.found.outcome if event.found else WORKER_FAILED)
            case SurfacesBuilt():
                self._telemetry.ended("build")
        note_event(event)

    def _act(self, effect: Effect) -> None:
        match effect:
            case ExtractFeatures(keyframe):
                self._start("extract", lambda: self._crew.extract(keyframe), lambda done: _extracted(keyframe, done))
            case SurveyPair():
                self._start("compare", lambda: self._crew.survey(effect), lambda done: _surveyed(effect, done))
            case BuildSurfaces():
                self._start("build", lambda: self._crew.build(effect), lambda done: _built(effect, done))
            case GroupsEvaluated(keyframes):
                now_ns = self._clock()
                for _, arrived_ns in keyframes:
                    self._telemetry.grouped((now_ns - arrived_ns) / _NS_PER_S)

    def _start(self, kind: JobKind, submit: Callable[[], Future[_T]], event_of: Callable[[Future[_T]], Event]) -> None:
        self._telemetry.started(kind)
        begun_s = self._telemetry.timer()
        try:
            job = submit()
        except Exception as error:
            # A job that cannot even be handed over has failed like any other: the station must have it back.
            log.exception("a job could not be handed over", extra=about(kind=kind))
            job = Future()
            job.set_exception(error)
        job.add_done_callback(lambda done: self._finish(kind, begun_s, done, event_of))

    def _finish(self, kind: JobKind, begun_s: float, done: Future[_T], event_of: Callable[[Future[_T]], Event]) -> None:
        """Runs in a worker's thread."""
        if not done.cancelled():
            self._telemetry.worked(kind, self._telemetry.timer() - begun_s)
            self._results.append(event_of(done))
            self.wake()

    def _tell(self, effects: Sequence[Effect], given: Sequence[SettingsGiven]) -> None:
        changes = [effect for effect in effects if isinstance(effect, GroupsChanged)]
        happened = [effect for effect in effects if isinstance(effect, Happened)]
        if not changes and not happened and not given:
            return
        events = tuple(event_report(next(self._event_ids), each) for each in happened)
        robots = tuple(dict.fromkeys(robot for change in changes for robot in change.robots))
        patch = {name: value for each in given for name, value in each.patch.items()}
        live = live_settings(given[-1].options) if given else None
        news = News(self.snapshot(), events, bool(changes), robots, live, patch)
        for sink in self._sinks:
            try:
                sink.take(news)
            except Exception:
                # The others must hear of it all the same.
                self._telemetry.fault("sink")
                log.exception("a sink failed; going on", extra=about(sink=type(sink).__name__))


def _extracted(keyframe: Keyframe, done: Future[Extraction]) -> FeaturesExtracted:
    match done.exception():
        case None:
            return FeaturesExtracted(keyframe.id, *done.result())
        case DecodeError() as error:
            return FeaturesExtracted(keyframe.id, None, None, error.code, str(error))
        case failure:
            problem = _describe("extracting features", failure, robot=keyframe.id.robot)
            return FeaturesExtracted(keyframe.id, None, None, WORKER_FAILED, problem)


def _built(job: BuildSurfaces, done: Future[Built]) -> SurfacesBuilt:
    failure = done.exception()
    if failure is None:
        return SurfacesBuilt(job, *done.result())
    robots = ", ".join(name.robot for name in job.keyframes)
    return SurfacesBuilt(job, None, problem=_describe("building surfaces", failure, robots=robots))


def _surveyed(job: SurveyPair, done: Future[Comparison]) -> SurveyDone:
    failure = done.exception()
    if failure is None:
        return SurveyDone(job.first, job.second, done.result())
    pair = f"{job.first.robot}/{job.second.robot}"
    return SurveyDone(job.first, job.second, None, _describe("surveying a pair", failure, pair=pair))


def _describe(what: str, failure: BaseException, **whom: object) -> str:
    log.error("a job failed", exc_info=failure, extra=about(job=what, **whom))
    return f"{what} failed: {type(failure).__name__}: {failure}"

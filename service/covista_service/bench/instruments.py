"""The station's process as in the demo, with instruments on it: its processor time, its memory, and what its loop does.

The station's core has no clock, so that it cannot time its own parts: here some of its calls are timed from outside.
"""

from __future__ import annotations

import functools
import os
import threading
import time
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from covista_schemas.errors import CovistaError

from covista_service import serve, telemetry
from covista_service.config import Settings
from covista_service.demo.children import Line, end_soon
from covista_service.demo.tidings import Failed, Ready
from covista_service.loop import Loop
from covista_service.station.groups import Groups
from covista_service.station.workload import Workload
from covista_service.telemetry import Summary, Telemetry

READINGS, WORKLOAD = "readings", "workload"
_NS_PER_MS = 1e6
# A station in distress may take its time.
_ASK_S = 30.0


@dataclass(frozen=True, slots=True)
class Readings:
    """What the instruments say: of the whole time since the start, but for what is `since` the readings before.

    `cpu_s` is of the whole process, `regrouping_s` of it the time that similarity and groups took to evaluate.
    `latencies_ms` since: (when the keyframe arrived, s since the epoch, and how long until it was in the groups);
    `turns_ms` since: how long turns of the loop took. `workload` is what waits now, and was begun since the start.
    """

    at_s: float
    cpu_s: float
    regrouping_s: float
    resident_bytes: int
    summary: Summary
    workload: Workload
    latencies_ms: tuple[tuple[float, float], ...]
    turns_ms: tuple[float, ...]


class _Instruments:
    def __init__(self) -> None:
        self._regrouping_ns = 0
        self._turns_ms: deque[float] = deque()
        self._latencies_ms: deque[tuple[float, float]] = deque()
        self._loop: Loop | None = None
        self._meet_loop()
        self._watch(Groups, "evaluate", time.thread_time_ns, self._regrouped)
        self._watch(Loop, "turn", time.perf_counter_ns, lambda taken_ns: self._turns_ms.append(taken_ns / _NS_PER_MS))
        plain = Telemetry.grouped

        @functools.wraps(plain)
        def grouped(kept: Telemetry, latency_s: float) -> None:
            self._latencies_ms.append((time.time() - latency_s, 1e3 * latency_s))
            plain(kept, latency_s)

        setattr(Telemetry, "grouped", grouped)  # noqa: B010 - a method is put in place of another

    def read(self, summary: Summary) -> Readings:
        """All readings as they are now."""
        return Readings(
            at_s=time.monotonic(),
            cpu_s=time.process_time(),
            regrouping_s=self._regrouping_ns / 1e9,
            resident_bytes=_resident_bytes(),
            summary=summary,
            workload=self.workload(),
            latencies_ms=tuple(_emptied(self._latencies_ms)),
            turns_ms=tuple(_emptied(self._turns_ms)),
        )

    def workload(self) -> Workload:
        """What waits now, and was begun since the start."""
        return Workload() if self._loop is None else self._loop.ask(_ASK_S).workload

    def _regrouped(self, taken_ns: int) -> None:
        self._regrouping_ns += taken_ns

    def _meet_loop(self) -> None:
        plain = Loop.run

        @functools.wraps(plain)
        async def run(loop: Loop) -> None:
            self._loop = loop
            await plain(loop)

        setattr(Loop, "run", run)  # noqa: B010 - a method is put in place of another

    def _watch(self, owner: type, name: str, clock: Callable[[], int], note: Callable[[int], None]) -> None:
        plain = getattr(owner, name)

        @functools.wraps(plain)
        def watched(*arguments: Any, **named: Any) -> Any:
            begin_ns = clock()
            try:
                return plain(*arguments, **named)
            finally:
                note(clock() - begin_ns)

        setattr(owner, name, watched)


def play(line: Line, settings: Settings) -> None:
    """Serve. Says `Ready` or `Failed`; answers `READINGS` and `WORKLOAD` with those, all else with `Summary`."""
    telemetry.log_to_stderr(settings.log_level)
    instruments = _Instruments()

    def ready(running: serve.Running) -> None:
        line.send(Ready(running.url, running.link))
        threading.Thread(target=_answer, args=(line, running, instruments), name="parent", daemon=True).start()

    try:
        serve.run(settings, ready=ready, signals=False)
    except CovistaError as error:
        line.send(Failed(str(error)))


def _answer(line: Line, running: serve.Running, instruments: _Instruments) -> None:
    while (word := line.receive()) is not None:
        if word == READINGS:
            line.send(instruments.read(running.summary()))
        else:
            line.send(instruments.workload() if word == WORKLOAD else running.summary())
    end_soon()
    running.stop()


def _emptied(samples: deque[Any]) -> list[Any]:
    return [samples.popleft() for _ in range(len(samples))]


def _resident_bytes() -> int:
    pages = int(Path("/proc/self/statm").read_text("ascii").split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE")

"""The rovers of the soak: processes that join, leave, are killed, pause, and start again, as chance has it.

What chance has is the same for the same seed; when things happen is up to the machine.
"""

from __future__ import annotations

import random
import signal
import threading
import time
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import zenoh
from covista_clients.simulation.stock import Stock
from covista_schemas import keys, zenoh_config

from covista_service.bench import soak_rover
from covista_service.bench.load import SITE
from covista_service.bench.soak_rover import POSE_RATE_HZ, PREFIX, RATE_HZ, TELL_S, Told
from covista_service.demo import children
from covista_service.demo.children import Child

# Between two things that happen, on average.
EVERY_S = 6.0
# What a boot sent so shortly before it was killed may be lost unheard, and that it was sent is not known for so long.
LAST_S = 1.0
_LEAST_PAUSE_S, _MOST_PAUSE_S = 2.0, 15.0
# A rover that was paused goes on for so long before anything else happens to it: its link may have to be made anew.
_AFTER_PAUSE_S = 10.0
_LEAVE_S = 15.0
LEAVE = "leave"
_BURST = 300
_GARBAGE = b"\xff\xff\xff no message of ours"


@dataclass(slots=True, eq=False)
class Boot:
    """A rover's process, and what it said that it has sent: (when it said so, messages)."""

    child: Child
    listener: threading.Thread
    told: list[tuple[float, Told]]
    paused_until_s: float | None = None
    untouched_until_s: float = 0.0


@dataclass(slots=True)
class Sent:
    """What all boots that are over have sent, at least and at most, and garbage."""

    least: int = 0
    most: int = 0
    garbage: int = 0


class SoakSwarm:
    """Twelve rovers and what happens to them. `happen` is to be called often."""

    def __init__(self, link: str, stock: Stock, seed: int) -> None:
        self.sent = Sent()
        self.happened: Counter[str] = Counter()
        self._link, self._stock = link, stock
        self._chance = random.Random(seed)
        self._boots: dict[int, Boot] = {}
        self._next_s = time.monotonic()

    @property
    def there(self) -> int:
        """How many rovers have a process."""
        return len(self._boots)

    def gather(self) -> None:
        """Let all join."""
        for robot in range(self._stock.robots):
            self._join(robot)

    def happen(self) -> None:
        """Let happen what is due."""
        now_s = time.monotonic()
        for boot in self._boots.values():
            if boot.paused_until_s is not None and boot.paused_until_s <= now_s:
                self._go_on(boot)
        if now_s >= self._next_s:
            self._next_s = now_s + self._chance.expovariate(1 / EVERY_S)
            self._befall(self._chance.randrange(self._stock.robots), now_s)

    def disperse(self) -> None:
        """Let all leave in order, side by side."""
        for boot in self._boots.values():
            if boot.paused_until_s is not None:
                self._go_on(boot)
        time.sleep(_AFTER_PAUSE_S)
        for boot in self._boots.values():
            boot.child.line.send(LEAVE)
        for robot in list(self._boots):
            self._see_off(robot)

    def end(self) -> None:
        """Leave no process behind, however the soak ends."""
        for boot in self._boots.values():
            boot.child.process.kill()
            boot.child.process.wait()
            boot.listener.join()
            boot.child.line.connection.close()

    def _befall(self, robot: int, now_s: float) -> None:
        boot = self._boots.get(robot)
        if boot is None:
            self._count("join", self._join, robot)
        elif boot.paused_until_s is None and now_s >= boot.untouched_until_s:
            what = self._chance.choice(("leave", "kill", "reboot", "pause", "garbage"))
            acts: dict[str, Callable[[int], None]] = {
                "leave": self._leave,
                "kill": self._kill,
                "reboot": self._reboot,
                "pause": self._pause,
                "garbage": self._garble,
            }
            self._count(what, acts[what], robot)

    def _count(self, what: str, act: Callable[[int], None], robot: int) -> None:
        act(robot)
        self.happened[what] += 1

    def _join(self, robot: int) -> None:
        child = children.start(soak_rover.__name__, self._link, self._stock, robot)
        told: list[tuple[float, Told]] = []
        listener = threading.Thread(target=_heard, args=(child, told), name=f"told-{robot}", daemon=True)
        listener.start()
        self._boots[robot] = Boot(child, listener, told)

    def _leave(self, robot: int) -> None:
        self._boots[robot].child.line.send(LEAVE)
        self._see_off(robot)

    def _see_off(self, robot: int) -> None:
        child = self._boots[robot].child
        if not child.ended(_LEAVE_S):
            child.process.kill()
        self._over(robot)

    def _kill(self, robot: int) -> None:
        self._boots[robot].child.process.kill()
        self._over(robot)

    def _reboot(self, robot: int) -> None:
        self._kill(robot)
        self._join(robot)

    def _pause(self, robot: int) -> None:
        boot = self._boots[robot]
        boot.child.process.send_signal(signal.SIGSTOP)
        boot.paused_until_s = time.monotonic() + self._chance.uniform(_LEAST_PAUSE_S, _MOST_PAUSE_S)

    def _go_on(self, boot: Boot) -> None:
        boot.child.process.send_signal(signal.SIGCONT)
        boot.paused_until_s, boot.untouched_until_s = None, time.monotonic() + _AFTER_PAUSE_S

    def _garble(self, robot: int) -> None:
        """Somebody sends garbage on the rover's keys, as fast as it goes."""
        name = f"{PREFIX}{robot + 1}"
        with zenoh.open(zenoh_config.config("client", connect=[self._link])) as session:
            for number in range(_BURST):
                key = keys.keyframe(SITE, name) if number % 2 else keys.pose(SITE, name)
                session.put(key, _GARBAGE, congestion_control=zenoh.CongestionControl.BLOCK)
        self.sent.garbage += _BURST

    def _over(self, robot: int) -> None:
        """Enter what a boot has sent into the accounts."""
        ended_s, boot = time.monotonic(), self._boots.pop(robot)
        boot.child.process.wait()
        # Until all that it said is read.
        boot.listener.join()
        boot.child.line.connection.close()
        least, most = bounds(boot.told, ended_s)
        self.sent.least += least
        self.sent.most += most


def bounds(told: Sequence[tuple[float, Told]], ended_s: float) -> tuple[int, int]:
    """Least and most messages that a station has to know of, of a boot that said so much and ended at `ended_s`."""
    last = told[-1][1] if told else Told(0, 0)
    if last.over:
        return last.messages, last.messages
    least = max((said.messages for at_s, said in told if at_s < ended_s - LAST_S), default=0)
    unsaid = (RATE_HZ + POSE_RATE_HZ) * (LAST_S + 2 * TELL_S) + 2
    return least, last.messages + round(unsaid)


def _heard(child: Child, told: list[tuple[float, Told]]) -> None:
    while (said := child.line.receive()) is not None:
        told.append((time.monotonic(), said))

"""A rover of the soak as a process, and whoever sends garbage in its name."""

from __future__ import annotations

import signal
import threading
import time

import zenoh
from covista_clients.simulation.stock import Stock
from covista_schemas import keys, zenoh_config

from covista_service.bench import soak_rover
from covista_service.bench.load import SITE
from covista_service.bench.soak_rover import PREFIX, Told
from covista_service.demo import children

_BURST = 300
_GARBAGE = b"\xff\xff\xff no message of ours"


class RoverProcess:
    """`soak_rover` in a process of its own, a `soak_swarm.Body`."""

    def __init__(self, link: str, stock: Stock, robot: int) -> None:
        self.told: list[tuple[float, Told]] = []
        self._child = children.start(soak_rover.__name__, link, stock, robot)
        self._listener = threading.Thread(target=self._hear, name=f"told-{robot}", daemon=True)
        self._listener.start()

    def leave(self) -> None:
        """Tell it to end in order."""
        self._child.line.send("leave")

    def kill(self) -> None:
        """As kill -9 does."""
        self._child.process.kill()

    def pause(self) -> None:
        """As a processor does that has none to spare."""
        self._child.process.send_signal(signal.SIGSTOP)

    def go_on(self) -> None:
        """Let it go on."""
        self._child.process.send_signal(signal.SIGCONT)

    def ended(self) -> bool:
        """Has it?"""
        return self._child.process.poll() is not None

    def close(self) -> None:
        """Wait for its end, and read all that it has said."""
        self._child.process.wait()
        self._listener.join()
        self._child.line.connection.close()

    def _hear(self) -> None:
        while (said := self._child.line.receive()) is not None:
            self.told.append((time.monotonic(), said))


def garble(link: str, robot: int) -> int:
    """Send garbage on a rover's keys, as fast as it goes; so many messages."""
    name = name_of(robot)
    with zenoh.open(zenoh_config.config("client", connect=[link])) as session:
        for number in range(_BURST):
            key = keys.keyframe(SITE, name) if number % 2 else keys.pose(SITE, name)
            session.put(key, _GARBAGE, congestion_control=zenoh.CongestionControl.BLOCK)
    return _BURST


def name_of(robot: int) -> str:
    """What the robot with this number is called."""
    return f"{PREFIX}{robot + 1}"

"""A handful of rovers that stand in the arena and say so: cheap to keep, and two groups of three to tell apart."""

from __future__ import annotations

import threading
import time
from contextlib import ExitStack
from functools import cache
from types import TracebackType

from covista_clients.simulation.antenna import Antenna
from covista_clients.simulation.crowd import Crowd
from covista_clients.simulation.fleet import shared_session
from covista_clients.simulation.stock import StockOptions, make

ROBOTS = ("r1", "r2", "r3", "r4", "r5", "r6")
# As they stand: r1, r3 and r5 look into one corner, the others into the opposite one.
TOGETHER, OTHERS = ("r1", "r3", "r5"), ("r2", "r4", "r6")
POSE_S, KEYFRAME_S = 1.0, 10.0


@cache
def _crowd() -> Crowd:
    stock = make(StockOptions(robots=len(ROBOTS), steps=1, features=300, thumbnails=True))
    assert stock is not None
    return Crowd(stock, len(ROBOTS))


class Rovers:
    """Rovers at one router, each there until it `leave`s; features with a thumbnail, poses every second."""

    def __init__(self, link: str) -> None:
        self._crowd = _crowd()
        self._stop = threading.Event()
        self._stack = ExitStack()
        session = shared_session(link, self._stop, self._stack)
        assert session is not None
        self._session = session
        self._lock = threading.Lock()
        self._there: dict[str, Antenna] = {}
        self._thread = threading.Thread(target=self._run, name="rovers")
        self._thread.start()

    def come(self, *names: str) -> None:
        """Start, each with a boot of its own, and send a keyframe at once."""
        for name in names:
            with self._lock:
                self._there[name] = antenna = Antenna(self._session, "default", [name])
            assert antenna.await_heard(self._stop)
            self._send(name, antenna, keyframe=True)

    def leave(self, *names: str) -> None:
        """Stop: the station hears at once that they are gone."""
        for name in names:
            with self._lock:
                self._there.pop(name).close()

    def __enter__(self) -> Rovers:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._stop.set()
        self._thread.join()
        with self._stack:
            self.leave(*list(self._there))

    def _run(self) -> None:
        next_s = time.monotonic() + KEYFRAME_S
        while not self._stop.wait(POSE_S):
            due = time.monotonic() >= next_s
            next_s += KEYFRAME_S if due else 0
            for name in ROBOTS:
                with self._lock:
                    if name in self._there:
                        self._send(name, self._there[name], keyframe=due)

    def _send(self, name: str, antenna: Antenna, *, keyframe: bool) -> None:
        robot = ROBOTS.index(name)
        pose = self._crowd.pose(robot, 0, time.time_ns())
        if not antenna.heard:
            return
        if keyframe:
            antenna.send_keyframe(0, pose, self._crowd.picture(robot, 0))
        else:
            antenna.send_pose(0, pose)

"""One rover of the soak, as a process that can be killed: it sends what is ready-made, until its line closes."""

from __future__ import annotations

import threading
import time
from dataclasses import dataclass

from covista_clients.simulation.crowd import Crowd
from covista_clients.simulation.fleet import fleet
from covista_clients.simulation.pacing import RealTime, schedule
from covista_clients.simulation.stock import Stock

from covista_service.bench.load import SITE
from covista_service.demo.children import Line, end_soon

PREFIX = "r"
RATE_HZ, POSE_RATE_HZ = 0.5, 2.0
# How often a rover says how much it has sent.
TELL_S = 0.25


@dataclass(frozen=True, slots=True)
class Told:
    """What a boot has sent so far; `over` when it has left in order, and no more comes."""

    keyframes: int
    poses: int
    over: bool = False

    @property
    def messages(self) -> int:
        """Both."""
        return self.keyframes + self.poses


def play(line: Line, connect: str, stock: Stock, robot: int) -> None:
    """Be the robot with this number, and say `Told` some times a second."""
    crowd, gone = Crowd(stock, stock.robots, prefix=PREFIX), threading.Event()
    threading.Thread(target=_listen, args=(line, gone), name="orders", daemon=True).start()
    with fleet([crowd.names[robot]], stock.camera, connect, SITE, "features", gone) as rovers:
        (rover,) = rovers
        pace, begin_ns, told_s = RealTime(gone), time.time_ns(), 0.0
        for due in schedule(1, RATE_HZ, POSE_RATE_HZ):
            if not pace.wait_until(due.t_s):
                break
            step = due.t_s * RATE_HZ
            pose = crowd.pose(robot, step, begin_ns + round(due.t_s * 1e9))
            if due.is_keyframe:
                rover.send_keyframe(crowd.features(robot, round(step)), pose)
            else:
                rover.send_pose(pose)
            if due.t_s - told_s >= TELL_S:
                told_s = due.t_s
                line.send(Told(rover.keyframes_sent, rover.poses_sent))
    line.send(Told(rover.keyframes_sent, rover.poses_sent, over=True))
    line.connection.close()


def _listen(line: Line, gone: threading.Event) -> None:
    """Any word is the one to leave; without its parent a rover ends at once."""
    if line.receive() is None:
        end_soon()
    gone.set()

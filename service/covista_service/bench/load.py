"""A load that is the same every time: a crowd that sends ready-made keyframes and poses, from a process of its own."""

from __future__ import annotations

import math
import threading
import time
from dataclasses import dataclass, replace
from functools import cache
from queue import SimpleQueue

from covista_clients.simulation.antenna import antenna
from covista_clients.simulation.crowd import Crowd
from covista_clients.simulation.marching import GRAIN_S, March, march
from covista_clients.simulation.pacing import RealTime
from covista_clients.simulation.stock import MOST_ROBOTS, Stock, StockOptions, make
from covista_clients.simulation.swarm import Progress

from covista_service.demo.children import Line, end_soon

SITE = "default"
PREFIX = "b"

# Of a number of turns, in floating point.
_ROUNDING = 1e-6


@dataclass(frozen=True, slots=True)
class LoadOptions:
    """`robots` send keyframes of `features` features, and poses; how often and for how long says each `March`.

    Their ids begin with `prefix`.
    """

    connect: str
    robots: int = 20
    features: int = 500
    prefix: str = PREFIX


@dataclass(frozen=True, slots=True)
class Prepared:
    """Said when all keyframes are made, before the first is sent."""


@dataclass(frozen=True, slots=True)
class Sent:
    """Said when the last keyframe of a march is out: counts since the beginning, and how late the march was at most.

    `skipped` were too late to be sent.
    """

    keyframes: int
    poses: int
    behind_s: float
    skipped: int = 0


@cache
def stock(robots: int, features: int) -> Stock:
    """What so many robots send, made once in a process."""
    made = make(StockOptions(robots=min(robots, MOST_ROBOTS), features=features))
    # Nothing stops it.
    assert made is not None  # noqa: S101 - tells the type checker
    return made


def play(line: Line, options: LoadOptions, ready: Stock | None = None) -> None:
    """Make keyframes, unless they are `ready`, and march as the parent says; leave when the line closes.

    Robots connect before the first march. `Sent` is said after each.
    """
    crowd = Crowd(ready or stock(options.robots, options.features), options.robots, prefix=options.prefix)
    line.send(Prepared())
    orders: SimpleQueue[March | None] = SimpleQueue()
    gone = threading.Event()
    listener = threading.Thread(target=_listen, args=(line, orders, gone), name="orders", daemon=True)
    listener.start()
    order = orders.get()
    if order is None:
        return
    with antenna(options.connect, SITE, crowd.names, gone) as raised:
        if raised is None or not raised.await_heard(gone):
            return
        total, turns = Progress(), 0
        while order is not None:
            order = replace(order, first_step=turns / crowd.robots)
            progress = march(crowd, raised, order, RealTime(gone, GRAIN_S), time.time_ns())
            # A march that is over before everybody's turn leaves the rest to the next one.
            turns += math.ceil((order.seconds or 0.0) * order.rate_hz * crowd.robots - _ROUNDING)
            total.keyframes += progress.keyframes
            total.poses += progress.poses
            total.skipped += progress.skipped
            line.send(Sent(total.keyframes, total.poses, progress.most_behind_s, total.skipped))
            order = orders.get()


def _listen(line: Line, orders: SimpleQueue[March | None], gone: threading.Event) -> None:
    while (order := line.receive()) is not None:
        orders.put(order)
    end_soon()
    gone.set()
    orders.put(None)

"""A crowd in real time: who sends when, and what becomes of it."""

from __future__ import annotations

import threading
from collections.abc import Callable
from dataclasses import dataclass, field
from itertools import takewhile

import numpy as np

from covista_clients.simulation.accounts import Accountant
from covista_clients.simulation.antenna import Antenna, antenna
from covista_clients.simulation.arena import ROVERS_PER_COURT
from covista_clients.simulation.crowd import Crowd
from covista_clients.simulation.pacing import Due, Pace, RealTime, schedule
from covista_clients.simulation.stock import MOST_ROBOTS, StockOptions, make
from covista_clients.simulation.swarm import Progress, SwarmOptions

# A crowd of slow senders drives slowly: so much of the path lies between two keyframes at most.
_MOST_STEP_S = 1.0
# What falls due within it goes out together.
GRAIN_S = 0.005


@dataclass(frozen=True, slots=True)
class March:
    """How often each robot sends a keyframe and a pose, and for how long; without `seconds` until told otherwise.

    `first_step` is how far robots have come before, in keyframes: with 2.5 half of them have sent three, and it is the
    turn of the others, who have sent two.
    """

    rate_hz: float
    pose_rate_hz: float = 1.0
    seconds: float | None = None
    first_step: float = 0.0


def is_crowd(options: SwarmOptions) -> bool:
    """Whether so many robots send features that pictures cannot be rendered while they drive."""
    return options.send != "image" and not options.only and options.robots > ROVERS_PER_COURT


def stock_of(options: SwarmOptions) -> StockOptions:
    """The stock that a crowd with these options sends from."""
    return StockOptions(
        robots=min(options.robots, MOST_ROBOTS if options.world == "arena" else ROVERS_PER_COURT),
        world=options.world,
        seed=options.seed,
        step_s=min(1 / options.rate_hz, _MOST_STEP_S),
        thumbnails=options.send == "features+thumbnail",
        width=options.width,
        height=options.height,
    )


def run_crowd(
    options: SwarmOptions,
    stop: threading.Event,
    seconds: float | None = None,
    on_shot: Callable[[int, int], None] | None = None,
    accountant: Accountant | None = None,
) -> Progress:
    """Make keyframes, wait for a station, and send them in real time for `seconds`, or until `stop` is set.

    `on_shot` hears how many of how many keyframes are made, `accountant` at the end what was sent.
    """
    progress = Progress()
    stock = make(stock_of(options), stop, on_shot)
    if stock is None:
        return progress
    crowd = Crowd(stock, options.robots, options.seed)
    with antenna(options.connect, options.site, crowd.names, stop, options.tls) as raised:
        if raised is not None and raised.await_heard(stop):
            plan = March(options.rate_hz, options.pose_rate_hz, seconds)
            march(crowd, raised, plan, RealTime(stop, GRAIN_S), options.now_ns(), progress)
    if accountant and raised is not None:
        accountant.tell(raised.accounts())
    return progress


def march(
    crowd: Crowd, raised: Antenna, plan: March, pace: Pace, begin_ns: int, progress: Progress | None = None
) -> Progress:
    """Send what is due, in order. What is more than a period late, or not heard by any station, is skipped.

    A robot drives from one keyframe to the next in the time between them, so that poses lie on the way; before its
    first one it stands. Poses are those of the time at which they are due, `begin_ns` is sensor time 0. The robots'
    turns are shuffled: neighbours do not send in a row.
    """
    progress = progress or Progress()
    marching = _Marching(crowd, raised, plan, begin_ns, progress)
    for due in takewhile(
        lambda due: plan.seconds is None or due.t_s < plan.seconds,
        schedule(crowd.robots, plan.rate_hz, plan.pose_rate_hz),
    ):
        if not pace.wait_until(due.t_s):
            return progress
        progress.behind_s = max(0.0, pace.now_s() - due.t_s)
        progress.most_behind_s = max(progress.most_behind_s, progress.behind_s)
        marching.send(due)
    if plan.seconds is not None:
        pace.wait_until(plan.seconds)
    return progress


@dataclass(slots=True)
class _Marching:
    crowd: Crowd
    raised: Antenna
    plan: March
    begin_ns: int
    progress: Progress
    turns: list[int] = field(init=False)

    def __post_init__(self) -> None:
        self.turns = np.random.default_rng(self.crowd.robots).permutation(self.crowd.robots).tolist()

    def send(self, due: Due) -> None:
        """Send one message, or count it as skipped."""
        period_s = 1 / (self.plan.rate_hz if due.is_keyframe else self.plan.pose_rate_hz)
        if self.progress.behind_s > period_s or not self.raised.heard:
            self.progress.skipped += 1
            return
        robots = self.crowd.robots
        turn = (due.robot + round(self.plan.first_step * robots)) % robots
        robot = self.turns[turn]
        step = max(0.0, self.plan.first_step + due.t_s * self.plan.rate_hz - turn / robots)
        time_ns = self.begin_ns + round(due.t_s * 1e9)
        if due.is_keyframe:
            number = round(step)
            pose = self.crowd.pose(robot, number, time_ns)
            self.raised.send_keyframe(robot, pose, self.crowd.picture(robot, number))
            self.progress.keyframes += 1
        else:
            self.raised.send_pose(robot, self.crowd.pose(robot, step, time_ns))
            self.progress.poses += 1

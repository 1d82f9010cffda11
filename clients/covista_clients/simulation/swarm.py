"""Simulated rovers that drive through a world in real time and send what their cameras see."""

from __future__ import annotations

import itertools
import math
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from covista_schemas.messages import Camera, Pose
from covista_schemas.zenoh_tls import Tls
from numpy.typing import NDArray

from covista_clients.simulation import worlds
from covista_clients.simulation.accounts import Accountant, account
from covista_clients.simulation.fleet import Sending, fleet
from covista_clients.simulation.pacing import Due, Pace, RealTime, schedule
from covista_clients.simulation.paths import SCENE_S, Paths
from covista_clients.simulation.renderer import render
from covista_clients.simulation.viewing import pinhole
from covista_clients.simulation.world import World

# Some thirty years: what is further off is no clock.
MOST_CLOCK_OFFSET_S = 1e9
# Processes that each drive some rovers of one swarm agree on how far it has come by the machine's clock: the swarm
# begins anew every hour, with a whole number of scenes.
ROUND_S = 200 * SCENE_S


@dataclass(frozen=True, slots=True)
class SwarmOptions:
    """A swarm: how many rovers, where, how often they send, and to whom. Raises ValueError for what makes no sense.

    `clock_offset_s` is how far the rovers' clocks are ahead. `only` names those that this process drives, where others
    drive the rest of the same swarm; empty: all.
    """

    robots: int = 6
    world: str = "arena"
    seed: int = 0
    rate_hz: float = 2.0
    pose_rate_hz: float = 10.0
    connect: str = "tcp/127.0.0.1:7447"
    site: str = "default"
    send: Sending = "image"
    width: int = 320
    height: int = 240
    tls: Tls | None = None
    clock_offset_s: float = 0.0
    only: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        if self.robots < 1:
            raise ValueError(f"a swarm has at least 1 robot, not {self.robots}")
        if self.world not in worlds.WORLDS:
            raise ValueError(f"there is no world {self.world!r}, but {', '.join(worlds.WORLDS)}")
        if not (0 < self.rate_hz < math.inf and 0 <= self.pose_rate_hz < math.inf):
            raise ValueError("rate_hz must be positive, and pose_rate_hz not negative, and both finite")
        if not abs(self.clock_offset_s) <= MOST_CLOCK_OFFSET_S:
            raise ValueError(f"clock_offset_s = {self.clock_offset_s:g} is not within {MOST_CLOCK_OFFSET_S:g} s")

        if unknown := sorted(set(self.only) - {f"r{k + 1}" for k in range(self.robots)}):
            raise ValueError(f"a swarm of {self.robots} has no robot {', '.join(unknown)}, but r1 to r{self.robots}")

    def now_ns(self) -> int:
        """The time by the rovers' clocks."""
        return time.time_ns() + round(self.clock_offset_s * 1e9)


@dataclass(frozen=True, slots=True)
class KeyframeRecord:
    """A keyframe handed to its rover: its name, and the pose that its picture was rendered from.

    While a rover has no station, or is slow, a keyframe replaces the one that waits and takes over its name: of records
    with one name the last one holds. `t_s`: when it was due, after the beginning.
    """

    robot: str
    boot: str
    sequence: int
    pose: Pose
    t_s: float = 0.0


@dataclass(slots=True)
class Progress:
    """Counts of a running swarm, kept up to date while it runs.

    `keyframes` that were handed over, those aside that a newer one `replaced` before they went out; `skipped` were not
    even rendered, since the swarm was behind; `behind_s` is how late the last message was.
    """

    keyframes: int = 0
    replaced: int = 0
    poses: int = 0
    skipped: int = 0
    behind_s: float = 0.0
    most_behind_s: float = 0.0


class Named(Protocol):
    """What a rover answers when it takes a keyframe."""

    @property
    def boot(self) -> str:
        """The rover's boot."""

    @property
    def sequence(self) -> int:
        """The keyframe's number in it."""


class Sender(Protocol):
    """What a swarm needs of a rover."""

    def send_pose(self, pose: Pose) -> object:
        """Send a pose."""

    def send_keyframe(self, image: NDArray[np.uint8], pose: Pose) -> Named:
        """Send a picture and the pose that it was taken from."""


@dataclass(frozen=True, slots=True, eq=False)
class Swarm:
    """A swarm without a link: its world, camera and paths. The same options give the same swarm."""

    options: SwarmOptions
    world: World
    camera: Camera
    paths: Paths


def names(options: SwarmOptions) -> list[str]:
    """Ids of the robots that this process drives, of r1 to rN."""
    return [f"r{k + 1}" for k in members(options)]


def members(options: SwarmOptions) -> list[int]:
    """Indices in the swarm of the robots that this process drives."""
    return [k for k in range(options.robots) if not options.only or f"r{k + 1}" in options.only]


def come_so_far_s(options: SwarmOptions) -> float:
    """Where on its paths the swarm is now: at the beginning, or where those of its rovers are that others drive."""
    return time.time() % ROUND_S if options.only else 0.0


def camera(options: SwarmOptions) -> Camera:
    """The camera that all rovers have."""
    return pinhole(options.width, options.height)


def swarm(options: SwarmOptions) -> Swarm:
    """Build the world and lay out the paths."""
    world = worlds.build(options.world, options.seed, options.robots)
    return Swarm(options, world, camera(options), Paths(world, options.robots, options.seed))


def run_swarm(
    options: SwarmOptions,
    stop: threading.Event,
    on_keyframe: Callable[[KeyframeRecord], None] | None = None,
    seconds: float | None = None,
    leave: threading.Event | None = None,
    progress: Progress | None = None,
    accountant: Accountant | None = None,
) -> Progress:
    """Drive and send in real time for `seconds`, or until `stop` is set; then, if given, stay until `leave` is set.

    `on_keyframe` is called for every keyframe handed to its rover; `progress` is kept up to date while it runs, and
    `accountant` looks at the rovers meanwhile and when they have left.
    """
    progress = progress or Progress()
    built = swarm(options)
    way = (options.connect, options.site, options.send, stop, options.tls)
    with fleet(names(options), built.camera, *way) as rovers:
        pace, driven_s = RealTime(stop), come_so_far_s(options)
        for record in drive(built, rovers, pace, options.now_ns(), seconds, progress, driven_s):
            if on_keyframe:
                on_keyframe(record)
            if accountant:
                accountant.look(rovers)
        if leave is not None:
            leave.wait()
    if accountant:
        accountant.tell(account(rover) for rover in rovers)
    return progress


def drive(
    built: Swarm,
    senders: Sequence[Sender],
    pace: Pace,
    begin_ns: int,
    seconds: float | None = None,
    progress: Progress | None = None,
    driven_s: float = 0.0,
) -> Iterator[KeyframeRecord]:
    """Send what is due, in order, and yield the keyframes; one that is more than a period late is skipped.

    `senders` are those of `names`. Poses and pictures are those of the time at which they are due, whenever they go
    out; `begin_ns` is sensor time 0, at which the swarm has driven for `driven_s` already.
    """
    progress = progress or Progress()
    options = built.options
    if not senders:
        # Nothing would ever be due.
        return
    sender_of = dict(zip(members(options), senders, strict=False))
    newest: dict[str, int] = {}
    schedule_all = schedule(options.robots, options.rate_hz, options.pose_rate_hz)
    due_all = (due for due in schedule_all if due.robot in sender_of)
    for due in itertools.takewhile(lambda due: seconds is None or due.t_s < seconds, due_all):
        if not pace.wait_until(due.t_s):
            return
        progress.behind_s = max(0.0, pace.now_s() - due.t_s)
        progress.most_behind_s = max(progress.most_behind_s, progress.behind_s)
        place_s = (driven_s + due.t_s) % ROUND_S if options.only else due.t_s
        pose = built.paths.pose(due.robot, place_s, begin_ns + round(due.t_s * 1e9))
        if not due.is_keyframe:
            sender_of[due.robot].send_pose(pose)
            progress.poses += 1
        elif progress.behind_s > 1 / options.rate_hz:
            progress.skipped += 1
        else:
            record = _keyframe(built, sender_of[due.robot], due, pose)
            is_new = record.sequence > newest.get(record.robot, -1)
            newest[record.robot] = record.sequence
            progress.keyframes += is_new
            progress.replaced += not is_new
            yield record


def _keyframe(built: Swarm, sender: Sender, due: Due, pose: Pose) -> KeyframeRecord:
    sent = sender.send_keyframe(render(built.world, built.camera, pose).image, pose)
    return KeyframeRecord(f"r{due.robot + 1}", sent.boot, sent.sequence, pose, due.t_s)

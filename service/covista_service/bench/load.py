"""A load that is the same every time: robots that send ready-made keyframes and poses at a fixed rate."""

from __future__ import annotations

import threading
import time
from dataclasses import dataclass, replace

import zenoh
from covista_clients.simulation import renderer, worlds
from covista_clients.simulation.paths import Paths
from covista_schemas import codec, features, keys, zenoh_config
from covista_schemas.messages import Camera, Features, Keyframe, Pose, PoseUpdate

from covista_service.demo.children import Line, end_soon

WORLD = "arena"
SITE = "default"
_BOOT = "bench"
_CAMERA = Camera(fx=250, fy=250, cx=159.5, cy=119.5, width=320, height=240)
# Positions along a path; afterwards a robot drives the same way back, and so on.
_DISTINCT = 12


@dataclass(frozen=True, slots=True)
class LoadOptions:
    """Each of `robots` sends a keyframe of `features` features and a pose, every `period_s`, for `seconds`."""

    connect: str
    seconds: float
    robots: int = 20
    period_s: float = 1.0
    features: int = 500


@dataclass(frozen=True, slots=True)
class Prepared:
    """Said when all keyframes are made, before the first is sent."""


@dataclass(frozen=True, slots=True)
class Sent:
    """Said when the last keyframe is out."""

    keyframes: int


def play(line: Line, options: LoadOptions) -> None:
    """Make keyframes, wait for a word from the parent, send, say how many, and stay until the line closes."""
    gone = threading.Event()
    stock = _stock(options)
    line.send(Prepared())
    if line.receive() is None:
        return
    listener = threading.Thread(target=_listen, args=(line, gone), name="orders", daemon=True)
    listener.start()
    with zenoh.open(zenoh_config.config("client", connect=[options.connect])) as session:
        line.send(Sent(_send(session, options, stock, gone)))
        gone.wait()


def _listen(line: Line, gone: threading.Event) -> None:
    while line.receive() is not None:
        pass
    end_soon()
    gone.set()


def _stock(options: LoadOptions) -> list[list[tuple[Pose, Features]]]:
    """What each robot sends, there and back along its path."""
    world = worlds.build(WORLD, robots=options.robots)
    paths = Paths(world, options.robots)

    def taken(robot: int, step: int) -> tuple[Pose, Features]:
        pose = paths.pose(robot, step * options.period_s)
        return pose, features.extract(renderer.render(world, _CAMERA, pose).image, count=options.features)

    way = [[taken(robot, step) for step in range(_DISTINCT)] for robot in range(options.robots)]
    return [forth + forth[-2:0:-1] for forth in way]


def _send(
    session: zenoh.Session, options: LoadOptions, stock: list[list[tuple[Pose, Features]]], gone: threading.Event
) -> int:
    """Send on time until the time is over; robots take turns, evenly over each period."""
    begin_s = time.monotonic()
    rounds = int(options.seconds / options.period_s)
    for turn in range(rounds * options.robots):
        if gone.wait(max(0.0, begin_s + turn * options.period_s / options.robots - time.monotonic())):
            return turn
        sequence, robot = divmod(turn, options.robots)
        pose, found = stock[robot][sequence % len(stock[robot])]
        _put(session, f"b{robot + 1}", sequence, replace(pose, time_ns=time.time_ns()), found)
    return rounds * options.robots


def _put(session: zenoh.Session, robot: str, sequence: int, pose: Pose, found: Features) -> None:
    update = codec.encode_pose(PoseUpdate(robot, _BOOT, sequence, pose))
    keyframe = codec.encode_keyframe(Keyframe(robot, _BOOT, sequence, _CAMERA, pose, features=found))
    session.put(keys.pose(SITE, robot), update, encoding=codec.POSE_ENCODING)
    session.put(keys.keyframe(SITE, robot), keyframe, encoding=codec.KEYFRAME_ENCODING)

"""A flood of poses, or of garbage, from one process that spends little on each: what it sends is all but made before.

Garbage is of all kinds in turn: noise under the names of good robots and under ten thousand others, ids that are not
those of the key, numbers that are no pose, and poses as long as books. All but the last are of a pose's size.
"""

from __future__ import annotations

import random
import struct
import threading
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import cycle
from typing import Literal

import numpy as np
import zenoh
from covista_schemas import codec, keys, zenoh_config
from covista_schemas import robot_pb2 as pb
from covista_schemas.messages import Camera, Features, Pose, PoseUpdate

from covista_service.bench.load import SITE
from covista_service.demo.children import Line, end_soon

_BOOT = "flood"
_NAMES = 10_000
_NOISE_BYTES = 90
_TICK_S = 0.002
# Sequences in so many bytes whatever their value, as protobuf allows.
_VARINT = 5
_TIME_NS = 1_700_000_000_000_000_000
_CAMERA = Camera(fx=500, fy=500, cx=320, cy=240, width=640, height=480)
_FEATURES = 500
Kind = Literal["poses", "keyframes", "garbage", "garbage_short", "garbage_long"]
Message = tuple[zenoh.KeyExpr, bytes]
Make = Callable[[int], Message]


@dataclass(frozen=True, slots=True)
class FloodOptions:
    """`rate` messages a second for `seconds`, by `robots`; without a rate as many as will go."""

    connect: str
    seconds: float
    kind: Kind = "poses"
    rate: float | None = None
    robots: int = 10


@dataclass(frozen=True, slots=True)
class Flooded:
    """Said when the last message is out."""

    sent: int
    seconds: float


def play(line: Line, options: FloodOptions) -> None:
    """Connect, wait for a word from the parent, send, say how much, and stay until the line closes."""
    gone = threading.Event()
    with zenoh.open(zenoh_config.config("client", connect=[options.connect])) as session:
        make = _MAKES[options.kind](session, options.robots)
        line.send("ready")
        if line.receive() is None:
            return
        listener = threading.Thread(target=_listen, args=(line, gone), name="orders", daemon=True)
        listener.start()
        line.send(_send(session, options, make, gone))
        gone.wait()


def _listen(line: Line, gone: threading.Event) -> None:
    while line.receive() is not None:
        pass
    end_soon()
    gone.set()


def _send(session: zenoh.Session, options: FloodOptions, make: Make, gone: threading.Event) -> Flooded:
    begin_s, sent = time.monotonic(), 0
    block = zenoh.CongestionControl.BLOCK
    while (passed_s := time.monotonic() - begin_s) < options.seconds and not gone.is_set():
        due = sent + 1000 if options.rate is None else int(passed_s * options.rate)
        for number in range(sent, due):
            key, data = make(number)
            session.put(key, data, congestion_control=block)
        sent = max(sent, due)
        if options.rate is not None:
            time.sleep(_TICK_S)
    return Flooded(sent, time.monotonic() - begin_s)


def poses(session: zenoh.Session, robots: int) -> Make:
    """Poses of robots f1, f2, ... in turn, each of which drives ahead."""
    ways = [_way(session, f"f{number + 1}", (0.0, 0.0, 0.0, 1.0)) for number in range(robots)]

    def make(number: int) -> Message:
        sequence, robot = divmod(number, robots)
        return ways[robot](sequence)

    return make


def keyframes(session: zenoh.Session, robots: int) -> Make:
    """Keyframes of robots k1, k2, ... in turn, that stand and see the same all the time."""
    chance = np.random.default_rng(0)
    names = chance.random((_FEATURES, 128), np.float32)
    points_px = chance.uniform(1, (_CAMERA.width - 2, _CAMERA.height - 2), (_FEATURES, 2))
    features = Features.from_arrays("rootsift", points_px, np.sqrt(names / names.sum(axis=1, keepdims=True)))
    picture = codec.encode_picture(_CAMERA, features)
    names_of = [f"k{number + 1}" for number in range(robots)]
    expressions = [session.declare_keyexpr(keys.keyframe(SITE, name)) for name in names_of]

    def make(number: int) -> Message:
        sequence, robot = divmod(number, robots)
        pose = Pose((0.0, 0.0, 0.0), time_ns=_TIME_NS + sequence)
        return expressions[robot], codec.encode_taken(PoseUpdate(names_of[robot], _BOOT, sequence, pose), picture)

    return make


def garbage(session: zenoh.Session, robots: int) -> Make:
    """Garbage of every kind in turn; good robots are called b1, b2, ..."""
    return _in_turn([*_short(session, robots), _long()])


def garbage_short(session: zenoh.Session, robots: int) -> Make:
    """Garbage of a pose's size, of every kind in turn."""
    return _in_turn(_short(session, robots))


def garbage_long(_session: zenoh.Session, _robots: int) -> Make:
    """Poses longer than poses may be."""
    return _in_turn([_long()])


def _in_turn(kinds: list[Iterator[Message]]) -> Make:
    turns = cycle(kinds)
    return lambda _number: next(next(turns))


def _short(session: zenoh.Session, robots: int) -> list[Iterator[Message]]:
    chance = random.Random(0)
    good = [keys.pose(SITE, f"b{number + 1}") for number in range(robots)]
    return [
        _same(good, chance.randbytes(_NOISE_BYTES)),
        _same([keys.keyframe(SITE, f"x{number}") for number in range(_NAMES)], chance.randbytes(_NOISE_BYTES)),
        _same(good, _pose("somebody").SerializeToString()),
        _wrong(session, robots),
    ]


def _long() -> Iterator[Message]:
    return _same([keys.pose(SITE, "long")], bytes(codec.MAX_POSE_BYTES + 1))


def _wrong(session: zenoh.Session, robots: int) -> Iterator[Message]:
    """Poses of robots w1, w2, ... that are none: their orientation is not of unit length."""
    ways = [_way(session, f"w{number + 1}", (0.0, 0.0, 0.0, 2.0)) for number in range(robots)]
    sequence = 0
    while True:
        for way in ways:
            yield way(sequence)
        sequence += 1


def _same(names: list[str], data: bytes) -> Iterator[Message]:
    """The same bytes under each of the keys."""
    return cycle([(zenoh.KeyExpr(name), data) for name in names])


def _pose(robot: str) -> pb.Pose:
    return pb.Pose(robot=robot, boot=_BOOT, sequence=1, time_ns=_TIME_NS)


def _way(session: zenoh.Session, robot: str, orientation_xyzw: tuple[float, float, float, float]) -> Make:
    """Poses of one robot by their sequence: made once, but for the sequence and x."""
    key = session.declare_keyexpr(keys.pose(SITE, robot))
    name = pb.Pose(robot=robot, boot=_BOOT).SerializeToString() + b"\x18"
    rest = pb.Pose(time_ns=_TIME_NS)
    rest.world_from_camera.position_m.extend((0.0, 0.0, 1.0))
    rest.world_from_camera.orientation_xyzw.extend(orientation_xyzw)
    encoded = rest.SerializeToString()
    at = encoded.index(struct.pack("<3d", 0.0, 0.0, 1.0))
    before, after = encoded[:at], encoded[at + 8 :]

    def make(sequence: int) -> Message:
        x_m = struct.pack("<d", 0.001 * (sequence % 10_000))
        return key, b"".join((name, _varint(sequence), before, x_m, after))

    return make


def _varint(number: int) -> bytes:
    groups = [number >> 7 * place & 0x7F for place in range(_VARINT)]
    return bytes([*(group | 0x80 for group in groups[:-1]), groups[-1]])


_MAKES: dict[Kind, Callable[[zenoh.Session, int], Make]] = {
    "poses": poses,
    "keyframes": keyframes,
    "garbage": garbage,
    "garbage_short": garbage_short,
    "garbage_long": garbage_long,
}

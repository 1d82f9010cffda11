"""A flood of poses, or of garbage, from one process that spends little on each: what it sends is all but made before.

Garbage is of all kinds in turn: noise under the names of good robots and under ten thousand others, ids that are not
those of the key, numbers that are no pose, and poses as long as books.
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

import zenoh
from covista_schemas import codec, keys, zenoh_config
from covista_schemas import robot_pb2 as pb

from covista_service.bench.load import SITE
from covista_service.demo.children import Line, end_soon

_BOOT = "flood"
_NAMES = 10_000
_NOISE_BYTES = 90
_TICK_S = 0.002
# Sequences in so many bytes whatever their value, as protobuf allows.
_VARINT = 5
_TIME_NS = 1_700_000_000_000_000_000
Kind = Literal["poses", "garbage"]
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
        make = poses(session, options.robots) if options.kind == "poses" else garbage(session, options.robots)
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


def garbage(session: zenoh.Session, robots: int) -> Make:
    """Garbage of every kind in turn; good robots are called b1, b2, ..."""
    chance = random.Random(0)
    good = [keys.pose(SITE, f"b{number + 1}") for number in range(robots)]
    short = [
        _same(good, chance.randbytes(_NOISE_BYTES)),
        _same([keys.keyframe(SITE, f"x{number}") for number in range(_NAMES)], chance.randbytes(_NOISE_BYTES)),
        _same(good, _pose("somebody").SerializeToString()),
        _wrong(session, robots),
    ]
    # Long ones are fewer: what they cost is the carrying of their bytes.
    kinds = cycle([*short, *short, _same([keys.pose(SITE, "long")], bytes(codec.MAX_POSE_BYTES + 1))])
    return lambda _number: next(next(kinds))


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

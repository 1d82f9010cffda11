"""How much can come in, and what does it cost those who send in measure?

Ten robots send one keyframe of 500 features and one pose a second: alone, beside a flood of poses of ten other robots,
and beside a flood of garbage; each time to a station of its own.
"""

from __future__ import annotations

import time
from collections.abc import Iterator, Mapping
from contextlib import ExitStack
from dataclasses import dataclass
from functools import partial
from itertools import pairwise

from covista_clients.simulation.marching import March
from covista_schemas.reports import Counters

from covista_service.bench import flood, raw_subscriber
from covista_service.bench.flood import Flooded, FloodOptions
from covista_service.bench.load import LoadOptions
from covista_service.bench.rig import LoadError, Rig, expect, free_endpoint, rig
from covista_service.bench.row import Row, median, spread
from covista_service.demo import children
from covista_service.demo.children import Child

POSES_PER_S = 20_000
GARBAGE_PER_S = 10_000
ROBOTS = 10
_RATE_HZ = 1.0
# Somewhat more is offered, for a generator that shares two cores is late now and then.
_OFFERED = 1.1
_SECONDS, _LONG_SECONDS = 10.0, 30.0
_RAW_SECONDS = 3.0
# Kinds take turns, so that a machine whose speed drifts does not tell them apart.
_COST_SECONDS, _COST_ROUNDS = 2.0, 5
_COST_PER_S: dict[flood.Kind, float] = {
    "poses": GARBAGE_PER_S,
    "garbage_short": GARBAGE_PER_S,
    # As often as a robot is heard, so that all of them are opened.
    "keyframes": 20,
    "garbage_long": 2000,
}
_LOOK_S = 1.0
_DRAIN_S, _POLL_S = 10.0, 0.1

_row = partial(Row, bench="ingest")


@dataclass(frozen=True, slots=True)
class Run:
    """What came of a load: from a keyframe to the first groups with it, and the flood as received, a second."""

    p50_ms: float
    rates: tuple[float, ...] = ()
    sent: int = 0
    accounted: bool = True


def rows(long: bool) -> Iterator[Row]:
    """`ingest/poses`, `keyframe_p50_quiet` and `_flooded`, `garbage`, `garbage_cost` and `garbage_long_cost`."""
    seconds = _LONG_SECONDS if long else _SECONDS
    raw = raw_rate()
    quiet = under_flood(seconds)
    flooded = under_flood(seconds, "poses", _OFFERED * POSES_PER_S)
    steady = flooded.p50_ms <= 2.0 * quiet.p50_ms
    yield _row(
        case="poses",
        median=median(flooded.rates),
        spread=spread(flooded.rates),
        unit="messages/s",
        peer="a raw zenoh subscriber that counts, and nothing else at work",
        peer_median=raw,
        mark=f">= {POSES_PER_S} beside keyframes whose p50 is not more than doubled; all accounted for",
        holds=median(flooded.rates) >= POSES_PER_S and steady and flooded.accounted,
    )
    yield _latency("keyframe_p50_quiet", quiet.p50_ms, None, "beside nothing", holds=True)
    yield _latency("keyframe_p50_flooded", flooded.p50_ms, quiet.p50_ms, "<= 2 x quiet", holds=steady)
    dirty = under_flood(seconds, "garbage", GARBAGE_PER_S)
    holds = dirty.p50_ms <= 2.0 * quiet.p50_ms and dirty.accounted
    yield _latency("garbage", dirty.p50_ms, quiet.p50_ms, f"<= 2 x quiet, beside {GARBAGE_PER_S} a second", holds=holds)
    yield from _costs(_COST_SECONDS)


def _latency(case: str, p50_ms: float, quiet_ms: float | None, mark: str, *, holds: bool) -> Row:
    peer = None if quiet_ms is None else "the same without"
    return _row(
        case=case, median=p50_ms, spread=None, unit="ms", peer=peer, peer_median=quiet_ms, mark=mark, holds=holds
    )


def _costs(seconds: float) -> Iterator[Row]:
    cost_us = costs_us(seconds, _COST_PER_S, _COST_ROUNDS)
    for case, bad, good, peer in (
        ("garbage_cost", "garbage_short", "poses", "a good pose"),
        ("garbage_long_cost", "garbage_long", "keyframes", "a good keyframe of 500 features, of a robot alone"),
    ):
        yield _row(
            case=case,
            median=median(cost_us[bad]),
            spread=spread(cost_us[bad]),
            unit="us",
            peer=peer,
            peer_median=median(cost_us[good]),
            mark="processor time each, less than the peer",
            holds=median(cost_us[bad]) < median(cost_us[good]),
        )


def costs_us(seconds: float, per_s: Mapping[flood.Kind, float], rounds: int) -> dict[str, list[float]]:
    """Processor time, by round, that a station with nothing else to do spends per message of each kind.

    What it spends by itself is read in each round as well, and taken off: of few messages, a cost may be below zero.
    """
    endpoint = free_endpoint()
    with rig(LoadOptions(endpoint, robots=1, features=100)) as running:
        found: dict[str, list[float]] = {kind: [] for kind in per_s}
        for _ in range(rounds):
            before_s = running.readings().cpu_s
            time.sleep(seconds)
            idle_s = running.readings().cpu_s - before_s
            for kind, rate in per_s.items():
                robots = 1 if kind == "keyframes" else ROBOTS
                found[kind].append(_cost_us(running, FloodOptions(endpoint, seconds, kind, rate, robots), idle_s))
        return found


def _cost_us(running: Rig, options: FloodOptions, idle_s: float) -> float:
    with ExitStack() as stack:
        flooder = _start(stack, flood.__name__, options)
        before_s = running.readings().cpu_s
        flooder.line.send("go")
        flooded = expect(flooder, Flooded)
        return cost_us(running.readings().cpu_s - before_s, idle_s, flooded.sent)


def cost_us(cpu_s: float, idle_s: float, messages: int) -> float:
    """Processor time per message, of what was spent while they came and what would have been spent without."""
    return 1e6 * (cpu_s - idle_s) / messages


def raw_rate(seconds: float = _RAW_SECONDS) -> float:
    """Poses a second that a subscriber can count that does nothing else."""
    endpoint = free_endpoint()
    with ExitStack() as stack:
        listener = _start(stack, raw_subscriber.__name__, endpoint)
        flooder = _start(stack, flood.__name__, FloodOptions(endpoint, seconds, robots=ROBOTS))
        flooder.line.send("go")
        flooded = expect(flooder, Flooded)
        listener.line.send("count")
        return expect(listener, int) / flooded.seconds


def under_flood(seconds: float, kind: flood.Kind | None = None, rate: float = 0.0, robots: int = ROBOTS) -> Run:
    """What comes of a load of so many robots, beside a flood of that kind if there is one. Raises LoadError."""
    endpoint = free_endpoint()
    with ExitStack() as stack:
        running = stack.enter_context(rig(LoadOptions(endpoint, robots=robots)))
        flooder = None
        if kind is not None:
            flooder = _start(stack, flood.__name__, FloodOptions(endpoint, seconds, kind, rate, robots))
        running.start(March(_RATE_HZ, _RATE_HZ, seconds))
        rates: list[float] = []
        flooded = Flooded(0, 0.0)
        if flooder is not None:
            flooder.line.send("go")
            rates = _rates(running, seconds)
            flooded = expect(flooder, Flooded)
        keyframes = running.sent().keyframes
        running.settle()
        p50_ms = running.summary().latency_p50_ms
        if p50_ms is None:
            raise LoadError("no keyframe came as far as the groups")
        accounted = _drained(running, keyframes, flooded.sent if kind == "poses" else 0)
        return Run(p50_ms, tuple(rates), flooded.sent, accounted)


def _start(stack: ExitStack, role: str, argument: object) -> Child:
    child = children.start(role, argument)
    stack.callback(child.end)
    expect(child, str)
    return child


def _rates(running: Rig, seconds: float) -> list[float]:
    """Poses received a second, looked at once a second; the first and the last second are left out, being in part."""
    looks: list[tuple[float, int]] = []
    end_s = time.monotonic() + seconds
    while time.monotonic() < end_s:
        time.sleep(_LOOK_S)
        looks.append((time.monotonic(), running.summary().poses_received))
    pairs = pairwise(looks[:-1])
    return [(count - before) / (at_s - before_s) for (before_s, before), (at_s, count) in pairs]


def _drained(running: Rig, keyframes: int, poses: int) -> bool:
    """Wait until what is still on its way is accounted for, for some seconds at most, and say whether it is."""
    deadline_s = time.monotonic() + _DRAIN_S
    while not (accounted := _accounted(running, keyframes, poses)) and time.monotonic() < deadline_s:
        time.sleep(_POLL_S)
    return accounted


def _accounted(running: Rig, keyframes: int, poses: int) -> bool:
    """Is every keyframe of the good robots, and every pose of the flood, received or missed, and its fate known?"""
    robots = {robot.id: robot for robot in running.watch.robots().robots}
    good = [robot.keyframes for name, robot in robots.items() if name.startswith("b")]
    hasty = [robot.poses for name, robot in robots.items() if name.startswith("f")]
    return _total(good) == keyframes and _total(hasty) == poses and all(map(_balanced, good + hasty))


def _total(counters: list[Counters]) -> int:
    return sum(each.received + each.missing for each in counters)


def _balanced(counters: Counters) -> bool:
    fates = counters.used + counters.replaced + counters.duplicate + counters.waiting
    return counters.received == fates + sum(counters.dropped.values())

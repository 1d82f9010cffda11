"""Is a station that gets five times what it can take still there for others, and how soon is it as before?

First it is found how many keyframes a second the station takes. Then robots send a quarter of that, then five times as
many, then a quarter again, while somebody asks for groups, readiness and a pair over REST all the time, and for
similarity, robots and metrics now and then.
"""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from covista_clients.simulation.marching import March
from covista_schemas.reports import Counters, RobotReport, Status

from covista_service.bench.load import PREFIX, LoadOptions, Sent
from covista_service.bench.prober import Answers, Prober
from covista_service.bench.rig import Rig, free_endpoint, rig
from covista_service.bench.row import Row, median, quantile, spread

MOST_REST_MS = 250.0
MOST_RECOVERY_S = 5.0
LEAST_POSES_USED = 0.9
# Of a keyframe that is in time; where the quiet station needs longer for some, no longer than twice that.
IN_TIME_MS = 500.0
TIMES = 5.0
ROBOTS = 20
_FEATURES = 500
_POSES_HZ = 1.0
_FLOOD_PER_S = 80.0
_NORMAL = 1 / 4
_SETTLE_S = 5.0
_OFTEN_HZ, _SELDOM_HZ = 5.0, 0.5
_OFTEN = ("/api/v1/groups", "/readyz", f"/api/v1/pairs/{PREFIX}1/{PREFIX}2")
_SELDOM = ("/api/v1/similarity", "/api/v1/robots", "/metrics")
_RATES_HZ = dict.fromkeys(_OFTEN, _OFTEN_HZ) | dict.fromkeys(_SELDOM, _SELDOM_HZ)
# A generator that shares the cores is late now and then.
LEAST_SENT = 0.9


@dataclass(frozen=True, slots=True)
class Times:
    """How long the parts last, seconds."""

    flood_s: float
    quiet_s: float
    overload_s: float
    after_s: float


SHORT, LONG = Times(5.0, 6.0, 10.0, 8.0), Times(20.0, 30.0, 120.0, 30.0)


@dataclass(frozen=True, slots=True)
class Ordeal:
    """What came of it: keyframes a second taken and sent, answers in quiet and under overload, and the rest.

    `recovery_s` is how long after the end of the overload keyframes were late, None if to the end. `astray` messages
    are neither received nor missing, or have no fate.
    """

    taken_per_s: float
    sent_per_s: float
    quiet: Answers
    pressed: Answers
    recovery_s: float | None
    astray: int
    not_live: int
    poses_used: float


def rows(long: bool) -> Iterator[Row]:
    """`overload/rest_p99`, beside the same questions to the quiet station, and how well the station bears it all.

    `taken` is how many keyframes a second come as far as the groups when far more are sent, and `sent` how many were.
    """
    times = LONG if long else SHORT
    with rig(LoadOptions(free_endpoint(), robots=ROBOTS, features=_FEATURES)) as running:
        found = ordeal(running, ROBOTS, times)
    yield from rows_of(found, times)


def rows_of(found: Ordeal, times: Times) -> Iterator[Row]:
    """What came of an ordeal that lasted so long."""
    yield _row("taken", found.taken_per_s, "keyframes/s", "", holds=True)
    least_per_s = LEAST_SENT * TIMES * found.taken_per_s
    enough = found.sent_per_s >= least_per_s
    yield _row("sent", found.sent_per_s, "keyframes/s", f">= {LEAST_SENT:g} x {TIMES:g} x taken", holds=enough)
    yield Row(
        bench="overload",
        case="rest_p99",
        median=quantile(found.pressed.times_ms, 0.99),
        spread=spread(found.pressed.times_ms),
        unit="ms",
        peer="p99 of the quiet station",
        peer_median=quantile(found.quiet.times_ms, 0.99),
        mark=f"<= {MOST_REST_MS:g} ms, all answered",
        holds=quantile(found.pressed.times_ms, 0.99) <= MOST_REST_MS and not found.pressed.failures,
    )
    yield _row("rest_p50", median(found.pressed.times_ms), "ms", "", holds=True)
    recovery_s = times.after_s if found.recovery_s is None else found.recovery_s
    recovered = found.recovery_s is not None and recovery_s <= MOST_RECOVERY_S
    yield _row("recovery", recovery_s, "s", f"<= {MOST_RECOVERY_S:g} s", holds=recovered)
    yield _row("uncounted", found.astray, "messages", "0", holds=not found.astray)
    yield _row("not_live", found.not_live, "robots", "0", holds=not found.not_live)
    used = found.poses_used >= LEAST_POSES_USED
    yield _row("poses_used", 100 * found.poses_used, "%", f">= {100 * LEAST_POSES_USED:g} %", holds=used)


def ordeal(running: Rig, robots: int, times: Times) -> Ordeal:
    """Put a station through it."""

    def plan(keyframes_per_s: float, seconds: float) -> March:
        return March(keyframes_per_s / robots, _POSES_HZ, seconds)

    flooded, sent = running.window(plan(_FLOOD_PER_S, times.flood_s), Sent(0, 0, 0.0))
    taken_per_s = flooded.surveyed_per_s
    running.settle(_SETTLE_S)
    with Prober(running.url, _RATES_HZ) as prober:
        prober.answers()
        calm, sent = running.window(plan(_NORMAL * taken_per_s, times.quiet_s), sent)
        quiet, before = prober.answers(), _poses(running.watch.robots().robots)
        pressed, more = running.window(plan(TIMES * taken_per_s, times.overload_s), sent)
        reports, end_s, answers = running.watch.robots().robots, time.time(), prober.answers()
        last = running.march(plan(_NORMAL * taken_per_s, times.after_s))
    running.settle(_SETTLE_S)
    running.accounted(last)
    in_time_ms = max(IN_TIME_MS, 2 * calm.latency_ms(0.99))
    return Ordeal(
        taken_per_s=taken_per_s,
        sent_per_s=pressed.keyframes / pressed.seconds,
        quiet=quiet,
        pressed=answers,
        recovery_s=recovery_s(running.readings().latencies_ms, end_s, times.after_s, in_time_ms),
        astray=astray(running.watch.robots().robots, last),
        not_live=robots - sum(report.status is Status.LIVE for report in reports),
        poses_used=(_poses(reports) - before) / (more.poses - sent.poses),
    )


def recovery_s(
    latencies_ms: Sequence[tuple[float, float]], end_s: float, after_s: float, in_time_ms: float
) -> float | None:
    """For how many seconds after `end_s` keyframes (arrival, s; latency, ms) are late; None if for all `after_s`.

    Second by second: one is late if half of the keyframes that arrived in it are, or if none came as far as the groups.
    """
    seconds: list[list[float]] = [[] for _ in range(int(after_s))]
    for arrived_s, latency_ms in latencies_ms:
        if 0 <= arrived_s - end_s < len(seconds):
            seconds[int(arrived_s - end_s)].append(latency_ms)
    late = [number for number, those in enumerate(seconds, 1) if not those or median(those) > in_time_ms]
    if not late:
        return 0.0
    return float(late[-1]) if late[-1] < len(seconds) else None


def astray(reports: Sequence[RobotReport], sent: Sent) -> int:
    """Messages that are on no account: sent = received + missing, and received = the sum of all fates."""
    count = 0
    for counters, number in (
        ([report.keyframes for report in reports], sent.keyframes),
        ([report.poses for report in reports], sent.poses),
    ):
        count += abs(number - sum(each.received + each.missing for each in counters))
        count += sum(abs(each.received - _settled(each)) for each in counters)
    return count


def _settled(counters: Counters) -> int:
    return counters.used + counters.replaced + counters.duplicate + counters.waiting + sum(counters.dropped.values())


def _poses(reports: Sequence[RobotReport]) -> int:
    return sum(report.poses.used for report in reports)


def _row(case: str, figure: float, unit: str, mark: str, *, holds: bool) -> Row:
    return Row(
        bench="overload",
        case=case,
        median=figure,
        spread=None,
        unit=unit,
        peer=None,
        peer_median=None,
        mark=mark,
        holds=holds,
    )

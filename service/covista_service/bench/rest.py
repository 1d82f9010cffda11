"""How soon does mission control have its answers while robots are at work?

20 robots send a keyframe and a pose a second each, 80 others are there, and 50 clients ask for the groups and for all
robots once a second each. Then nobody sends, and one asks for the similarity matrix of a thousand robots as numbers.
"""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import ExitStack

import httpx
from covista_clients.simulation.marching import March

from covista_service.bench import audience, load
from covista_service.bench.audience import Attended, AudienceOptions
from covista_service.bench.load import LoadOptions, Prepared, Sent
from covista_service.bench.rig import LoadError, Rig, expect, free_endpoint, rig
from covista_service.bench.row import Row, median, quantile, spread
from covista_service.demo import children

MOST_READ_MS = 50.0
MOST_MATRIX_MS = 100.0
# A client that hangs has no time.
LEAST_ANSWERED = 0.9
ROBOTS, OTHERS, CLIENTS = 20, 80, 50
CROWD = 1000
_GROUPS, _ROBOTS, _MATRIX = "/api/v1/groups", "/api/v1/robots", "/api/v1/similarity"
_SECONDS, _LONG_SECONDS = 10.0, 60.0
_LEAD_S = 5.0
_RATE_HZ = 1.0
_ROUNDS = 9
_X_NPY = {"accept": "application/x-npy"}


def rows(long: bool) -> Iterator[Row]:
    """`rest/groups_p99` and `robots_p99`, beside one client of a station that is left alone, and `matrix_n1000`."""
    seconds = _LONG_SECONDS if long else _SECONDS
    quiet, pressed = reads(seconds, ROBOTS, OTHERS, CLIENTS)
    for case, path in (("groups_p99", _GROUPS), ("robots_p99", _ROBOTS)):
        p99_ms = quantile(pressed.times_ms[path], 0.99)
        answered = len(pressed.times_ms[path]) / (CLIENTS * seconds)
        yield Row(
            bench="rest",
            case=case,
            median=p99_ms,
            spread=spread(pressed.times_ms[path]),
            unit="ms",
            peer="p99 of one client of a quiet station",
            peer_median=quantile(quiet.times_ms[path], 0.99),
            mark=f"<= {MOST_READ_MS:g} ms, all answered",
            holds=p99_ms <= MOST_READ_MS and not pressed.failures and answered >= LEAST_ANSWERED,
        )
    times_ms = matrix_ms(CROWD, _ROUNDS)
    yield Row(
        bench="rest",
        case=f"matrix_n{CROWD}",
        median=median(times_ms),
        spread=spread(times_ms),
        unit="ms",
        peer=None,
        peer_median=None,
        mark=f"<= {MOST_MATRIX_MS:g} ms",
        holds=median(times_ms) <= MOST_MATRIX_MS,
    )


def reads(seconds: float, robots: int, others: int, clients: int) -> tuple[Attended, Attended]:
    """What one client sees of a station that is left alone, and many see of one that works. Raises LoadError."""
    endpoint = free_endpoint()
    with ExitStack() as stack:
        running = stack.enter_context(rig(LoadOptions(endpoint, robots=robots)))
        bystanders = children.start(load.__name__, LoadOptions(endpoint, robots=others, features=200, prefix="c"))
        stack.callback(bystanders.end)
        expect(bystanders, Prepared)
        bystanders.line.send(March(1 / _LEAD_S, 1 / _LEAD_S, _LEAD_S))
        running.march(March(_RATE_HZ, _RATE_HZ, _LEAD_S))
        expect(bystanders, Sent)
        running.settle()
        quiet = _attended(running, 1, seconds / 2, None)
        pressed = _attended(running, clients, seconds, March(_RATE_HZ, _RATE_HZ, seconds + 1.0))
        if len(running.watch.robots().robots) != robots + others:
            raise LoadError("some robots were not heard")
        return quiet, pressed


def matrix_ms(robots: int, rounds: int) -> list[float]:
    """How long the similarity matrix takes as numbers, each time another one. Raises LoadError."""
    with rig(LoadOptions(free_endpoint(), robots=robots, features=100)) as running:
        # A keyframe of everybody, so that all are in it.
        running.march(March(0.1, 0.1, 1.1 * 10.0))
        running.settle()
        times_ms: list[float] = []
        with httpx.Client(base_url=running.url, headers=_X_NPY, timeout=10.0) as client:
            for _ in range(rounds):
                # A few poses, so that there is news.
                running.march(March(0.0, 5.0 / robots, 1.0))
                begun_s = time.perf_counter()
                answer = client.get(_MATRIX)
                times_ms.append(1e3 * (time.perf_counter() - begun_s))
                if answer.status_code != 200 or len(answer.content) < 8 * robots * robots:
                    raise LoadError(f"no matrix of {robots} robots, but {answer.status_code}")
        return times_ms


def _attended(running: Rig, clients: int, seconds: float, plan: March | None) -> Attended:
    with ExitStack() as stack:
        options = AudienceOptions(running.url, (_GROUPS, _ROBOTS), clients)
        child = children.start(audience.__name__, options)
        stack.callback(child.end)
        expect(child, str)
        if plan is not None:
            running.start(plan)
        child.line.send("tell")
        expect(child, Attended)
        time.sleep(seconds)
        child.line.send("tell")
        seen = expect(child, Attended)
        if plan is not None:
            running.sent()
        return seen

"""How soon do 200 listeners hear of a change of the groups, while 20 robots are at work?

Whoever watches changes the number of groups once a second: each time all robots are grouped anew.
"""

from __future__ import annotations

import itertools
import time
from collections.abc import Iterator
from contextlib import ExitStack
from dataclasses import replace

import httpx
from covista_clients.simulation.marching import March

from covista_service.bench import audience
from covista_service.bench.audience import Attended, AudienceOptions
from covista_service.bench.load import LoadOptions
from covista_service.bench.rig import LoadError, expect, free_endpoint, rig
from covista_service.bench.row import Row, quantile, spread
from covista_service.demo import children

MOST_P95_MS = 200.0
ROBOTS, LISTENERS = 20, 200
_RATE_HZ = 1.0
_SECONDS, _LONG_SECONDS = 10.0, 60.0
_LEAD_S = 5.0


def rows(long: bool) -> Iterator[Row]:
    """`sse/p95`: from the moment of a change to each listener, beside one listener alone; and what was not heard."""
    seconds = _LONG_SECONDS if long else _SECONDS
    alone = listen(seconds / 2, ROBOTS, 1)
    crowd = listen(seconds, ROBOTS, LISTENERS)
    p95_ms = quantile(crowd.delays_ms, 0.95)
    yield Row(
        bench="sse",
        case="p95",
        median=p95_ms,
        spread=spread(crowd.delays_ms),
        unit="ms",
        peer="p95 of one listener alone",
        peer_median=quantile(alone.delays_ms, 0.95),
        mark=f"<= {MOST_P95_MS:g} ms",
        holds=p95_ms <= MOST_P95_MS and not crowd.failures,
    )
    unheard = sum(LISTENERS - count for count in crowd.heard.values())
    yield Row(
        bench="sse",
        case="unheard",
        median=unheard,
        spread=None,
        unit="events",
        peer=None,
        peer_median=None,
        mark="0",
        holds=not unheard,
    )


def listen(seconds: float, robots: int, listeners: int) -> Attended:
    """What so many listeners hear while robots are at work and groups change. Raises LoadError."""
    with ExitStack() as stack:
        running = stack.enter_context(rig(LoadOptions(free_endpoint(), robots=robots)))
        running.march(March(_RATE_HZ, _RATE_HZ, _LEAD_S))
        child = children.start(audience.__name__, AudienceOptions(running.url, listeners=listeners))
        stack.callback(child.end)
        expect(child, str)
        running.start(March(_RATE_HZ, _RATE_HZ, seconds + 2.0))
        client = stack.enter_context(httpx.Client(base_url=running.url, timeout=10.0))
        child.line.send("tell")
        expect(child, Attended)
        end_s = time.monotonic() + seconds
        for groups in itertools.cycle((2, 4)):
            if client.patch("/api/v1/settings", json={"groups": groups}).is_error:
                raise LoadError("the settings cannot be changed")
            time.sleep(1.0)
            if time.monotonic() > end_s:
                break
        child.line.send("tell")
        heard = expect(child, Attended)
        # What was on its way when counting began, some have heard of before.
        heard = replace(
            heard, heard={number: count for number, count in heard.heard.items() if number != min(heard.heard)}
        )
        running.sent()
        if not heard.delays_ms:
            raise LoadError("nobody has heard of a change of the groups")
        return heard

"""What do open dashboards cost the station, and does their map move smoothly?

The cost is that of what pages ask for, in latency, by clients that do no more than ask: a browser beside the station,
on the same two cores, would take more than it asks for. Smoothness is that of a real browser, which has those cores and
no graphics card to draw with. Runs only when it is named, for it needs Playwright and a browser.
"""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from functools import partial
from importlib.util import find_spec

from covista_clients.simulation.marching import March
from covista_schemas.errors import CovistaError, MissingExtraError

from covista_service.bench import audience, browsing
from covista_service.bench.audience import Attended, AudienceOptions
from covista_service.bench.browsing import BrowsingOptions, Seen, browser_path
from covista_service.bench.latency import MARKS_MS
from covista_service.bench.load import PREFIX, LoadOptions, Sent
from covista_service.bench.rig import LoadError, Rig, Window, expect, free_endpoint, rig
from covista_service.bench.row import Row
from covista_service.demo import children

ROBOTS, PAGES = 20, 5
# Robots on the map, and the frames a second that it must have.
CROWDS = ((200, 20.0), (1000, 5.0))
_SWARM = "/dashboard/"
# What an open page asks for in so many seconds: the swarm, and each time with all edges; why two robots are apart or
# together; who is logged in.
_ROUND_S = 2.0
_ASKED = (
    *("/dashboard/data/swarm",) * 5,
    *(f"/dashboard/data/why?a={PREFIX}1&b={PREFIX}2",) * 2,
    "/dashboard/data/session",
)
_SECONDS, _LONG_SECONDS = 20.0, 60.0
_LEAD_S = 5.0
_RATE_HZ = 1.0

_row = partial(Row, bench="dashboard", spread=None)


def rows(long: bool) -> Iterator[Row]:
    """`p50`, `p99`: the latency with five pages open; `frames_n200`, `frames_n1000`: how often a map is drawn.

    Time of processors tells nothing of pages: workers look for more to survey whenever a core is idle.
    """
    _check()
    seconds = _LONG_SECONDS if long else _SECONDS
    alone, watched = watched_load(seconds)
    for case, (share, mark_ms) in MARKS_MS.items():
        figure = watched.latency_ms(share)
        yield _row(
            case=case,
            median=figure,
            unit="ms",
            peer="the same without pages",
            peer_median=alone.latency_ms(share),
            mark=f"<= {mark_ms:g} ms",
            holds=figure <= mark_ms,
        )
    for robots, least in CROWDS:
        figure = frames_per_s(robots, seconds / 2)
        yield _row(
            case=f"frames_n{robots}",
            median=figure,
            unit="frames/s",
            peer=None,
            peer_median=None,
            mark=f">= {least:g} frames/s",
            holds=figure >= least,
        )


def watched_load(seconds: float) -> tuple[Window, Window]:
    """What a station does under the load of `latency`, alone and with what pages ask. Raises LoadError."""
    plan, lead = March(_RATE_HZ, _RATE_HZ, seconds), March(_RATE_HZ, _RATE_HZ, _LEAD_S)
    with rig(LoadOptions(free_endpoint(), robots=ROBOTS)) as running:
        sent = running.march(lead)
        alone, sent = running.window(plan, sent)
        with ExitStack() as stack:
            pages = children.start(audience.__name__, AudienceOptions(running.url, _ASKED, PAGES, _ROUND_S))
            stack.callback(pages.end)
            expect(pages, str)
            sent = running.march(lead)
            watched, sent = running.window(plan, sent)
            pages.line.send("tell")
            if expect(pages, Attended).failures:
                raise LoadError("the station did not answer all that pages ask for")
        return alone, watched


def frames_per_s(robots: int, seconds: float) -> float:
    """How often a map of so many moving robots is drawn. Raises LoadError."""
    with rig(LoadOptions(free_endpoint(), robots=robots, features=100)) as running:
        # A keyframe of everybody, and from then on poses alone.
        running.march(March(0.1, 0.1, 11.0))
        running.settle()
        running.start(March(0.0, 0.5, seconds + 2 * _LEAD_S))
        with _looking(running, _SWARM) as page:
            time.sleep(_LEAD_S)
            before = _look(page)
            time.sleep(seconds)
            after = _look(page)
        expect(running.robots, Sent)
    return (after.frames - before.frames) / (after.at_s - before.at_s)


@contextmanager
def _looking(running: Rig, path: str) -> Iterator[children.Child]:
    with ExitStack() as stack:
        child = children.start(browsing.__name__, BrowsingOptions(running.url, path))
        stack.callback(child.end)
        expect(child, Seen)
        yield child


def _look(child: children.Child) -> Seen:
    child.line.send("look")
    return expect(child, Seen)


def _check() -> None:
    """Raises MissingExtraError, or CovistaError where there is no browser."""
    if find_spec("nicegui") is None:
        raise MissingExtraError("bench dashboard", "dashboard")
    if find_spec("playwright") is None:
        raise MissingExtraError("bench dashboard", "dev")
    if browser_path() is None:
        raise CovistaError(f"bench dashboard needs a browser: one of {', '.join(browsing.BROWSERS)}")

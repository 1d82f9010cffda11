"""What the station tells over zenoh: the groups, each robot's own group, and events.

The last value of each key, and some hundred events, are kept for advanced subscribers that come late. What a subscriber
missed, because it slept or its link was away, it notices by the heartbeats of the key and asks for again. A thread of
its own puts, so that a slow peer costs the loop nothing; where it cannot keep up, only the newest of a key goes out.

What a subscriber does not take is dropped for that subscriber alone, once it has held up the others for as long as
`session.WAIT_US`. (Blocking, zenoh waits five seconds for one that is stopped, and everybody else with it.) The same
goes for heartbeats. What is sent again is not: it goes out in zenoh's threads, of a lower priority.
"""

from __future__ import annotations

import logging
import threading
from collections import deque
from collections.abc import Callable

import zenoh
from covista_schemas import keys
from covista_schemas.errors import LinkError
from covista_schemas.reports import EventReport
from zenoh import ext

from covista_service import answers
from covista_service.loop import News, SinkStatus
from covista_service.station.snapshot import Snapshot
from covista_service.telemetry import about

MAX_EVENTS = 1000
# Kept for who comes late or missed some; of groups the newest says all.
EVENTS_KEPT = 500
# How soon a subscriber notices that the last value passed it by.
HEARTBEAT_S = 1.0
# A thousand rovers have a key each, and changes of their groups are rare.
OWN_HEARTBEAT_S = 5.0

log = logging.getLogger(__name__)


class Publisher:
    """A sink of the loop's news. Without a session it keeps what is to be told until it joins one."""

    def __init__(self, session: zenoh.Session | None, site: str) -> None:
        self._session = session
        self._site = site
        self._changed = threading.Condition()
        self._events: deque[EventReport] = deque(maxlen=MAX_EVENTS)
        self._robots: dict[str, None] = {}
        self._snapshot: Snapshot | None = None
        # The groups that were told last.
        self._last: Snapshot | None = None
        self._busy = self._parting = False
        self._closing = False
        self._told = 0
        self._lost = 0
        self._publishers: dict[str, ext.AdvancedPublisher] = {}
        self._thread = threading.Thread(target=self._run, name="covista-publish")
        self._thread.start()

    def take(self, news: News) -> None:
        """Publish this soon."""
        with self._changed:
            self._lost += max(0, len(self._events) + len(news.events) - MAX_EVENTS)
            self._events.extend(news.events)
            if news.groups_changed:
                self._snapshot = news.snapshot
                self._robots.update(dict.fromkeys(news.robots))
            self._changed.notify_all()

    def join(self, session: zenoh.Session) -> Callable[[], None]:
        """Tell on this session, the groups that stand first; returns how to part with it."""
        with self._changed:
            self._session = session
            if self._last is not None:
                self._snapshot = self._snapshot or self._last
                self._robots.update(dict.fromkeys(self._last.robots))
            self._changed.notify_all()
        return self.part

    def part(self) -> None:
        """Let go of the session, once what is being told is told."""
        with self._changed:
            self._parting = True
            self._changed.wait_for(lambda: not self._busy)
            self._session, self._parting = None, False
            while self._publishers:
                self._publishers.popitem()[1].undeclare()

    def status(self) -> SinkStatus:
        """How many events and groups of robots wait, were put, and were lost because they could not be."""
        with self._changed:
            return SinkStatus(len(self._events) + len(self._robots), self._told, self._lost)

    def close(self) -> None:
        """Publish what is waiting, then end."""
        with self._changed:
            self._closing = True
            self._changed.notify_all()
        self._thread.join()
        while self._publishers:
            self._publishers.popitem()[1].undeclare()

    @property
    def keys(self) -> frozenset[str]:
        """The keys that hold a last value."""
        return frozenset(self._publishers)

    def _run(self) -> None:
        while True:
            with self._changed:
                self._busy = False
                self._changed.notify_all()
                self._changed.wait_for(lambda: self._closing or self._may_tell)
                if not self._may_tell:
                    self._lost += len(self._events) + len(self._robots)
                    return
                snapshot, robots, events = self._snapshot, tuple(self._robots), tuple(self._events)
                self._snapshot = None
                self._robots.clear()
                self._events.clear()
                self._busy = True
            self._tell(snapshot, robots, events)

    @property
    def _may_tell(self) -> bool:
        """Whether something waits, and there is a session for it."""
        waits = bool(self._events) or self._snapshot is not None
        return waits and self._session is not None and not self._parting

    def _tell(self, snapshot: Snapshot | None, robots: tuple[str, ...], events: tuple[EventReport, ...]) -> None:
        try:
            self._publish(snapshot, robots, events)
        except Exception:
            # What cannot be published today must not keep tomorrow's groups from going out.
            log.exception("cannot publish", extra=about(events=len(events), robots=len(robots)))
            with self._changed:
                self._lost += len(events) + len(robots)
        else:
            with self._changed:
                self._told += len(events) + len(robots)

    def _publish(self, snapshot: Snapshot | None, robots: tuple[str, ...], events: tuple[EventReport, ...]) -> None:
        if snapshot is not None:
            self._last = snapshot
            self._put(keys.groups(self._site), answers.groups_report(snapshot).model_dump_json())
            for robot in robots:
                self._put(
                    keys.own_group(self._site, robot), answers.own_group_report(snapshot, robot).model_dump_json()
                )
            self._forget(snapshot)
        for event in events:
            self._put(keys.events(self._site), event.model_dump_json())

    def _put(self, key: str, text: str) -> None:
        if key not in self._publishers:
            self._publishers[key] = self._declare(key)
        self._publishers[key].put(text)

    def _declare(self, key: str) -> ext.AdvancedPublisher:
        kept = EVENTS_KEPT if key == keys.events(self._site) else 1
        whole = key in (keys.events(self._site), keys.groups(self._site))
        # What is sent again is not asked for twice, so it waits for its link; in a queue of its own, which holds up
        # nothing but itself.
        replies = ext.RepliesConfig(congestion_control=zenoh.CongestionControl.BLOCK, priority=zenoh.Priority.DATA_LOW)
        # Not sporadic heartbeats: zenoh sends those blocking.
        heartbeat = ext.MissDetectionConfig(
            heartbeat=HEARTBEAT_S if whole else OWN_HEARTBEAT_S, sporadic_heartbeat=None
        )
        if self._session is None:
            raise LinkError(f"no session to publish {key} on")
        return ext.declare_advanced_publisher(
            self._session,
            key,
            cache=ext.CacheConfig(kept, replies_config=replies),
            sample_miss_detection=heartbeat,
            publisher_detection=True,
            encoding=zenoh.Encoding.APPLICATION_JSON,
            congestion_control=zenoh.CongestionControl.DROP,
        )

    def _forget(self, snapshot: Snapshot) -> None:
        """Robots that are forgotten need no publisher any more."""
        standing = {keys.own_group(self._site, robot) for robot in snapshot.robots}
        standing |= {keys.groups(self._site), keys.events(self._site)}
        for key in self._publishers.keys() - standing:
            self._publishers.pop(key).undeclare()

"""Which robots are alive, where nobody else asks: a router learns so who says nothing under its own name."""

from __future__ import annotations

import threading
from collections.abc import Callable, Collection

import zenoh
from covista_schemas import keys
from covista_schemas.errors import KeyExpressionError
from covista_schemas.keys import RobotTopic


class Alive:
    """The robots of a site that have a liveliness token. Zenoh's threads write, and the one that looks reads."""

    def __init__(self, site: str) -> None:
        self._key = keys.every(site, RobotTopic.ALIVE)
        self._lock = threading.Lock()
        # None while there is no session to hear of them in.
        self._tokens: set[tuple[str, str | None]] | None = None

    def robots(self) -> Collection[str] | None:
        """Those that have one, None where nobody knows."""
        with self._lock:
            return None if self._tokens is None else {robot for robot, _ in self._tokens}

    def join(self, session: zenoh.Session) -> Callable[[], object]:
        """Hear of tokens in this session; returns how to end that."""
        with self._lock:
            self._tokens = set()
        subscriber = session.liveliness().declare_subscriber(self._key, self._take, history=True)

        def part() -> None:
            subscriber.undeclare()
            with self._lock:
                self._tokens = None

        return part

    def _take(self, sample: zenoh.Sample) -> None:
        try:
            key = keys.parse_robot_key(str(sample.key_expr))
        except KeyExpressionError:
            return
        with self._lock:
            if self._tokens is not None:
                there = sample.kind == zenoh.SampleKind.PUT
                (self._tokens.add if there else self._tokens.discard)((key.robot, key.boot))

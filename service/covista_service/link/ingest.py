"""From zenoh's threads into the mailboxes: copy the bytes, read the name, nothing more."""

from __future__ import annotations

import logging
import time
from collections.abc import Callable
from typing import Any

import zenoh
from covista_schemas import codec, keys
from covista_schemas.errors import DecodeError, KeyExpressionError
from covista_schemas.keys import RobotKey, RobotTopic

from covista_service.link.mailbox import Letter, Mailboxes
from covista_service.station.events import Topic

Peek = Callable[..., tuple[str, str, int]]

log = logging.getLogger(__name__)


class Ingest:
    """The subscriptions of one site. Zenoh may call back once more after the end, hence the flag."""

    def __init__(
        self, session: zenoh.Session, site: str, mailboxes: Mailboxes, clock: Callable[[], int] = time.time_ns
    ) -> None:
        self._mailboxes = mailboxes
        self._clock = clock
        self._closed = False
        alive = keys.every(site, RobotTopic.ALIVE)
        self._subscribers: list[zenoh.Subscriber[Any]] = [
            session.declare_subscriber(keys.every(site, RobotTopic.KEYFRAME), self._keyframe),
            session.declare_subscriber(keys.every(site, RobotTopic.POSE), self._pose),
            session.liveliness().declare_subscriber(alive, self._token, history=True),
        ]

    def close(self) -> None:
        """Hear no more."""
        self._closed = True
        for subscriber in self._subscribers:
            subscriber.undeclare()

    def _keyframe(self, sample: zenoh.Sample) -> None:
        self._message(sample, "keyframe", codec.peek_keyframe)

    def _pose(self, sample: zenoh.Sample) -> None:
        self._message(sample, "pose", codec.peek_pose)

    def _message(self, sample: zenoh.Sample, topic: Topic, peek: Peek) -> None:
        arrived_ns = self._clock()
        key = self._key(sample)
        if key is None:
            return
        data = sample.payload.to_bytes()
        try:
            _, boot, sequence = peek(data, robot=key.robot)
        except DecodeError as error:
            self._mailboxes.refuse(key.robot, topic, error.code, str(error), arrived_ns)
        else:
            self._mailboxes.put(Letter(key.robot, topic, boot, sequence, data, arrived_ns))

    def _token(self, sample: zenoh.Sample) -> None:
        key = self._key(sample)
        if key is not None and key.boot is not None:
            self._mailboxes.token(key.robot, key.boot, sample.kind == zenoh.SampleKind.PUT, self._clock())

    def _key(self, sample: zenoh.Sample) -> RobotKey | None:
        if self._closed:
            return None
        try:
            return keys.parse_robot_key(str(sample.key_expr))
        except KeyExpressionError as error:
            self._mailboxes.turn_away("wrong_key")
            log.debug("%s", error)
            return None

"""From zenoh's channels into the mailboxes: copy the bytes, read the name, nothing more.

A thread per topic takes all that has come whenever it gets its turn. (With a callback per message, each would wait for
the interpreter anew, and beside busy threads some thousand messages a second would be all that gets through.)
"""

from __future__ import annotations

import logging
import threading
import time
from collections.abc import Callable
from typing import Any

import zenoh
from covista_schemas import codec, keys
from covista_schemas import robot_pb2 as pb
from covista_schemas.errors import KeyExpressionError
from covista_schemas.keys import RobotTopic
from covista_schemas.names import KeyReader, NameReader

from covista_service.link.mailbox import Letter, Mailboxes
from covista_service.station.events import Topic

WRONG_KEY = "wrong_key"
# Messages between zenoh and the thread that takes them; when a channel is full, senders have to wait.
_POSES, _KEYFRAMES = 512, 64
# Messages closer together than that are waited for and taken together: to be woken for each costs ten times what a
# message does, and everybody else the interpreter.
_RUSH_S = 0.005

log = logging.getLogger(__name__)


class Ingest:
    """The subscriptions of one site. Zenoh may call back once more after the end, hence the flag."""

    def __init__(
        self, session: zenoh.Session, site: str, mailboxes: Mailboxes, clock: Callable[[], int] = time.time_ns
    ) -> None:
        self._mailboxes = mailboxes
        self._clock = clock
        self._closed = False
        # Robots and boots that have a token. Zenoh's threads and ours meet at the end.
        self._tokens: set[tuple[str, str]] = set()
        self._at_tokens = threading.Lock()
        self._subscribers: list[zenoh.Subscriber[Any]] = []
        self._threads: list[threading.Thread] = []
        self._listen(session, site, RobotTopic.KEYFRAME, _KEYFRAMES, _Opener("keyframe", mailboxes, clock))
        self._listen(session, site, RobotTopic.POSE, _POSES, _Opener("pose", mailboxes, clock))
        alive = keys.every(site, RobotTopic.ALIVE)
        self._subscribers.append(session.liveliness().declare_subscriber(alive, self._token, history=True))

    @property
    def alive(self) -> frozenset[str]:
        """The robots that have a token."""
        with self._at_tokens:
            return frozenset(robot for robot, _ in self._tokens)

    def part(self) -> None:
        """Hear no more, and know of no token any more: those that are still there show when we listen anew."""
        self.close()
        with self._at_tokens:
            tokens, self._tokens = self._tokens, set()
        for robot, boot in tokens:
            self._mailboxes.token(robot, boot, False, self._clock())

    def close(self) -> None:
        """Hear no more."""
        with self._at_tokens:
            self._closed = True
        for subscriber in self._subscribers:
            subscriber.undeclare()
        for thread in self._threads:
            thread.join()

    def _listen(self, session: zenoh.Session, site: str, topic: RobotTopic, capacity: int, opener: _Opener) -> None:
        subscriber = session.declare_subscriber(keys.every(site, topic), zenoh.handlers.FifoChannel(capacity))
        thread = threading.Thread(target=self._read, args=(subscriber.handler, opener), name=f"covista-{topic}s")
        thread.start()
        self._subscribers.append(subscriber)
        self._threads.append(thread)

    def _read(self, channel: zenoh.handlers.Handler[zenoh.Sample], opener: _Opener) -> None:
        last_s = 0.0
        try:
            while True:
                sample: zenoh.Sample | None = channel.recv()
                if time.monotonic() - last_s < _RUSH_S:
                    time.sleep(_RUSH_S)
                while sample is not None:
                    if not self._closed:
                        _survive(opener.open, sample)
                    sample = channel.try_recv()
                last_s = time.monotonic()
        except zenoh.ZError:
            log.debug("a channel was closed")

    def _token(self, sample: zenoh.Sample) -> None:
        with self._at_tokens:
            if not self._closed:
                self._note(str(sample.key_expr), sample.kind == zenoh.SampleKind.PUT)

    def _note(self, text: str, is_there: bool) -> None:
        try:
            key = keys.parse_robot_key(text)
        except KeyExpressionError:
            self._mailboxes.turn_away(WRONG_KEY)
            return
        if key.boot is not None:
            (self._tokens.add if is_there else self._tokens.discard)((key.robot, key.boot))
            self._mailboxes.token(key.robot, key.boot, is_there, self._clock())


class _Opener:
    """Reads the names of one topic's messages, in one thread."""

    def __init__(self, topic: Topic, mailboxes: Mailboxes, clock: Callable[[], int]) -> None:
        self._topic = topic
        self._mailboxes = mailboxes
        self._clock = clock
        self._keys = KeyReader()
        self._names = NameReader(pb.Pose if topic == "pose" else pb.Keyframe)
        self._most_bytes = codec.MAX_POSE_BYTES if topic == "pose" else codec.MAX_KEYFRAME_BYTES

    def open(self, sample: zenoh.Sample) -> None:
        """Put a message into its robot's mailbox."""
        arrived_ns = self._clock()
        robot = self._keys.read(str(sample.key_expr))
        if robot is None:
            self._mailboxes.turn_away(WRONG_KEY)
            return
        payload = sample.payload
        if (size := len(payload)) > self._most_bytes:
            text = f"{size} bytes, more than the {self._most_bytes} that it may have"
            self._mailboxes.refuse(robot, self._topic, codec.TOO_LARGE, lambda: f"payload: {text}", arrived_ns)
            return
        data = payload.to_bytes()
        name = self._names.read(data, robot)
        if isinstance(name, str):
            self._mailboxes.refuse(robot, self._topic, name, lambda: self._names.complain(data, robot), arrived_ns)
        else:
            self._mailboxes.put(Letter(robot, self._topic, name[0], name[1], data, arrived_ns))


def _survive(take: Callable[[zenoh.Sample], None], sample: zenoh.Sample) -> None:
    """A bug that one message brings to light costs that message, and not the thread."""
    try:
        take(sample)
    except Exception:
        log.exception("cannot take a message in")

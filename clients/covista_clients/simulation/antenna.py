"""One session through which all robots of a crowd send, as robots behind one radio would."""

from __future__ import annotations

import threading
import uuid
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from typing import Any

import zenoh
from covista_schemas import codec, keys
from covista_schemas.messages import Pose, PoseUpdate
from covista_schemas.zenoh_tls import Tls

from covista_clients.simulation.accounts import Account
from covista_clients.simulation.fleet import shared_session


class Antenna:
    """Numbers and sends what robots say, robots by index; nothing goes out, and no number is used up, unheard.

    Where the link is congested it waits: what is put is lost with the link only. Keyframes give way to poses.
    """

    def __init__(self, session: zenoh.Session, site: str, names: Sequence[str]) -> None:
        self.keyframes = [0] * len(names)
        self.poses = [0] * len(names)
        self._session = session
        self._names = names
        self._boots = [uuid.uuid4().hex for _ in names]
        self._heard = threading.Condition()
        self._keyframe_keys = [session.declare_keyexpr(keys.keyframe(site, name)) for name in names]
        self._pose_keys = [session.declare_keyexpr(keys.pose(site, name)) for name in names]
        # A station hears all robots or none: the first one's publishers tell.
        first = (keys.keyframe(site, names[0]), keys.pose(site, names[0]))
        self._probes = [session.declare_publisher(key) for key in first]
        self._listeners = [probe.declare_matching_listener(self._matched) for probe in self._probes]
        alive = [keys.alive(site, name, boot) for name, boot in zip(names, self._boots, strict=True)]
        self._tokens = [session.liveliness().declare_token(key) for key in alive]
        self._matched()

    def await_heard(self, stop: threading.Event, poll_s: float = 0.1) -> bool:
        """Wait until a station listens; False once `stop` is set."""
        with self._heard:
            while not (self.heard or stop.is_set()):
                self._heard.wait(poll_s)
        return not stop.is_set()

    def send_pose(self, robot: int, pose: Pose) -> None:
        """Send a robot's pose."""
        data = codec.encode_pose(self._update(robot, self.poses, pose))
        self._put(self._pose_keys[robot], data, codec.POSE_ENCODING, zenoh.Priority.INTERACTIVE_HIGH)

    def send_keyframe(self, robot: int, pose: Pose, picture: bytes) -> None:
        """Send a robot's keyframe, its picture as `codec.encode_picture` makes it."""
        data = codec.encode_taken(self._update(robot, self.keyframes, pose), picture)
        self._put(self._keyframe_keys[robot], data, codec.KEYFRAME_ENCODING, zenoh.Priority.DATA_LOW)

    def accounts(self) -> list[Account]:
        """What each robot has sent."""
        counted = zip(self._names, self._boots, self.keyframes, self.poses, strict=True)
        return [Account(*each) for each in counted]

    def close(self) -> None:
        """Let all robots leave."""
        undo: list[Callable[[], object]] = [each.undeclare for each in self._listeners]
        undo += [each.undeclare for each in self._probes]
        undo += [each.undeclare for each in self._tokens]
        for each in undo:
            each()

    def _put(self, key: zenoh.KeyExpr, data: bytes, encoding: str, priority: zenoh.Priority) -> None:
        """Wait where the link is congested: what is dropped on the way would be lost without a count."""
        self._session.put(
            key, data, encoding=encoding, congestion_control=zenoh.CongestionControl.BLOCK, priority=priority
        )

    def _update(self, robot: int, counts: list[int], pose: Pose) -> PoseUpdate:
        counts[robot] += 1
        return PoseUpdate(self._names[robot], self._boots[robot], counts[robot] - 1, pose)

    def _matched(self, _: object = None) -> None:
        # The stubs of zenoh call a status a bool; it is an object that is always true.
        statuses: list[Any] = [probe.matching_status for probe in self._probes]
        with self._heard:
            self.heard = all(status.matching for status in statuses)
            self._heard.notify_all()


@contextmanager
def antenna(
    connect: str, site: str, names: Sequence[str], stop: threading.Event, tls: Tls | None = None
) -> Iterator[Antenna | None]:
    """An antenna as soon as there is a router at `connect`; None once `stop` is set."""
    with ExitStack() as stack:
        session = shared_session(connect, stop, stack, tls)
        if session is None:
            yield None
            return
        raised = Antenna(session, site, names)
        stack.callback(raised.close)
        yield raised

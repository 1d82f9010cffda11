"""A rover's half of the zenoh link: publishers, presence, its group, and the station's confirmation."""

from __future__ import annotations

import logging
import random
import threading
import time
from collections.abc import Callable
from functools import partial
from typing import Any

import zenoh
import zenoh.ext
from covista_schemas import codec, keys
from covista_schemas.errors import LinkError
from covista_schemas.reports import KeyframeId, OwnGroupReport, Problem, RobotReport
from covista_schemas.zenoh_config import config
from covista_schemas.zenoh_tls import Tls
from pydantic import ValidationError

logger = logging.getLogger(__name__)

# Long enough for a slow network, short enough for a rover that is closed while it still looks for a router.
OPEN_TIMEOUT_MS = 1500
_PAUSE_S = 0.1
# After so long it is told that nobody answers, or listens, and what it may be.
PATIENCE_S = 5.0
_ASK_EVERY_S = 0.03
# Between two questions whether a keyframe was heard: at first, and at most. How often it is looked for an answer.
_PAUSES_S, _GLANCE_S = (0.1, 1.0), 0.01
# One station answers, and zenoh that the time is over.
_ANSWERS = 4
# After a router came back all its rovers ask at once: they ask again at different times.
_ASK_AGAIN_S = (0.03, 0.2)
# So many changes of the link are kept until somebody looks; the newest tell enough.
_CHANGES_KEPT = 8
# Groups that a slow callback may leave waiting; of more, the newest remain.
_GROUPS_WAITING = 16
# How long leaving waits for a callback that is at work.
_CALLBACK_END_S = 2.0

OnGroup = Callable[[OwnGroupReport], object]


def open_with_retry(endpoint: str, stop: threading.Event, tls: Tls | None = None) -> zenoh.Session | None:
    """A session as client of the router at `endpoint`, as soon as there is one; None once `stop` is set.

    When it takes long a warning says what it may be, once.
    """
    told_s = time.monotonic() + PATIENCE_S
    while not stop.is_set():
        try:
            return zenoh.open(config("client", connect=[endpoint], timeout_ms=OPEN_TIMEOUT_MS, tls=tls))
        except zenoh.ZError as error:
            logger.debug("no router at %s yet: %s", endpoint, error)
        if time.monotonic() >= told_s:
            told_s = float("inf")
            logger.warning("%s", nobody_answers(endpoint, tls))
        stop.wait(_PAUSE_S)
    return None


def nobody_answers(endpoint: str, tls: Tls | None) -> str:
    """What is known of a router that does not answer: zenoh does not say why."""
    if tls is None:
        return f"nobody answers at {endpoint}: is a station there, and does it take links without a certificate?"
    return (
        f"nobody answers at {endpoint}: is a station there, does its certificate name this host, and are its "
        f"certificate and ours ({tls.cert}) both of the authority {tls.ca}?"
    )


def nobody_listens(robot: str, tls: Tls) -> str:
    """What is known where nobody wants to hear the robot."""
    return (
        f"no station listens to {robot}: is one there, and is the robot in its list of robots, by the name in "
        f"{tls.cert}?"
    )


def warn_of_another_name(robot: str, tls: Tls) -> None:
    """A robot that shows the certificate of another one is not heard, and not told so. Raises LinkError, see Tls."""
    name = tls.common_name()
    if name != robot:
        logger.warning(
            "%s shows the certificate of %s: unless that may speak for all, the station does not hear it", robot, name
        )


def follow(session: zenoh.Session, key: str, handler: Any) -> zenoh.ext.AdvancedSubscriber[Any]:
    """Hear what the station tells on `key`: the last value at once, and what was missed as soon as that is noticed."""
    return zenoh.ext.declare_advanced_subscriber(
        session,
        key,
        handler,
        # Late publishers too: a station that starts after the rover says where the rover stands.
        history=zenoh.ext.HistoryConfig(detect_late_publishers=True),
        recovery=zenoh.ext.RecoveryConfig(periodic_queries=None, heartbeat=True),
    )


class RoverLink:
    """What one robot declares on a session; with `owned`, closing closes the session too."""

    def __init__(
        self,
        session: zenoh.Session,
        site: str,
        robot: str,
        boot: str,
        *,
        owned: bool,
        token: bool,
    ) -> None:
        self._session = session
        self._site, self._robot, self._boot = site, robot, boot
        self._owned = owned
        self._closed = False
        self._way_s = float("inf")
        # Keyframes give way to poses, and a congested link drops them at the source instead of holding up the robot.
        self._keyframes = session.declare_publisher(
            keys.keyframe(site, robot),
            encoding=codec.KEYFRAME_ENCODING,
            congestion_control=zenoh.CongestionControl.BLOCK_FIRST,
            priority=zenoh.Priority.DATA_LOW,
        )
        self._poses = session.declare_publisher(
            keys.pose(site, robot),
            encoding=codec.POSE_ENCODING,
            congestion_control=zenoh.CongestionControl.DROP,
            priority=zenoh.Priority.INTERACTIVE_HIGH,
            express=True,
        )
        # Rings to be looked into, no callbacks: see `follow_group`.
        self._matching = self._keyframes.declare_matching_listener(zenoh.handlers.RingChannel(_CHANGES_KEPT))
        self._links = session.info.declare_link_events_listener(zenoh.handlers.RingChannel(_CHANGES_KEPT))
        self._undo: list[Callable[[], object]] = [self._keyframes.undeclare, self._poses.undeclare]
        self._undo += [self._matching.undeclare, self._links.undeclare]
        if token:
            self._undo.append(session.liveliness().declare_token(keys.alive(site, robot, boot)).undeclare)

    def keyframes_wanted(self) -> bool:
        """Whether a station listens to keyframes right now: what is put without one is lost without a word."""
        return _has_listeners(self._keyframes)

    def poses_wanted(self) -> bool:
        """Whether a station listens to poses right now."""
        return _has_listeners(self._poses)

    def broke(self) -> bool:
        """Whether, since this was asked last, the way to the station broke: what was put just before may be lost."""
        broken = False
        while (status := self._matching.try_recv()) is not None:
            broken |= not status.matching
        while (event := self._links.try_recv()) is not None:
            broken |= event.kind == zenoh.SampleKind.DELETE
        return broken

    def put_pose(self, data: bytes) -> None:
        """Send a pose, or drop it where the link is congested."""
        self._poses.put(data)

    def put_keyframe(self, data: bytes) -> None:
        """Send a keyframe, or drop it where the link is congested for long."""
        self._keyframes.put(data)

    def put_last_keyframe(self, data: bytes) -> None:
        """Send a keyframe that nothing follows: waits for a congested link instead of dropping."""
        self._session.put(
            keys.keyframe(self._site, self._robot),
            data,
            encoding=codec.KEYFRAME_ENCODING,
            congestion_control=zenoh.CongestionControl.BLOCK,
            priority=zenoh.Priority.DATA_LOW,
        )

    def follow_group(self, callback: OnGroup) -> None:
        """Call `callback` with the robot's group, the present one first, from a thread of its own."""
        key = keys.own_group(self._site, self._robot)
        subscriber = follow(self._session, key, zenoh.handlers.RingChannel(_GROUPS_WAITING))
        # No callback of zenoh's: its thread cannot be joined, and one that outlives the interpreter aborts the program.
        name = f"rover-{self._robot}-groups"
        follower = threading.Thread(target=self._follow, args=(subscriber, callback), name=name, daemon=True)
        follower.start()
        self._undo += [partial(follower.join, _CALLBACK_END_S), subscriber.undeclare]

    def report(self, timeout_s: float) -> RobotReport | None:
        """What the station knows of this robot, or None where it does not answer."""
        return ask_report(self._session, self._site, self._robot, timeout_s)

    def hear_back(self, within_s: float, stop: threading.Event) -> RobotReport | None:
        """What the station knows of this robot; None where it knows nothing, or says nothing in time."""
        deadline_s = time.monotonic() + within_s
        while not stop.is_set() and (left_s := deadline_s - time.monotonic()) > 0:
            answered, report = self._ask(left_s, lambda: not stop.is_set())
            if answered:
                return report
            stop.wait(min(random.uniform(*_ASK_AGAIN_S), left_s))
        return None

    def confirm(self, last: int, deadline_s: float) -> bool:
        """Wait until the station has heard of keyframe `last` of this boot; False after `deadline_s` (monotonic)."""
        pause = threading.Event()
        while (left_s := deadline_s - time.monotonic()) > 0:
            report = self.report(left_s)
            if report is not None and has_heard(report, KeyframeId(boot=self._boot, sequence=last)):
                return True
            pause.wait(min(_ASK_EVERY_S, left_s))
        return False

    def delay_s(self, sequence: int, within_s: float, go_on: Callable[[], bool]) -> float | None:
        """How much longer keyframe `sequence` of this boot, just put, is on its way than a question and its answer.

        Asks until the station has heard of it; infinite where it has not in so long. None where that cannot be found
        out: nobody answers, the station is too busy, or `go_on`, which is asked all the while, says no. Raises
        LinkError where the answer cannot be read.
        """
        begun_s, keyframe = time.monotonic(), KeyframeId(boot=self._boot, sequence=sequence)
        asked, pause, pause_s = 0, threading.Event(), _PAUSES_S[0]
        while go_on() and (left_s := begun_s + within_s - time.monotonic()) > 0:
            asked_s = time.monotonic()
            answered, report = self._ask(left_s, go_on)
            if not answered:
                break
            # The way of a question was never shorter than when there was nothing before it.
            self._way_s, asked = min(self._way_s, time.monotonic() - asked_s), asked + 1
            if report is not None and has_heard(report, keyframe):
                return time.monotonic() - begun_s - asked * self._way_s
            pause.wait(min(random.uniform(0.5, 1.0) * pause_s, left_s))
            pause_s = min(2 * pause_s, _PAUSES_S[1])
        return None if time.monotonic() < begun_s + within_s else float("inf")

    def _ask(self, within_s: float, go_on: Callable[[], bool]) -> tuple[bool, RobotReport | None]:
        """Whether the station says what it knows of this robot, and that: None where it knows of no such robot."""
        pause = threading.Event()
        answers: zenoh.handlers.FifoChannel[zenoh.Reply] = zenoh.handlers.FifoChannel(_ANSWERS)
        replies = self._session.get(keys.robot_report(self._site, self._robot), answers, timeout=within_s)
        while go_on():
            try:
                reply = replies.try_recv()
            except zenoh.ZError:
                # All have answered, or the time is over.
                break
            if reply is None:
                pause.wait(_GLANCE_S)
            elif reply.ok is not None:
                return True, _read_report(self._robot, reply.ok)
            elif reply.err is not None and _is_unknown(reply.err):
                return True, None
        return False, None

    def close(self) -> None:
        """Take everything back."""
        self._closed = True
        for undo in reversed(self._undo):
            undo()
        if self._owned:
            self._session.close()

    def _follow(self, subscriber: zenoh.ext.AdvancedSubscriber[Any], callback: OnGroup) -> None:
        try:
            for sample in subscriber:
                # What was queued before closing still comes after it.
                if not self._closed:
                    self._tell(callback, sample.payload.to_bytes())
        except zenoh.ZError:
            logger.debug("%s follows its group no longer", self._robot)

    @staticmethod
    def _tell(callback: OnGroup, data: bytes) -> None:
        try:
            callback(OwnGroupReport.read(data))
        except Exception:
            # Whatever the rover's own code raises must not end the subscription.
            logger.exception("a callback of on_group failed")


def _has_listeners(publisher: zenoh.Publisher) -> bool:
    # The stubs of zenoh call it a bool; it is an object that is always true.
    status: Any = publisher.matching_status
    return bool(status.matching)


def ask_report(session: zenoh.Session, site: str, robot: str, timeout_s: float) -> RobotReport | None:
    """What the station knows of `robot`, or None where it does not answer (in time), or does not know it."""
    for reply in session.get(keys.robot_report(site, robot), timeout=timeout_s):
        if reply.ok is not None:
            return _read_report(robot, reply.ok)
    return None


def _read_report(robot: str, sample: zenoh.Sample) -> RobotReport:
    try:
        return RobotReport.read(sample.payload.to_bytes())
    except ValidationError as error:
        raise LinkError(f"the station's report on {robot} cannot be read: {error}") from error


def _is_unknown(error: zenoh.ReplyError) -> bool:
    """Whether the station says that it does not know the robot; it may be busy instead, or the time be over."""
    try:
        return Problem.read(error.payload.to_bytes()).status == 404
    except ValidationError:
        return False


def has_heard(report: RobotReport, keyframe: KeyframeId) -> bool:
    """Whether the station has received this keyframe or a later one of the same boot, usable or not."""
    # Not `keyframe`: a station that was started anew may remember that one, and has no more of it than its name.
    heard = report.heard
    return heard is not None and heard.boot == keyframe.boot and heard.sequence >= keyframe.sequence

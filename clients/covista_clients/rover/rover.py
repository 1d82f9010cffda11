"""A robot that tells the station what it sees."""

from __future__ import annotations

import atexit
import logging
import threading
import time
import uuid
from collections.abc import Callable
from functools import partial
from types import TracebackType
from typing import Self

import zenoh
from covista_schemas import codec, keys
from covista_schemas.errors import LinkError
from covista_schemas.messages import Camera, Keyframe, Pose, PoseUpdate
from covista_schemas.reports import KeyframeId, RobotReport
from covista_schemas.zenoh_config import check_endpoint, check_transport
from covista_schemas.zenoh_tls import Tls

from covista_clients.rover.content import Content, Image, Send, prepare
from covista_clients.rover.last_words import LastWords
from covista_clients.rover.link import (
    PATIENCE_S,
    OnGroup,
    RoverLink,
    nobody_listens,
    open_with_retry,
    warn_of_another_name,
)
from covista_clients.rover.outbox import Outbox

logger = logging.getLogger(__name__)

CLOSE_TIMEOUT_S = 2.0
# How soon what waits is sent once a station listens.
_LOOK_EVERY_S = 0.05
# How soon a rover that says nothing notices that its link broke.
_LOOK_BACK_EVERY_S = 0.5
# How long the station may take to say what it heard before.
_HEAR_BACK_S = 1.0
# Of every so many keyframes it is asked whether the station has heard them; waited for at most so long; and where it
# takes so much longer than a question, the link is slow.
_PROBE_EVERY, _UNHEARD_S, _SLOW_S = 4, 5.0, 0.5


class Rover:
    """Sends poses and keyframes of one camera to a station, and hears which group the robot is in.

    Connects in the background and for as long as it takes; until a station listens, the newest keyframe and the newest
    pose are kept. When a link that broke stands again, the newest that went out before are sent again, unless the
    station has heard them. Close it, or use it as a context manager: closing waits until the station has confirmed the
    last keyframe, at most two seconds. Safe to use from several threads; not from inside an `on_group` callback, where
    only `send_pose` and `send_keyframe` may be called.
    """

    def __init__(
        self,
        robot: str,
        camera: Camera,
        connect: str = "tcp/127.0.0.1:7447",
        *,
        site: str = "default",
        send: Send | str = Send.IMAGE,
        session: zenoh.Session | None = None,
        boot: str | None = None,
        liveliness: bool = True,
        tls: Tls | None = None,
    ) -> None:
        """`send` says what becomes of pictures: image (JPEG), features, or features+thumbnail.

        With `session` the rover speaks over an open session, which stays open. With `tls` it proves who it is, by a
        certificate whose common name is the robot's id, to a station that does so too, at an end point such as
        tls/station:7447. Raises ValueError for ids that are none, and LinkError for an end point that cannot be one,
        or files of `tls` that are of no use.
        """
        self.robot, self.site = keys.check_id(robot, "robot"), keys.check_id(site, "site")
        self.boot = keys.check_id(boot, "boot") if boot is not None else uuid.uuid4().hex
        self.camera = camera
        self.send = _checked_send(send)
        self.keyframes_sent = 0
        self.poses_sent = 0
        self._last_sent: int | None = None
        self._last_words = LastWords(self.boot)
        self._in_doubt = False
        self._connect = connect
        self._tls = tls
        if session is None:
            self._check_way()
        self._unheard_s: float | None = None
        self._wondered = False
        self._slow = False
        self._token = liveliness
        self._outbox: Outbox[tuple[Pose, Callable[[], Content]]] = Outbox()
        self._stop = threading.Event()
        self._closing = False
        self._pose_news = threading.Condition()
        self._held_pose: Pose | None = None
        self._link_lock = threading.Lock()
        self._link: RoverLink | None = None
        self._callbacks: list[OnGroup] = []
        if session is not None:
            self._attach(session, owned=False)
        # A daemon: a rover that was never closed does not keep its program from ending, and leaves at its end.
        atexit.register(self._leave)
        self._sender = threading.Thread(target=self._work, name=f"rover-{robot}", daemon=True)
        self._sender.start()

    @property
    def replaced(self) -> int:
        """Keyframes that gave way to newer ones before they were sent."""
        return self._outbox.replaced

    @property
    def keyframes_resent(self) -> int:
        """Keyframes that were sent again because the link broke and the station had not heard them."""
        return self._last_words.keyframes_resent

    @property
    def poses_resent(self) -> int:
        """Poses that were sent again because the link broke and the station had not heard them."""
        return self._last_words.poses_resent

    @property
    def keyframes_lost(self) -> int:
        """Keyframes that were sent, went down with a link and were not sent again, as the station says."""
        return self._last_words.keyframes_lost

    def send_pose(self, pose: Pose) -> None:
        """Send where the camera is; kept, until a newer one comes, while no station listens."""
        self._check_open()
        with self._pose_news:
            self._held_pose = _checked_pose(pose)
            self._flush_pose()
            held = self._held_pose is not None
        if held:
            self._outbox.wake()

    def send_keyframe(self, image: Image, pose: Pose, thumbnail: bytes | None = None) -> KeyframeId:
        """Hand over a picture, (H, W) grey or (H, W, 3) BGR uint8, JPEG, PNG or WebP bytes, or Features, with its pose.

        Returns at once with the id that the keyframe goes out under; if a newer one replaces it before, that one bears
        the id. Raises ValueError that names what does not fit.
        """
        self._check_open()
        work = prepare(image, self.camera, self.send, thumbnail)
        sequence = self._outbox.offer((_checked_pose(pose), work))
        return KeyframeId(boot=self.boot, sequence=sequence)

    def on_group(self, callback: OnGroup) -> None:
        """Call `callback` with an OwnGroupReport: soon with the present one, and whenever the robot's group changes."""
        self._check_open()
        with self._link_lock:
            self._callbacks.append(callback)
            if self._link is not None:
                self._link.follow_group(callback)

    def close(self, wait_s: float | None = None) -> None:
        """Send what still waits, wait for the station's confirmation (`wait_s` in all, by default 2 s), and leave."""
        with self._link_lock:
            if self._closing:
                return
            self._closing = True
        deadline_s = time.monotonic() + (CLOSE_TIMEOUT_S if wait_s is None else wait_s)
        try:
            if wait_s != 0 and not (self._drain(deadline_s) and self._confirm(deadline_s)):
                logger.warning(
                    "%s leaves without the station's confirmation of all it had to say; is it still starting, or "
                    "does it refuse this robot?",
                    self.robot,
                )
        finally:
            atexit.unregister(self._leave)
            self._stop.set()
            self._outbox.close()
            self._sender.join()
            if self._link is not None:
                self._link.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def _leave(self) -> None:
        self.close(wait_s=0)

    def _check_way(self) -> None:
        check_transport(check_endpoint(self._connect), self._tls is not None)
        if self._tls is not None:
            warn_of_another_name(self.robot, self._tls)

    def _wonder(self, heard: bool) -> None:
        """Say once what it may be that nobody has listened for long: zenoh does not tell whom it keeps out."""
        now_s = time.monotonic()
        self._unheard_s = None if heard else self._unheard_s or now_s
        if self._tls is None or self._wondered or self._unheard_s is None:
            return
        if now_s - self._unheard_s >= PATIENCE_S:
            self._wondered = True
            logger.warning("%s", nobody_listens(self.robot, self._tls))

    def _check_open(self) -> None:
        if self._closing:
            raise LinkError(f"rover {self.robot} is closed")

    def _attach(self, session: zenoh.Session, *, owned: bool) -> None:
        with self._link_lock:
            self._link = RoverLink(session, self.site, self.robot, self.boot, owned=owned, token=self._token)
            for callback in self._callbacks:
                self._link.follow_group(callback)

    def _work(self) -> None:
        """The rover's own thread: connect, then encode and send until closed."""
        if self._link is None:
            session = open_with_retry(self._connect, self._stop, self._tls)
            if session is None:
                return
            self._attach(session, owned=True)
        link = self._link
        while link is not None and not self._outbox.closed:
            if self._doubts(link) and link.keyframes_wanted():
                self._catch_up(link)
            with self._pose_news:
                self._flush_pose()
                held = self._held_pose is not None
            taken = self._outbox.take(partial(self._may_send, link), self._patience_s(held))
            if taken is not None:
                self._send_keyframe(link, *taken)
                self._let_through(link, taken[0])
            elif held or self._outbox.waits or self._in_doubt:
                self._wonder(link.keyframes_wanted())
                self._stop.wait(_LOOK_EVERY_S)

    def _patience_s(self, held: bool) -> float | None:
        """How long to wait for the next keyframe before there may be something else to do."""
        if held or self._in_doubt:
            return 0.0
        return _LOOK_BACK_EVERY_S if self._last_words.any else None

    def _may_send(self, link: RoverLink) -> bool:
        """A new keyframe must not hide from the station's report what was lost before it."""
        return not self._doubts(link) and link.keyframes_wanted()

    def _doubts(self, link: RoverLink) -> bool:
        """Whether what was sent last may not have arrived."""
        if link.broke():
            self._in_doubt = self._last_words.any
        return self._in_doubt

    def _catch_up(self, link: RoverLink) -> None:
        """Say again what was said last, unless the station has heard it."""
        try:
            report = link.hear_back(_HEAR_BACK_S, self._stop)
            if not link.broke():
                self._in_doubt = False
                self._say_again(link, report)
        except (LinkError, zenoh.ZError):
            self._in_doubt = False
            logger.exception("%s could not find out what the station has heard", self.robot)

    def _say_again(self, link: RoverLink, report: RobotReport | None) -> None:
        keyframe = self._last_words.unheard_keyframe(report, superseded=self._outbox.waits)
        if keyframe is not None:
            # Nothing may follow it for long.
            link.put_last_keyframe(keyframe)
        with self._pose_news:
            pose = self._last_words.unheard_pose(report) if self._held_pose is None else None
            if pose is not None:
                link.put_pose(pose)

    def _send_keyframe(self, link: RoverLink, sequence: int, item: tuple[Pose, Callable[[], Content]]) -> None:
        pose, work = item
        try:
            content = work()
            keyframe = Keyframe(
                self.robot, self.boot, sequence, self.camera, pose, content.image, content.features, content.thumbnail
            )
            put = link.put_last_keyframe if self._closing else link.put_keyframe
            data = codec.encode_keyframe(keyframe)
            put(data)
        except Exception:
            # One picture that OpenCV or the link refuses must not silence the rover.
            logger.exception("%s could not send keyframe %d", self.robot, sequence)
        else:
            self.keyframes_sent += 1
            self._last_sent = sequence
            self._last_words.keyframe_sent(sequence, data)

    def _let_through(self, link: RoverLink, sequence: int) -> None:
        """On a slow link one keyframe is under way at a time: what is put into buffers delays poses by many seconds.

        Whether it is slow, every few keyframes tell. Meanwhile the newest keyframe replaces the one that waits.
        """
        if not self._slow and sequence % _PROBE_EVERY:
            return
        try:
            delay_s = link.delay_s(sequence, _UNHEARD_S, lambda: not self._closing and not self._doubts(link))
        except (LinkError, zenoh.ZError) as error:
            logger.debug("%s could not find out whether the station hears it: %s", self.robot, error)
            return
        if delay_s is not None:
            self._slow = delay_s > _SLOW_S

    def _flush_pose(self) -> None:
        """Send the pose that waits, if a station listens; call with `_pose_news` held."""
        if self._held_pose is None or self._link is None or not self._link.poses_wanted():
            return
        update = PoseUpdate(self.robot, self.boot, self.poses_sent, self._held_pose)
        data = codec.encode_pose(update)
        self._link.put_pose(data)
        self._last_words.pose_sent(update.pose.time_ns, data)
        self.poses_sent += 1
        self._held_pose = None
        self._pose_news.notify_all()

    def _drain(self, deadline_s: float) -> bool:
        with self._pose_news:
            said = self._pose_news.wait_for(lambda: self._held_pose is None, deadline_s - time.monotonic())
        return self._outbox.drain(deadline_s - time.monotonic()) and said

    def _confirm(self, deadline_s: float) -> bool:
        if self._last_sent is None or self._link is None:
            return True
        return self._link.confirm(self._last_sent, deadline_s)


def _checked_send(send: Send | str) -> Send:
    try:
        return Send(send)
    except ValueError:
        raise ValueError(f"send: {send!r}, not one of {', '.join(Send)}") from None


def _checked_pose(pose: Pose) -> Pose:
    if not isinstance(pose, Pose):
        raise ValueError(f"pose: a Pose, not {type(pose).__name__}")
    return pose

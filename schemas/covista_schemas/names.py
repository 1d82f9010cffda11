"""Which message is it? Read from the bytes of one after the other, as `codec.peek_*` does, at a fraction of its cost.

A reader keeps what it can use again: a message to parse into, and the ids that were found to be valid. A message
that is parsed into again keeps the memory of all that it ever held, so that it is used for some bytes and no more.
"""

from __future__ import annotations

from google.protobuf.message import DecodeError as ProtobufDecodeError

from covista_schemas import codec, keys
from covista_schemas import robot_pb2 as pb
from covista_schemas.errors import DecodeError, KeyExpressionError

_MAX_IDS = 16_384
# Some hundreds of poses, and never more than one keyframe.
_BYTES_PER_MESSAGE = 64 * 1024


class NameReader:
    """Reads (boot, sequence) of the messages of one topic; for one thread."""

    def __init__(self, kind: type[pb.Keyframe] | type[pb.Pose]) -> None:
        """`kind` is the topic's message."""
        self._kind = kind
        self._most_bytes = codec.MAX_POSE_BYTES if kind is pb.Pose else codec.MAX_KEYFRAME_BYTES
        self._message = kind()
        self._held_bytes = 0
        self._boots: set[str] = set()

    def read(self, data: bytes, robot: str) -> tuple[str, int] | str:
        """(boot, sequence) of the message in `data`, or the code of what is wrong with it.

        `robot` is the id in the key, a valid one; the id inside must be the same.
        """
        if len(data) > self._most_bytes:
            return codec.TOO_LARGE
        message = self._room(len(data))
        try:
            message.ParseFromString(data)
        except ProtobufDecodeError:
            return codec.MALFORMED
        if message.robot != robot:
            return codec.WRONG_ID
        boot = message.boot
        if boot not in self._boots and not self._learn(boot):
            return codec.WRONG_ID
        sequence = message.sequence
        return codec.MALFORMED if sequence > codec.MAX_SEQUENCE else (boot, sequence)

    def complain(self, data: bytes, robot: str) -> str:
        """What is wrong with a message that could not be read, in words."""
        peek = codec.peek_pose if self._kind is pb.Pose else codec.peek_keyframe
        try:
            peek(data, robot=robot)
        except DecodeError as error:
            return str(error)
        return ""

    def _room(self, size: int) -> pb.Keyframe | pb.Pose:
        """A message to parse so many bytes into."""
        self._held_bytes += size
        if self._held_bytes > _BYTES_PER_MESSAGE:
            self._message, self._held_bytes = self._kind(), size
        return self._message

    def _learn(self, boot: str) -> bool:
        try:
            keys.check_id(boot, "boot")
        except KeyExpressionError:
            return False
        if len(self._boots) >= _MAX_IDS:
            self._boots.clear()
        self._boots.add(boot)
        return True


class KeyReader:
    """Which robot a key names, for one topic of all robots; for one thread."""

    def __init__(self) -> None:
        self._robots: dict[str, str] = {}

    def read(self, key: str) -> str | None:
        """The robot's id, None where the key is not one that a robot publishes on."""
        try:
            return self._robots[key]
        except KeyError:
            return self._learn(key)

    def _learn(self, key: str) -> str | None:
        try:
            robot = keys.parse_robot_key(key).robot
        except KeyExpressionError:
            # Not remembered: wrong keys without end must not make the right ones be forgotten.
            return None
        if len(self._robots) >= _MAX_IDS:
            self._robots.clear()
        self._robots[key] = robot
        return robot

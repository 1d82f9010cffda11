"""What a rover said last, in case nobody heard it: a link that dies takes along what was put until that is noticed."""

from __future__ import annotations

from dataclasses import dataclass

from covista_schemas.reports import RobotReport, time_of


@dataclass(frozen=True, slots=True, eq=False)
class _Keyframe:
    sequence: int
    data: bytes


@dataclass(frozen=True, slots=True, eq=False)
class _Pose:
    time_ns: int
    data: bytes


class LastWords:
    """The newest keyframe and pose of one boot that went out, and what the station's report says of them.

    They are said again as they are, under the same number: if they were heard after all, the station counts a
    duplicate, and accounts stay exact. Keyframes have one thread that sends them; poses are guarded by the rover.
    """

    def __init__(self, boot: str) -> None:
        self.keyframes_resent = 0
        self.poses_resent = 0
        # Keyframes that the station never heard and that were not said again, by its own word.
        self.keyframes_lost = 0
        self._boot = boot
        self._keyframe: _Keyframe | None = None
        self._pose: _Pose | None = None
        # Of keyframes up to this one it is settled whether they are lost.
        self._settled = -1

    @property
    def any(self) -> bool:
        """Whether anything went out."""
        return self._keyframe is not None or self._pose is not None

    def keyframe_sent(self, sequence: int, data: bytes) -> None:
        """Remember a keyframe that went out."""
        self._keyframe = _Keyframe(sequence, data)

    def pose_sent(self, time_ns: int, data: bytes) -> None:
        """Remember a pose that went out."""
        self._pose = _Pose(time_ns, data)

    def unheard_keyframe(self, report: RobotReport | None, *, superseded: bool) -> bytes | None:
        """The newest keyframe if it must be said again: not if it was heard, or is `superseded` by one that waits.

        Counts what is lost. A station that knows no keyframe of this boot has been started anew, or has never heard
        one: nobody can say how many are lost then, and none is counted.
        """
        last = self._keyframe
        if last is None:
            return None
        heard = report.heard if report is not None else None
        known = heard is not None and heard.boot == self._boot
        if heard is not None and known and heard.sequence >= last.sequence:
            self._settled = last.sequence
            return None
        settled = last.sequence if superseded else last.sequence - 1
        if heard is not None and known:
            self.keyframes_lost += max(0, settled - max(heard.sequence, self._settled))
        self._settled = max(self._settled, settled)
        if superseded:
            return None
        self.keyframes_resent += 1
        return last.data

    def unheard_pose(self, report: RobotReport | None) -> bytes | None:
        """The newest pose, if the station does not know it or a later one."""
        last = self._pose
        if last is None:
            return None
        known = report.pose if report is not None and report.boot == self._boot else None
        if known is not None and known.time >= time_of(last.time_ns):
            return None
        self.poses_resent += 1
        return last.data

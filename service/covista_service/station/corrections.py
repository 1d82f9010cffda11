"""How far reported poses are from what the images say, and which robots it happens to again and again."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from covista_schemas.reports import EventKind

from covista_service.station.events import Happened
from covista_service.station.outlook import Outlook

# A keyframe's pose disagrees if it is off by so much: less is what images tell apart from nothing.
_DEG, _SHARE = 0.5, 0.01
# So many keyframes in a row that disagree are worth a warning, so many that agree end it.
_PERSISTS, _OVER = 3, 3


@dataclass(frozen=True, slots=True)
class Correction:
    """How far the reported pose of a robot's newest outlook is from the one that stands: `deg` and `m`.

    `disagreeing` is for how many keyframes in a row.
    """

    deg: float
    m: float
    disagreeing: int


class Corrections:
    """Corrections by robot; a robot whose poses keep disagreeing is flagged until they agree again."""

    def __init__(self) -> None:
        self._corrections: dict[str, Correction] = {}
        self._agreeing: dict[str, int] = {}
        self._flagged: set[str] = set()

    def __getitem__(self, robot: str) -> Correction | None:
        return self._corrections.get(robot)

    def note(self, outlook: Outlook, now_ns: int, *, again: bool) -> list[Happened]:
        """Take in an outlook, `again` if its keyframe had one before; what mission control should hear of."""
        robot = outlook.keyframe.id.robot
        deg, m = _off(outlook)
        disagrees = deg > _DEG or m > _SHARE * outlook.depths_m[1]
        held = self._corrections.get(robot)
        before = 0 if held is None else held.disagreeing - (again and held.disagreeing > 0)
        self._corrections[robot] = Correction(deg, m, before + 1 if disagrees else 0)
        self._agreeing[robot] = 0 if disagrees else self._agreeing.get(robot, 0) + (not again)
        if before + 1 >= _PERSISTS and disagrees and robot not in self._flagged:
            self._flagged.add(robot)
            text = f"the poses that {robot} reports keep disagreeing with the images: {deg:.1f} deg, {m:.2f} m off"
            return [Happened(EventKind.WARNING, now_ns, text, (robot,))]
        if self._agreeing[robot] >= _OVER and robot in self._flagged:
            self._flagged.remove(robot)
            text = f"the poses that {robot} reports agree with the images again"
            return [Happened(EventKind.WARNING, now_ns, text, (robot,))]
        return []

    def forget(self, robot: str) -> None:
        """Drop a robot."""
        self._corrections.pop(robot, None)
        self._agreeing.pop(robot, None)
        self._flagged.discard(robot)


def _off(outlook: Outlook) -> tuple[float, float]:
    """Angle in degrees and distance in metres between the reported pose and the one that stands."""
    reported = outlook.keyframe.pose
    turn = reported.world_from_camera.T @ outlook.pose.world_from_camera
    # The chord is well conditioned where the trace is not: |R - I|_F = 2 sqrt(2) sin(angle / 2).
    half = float(np.linalg.norm(turn - np.eye(3))) / (2 * np.sqrt(2))
    deg = float(np.degrees(2 * np.arcsin(min(1.0, half))))
    return deg, float(np.linalg.norm(outlook.pose.centre_m - reported.centre_m))

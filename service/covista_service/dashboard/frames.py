"""The swarm at one moment as its map wants it: columns, for a thousand robots are asked for again and again."""

from __future__ import annotations

import asyncio
import math
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from covista_schemas import reports
from pydantic_core import to_json

from covista_service.perception.camera import Camera, Floats, Pose
from covista_service.station.options import NS_PER_S
from covista_service.station.snapshot import RobotView, SimilarityView, Snapshot

# Who asks within so long is told the same.
_FRESH_S = 0.1
# Less in common is not drawn, and of many robots each has so many edges at most.
_LEAST_OVERLAP = 0.02
_FEW, _EDGES_EACH = 60, 6
_DECIMALS_M, _DECIMALS_SHARE = 3, 3


class Frames:
    """Frames as JSON, made once for all who ask at the same time, and in another thread; for one event loop alone."""

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        self._clock = clock
        self._making = asyncio.Lock()
        self._made_s = -math.inf
        self._swarm = b"{}"
        self._edges: tuple[int, bytes] = (-1, b"null")
        self._rows = Rows()

    async def swarm(self, station: str, snapshot: Callable[[], Snapshot], matrix: int | None = None) -> bytes:
        """The swarm now; its edges too, unless they are those of the revision `matrix`, which who asks has."""
        async with self._making:
            if self._clock() - self._made_s >= _FRESH_S:
                await asyncio.to_thread(self._make, station, snapshot())
                self._made_s = self._clock()
        edges = b"null" if matrix == self._edges[0] else self._edges[1]
        return b'%b,"edges":%b}' % (self._swarm[:-1], edges)

    def _make(self, station: str, found: Snapshot) -> None:
        if found.similarity.revision != self._edges[0]:
            self._edges = found.similarity.revision, to_json(edges_of(found.similarity))
        self._swarm = to_json({"station": station, **swarm_frame(found, self._rows)})


@dataclass(frozen=True, slots=True)
class Row:
    """What is told of a robot and stands as long as its view does: its place, and the corners of what it sees."""

    at_m: list[float] | None
    corners: list[float] | None
    off_deg: float | None


class Rows:
    """Rows of robots; most have not changed since somebody asked last."""

    def __init__(self) -> None:
        self._held: dict[str, tuple[RobotView, Row]] = {}

    def of(self, views: Sequence[RobotView]) -> list[Row]:
        """A row for each, and no others are kept."""
        held = {view.id: self._row(view) for view in views}
        self._held = held
        return [held[view.id][1] for view in views]

    def _row(self, view: RobotView) -> tuple[RobotView, Row]:
        known = self._held.get(view.id)
        if known is not None and known[0] is view:
            return known
        fix, camera = view.fix, view.camera
        return view, Row(
            at_m=None if fix is None else rounded(fix.pose.centre_m),
            corners=None if fix is None or camera is None else corners(camera, fix.pose),
            off_deg=None if view.correction is None else round(view.correction.deg, 1),
        )


def swarm_frame(snapshot: Snapshot, rows: Rows) -> dict[str, Any]:
    """Robots as columns, in the order of ids; positions in metres, silence in seconds."""
    views = [snapshot.robots[name] for name in sorted(snapshot.robots)]
    reasons = dict(snapshot.groups.ungrouped)
    told = rows.of(views)
    return {
        "time": reports.time_of(snapshot.wall_ns).isoformat(),
        "revision": snapshot.groups.revision,
        "matrix": snapshot.similarity.revision,
        "robots": {
            "id": [view.id for view in views],
            "status": [view.status for view in views],
            "group": [view.group for view in views],
            "reason": [reasons.get(view.id) for view in views],
            "at_m": [row.at_m for row in told],
            "view": [row.corners for row in told],
            "silent_s": [silence_s(view, snapshot.wall_ns) for view in views],
            "off_deg": [row.off_deg for row in told],
        },
    }


def rounded(position_m: Floats) -> list[float]:
    """A position in millimetres, which is finer than any map."""
    return [round(float(value), _DECIMALS_M) for value in position_m]


def corners(camera: Camera, pose: Pose) -> list[float]:
    """Where the corners of the image lie one metre ahead, from the camera and from above: x, y of four of them."""
    width, height = camera.width - 0.5, camera.height - 0.5
    pixels = np.array([[-0.5, -0.5, 1], [width, -0.5, 1], [width, height, 1], [-0.5, height, 1]])
    rays = pixels @ camera.rays_from_pixels.T @ pose.world_from_camera.T
    return np.round(rays[:, :2], _DECIMALS_M).ravel().tolist()


def silence_s(view: RobotView, wall_ns: int) -> float | None:
    """For how long a robot has not been heard; None if it never was."""
    return None if view.last_seen_ns is None else round(max(0.0, (wall_ns - view.last_seen_ns) / NS_PER_S), 1)


def edges_of(similarity: SimilarityView) -> dict[str, Any]:
    """Who shares what with whom now."""
    return edges_between(similarity.robots, np.nan_to_num(similarity.overlap))


def edges_between(robots: Sequence[str], overlap: Floats) -> dict[str, Any]:
    """Who shares what with whom: indices i < j into `robots`, the share of i's image that j sees, and of j's that i.

    `overlap` (N, N) has in row i the shares of i's image; what is not known is 0.
    """
    shared = np.triu(np.maximum(overlap, overlap.T), 1)
    drawn = shared >= _LEAST_OVERLAP
    if len(shared) > _FEW:
        both = np.maximum(shared, shared.T)
        least = np.partition(both, -_EDGES_EACH, axis=1)[:, -_EDGES_EACH]
        drawn &= (both >= least[:, None]) | (both >= least[None, :])
    first, second = np.nonzero(drawn)
    shares = np.round(np.column_stack([overlap[first, second], overlap[second, first]]), _DECIMALS_SHARE)
    return {
        "robots": list(robots),
        "pairs": [[i, j, *share] for i, j, share in zip(first.tolist(), second.tolist(), shares.tolist(), strict=True)],
    }

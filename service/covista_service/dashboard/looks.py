"""Pairs as pages show them: both pictures, planes and figures of one moment.

An overlap is read anew with every keyframe and every pose, and its planes are known only until the next keyframe, which
comes while one looks. So the last moment at which both images told planes is kept for pairs that somebody watches.
"""

from __future__ import annotations

import threading
from base64 import b64encode
from collections import OrderedDict
from dataclasses import dataclass
from typing import Any

from covista_service.answers import NotKnownError, explaining_survey, find_pair, pair_picture, pair_view_report
from covista_service.station.events import Pair
from covista_service.station.options import NS_PER_S
from covista_service.station.snapshot import PairView, Snapshot

# A look that is older says too little of now.
_KEPT_NS = 30 * NS_PER_S
# So many pairs are watched at a time, and of so many looks the pictures are kept for who asks next.
_PAIRS, _DRAWN = 32, 4


@dataclass(frozen=True, slots=True, eq=False)
class Look:
    """A pair as it was at `at_ns` of the station's time."""

    view: PairView
    at_ns: int

    @property
    def version(self) -> str:
        """Changes with what there is to see, and not with poses since."""
        view = self.view
        sides = ((view.a, view.keyframe_a), (view.b, view.keyframe_b))
        frames = "-".join(
            f"{name}.{keyframe.id.boot}.{keyframe.id.sequence}" if keyframe else name for name, keyframe in sides
        )
        return f"{frames}-{view.outcome}-{view.inliers}-{'explained' if view.explained else view.found_by}"


class Looks:
    """The last looks that told planes; for the thread of the event loop, but for `drawn`."""

    def __init__(self) -> None:
        self._told: OrderedDict[Pair, Look] = OrderedDict()
        self._drawn: OrderedDict[tuple[str, str], dict[str, Any]] = OrderedDict()
        self._lock = threading.Lock()

    def note(self, snapshot: Snapshot, a: str, b: str) -> Look:
        """The pair as it is now; kept if its images tell planes. Raises NotKnownError."""
        look = Look(find_pair(snapshot, a, b), snapshot.now_ns)
        if look.view.explained:
            pair = look.view.a, look.view.b
            self._told[pair] = look
            self._told.move_to_end(pair)
        while self._told and (len(self._told) > _PAIRS or self._is_old(next(iter(self._told.values())), snapshot)):
            # Pictures are large.
            self._told.popitem(last=False)
        return look

    def best(self, snapshot: Snapshot, a: str, b: str) -> Look:
        """The pair as it was when its images last told planes, or now if that is long ago. Raises NotKnownError."""
        now = self.note(snapshot, a, b)
        told = self._told.get((now.view.a, now.view.b), now)
        return told if told.view.explained and not self._is_old(told, snapshot) else now

    @staticmethod
    def _is_old(look: Look, snapshot: Snapshot) -> bool:
        return snapshot.now_ns - look.at_ns > _KEPT_NS

    def drawn(self, look: Look, a: str) -> dict[str, Any]:
        """The look with robot `a` as the first: the report, and both pictures or why there are none."""
        key = (look.version, a)
        found = self._drawn.get(key)
        if found is None:
            found = _drawn(look, a)
            # What was drawn in other threads meanwhile may have gone again.
            with self._lock:
                self._drawn[key] = found
                while len(self._drawn) > _DRAWN:
                    self._drawn.popitem(last=False)
        return found


def _drawn(look: Look, a: str) -> dict[str, Any]:
    view = look.view
    b = view.b if a == view.a else view.a
    return {
        "version": look.version,
        "explained": explaining_survey(view) is not None,
        "pair": pair_view_report(view, a).model_dump(mode="json", exclude={"regions_a", "regions_b"}),
        "pictures": [_picture(view, robot) for robot in (a, b)],
    }


def _picture(view: PairView, robot: str) -> dict[str, str | None]:
    try:
        return {"png": b64encode(pair_picture(view, robot)).decode(), "problem": None}
    except NotKnownError as error:
        return {"png": None, "problem": error.detail}

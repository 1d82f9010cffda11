"""How long until a keyframe's surface is there, once its pairs have said their depths?"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import chain, combinations

from covista_schemas.features import DEFAULT_COUNT

from covista_service.bench.row import Row, alternately_ms, median, spread
from covista_service.bench.scene import views
from covista_service.bench.threads import one_thread
from covista_service.perception.agreement import DepthPoints, Observations, agree
from covista_service.perception.camera import Floats, View, relative, undistort
from covista_service.perception.depths import Matched, observe
from covista_service.perception.matching import match
from covista_service.perception.scene import SceneOptions
from covista_service.perception.surface import interpolate

# Features of a keyframe, and the time that its surface may take.
MARKS_MS = {DEFAULT_COUNT: 5.0, 500: 5.0}
_ROUNDS, _LONG_ROUNDS = 15, 80
_LEAST_POINTS = 50


@dataclass(frozen=True, slots=True, eq=False)
class _Observed:
    """A keyframe, its keypoints in ideal px, and what its pairs say of them."""

    view: View
    keypoints_px: Floats
    said: list[Observations]
    options: SceneOptions

    def agree(self) -> DepthPoints:
        return agree(self.said, self.keypoints_px, self.view.camera.width, self.options.agreement)

    def interpolate(self, points: DepthPoints) -> Callable[[], object]:
        return lambda: interpolate(points, self.view.camera, self.options.surface)

    def both(self) -> object:
        return self.interpolate(self.agree())()


def rows(long: bool) -> Iterator[Row]:
    """`survey/surface` and `survey/surface_500`: what pairs agree on and the surface through it, on one core.

    With the usual number of features, and with 500. Of either, how long its two stages take: `surface_agree`,
    `surface_interpolate`.
    """
    with one_thread():
        for count, mark_ms in MARKS_MS.items():
            yield from _surface(count, mark_ms, _LONG_ROUNDS if long else _ROUNDS)


def _surface(count: int, mark_ms: float, rounds: int) -> Iterator[Row]:
    calls = [
        call
        for one in _observed(views(count), SceneOptions())
        if len(points := one.agree()) >= _LEAST_POINTS
        for call in (one.both, one.agree, one.interpolate(points))
    ]
    times = alternately_ms(calls, rounds)
    for k, stage in enumerate(("", "_agree", "_interpolate")):
        taken = list(chain(*times[k::3]))
        yield Row(
            bench="survey",
            case=f"surface{'' if count == DEFAULT_COUNT else f'_{count}'}{stage}",
            median=median(taken),
            spread=spread(taken),
            unit="ms",
            peer=None,
            peer_median=None,
            mark=f"<= {mark_ms:g} ms",
            holds=median(taken) <= mark_ms,
        )


def _observed(views: list[View], options: SceneOptions) -> list[_Observed]:
    ideal = [undistort(view.camera, view.features.keypoints_px) for view in views]
    said: list[list[Observations]] = [[] for _ in views]
    for i, j in combinations(range(len(views)), 2):
        matches = match(views[i].features, views[j].features, options.comparison.matching)
        pair = Matched((views[i], views[j]), (ideal[i], ideal[j]), matches.astype("int64"), True)
        for k, of_one in zip(
            (i, j), observe(pair, *relative(views[i].pose, views[j].pose), options.depths, 0), strict=True
        ):
            said[k].append(of_one)
    return [_Observed(*one, options) for one in zip(views, ideal, said, strict=True)]

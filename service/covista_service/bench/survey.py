"""How long is the survey of a pair, against OpenCV's brute-force matcher on the same descriptors?"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from itertools import chain

import cv2
import numpy as np

from covista_service.bench.row import Row, alternately_ms, median, timed
from covista_service.bench.scene import overlapping_pairs
from covista_service.bench.threads import one_thread
from covista_service.perception.camera import View, relative
from covista_service.perception.comparison import compare, sighted
from covista_service.perception.fuzzy import Points
from covista_service.perception.matching import match
from covista_service.perception.overlap import common_field
from covista_service.perception.planes import find_planes
from covista_service.perception.relative_pose import relative_pose
from covista_service.perception.survey import Outcome, SurveyOptions, shown, survey
from covista_service.perception.triangulation import triangulate

PEER = "OpenCV BFMatcher.knnMatch, both directions"
# Features of each image, and the time a survey may take.
MARKS_MS = {500: 10.0, 1000: 20.0}
WARM_MARK_MS = 6.0
STAGES = ("matching", "pose", "triangulation", "planes", "field")
_ROUNDS, _LONG_ROUNDS = 7, 40

Pair = tuple[View, View]
Call = Callable[[], object]


def rows(long: bool) -> Iterator[Row]:
    """`survey/cold_500` and `survey/cold_1000`: all stages, RootSIFT, one core, nothing to start from.

    `survey/warm_500` starts from the pair's last result; `survey/stage_*` say where the time of 500 features goes.
    """
    rounds = _LONG_ROUNDS if long else _ROUNDS
    with one_thread():
        for count, mark_ms in MARKS_MS.items():
            yield _cold(count, mark_ms, rounds)
        yield _warm(500, rounds)
        yield from _stages(500, rounds)


def _cold(count: int, mark_ms: float, rounds: int) -> Row:
    pairs = overlapping_pairs(count)
    calls = [call for pair in pairs for call in (_ours(*pair), _peer(*pair))]
    times = alternately_ms(calls, rounds)
    ours, peer = list(chain(*times[::2])), list(chain(*times[1::2]))
    holds = median(ours) <= min(mark_ms, median(peer))
    return _row(f"cold_{count}", ours, f"<= {mark_ms:g} ms and <= peer", peer, holds=holds)


def _warm(count: int, rounds: int) -> Row:
    times = list(chain(*alternately_ms([_again(*pair) for pair in overlapping_pairs(count)], rounds)))
    return _row(f"warm_{count}", times, f"<= {WARM_MARK_MS:g} ms", holds=median(times) <= WARM_MARK_MS)


def _stages(count: int, rounds: int) -> Iterator[Row]:
    calls = [call for pair in overlapping_pairs(count) for call in _stages_of(*pair)]
    times = alternately_ms(calls, rounds)
    for index, stage in enumerate(STAGES):
        yield _row(f"stage_{stage}", list(chain(*times[index :: len(STAGES)])), "", holds=True)


def _row(
    case: str, times_ms: Sequence[float], mark: str, peer_ms: Sequence[float] | None = None, *, holds: bool
) -> Row:
    return timed("survey", case, times_ms, mark, holds=holds, peer=PEER, peer_ms=peer_ms)


def _ours(first: View, second: View) -> Call:
    return lambda: survey(first, second, SurveyOptions())


def _again(first: View, second: View) -> Call:
    last = survey(first, second, SurveyOptions())
    return lambda: survey(first, second, SurveyOptions(), last)


def _stages_of(first: View, second: View) -> tuple[Call, ...]:
    """The stages one by one, each with what those before it came to; none of a pair that is not measured."""
    options = SurveyOptions()
    found = survey(first, second, options)
    if found.outcome is not Outcome.MEASURED:
        return ()
    comparing = options.comparison
    matches = compare(first, second, comparing).sightings
    reported = relative(first.pose, second.pose)
    pose = relative_pose(matches, *reported, comparing.pose, comparing.seed)
    inliers = matches.only(pose.inliers)
    triangulated = triangulate(inliers, pose.rotation, pose.translation, options.triangulation)
    points = triangulated.only(triangulated.kept)
    cloud = Points(points.rays, points.inverse_depths, points.shifts_px)
    planes = find_planes(cloud, options.planes, options.seed)

    def field() -> object:
        orders = shown(first.camera, second.camera, found, planes, options.territories)
        return common_field(first.camera, second.camera, pose.rotation, pose.translation, planes.normals, orders)

    return (
        lambda: sighted(first, second, match(first.features, second.features, comparing.matching)),
        lambda: relative_pose(matches, *reported, comparing.pose, comparing.seed),
        lambda: triangulate(inliers, pose.rotation, pose.translation, options.triangulation),
        lambda: find_planes(cloud, options.planes, options.seed),
        field,
    )


def _peer(first: View, second: View) -> Call:
    # As float32, which OpenCV matches seven times faster than bytes.
    one, two = (view.features.descriptors.astype(np.float32) for view in (first, second))
    matcher = cv2.BFMatcher(cv2.NORM_L2)
    return lambda: (matcher.knnMatch(one, two, k=2), matcher.knnMatch(two, one, k=2))

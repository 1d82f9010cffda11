import numpy as np
import pytest
from covista_service.perception.agreement import Observations
from covista_service.perception.camera import Floats, relative
from covista_service.perception.depths import DepthOptions, Matched, observe
from covista_service.perception.matching import MatchingOptions, match

from tests.service.perception.swarms import points_on_wall, side_by_side, views

OPTIONS = DepthOptions()
MOTION = relative(*side_by_side(2))


def pair(chosen: int | None = None, noise_px: float = 0.0, verified: bool = True) -> Matched:
    first, second = views(points_on_wall(slope=0.0), side_by_side(2), noise_px=noise_px)
    matches = match(first.features, second.features, MatchingOptions(rootsift_ratio=0.8)).astype(np.int64)[:chosen]
    ideal: tuple[Floats, Floats] = (
        first.features.keypoints_px.astype(np.float64),
        second.features.keypoints_px.astype(np.float64),
    )
    return Matched((first, second), ideal, matches, verified)


def depths(said: Observations) -> Floats:
    return 1 / said.inverse_depths


def test_a_wall_has_its_depth_in_both_images() -> None:
    for said in observe(pair(), *MOTION, OPTIONS, 0):
        assert len(said) > 100
        assert np.median(depths(said)) == pytest.approx(6.0, rel=0.02)


def test_matches_without_support_are_dropped() -> None:
    right = pair()
    swapped = right.matches.copy()
    swapped[:6, 1] = swapped[5::-1, 1]
    wrong = Matched(right.views, right.ideal_px, swapped, verified=True)
    said = observe(wrong, *MOTION, OPTIONS, 0)[0]
    assert np.abs(depths(said) / np.median(depths(said)) - 1).max() < 0.2


@pytest.mark.parametrize("count", [1, 2, 3, 4])
def test_few_points_that_agree_stay(count: int) -> None:
    few = pair(count)
    alone = DepthOptions(guided=OPTIONS.guided)
    said = observe(Matched(few.views, few.ideal_px, few.matches, verified=True), *MOTION, alone, 0)[0]
    free = set(few.matches[:, 0].tolist())
    assert free <= set(said.keypoints.tolist())


def test_robots_in_one_place_have_no_depths() -> None:
    assert [len(said) for said in observe(pair(), np.eye(3), np.zeros(3), OPTIONS, 0)] == [0, 0]

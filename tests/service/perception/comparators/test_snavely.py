import numpy as np
import pytest
from covista_service.perception.camera import Features
from covista_service.perception.comparators.image import Image
from covista_service.perception.comparators.snavely import similarity, verified

from tests.service.perception.comparators.images import HOPELESS, alike, mixed, pair, unrelated


def measured(first: Image, second: Image) -> float:
    return similarity(len(verified(first, second)), first, second)


@pytest.mark.parametrize("kind", ["rootsift", "orb"])
def test_an_image_is_all_like_itself_and_nothing_like_another(kind: str) -> None:
    one, other = unrelated(0, kind=kind), unrelated(1, kind=kind)
    assert measured(one, one) == 1.0
    assert measured(one, other) == 0.0


def test_it_counts_matches_over_the_features_of_the_poorer_image() -> None:
    first, second = pair(200, noise_px=0.3)
    count = len(first.features.keypoints_px)
    assert measured(first, second) == pytest.approx(1.0, abs=0.03)
    first, second = mixed(200, 100)
    assert measured(first, second) == pytest.approx(count / (count + 100), abs=0.03)


def test_swapping_the_images_changes_little() -> None:
    first, second = mixed(150, 150, seed=1)
    assert measured(first, second) == pytest.approx(measured(second, first), abs=0.02)


@pytest.mark.parametrize(("count", "expected"), [(19, 0), (20, 20)])
def test_fewer_than_twenty_are_none(count: int, expected: int) -> None:
    few = unrelated(3, count)
    assert len(verified(few, few)) == expected


def test_a_match_off_its_epipolar_line_does_not_count() -> None:
    first, second = pair(120)
    moved = second.features.keypoints_px.copy()
    moved[:30] = np.random.default_rng(0).uniform(0, 479, (30, 2))
    inliers = verified(first, Image(Features("rootsift", moved, second.features.descriptors), 640, 480))
    # By chance a few lie near theirs.
    assert np.count_nonzero(inliers[:, 1] < 30) <= 5
    assert np.count_nonzero(inliers[:, 1] >= 30) >= 0.95 * (len(moved) - 30)


@pytest.mark.parametrize(("n", "m"), HOPELESS)
def test_few_features_are_nothing_in_common(n: int, m: int) -> None:
    assert measured(unrelated(0, n), unrelated(1, m)) == 0.0


def test_neither_kinds_that_differ_nor_equals_match() -> None:
    assert measured(unrelated(0), unrelated(0, kind="orb")) == 0.0
    assert measured(*alike(50)) == 0.0

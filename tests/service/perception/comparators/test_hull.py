import numpy as np
import pytest
from covista_service.perception.camera import Features
from covista_service.perception.comparators.hull import overlap
from covista_service.perception.comparators.image import Image

from tests.service.perception.comparators.images import HOPELESS, alike, mixed, unrelated


def test_an_image_covers_itself_but_for_the_known_bias() -> None:
    for count in (100, 400):
        left_out = [1 - overlap(image, image)[0] for image in (unrelated(seed, count) for seed in range(20))]
        assert np.mean(left_out) == pytest.approx(8 / 3 * np.log(count) / count, rel=0.3)


def test_unrelated_images_have_nothing_in_common() -> None:
    assert overlap(unrelated(0), unrelated(1)) == (0.0, 0.0, 0)


def test_the_half_that_both_show_is_half_of_one_and_all_of_the_other() -> None:
    whole = unrelated(0, 1000)
    left = whole.features.keypoints_px[:, 0] < 319.5
    features = whole.features
    half = Image(Features("rootsift", 2 * features.keypoints_px[left], features.descriptors[left]), 639, 960)
    share_of_whole, share_of_half, matches = overlap(whole, half)
    assert matches == left.sum()
    assert share_of_whole == pytest.approx(0.5, abs=0.03)
    assert share_of_half == pytest.approx(1.0, abs=0.06)


def test_swapping_the_images_swaps_the_shares() -> None:
    first, second = mixed(200, 100)
    there, back = overlap(first, second), overlap(second, first)
    assert there[:2] == pytest.approx(back[1::-1], abs=0.05)


@pytest.mark.parametrize(("n", "m"), HOPELESS)
def test_few_features_cover_nothing(n: int, m: int) -> None:
    assert overlap(unrelated(0, n), unrelated(1, m)) == (0.0, 0.0, 0)


def test_neither_kinds_that_differ_nor_equals_cover_anything() -> None:
    assert overlap(unrelated(0), unrelated(0, kind="orb")) == (0.0, 0.0, 0)
    assert overlap(*alike(50)) == (0.0, 0.0, 0)

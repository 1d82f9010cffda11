import numpy as np
import pytest
from covista_service.perception.camera import Features
from covista_service.perception.matching import MatchingOptions, match, mutual


def features(kind: str, descriptors: np.ndarray) -> Features:
    return Features(kind, np.zeros((len(descriptors), 2), np.float32), descriptors.astype(np.uint8))


@pytest.mark.parametrize(("kind", "length", "top"), [("rootsift", 128, 90), ("orb", 32, 256)])
def test_shuffled_descriptors_find_each_other(kind: str, length: int, top: int) -> None:
    random = np.random.default_rng(0)
    one = random.integers(0, top, (60, length))
    order = random.permutation(60)
    found = match(features(kind, one), features(kind, one[order]), MatchingOptions())
    assert len(found) == 60
    np.testing.assert_array_equal(order[found[:, 1]], found[:, 0])


def test_swapping_the_images_swaps_the_matches() -> None:
    random = np.random.default_rng(1)
    distances = random.random((80, 50)).astype(np.float32)
    there, back = mutual(distances, 0.9), mutual(distances.T.copy(), 0.9)
    assert {tuple(pair) for pair in there} == {tuple(pair[::-1]) for pair in back}
    assert len(there) > 3


def test_of_equals_none_stands_out() -> None:
    twins = np.zeros((2, 128))
    assert len(match(features("rootsift", twins), features("rootsift", twins), MatchingOptions())) == 0


@pytest.mark.parametrize(("n", "m"), [(0, 0), (0, 5), (5, 0)])
def test_nothing_matches_nothing(n: int, m: int) -> None:
    for kind, length in (("rootsift", 128), ("orb", 32)):
        none = match(features(kind, np.ones((n, length))), features(kind, np.ones((m, length))), MatchingOptions())
        assert none.shape == (0, 2)


def test_one_and_one_have_no_rival() -> None:
    one = features("orb", np.arange(32)[None])
    assert match(one, one, MatchingOptions()).tolist() == [[0, 0]]

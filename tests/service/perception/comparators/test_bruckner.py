import numpy as np
import pytest
from covista_service.perception.comparators.bruckner import entropy_similarity, geometric_similarity
from covista_service.perception.comparators.image import Image
from scipy.spatial.distance import cdist
from scipy.special import softmax
from scipy.stats import entropy

from tests.service.perception.comparators.images import HOPELESS, alike, mixed, pair, unrelated


def by_entropy(first: Image, second: Image) -> float:
    return entropy_similarity(first.features, second.features)


@pytest.mark.parametrize("kind", ["rootsift", "orb"])
@pytest.mark.parametrize("measure", [by_entropy, geometric_similarity])
def test_an_image_is_all_like_itself_and_hardly_like_another(measure, kind: str) -> None:
    one, other = unrelated(0, kind=kind), unrelated(1, kind=kind)
    assert measure(one, one) == pytest.approx(1.0)
    assert measure(one, other) < 0.05


@pytest.mark.parametrize("measure", [by_entropy, geometric_similarity])
def test_more_in_common_is_more_alike_and_swapping_changes_little(measure) -> None:
    found = [measure(*mixed(shared, 300 - shared)) for shared in (50, 150, 250)]
    assert found == sorted(found)
    assert found[0] < found[2] - 0.2
    first, second = mixed(150, 100)
    assert measure(first, second) == pytest.approx(measure(second, first), abs=0.03)


def test_swapping_does_not_change_an_entropy() -> None:
    first, second = unrelated(0, 50), unrelated(1, 80)
    assert by_entropy(first, second) == pytest.approx(by_entropy(second, first), abs=1e-12)


def test_entropies_are_those_of_the_definition() -> None:
    first, second = mixed(60, 40)
    apart = cdist(*(image.features.descriptors.astype(float) for image in (first, second)))
    n, m = apart.shape
    normalised, least = [], []
    for distances, (own, others) in ((apart, (n, m)), (apart.T, (m, n))):
        nearest = distances.min(axis=1, keepdims=True)
        scale = np.maximum(0.5 * nearest, 1e-6)
        conditional = entropy(softmax(-(distances - nearest) / scale, axis=1), axis=1).mean()
        normalised.append((np.log(own) + conditional) / (np.log(own) + np.log(others)))
        least.append(np.log(own) / (np.log(own) + np.log(others)))
    expected = (1 - np.mean(normalised)) / (1 - np.mean(least))
    assert by_entropy(first, second) == pytest.approx(expected, abs=1e-6)


def test_geometry_without_chance_is_all_in_common() -> None:
    assert geometric_similarity(*pair(200, noise_px=0.3)) > 0.95


@pytest.mark.parametrize(("n", "m"), HOPELESS)
def test_few_features_say_little(n: int, m: int) -> None:
    first, second = unrelated(0, n), unrelated(1, m)
    assert 0 <= by_entropy(first, second) < 0.2
    assert geometric_similarity(first, second) == 0.0


@pytest.mark.parametrize("measure", [by_entropy, geometric_similarity])
def test_neither_kinds_that_differ_nor_equals_have_anything_in_common(measure) -> None:
    assert measure(unrelated(0), unrelated(0, kind="orb")) == 0.0
    assert measure(*alike(50)) == pytest.approx(0.0, abs=1e-9)

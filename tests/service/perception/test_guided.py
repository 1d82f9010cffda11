import numpy as np
from covista_service.perception.camera import Features, relative
from covista_service.perception.epipolar import fundamental
from covista_service.perception.guided import Directions, GuidedOptions, guided_matches

from tests.service.perception.scenes import CAMERA
from tests.service.perception.swarms import points_on_wall, side_by_side, views

OPTIONS = GuidedOptions()


def by_arrays(first: np.ndarray, one: np.ndarray, second: np.ndarray, other: np.ndarray, F: np.ndarray) -> set:
    """The same as masks and matrices: slow, and plain to read."""
    lines = np.column_stack((first, np.ones(len(first)))) @ F.T
    distance = np.abs(lines @ np.column_stack((second, np.ones(len(second)))).T) / np.hypot(*lines.T[:2])[:, None]
    cosine = np.where(distance < OPTIONS.band_px, one @ other.T, -1.0)

    def stands_out(rows: np.ndarray) -> np.ndarray:
        second_best, best = np.sort(rows, axis=1)[:, -2:].T
        return (best > OPTIONS.least_cosine) & (1 - best < OPTIONS.ratio**2 * (1 - second_best))

    there, back = cosine.argmax(axis=1), cosine.argmax(axis=0)
    out, out_back = stands_out(cosine), stands_out(cosine.T)
    return {(i, int(j)) for i, j in enumerate(there) if back[j] == i and out[i] and out_back[j]}


def signs(descriptors: np.ndarray) -> np.ndarray:
    return (np.unpackbits(descriptors, axis=1).astype(np.float32) * 2 - 1) / np.sqrt(8 * descriptors.shape[1])


def test_one_pass_finds_what_arrays_find() -> None:
    first, second = views(points_on_wall(), side_by_side(2), noise_px=1.0)
    F = fundamental(CAMERA, CAMERA, *relative(first.pose, second.pose))
    one, other = (Directions.of(view.features) for view in (first, second))
    first_px, second_px = (view.features.keypoints_px.astype(np.float64) for view in (first, second))
    found = guided_matches(first_px, one, second_px, other, F, OPTIONS)
    assert set(map(tuple, found.tolist())) == by_arrays(first_px, one.values, second_px, other.values, F)
    assert len(found) > 100


def test_bits_are_signs() -> None:
    first, second = views(points_on_wall(), side_by_side(2), noise_px=1.0)
    F = fundamental(CAMERA, CAMERA, *relative(first.pose, second.pose))
    random = np.random.default_rng(0)
    pattern = random.integers(0, 256, (128, 32))
    # As many bits alike as the other descriptors are alike, roughly: a few of them flipped at random.
    words = [
        (
            pattern[view.features.descriptors.argmax(axis=1)]
            ^ (random.random((len(view.features.descriptors), 32)) < 0.5)
        )
        for view in (first, second)
    ]
    bits = [word.astype(np.uint8) for word in words]
    one, other = (Directions.of(Features("orb", np.zeros((len(word), 2), np.float32), word)) for word in bits)
    first_px, second_px = (view.features.keypoints_px.astype(np.float64) for view in (first, second))
    found = guided_matches(first_px, one, second_px, other, F, OPTIONS)
    assert set(map(tuple, found.tolist())) == by_arrays(first_px, signs(bits[0]), second_px, signs(bits[1]), F)
    assert len(found) > 20


def test_nothing_matches_nothing() -> None:
    nobody = np.zeros((0, 2))
    for kind, width in (("rootsift", 128), ("orb", 32)):
        nothing = Directions.of(Features(kind, nobody.astype(np.float32), np.zeros((0, width), np.uint8)))
        assert len(guided_matches(nobody, nothing, nobody, nothing, np.eye(3), OPTIONS)) == 0

import numpy as np
from covista_service.perception.camera import relative
from covista_service.perception.epipolar import fundamental
from covista_service.perception.guided import GuidedOptions, guided_matches

from tests.service.perception.scenes import CAMERA
from tests.service.perception.swarms import points_on_wall, side_by_side, views

OPTIONS = GuidedOptions()


def unit(descriptors: np.ndarray) -> np.ndarray:
    values = descriptors.astype(np.float32)
    return values / np.linalg.norm(values, axis=1, keepdims=True)


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


def test_one_pass_finds_what_arrays_find() -> None:
    first, second = views(points_on_wall(), side_by_side(2), noise_px=1.0)
    F = fundamental(CAMERA, CAMERA, *relative(first.pose, second.pose))
    one, other = unit(first.features.descriptors), unit(second.features.descriptors)
    first_px, second_px = (view.features.keypoints_px.astype(np.float64) for view in (first, second))
    found = guided_matches(first_px, one, second_px, other, F, OPTIONS)
    assert set(map(tuple, found.tolist())) == by_arrays(first_px, one, second_px, other, F)
    assert len(found) > 100


def test_nothing_matches_nothing() -> None:
    nobody, nothing = np.zeros((0, 2)), np.zeros((0, 128), np.float32)
    assert len(guided_matches(nobody, nothing, nobody, nothing, np.eye(3), OPTIONS)) == 0

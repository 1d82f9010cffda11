import numpy as np
import pytest
from covista_service.perception.smoothing import SmoothingOptions, lowest, smoothed

EVEN = np.full((20, 30), 100, np.float32)


def costs(labels: np.ndarray, count: int = 8) -> np.ndarray:
    """Costs that are least at `labels` (h, w)."""
    return np.minimum(np.abs(np.arange(count) - labels[..., None]) * 0.2, 0.5).astype(np.float32)


def test_without_penalties_each_pixel_keeps_its_own() -> None:
    random = np.random.default_rng(0)
    given = random.random((20, 30, 8)).astype(np.float32)
    total = smoothed(given, EVEN, SmoothingOptions(0.0, 0.0))
    assert total - total.min(axis=2, keepdims=True) == pytest.approx(
        4 * (given - given.min(axis=2, keepdims=True)), abs=1e-4
    )


def test_weak_lonely_labels_follow_the_rest() -> None:
    labels = np.full((20, 30), 3)
    labels[6, 8] = labels[12:14, 20] = 6
    given = costs(labels)
    given[labels == 6] *= 0.5
    assert np.abs(lowest(given) - 3).max() > 2.5
    assert np.abs(lowest(smoothed(given, EVEN, SmoothingOptions())) - 3).max() < 1


def test_what_says_nothing_follows_the_rest() -> None:
    given = costs(np.full((20, 30), 3))
    given[5:15, 5:25] = 0.5
    assert (np.rint(lowest(smoothed(given, EVEN, SmoothingOptions()))) == 3).all()


def test_a_jump_goes_to_the_edge_in_the_image() -> None:
    labels = np.where(np.arange(30) < 15, 1, 6) * np.ones((20, 1), int)
    given = costs(labels)
    given[:, 10:20] = 0.5
    grey = np.where(np.arange(30) < 12, 40, 200).astype(np.float32) * np.ones((20, 1), np.float32)
    found = np.rint(lowest(smoothed(given, grey, SmoothingOptions())))
    assert (found[:, :12] == 1).all()
    assert (found[:, 12:] == 6).all()


def test_left_and_right_up_and_down_are_alike() -> None:
    random = np.random.default_rng(1)
    given = random.random((20, 30, 8)).astype(np.float32)
    grey = random.uniform(0, 255, (20, 30)).astype(np.float32)
    total = smoothed(given, grey, SmoothingOptions())
    for mirror in (np.s_[::-1, :], np.s_[:, ::-1]):
        turned = smoothed(given[mirror].copy(), grey[mirror].copy(), SmoothingOptions())
        assert turned[mirror] == pytest.approx(total, abs=1e-4)


def test_between_labels_it_is_the_vertex() -> None:
    parabola = ((np.arange(8) - 3.3) ** 2).astype(np.float32)
    assert lowest(np.tile(parabola, (2, 2, 1))) == pytest.approx(3.3, abs=1e-5)
    assert (lowest(np.tile(np.arange(8, dtype=np.float32), (2, 2, 1))) == 0).all()
    assert (lowest(np.tile(-np.arange(8, dtype=np.float32), (2, 2, 1))) == 7).all()

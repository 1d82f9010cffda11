import warnings

import numpy as np
import pytest
from covista_service.perception.camera import Pose, relative
from covista_service.perception.certainty import CertaintyOptions, Found, find, intervals, terms
from covista_service.perception.surface import COLUMNS, ROWS, Surface, flat
from covista_service.perception.visibility import CLUES, SAME_SCALE, Seeing, VisibilityOptions

from tests.service.perception.scenes import CAMERA, ORIGIN, turn

OPTIONS = CertaintyOptions()
WALL = Seeing(CAMERA, flat(1 / 6, 0.01))
ASIDE = Pose(np.eye(3), np.array([1.5, 0.0, 0.0]))
AWAY = Pose(turn(0, np.pi, 0), np.zeros(3))


def found(
    first: Seeing = WALL, second: Seeing = WALL, pose: Pose = ASIDE, matched: bool = True, connected: bool = True
) -> Found:
    motion = relative(ORIGIN, pose)
    ratios = SAME_SCALE if connected else (0.5, 2.0)
    return find(first, second, *motion, VisibilityOptions(), OPTIONS, matched=matched, ratios=ratios)


def interval(overlap: float, clues: dict[str, float], matched: bool) -> tuple[float, float]:
    row = np.array([[clues[name] for name in CLUES]])
    low, high = intervals(np.array([overlap]), row, np.array([matched]), OPTIONS)[0]
    return float(low), float(high)


def width(one: Found) -> float:
    return one.interval[1] - one.interval[0]


def rough(scatter: float, seed: int = 0) -> Seeing:
    factors = 1 + scatter * np.random.default_rng(seed).standard_normal((ROWS, COLUMNS))
    return Seeing(CAMERA, Surface(np.maximum(factors, 0.05) / 6, np.full((ROWS, COLUMNS), 0.05)))


@pytest.mark.parametrize("matched", [True, False])
@pytest.mark.parametrize("connected", [True, False])
@pytest.mark.parametrize("seed", range(5))
def test_an_interval_holds_its_overlap_and_stays_within_shares(seed: int, matched: bool, connected: bool) -> None:
    random = np.random.default_rng(seed)
    pose = Pose(turn(*random.normal(0, 0.3, 3)), random.normal(0, 1.5, 3))
    one = found(rough(0.2, seed), rough(0.2, seed + 1), pose, matched, connected)
    low, high = one.interval
    assert 0 <= low <= one.overlap <= high <= 1


def test_one_place_and_one_surface_leave_little_doubt() -> None:
    same = found(pose=ORIGIN)
    assert same.overlap == same.interval[1] == 1
    assert width(same) < 0.02


def test_back_to_back_leaves_little_doubt() -> None:
    assert found(pose=AWAY, matched=False).interval == pytest.approx((0, 0), abs=0.02)


def test_what_no_image_has_verified_is_less_sure() -> None:
    assert width(found(matched=False)) > width(found(matched=True))


def test_surfaces_that_disagree_are_less_sure() -> None:
    widths = [width(found(rough(scatter), WALL)) for scatter in (0.0, 0.01, 0.03)]
    assert widths == sorted(widths)
    assert widths[2] > 2 * widths[0]


def test_hidden_cells_leave_room_upwards_and_cells_before_the_rest_downwards() -> None:
    near = Seeing(CAMERA, flat(1 / 3, 0.01))
    hidden, before = found(WALL, near), found(near, WALL)
    assert hidden.overlap < 0.1
    assert hidden.interval[1] - hidden.overlap > 0.2
    assert before.overlap - before.interval[0] > before.interval[1] - before.overlap + 0.1


@pytest.mark.parametrize("name", CLUES)
@pytest.mark.parametrize("matched", [True, False])
def test_more_doubt_never_narrows(name: str, matched: bool) -> None:
    some = dict(zip(CLUES, (0.01, 0.01, 0.1, 0.05, 0.05), strict=True))
    low, high = interval(0.5, some, matched)
    wider = interval(0.5, {**some, name: 2 * some[name]}, matched)
    assert wider[0] <= low
    assert wider[1] >= high


def test_every_weight_has_its_term() -> None:
    for side in terms(np.zeros((3, len(CLUES))), np.ones(3, np.bool_)):
        assert side.shape == (3, len(OPTIONS.weights))


@pytest.mark.parametrize("rho", [1e-12, 1e12])
def test_hopeless_surfaces_give_shares_without_a_warning(rho: float) -> None:
    hopeless = Seeing(CAMERA, flat(rho))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for first, second in ((hopeless, WALL), (WALL, hopeless), (hopeless, hopeless)):
            for connected in (True, False):
                one = found(first, second, connected=connected)
                assert np.isfinite([one.overlap, *one.interval]).all()
                assert 0 <= one.interval[0] <= one.interval[1] <= 1

import numpy as np
import pytest
from covista_service.perception.scales import ratio_range, scale_sigmas

CENTRES = np.array([[0.0, 0, 0], [3.0, 0, 0], [0, 0, 0], [0, 0.03, 0], [9.0, 9, 9]])
DEPTHS = np.array([3.0, 3.0, 3.0, np.nan, 3.0])
PARTS = np.array([0, 0, 1, 1, 2])


def test_the_longer_the_baseline_the_better_the_scale() -> None:
    wide, _, narrow, also_narrow, alone = scale_sigmas(CENTRES, DEPTHS, PARTS, 0.03)
    assert wide == pytest.approx(0.03 * 3 / (3 / np.sqrt(2)))
    assert narrow == also_narrow == pytest.approx(100 * wide)
    assert alone > narrow


@pytest.mark.parametrize("scale", [0.1, 10.0])
def test_scaling_the_scene_changes_nothing(scale: float) -> None:
    one = scale_sigmas(CENTRES, DEPTHS, PARTS, 0.03)
    assert scale_sigmas(scale * CENTRES, scale * DEPTHS, PARTS, 0.03) == pytest.approx(one)


def test_nothing_known_is_any_ratio() -> None:
    unknown = scale_sigmas(CENTRES, np.full(5, np.nan), PARTS, 0.03)
    least, greatest = ratio_range(unknown[0], unknown[1], 3.0)
    assert least < 1e-3
    assert greatest > 1e3
    assert len(scale_sigmas(np.zeros((0, 3)), np.zeros(0), np.zeros(0, np.int64), 0.03)) == 0


def test_ratios_allow_for_both_scales() -> None:
    least, greatest = ratio_range(0.03, 0.04, 2.0)
    assert (least, greatest) == pytest.approx((np.exp(-0.1), np.exp(0.1)))

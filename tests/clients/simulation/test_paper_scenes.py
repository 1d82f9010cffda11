import numpy as np
import pytest
from covista_clients.simulation import truth
from covista_clients.simulation.paper_scenes import PAPER_SCENES, placed, tinted
from covista_clients.simulation.textures import gravel
from covista_clients.simulation.viewing import pinhole

SMALL = pinhole(160, 120)


def test_the_second_camera_sees_the_share_asked_for_and_less_further_on() -> None:
    scene = PAPER_SCENES["Floor"]()
    first = scene.first.pose

    def seen(share: float) -> float:
        return truth.overlap(scene.world, SMALL, first, SMALL, placed(scene, SMALL, share).pose, 1)

    assert seen(0.9) == pytest.approx(0.9, abs=0.01)
    assert seen(0.7) == pytest.approx(0.7, abs=0.01)
    assert placed(scene, SMALL, 0.7).position_m[0] > placed(scene, SMALL, 0.9).position_m[0]
    assert placed(scene, SMALL, 0.9) == placed(PAPER_SCENES["Floor"](), SMALL, 0.9)


def test_both_ways_start_with_the_same_view() -> None:
    scene = PAPER_SCENES["Floor"]()
    assert scene.second(0.0) == scene.first


def test_coloured_light_changes_colours_alone() -> None:
    plain, red = (
        material(np.random.default_rng(0), 40, 50, 100.0, 0.5) for material in (gravel, tinted(gravel, (0.5, 0.5, 1.0)))
    )
    assert np.array_equal(plain[..., 2], red[..., 2])
    assert red[..., :2].mean() == pytest.approx(0.5 * plain[..., :2].mean(), abs=1)


def test_what_is_common_is_a_part_of_what_is_seen() -> None:
    scene = PAPER_SCENES["Floor"]()
    met, seen = truth.common(scene.world, SMALL, scene.first.pose, SMALL, scene.second(0.5).pose, 4)
    assert len(met) == len(seen) == len(truth.pixels(SMALL, 4))
    assert not np.any(seen & ~met)
    assert 0 < seen.sum() < met.sum()

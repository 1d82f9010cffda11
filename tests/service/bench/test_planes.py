from __future__ import annotations

import numpy as np
import pytest
from covista_service.bench.plane_scenes import SCENES, draw
from covista_service.bench.planes import right
from covista_service.perception.comparators import msac
from covista_service.perception.planes import PlaneOptions, find_planes


@pytest.mark.parametrize("name", SCENES)
def test_planes_without_noise_are_found_and_by_msac_too(name: str) -> None:
    scenes = [draw(name, 0.1, 0.0, np.random.default_rng(seed)) for seed in range(6)]
    for find in (find_planes, msac.find_planes):
        assert sum(right(one, find(one.points, PlaneOptions(), 0).normals) for one in scenes) >= 5


def test_right_means_as_many_and_each_its_own() -> None:
    scene = draw("corner", 0.0, 0.0, np.random.default_rng(0))
    assert right(scene, scene.planes[::-1])
    assert not right(scene, scene.planes[:2])
    assert not right(scene, scene.planes[[0, 0, 1]])


@pytest.mark.parametrize("name", SCENES)
def test_points_without_noise_or_outliers_lie_on_the_planes(name: str) -> None:
    scene = draw(name, 0.0, 0.0, np.random.default_rng(1))
    assert scene.points.distances(-scene.planes).min(axis=1).max() < 1e-6


@pytest.mark.parametrize("count", [0, 3, 5])
def test_msac_finds_nothing_among_few_points(count: int) -> None:
    points = draw("wall", 0.0, 0.0, np.random.default_rng(0)).points
    few = type(points)(points.rays[:count], points.inverse_depths[:count], points.shifts_px[:count])
    assert not len(msac.find_planes(few, PlaneOptions(), 0).normals)

import pytest

from tests.service.warmed import compiled

_IMPORTS = """
from dataclasses import replace
import numpy as np
from covista_service.perception.camera import Camera, Pose
from covista_service.perception.flow import flow
from covista_service.perception.regions import RegionOptions, regions
from covista_service.perception.scene import SceneOptions, reconstruct
from covista_service.perception.surface import COLUMNS, ROWS
from covista_service.perception.survey import SurveyOptions, survey
from covista_service.perception.visibility import Seeing
from tests.service.perception.scenes import CAMERA, turn
from tests.service.perception.swarms import moved, points_on_wall, side_by_side, views
"""
_AFTERWARDS = """
distorted = Camera(CAMERA.matrix, CAMERA.width, CAMERA.height, "plumb_bob", (0.01, 0.0, 0.0, 0.0))
poses = side_by_side(4)
seen = views(points_on_wall(600), poses, noise_px=0.3)
seen[1] = replace(seen[1], camera=distorted, thumbnail=np.full((30, 40), 99, np.uint8))
seen[2] = moved(seen[2], Pose(turn(0.05, 0.02, 0) @ poses[2].world_from_camera, poses[2].centre_m))
strange = np.random.default_rng(0).integers(0, 90, seen[3].features.descriptors.shape).astype(np.uint8)
seen[3] = replace(seen[3], features=replace(seen[3].features, descriptors=strange))
pairs = [(i, j) for j in range(4) for i in range(j)]
scene = reconstruct(seen, pairs, SceneOptions())
assert [scene.parts[k] == scene.parts[0] for k in range(4)] == [True, True, True, False]
assert scene.poses[2] is not seen[2].pose
assert all(scene.overlap(*pair) is not None for pair in pairs)
regions(np.random.default_rng(0).random((ROWS, COLUMNS)) < 0.7, distorted, RegionOptions())
survey(seen[0], seen[1], SurveyOptions())
seeing = [Seeing(CAMERA, surface) for surface in scene.surfaces]
flow(seeing, np.repeat(turn(0, 2, 0)[None], 4, axis=0), np.zeros((4, 3)), [CAMERA] * 4)
"""


@pytest.mark.timeout(300)
def test_after_warming_up_nothing_is_compiled() -> None:
    warm, afterwards = compiled("perception", _IMPORTS, _AFTERWARDS)
    assert 0 < warm == afterwards

import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[3]

_AFTERWARDS = """
import sys
from dataclasses import replace
import numpy as np
from covista_service.perception.camera import Camera, Pose
from covista_service.perception.regions import RegionOptions, regions
from covista_service.perception.scene import SceneOptions, reconstruct
from covista_service.perception.surface import COLUMNS, ROWS
from covista_service.perception.survey import SurveyOptions, survey
from covista_service.perception.warming import warm_up
from numba.core.registry import CPUDispatcher
from tests.service.perception.scenes import CAMERA, turn
from tests.service.perception.swarms import moved, points_on_wall, side_by_side, views

def compiled():
    ours = [module for name, module in sys.modules.items() if name.startswith("covista_service.perception.")]
    found = {id(each): each for module in ours for each in vars(module).values() if isinstance(each, CPUDispatcher)}
    return sum(len(each.signatures) for each in found.values())

warm_up()
warm = compiled()

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
print(warm, compiled())
"""


# On a fresh machine the compiler is most of it.
@pytest.mark.timeout(300)
def test_after_warming_up_nothing_is_compiled() -> None:
    said = subprocess.run(
        [sys.executable, "-c", _AFTERWARDS], cwd=ROOT, capture_output=True, text=True, timeout=290, check=False
    )
    assert said.returncode == 0, said.stderr
    warm, afterwards = map(int, said.stdout.split())
    assert 0 < warm == afterwards

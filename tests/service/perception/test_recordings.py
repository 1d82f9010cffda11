import json
import os
from pathlib import Path

import cv2
import numpy as np
import pytest
from covista_schemas.features import extract
from covista_service.perception.camera import Camera, Features, Pose, View
from covista_service.perception.survey import Outcome, SurveyOptions, survey

DATA = Path(os.environ.get("COVISTA_DATA", Path(__file__).parents[4] / "shared" / "data"))
OFFICE = DATA / "office_slambook"


def frame(index: int, kind: str) -> View:
    recording = json.loads((OFFICE / "dataset.json").read_text())
    told = recording["frames"][index]
    image = np.asarray(cv2.imread(str(OFFICE / told["image"])), np.uint8)
    found = extract(image, kind)
    world_from_camera = np.array(told["T_wc"])
    return View(
        Camera(np.array(recording["K"]), image.shape[1], image.shape[0]),
        Pose(world_from_camera[:3, :3], world_from_camera[:3, 3]),
        Features(str(found.kind), found.keypoints_px, found.descriptors),
    )


@pytest.mark.skipif(not OFFICE.exists(), reason="needs the recordings of ../shared/data or COVISTA_DATA")
@pytest.mark.parametrize("kind", ["rootsift", "orb"])
def test_two_views_of_an_office_share_what_the_depth_camera_says(kind: str) -> None:
    found = survey(frame(1, kind), frame(2, kind), SurveyOptions())
    truth = json.loads((OFFICE / "overlap_gt.json").read_text())["q"]
    assert found.outcome is Outcome.MEASURED
    assert found.overlap_first == pytest.approx(truth[1][2], abs=0.2)
    assert found.overlap_second == pytest.approx(truth[2][1], abs=0.2)

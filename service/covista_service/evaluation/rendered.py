"""Rendered pictures as the methods see them: the simulation's cameras and poses in the terms of the maths."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from covista_schemas import features, messages
from numpy.typing import NDArray

from covista_service.evaluation.case import Case, Pair, Surveys
from covista_service.perception.camera import Camera, Features, Pose, View, rotation_of
from covista_service.perception.comparators.image import image_of
from covista_service.perception.survey import SurveyOptions


def view_of(camera: messages.Camera, pose: messages.Pose, image: NDArray[np.uint8]) -> View:
    """RootSIFT features, strongest first, and thumbnail of an image (H, W, 3) BGR without lens distortion."""
    found = features.extract(image)
    grey = features.decode_image(features.thumbnail(image))[:, :, 0]
    return View(
        camera_of(camera),
        pose_of(pose),
        Features(str(found.kind), found.keypoints_px, found.descriptors),
        np.ascontiguousarray(grey),
    )


def case_of(views: Sequence[View], pairs: Sequence[Pair]) -> Case:
    """The question to the methods what pairs of rendered views have in common."""
    surveys = Surveys(pairs, views, SurveyOptions())
    return Case(tuple(pairs), tuple(views), surveys, tuple(image_of(view) for view in views))


def camera_of(camera: messages.Camera) -> Camera:
    """An ideal camera of the simulation."""
    matrix = np.array([[camera.fx, 0, camera.cx], [0, camera.fy, camera.cy], [0, 0, 1.0]])
    return Camera(matrix, camera.width, camera.height)


def pose_of(pose: messages.Pose) -> Pose:
    """A pose of the simulation."""
    return Pose(rotation_of(pose.orientation_xyzw), np.array(pose.position_m))

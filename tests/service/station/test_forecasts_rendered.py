"""Forecasts beside the truth of a rendered world, and beside what a keyframe taken there would be answered."""

from dataclasses import dataclass
from itertools import combinations

import numpy as np
import pytest
from covista_clients.simulation import renderer, truth, worlds
from covista_clients.simulation.viewing import facing, world_from_camera
from covista_schemas import features, messages
from covista_service.perception.camera import Features, Pose
from covista_service.perception.comparison import ComparisonOptions, compare
from covista_service.perception.scene import SceneOptions, settle
from covista_service.station.events import BuildSurfaces, Keyframe, SurfacesBuilt

from tests.service.station.scenes import CAMERA, Found, Scene

LENS = messages.Camera(fx=300, fy=300, cx=159.5, cy=119.5, width=320, height=240)
WORLD = worlds.build("boxes")


@dataclass
class Rendered(Scene):
    """A scene whose keyframes are rendered, compared and settled in earnest."""

    def keyframe(self, robot: str, at: messages.Pose, **details: object) -> Keyframe:
        found = features.extract(renderer.render(WORLD, LENS, at).image, count=500)
        keyframe = super().keyframe(robot, pose_of(at), **details)
        extracted = Features(str(found.kind), found.keypoints_px, found.descriptors)
        return Keyframe(keyframe.id, keyframe.time_ns, keyframe.arrived_ns, CAMERA, keyframe.pose, features=extracted)

    def wall_ahead(self, job: BuildSurfaces) -> SurfacesBuilt:
        settled, evidence = settle(job.sights, job.evidence, SceneOptions())
        return SurfacesBuilt(job, tuple(settled), evidence)

    def look(self) -> None:
        self.settle(lambda job: Found(compare(job.first_view, job.second_view, ComparisonOptions())))

    def overlaps(self) -> np.ndarray:
        view = self.snapshot.pair("r1", "r2")
        return np.array([view.overlap_a, view.overlap_b], float)


def pose_of(at: messages.Pose) -> Pose:
    return Pose(world_from_camera(at), np.array(at.position_m))


def nudged(at: messages.Pose, step_m: tuple[float, float], turn_rad: float) -> messages.Pose:
    ahead = world_from_camera(at)[:, 2]
    yaw, pitch = np.arctan2(ahead[1], ahead[0]), np.arcsin(ahead[2])
    x, y, z = at.position_m
    return facing((x + step_m[0], y + step_m[1], z), float(yaw) + turn_rad, float(pitch))


def true(first: messages.Pose, second: messages.Pose) -> np.ndarray:
    ways = ((first, second), (second, first))
    return np.array([truth.overlap(WORLD, LENS, one, LENS, other) for one, other in ways])


def companions() -> list[tuple[messages.Pose, messages.Pose]]:
    """Places that see much of what each other sees."""
    pairs = combinations(worlds.viewpoints(WORLD, 8), 2)
    return sorted(pairs, key=lambda pair: -true(*pair).min())[:4]


@pytest.mark.parametrize(("step_m", "turn_rad"), [((0.15, -0.1), 0.12), ((-0.2, 0.1), -0.15), ((0.0, 0.0), 0.25)])
def test_a_forecast_is_as_good_as_a_keyframe_and_better_than_to_stand_by_the_last(
    step_m: tuple[float, float], turn_rad: float
) -> None:
    forecast, held, measured = [], [], []
    for first, second in companions():
        scene, there = Rendered(), nudged(first, step_m, turn_rad)
        scene.send("r1", first)
        scene.send("r2", second)
        scene.look()
        before, expected = scene.overlaps(), true(there, second)
        scene.send_pose("r1", pose_of(there))
        scene.tick()
        forecast.append(np.abs(scene.overlaps() - expected))
        held.append(np.abs(before - expected))
        told = scene.overlaps()
        scene.send("r1", there)
        scene.look()
        measured.append(np.abs(scene.overlaps() - expected))
        assert scene.overlaps() == pytest.approx(told, abs=0.15)
    assert np.mean(forecast) < np.mean(held)
    assert np.mean(forecast) < np.mean(measured) + 0.02

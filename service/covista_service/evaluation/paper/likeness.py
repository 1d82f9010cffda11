"""The paper's three scenes as rendered pairs, with the share that the paper prints as their true overlap."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cache

from covista_clients.simulation import truth
from covista_clients.simulation.paper_scenes import PAPER_SCENES, placed
from covista_clients.simulation.renderer import Rendering, render
from covista_clients.simulation.viewing import pinhole
from covista_clients.simulation.world import World
from covista_schemas import messages

from covista_service.evaluation.rendered import view_of
from covista_service.perception.camera import Features, View

CAMERA = pinhole(640, 480)


@dataclass(frozen=True, slots=True)
class PrintedRow:
    """A row of Table I, and the figure that shows the scene."""

    figure: str
    planes: int
    inliers: int
    overlap_percent: float


TABLE_1: Mapping[str, PrintedRow] = {
    "Wall": PrintedRow("Fig. 2", 1, 30, 45.25),
    "Floor": PrintedRow("Fig. 3", 2, 37, 91.28),
    "Mars": PrintedRow("Fig. 4", 1, 24, 73.50),
}


@dataclass(frozen=True, slots=True, eq=False)
class Likeness:
    """A rendered pair; `truth` holds q_1 and q_2, exact, of which the first is the printed one."""

    name: str
    world: World
    poses: tuple[messages.Pose, messages.Pose]
    renderings: tuple[Rendering, Rendering]
    views: tuple[View, View]
    truth: tuple[float, float]


@cache
def likeness(name: str) -> Likeness:
    """The pair that stands for a row of Table I."""
    scene = PAPER_SCENES[name]()
    second = placed(scene, CAMERA, TABLE_1[name].overlap_percent / 100)
    poses = scene.first.pose, second.pose
    one, other = (render(scene.world, CAMERA, pose) for pose in poses)
    return Likeness(
        name,
        scene.world,
        poses,
        (one, other),
        (view_of(CAMERA, poses[0], one.image), view_of(CAMERA, poses[1], other.image)),
        (
            truth.overlap(scene.world, CAMERA, poses[0], CAMERA, poses[1], 1),
            truth.overlap(scene.world, CAMERA, poses[1], CAMERA, poses[0], 1),
        ),
    )


def strongest(view: View, count: int) -> View:
    """The same view with its `count` strongest features only: they come in that order."""
    kept = view.features
    return replace(view, features=Features(kept.kind, kept.keypoints_px[:count], kept.descriptors[:count]))

"""Planted groups before rendered worlds: here overlaps and matched features come from pictures."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations

import numpy as np
from covista_clients.simulation import worlds
from covista_clients.simulation.renderer import render
from covista_clients.simulation.vantage import open_sights, towards, vantage
from covista_clients.simulation.viewing import facing, pinhole
from covista_clients.simulation.world import World
from covista_schemas.messages import Pose

from covista_service.evaluation import methods
from covista_service.evaluation.case import Answer, Pair
from covista_service.evaluation.planted.layout import Labels
from covista_service.evaluation.planted.swarm import Swarm
from covista_service.evaluation.rendered import case_of, view_of
from covista_service.perception.camera import Floats
from covista_service.perception.survey import Outcome

WORLDS = ("arena", "wall", "arena", "boxes")
CAMERA = pinhole(320, 240)
_ROBOTS = (8, 14)
_MEMBERS = (2, 5)
_SIGHTS_APART_M = 3.5
_HEIGHT_M = (0.9, 1.15)
_ASIDE_RAD = 0.08


@dataclass(frozen=True, slots=True, eq=False)
class RenderedSwarm:
    """A swarm whose overlaps come from images, NaN where a pair was not answered.

    Two cameras have map points in common by matches that their geometry bears out. `features` (N, N): similarity by
    numbers of verified matches (Snavely et al. 2008).
    """

    swarm: Swarm
    features: Floats


def rendered(seed: int) -> RenderedSwarm:
    """The swarm of a seed: 8 to 14 cameras in groups of 2 to 5 and loners, each group before a sight of its own."""
    rng = np.random.default_rng([seed, 2])
    count = int(rng.integers(_ROBOTS[0], _ROBOTS[1] + 1))
    world = worlds.build(WORLDS[seed % len(WORLDS)], seed, count)
    poses, truth = _stand(world, rng, count)
    pairs = tuple(combinations(range(len(poses)), 2))
    case = case_of([view_of(CAMERA, pose, render(world, CAMERA, pose).image) for pose in poses], pairs)
    answers = methods.METHODS["auto"](case)
    counted = methods.METHODS["snavely"](case)
    sharing = np.eye(len(poses), dtype=np.bool_)
    for a, b in pairs:
        sharing[a, b] = sharing[b, a] = case.surveys[a, b].survey.outcome is Outcome.MEASURED
    positions = np.array([pose.position_m for pose in poses])
    swarm = Swarm(positions, _matrix(answers, len(poses), np.nan), sharing, truth, "rendered", seed)
    return RenderedSwarm(swarm, _matrix(counted, len(poses), 0.0))


def _stand(world: World, rng: np.random.Generator, count: int) -> tuple[list[Pose], Labels]:
    """Poses before sights that are apart from one another, and the sight of each robot, in no order."""
    places = [(court, sight) for court in world.courts for sight in open_sights(court, rng)]
    chosen: list[int] = []
    for k in rng.permutation(len(places)).tolist():
        if all(np.linalg.norm(places[k][1][:3] - places[held][1][:3]) >= _SIGHTS_APART_M for held in chosen):
            chosen.append(k)
    truth = _shared_out(rng, count, len(chosen))
    taken, poses = np.empty((0, 2)), []
    for label in truth.tolist():
        court, sight = places[chosen[label]]
        place = vantage(court, sight, rng, taken)
        taken = np.vstack([taken, place])
        height = float(rng.uniform(*_HEIGHT_M))
        yaw, pitch = towards(place, sight, height)
        aside, tilt = rng.normal(0, _ASIDE_RAD, 2)
        poses.append(facing((float(place[0]), float(place[1]), height), yaw + aside, pitch + tilt / 2))
    return poses, truth


def _shared_out(rng: np.random.Generator, count: int, sights: int) -> Labels:
    """A sight for each robot: groups of some, the rest alone as far as there are sights, and then with the others."""
    labels: list[int] = []
    while len(labels) < count and (not labels or labels[-1] + 1 < sights):
        size = int(rng.integers(_MEMBERS[0], _MEMBERS[1] + 1)) if rng.random() > 0.25 else 1
        labels += [labels[-1] + 1 if labels else 0] * min(size, count - len(labels))
    labels += rng.integers(0, max(labels) + 1, count - len(labels)).tolist()
    return rng.permutation(np.array(labels, np.intp))


def _matrix(answers: dict[Pair, Answer], count: int, missing: float) -> Floats:
    """Overlaps (N, N) of answers, 1 on the diagonal, `missing` where there is none."""
    matrix = np.full((count, count), missing)
    np.fill_diagonal(matrix, 1.0)
    for (a, b), answer in answers.items():
        if answer.overlap_a is not None and answer.overlap_b is not None:
            matrix[a, b], matrix[b, a] = answer.overlap_a, answer.overlap_b
    return matrix

"""Places from which a rover sees a sight well."""

from __future__ import annotations

import math

import numpy as np
from covista_schemas.messages import Pose
from numpy.typing import NDArray

from covista_clients.simulation.viewing import facing
from covista_clients.simulation.world import Court, Floats, World, clearance_m, to_obstacles_m

# How close to anything a rover comes where it stands.
CLEARANCE_M = 0.4
_NEAREST_M, _FURTHEST_M = 1.7, 3.4
_ASIDE_RAD = math.radians(26)
_DRAWS = 64
_PLENTY = 12
_APART_M = 0.5
_DOWN_RAD = math.radians(3)
_CAMERAS_PER_SIGHT = 3


def vantage(court: Court, sight: Floats, rng: np.random.Generator, taken_m: Floats) -> Floats:
    """A free place (2,) with a free view of an open `sight`, apart from places `taken_m` (n, 2) if it can be."""
    free = _free_places(court, sight, rng)
    while not len(free):
        free = _free_places(court, sight, rng)
    apart = np.linalg.norm(free[:, None] - taken_m.reshape(1, -1, 2), axis=2).min(axis=1, initial=np.inf)
    return np.asarray(free[int(np.argmax(np.minimum(apart, _APART_M)))], np.float64)


def open_sights(court: Court, rng: np.random.Generator) -> Floats:
    """The sights (k, 5) of a court that can be looked at from plenty of places, so that drawing one succeeds."""
    return court.sights[[len(_free_places(court, sight, rng)) >= _PLENTY for sight in court.sights]]


def _free_places(court: Court, sight: Floats, rng: np.random.Generator) -> Floats:
    normal = math.atan2(sight[4], sight[3])
    angle = normal + np.clip(rng.normal(0, _ASIDE_RAD / 1.5, _DRAWS), -_ASIDE_RAD, _ASIDE_RAD)
    distance = rng.uniform(_NEAREST_M, _FURTHEST_M, _DRAWS)
    places = sight[:2] + distance[:, None] * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    free = places[clearance_m(court, places) >= CLEARANCE_M]
    return np.asarray(free[_unhidden(court, sight, free)], np.float64)


def towards(place_m: Floats, sight: Floats, height_m: float) -> tuple[float, float]:
    """Yaw and pitch that look from a place (2,) at a sight, a little downwards."""
    dx, dy = sight[:2] - place_m
    return math.atan2(dy, dx), math.atan2(sight[2] - height_m, math.hypot(dx, dy)) - _DOWN_RAD


def viewpoints(world: World, count: int, seed: int = 0) -> list[Pose]:
    """Fixed camera poses, a few for every sight chosen, as rovers would stand; the same seed gives the same."""
    rng = np.random.default_rng([seed, count])
    court = world.courts[0]
    sights = open_sights(court, rng)
    chosen = sights[rng.permutation(len(sights))[: max(1, round(count / _CAMERAS_PER_SIGHT))]]
    taken = np.empty((0, 2))
    poses = []
    for k in range(count):
        sight = chosen[k % len(chosen)]
        place = vantage(court, sight, rng, taken)
        taken = np.vstack([taken, place])
        height = float(rng.uniform(0.9, 1.15))
        yaw, pitch = towards(place, sight, height)
        aside, tilt = rng.normal(0, math.radians(5), 2)
        poses.append(facing((float(place[0]), float(place[1]), height), yaw + aside, pitch + tilt / 2))
    return poses


def _unhidden(court: Court, sight: Floats, places: Floats) -> NDArray[np.bool_]:
    """Whether the way from places (n, 2) to just before the sight keeps off every obstacle."""
    end = sight[:2] + 0.05 * sight[3:5]
    share = np.linspace(0, 1, 20)[:, None, None]
    way = places + share * (end - places)
    free = to_obstacles_m(court, way.reshape(-1, 2)) > 0
    return np.asarray(free.reshape(len(share), -1).all(axis=0), np.bool_)

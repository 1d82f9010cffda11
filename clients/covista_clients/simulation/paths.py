"""How rovers drive: from sight to sight on smooth ways, standing and swaying a little where they look."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from covista_schemas.messages import Pose

from covista_clients.simulation.lattice import lattice, place, route
from covista_clients.simulation.scenes import Scene, Stage, following, opening
from covista_clients.simulation.vantage import open_sights, towards
from covista_clients.simulation.viewing import facing
from covista_clients.simulation.world import Court, Floats, World

SCENE_S = 18.0
_SPEED_M_S = 0.7
_TURN_RAD_S = math.radians(25)
# Everyone has arrived, and has stood for a while, before the scene changes.
_LOOKING_S = 4.5
_LATEST_START_S = 2.0
_SWAY_M = 0.08
_SWAY_RAD = math.radians(3)


@dataclass(frozen=True, slots=True, eq=False)
class Leg:
    """One rover's part in one scene: `way` (n, 2), reached distances along it (n,), and gaze at its ends."""

    way: Floats
    along_m: Floats
    start_s: float
    travel_s: float
    gaze_from: tuple[float, float]
    gaze_to: tuple[float, float]
    sway_rad: float


class Paths:
    """Poses of `robots` at any time; the same world, number and seed give the same. Not for several threads at once.

    Rovers are dealt to the world's courts evenly, and each court plays scenes of its own.
    """

    def __init__(self, world: World, robots: int, seed: int = 0) -> None:
        courts = world.courts
        self._troupes = [
            _Troupe(court, len(range(k, robots, len(courts))), np.random.default_rng([seed, k]), offset_s)
            for k, (court, offset_s) in enumerate(zip(courts, _offsets(len(courts), seed), strict=True))
            if k < robots
        ]
        self.robots = robots

    def pose(self, robot_index: int, t_s: float, time_ns: int = 0) -> Pose:
        """Camera pose of a rover `t_s` seconds after the beginning."""
        if not 0 <= robot_index < self.robots:
            raise IndexError(f"there are {self.robots} rovers, and none of index {robot_index}")
        member, troupe = divmod(robot_index, len(self._troupes))
        return self._troupes[troupe].pose(member, max(t_s, 0.0), time_ns)

    def watched(self, robot_index: int, t_s: float) -> tuple[float, float, float]:
        """The point that a rover looks at, or drives to look at, at `t_s`: rovers with the same one belong together."""
        member, troupe = divmod(robot_index, len(self._troupes))
        return self._troupes[troupe].watched(member, max(t_s, 0.0))


class _Troupe:
    """The rovers of one court, and what they have played so far."""

    def __init__(self, court: Court, rovers: int, rng: np.random.Generator, offset_s: float) -> None:
        self._stage = Stage(court, lattice(court), open_sights(court, rng))
        self._rng = rng
        self._offset_s = offset_s
        self._heights_m = rng.uniform(0.9, 1.15, rovers).tolist()
        self._scenes = [opening(self._stage, rovers, rng)]
        self._legs: dict[int, tuple[int, Leg]] = {}

    def pose(self, member: int, t_s: float, time_ns: int) -> Pose:
        number, since_s = divmod(t_s + self._offset_s, SCENE_S)
        (x, y), yaw, pitch = _along(self._leg(member, int(number)), since_s)
        return facing((x, y, self._heights_m[member]), yaw, pitch, time_ns)

    def watched(self, member: int, t_s: float) -> tuple[float, float, float]:
        number = int((t_s + self._offset_s) // SCENE_S)
        x, y, z = self._stage.sights[self._scene(number).sights[member], :3].tolist()
        return x, y, z

    def _scene(self, number: int) -> Scene:
        while len(self._scenes) <= number:
            self._scenes.append(following(self._stage, self._scenes[-1], len(self._scenes), self._rng))
        return self._scenes[number]

    def _leg(self, member: int, number: int) -> Leg:
        known, leg = self._legs.get(member, (-1, None))
        if leg is None or known != number:
            leg = self._drawn(member, number)
            self._legs[member] = number, leg
        return leg

    def _drawn(self, member: int, number: int) -> Leg:
        before, after = self._scene(max(number - 1, 0)), self._scene(number)
        way = route(self._stage.grid, before.places[member], after.places[member])
        along = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(way, axis=0).T))])
        gaze = [
            towards(place(self._stage.grid, scene.places[member]), self._stage.sights[scene.sights[member]], height)
            for scene, height in ((before, self._heights_m[member]), (after, self._heights_m[member]))
        ]
        # Golden-ratio steps: rovers of a scene start one after another, without further draws.
        late = (member * 0.618 + number * 0.382) % 1.0
        turn = abs(math.remainder(gaze[1][0] - gaze[0][0], 2 * math.pi))
        wanted = max(float(along[-1]) / _SPEED_M_S, turn / _TURN_RAD_S)
        travel = min(wanted, SCENE_S - _LOOKING_S - _LATEST_START_S)
        return Leg(way, along, late * _LATEST_START_S, travel, gaze[0], gaze[1], 2 * math.pi * late)


def _offsets(courts: int, seed: int) -> list[float]:
    """When courts change scenes, seconds early: the first one on time, the others anywhere between."""
    offsets: list[float] = np.random.default_rng([seed, courts]).uniform(0, SCENE_S, courts).tolist()
    return [0.0, *offsets[1:]]


def _along(leg: Leg, since_s: float) -> tuple[tuple[float, float], float, float]:
    """Place, yaw and pitch `since_s` seconds after the scene began."""
    share = min(max((since_s - leg.start_s) / leg.travel_s, 0.0), 1.0) if leg.travel_s else 1.0
    done = share * share * (3 - 2 * share)
    reached = done * leg.along_m[-1]
    x, y = (float(np.interp(reached, leg.along_m, leg.way[:, axis])) for axis in (0, 1))
    turn = math.remainder(leg.gaze_to[0] - leg.gaze_from[0], 2 * math.pi)
    yaw = leg.gaze_from[0] + done * turn
    pitch = leg.gaze_from[1] + done * (leg.gaze_to[1] - leg.gaze_from[1])
    # Swaying begins and ends at rest, with the scene.
    phase = 2 * math.pi * since_s / SCENE_S
    sway = math.sin(phase / 2) ** 2
    drift = _SWAY_M * sway
    angle = leg.sway_rad + phase
    return (x + drift * math.cos(angle), y + drift * math.sin(angle)), yaw + _SWAY_RAD * sway * math.sin(angle), pitch

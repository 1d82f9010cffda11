"""What does it cost to answer for a robot that has moved, all in: its surface from there, its overlaps, one row?"""

from __future__ import annotations

import time
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from covista_service.bench.row import Row, median, spread
from covista_service.bench.threads import one_thread
from covista_service.perception.agreement import DepthPoints, Observations
from covista_service.perception.camera import Camera, Features, Floats, Pose, View, relatives
from covista_service.perception.scene import Evidence, Settled, Sight
from covista_service.perception.surface import COLUMNS, ROWS, Surface
from covista_service.perception.visibility import Gallery, Seeing, VisibilityOptions, looks
from covista_service.station import prospects
from covista_service.station.events import BuildSurfaces, Keyframe, KeyframeId, SurfacesBuilt
from covista_service.station.forecasts import Forecasts
from covista_service.station.groups import Groups
from covista_service.station.options import NS_PER_S, StationOptions
from covista_service.station.outlooks import Outlooks
from covista_service.station.pairs import Pairs, pair_of
from covista_service.station.roster import Roster

PEER = "visibility of the same pairs alone"
MARK_US, MARK_TURN_MS = 40.0, 20.0
_ROBOTS, _TEAM, _MOVING = 1000, 8, 32
_ROUNDS, _LONG_ROUNDS = 25, 200
_CAMERA = Camera(np.array([[300.0, 0, 159.5], [0, 300.0, 119.5], [0, 0, 1]]), 320, 240)
_FEATURES = Features("rootsift", np.zeros((0, 2), np.float32), np.zeros((0, 128), np.uint8))
_DEPTH_M, _APART_M = 4.0, 20.0
_SEEN = Observations(np.arange(9), np.ones(9), np.ones(9), np.ones(9, np.bool_))
_MATCHED = Evidence(np.zeros((9, 2), np.int64), None, (np.eye(3), np.zeros(3)), (_SEEN, _SEEN))


def rows(long: bool) -> Iterator[Row]:
    """`predict/poses`: us for each ordered pair, when 32 robots of 1000 have moved, each with seven partners.

    `predict/poses_turn`: ms of a turn of the station's loop that reads as many as it may. On one core.
    """
    with one_thread():
        swarm = _Swarm(_ROBOTS, np.random.default_rng(0))
        costs, turns, peers = swarm.rounds(_LONG_ROUNDS if long else _ROUNDS)
    for case, times, unit, mark, peer in (
        ("poses", costs, "us/pair", MARK_US, peers),
        ("poses_turn", turns, "ms", MARK_TURN_MS, None),
    ):
        figure = median(times)
        yield Row(
            bench="predict",
            case=case,
            median=figure,
            spread=spread(times),
            unit=unit,
            peer=None if peer is None else PEER,
            peer_median=None if peer is None else median(peer),
            mark=f"<= {mark:g} {unit}",
            holds=figure <= mark,
        )


@dataclass(frozen=True, slots=True, eq=False)
class _Member:
    name: KeyframeId
    surface: Surface
    pose: Pose


class _Swarm:
    """Teams that look at the same, without the messages that would bring them about."""

    def __init__(self, robots: int, rng: np.random.Generator) -> None:
        self._rng = rng
        self._members = [_member(number, rng) for number in range(robots)]
        self._team = {
            member.name.robot: frozenset(
                other.name.robot
                for other in self._members[number // _TEAM * _TEAM : number // _TEAM * _TEAM + _TEAM]
                if other is not member
            )
            for number, member in enumerate(self._members)
        }
        options = StationOptions(forecasts_per_s=1e9)
        self._roster, self._outlooks = Roster(options), Outlooks()
        pairs, groups = Pairs(round(options.unknown_after_s * NS_PER_S)), Groups(options)
        self._forecasts = Forecasts(
            self._roster, pairs, groups, self._outlooks, lambda _robot, _pose: (), options, prospects.read
        )
        self._now_ns = 0
        for robot, others in self._team.items():
            for other in others:
                pairs.meet(pair_of(robot, other), None)
        for member in self._members:
            groups.place(member.name.robot, member.pose.centre_m)
            self._show(member)
        self._forecasts.renewed(list(self._team), self._now_ns)

    def rounds(self, count: int) -> tuple[list[float], list[float], list[float]]:
        """Costs of an ordered pair (us), of full turns (ms), and of visibility alone (us), round by round."""
        costs, turns, peers = [], [], []
        for step in range(count + 1):
            moved = self._rng.choice(len(self._members), _MOVING, replace=False).tolist()
            pairs, took_ns, turn_ns = self._move(moved)
            peer_ns = self._looks(moved)
            if step:  # the first one warms up
                costs.append(took_ns / pairs / 1e3)
                turns.append(turn_ns / 1e6)
                peers.append(peer_ns / 1e3)
        return costs, turns, peers

    def _show(self, member: _Member) -> None:
        """Let a robot have a keyframe with a surface that is matched with all of its team."""
        robot = self._roster.meet(member.name.robot)
        keyframe = Keyframe(member.name, 0, 0, _CAMERA, member.pose, features=_FEATURES)
        robot.keyframe = keyframe
        robot.locate(member.pose, 0, member.name.boot)
        self._outlooks.keyframe(keyframe)
        sight = Sight(View(_CAMERA, member.pose, _FEATURES), member.pose)
        beside = [KeyframeId(other, member.name.boot, 0) for other in sorted(self._team[member.name.robot])]
        names = (member.name, *beside)
        job = BuildSurfaces(names, (sight, *[Sight(sight.view, sight.pose, open=False)] * len(beside)), (), {})
        nothing = DepthPoints(np.zeros((0, 2)), *(np.zeros(0) for _ in range(3)))
        settled = (Settled(member.pose, member.surface, nothing),) * len(names)
        evidence = {(0, k + 1): _MATCHED for k in range(len(beside))}
        self._outlooks.built(SurfacesBuilt(job, settled, evidence), self._now_ns)

    def _move(self, moved: list[int]) -> tuple[int, int, int]:
        """Ordered pairs read when these have moved, ns that it took, and ns of the first turn."""
        poses = [(self._members[k].name, _nudged(self._members[k].pose, self._rng)) for k in moved]
        before, turns = self._forecasts.count, []
        while poses or self._forecasts.waiting:
            self._now_ns += NS_PER_S // 50
            start = time.perf_counter_ns()
            for name, pose in poses:
                self._roster[name.robot].locate(pose, self._now_ns, name.boot)
                self._forecasts.moved(name.robot)
            poses = []
            self._forecasts.look(self._now_ns)
            turns.append(time.perf_counter_ns() - start)
        return self._forecasts.count - before, sum(turns), turns[0]

    def _looks(self, moved: list[int]) -> float:
        """Ns for each ordered pair that visibility alone takes."""
        teams = [self._members[k // _TEAM * _TEAM : k // _TEAM * _TEAM + _TEAM] for k in moved]
        members = [member for team in teams for member in team]
        gallery = Gallery.of([Seeing(_CAMERA, member.surface) for member in members])
        pairs = np.array([(base, base + k) for base in range(0, len(members), _TEAM) for k in range(1, _TEAM)])
        motions = relatives([member.pose for member in members], pairs)
        start = time.perf_counter_ns()
        looks(gallery, pairs, *motions, np.ones((len(pairs), 2)), VisibilityOptions())
        return (time.perf_counter_ns() - start) / len(pairs)


def _member(number: int, rng: np.random.Generator) -> _Member:
    """One of a team before a wavy wall, near the others."""
    row, column = divmod(number // _TEAM, round(np.sqrt(_ROBOTS / _TEAM)))
    centre_m = np.array([_APART_M * column, 0.0, _APART_M * row]) + rng.normal(0, 0.5, 3)
    across, down = np.sin(np.arange(COLUMNS) / 9 + rng.uniform(0, 6)), np.sin(np.arange(ROWS) / 9)
    depth_m = _DEPTH_M * np.exp(0.2 * (across + down[:, None]))
    pose = Pose(_turned(rng.normal(0, 0.15)), centre_m)
    return _Member(KeyframeId(f"r{number:04d}", "b", 0), Surface(1 / depth_m, np.full((ROWS, COLUMNS), 0.03)), pose)


def _nudged(pose: Pose, rng: np.random.Generator) -> Pose:
    """Far enough from where the keyframe was taken to be noticed."""
    return Pose(_turned(rng.uniform(0.03, 0.2)) @ pose.world_from_camera, pose.centre_m + rng.normal(0, 0.1, 3))


def _turned(angle: float) -> Floats:
    sin, cos = np.sin(angle), np.cos(angle)
    return np.array([[cos, 0.0, sin], [0.0, 1.0, 0.0], [-sin, 0.0, cos]])

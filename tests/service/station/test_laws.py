"""Whatever robots, images and clocks do: the matrix and the answers say the same, and nothing is left behind."""

from itertools import combinations

import numpy as np
import pytest
from covista_service.perception.camera import Pose
from covista_service.station.events import SurveyPair
from covista_service.station.snapshot import Snapshot
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.service.perception.scenes import turn
from tests.service.station.scenes import NOTHING, SEEN, Found, S, Scene


class Life:
    """A swarm that mixes, on the ground or in a corner of it, told by keyframes and poses; surveys find anything."""

    def __init__(self, seed: int) -> None:
        self.rng = np.random.default_rng(seed)
        self.count, self.side_m = int(self.rng.integers(2, 8)), float(self.rng.choice([5.0, 60.0]))
        times = {"live_after_s": 20, "gone_after_s": 20, "forget_after_s": 100}
        self.scene = Scene.of(capacity=3, retry_after_s=2.0, decay_after_s=10, unknown_after_s=40, **times)

    def step(self) -> None:
        for _ in range(int(self.rng.integers(1, 4))):
            self._say(f"r{self.rng.integers(self.count)}")
        happens = self.rng.random()
        if happens < 0.05:
            self.scene.now_ns -= int(self.rng.integers(1, 5000)) * S
        elif happens < 0.1:
            self.scene.work(self.scene.wait(float(self.rng.uniform(0, 60))), self._find)
        self.scene.work(self.scene.wait(float(self.rng.uniform(0, 1.5))), self._find)
        self.scene.settle(self._find)

    def _say(self, robot: str) -> None:
        x_m, z_m = self.rng.uniform(0, self.side_m, 2)
        at = Pose(turn(0, self.rng.uniform(-3, 3), 0), np.array([x_m, 0.0, z_m]))
        if self.rng.random() < 0.5:
            self.scene.send(robot, at)
        else:
            self.scene.send_pose(robot, at)

    def _find(self, job: SurveyPair) -> Found | None:
        return (SEEN, SEEN, NOTHING, NOTHING, None)[self.rng.integers(5)]


def assert_agreement(snapshot: Snapshot) -> None:
    """The matrix says what the answers say, and those are of no time to come."""
    similarity = snapshot.similarity
    for (i, a), (k, b) in combinations(enumerate(similarity.robots), 2):
        view = snapshot.pair(a, b)
        assert view.age_s is None or 0 <= view.age_s < 40
        for told, shared in (
            (view.overlap_a, similarity.overlap[i, k]),
            (view.overlap_b, similarity.overlap[k, i]),
        ):
            assert told == (None if np.isnan(shared) else pytest.approx(shared, abs=1e-9))


@given(st.integers(0, 2**31))
@settings(max_examples=15, deadline=None)
def test_the_matrix_says_what_the_answers_say_and_no_answer_is_of_a_time_to_come(seed: int) -> None:
    life = Life(seed)
    for _ in range(30):
        life.step()
        assert_agreement(life.scene.snapshot)


@given(st.integers(0, 2**31))
@settings(max_examples=10, deadline=None)
def test_nothing_is_left_of_robots_that_are_forgotten(seed: int) -> None:
    life = Life(seed)
    for _ in range(20):
        life.step()
    scene = life.scene
    scene.work(scene.wait(25), lambda job: NOTHING)
    scene.wait(200)
    station, hoods = scene.station, scene.station._surveys.neighbourhoods
    assert scene.snapshot.robots == {}
    assert (len(station._pairs), len(hoods._grid), len(hoods._ground)) == (0, 0, 0)
    for places in (hoods._reaches, hoods._standing, hoods._judged, hoods._ageing, hoods._lapsed, hoods._receding):
        assert places == {}
    assert scene.snapshot.workload.under_way == 0

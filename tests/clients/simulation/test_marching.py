from __future__ import annotations

import itertools
import threading
from collections import defaultdict

import numpy as np
import pytest
from covista_clients.simulation.antenna import Antenna, antenna
from covista_clients.simulation.crowd import Crowd
from covista_clients.simulation.marching import March, is_crowd, march, run_crowd, stock_of
from covista_clients.simulation.pacing import AtOnce, RealTime
from covista_clients.simulation.swarm import SwarmOptions
from covista_schemas.messages import Keyframe, PoseUpdate

from tests.clients.ground import SITE, Ground
from tests.clients.simulation import stocks

CROWD = Crowd(stocks.drawn(robots=6, steps=4), 20)
BEGIN_NS = 10**18


class Late(AtOnce):
    """A machine that falls behind by a second once, at second 1, and takes its time to catch up."""

    def now_s(self) -> float:
        due_s = super().now_s()
        return max(due_s, 2.0) if due_s >= 1 else due_s


class Sent:
    """What the ground has heard of a march."""

    def __init__(self, ground: Ground, keyframes: int, poses: int) -> None:
        ground.wait(lambda: len(ground.keyframes) >= keyframes and len(ground.poses) >= poses)
        self.keyframes: dict[str, list[Keyframe]] = defaultdict(list)
        self.poses: dict[str, list[PoseUpdate]] = defaultdict(list)
        for keyframe in ground.keyframes:
            self.keyframes[keyframe.robot].append(keyframe)
        for pose in ground.poses:
            self.poses[pose.robot].append(pose)


@pytest.fixture
def raised(ground: Ground, endpoint: str) -> Antenna:
    with antenna(endpoint, SITE, CROWD.names, threading.Event()) as made:
        assert made is not None
        assert made.await_heard(threading.Event())
        yield made


def test_everyone_sends_at_its_rates_and_numbers_have_no_gaps(ground: Ground, raised: Antenna) -> None:
    progress = march(CROWD, raised, March(1.0, 2.0, 5.0), AtOnce(), BEGIN_NS)
    assert (progress.keyframes, progress.poses, progress.skipped) == (100, 200, 0)
    sent = Sent(ground, 100, 200)
    for robot in CROWD.names:
        assert [keyframe.sequence for keyframe in sent.keyframes[robot]] == list(range(5))
        assert [pose.sequence for pose in sent.poses[robot]] == list(range(10))
    assert raised.keyframes == [5] * 20
    assert raised.poses == [10] * 20


def test_everyone_has_a_boot_and_a_token_of_its_own(ground: Ground, raised: Antenna) -> None:
    march(CROWD, raised, March(1.0, 1.0, 1.0), AtOnce(), BEGIN_NS)
    sent = Sent(ground, 20, 20)
    boots = {robot: {keyframe.boot for keyframe in sent.keyframes[robot]} for robot in CROWD.names}
    assert all(len(boot) == 1 for boot in boots.values())
    assert len(set.union(*boots.values())) == 20
    assert {pose.boot for pose in sent.poses["r7"]} == boots["r7"]
    expected = {f"covista/{SITE}/robots/{robot}/alive/{min(boot)}" for robot, boot in boots.items()}
    ground.wait(lambda: ground.tokens == expected)


def test_poses_lie_on_the_way_from_keyframe_to_keyframe(ground: Ground, raised: Antenna) -> None:
    march(CROWD, raised, March(0.5, 4.0, 8.0), AtOnce(), BEGIN_NS)
    sent = Sent(ground, 80, 640)
    for robot in CROWD.names:
        taken = sent.keyframes[robot]
        times = np.array([each.pose.time_ns - BEGIN_NS for each in taken]) / 1e9
        np.testing.assert_allclose(np.diff(times), 2.0)
        at = np.array([each.pose.position_m for each in taken])
        for update in sent.poses[robot]:
            t_s = (update.pose.time_ns - BEGIN_NS) / 1e9
            # Before the first keyframe it stands; after the last one it drives on.
            if t_s <= times[-1]:
                between = [np.interp(t_s, times, at[:, axis]) for axis in range(3)]
                np.testing.assert_allclose(update.pose.position_m, between, atol=1e-6)


def test_a_march_goes_on_where_the_one_before_ended(ground: Ground, raised: Antenna) -> None:
    march(CROWD, raised, March(1.0, 0.0, 2.0), AtOnce(), BEGIN_NS)
    march(CROWD, raised, March(1.0, 1.0, 1.0, first_step=2), AtOnce(), BEGIN_NS + 2 * 10**9)
    sent = Sent(ground, 60, 20)
    for robot, name in enumerate(CROWD.names):
        assert [keyframe.sequence for keyframe in sent.keyframes[name]] == [0, 1, 2]
        at = [keyframe.pose.position_m for keyframe in sent.keyframes[name]]
        assert at == [CROWD.pose(robot, step).position_m for step in range(3)]
        assert sent.poses[name][0].pose.position_m == at[2]


def test_a_march_that_ends_between_turns_goes_on_with_those_whose_turn_it_is(ground: Ground, raised: Antenna) -> None:
    for first_step in (0.0, 0.5, 1.0, 1.5):
        march(CROWD, raised, March(1.0, 0.0, 0.5, first_step), AtOnce(), BEGIN_NS + round(first_step * 1e9))
    sent = Sent(ground, 40, 0)
    for robot, name in enumerate(CROWD.names):
        assert [keyframe.sequence for keyframe in sent.keyframes[name]] == [0, 1]
        at = [keyframe.pose.position_m for keyframe in sent.keyframes[name]]
        assert at == [CROWD.pose(robot, step).position_m for step in range(2)]


def test_what_falls_due_while_it_sleeps_goes_out_together() -> None:
    pace = RealTime(threading.Event(), grain_s=0.02)
    assert pace.wait_until(0.001)
    assert pace.now_s() >= 0.02
    assert pace.wait_until(0.015)


def test_neighbours_do_not_send_in_a_row(ground: Ground, raised: Antenna) -> None:
    march(CROWD, raised, March(1.0, 0.0, 1.0), AtOnce(), BEGIN_NS)
    Sent(ground, 20, 0)
    order = [int(keyframe.robot[1:]) - 1 for keyframe in ground.keyframes]
    in_a_row = sum(one // 6 == other // 6 for one, other in itertools.pairwise(order))
    assert sorted(order) == list(range(20))
    assert in_a_row < 12


def test_a_crowd_that_falls_behind_skips_and_says_so(ground: Ground, raised: Antenna) -> None:
    progress = march(CROWD, raised, March(2.0, 0.0, 4.0), Late(), BEGIN_NS)
    assert progress.most_behind_s == 1.0
    assert progress.behind_s == 0.0
    assert progress.skipped == 20
    assert progress.keyframes == 140
    sent = Sent(ground, 140, 0)
    for robot in CROWD.names:
        # What was not sent had no number.
        assert [keyframe.sequence for keyframe in sent.keyframes[robot]] == list(range(7))


def test_nothing_is_sent_while_nobody_hears(endpoint: str) -> None:
    with Ground(endpoint) as ground, antenna(endpoint, "elsewhere", CROWD.names, threading.Event()) as raised:
        assert raised is not None
        assert not raised.heard
        progress = march(CROWD, raised, March(1.0, 1.0, 2.0), AtOnce(), BEGIN_NS)
        assert (progress.keyframes, progress.poses, progress.skipped) == (0, 0, 80)
        assert raised.keyframes == [0] * 20
        assert not ground.keyframes


def test_waiting_for_a_router_or_a_station_ends_when_told(endpoint: str) -> None:
    stop = threading.Event()
    stop.set()
    with antenna(endpoint, SITE, CROWD.names, stop) as raised:
        assert raised is None
    with Ground(endpoint), antenna(endpoint, "elsewhere", CROWD.names, threading.Event()) as raised:
        assert raised is not None
        assert not raised.await_heard(stop)


def test_a_march_ends_when_told(raised: Antenna) -> None:
    stop = threading.Event()
    stop.set()
    assert march(CROWD, raised, March(1.0), RealTime(stop), BEGIN_NS).keyframes == 0


def test_a_crowd_leaves(ground: Ground, endpoint: str) -> None:
    options = SwarmOptions(
        robots=7, world="wall", rate_hz=5, connect=endpoint, send="features+thumbnail", width=128, height=96
    )
    progress = run_crowd(options, threading.Event(), seconds=0.4)
    sent = Sent(ground, progress.keyframes, progress.poses)
    assert progress.keyframes == 14
    assert set(sent.keyframes) == {f"r{k + 1}" for k in range(7)}
    assert all(keyframe.thumbnail for keyframe in ground.keyframes)
    ground.wait(lambda: not ground.tokens)


def test_a_crowd_without_a_station_ends_when_told(endpoint: str) -> None:
    stop = threading.Event()
    options = SwarmOptions(robots=7, world="wall", connect=endpoint, send="features")
    progress = run_crowd(options, stop, on_shot=lambda *_: stop.set())
    assert (progress.keyframes, progress.poses) == (0, 0)


@pytest.mark.parametrize(
    ("robots", "send", "expected"),
    [(6, "features", False), (7, "features", True), (7, "features+thumbnail", True), (1000, "image", False)],
)
def test_many_that_send_features_are_a_crowd(robots: int, send: str, expected: bool) -> None:
    assert is_crowd(SwarmOptions(robots=robots, send=send)) is expected


def test_a_stock_is_a_tile_of_the_world_asked_for() -> None:
    assert stock_of(SwarmOptions(robots=1000, rate_hz=0.1)).robots == 24
    assert stock_of(SwarmOptions(robots=20)).robots == 20
    assert stock_of(SwarmOptions(robots=20, world="shelf")).robots == 6
    assert stock_of(SwarmOptions(rate_hz=0.1)).step_s == 1.0
    assert stock_of(SwarmOptions(rate_hz=4)).step_s == 0.25
    assert stock_of(SwarmOptions(send="features+thumbnail")).thumbnails

"""A rover whose keyframes are not heard for long sends one at a time, so that poses do not wait behind them."""

import numpy as np
import pytest
from covista_clients import Camera, Pose, Rover
from covista_clients.rover import rover as rover_module
from covista_schemas.reports import KeyframeId, RobotReport

from tests.clients.ground import BusyError, Ground, report_on
from tests.clients.rover.test_rover import wait_until

pytestmark = pytest.mark.usefixtures("no_thread_left")
CAMERA = Camera(fx=60, fy=60, cx=31.5, cy=23.5, width=64, height=48)
PICTURE = np.random.default_rng(0).integers(0, 256, (48, 64, 3), np.uint8)


def at(x: float) -> Pose:
    return Pose((x, 0, 0), time_ns=int(x * 1e9))


class Deaf:
    """Answers that it has heard keyframes up to a number, which the test sets."""

    def __init__(self) -> None:
        self.boot = ""
        self.heard = -1

    def report(self, robot: str) -> RobotReport:
        heard = None if self.heard < 0 else KeyframeId(boot=self.boot, sequence=self.heard)
        return report_on(robot, heard=heard)


def test_one_keyframe_is_under_way_at_a_time_and_poses_go_on(endpoint: str) -> None:
    deaf = Deaf()
    with Ground(endpoint, answer=deaf.report) as station, Rover("r1", CAMERA, endpoint) as rover:
        deaf.boot = rover.boot
        rover.send_keyframe(PICTURE, at(0))
        station.wait(lambda: len(station.keyframes) == 1)
        wait_until(lambda: rover._link.poses_wanted())
        for number in range(1, 6):
            rover.send_keyframe(PICTURE, at(number))
            rover.send_pose(at(number))
        station.wait(lambda: len(station.poses) == 5)
        assert [each.sequence for each in station.keyframes] == [0]
        deaf.heard = 0
        # The newest goes out when the one before it was heard, under the next number.
        station.wait(lambda: len(station.keyframes) == 2)
        assert (station.keyframes[1].sequence, station.keyframes[1].pose.position_m[0]) == (1, 5.0)
        deaf.heard = 1
        rover.close()


def test_where_keyframes_are_heard_at_once_again_few_are_asked_for(
    endpoint: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(rover_module, "_SLOW_S", 0.2)
    deaf = Deaf()
    with Ground(endpoint, answer=deaf.report) as station, Rover("r1", CAMERA, endpoint) as rover:
        deaf.boot = rover.boot
        rover.send_keyframe(PICTURE, at(0))
        # A fifth question comes after pauses of more than .2 s in all.
        station.wait(lambda: station.asked >= 5)
        deaf.heard = 99
        wait_until(lambda: not rover._outbox._sending)
        for number in (1, 2, 3, 4):
            rover.send_keyframe(PICTURE, at(number))
            wait_until(lambda number=number: rover.keyframes_sent == number + 1)
        wait_until(lambda: not rover._outbox._sending)
        asked = station.asked
        for number in (5, 6, 7):
            rover.send_keyframe(PICTURE, at(number))
            wait_until(lambda number=number: rover.keyframes_sent == number + 1)
        wait_until(lambda: not rover._outbox._sending)
        assert station.asked == asked


def test_a_station_that_is_busy_does_not_make_the_link_slow(endpoint: str) -> None:
    def busy(robot: str) -> RobotReport | None:
        raise BusyError

    with Ground(endpoint, answer=busy) as station, Rover("r1", CAMERA, endpoint) as rover:
        for number in range(9):
            rover.send_keyframe(PICTURE, at(number))
            wait_until(lambda number=number: rover.keyframes_sent == number + 1)
        station.wait(lambda: len(station.keyframes) == 9)
        # Once for every fourth.
        assert station.asked <= 3
        rover.close(wait_s=0)


def test_who_is_closed_waits_for_nothing_more_of_a_slow_link(endpoint: str) -> None:
    deaf = Deaf()
    with Ground(endpoint, answer=deaf.report) as station:
        rover = Rover("r1", CAMERA, endpoint)
        deaf.boot = rover.boot
        rover.send_keyframe(PICTURE, at(0))
        station.wait(lambda: len(station.keyframes) == 1)
        rover.send_keyframe(PICTURE, at(1))
        rover.close()
        assert [each.sequence for each in station.keyframes] == [0, 1]

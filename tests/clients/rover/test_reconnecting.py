"""A router in a process of its own dies with what a rover has just put, and comes back."""

from collections.abc import Callable, Iterator

import numpy as np
import pytest
from covista_clients import Camera, Pose, Rover
from covista_clients.rover.link import RoverLink
from covista_schemas.reports import KeyframeId, PoseReport, RobotReport

from tests.clients.ground import Ground, report_on
from tests.clients.rover.test_rover import wait_until
from tests.router_process import RouterProcess

pytestmark = pytest.mark.usefixtures("no_thread_left")
CAMERA = Camera(fx=60, fy=60, cx=31.5, cy=23.5, width=64, height=48)
PICTURE = np.random.default_rng(0).integers(0, 256, (48, 64, 3), np.uint8)


def at(x: float) -> Pose:
    return Pose((x, 0, 0), time_ns=int(x * 1e9))


@pytest.fixture(autouse=True)
def a_link_that_is_not_slow(monkeypatch: pytest.MonkeyPatch) -> None:
    """On a slow one a keyframe waits for what is said of the one before, also while the router stands still."""
    monkeypatch.setattr(RoverLink, "delay_s", lambda *_: None)


@pytest.fixture
def router(endpoint: str) -> Iterator[RouterProcess]:
    with RouterProcess(endpoint) as router:
        yield router


@pytest.fixture
def station(endpoint: str, router: RouterProcess) -> Iterator[Ground]:
    """A client of the router, as the rover is one."""
    with Ground(endpoint, router=False, answer=lambda robot: report(station, robot)) as station:
        yield station


def report(station: Ground, robot: str) -> RobotReport | None:
    """What a station has heard: of the poses too."""
    confirmed = station.confirming(robot)
    if confirmed is None or not station.poses:
        return confirmed
    pose = station.poses[-1].pose
    told = PoseReport(position_m=pose.position_m, orientation_xyzw=pose.orientation_xyzw, time=pose.time_ns / 1e9)
    return confirmed.model_copy(update={"pose": told})


def send(rover: Rover, *numbers: int) -> None:
    """Keyframes and poses, each out before the next."""
    for number in numbers:
        rover.send_keyframe(PICTURE, at(number))
        rover.send_pose(at(number))
        wait_until(lambda number=number: rover.keyframes_sent == rover.poses_sent == number + 1)


def sequences(station: Ground) -> tuple[list[int], list[int]]:
    return [k.sequence for k in station.keyframes], [p.sequence for p in station.poses]


def bounce(router: RouterProcess, rover: Rover, unheard: Callable[[], None]) -> None:
    """End the router, with what `unheard` says on its way, and start it again."""
    router.stop()
    unheard()
    router.kill()
    link = rover._link
    assert link is not None
    wait_until(lambda: not link.keyframes_wanted())
    router.start()


def test_the_newest_that_a_dying_router_took_along_is_said_again(
    endpoint: str, router: RouterProcess, station: Ground
) -> None:
    with Rover("r1", CAMERA, endpoint) as rover:
        send(rover, 0, 1)
        station.wait(lambda: sequences(station) == ([0, 1], [0, 1]))
        bounce(router, rover, lambda: send(rover, 2, 3, 4))
        station.wait(lambda: sequences(station) == ([0, 1, 4], [0, 1, 4]))
        assert station.keyframes[-1].pose == station.poses[-1].pose == at(4)
        assert (rover.keyframes_resent, rover.poses_resent, rover.keyframes_lost) == (1, 1, 2)
        assert (rover.keyframes_sent, rover.poses_sent) == (5, 5)
        send(rover, 5)
        station.wait(lambda: sequences(station) == ([0, 1, 4, 5], [0, 1, 4, 5]))
    assert station.keyframes[-1].boot == rover.boot


def test_what_was_heard_is_not_said_again(endpoint: str, router: RouterProcess, station: Ground) -> None:
    with Rover("r1", CAMERA, endpoint) as rover:
        send(rover, 0)
        station.wait(lambda: sequences(station) == ([0], [0]))
        asked = station.asked
        bounce(router, rover, lambda: None)
        station.wait(lambda: station.asked > asked)
        wait_until(lambda: not rover._in_doubt)
        send(rover, 1)
        station.wait(lambda: sequences(station) == ([0, 1], [0, 1]))
        assert (rover.keyframes_resent, rover.poses_resent, rover.keyframes_lost) == (0, 0, 0)


def test_a_newer_keyframe_that_waits_goes_in_place_of_the_old_one(
    endpoint: str, router: RouterProcess, station: Ground
) -> None:
    with Rover("r1", CAMERA, endpoint) as rover:
        send(rover, 0)
        station.wait(lambda: sequences(station) == ([0], [0]))
        router.stop()
        send(rover, 1, 2)
        router.kill()
        wait_until(lambda: not rover._link.keyframes_wanted())
        rover.send_keyframe(PICTURE, at(3))
        rover.send_pose(at(3))
        router.start()
        station.wait(lambda: sequences(station) == ([0, 3], [0, 3]))
        assert (rover.keyframes_resent, rover.poses_resent, rover.keyframes_lost) == (0, 0, 2)


def test_a_station_that_starts_anew_hears_the_newest_at_once(endpoint: str, router: RouterProcess) -> None:
    with Rover("r1", CAMERA, endpoint) as rover:
        with Ground(endpoint, router=False) as before:
            send(rover, 0, 1)
            before.wait(lambda: sequences(before) == ([0, 1], [0, 1]))
        with Ground(endpoint, router=False) as after:
            after.wait(lambda: sequences(after) == ([1], [1]))
        assert (rover.keyframes_resent, rover.poses_resent, rover.keyframes_lost) == (1, 1, 0)


def test_a_station_that_does_not_answer_hears_the_newest_again(endpoint: str, router: RouterProcess) -> None:
    """What it heard before is then a duplicate, which it counts."""

    def silent(robot: str) -> RobotReport | None:
        return report_on(robot, heard=KeyframeId(boot="of somebody else", sequence=0))

    with Ground(endpoint, router=False, answer=silent) as station, Rover("r1", CAMERA, endpoint) as rover:
        send(rover, 0)
        station.wait(lambda: sequences(station) == ([0], [0]))
        bounce(router, rover, lambda: None)
        station.wait(lambda: sequences(station) == ([0, 0], [0, 0]))
        rover.close(wait_s=0)

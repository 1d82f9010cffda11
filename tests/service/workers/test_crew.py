import os
import signal
import subprocess
import sys
import threading
from collections.abc import Iterator
from concurrent.futures import CancelledError, wait

import numpy as np
import psutil
import pytest
from covista_schemas import features
from covista_schemas.codec import BAD_IMAGE
from covista_schemas.errors import DecodeError
from covista_service.link.mailbox import Letter, Mailboxes
from covista_service.link.translate import events_of
from covista_service.perception.camera import View
from covista_service.perception.comparison import Outcome
from covista_service.perception.scene import Evidence, Sight
from covista_service.perception.warming import warm_up
from covista_service.station.events import BuildSurfaces, Keyframe, KeyframeArrived, KeyframeId, SurveyPair
from covista_service.station.outlook import Outlook, masks
from covista_service.workers import Workers, WorkersOptions, extract

from tests.service.deadline import wait_until
from tests.service.wall import keyframe_bytes, overlap, picture, picture_bytes

# The first one may have to wait for the compiler.
pytestmark = pytest.mark.timeout(300)


def arrived(data: bytes, robot: str) -> Keyframe:
    boxes = Mailboxes()
    boxes.put(Letter(robot, "keyframe", "b0", 0, data, 0))
    (mail,), _ = boxes.drain(1, 0)
    event = list(events_of(mail))[-1]
    assert isinstance(event, KeyframeArrived)
    return event.keyframe


def keyframe(name: KeyframeId) -> Keyframe:
    return arrived(keyframe_bytes(name.robot), name.robot)


def pair(distance_m: float = 1.0) -> SurveyPair:
    first, second = arrived(keyframe_bytes("r1"), "r1"), arrived(keyframe_bytes("r2", distance_m), "r2")
    assert first.features is not None
    assert second.features is not None
    return SurveyPair(
        first.id,
        second.id,
        View(first.camera, first.pose, first.features),
        View(second.camera, second.pose, second.features),
    )


@pytest.fixture(scope="module", autouse=True)
def compiled() -> None:
    """What a fresh machine has to compile first, so that no worker below is waited for while it does."""
    warm_up()


@pytest.fixture(scope="module", params=["threads", "processes"])
def workers(request: pytest.FixtureRequest) -> Iterator[Workers]:
    workers = Workers(WorkersOptions(request.param, count=1))
    yield workers
    workers.close()


def test_pictures_become_features(workers: Workers) -> None:
    found, thumbnail = workers.extract(arrived(picture_bytes("r1"), "r1")).result(30)
    assert found.kind == "rootsift"
    assert thumbnail is not None
    assert features.decode_image(thumbnail).shape == (72, 96, 3)
    assert len(found.keypoints_px) == len(found.descriptors) > 50


def test_pairs_are_surveyed(workers: Workers) -> None:
    found = workers.survey(pair()).result(30)
    assert found.outcome is Outcome.MEASURED
    assert len(found.matches) > 50


@pytest.mark.parametrize("thumbnail", [None, features.thumbnail(picture()), b"no picture"])
def test_surfaces_are_built(workers: Workers, thumbnail: bytes | None) -> None:
    """A thumbnail that is none does no harm."""
    job = pair()
    found = workers.survey(job).result(30)
    sights = (Sight(job.first_view, job.first_view.pose), Sight(job.second_view, job.second_view.pose))
    names, evidence = (job.first, job.second), {(0, 1): Evidence.of(found)}
    settled, said = workers.build(BuildSurfaces(names, sights, (thumbnail, None), evidence)).result(30)
    assert said[0, 1].matched > 50
    one, other = (
        Outlook(keyframe(name), each.pose, each.surface, 50, {}, (1.0, 1.0, 1.0))
        for name, each in zip(names, settled, strict=True)
    )
    assert masks(one, other, (1.0, 1.0))[0].mean() == pytest.approx(overlap(1.0), abs=0.05)


def test_what_is_wrong_with_a_picture_comes_back(workers: Workers) -> None:
    keyframe = arrived(picture_bytes("r1"), "r1")
    assert keyframe.image is not None
    head_only = keyframe.image[:700] + b"\xff\xd9"
    broken = Keyframe(keyframe.id, 0, 0, keyframe.camera, keyframe.pose, head_only[:2] + b"\x00" * 50)
    with pytest.raises(DecodeError) as caught:
        workers.extract(broken).result(30)
    assert caught.value.code == BAD_IMAGE


def test_a_picture_that_decodes_to_another_size_is_refused() -> None:
    with pytest.raises(DecodeError, match="320 x 240 px, but the camera says 640 x 480"):
        extract(features.encode_jpeg(picture()), 640, 480)


def test_grey_pictures_do_as_well() -> None:
    grey = np.ascontiguousarray(picture()[..., 1])
    assert len(extract(features.encode_jpeg(grey), 320, 240)[0].keypoints_px) > 50


def test_a_keyframe_without_a_picture_is_a_mistake_of_ours(workers: Workers) -> None:
    with pytest.raises(ValueError, match="nothing to extract"):
        workers.extract(arrived(keyframe_bytes("r1"), "r1"))


def test_workers_are_warm_before_their_first_job(workers: Workers) -> None:
    # Said in words, for neither this test nor what a cache says of itself can be sent to a process.
    asked = f"__import__({warm_up.__module__!r}, fromlist='*').warm_up.cache_info().currsize"
    assert workers._submit(eval, asked).result(30) == 1


def test_a_pool_whose_process_died_is_replaced() -> None:
    before = set(psutil.Process().children())
    workers = Workers(WorkersOptions("processes", count=1))
    assert workers.survey(pair()).result(30).outcome is Outcome.MEASURED
    (child,) = [
        each for each in psutil.Process().children() if each not in before and "spawn_main" in " ".join(each.cmdline())
    ]
    child.kill()
    wait_until(lambda: not psutil.pid_exists(child.pid) or child.status() == psutil.STATUS_ZOMBIE)

    def works_again() -> bool:
        done = workers.survey(pair())
        wait([done], 30)
        return done.exception() is None

    wait_until(works_again, "a survey after a worker died", 30)
    workers.close()


def test_closing_drops_what_waits_and_leaves_nothing() -> None:
    before = threading.active_count()
    workers = Workers(WorkersOptions("threads", count=1))
    jobs = [workers.survey(pair()) for _ in range(20)]
    workers.close()
    assert any(job.cancelled() for job in jobs)
    assert all(job.done() for job in jobs)
    assert threading.active_count() == before
    with pytest.raises(CancelledError):
        workers.survey(pair()).result(1)


_STATION = """
import sys
from covista_service.workers import Workers, WorkersOptions
if __name__ == "__main__":
    workers = Workers(WorkersOptions("processes", count=1))
    workers._submit(int).result()
    print("ready", flush=True)
    sys.stdin.read()
"""


def test_worker_processes_end_with_a_station_that_is_killed() -> None:
    station = subprocess.Popen([sys.executable, "-c", _STATION], stdin=subprocess.PIPE, stdout=subprocess.PIPE)
    assert station.stdin is not None
    assert station.stdout is not None
    with station.stdin, station.stdout:
        assert station.stdout.readline() == b"ready\n"
        family = psutil.Process(station.pid).children(recursive=True)
        assert family
        os.kill(station.pid, signal.SIGKILL)
        station.wait()
    gone, alive = psutil.wait_procs(family, timeout=10)
    assert not alive, gone

import threading
from collections.abc import Iterator
from concurrent.futures import CancelledError
from contextlib import ExitStack, closing
from dataclasses import replace

import numpy as np
import pytest
from covista_schemas import features
from covista_schemas.codec import BAD_IMAGE
from covista_schemas.errors import DecodeError, MissingExtraError
from covista_service.perception.comparison import Outcome, compare
from covista_service.perception.scene import Evidence, SceneOptions, Sight
from covista_service.station.events import BuildSurfaces, Keyframe, KeyframeId
from covista_service.station.outlook import Outlook, masks
from covista_service.workers import Workers, WorkersOptions, extract, load, scheduler

from tests.service.deadline import wait_until
from tests.service.wall import keyframe_bytes, overlap, picture, picture_bytes
from tests.service.workers.dask_cluster import dask_cluster
from tests.service.workers.pairs import arrived, pair

# The first one may have to wait for the compiler.
pytestmark = pytest.mark.timeout(300)


def keyframe(name: KeyframeId) -> Keyframe:
    return arrived(keyframe_bytes(name.robot), name.robot)


@pytest.fixture(scope="module", autouse=True)
def compiled() -> None:
    """What a fresh machine has to compile first, so that no worker below is waited for while it does."""
    load()


@pytest.fixture(scope="module", params=["threads", "processes", "dask"])
def workers(request: pytest.FixtureRequest) -> Iterator[Workers]:
    """Every kind, with room for one job."""
    with ExitStack() as stack:
        kind = request.param
        if kind == "dask":
            cluster = stack.enter_context(dask_cluster())
            cluster.scheduler()
            cluster.worker()
            kind = cluster.url
        workers = Workers(WorkersOptions(kind, count=1))
        stack.callback(workers.close)
        wait_until(lambda: workers.warm and workers.status().fallback is None, "workers are ready", 60)
        yield workers


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


@pytest.mark.parametrize("kind", ["threads", "processes"])
def test_how_long_work_took_is_told_and_nothing_of_what_failed(kind: str) -> None:
    took: list[tuple[str, float]] = []
    with closing(Workers(WorkersOptions(kind, 1), lambda job, seconds: took.append((job, seconds)))) as workers:
        found = workers.survey(pair()).result(30)
        broken = Keyframe(KeyframeId("r1", "b0", 0), 0, 0, pair().first_view.camera, pair().first_view.pose, b"none")
        with pytest.raises(DecodeError):
            workers.extract(broken).result(30)
    assert found.outcome is Outcome.MEASURED
    assert [job for job, _ in took] == ["compare"]
    assert 0 < took[0][1] < 30


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


def test_a_job_s_own_error_comes_back(workers: Workers) -> None:
    """It is not the workers' fault, and nothing is tried again for it."""
    before = workers.status()
    views = pair()
    odd = replace(views.second_view.features, keypoints_px=np.zeros((1, 2), np.float32))
    job = workers.survey(replace(views, second_view=replace(views.second_view, features=odd)))
    with pytest.raises(IndexError):
        job.result(30)
    after = workers.status()
    assert (after.retried, after.lost, after.given_up) == (before.retried, before.lost, before.given_up) == (0, 0, 0)


def test_all_kinds_find_the_same(workers: Workers) -> None:
    job = pair()
    here = compare(job.first_view, job.second_view, SceneOptions().comparison)
    there = workers.survey(job).result(30)
    assert np.array_equal(here.matches, there.matches)
    assert np.array_equal(here.pose.rotation, there.pose.rotation)


def test_capacity_is_what_was_asked_for(workers: Workers) -> None:
    """To and from a cluster jobs take time: one may be on its way while another is done."""
    assert workers.capacity == workers.status().capacity == (2 if workers.status().kind == "dask" else 1)


def test_features_travel_once(workers: Workers) -> None:
    """However many jobs they take part in; to threads they do not travel at all."""
    job = pair()
    size = sum(
        one.features.keypoints_px.nbytes + one.features.descriptors.nbytes for one in (job.first_view, job.second_view)
    )
    before = workers.status().shipped_bytes
    for _ in range(5):
        workers.survey(job).result(30)
    shipped = workers.status().shipped_bytes - before
    assert shipped == 0 if workers.status().kind == "threads" else size <= shipped < 1.1 * size


def test_unknown_kinds_are_refused() -> None:
    with pytest.raises(ValueError, match="no such workers: goblins"):
        Workers(WorkersOptions("goblins"))


def test_an_absent_extra_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(scheduler, "find_spec", lambda name: None)
    with pytest.raises(MissingExtraError, match=r"pip install 'covista\[scale\]'"):
        Workers(WorkersOptions("dask://127.0.0.1:8786"))


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

"""Where the heavy work runs: threads of this process, or processes of their own.

OpenCV, BLAS and numba let go of the interpreter's lock while they compute, so threads do well; processes keep the rest
of the station undisturbed, and survive a picture that crashes a decoder.
"""

from __future__ import annotations

import logging
import os
import signal
import threading
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import BrokenExecutor, Executor, Future, ProcessPoolExecutor, ThreadPoolExecutor
from dataclasses import dataclass, field, replace
from multiprocessing import get_context, parent_process
from typing import Literal, ParamSpec, TypeVar

import cv2
import numpy as np
from covista_schemas import features as vision
from covista_schemas.codec import BAD_IMAGE
from covista_schemas.errors import DecodeError
from numpy.typing import NDArray

from covista_service.grouping import warming as grouping_warming
from covista_service.perception.camera import Features
from covista_service.perception.comparison import Comparison, compare
from covista_service.perception.scene import Evidence, SceneOptions, Settled, Sight, settle
from covista_service.perception.warming import warm_up
from covista_service.station.events import BuildSurfaces, Keyframe, SurveyPair

# A robot that shot while tilted says so in its pose, not by an orientation tag in the file.
_AS_STORED = cv2.IMREAD_COLOR | cv2.IMREAD_IGNORE_ORIENTATION
_P = ParamSpec("_P")
_T = TypeVar("_T")
Built = tuple[tuple[Settled, ...], Mapping[tuple[int, int], Evidence]]

log = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True)
class WorkersOptions:
    """`count` jobs run at a time, each on one core."""

    kind: Literal["threads", "processes"] = "threads"
    count: int = 2
    scene: SceneOptions = field(default_factory=SceneOptions)


class Workers:
    """A pool of workers. A pool whose process died is replaced when the next job comes."""

    def __init__(self, options: WorkersOptions) -> None:
        self._options = options
        self._lock = threading.Lock()
        self._closed = False
        self._pool = _pool(options)
        # Processes take a second or two to start, and compiled code to load: now is better than when the first robot
        # waits. Threads share what one of them has loaded.
        self._here = ThreadPoolExecutor(1, "covista-loading")
        if options.kind == "threads":
            self._warming = [self._submit(warm_up)]
        else:
            # Overlaps are read in this process.
            self._warming = [self._here.submit(warm_up), *(self._submit(warm_up) for _ in range(options.count))]
        for one in self._warming:
            one.add_done_callback(_tell_failure)

    @property
    def warm(self) -> bool:
        """Is compiled code loaded, so that no keyframe has to wait for it?"""
        return all(one.done() for one in self._warming)

    @property
    def capacity(self) -> int:
        """How many jobs can run at a time."""
        return self._options.count

    def extract(self, keyframe: Keyframe) -> Future[tuple[Features, bytes | None]]:
        """Decode the keyframe's image and extract its features and a thumbnail.

        Fails with DecodeError where it is no such image.
        """
        if keyframe.image is None:
            raise ValueError("a keyframe without an image has nothing to extract from")
        return self._submit(extract, keyframe.image, keyframe.camera.width, keyframe.camera.height)

    def survey(self, job: SurveyPair) -> Future[Comparison]:
        """Survey a pair."""
        return self._submit(compare, job.first_view, job.second_view, self._options.scene.comparison)

    def build(self, job: BuildSurfaces) -> Future[Built]:
        """Settle poses and surfaces."""
        return self._submit(build, job.sights, job.thumbnails, job.evidence, self._options.scene)

    def close(self) -> None:
        """Let jobs under way end, and drop those that wait."""
        self._closed = True
        self._here.shutdown(wait=True, cancel_futures=True)
        self._pool.shutdown(wait=True, cancel_futures=True)

    def _submit(self, job: Callable[_P, _T], *args: _P.args, **kwargs: _P.kwargs) -> Future[_T]:
        with self._lock:
            try:
                return self._pool.submit(job, *args, **kwargs)
            except BrokenExecutor:
                log.warning("a worker died; starting others")
                self._pool.shutdown(wait=False)
                self._pool = _pool(self._options)
                return self._pool.submit(job, *args, **kwargs)
            except RuntimeError:
                if not self._closed:
                    raise
                # Nobody waits for this job any more.
                cancelled: Future[_T] = Future()
                cancelled.cancel()
                return cancelled


def _tell_failure(warming: Future[None]) -> None:
    if not warming.cancelled() and (failure := warming.exception()) is not None:
        log.warning("compiled code could not be loaded ahead; the first keyframes will wait for it", exc_info=failure)


def load() -> None:
    """Load all compiled code into this process, or compile what is not on disk yet: for who installs the station."""
    grouping_warming.warm_up()
    warm_up()


def extract(image: bytes, width: int, height: int) -> tuple[Features, bytes | None]:
    """The features of an encoded picture of this size, and its thumbnail. Raises DecodeError."""
    try:
        picture = cv2.imdecode(np.frombuffer(image, np.uint8), _AS_STORED)
    except cv2.error as error:
        raise DecodeError(BAD_IMAGE, "image", f"cannot be decoded: {error.err}") from error
    if picture is None:
        raise DecodeError(BAD_IMAGE, "image", "cannot be decoded")
    if picture.shape[:2] != (height, width):
        raise DecodeError(
            BAD_IMAGE, "image", f"{picture.shape[1]} x {picture.shape[0]} px, but the camera says {width} x {height}"
        )
    found = vision.extract(np.asarray(picture, np.uint8))
    thumbnail = vision.thumbnail(np.asarray(picture, np.uint8))
    return Features(found.kind.value, found.keypoints_px, found.descriptors), thumbnail


def build(
    sights: Sequence[Sight],
    thumbnails: Sequence[bytes | None],
    evidence: Mapping[tuple[int, int], Evidence],
    options: SceneOptions,
) -> Built:
    """Settle poses and surfaces of sights with their encoded thumbnails."""
    seen = [
        replace(sight, view=replace(sight.view, thumbnail=_grey(data))) if data else sight
        for sight, data in zip(sights, thumbnails, strict=True)
    ]
    settled, said = settle(seen, evidence, options)
    return tuple(settled), said


def _grey(data: bytes) -> NDArray[np.uint8] | None:
    """A thumbnail's picture (h, w); None if it is none, for a surface does without."""
    try:
        picture = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_GRAYSCALE | cv2.IMREAD_IGNORE_ORIENTATION)
    except cv2.error:
        return None
    return None if picture is None else np.asarray(picture, np.uint8)


def _pool(options: WorkersOptions) -> Executor:
    if options.kind == "threads":
        return ThreadPoolExecutor(options.count, "covista-worker", initializer=_use_one_core)
    return ProcessPoolExecutor(options.count, get_context("spawn"), initializer=_enter_process)


def _use_one_core() -> None:
    """The cores are shared out by the pool: OpenCV must not take them all for one job."""
    cv2.setNumThreads(1)


def _enter_process() -> None:
    """Leave Ctrl-C to the station, end with it even when it is killed, and be ready when the first job comes."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    _use_one_core()
    station = parent_process()
    if station is not None:
        threading.Thread(target=_follow, args=(station.join,), daemon=True).start()
    warm_up()


def _follow(wait: Callable[[], None]) -> None:
    wait()
    os._exit(1)

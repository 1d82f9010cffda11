"""The jobs that workers do, and how one crosses the border of a process."""

from __future__ import annotations

import os
import pickle
import sys
import threading
import time
import traceback
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import Any, Generic, TypeVar

import cv2
import numpy as np
from covista_schemas import features as vision
from covista_schemas.codec import BAD_IMAGE
from covista_schemas.errors import DecodeError
from numpy.typing import NDArray

from covista_service.grouping import warming as grouping_warming
from covista_service.loop import Built, Extraction
from covista_service.perception.camera import Features, View
from covista_service.perception.comparison import Comparison, ComparisonOptions, compare
from covista_service.perception.scene import Evidence, SceneOptions, Sight, settle
from covista_service.perception.warming import warm_up
from covista_service.station.events import BuildSurfaces, Keyframe, SurveyPair

# A robot that shot while tilted says so in its pose, not by an orientation tag in the file.
_AS_STORED = cv2.IMREAD_COLOR | cv2.IMREAD_IGNORE_ORIENTATION
_SHIPPED = Features("", np.zeros((0, 2), np.float32), np.zeros((0, 0), np.uint8))
_PROTOCOL = 5
_T = TypeVar("_T")
_T_co = TypeVar("_T_co", covariant=True)


@dataclass(frozen=True, slots=True, eq=False)
class Job(Generic[_T_co]):
    """`call(features, *arguments)`, where `features` are those of the keyframes that the job is about.

    They are most of a job's bytes and belong to many jobs, so that they travel on their own, once.
    """

    call: Callable[..., _T_co]
    arguments: tuple[Any, ...]
    features: tuple[Features, ...] = ()

    def here(self) -> _T_co:
        """Do it in this thread."""
        return self.call(self.features, *self.arguments)

    def packed(self) -> bytes:
        """What `perform` needs besides features. Raises what pickling raises."""
        return pickle.dumps((self.call, self.arguments), _PROTOCOL)


def timed(job: Job[_T]) -> Job[tuple[_T, float]]:
    """The same job, whose result comes with the seconds that it took."""
    return Job(_timed, (job.call, *job.arguments), job.features)


def perform(packed: bytes, features: Sequence[Features]) -> bytes:
    """Do a packed job, and pack its result or its error; `unpacked` gives the one or raises the other."""
    try:
        call, arguments = pickle.loads(packed)  # noqa: S301 - from our own station
        return pickle.dumps((call(tuple(features), *arguments), None), _PROTOCOL)
    except Exception as error:  # noqa: BLE001 - raised again where the job came from
        error.add_note("".join(traceback.format_exception(error)))
        try:
            return pickle.dumps((None, error), _PROTOCOL)
        except Exception:  # noqa: BLE001 - an error that cannot travel is told in words
            return pickle.dumps((None, RuntimeError(f"{type(error).__name__}: {error}")), _PROTOCOL)


def unpacked(said: bytes) -> Any:
    """The result of a job that was performed; raises its error."""
    result, error = pickle.loads(said)  # noqa: S301 - from our own workers
    if error is not None:
        raise error
    return result


def extraction_of(keyframe: Keyframe) -> Job[Extraction]:
    """Decode a keyframe's image and extract its features and a thumbnail. Raises ValueError where there is none."""
    if keyframe.image is None:
        raise ValueError("a keyframe without an image has nothing to extract from")
    return Job(_extract, (keyframe.image, keyframe.camera.width, keyframe.camera.height))


def survey_of(pair: SurveyPair, options: ComparisonOptions) -> Job[Comparison]:
    """Compare the images of a pair."""
    views = (pair.first_view, pair.second_view)
    return Job(_survey, (*map(_bare, views), options), tuple(view.features for view in views))


def building_of(surfaces: BuildSurfaces, options: SceneOptions) -> Job[Built]:
    """Settle poses and surfaces."""
    sights = tuple(replace(sight, view=_bare(sight.view)) for sight in surfaces.sights)
    arguments = (sights, surfaces.thumbnails, surfaces.evidence, options)
    return Job(_build, arguments, tuple(sight.view.features for sight in surfaces.sights))


def loading() -> Job[None]:
    """Be ready for all other jobs."""
    return Job(_load, ())


def load() -> None:
    """Load all compiled code into this process, or compile what is not on disk yet: for who installs the station."""
    grouping_warming.warm_up()
    warm_up()


# Of who works, against 0 of who answers: with both cores busy answers over REST come sooner, and work is not
# starved by a flood of messages (of 0, 5 and 10 both took least with 5).
_NICENESS = 5


def use_one_core() -> None:
    """The cores are shared out by the pool: OpenCV must not take them all for one job."""
    cv2.setNumThreads(1)


def begin_to_work() -> None:
    """What a thread of the station, or of a process beside it, does first: it works when nobody has to be answered.

    A lower priority of its own is something that only Linux gives to a thread.
    """
    use_one_core()
    if sys.platform == "linux":
        with suppress(OSError):
            os.setpriority(os.PRIO_PROCESS, threading.get_native_id(), _NICENESS)


def extract(image: bytes, width: int, height: int) -> Extraction:
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


def _timed(features: tuple[Features, ...], call: Callable[..., _T], *arguments: Any) -> tuple[_T, float]:
    begun_s = time.perf_counter()
    result = call(features, *arguments)
    return result, time.perf_counter() - begun_s


def _extract(_: tuple[Features, ...], image: bytes, width: int, height: int) -> Extraction:
    return extract(image, width, height)


def _survey(features: tuple[Features, ...], first: View, second: View, options: ComparisonOptions) -> Comparison:
    one, other = features
    return compare(replace(first, features=one), replace(second, features=other), options)


def _build(
    features: tuple[Features, ...],
    sights: Sequence[Sight],
    thumbnails: Sequence[bytes | None],
    evidence: Mapping[tuple[int, int], Evidence],
    options: SceneOptions,
) -> Built:
    whole = [
        replace(sight, view=replace(sight.view, features=own)) for sight, own in zip(sights, features, strict=True)
    ]
    return build(whole, thumbnails, evidence, options)


def _load(_: tuple[Features, ...]) -> None:
    use_one_core()
    load()


def _bare(view: View) -> View:
    """A view whose features travel on their own."""
    return replace(view, features=_SHIPPED)


def _grey(data: bytes) -> NDArray[np.uint8] | None:
    """A thumbnail's picture (h, w); None if it is none, for a surface does without."""
    try:
        picture = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_GRAYSCALE | cv2.IMREAD_IGNORE_ORIENTATION)
    except cv2.error:
        return None
    return None if picture is None else np.asarray(picture, np.uint8)

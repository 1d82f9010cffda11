"""Run methods over a set, with errors put on its poses, and say how good they are."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, fields, replace
from typing import Literal

import numpy as np
from covista_schemas import features
from covista_schemas.messages import FeatureKind
from numpy.typing import NDArray

from covista_service.evaluation import methods
from covista_service.evaluation.case import Answer, Case, Pair, Surveys
from covista_service.evaluation.datasets import Dataset, median_depth, picture
from covista_service.evaluation.files import DATASET, DatasetError
from covista_service.evaluation.metrics import Metrics, measure
from covista_service.evaluation.noise import NO_NOISE, PoseNoise, disturbed
from covista_service.perception.camera import Features, Floats, Pose, View
from covista_service.perception.comparators.image import Image
from covista_service.perception.survey import SurveyOptions

Input = Literal["images", "features", "features+thumbnails"]
_Extracted = tuple[Image, NDArray[np.uint8] | None]


@dataclass(frozen=True, slots=True)
class RunOptions:
    """What to run: method names of `methods.METHODS`, each over every seed."""

    methods: tuple[str, ...] = ("auto",)
    input: Input = "images"
    features: FeatureKind = FeatureKind.ROOTSIFT
    noise: PoseNoise = NO_NOISE
    seeds: int = 1


@dataclass(frozen=True, slots=True)
class Evaluation:
    """Answers of one method to one set under one seed, pair by pair, and what they are worth.

    `case` is the question that they answer.
    """

    dataset: str
    method: str
    input: Input
    pose_noise: PoseNoise
    seed: int
    pairs: tuple[tuple[str, str, Answer], ...]
    metrics: Metrics
    case: Case

    def as_json(self) -> dict[str, object]:
        """What `covista-station evaluate --format json` writes of it."""
        return {
            "dataset": self.dataset,
            "method": self.method,
            "input": self.input,
            "pose_noise": [self.pose_noise.deg, self.pose_noise.share],
            "seed": self.seed,
            "pairs": [{"a": a, "b": b, **_fields(answer)} for a, b, answer in self.pairs],
            "metrics": _fields(self.metrics),
        }


def evaluate(dataset: Dataset, options: RunOptions, advance: Callable[[], None] = lambda: None) -> Iterator[Evaluation]:
    """An evaluation for each seed and method; `advance` is called `steps` times on the way."""
    extracted = _extracted(dataset, options, advance)
    images = tuple(image for image, _ in extracted)
    for seed in range(options.seeds):
        poses = _poses(dataset, options.noise, np.random.default_rng(seed))
        views = _views(dataset, poses, extracted)
        surveys = Surveys(dataset.pairs, views, SurveyOptions(seed=seed), advance)
        case = Case(dataset.pairs, views, surveys, images)
        for name in options.methods:
            if not seed:
                methods.METHODS[name](_first(case))  # so that what is compiled on first use is not timed
            answers = methods.METHODS[name](case)
            advance()
            yield _evaluation(dataset, options, seed, name, answers, case)
        for _ in range(surveys.left):  # those that no method wanted
            advance()


def viewed(
    dataset: Dataset, options: RunOptions, advance: Callable[[], None] = lambda: None
) -> Iterator[tuple[PoseNoise, tuple[View, ...]]]:
    """The views of a set with poses as they are, then with each seed's errors; none of a set without cameras."""
    extracted = _extracted(dataset, options, advance)
    trials = [(NO_NOISE, 0)] + [(options.noise, seed) for seed in range(options.seeds) if not options.noise.is_none]
    for noise, seed in trials:
        views = _views(dataset, _poses(dataset, noise, np.random.default_rng(seed)), extracted)
        if views is not None:
            yield noise, views


def steps(dataset: Dataset, options: RunOptions) -> int:
    """How often `evaluate` calls `advance`: for an image, a pair surveyed or left alone, and a method that is done."""
    surveyed = len(dataset.pairs) if _has_cameras(dataset) else 0
    return len(dataset.frames) + options.seeds * (surveyed + len(options.methods))


def judge(truth: Floats, answers: dict[Pair, Answer]) -> Metrics:
    """Metrics of the answers over all ordered pairs with a defined truth, (n, n)."""
    rows = [
        (truth[i, j], overlap, *(interval or (None, None)))
        for (a, b), answer in answers.items()
        for i, j, overlap, interval in (
            (a, b, answer.overlap_a, answer.interval_a),
            (b, a, answer.overlap_b, answer.interval_b),
        )
        if np.isfinite(truth[i, j])
    ]
    actual, given, low, high = np.array(rows, np.float64).reshape(-1, 4).T
    return measure(actual, given, low, high, np.array([answer.ms for answer in answers.values()]))


def _evaluation(
    dataset: Dataset, options: RunOptions, seed: int, method: str, answers: dict[Pair, Answer], case: Case
) -> Evaluation:
    pairs = tuple((dataset.frames[a].id, dataset.frames[b].id, answers[a, b]) for a, b in dataset.pairs)
    metrics = judge(dataset.truth, answers)
    return Evaluation(dataset.name, method, options.input, options.noise, seed, pairs, metrics, case)


def _first(case: Case) -> Case:
    """The same question about the first pair alone."""
    pairs = case.pairs[:1]
    return replace(case, pairs=pairs, surveys=Surveys(pairs, case.views, SurveyOptions()))


def _has_cameras(dataset: Dataset) -> bool:
    return all(frame.camera is not None and frame.pose is not None for frame in dataset.frames)


def _extracted(dataset: Dataset, options: RunOptions, advance: Callable[[], None]) -> list[_Extracted]:
    """Features, and the small grey picture that a rover would send with them: from images it can always be made."""
    extracted: list[_Extracted] = []
    for frame in dataset.frames:
        image = picture(frame)
        found = features.extract(image, options.features)
        grey = None if options.input == "features" else _grey(features.thumbnail(image))
        known = Features(str(found.kind), found.keypoints_px, found.descriptors)
        extracted.append((Image(known, width=image.shape[1], height=image.shape[0]), grey))
        advance()
    return extracted


def _grey(jpeg: bytes) -> NDArray[np.uint8]:
    """A grey JPEG's picture (h, w): all its channels are alike."""
    return np.ascontiguousarray(features.decode_image(jpeg)[:, :, 0])


def _poses(dataset: Dataset, noise: PoseNoise, rng: np.random.Generator) -> list[Pose]:
    reported = [frame.pose for frame in dataset.frames if frame.pose is not None]
    if noise.is_none or not reported:
        return reported
    depth = median_depth(dataset)
    if depth is None:
        raise DatasetError(dataset.folder / DATASET, "depth", "pose noise is a share of the depth, and there is none")
    return [disturbed(pose, noise, depth, rng) for pose in reported]


def _views(dataset: Dataset, poses: Sequence[Pose], extracted: Sequence[_Extracted]) -> tuple[View, ...] | None:
    cameras = [frame.camera for frame in dataset.frames if frame.camera is not None]
    if not _has_cameras(dataset):
        return None
    return tuple(
        View(camera, pose, image.features, grey)
        for camera, pose, (image, grey) in zip(cameras, poses, extracted, strict=True)
    )


def _fields(record: Answer | Metrics) -> dict[str, object]:
    return {field.name: getattr(record, field.name) for field in fields(record)}

import builtins
import sys
from types import ModuleType

import cv2
import numpy as np
import pytest
from covista_schemas import features
from covista_schemas.errors import MissingExtraError
from covista_schemas.messages import Camera, FeatureKind, Features, check_inside
from numpy.typing import NDArray

Image = NDArray[np.uint8]
KINDS = pytest.mark.parametrize("kind", list(FeatureKind))


def rubble(width: int, height: int, seed: int = 0) -> Image:
    """Noise of several sizes, as stone has."""
    rng = np.random.default_rng(seed)
    layers = [cv2.GaussianBlur(rng.normal(size=(height, width)), (0, 0), sigma) * sigma for sigma in (1.5, 4, 10)]
    return cv2.normalize(sum(layers), None, 0, 255, cv2.NORM_MINMAX).astype(np.uint8)


def matched(one: Features, other: Features) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Points (n, 2) px of mutually nearest descriptors."""
    hamming = one.kind is FeatureKind.ORB
    matcher = cv2.BFMatcher(cv2.NORM_HAMMING if hamming else cv2.NORM_L2, crossCheck=True)
    prepared = [each.descriptors if hamming else each.descriptors.astype(np.float32) for each in (one, other)]
    found = matcher.match(*prepared)
    return one.keypoints_px[[m.queryIdx for m in found]], other.keypoints_px[[m.trainIdx for m in found]]


@KINDS
def test_the_same_picture_gives_the_same_features(kind: FeatureKind) -> None:
    image = rubble(320, 240)
    one, again = features.extract(image, kind), features.extract(cv2.cvtColor(image, cv2.COLOR_GRAY2BGR), kind)
    assert len(one) > 200
    np.testing.assert_array_equal(one.keypoints_px, again.keypoints_px)
    np.testing.assert_array_equal(one.descriptors, again.descriptors)


@KINDS
@pytest.mark.parametrize("size", [(320, 240), (640, 481), (1201, 900)])
def test_pixel_centres_are_at_integers(kind: FeatureKind, size: tuple[int, int]) -> None:
    """Turned by half a turn, what was at x is at W - 1 - x, at every scale that the detector looks at."""
    image = rubble(*size)
    points, turned = matched(
        features.extract(image, kind), features.extract(np.ascontiguousarray(image[::-1, ::-1]), kind)
    )
    off = (points + turned - (np.array(size) - 1)) / 2
    off = off[np.abs(off).max(axis=1) < 3]
    assert len(off) > 200
    # Pixels of the picture as extracted from are larger where it was shrunk.
    np.testing.assert_allclose(np.median(off, axis=0), 0, atol=0.01 * max(1, max(size) / features.MAX_SIDE_PX))
    assert np.mean(np.abs(off).max(axis=1) < 0.1) > 0.8


def test_descriptors_match_across_scales() -> None:
    """A picture and its double, which is shrunk before it is looked at: points are where they were."""
    image = rubble(640, 480)
    double = cv2.resize(image, (1280, 960), interpolation=cv2.INTER_CUBIC)
    one, other = features.extract(image), features.extract(double)
    points, doubled = matched(one, other)
    off = doubled - ((points + 0.5) * 2 - 0.5)
    agree = np.abs(off).max(axis=1) < 2
    assert agree.mean() > 0.7
    np.testing.assert_allclose(np.median(off[agree], axis=0), 0, atol=0.05)


@KINDS
def test_no_more_than_asked_for(kind: FeatureKind) -> None:
    image = rubble(320, 240)
    few, many = features.extract(image, kind, count=50), features.extract(image, kind, count=400)
    assert len(few) == 50
    assert len(many) <= 400
    check_inside(many.keypoints_px, Camera(fx=1, fy=1, cx=0, cy=0, width=320, height=240))


def widths(points: NDArray[np.float64], responses: NDArray[np.float64]) -> NDArray[np.float64]:
    """How far from each point the nearest clearly stronger one is, said plainly."""
    distances = np.hypot(*(points[:, None] - points).transpose(2, 0, 1))
    distances[0.9 * responses <= responses[:, None]] = np.inf
    return np.asarray(distances.min(axis=1))


def test_points_are_chosen_that_are_strongest_far_around() -> None:
    random = np.random.default_rng(0)
    points, responses = random.uniform(0, 640, (1300, 2)), random.random(1300)
    chosen = features.spread(points, responses, 200)
    expected = np.sort(widths(points, responses))[::-1][:200]
    assert len(set(chosen.tolist())) == 200
    np.testing.assert_allclose(np.sort(widths(points, responses)[chosen])[::-1], expected, rtol=1e-4)


def test_a_corner_full_of_texture_does_not_take_all() -> None:
    random = np.random.default_rng(0)
    points = np.concatenate((random.uniform(0, 60, (500, 2)), random.uniform(0, 640, (500, 2))))
    responses = np.concatenate((random.uniform(5, 10, 500), random.uniform(1, 2, 500)))
    assert (features.spread(points, responses, 300) >= 500).sum() > 150
    assert (np.argsort(-responses)[:300] >= 500).sum() == 0


def test_two_orientations_of_one_place_stay_together() -> None:
    places = np.random.default_rng(0).uniform(0, 640, (50, 2))
    responses = np.repeat(np.linspace(1, 2, 50), 2)
    chosen = features.spread(np.repeat(places, 2, axis=0), responses, 20)
    assert sorted(chosen // 2) == sorted(np.repeat(np.unique(chosen // 2), 2))


@KINDS
@pytest.mark.parametrize("size", [(240, 320), (1, 1), (2, 9), (15, 3000)])
def test_without_texture_there_is_nothing(kind: FeatureKind, size: tuple[int, int]) -> None:
    found = features.extract(np.full(size, 90, np.uint8), kind)
    assert len(found) == 0
    assert Features.from_arrays(kind, found.keypoints_px, found.descriptors) is not None


def test_rootsift_has_unit_length() -> None:
    length = np.linalg.norm(features.extract(rubble(320, 240)).descriptors / 512, axis=1)
    np.testing.assert_allclose(length, 1, atol=0.02)


def test_a_thumbnail_is_small_and_grey() -> None:
    data = features.thumbnail(cv2.cvtColor(rubble(640, 480), cv2.COLOR_GRAY2BGR))
    assert len(data) < 5000
    picture = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_UNCHANGED)
    assert picture is not None
    assert picture.shape == (72, 96)
    tiny = cv2.imdecode(np.frombuffer(features.thumbnail(rubble(40, 20)), np.uint8), cv2.IMREAD_UNCHANGED)
    assert tiny is not None
    assert tiny.shape == (20, 40)


@pytest.mark.parametrize(
    "wrong",
    [np.zeros((4, 4, 4), np.uint8), np.zeros((4, 4), np.float32), np.zeros(4, np.uint8), np.zeros((0, 4), np.uint8)],
)
def test_arrays_that_are_no_pictures_are_refused(wrong: Image) -> None:
    for use in (features.extract, features.thumbnail, features.encode_jpeg):
        with pytest.raises(ValueError, match=r"^image: shape"):
            use(wrong)


def test_pictures_are_decoded_as_the_sensor_took_them() -> None:
    image = cv2.cvtColor(rubble(64, 48), cv2.COLOR_GRAY2BGR)
    jpeg = features.encode_jpeg(image, 95)
    # Exif with orientation 6: a viewer would turn the picture.
    exif = b"Exif\0\0II*\0\x08\0\0\0\x01\0\x12\x01\x03\0\x01\0\0\0\x06\0\0\0\0\0\0\0"
    tagged = jpeg[:2] + b"\xff\xe1" + (len(exif) + 2).to_bytes(2, "big") + exif + jpeg[2:]
    assert features.decode_image(tagged).shape == (48, 64, 3)
    for bad in (b"", b"not a picture"):
        with pytest.raises(ValueError, match=r"^image: "):
            features.decode_image(bad)


def test_without_opencv_it_says_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    imported = builtins.__import__

    def without_opencv(name: str, *arguments: object) -> ModuleType:
        if name == "cv2":
            raise ImportError(name)
        return imported(name, *arguments)

    monkeypatch.delitem(sys.modules, "cv2")
    monkeypatch.setattr(builtins, "__import__", without_opencv)
    for call in (features.opencv, lambda: features.extract(np.zeros((9, 9), np.uint8))):
        with pytest.raises(MissingExtraError, match=r"covista\[vision\]"):
            call()

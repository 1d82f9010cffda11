import cv2
import numpy as np
import pytest
from covista_clients.rover import content
from covista_clients.rover.content import MAX_IMAGE_BYTES, Send, prepare
from covista_schemas import features
from covista_schemas.messages import Camera, Features

CAMERA = Camera(fx=60, fy=60, cx=31.5, cy=23.5, width=64, height=48)
PICTURE = np.random.default_rng(0).integers(0, 256, (48, 64, 3), np.uint8)
FEATURES = Features.from_arrays("orb", np.full((3, 2), 7.0), np.zeros((3, 32), np.uint8))


def test_an_array_becomes_a_picture_of_the_same_size() -> None:
    for array in (PICTURE, PICTURE[:, :, 0]):
        made = prepare(array, CAMERA, Send.IMAGE)()
        assert made.image is not None
        assert features.decode_image(made.image).shape == (48, 64, 3)


def test_the_caller_may_use_the_array_again() -> None:
    array = np.full((48, 64), 200, np.uint8)
    work = prepare(array, CAMERA, Send.IMAGE)
    array[:] = 0
    image = work().image
    assert image is not None
    assert features.decode_image(image).mean() > 190


@pytest.mark.parametrize("suffix", [".jpg", ".png", ".webp"])
def test_encoded_bytes_pass_through(suffix: str) -> None:
    data = bytes(cv2.imencode(suffix, PICTURE)[1])
    assert prepare(data, CAMERA, Send.IMAGE)().image == data
    made = prepare(data, CAMERA, Send.FEATURES)()
    assert made.image is None
    assert made.features is not None


def test_features_pass_through_however_pictures_go() -> None:
    thumbnail = features.thumbnail(PICTURE)
    for send in Send:
        made = prepare(FEATURES, CAMERA, send, thumbnail)()
        assert made.image is None
        assert made.features is not None
        np.testing.assert_array_equal(made.features.descriptors, FEATURES.descriptors)
        assert made.thumbnail == thumbnail


def test_a_thumbnail_is_made_where_asked_for() -> None:
    assert prepare(PICTURE, CAMERA, Send.FEATURES)().thumbnail is None
    assert prepare(PICTURE, CAMERA, Send.FEATURES_AND_THUMBNAIL)().thumbnail == features.thumbnail(PICTURE)


def test_a_large_picture_is_made_to_fit_into_a_message(monkeypatch: pytest.MonkeyPatch) -> None:
    best, poor = (len(features.encode_jpeg(PICTURE, quality)) for quality in (85, 30))
    monkeypatch.setattr(content, "MAX_IMAGE_BYTES", poor)
    made = prepare(PICTURE, CAMERA, Send.IMAGE)()
    assert made.image is not None
    assert len(made.image) <= poor < best
    monkeypatch.setattr(content, "MAX_IMAGE_BYTES", 100)
    with pytest.raises(ValueError, match=r"^image: \d+ bytes"):
        prepare(PICTURE, CAMERA, Send.IMAGE)()


WRONG = [
    (PICTURE[:40], None, "image"),
    (PICTURE.astype(np.float32), None, "image"),
    (np.zeros((48, 64, 4), np.uint8), None, "image"),
    (b"GIF89a", None, "image"),
    (b"", None, "image"),
    (b"\xff\xd8\xff" + bytes(MAX_IMAGE_BYTES), None, "image"),
    ("picture.jpg", None, "image"),
    (PICTURE, b"\xff\xd8\xff", "thumbnail"),
    (FEATURES, b"not a picture", "thumbnail"),
    (FEATURES, b"\xff\xd8\xff" + bytes(70_000), "thumbnail"),
    (Features.from_arrays("orb", np.full((1, 2), 64.0), np.zeros((1, 32), np.uint8)), None, "keypoints"),
    (Features("orb", np.zeros((2, 2)), np.zeros((1, 32))), None, "descriptors"),
]


@pytest.mark.parametrize(("image", "thumbnail", "named"), WRONG)
def test_what_does_not_fit_is_named_at_once(image: object, thumbnail: bytes | None, named: str) -> None:
    with pytest.raises(ValueError, match=f"^{named}: "):
        prepare(image, CAMERA, Send.IMAGE, thumbnail)


def test_an_encoded_picture_of_another_size_is_refused_when_it_is_opened() -> None:
    work = prepare(features.encode_jpeg(PICTURE[:40]), CAMERA, Send.FEATURES)
    with pytest.raises(ValueError, match=r"^image: shape \(40, 64, 3\)"):
        work()

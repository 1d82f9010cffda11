import time

import cv2
import numpy as np
import pytest
from covista_schemas import features
from covista_schemas.codec import BAD_IMAGE, IMAGE_TOO_LARGE
from covista_schemas.errors import DecodeError
from covista_service.link.pictures import check_image, check_thumbnail, measure

from tests.service.wall import picture


def encoded(extension: str) -> bytes:
    return cv2.imencode(extension, picture())[1].tobytes()


FORMATS = [".jpg", ".png", ".webp"]


def code_of(data: bytes, width: int = 320, height: int = 240) -> str:
    with pytest.raises(DecodeError) as caught:
        check_image(data, width, height)
    return caught.value.code


@pytest.mark.parametrize("extension", FORMATS)
def test_a_whole_picture_passes(extension: str) -> None:
    check_image(encoded(extension), 320, 240)


@pytest.mark.parametrize("extension", FORMATS)
@pytest.mark.parametrize("share", [0.02, 0.5, 0.99])
def test_a_truncated_picture_is_refused(extension: str, share: float) -> None:
    data = encoded(extension)
    assert code_of(data[: int(share * len(data))]) == BAD_IMAGE


@pytest.mark.parametrize("extension", FORMATS)
def test_a_picture_of_another_size_than_the_camera_s_is_refused(extension: str) -> None:
    assert code_of(encoded(extension), 640, 480) == BAD_IMAGE


@pytest.mark.parametrize(
    "data",
    [b"", b"hello", b"\xff\xd8\xff", b"\x89PNG\r\n\x1a\n", b"RIFF\x00\x00\x00\x00WEBP", b"<svg/>", b"GIF89a\x01\x00"],
)
def test_what_is_not_a_picture_is_refused(data: bytes) -> None:
    assert code_of(data) == BAD_IMAGE


def claiming(width: int, height: int) -> bytes:
    """A small PNG whose head claims another size."""
    data = bytearray(encoded(".png"))
    data[16:24] = width.to_bytes(4) + height.to_bytes(4)
    return bytes(data)


@pytest.mark.parametrize("size", [(10_000, 5_001), (65_535, 65_535), (2**31 - 1, 2**31 - 1)])
def test_a_head_that_claims_more_than_50_megapixels_is_refused_by_itself(size: tuple[int, int]) -> None:
    assert code_of(claiming(*size), *size) == IMAGE_TOO_LARGE


def test_50_megapixels_are_allowed() -> None:
    assert measure(claiming(10_000, 5_000), "image", 50_000_000) == (10_000, 5_000)


def test_a_size_of_zero_is_refused() -> None:
    assert code_of(claiming(0, 240), 0, 240) == BAD_IMAGE


def test_a_camera_s_preview_inside_a_jpeg_does_not_pass_for_its_end() -> None:
    small = features.thumbnail(picture())
    segment = b"\xff\xe1" + (len(small) + 2).to_bytes(2) + small
    whole = encoded(".jpg")
    data = whole[:2] + segment + whole[2:]
    check_image(data, 320, 240)
    assert code_of(data[:-400]) == BAD_IMAGE


@pytest.mark.parametrize("junk", [b"\xff", b"\xff\xe0\x00\x02", b"\xff\xd0", b"\xff\xe0\x00\x02\x00"])
def test_a_head_that_does_not_end_is_refused_before_it_costs_time(junk: bytes) -> None:
    whole = encoded(".jpg")
    data = whole[:2] + junk * (3_000_000 // len(junk)) + whole[2:]
    began_s = time.process_time()
    assert code_of(data) == BAD_IMAGE
    assert time.process_time() - began_s < 0.2


def test_fillers_between_the_segments_of_a_jpeg_are_passed_over() -> None:
    whole = encoded(".jpg")
    check_image(whole[:2] + b"\xff\xff" + whole[2:], 320, 240)


def test_an_orientation_tag_does_not_turn_the_picture() -> None:
    exif = (
        b"Exif\x00\x00MM\x00*\x00\x00\x00\x08\x00\x01\x01\x12\x00\x03\x00\x00\x00\x01\x00\x06\x00\x00\x00\x00\x00\x00"
    )
    whole = encoded(".jpg")
    check_image(whole[:2] + b"\xff\xe1" + (len(exif) + 2).to_bytes(2) + exif + whole[2:], 320, 240)


def test_thumbnails_are_small_whole_pictures() -> None:
    check_thumbnail(features.thumbnail(picture()))
    for bad in (b"x", features.thumbnail(picture())[:200], claiming(2000, 1000)):
        with pytest.raises(DecodeError, match="thumbnail"):
            check_thumbnail(bad)


@pytest.mark.parametrize("extension", FORMATS)
def test_damaged_heads_are_refused_or_read_but_never_worse(extension: str) -> None:
    data, random = encoded(extension), np.random.default_rng(0)
    for _ in range(500):
        damaged = bytearray(data[: random.integers(8, 700)])
        for at in random.integers(0, len(damaged), 3):
            damaged[at] = random.integers(256)
        with pytest.raises(DecodeError):
            check_image(bytes(damaged), 320, 240)

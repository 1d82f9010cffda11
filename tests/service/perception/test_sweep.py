import cv2
import numpy as np
import pytest
from covista_service.perception.camera import Camera
from covista_service.perception.confirmation import confirmed
from covista_service.perception.sweep import Beside, Glimpse, glimpse, likeness, transfer

from tests.service.perception.scenes import CAMERA

MATRIX = np.array([[96.0, 0, 47.5], [0, 96.0, 35.5], [0, 0, 1]])
PLANES = np.linspace(0.1, 0.5, 17)
TRUE = 8
SHIFT_PX = 4


def pictures() -> tuple[Glimpse, Beside]:
    """A wall parallel to both images at the inverse depth PLANES[TRUE], so seen SHIFT_PX apart."""
    noise = np.random.default_rng(0).normal(size=(72, 120)).astype(np.float32)
    grey = 128 + 150 * cv2.GaussianBlur(noise, (0, 0), 1.5)
    beside = np.array([-SHIFT_PX / 96 / PLANES[TRUE], 0, 0])
    one, other = (np.ascontiguousarray(grey[:, x : x + 96]) for x in (0, SHIFT_PX))
    return Glimpse(one, MATRIX), Beside(Glimpse(other, MATRIX), np.eye(3), beside)


def test_the_true_plane_is_the_most_alike() -> None:
    first, other = pictures()
    alike = likeness(first, [other], PLANES, noise=1.0)
    assert alike.shape == (17, 72, 96)
    assert (alike.argmax(axis=0)[:, 10:-10] == TRUE).mean() > 0.99
    assert alike[TRUE, :, 10:-10].min() > 0.8
    assert np.median(alike[TRUE, :, 10:-10]) > 0.98
    assert np.abs(alike).max() < 1 + 1e-5


def test_what_nobody_sees_says_nothing() -> None:
    first, other = pictures()
    alike = likeness(first, [other, other], PLANES, noise=1.0)
    assert (alike[TRUE, :, : SHIFT_PX - 1] == 0).all()
    behind = Beside(other.glimpse, np.diag([-1.0, 1.0, -1.0]), np.zeros(3))
    assert (likeness(first, [behind], PLANES, noise=1.0) == 0).all()


def test_one_that_sees_nothing_changes_nothing() -> None:
    first, other = pictures()
    behind = Beside(other.glimpse, np.diag([-1.0, 1.0, -1.0]), np.zeros(3))
    alone, both = (likeness(first, others, PLANES, noise=1.0) for others in ([other], [behind, other]))
    assert (alone == both).all()


def test_two_of_three_are_enough() -> None:
    first, other = pictures()
    hidden = Beside(Glimpse(other.glimpse.grey[::-1].copy(), MATRIX), other.rotation, other.translation)
    alike = likeness(first, [other, hidden, other], PLANES, noise=1.0)
    assert np.median(alike[TRUE, :, 10:-10]) > 0.98


def test_brightness_and_contrast_do_not_matter() -> None:
    first, other = pictures()
    darker = Beside(Glimpse(other.glimpse.grey * np.float32(0.5) + 10, MATRIX), other.rotation, other.translation)
    one, two = (likeness(first, [each], PLANES, noise=0.1) for each in (other, darker))
    assert one == pytest.approx(two, abs=0.02)


def test_without_texture_nothing_is_alike() -> None:
    first, other = pictures()
    flat = Beside(Glimpse(np.full((72, 96), 255, np.float32), MATRIX), other.rotation, other.translation)
    assert np.abs(likeness(first, [flat], PLANES, noise=2.0)).max() < 0.05


def test_images_may_have_other_sizes() -> None:
    first, other = pictures()
    half = np.diag([0.5, 0.5, 1.0]) @ MATRIX + np.array([[0, 0, -0.25], [0, 0, -0.25], [0, 0, 0]])
    small = cv2.resize(other.glimpse.grey, (48, 36), interpolation=cv2.INTER_AREA)
    alike = likeness(first, [Beside(Glimpse(small, half), other.rotation, other.translation)], PLANES, noise=1.0)
    assert (np.abs(alike.argmax(axis=0)[:, 10:-10] - TRUE) <= 1).mean() > 0.9


def test_a_glimpse_spans_the_same_view() -> None:
    matrix = glimpse(np.zeros((72, 96), np.uint8), CAMERA).matrix
    for corner, small in (((-0.5, -0.5), (-0.5, -0.5)), ((639.5, 479.5), (95.5, 71.5))):
        ray = CAMERA.rays_from_pixels @ (*corner, 1)
        assert (matrix @ ray)[:2] == pytest.approx(small)


@pytest.mark.parametrize(("model", "count"), [("plumb_bob", 5), ("equidistant", 4)])
def test_distortion_is_taken_out(model: str, count: int) -> None:
    picture = cv2.GaussianBlur(np.random.default_rng(0).integers(0, 256, (72, 96), np.uint8), (0, 0), 2)
    plain = glimpse(picture, CAMERA)
    straight = glimpse(picture, Camera(CAMERA.matrix, 640, 480, "plumb_bob", (0.0,) * 5))
    bent = glimpse(picture, Camera(CAMERA.matrix, 640, 480, model, (0.2,) + (0.0,) * (count - 1)))  # type: ignore[arg-type]
    assert straight.grey == pytest.approx(plain.grey, abs=0.5)
    centre = np.s_[33:39, 45:51]
    assert bent.grey[centre] == pytest.approx(plain.grey[centre], abs=3)
    assert np.abs(bent.grey - plain.grey)[:8, :8].max() > 5


def test_a_depth_is_confirmed_by_the_same_depth_alone() -> None:
    first, other = pictures()
    rho = np.full((72, 96), PLANES[TRUE])
    assert confirmed(first, other, rho, rho, 0.05, 0.0)[:, SHIFT_PX:].all()
    assert not confirmed(first, other, rho, rho, 0.05, 0.0)[:, : SHIFT_PX - 1].any()
    assert not confirmed(first, other, rho, 1.1 * rho, 0.05, 0.0).any()
    assert not confirmed(first, other, rho, 0.9 * rho, 0.05, 0.0).any()
    assert confirmed(first, other, rho, 1.1 * rho, 0.05, 0.1)[:, SHIFT_PX:].all()


def test_what_is_behind_is_not_confirmed() -> None:
    first, other = pictures()
    behind = Beside(other.glimpse, np.diag([-1.0, 1.0, -1.0]), np.zeros(3))
    rho = np.full((72, 96), PLANES[TRUE])
    assert not confirmed(first, behind, rho, rho, 0.05, 1.0).any()


def test_a_pixel_goes_where_its_point_is() -> None:
    first, other = pictures()
    moved = transfer(first, other) @ (50, 30, 1, PLANES[TRUE])
    assert moved[:2] / moved[2] == pytest.approx((50 - SHIFT_PX, 30))

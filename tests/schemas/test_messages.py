import numpy as np
import pytest
from covista_schemas.messages import (
    MAX_FEATURES,
    Camera,
    Distortion,
    Features,
    Keyframe,
    Pose,
    quantise_rootsift,
)
from pydantic import ValidationError


def test_a_pose_takes_numbers_of_any_kind() -> None:
    pose = Pose(np.arange(3.0), [0, 0, 0, 1], np.int64(5), np.eye(6).ravel())
    assert pose.position_m == (0.0, 1.0, 2.0)
    assert pose == Pose((0, 1, 2), (0, 0, 0, 1), 5, tuple(np.eye(6).ravel()))
    assert hash(pose) == hash(Pose((0, 1, 2), (0, 0, 0, 1), 5, tuple(np.eye(6).ravel())))


@pytest.mark.parametrize(
    ("wrong", "named"),
    [
        ({"position_m": (1.0, 2.0)}, "position_m"),
        ({"position_m": (1.0, 2.0, float("nan"))}, "position_m"),
        ({"position_m": ("x", 0, 0)}, "position_m"),
        ({"position_m": (None, 0, 0)}, "position_m"),
        ({"position_m": (1e200, 0, 0)}, "position_m"),
        ({"orientation_xyzw": (0.0, 0.0, 0.0)}, "orientation_xyzw"),
        ({"orientation_xyzw": (0.0, 0.0, 0.0, 0.0)}, "orientation_xyzw"),
        ({"orientation_xyzw": (1.0, 1.0, 0.0, 0.0)}, "orientation_xyzw"),
        ({"covariance": (1.0,)}, "covariance"),
        ({"time_ns": 2**63}, "time_ns"),
        ({"time_ns": 1.5}, "time_ns"),
    ],
)
def test_a_wrong_pose_says_what_is_wrong(wrong: dict[str, object], named: str) -> None:
    with pytest.raises(ValueError, match=f"^{named}: "):
        Pose(**{"position_m": (0.0, 0.0, 0.0)} | wrong)


def test_features_are_checked_at_the_door() -> None:
    points, descriptors = np.zeros((2, 2)), np.zeros((2, 32), np.uint8)
    assert len(Features.from_arrays("orb", points, descriptors)) == 2
    wrong = [
        ("kind", ("surf", points, descriptors)),
        ("keypoints", ("orb", np.zeros((2, 3)), descriptors)),
        ("keypoints", ("orb", np.full((2, 2), np.inf), descriptors)),
        ("keypoints", ("orb", np.zeros((MAX_FEATURES + 1, 2)), np.zeros((MAX_FEATURES + 1, 32), np.uint8))),
        ("descriptors", ("orb", points, np.zeros((3, 32), np.uint8))),
        ("descriptors", ("orb", points, np.zeros((2, 32), np.float32))),
        ("descriptors", ("rootsift", points, np.full((2, 128), np.nan))),
    ]
    for named, arguments in wrong:
        with pytest.raises(ValueError, match=f"^{named}: "):
            Features.from_arrays(*arguments)


def test_rootsift_is_quantised_to_half_a_step() -> None:
    values = np.random.default_rng(1).uniform(0, 255 / 512, (10, 128))
    np.testing.assert_allclose(quantise_rootsift(values) / 512, values, atol=0.5 / 512 + 1e-6)
    assert quantise_rootsift(np.array([[2.0, -1.0]])).tolist() == [[255, 0]]


def test_a_keyframe_carries_one_thing() -> None:
    camera = Camera(fx=1, fy=1, cx=0, cy=0, width=1, height=1)
    features = Features.from_arrays("orb", np.zeros((0, 2)), np.zeros((0, 32), np.uint8))
    for content in ({}, {"image": b"x", "features": features}):
        with pytest.raises(ValueError, match="either an image or features"):
            Keyframe("r1", "b", 0, camera, Pose((0, 0, 0)), **content)


def test_distortion_counts_its_coefficients() -> None:
    assert Distortion(model="plumb_bob", coefficients=(0.1, 0, 0, 0, 0))
    for model, count in (("none", 1), ("plumb_bob", 3), ("equidistant", 5)):
        with pytest.raises(ValidationError, match="coefficients"):
            Distortion(model=model, coefficients=(0.0,) * count)

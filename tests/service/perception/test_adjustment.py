from dataclasses import replace

import numpy as np
import pytest
from covista_service.perception.adjustment import AdjustmentOptions, Link, Sighted, adjust, to_adjust, tracks
from covista_service.perception.camera import Pose, relative
from scipy.spatial.transform import Rotation

from tests.service.perception.swarms import points_on_wall, side_by_side, views

OPTIONS = AdjustmentOptions()
TRUE = side_by_side(4, step_m=0.8)
VIEWS = views(points_on_wall(), TRUE)


def matches(i: int, j: int) -> np.ndarray:
    """Indices of the same points, told by their descriptors."""
    of_second = {one.tobytes(): k for k, one in enumerate(VIEWS[j].features.descriptors)}
    shared = [(k, of_second.get(one.tobytes())) for k, one in enumerate(VIEWS[i].features.descriptors)]
    return np.array([(k, other) for k, other in shared if other is not None], np.int64)


def keyframes(reported: list[Pose]) -> list[Sighted]:
    points = [view.features.keypoints_px.astype(np.float64) for view in VIEWS]
    return [Sighted(view.camera, pose, px, 6.0) for view, pose, px in zip(VIEWS, reported, points, strict=True)]


def links(contradicts: bool) -> dict[tuple[int, int], Link]:
    return {
        (i, j): Link(matches(i, j), *relative(TRUE[i], TRUE[j]), contradicts)
        for i in range(4)
        for j in range(i + 1, 4)
        if j - i < 3
    }


def disturbed(seed: int) -> list[Pose]:
    random = np.random.default_rng(seed)
    turns = Rotation.from_rotvec(random.normal(0, np.radians(2), (4, 3))).as_matrix()
    shifts = random.normal(0, 0.1, (4, 3))
    return [
        Pose(turned @ pose.world_from_camera, pose.centre_m + shift)
        for pose, turned, shift in zip(TRUE, turns, shifts, strict=True)
    ]


def worst_turn_deg(poses: list[Pose]) -> float:
    """How far relative rotations are off at most."""
    gaps = [
        Rotation.from_matrix(relative(poses[0], poses[k])[0] @ relative(TRUE[0], TRUE[k])[0].T).magnitude()
        for k in range(1, 4)
    ]
    return float(np.degrees(max(gaps)))


def test_poses_that_nobody_contradicts_stay_as_reported() -> None:
    reported = disturbed(0)
    assert adjust(keyframes(reported), links(contradicts=False), OPTIONS) == reported


def test_without_links_nothing_moves() -> None:
    reported = disturbed(0)
    assert adjust(keyframes(reported), {}, OPTIONS) == reported


@pytest.mark.parametrize("seed", range(4))
def test_contradicted_poses_come_to_agree_with_the_images(seed: int) -> None:
    reported = disturbed(seed)
    adjusted = adjust(keyframes(reported), links(contradicts=True), OPTIONS)
    assert worst_turn_deg(reported) > 1
    assert worst_turn_deg(adjusted) < 0.1
    lengths = [np.linalg.norm(adjusted[k].centre_m - adjusted[0].centre_m) for k in range(1, 4)]
    true = [np.linalg.norm(TRUE[k].centre_m - TRUE[0].centre_m) for k in range(1, 4)]
    # The images tell all lengths but one: their scale is as good as what was reported.
    assert np.array(lengths) / lengths[0] == pytest.approx(np.array(true) / true[0], rel=0.02)


def test_a_baseline_reported_backwards_is_turned_round() -> None:
    reported = [Pose(pose.world_from_camera, -pose.centre_m) for pose in TRUE]
    adjusted = adjust(keyframes(reported), links(contradicts=True), OPTIONS)
    towards = adjusted[3].centre_m - adjusted[0].centre_m
    true = TRUE[3].centre_m - TRUE[0].centre_m
    assert towards @ true > 0.9 * np.linalg.norm(towards) * np.linalg.norm(true)


def test_a_chain_that_comes_to_a_keyframe_twice_is_no_track() -> None:
    one, other = np.array([[0, 0], [1, 1]], np.int64), np.array([[0, 0], [1, 5]], np.int64)
    found = tracks(
        keyframes(TRUE),
        {
            (0, 1): Link(one, np.eye(3), np.ones(3), False),
            (1, 2): Link(other, np.eye(3), np.ones(3), False),
            (0, 2): Link(np.array([[7, 5]], np.int64), np.eye(3), np.ones(3), False),
        },
    )
    # Point 0 is seen by three keyframes; the chain 0:1 - 1:1 - 2:5 - 0:7 comes to keyframe 0 twice.
    assert found.starts.tolist() == [0, 3]
    assert found.keyframes.tolist() == [0, 1, 2]


def test_who_is_borne_out_gives_way_to_its_like_only() -> None:
    reported = keyframes(TRUE)
    link = Link(matches(0, 1), *relative(TRUE[0], TRUE[1]), True)
    firm = [replace(one, firm=k in (0, 2)) for k, one in enumerate(reported)]
    assert to_adjust(reported, {(0, 1): link}).tolist() == [True, True, False, False]
    assert to_adjust(firm, {(0, 1): link}).tolist() == [False, True, False, False]
    assert to_adjust(firm, {(0, 2): link}).tolist() == [True, False, True, False]
    held = [replace(one, held=k == 1) for k, one in enumerate(firm)]
    assert to_adjust(held, {(0, 1): link}).tolist() == [False, False, False, False]

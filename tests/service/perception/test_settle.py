"""What becomes of keyframes that news has come for: the open ones are settled, the others only lend."""

import numpy as np
import pytest
from covista_service.perception.agreement import Observations
from covista_service.perception.camera import Pose
from covista_service.perception.comparison import ComparisonOptions, Outcome, compare
from covista_service.perception.scene import Evidence, SceneOptions, Settled, Sight, settle
from covista_service.perception.surface import flat
from covista_service.perception.warp import Carried

from tests.service.perception.scenes import turn
from tests.service.perception.swarms import moved, points_on_wall, side_by_side, views

OPTIONS = SceneOptions()
POSES = side_by_side(4)
SEEN = views(points_on_wall(600), POSES, noise_px=0.3)
OFF = Pose(POSES[3].world_from_camera @ turn(0, 0.06, 0), POSES[3].centre_m + np.array([0, 0.2, 0]))


def evidence(*pairs: tuple[int, int], seen=SEEN) -> dict[tuple[int, int], Evidence]:
    return {(i, j): Evidence.of(compare(seen[i], seen[j], ComparisonOptions())) for i, j in pairs}


def sights(seen=SEEN, lending: tuple[int, ...] = ()) -> list[Sight]:
    return [Sight(view, view.pose, k not in lending, (), flat(1 / 6)) for k, view in enumerate(seen)]


def turned_deg(one: Settled, pose: Pose) -> float:
    chord = np.linalg.norm(one.pose.world_from_camera - pose.world_from_camera)
    return float(np.degrees(2 * np.arcsin(chord / np.sqrt(8))))


def test_only_the_open_one_is_corrected_and_others_stay() -> None:
    wrong = [*SEEN[:3], moved(SEEN[3], OFF)]
    settled, said = settle(sights(wrong, lending=(0, 1, 2)), evidence((0, 3), (1, 3), (2, 3), seen=wrong), OPTIONS)
    assert [one.pose for one in settled[:3]] == POSES[:3]
    assert turned_deg(settled[3], OFF) > 3
    assert turned_deg(settled[3], POSES[3]) < 0.2
    assert np.linalg.norm(settled[3].pose.centre_m - POSES[3].centre_m) < 0.15
    assert all(one.link is not None and not one.link.contradicts for one in said.values())


def test_what_was_observed_under_the_same_poses_is_not_observed_again() -> None:
    _, said = settle(sights(), evidence((0, 1), (1, 2)), OPTIONS)
    _, again = settle(sights(), said, OPTIONS)
    assert [again[pair] is said[pair] for pair in said] == [True, True]
    shifted = [*SEEN[:2], moved(SEEN[2], OFF), SEEN[3]]
    _, anew = settle(sights(shifted), said, OPTIONS)
    assert anew[0, 1] is said[0, 1]
    assert anew[1, 2] is not said[1, 2]


def test_pair_after_pair_comes_to_what_all_pairs_at_once_do() -> None:
    pairs = ((0, 1), (0, 2), (1, 2))
    at_once, _ = settle(sights(), evidence(*pairs), OPTIONS)
    said: dict[tuple[int, int], Evidence] = {}
    for pair in pairs:
        in_turn, said = settle(sights(), {**said, **evidence(pair)}, OPTIONS)
    for k in range(3):
        one, other = in_turn[k].surface, at_once[k].surface
        assert one is not None
        assert other is not None
        np.testing.assert_allclose(one.inverse_depth, other.inverse_depth, rtol=1e-12)


def test_a_lender_keeps_its_surface_and_one_without_points_its_former() -> None:
    mine = flat(0.1)
    lender = Sight(SEEN[0], POSES[0], False, (), mine)
    lonely = Sight(SEEN[3], POSES[3], True, (), mine)
    settled, _ = settle([lender, Sight(SEEN[1], POSES[1]), lonely], evidence((0, 1)), OPTIONS)
    assert settled[0].surface is mine
    assert settled[1].surface is not None
    assert np.median(settled[1].surface.inverse_depth) == pytest.approx(1 / 6, rel=0.05)
    assert settled[2].surface is mine


def test_depths_from_keyframes_that_are_gone_count_as_well() -> None:
    _, said = settle(sights(), evidence((0, 1), (1, 2)), OPTIONS)
    beside = tuple(one.observed[pair.index(1)] for pair, one in said.items() if one.observed is not None)
    (alone,), _ = settle([Sight(SEEN[1], POSES[1], True, beside)], {}, OPTIONS)
    together, _ = settle(sights(), said, OPTIONS)
    np.testing.assert_array_equal(alone.points.inverse_depths, together[1].points.inverse_depths)


def test_outcomes_have_names() -> None:
    assert compare(SEEN[0], SEEN[1], ComparisonOptions()).outcome is Outcome.MEASURED
    assert compare(SEEN[0], SEEN[1], ComparisonOptions(min_matches=10_000)).outcome is Outcome.FEW_MATCHES


def test_few_wrong_points_do_not_undo_what_was_seen_before() -> None:
    """Some points of one pair that put a wall of six metres at twenty speak against all that was known."""
    random = np.random.default_rng(2)
    chosen = random.choice(len(SEEN[1].features.keypoints_px), 20, replace=False)
    wrong = Observations(chosen, np.full(20, 1 / 20), np.full(20, 1e-3), np.ones(20, np.bool_))
    (right,), _ = settle([Sight(SEEN[1], POSES[1], True, tuple(both_of(1)))], {}, OPTIONS)
    assert right.surface is not None
    before = Carried(right.surface, SEEN[1].camera, np.eye(3), np.zeros(3))
    (alone,), _ = settle([Sight(SEEN[1], POSES[1], True, (wrong,))], {}, OPTIONS)
    (held,), _ = settle([Sight(SEEN[1], POSES[1], True, (wrong,), None, before)], {}, OPTIONS)
    assert alone.surface is not None
    assert np.median(1 / alone.surface.inverse_depth) > 15
    assert held.surface is not None
    np.testing.assert_allclose(held.surface.inverse_depth, right.surface.inverse_depth, rtol=0.1)


def test_what_many_points_tell_anew_counts_more_than_what_was_before() -> None:
    before = Carried(flat(1 / 3), SEEN[1].camera, np.eye(3), np.zeros(3))
    settled, _ = settle(
        [Sight(SEEN[0], POSES[0]), Sight(SEEN[1], POSES[1], True, (), None, before), Sight(SEEN[2], POSES[2])],
        evidence((0, 1), (1, 2)),
        OPTIONS,
    )
    without, _ = settle([Sight(view, view.pose) for view in SEEN[:3]], evidence((0, 1), (1, 2)), OPTIONS)
    one, other = settled[1].surface, without[1].surface
    assert one is not None
    assert other is not None
    assert np.median(np.abs(one.inverse_depth / other.inverse_depth - 1)) < 0.02


def both_of(k: int) -> list[Observations]:
    """Depths that its neighbours give keyframe `k`."""
    _, said = settle(sights(), evidence((k - 1, k), (k, k + 1)), OPTIONS)
    return [one.observed[pair.index(k)] for pair, one in said.items() if one.observed is not None]

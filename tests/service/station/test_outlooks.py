"""Who bears out whom, and which depths have one scale."""

from collections.abc import Sequence

import numpy as np
import pytest
from covista_service.perception.adjustment import AdjustmentOptions
from covista_service.perception.camera import Pose
from covista_service.perception.scales import parts_of, ratio_range, scale_sigmas
from covista_service.perception.surface import flat
from covista_service.perception.visibility import SAME_SCALE, VisibilityOptions
from covista_service.station.agreements import Agreements
from covista_service.station.events import KeyframeId
from covista_service.station.outlook import Outlook
from covista_service.station.scales import NEAREST, Scales

from tests.service.station.scenes import Scene, pose


def agreements(agree: str = "", contradict: str = "") -> Agreements:
    found = Agreements()
    for pairs, said in ((agree, True), (contradict, False)):
        for one, other in pairs.split():
            found.note(KeyframeId(one, "b", 0), KeyframeId(other, "b", 0), agree=said)
    return found


@pytest.mark.parametrize(
    ("agree", "contradict", "borne_out"),
    [
        ("", "", ""),
        ("ab", "", "ab"),
        ("ab bc", "ad bd", "abc"),
        ("ab", "ac", "ab"),
        # One word against another: nobody can say who is wrong.
        ("", "ab", ""),
        ("ab cd", "ac", ""),
    ],
)
def test_the_largest_set_that_agrees_is_borne_out(agree: str, contradict: str, borne_out: str) -> None:
    assert agreements(agree, contradict).borne_out("abcd", lambda name: True) == set(borne_out)


def test_what_was_said_last_counts_and_a_forgotten_robot_does_not() -> None:
    found = agreements("ab bc", "ad")
    found.note(KeyframeId("b", "b", 1), KeyframeId("c", "b", 0), agree=False)
    assert found.borne_out("abcd", lambda name: True) == {"a", "b"}
    found.forget("a")
    assert found.borne_out("abcd", lambda name: True) == set()


def test_who_agreed_with_a_keyframe_that_is_gone_is_not_borne_out_by_that() -> None:
    found = agreements("ab bc ad", "")
    found.note(KeyframeId("b", "b", 0), KeyframeId("d", "b", 7), agree=False)
    assert found.borne_out("abcd", lambda name: name != KeyframeId("d", "b", 0)) == {"a", "b", "c"}


def scales(centres_m: Sequence[float], joined: Sequence[tuple[int, int]]) -> Scales:
    scene, found = Scene(), Scales()
    keyframes = [scene.keyframe(f"r{k}", pose(x_m)) for k, x_m in enumerate(centres_m)]
    for k, one in enumerate(keyframes):
        matched = {keyframes[j].id: 9 for i, j in joined if i == k}
        found.put(Outlook(one, Pose(np.eye(3), one.pose.centre_m), flat(0.25), 20, matched, (4.0, 4.0, 4.0)))
    return found


def test_robots_that_matches_connect_have_one_scale_and_others_theirs() -> None:
    found = scales((0.0, 1.0, 2.0, 5.0, 9.0), [(0, 1), (1, 2), (3, 4)])
    assert found.ratios("r0", "r2") == SAME_SCALE
    least, most = found.ratios("r0", "r3")
    assert least == pytest.approx(1 / most)
    # Scales by baselines of metres at a depth of four: known to a few per cent.
    assert 1.05 < most < 1.6


def test_a_robot_alone_has_no_scale_but_that_of_its_own_past() -> None:
    """Nothing tells its own; what it has seen before and how it moved bounds it, or walls would be taken for scales."""
    found = scales((0.0, 1.0, 2.0), [(0, 1)])
    least, most = found.ratios("r2", "r0")
    assert 1.5 < most < 2
    assert least == pytest.approx(1 / most)


def everywhere(centres_m: np.ndarray, depths_m: np.ndarray, joined: Sequence[tuple[int, int]]) -> np.ndarray:
    """Least and greatest ratios (N, N, 2) as of all robots at once: parts by matches, scales by the spread of each."""
    parts = parts_of(len(centres_m), joined)
    sigmas = np.minimum(scale_sigmas(centres_m, depths_m, parts, AdjustmentOptions().position_share), 0.15)
    count = len(centres_m)
    found = np.ones((count, count, 2))
    for i in range(count):
        for j in range(count):
            if parts[i] != parts[j]:
                found[i, j] = ratio_range(sigmas[i], sigmas[j], VisibilityOptions().scale_sigmas)
    return found


@pytest.mark.parametrize("seed", range(8))
def test_scales_of_a_swarm_that_is_not_too_large_are_those_of_all_at_once(seed: int) -> None:
    """Whatever came and went before: incremental = batch."""
    rng, scene, found = np.random.default_rng(seed), Scene(), Scales()
    count = int(rng.integers(2, NEAREST + 1))
    keyframes = [scene.keyframe(f"r{k}") for k in range(count)]
    state: dict[int, tuple[np.ndarray, float, set[int]]] = {}
    for step in range(3 * count):
        k = int(rng.integers(count)) if step >= count else step
        if step > count and rng.random() < 0.1:
            found.drop(f"r{k}")
            state.pop(k, None)
            continue
        others = {int(j) for j in rng.integers(0, count, rng.integers(0, 3))}
        centre_m, depth_m = rng.normal(0, 5, 3), float(rng.uniform(1, 9))
        state[k] = (centre_m, depth_m, others)
        matched = {keyframes[j].id: 9 for j in others}
        found.put(Outlook(keyframes[k], Pose(np.eye(3), centre_m), flat(1.0), 9, matched, (1.0, depth_m, 9.0)))
        if step % 7 == 0:
            present = sorted(state)
            found.ratios(f"r{present[0]}", f"r{present[-1]}")
    present = sorted(state)
    place = {k: index for index, k in enumerate(present)}
    joined = [(place[k], place[j]) for k in present for j in state[k][2] if j in place]
    expected = everywhere(np.array([state[k][0] for k in present]), np.array([state[k][1] for k in present]), joined)
    told = [[found.ratios(f"r{i}", f"r{j}") for j in present] for i in present]
    np.testing.assert_allclose(told, expected, rtol=1e-9)


def test_of_a_long_chain_only_the_nearest_are_asked() -> None:
    count = 3 * NEAREST
    found = scales(np.arange(count, dtype=float).tolist(), [(k, k + 1) for k in range(count - 1)])
    assert found.ratios("r0", f"r{NEAREST // 2}") == SAME_SCALE
    assert found.ratios("r0", f"r{count - 1}") != SAME_SCALE
    assert all(len(part.robots) <= NEAREST for part in found._parts.values())


@pytest.mark.parametrize("seed", range(20))
def test_who_is_borne_out_by_all_is_borne_out_by_those_around(seed: int) -> None:
    """Among robots that images connect, whatever these say, and not too many."""
    rng = np.random.default_rng(seed)
    count = int(rng.integers(2, 40))
    robots = [f"r{k}" for k in range(count)]
    said = {(k, int(rng.integers(k))): bool(rng.random() < 0.7) for k in range(1, count)}
    said |= {tuple(sorted(rng.choice(count, 2, replace=False).tolist())[::-1]): True for _ in range(count // 4)}
    found = Agreements()
    for (i, j), agree in said.items():
        found.note(KeyframeId(robots[i], "b", 0), KeyframeId(robots[j], "b", 0), agree=agree)
    parts = parts_of(count, [pair for pair, agree in said.items() if agree])
    sizes = np.bincount(parts)
    alone = (sizes == sizes.max()).sum() == 1
    expected = {robots[k] for k in range(count) if alone and parts[k] == sizes.argmax()}
    assert found.borne_out(robots, lambda name: True) == expected
    asked = rng.choice(robots, count // 2).tolist()
    assert found.borne_out(asked, lambda name: True) == expected & set(asked)


def test_others_that_no_image_connects_with_these_have_no_say() -> None:
    found = agreements("ab bc de", "dc")
    assert found.borne_out("abcde", lambda name: True) == {"a", "b", "c"}
    found = agreements("ab bc ac de df ef", "dg")
    assert found.borne_out("defg", lambda name: True) == {"d", "e", "f"}


def test_nothing_is_left_of_a_robot_that_is_forgotten() -> None:
    found = agreements("ab bc", "ac")
    for robot in "abc":
        found.forget(robot)
    assert found._said == {}
    held = scales((0.0, 1.0, 2.0), [(0, 1), (1, 2)])
    held.ratios("r0", "r2")
    for robot in ("r1", "r0", "r2"):
        held.drop(robot)
    assert not any((held._outlooks, held._joins, held._joined, held._parts, *held._within.values()))


def test_what_was_said_of_keyframes_that_are_replaced_is_forgotten() -> None:
    """However robots mix, no more is kept than what is said of keyframes in use, and what nobody has asked about."""
    found, rng = Agreements(), np.random.default_rng(1)
    newest = dict.fromkeys(range(40), 0)

    def held(name: KeyframeId) -> bool:
        return newest[int(name.robot)] == name.sequence

    kept = []
    for turn in range(400):
        one, *others = rng.choice(40, 4, replace=False).tolist()
        newest[one] = turn
        for other in others:
            names = [KeyframeId(str(robot), "b0", newest[robot]) for robot in (one, other)]
            found.note(*names, agree=bool(turn % 3))
        found.borne_out([str(one)], held)
        assert all(one in found._said[other] for one, said in found._said.items() for other in said)
        kept.append(sum(map(len, found._said.values())) // 2)
    # Each has the links of its last turn, and those that others have made with it since.
    assert max(kept) < 40 * 6
    for robot in newest:
        newest[robot] = -1
    found.borne_out([str(robot) for robot in newest], held)
    assert found._said == {}

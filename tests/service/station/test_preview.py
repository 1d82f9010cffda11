"""What other settings would make of the groups."""

import time
from dataclasses import replace

import numpy as np
import pytest
from covista_service.grouping.hysteresis import HysteresisOptions
from covista_service.station.options import GroupingOptions
from covista_service.station.preview import preview
from covista_service.station.snapshot import GroupsView, SimilarityView, Snapshot
from covista_service.station.station import Station
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.service.station.scenes import Scene, measured, pose
from tests.service.station.test_groups import groups, share, two_groups
from tests.service.station.test_laws import Life

OPTIONS = st.builds(
    GroupingOptions,
    alpha=st.sampled_from([0.0, 0.3, 0.5, 1.0]),
    groups=st.sampled_from(["auto", 1, 2, 3, (2, 4)]),
    min_group_size=st.integers(1, 3),
    sigma=st.sampled_from(["shared", "std", 4.0]),
    criterion=st.sampled_from(["adaptive", "gain", "eigengap"]),
    grouping=st.sampled_from(["spectral", "components", "distance"]),
    smoothing=st.sampled_from([0.3, 1.0]),
)


def by_label(view: GroupsView) -> dict[str, tuple[str, ...]]:
    return {group.label: group.robots for group in view.groups}


def given_now(scene: Scene, options: GroupingOptions) -> GroupsView:
    """What the station shows once these settings are set anew."""
    # Others in between, so that they are not those in force.
    scene.station.set_grouping(replace(options, alpha=0.7, sigma=99.0))
    scene.station.set_grouping(options)
    scene.tick()
    return scene.snapshot.groups


@given(st.integers(0, 2**31), OPTIONS)
@settings(max_examples=40, deadline=None)
def test_it_is_what_the_station_shows_once_the_settings_are_given(seed: int, options: GroupingOptions) -> None:
    life = Life(seed)
    for _ in range(8):
        life.step()
    # Bring the matrices up to date.
    life.scene.wait(1)
    snapshot = life.scene.snapshot
    told, shown = preview(snapshot, options), given_now(life.scene, options)
    assert by_label(told) == by_label(shown)
    assert told.note == shown.note
    assert [number for number, _ in told.scores] == [number for number, _ in shown.scores]
    assert [score for _, score in told.scores] == pytest.approx([score for _, score in shown.scores])
    assert (told.settings, told.ungrouped) == (options, shown.ungrouped)
    assert told.revision == snapshot.groups.revision


@given(st.integers(0, 2**31), OPTIONS)
@settings(max_examples=10, deadline=None)
def test_nothing_changes_by_it(seed: int, options: GroupingOptions) -> None:
    life = Life(seed)
    for _ in range(8):
        life.step()
    snapshot = life.scene.snapshot
    view, matrices = snapshot.groups, snapshot.similarity
    kept = [getattr(matrices, name).copy() for name in ("similarity", "overlap", "squared_m2", "mutual")]
    preview(snapshot, options)
    assert snapshot.groups == view == life.scene.snapshot.groups
    assert life.scene.snapshot.similarity is matrices
    for name, matrix in zip(("similarity", "overlap", "squared_m2", "mutual"), kept, strict=True):
        assert np.array_equal(getattr(matrices, name), matrix, equal_nan=True)
    assert life.scene.station.options.grouping == view.settings
    assert life.scene.tick() == []


def test_labels_follow_the_groups_on_show_and_new_ones_were_never_used() -> None:
    scene = two_groups()
    shown, last = groups(scene), scene.snapshot.groups.last_label
    merged = by_label(preview(scene.snapshot, GroupingOptions(groups=1)))
    assert list(merged) == ["g1"]
    assert len(merged["g1"]) == 6
    parted = by_label(preview(scene.snapshot, GroupingOptions(groups=6)))
    assert set(shown) <= set(parted)
    assert {int(label[1:]) for label in parted.keys() - shown.keys()} == set(range(last + 1, last + 5))
    assert groups(scene) == shown


def test_a_change_that_is_held_back_now_would_be_shown() -> None:
    scene = Scene.of(
        grouping=GroupingOptions(smoothing=1.0, hysteresis=HysteresisOptions(persistence_s=1e6, clear=1e6))
    )
    for robot in ("a1", "a2", "b1", "b2"):
        scene.send(robot, pose(0.0 if robot[0] == "a" else 20.0))
    scene.settle(share)
    shown = groups(scene)
    for _ in range(3):
        for robot in ("a1", "a2", "b1", "b2"):
            scene.send(robot, pose(0.0 if robot in ("a1", "b1") else 20.0))
        scene.settle(lambda job: measured(0.9, 0.9) if job.first.robot[1] == job.second.robot[1] else measured(0, 0))
    assert groups(scene) == shown
    assert scene.snapshot.groups.waiting != ()
    told = preview(scene.snapshot, scene.snapshot.groups.settings)
    assert set(by_label(told).values()) == {("a1", "b1"), ("a2", "b2")}
    assert told.waiting == ()


def test_bounds_that_cannot_be_kept_are_noted() -> None:
    assert preview(two_groups().snapshot, GroupingOptions(groups=9)).note is not None


@pytest.mark.parametrize("options", [GroupingOptions(alpha=1.5), GroupingOptions(sigma=-1.0)])
def test_an_alpha_or_a_sigma_that_is_none_is_refused(options: GroupingOptions) -> None:
    with pytest.raises(ValueError, match=r"alpha|sigma"):
        preview(two_groups().snapshot, options)


def test_a_station_without_robots_would_have_no_groups() -> None:
    told = preview(Station().snapshot(0), GroupingOptions(groups=3))
    assert (told.groups, told.ungrouped, told.revision) == ((), (), 0)


def large(count: int) -> Snapshot:
    """Robots in groups of ten who see the same, in an arena where nobody else is near."""
    rng = np.random.default_rng(1)
    places_m = np.repeat(rng.uniform(0, 2000, (count // 10, 3)), 10, axis=0) + rng.uniform(0, 3, (count, 3))
    squared_m2 = ((places_m[:, None] - places_m[None]) ** 2).sum(axis=2)
    together = np.equal.outer(np.arange(count) // 10, np.arange(count) // 10)
    mutual = np.where(together, 0.6, 0.0)
    np.fill_diagonal(mutual, 1.0)
    for matrix in (squared_m2, mutual):
        matrix.flags.writeable = False
    names = tuple(f"r{number:04d}" for number in range(count))
    similarity = SimilarityView(1, names, 1.0, mutual, mutual, squared_m2, mutual)
    return replace(Station().snapshot(0), similarity=similarity)


def test_a_thousand_robots_are_grouped_while_somebody_waits() -> None:
    snapshot = large(1000)
    took_s = []
    for _ in range(4):
        began_s = time.thread_time()
        told = preview(snapshot, GroupingOptions())
        took_s.append(time.thread_time() - began_s)
    assert len(told.groups) == 100
    assert min(took_s) < 0.15

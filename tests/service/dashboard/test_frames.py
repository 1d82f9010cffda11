import asyncio
import json
from collections.abc import Callable
from typing import Any

import numpy as np
from covista_service.dashboard.frames import Frames, Rows, corners, edges_of, swarm_frame
from covista_service.perception.camera import Pose, rotation_of
from covista_service.station.snapshot import SimilarityView, Snapshot

from tests.service.station.scenes import AHEAD, CAMERA, Scene, measured, pose


def swarm(robots: int = 3) -> Scene:
    scene = Scene()
    for k in range(robots):
        scene.send(f"r{k + 1}", pose(0.2 * k))
    scene.settle(lambda job: measured(0.5, 0.25))
    return scene


def view(overlap: list[list[float]]) -> SimilarityView:
    shares = np.array(overlap)
    names = tuple(f"r{k}" for k in range(len(shares)))
    return SimilarityView(4, names, 1.0, shares, shares, np.zeros_like(shares), shares)


def test_a_frame_has_a_row_for_each_robot_in_every_column() -> None:
    scene = swarm()
    scene.wait(6)
    frame = swarm_frame(scene.snapshot, Rows())
    columns = frame["robots"]
    assert columns["id"] == ["r1", "r2", "r3"]
    assert {len(column) for column in columns.values()} == {3}
    assert columns["at_m"] == [[0, 0, 0], [0.2, 0, 0], [0.4, 0, 0]]
    assert columns["status"] == ["stale"] * 3
    assert columns["silent_s"] == [6.0] * 3
    assert frame["revision"] == scene.snapshot.groups.revision
    assert columns["group"] == [scene.snapshot.robots[name].group for name in columns["id"]]


def test_who_stands_in_no_group_has_a_reason_and_who_told_no_pose_no_place() -> None:
    scene = swarm()
    scene.wait(40)
    columns = swarm_frame(scene.snapshot, Rows())["robots"]
    assert columns["reason"] == ["gone"] * 3
    assert columns["group"] == [None] * 3


def test_a_view_is_where_the_corners_of_the_image_lie_from_above() -> None:
    # Looks along the world's x, its own right being the world's -y.
    level = Pose(rotation_of((-0.5, 0.5, -0.5, 0.5)), np.zeros(3))
    x, y = np.array(corners(CAMERA, level)).reshape(4, 2).T
    np.testing.assert_allclose(x, 1.0, atol=1e-3)
    half = 160 / 300
    np.testing.assert_allclose(sorted(y), [-half, -half, half, half], atol=1e-3)
    # One that looks down covers its image's shape on the ground, centred below it.
    down = np.array(corners(CAMERA, Pose(AHEAD, np.zeros(3)))).reshape(4, 2)
    np.testing.assert_allclose(down.mean(axis=0), 0, atol=1e-3)
    np.testing.assert_allclose(np.ptp(down, axis=0), [320 / 300, 240 / 300], atol=2e-3)


def test_edges_are_told_once_with_the_share_of_each_and_nothing_of_what_is_unknown() -> None:
    found = edges_of(view([[0, 0.5, np.nan], [0.25, 0, 0.01], [np.nan, 0.0, 0]]))
    assert found == {"robots": ["r0", "r1", "r2"], "pairs": [[0, 1, 0.5, 0.25]]}


def test_of_many_robots_each_keeps_its_strongest_edges() -> None:
    rng = np.random.default_rng(3)
    overlap = rng.uniform(0.1, 1.0, (80, 80))
    np.fill_diagonal(overlap, 0)
    pairs = edges_of(view(overlap.tolist()))["pairs"]
    shared = np.maximum(overlap, overlap.T)
    best = {tuple(sorted((i, int(np.argmax(shared[i]))))) for i in range(80)}
    assert best <= {(i, j) for i, j, *_ in pairs}
    assert len(pairs) <= 80 * 6


def counted(scene: Scene, asked: list[int]) -> Callable[[], Snapshot]:
    def snapshot() -> Snapshot:
        asked.append(1)
        return scene.snapshot

    return snapshot


def test_who_asks_at_the_same_time_is_told_the_same_made_once() -> None:
    now_s, asked = 0.0, list[int]()
    frames, snapshot = Frames(lambda: now_s), counted(swarm(), asked)

    async def asking() -> None:
        nonlocal now_s
        first, second = await asyncio.gather(frames.swarm("here", snapshot), frames.swarm("here", snapshot))
        assert first == second
        assert len(asked) == 1
        now_s = 1.0
        await frames.swarm("here", snapshot)
        assert len(asked) == 2

    asyncio.run(asking())


def test_edges_are_left_out_for_who_has_them() -> None:
    now_s = 0.0
    frames, scene = Frames(lambda: now_s), swarm()

    def told(matrix: int | None = None) -> Any:
        return json.loads(asyncio.run(frames.swarm("here", lambda: scene.snapshot, matrix)))

    whole = told()
    assert [each[2:] for each in whole["edges"]["pairs"]] == [[0.5, 0.25]] * 3
    assert whole["station"] == "here"
    assert told(whole["matrix"])["edges"] is None
    scene.send("r4", pose(0.8))
    scene.settle(lambda job: measured())
    now_s = 1.0
    assert told(whole["matrix"])["edges"] is not None


def test_a_row_is_made_anew_only_for_a_robot_that_has_changed() -> None:
    scene, rows = swarm(), Rows()
    before = rows.of(list(scene.snapshot.robots.values()))
    scene.send_pose("r2", pose(5.0))
    after = rows.of(list(scene.snapshot.robots.values()))
    assert [new is old for new, old in zip(after, before, strict=True)] == [True, False, True]
    assert after[1].at_m == [5.0, 0.0, 0.0]

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import cv2
import numpy as np
import pytest
from covista_clients.simulation import folder, worlds
from covista_clients.simulation.viewing import pinhole
from covista_clients.simulation.world import World

Worlds = Callable[[str], World]


@pytest.mark.parametrize("name", worlds.WORLDS)
def test_depth_and_poses_on_disk_tell_the_overlap(world: Worlds, name: str, tmp_path: Path) -> None:
    out = tmp_path / "deep" / name
    folder.write(world(name), 3, 0, out, pinhole())
    dataset = json.loads((out / "dataset.json").read_text())
    truth = json.loads((out / "overlap_gt.json").read_text())
    assert truth["ids"] == [frame["id"] for frame in dataset["frames"]]
    for a in range(3):
        assert truth["q"][a][a] is None
        for b in {0, 1, 2} - {a}:
            assert truth["q"][a][b] == pytest.approx(_from_depth(out, dataset, a, b, truth["step"]), abs=0.05)


def test_frames_are_pictures_and_depth_of_one_size(world: Worlds, tmp_path: Path) -> None:
    folder.write(world("wall"), 2, 0, tmp_path)
    dataset = json.loads((tmp_path / "dataset.json").read_text())
    assert dataset["kind"] == "rgbd"
    for frame in dataset["frames"]:
        image = cv2.imread(str(tmp_path / frame["image"]))
        depth = cv2.imread(str(tmp_path / frame["depth"]), cv2.IMREAD_UNCHANGED)
        assert image.shape == (dataset["height"], dataset["width"], 3)
        assert depth.shape == image.shape[:2]
        assert depth.dtype == np.uint16
        rotation = np.array(frame["T_wc"])[:3, :3]
        np.testing.assert_allclose(rotation @ rotation.T, np.eye(3), atol=1e-12)


def test_the_same_seed_writes_the_same_files(world: Worlds, tmp_path: Path) -> None:
    for name in ("one", "two"):
        folder.write(world("corner"), 2, 5, tmp_path / name, pinhole(160, 120))
    one, two = (sorted((tmp_path / name).iterdir()) for name in ("one", "two"))
    assert [path.read_bytes() for path in one] == [path.read_bytes() for path in two]


def _from_depth(out: Path, dataset: dict, a: int, b: int, step: int) -> float:
    """The overlap as pictures of depth tell it, nearest pixel, with 5 % of tolerance."""
    matrix = np.array(dataset["K"])
    first, second = (dataset["frames"][k] for k in (a, b))
    depth_a, depth_b = (
        cv2.imread(str(out / frame["depth"]), cv2.IMREAD_UNCHANGED) / dataset["depth_scale"]
        for frame in (first, second)
    )
    y, x = (axis.ravel() for axis in np.mgrid[step // 2 : 240 : step, step // 2 : 320 : step])
    z = depth_a[y, x]
    points = np.linalg.inv(matrix) @ np.stack([x, y, np.ones_like(x)]) * z
    second_from_first = np.linalg.inv(second["T_wc"]) @ np.array(first["T_wc"])
    moved = second_from_first[:3, :3] @ points + second_from_first[:3, 3:]
    seen = np.zeros(len(z), bool)
    ahead = np.flatnonzero((z > 0) & (moved[2] > 0))
    u, v = np.rint((matrix @ moved[:, ahead] / moved[2, ahead])[:2]).astype(int)
    inside = (u >= 0) & (u < 320) & (v >= 0) & (v < 240)
    there = ahead[inside]
    seen[there] = np.abs(depth_b[v[inside], u[inside]] - moved[2, there]) < 0.05 * moved[2, there]
    return float(seen.sum() / (z > 0).sum())

"""A rendered world on disk, in the format of recordings with known overlap.

`dataset.json` (cameras, poses world from camera with OpenCV axes, depth files and scale), pictures as PNG, depth as
16-bit PNG, and `overlap_gt.json` with the exact share of every picture that every other one sees.
"""

from __future__ import annotations

import itertools
import json
from collections.abc import Sequence
from pathlib import Path

import cv2
import numpy as np
from covista_schemas.messages import Camera, Pose
from numpy.typing import NDArray

from covista_clients.simulation import truth
from covista_clients.simulation.renderer import render
from covista_clients.simulation.vantage import viewpoints
from covista_clients.simulation.viewing import pinhole, world_from_camera
from covista_clients.simulation.world import World

# Stored steps per metre: half a millimetre fine, 32 m far.
DEPTH_SCALE = 2000.0
_FARTHEST = 65_535


def write(world: World, cameras: int, seed: int, out: Path, camera: Camera | None = None) -> None:
    """Render `cameras` views of `world` into the folder `out`, which is made; `seed` chooses the views."""
    camera = camera or pinhole(640, 480)
    poses = viewpoints(world, cameras, seed)
    ids = [f"c{k + 1}" for k in range(cameras)]
    out.mkdir(parents=True, exist_ok=True)
    frames = [_frame(world, camera, pose, name, out) for name, pose in zip(ids, poses, strict=True)]
    dataset = {
        "name": f"{world.name}_{seed}",
        "kind": "rgbd",
        "real": False,
        "source": {"world": world.name, "world_seed": world.seed, "views_seed": seed},
        "origin": "rendered by covista",
        "licence": "Apache-2.0",
        "width": camera.width,
        "height": camera.height,
        "depth_scale": DEPTH_SCALE,
        "depth_invalid": [0],
        "depth_type": "z, exact",
        "K": [[camera.fx, 0.0, camera.cx], [0.0, camera.fy, camera.cy], [0.0, 0.0, 1.0]],
        "frames": frames,
    }
    _dump(dataset, out / "dataset.json")
    overlaps = {
        "tol": 0.0,
        "step": truth.STEP_PX,
        "ids": ids,
        "note": "q[i][j]: share of pixels of i (with depth) visible in j, by ray casting; null = not defined",
        "q": _overlaps(world, camera, poses),
    }
    _dump(overlaps, out / "overlap_gt.json")


def _frame(world: World, camera: Camera, pose: Pose, name: str, out: Path) -> dict[str, object]:
    rendering = render(world, camera, pose)
    image, depth = f"{name}.png", f"{name}_depth.png"
    _save(out / image, rendering.image)
    stored = np.rint(rendering.depth_m * DEPTH_SCALE)
    # What is beyond the range of 16 bits has no depth, like the sky.
    _save(out / depth, np.where(stored <= _FARTHEST, stored, 0).astype(np.uint16))
    world_from = np.eye(4)
    world_from[:3, :3] = world_from_camera(pose)
    world_from[:3, 3] = pose.position_m
    return {"id": name, "image": image, "depth": depth, "T_wc": world_from.tolist()}


def _overlaps(world: World, camera: Camera, poses: Sequence[Pose]) -> list[list[float | None]]:
    table: list[list[float | None]] = [[None] * len(poses) for _ in poses]
    for a, b in itertools.permutations(range(len(poses)), 2):
        table[a][b] = round(truth.overlap(world, camera, poses[a], camera, poses[b]), 4)
    return table


def _save(path: Path, picture: NDArray[np.uint8] | NDArray[np.uint16]) -> None:
    if not cv2.imwrite(str(path), picture):
        raise OSError(f"cannot write {path}")


def _dump(content: dict[str, object], path: Path) -> None:
    path.write_text(json.dumps(content, indent=1) + "\n", encoding="utf-8")

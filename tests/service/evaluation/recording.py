"""Writes small recordings for tests: a textured plane that two or more cameras look at from straight above."""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

WIDTH, HEIGHT, FOCAL, DEPTH = 320, 240, 300.0, 5.0
K = [[FOCAL, 0.0, 159.5], [0.0, FOCAL, 119.5], [0.0, 0.0, 1.0]]


def texture(seed: int = 0) -> np.ndarray:
    """A picture (480, 960, 3) with plenty of corners at several scales."""
    rng = np.random.default_rng(seed)
    total = np.zeros((480, 960, 3))
    for size in (4, 12, 40):
        total += cv2.resize(rng.normal(size=(480 // size + 1, 960 // size + 1, 3)), (960, 480))
    spread = cv2.normalize(total, None, 0, 255, cv2.NORM_MINMAX)
    return spread.astype(np.uint8)


def frame(index: int, shift_px: int, **extra: Any) -> dict[str, Any]:
    """An entry of dataset.json: a camera `shift_px` pixels further along the plane."""
    pose = np.eye(4)
    pose[0, 3] = shift_px * DEPTH / FOCAL
    return {
        "id": f"f{index}",
        "image": f"f{index}.png",
        "depth": f"f{index}_depth.png",
        "T_wc": pose.tolist(),
        **extra,
    }


def write(folder: Path, shifts_px: tuple[int, ...] = (0, 80), **changes: Any) -> Path:
    """A set of kind rgbd with exact truth; `changes` replaces fields of dataset.json."""
    folder.mkdir(parents=True, exist_ok=True)
    plane = texture()
    frames = [frame(index, shift) for index, shift in enumerate(shifts_px)]
    for entry, shift in zip(frames, shifts_px, strict=True):
        cv2.imwrite(str(folder / entry["image"]), plane[100 : 100 + HEIGHT, shift : shift + WIDTH])
        cv2.imwrite(str(folder / entry["depth"]), np.full((HEIGHT, WIDTH), round(DEPTH * 1000), np.uint16))
    described = {"name": "plane", "kind": "rgbd", "K": K, "depth_scale": 1000.0, "frames": frames, **changes}
    (folder / "dataset.json").write_text(json.dumps(described))
    q = [[None if a == b else max(0.0, 1 - abs(a - b) / WIDTH) for b in shifts_px] for a in shifts_px]
    (folder / "overlap_gt.json").write_text(json.dumps({"ids": [entry["id"] for entry in frames], "q": q}))
    return folder


def shared(name: str) -> Path:
    """A recording of the shared data; skips where it is absent."""
    root = Path(os.environ.get("COVISTA_DATA") or Path(__file__).parents[4] / "shared" / "data")
    if not (root / name / "dataset.json").is_file():
        pytest.skip(f"no recordings at {root} (COVISTA_DATA)")
    return root / name

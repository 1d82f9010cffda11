"""Recordings with known overlap, read from folders: images, cameras, poses, and the true share of each ordered pair."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import combinations
from pathlib import Path
from zipfile import BadZipFile

import cv2
import imagesize
import numpy as np
from numpy.typing import NDArray

from covista_service.evaluation.files import DATASET, TRUTH, DatasetError, DatasetFile, FrameFile, TruthFile, read
from covista_service.perception.camera import Camera, Floats, Pose

# Published rotations carry few decimals; further off than this it is another convention, or a mistake.
ROTATION_TOLERANCE = 0.02
_DEPTH_STEP = 4


@dataclass(frozen=True, slots=True, eq=False)
class Frame:
    """One image of a set; `camera` and `pose` are None where the set does not know them."""

    id: str
    image: Path
    camera: Camera | None
    pose: Pose | None
    group: str | int | None
    view: str | int | None


@dataclass(frozen=True, slots=True, eq=False)
class Dataset:
    """A set of images; `truth` (n, n) is the share of image i that image j sees, NaN where not defined."""

    name: str
    folder: Path
    frames: tuple[Frame, ...]
    truth: Floats
    file: DatasetFile

    @property
    def pairs(self) -> tuple[tuple[int, int], ...]:
        """Every unordered pair of frames that may be compared, once."""
        return tuple(
            (i, j)
            for (i, first), (j, second) in combinations(enumerate(self.frames), 2)
            if first.group == second.group and (first.view is None or first.view != second.view)
        )


def load(folder: Path) -> Dataset:
    """The set in `folder`; raises DatasetError, which names the file and the field."""
    file = read(folder / DATASET, DatasetFile)
    frames = tuple(_frame(folder, file, index) for index in range(len(file.frames)))
    return Dataset(folder.resolve().name, folder, frames, _truth(folder, file), file)


def picture(frame: Frame) -> NDArray[np.uint8]:
    """The image of a frame, (H, W, 3) BGR uint8; what is transparent in it is taken as it is coloured."""
    # Poses and truth are of the pixels as stored, whatever orientation a tag in the file asks for.
    image = cv2.imread(str(frame.image), cv2.IMREAD_COLOR | cv2.IMREAD_IGNORE_ORIENTATION)
    if image is None:
        raise DatasetError(frame.image, "", "cannot be decoded as an image")
    return np.asarray(image, np.uint8)


def median_depth(dataset: Dataset) -> float | None:
    """Median Z over all pixels of the set that have one, in its own unit of length; None for a set without depth."""
    samples = [z for depth in _depths(dataset) if (z := depth[depth > 0]).size]
    return float(np.median(np.concatenate(samples))) if samples else None


def _frame(folder: Path, file: DatasetFile, index: int) -> Frame:
    entry, where = file.frames[index], f"frames.{index}"
    image = folder / entry.image
    _must_exist(folder, entry.image, f"{where}.image")
    try:
        width, height = imagesize.get(image, exif_rotation=False)
    except ValueError as error:
        raise DatasetError(image, "", f"unreadable head: {error}") from error
    if width <= 0 or height <= 0:
        raise DatasetError(image, "", "not an image of a known format")
    camera = pose = None
    if file.kind != "homography":
        camera = _camera(folder, file, entry, where, (width, height))
        pose = _pose(folder, entry, where)
    return Frame(entry.id, image, camera, pose, entry.group, entry.view)


def _must_exist(folder: Path, name: str, field: str) -> None:
    if not (folder / name).is_file():
        raise DatasetError(folder / DATASET, field, f"there is no file {name!r}")


def _camera(folder: Path, file: DatasetFile, entry: FrameFile, where: str, size: tuple[int, int]) -> Camera:
    field = f"{where}.K" if entry.K is not None or file.K is None else "K"
    matrix = entry.K or file.K
    if matrix is None:
        raise DatasetError(folder / DATASET, field, f"a set of kind {file.kind} needs intrinsics")
    K = np.array(matrix)
    if K[0, 0] <= 0 or K[1, 1] <= 0 or K[1, 0] != 0 or tuple(K[2]) != (0, 0, 1):
        raise DatasetError(folder / DATASET, field, "not an intrinsic matrix [[fx, s, cx], [0, fy, cy], [0, 0, 1]]")
    return Camera(K, *size)


def _pose(folder: Path, entry: FrameFile, where: str) -> Pose:
    if entry.T_wc is None:
        raise DatasetError(folder / DATASET, f"{where}.T_wc", "no pose given")
    world_from_camera = np.array(entry.T_wc)
    rotation = world_from_camera[:3, :3]
    off = np.abs(rotation.T @ rotation - np.eye(3)).max()
    if off > ROTATION_TOLERANCE or np.linalg.det(rotation) < 0 or tuple(world_from_camera[3]) != (0, 0, 0, 1):
        raise DatasetError(folder / DATASET, f"{where}.T_wc", "not a rigid motion [[R, t], [0, 0, 0, 1]]")
    left, _, right = np.linalg.svd(rotation)
    return Pose(left @ right, world_from_camera[:3, 3].copy())


def _truth(folder: Path, file: DatasetFile) -> Floats:
    truth = read(folder / TRUTH, TruthFile)
    ids = [frame.id for frame in file.frames]
    if sorted(truth.ids) != sorted(ids):
        odd = sorted(set(truth.ids) ^ set(ids)) or sorted(truth.ids)
        raise DatasetError(folder / TRUTH, "ids", f"not those of {DATASET}: {odd[0]!r}")
    q = np.array([[np.nan if share is None else share for share in row] for row in truth.q])
    order = [truth.ids.index(name) for name in ids]
    np.fill_diagonal(q, np.nan)
    return q[np.ix_(order, order)]


def _depths(dataset: Dataset) -> Iterator[Floats]:
    """Depths in every fourth pixel, 0 where unknown; one array for each frame that has them."""
    folder, file = dataset.folder, dataset.file
    if file.kind == "stereo_disparity" and file.disparity and file.focal_px and file.baseline_m:
        _must_exist(folder, file.disparity, "disparity")
        disparity = _array(folder / file.disparity, file.disparity_key) + file.doffs
        known = np.isfinite(disparity) & (disparity > file.doffs)
        yield np.divide(file.focal_px * file.baseline_m, disparity, out=np.zeros_like(disparity), where=known)
    for index, frame in enumerate(file.frames):
        if frame.depth is not None:
            _must_exist(folder, frame.depth, f"frames.{index}.depth")
            yield _depth_image(folder / frame.depth, file)


def _array(path: Path, key: str) -> Floats:
    try:
        with path.open("rb") as file, np.load(file) as arrays:
            return np.asarray(arrays[key], np.float64)[::_DEPTH_STEP, ::_DEPTH_STEP]
    except (OSError, EOFError, BadZipFile, ValueError, KeyError, TypeError, IndexError) as error:
        # No archive, cut short, no such key, a single array instead of an archive, or an array of one dimension.
        raise DatasetError(path, key, f"no such array of disparities: {error}") from error


def _depth_image(path: Path, file: DatasetFile) -> Floats:
    stored = cv2.imread(str(path), cv2.IMREAD_UNCHANGED)
    if stored is None or stored.ndim != 2:
        raise DatasetError(path, "", "not a depth image of one channel")
    stored = stored[::_DEPTH_STEP, ::_DEPTH_STEP]
    return np.where(np.isin(stored, file.depth_invalid), 0.0, stored / file.depth_scale)

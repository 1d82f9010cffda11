from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from covista_service.evaluation.datasets import load, median_depth, picture
from covista_service.evaluation.files import DatasetError

from tests.service.evaluation import recording


def change(folder: Path, name: str, where: tuple[Any, ...], value: Any) -> None:
    """Set one field of a JSON file."""
    content = json.loads((folder / name).read_text())
    target = content
    for step in where[:-1]:
        target = target[step]
    target[where[-1]] = value
    (folder / name).write_text(json.dumps(content))


def test_a_set_is_read_whole(tmp_path: Path) -> None:
    dataset = load(recording.write(tmp_path / "plane", (0, 80, 160)))
    assert dataset.name == "plane"
    assert [frame.id for frame in dataset.frames] == ["f0", "f1", "f2"]
    assert dataset.pairs == ((0, 1), (0, 2), (1, 2))
    camera, pose = dataset.frames[1].camera, dataset.frames[1].pose
    assert camera is not None
    assert pose is not None
    assert (camera.width, camera.height) == (320, 240)
    np.testing.assert_allclose(camera.matrix, recording.K)
    np.testing.assert_allclose(pose.centre_m, [80 * 5 / 300, 0, 0])
    np.testing.assert_allclose(dataset.truth, [[np.nan, 0.75, 0.5], [0.75, np.nan, 0.75], [0.5, 0.75, np.nan]])
    assert median_depth(dataset) == pytest.approx(5.0)


def test_the_name_is_the_folders_even_from_inside(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(recording.write(tmp_path / "plane"))
    assert load(Path()).name == "plane"


def test_a_frame_may_have_intrinsics_of_its_own(tmp_path: Path) -> None:
    folder = recording.write(tmp_path)
    change(folder, "dataset.json", ("frames", 1, "K"), [[400, 0, 160], [0, 410, 120], [0, 0, 1]])
    first, second = (frame.camera for frame in load(folder).frames)
    assert first is not None
    assert second is not None
    assert first.matrix[0, 0] == 300
    assert (second.matrix[0, 0], second.matrix[1, 1]) == (400, 410)


def test_only_frames_of_one_group_and_different_views_are_compared(tmp_path: Path) -> None:
    frames = [
        recording.frame(0, 0, group="a", view=0),
        recording.frame(1, 0, group="a", view=0),
        recording.frame(2, 0, group="a", view=1),
        recording.frame(3, 0, group="b", view=1),
        recording.frame(4, 0, group="b", view=0),
    ]
    folder = recording.write(tmp_path, (0, 0, 0, 0, 0), frames=frames)
    assert load(folder).pairs == ((0, 2), (1, 2), (3, 4))


def test_truth_goes_by_ids_and_its_diagonal_says_nothing(tmp_path: Path) -> None:
    folder = recording.write(tmp_path)
    (folder / "overlap_gt.json").write_text(json.dumps({"ids": ["f1", "f0"], "q": [[1.0, 0.25], [None, 1.0]]}))
    np.testing.assert_array_equal(load(folder).truth, [[np.nan, np.nan], [0.25, np.nan]])


def test_transparent_pictures_have_three_channels(tmp_path: Path) -> None:
    folder = recording.write(tmp_path)
    grey = np.full((240, 320), 77, np.uint8)
    cv2.imwrite(str(folder / "f0.png"), np.dstack([grey, grey, grey, np.zeros_like(grey)]))
    image = picture(load(folder).frames[0])
    assert image.shape == (240, 320, 3)
    assert (image == 77).all()


def test_depth_of_a_disparity(tmp_path: Path) -> None:
    folder = recording.write(
        tmp_path,
        kind="stereo_disparity",
        disparity="d.npz",
        disparity_key="map",
        focal_px=300.0,
        baseline_m=0.5,
        doffs=10.0,
        frames=[{k: v for k, v in recording.frame(i, s).items() if k != "depth"} for i, s in ((0, 0), (1, 80))],
    )
    disparity = np.full((240, 320), 20.0)
    disparity[:100] = np.inf
    np.savez(folder / "d.npz", map=disparity)
    assert median_depth(load(folder)) == pytest.approx(300 * 0.5 / 30)


def test_a_set_of_homographies_has_no_cameras(tmp_path: Path) -> None:
    frames = [{"id": f"f{i}", "image": f"f{i}.png", "H_1_to_this": np.eye(3).tolist()} for i in range(2)]
    dataset = load(recording.write(tmp_path, kind="homography", frames=frames, K=None))
    assert all(frame.camera is None and frame.pose is None for frame in dataset.frames)
    assert dataset.pairs == ((0, 1),)
    assert median_depth(dataset) is None


SKEW = [[2.0, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]


@pytest.mark.parametrize(
    ("file", "where", "value", "field"),
    [
        ("dataset.json", ("kind",), "relpose", "kind"),
        ("dataset.json", ("frames",), [], "frames"),
        ("dataset.json", ("frames", 1, "id"), "f0", "f0"),
        ("dataset.json", ("K",), [[0.0, 0, 1], [0, 1, 1], [0, 0, 1]], "K"),
        ("dataset.json", ("K",), [[1.0, 0], [0, 1]], "K"),
        ("dataset.json", ("K",), None, "frames.0.K"),
        ("dataset.json", ("frames", 1, "T_wc"), SKEW, "frames.1.T_wc"),
        ("dataset.json", ("frames", 1, "T_wc"), None, "frames.1.T_wc"),
        ("dataset.json", ("frames", 0, "image"), "nowhere.png", "frames.0.image"),
        ("dataset.json", ("depth_scale",), 0, "depth_scale"),
        ("overlap_gt.json", ("q", 0, 1), 1.5, "q.0.1"),
        ("overlap_gt.json", ("q",), [[None]], "q"),
        ("overlap_gt.json", ("ids", 0), "else", "ids"),
    ],
)
def test_what_is_wrong_is_named(tmp_path: Path, file: str, where: tuple[Any, ...], value: Any, field: str) -> None:
    folder = recording.write(tmp_path)
    change(folder, file, where, value)
    with pytest.raises(DatasetError) as caught:
        load(folder)
    assert str(folder / file) in str(caught.value)
    assert field in str(caught.value)


@pytest.mark.parametrize("file", ["dataset.json", "overlap_gt.json"])
def test_files_that_are_absent_or_not_json_are_named(tmp_path: Path, file: str) -> None:
    folder = recording.write(tmp_path)
    (folder / file).write_text("{")
    with pytest.raises(DatasetError, match=file):
        load(folder)
    (folder / file).unlink()
    with pytest.raises(DatasetError, match=file):
        load(folder)


def test_what_is_not_an_image_is_named(tmp_path: Path) -> None:
    folder = recording.write(tmp_path)
    (folder / "f0.png").write_bytes(b"words")
    with pytest.raises(DatasetError, match=r"f0\.png"):
        load(folder)


@pytest.mark.parametrize(
    ("name", "pairs", "ordered"),
    [
        ("office_slambook", 10, 20),
        ("moon_stereolunar", 78, 156),
        ("motorcycle_middlebury", 1, 1),
        ("graf_oxford", 15, 30),
    ],
)
def test_pairs_of_the_shared_recordings(name: str, pairs: int, ordered: int) -> None:
    dataset = load(recording.shared(name))
    assert len(dataset.pairs) == pairs
    defined = np.isfinite(dataset.truth)
    assert defined.sum() == ordered
    compared = np.zeros_like(defined)
    for a, b in dataset.pairs:
        compared[a, b] = compared[b, a] = True
    assert (compared | ~defined).all()


@pytest.mark.parametrize("content", ["none", "empty", "cut", "one array", "one row"])
def test_a_broken_disparity_is_named(tmp_path: Path, content: str) -> None:
    frames = [{k: v for k, v in recording.frame(i, 0).items() if k != "depth"} for i in range(2)]
    kind: dict[str, object] = {"kind": "stereo_disparity", "disparity": "d.npz", "focal_px": 300.0, "baseline_m": 0.5}
    folder = recording.write(tmp_path, frames=frames, **kind)
    match content:
        case "none":
            np.savez(folder / "d.npz", other=np.ones((4, 4)))
        case "empty":
            (folder / "d.npz").write_bytes(b"")
        case "cut":
            (folder / "d.npz").write_bytes(b"PK\x03\x04 and no more")
        case "one array":
            with (folder / "d.npz").open("wb") as file:
                np.save(file, np.ones((4, 4)))
        case "one row":
            np.savez(folder / "d.npz", arr_0=np.ones(4))
    with pytest.raises(DatasetError, match=r"d\.npz: arr_0"):
        median_depth(load(folder))


def test_the_size_is_that_of_the_pixels_as_stored(tmp_path: Path) -> None:
    folder = recording.write(tmp_path)
    plain = cv2.imencode(".jpg", np.zeros((240, 320, 3), np.uint8))[1].tobytes()
    tiff = b"MM\x00*\x00\x00\x00\x08\x00\x01\x01\x12\x00\x03\x00\x00\x00\x01\x00\x06\x00\x00\x00\x00\x00\x00"
    turned = b"\xff\xe1" + (len(tiff) + 8).to_bytes(2) + b"Exif\x00\x00" + tiff
    (folder / recording.frame(0, 0)["image"]).write_bytes(plain[:2] + turned + plain[2:])
    camera = load(folder).frames[0].camera
    assert camera is not None
    assert (camera.width, camera.height) == (320, 240)

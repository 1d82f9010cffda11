import numpy as np
import pytest
from covista_service.perception.camera import Floats, Pose, relative
from covista_service.perception.frustum import overlap
from covista_service.perception.surface import COLUMNS, ROWS, Surface, flat
from covista_service.perception.visibility import Seeing, VisibilityOptions, seen

from tests.service.perception.scenes import CAMERA, ORIGIN, turn

OPTIONS = VisibilityOptions()
FAR = Seeing(CAMERA, flat(1 / 6, 0.01))


def share(first: Seeing, second: Seeing, first_pose: Pose, second_pose: Pose, connected: bool = True) -> float:
    return float(seen(first, second, *relative(first_pose, second_pose), OPTIONS, connected=connected).mean())


def at(x: float, y: float = 0.0, z: float = 0.0, rotation: Floats | None = None) -> Pose:
    return Pose(np.eye(3) if rotation is None else rotation, np.array([x, y, z]))


def test_the_same_view_sees_all() -> None:
    assert share(FAR, FAR, ORIGIN, ORIGIN) == 1


def test_back_to_back_sees_nothing() -> None:
    assert share(FAR, FAR, ORIGIN, at(0, rotation=turn(0, np.pi, 0))) == 0


@pytest.mark.parametrize("x", [0.5, 1.5, 3.0])
def test_a_wall_is_seen_as_its_polygon_says(x: float) -> None:
    expected = overlap(CAMERA, ORIGIN, 6.0, CAMERA, at(x), 6.0)[0]
    assert share(FAR, FAR, ORIGIN, at(x)) == pytest.approx(expected, abs=1 / COLUMNS)


@pytest.mark.parametrize("scale", [0.1, 10.0])
def test_scaling_the_baseline_with_the_depths_changes_nothing(scale: float) -> None:
    scaled = Seeing(CAMERA, flat(1 / 6 / scale, 0.01))
    one = seen(FAR, FAR, *relative(ORIGIN, at(1.3)), OPTIONS)
    other = seen(scaled, scaled, *relative(ORIGIN, at(1.3 * scale)), OPTIONS)
    assert (one == other).all()


def test_what_lies_behind_the_other_surface_is_hidden() -> None:
    near = flat(1 / 6, 0.01).inverse_depth.copy()
    near[:, : COLUMNS // 2] = 1 / 2  # something close before the left half of the second camera
    blocked = Seeing(CAMERA, Surface(near, np.full((ROWS, COLUMNS), 0.01)))
    free = share(FAR, FAR, ORIGIN, at(1.0))
    assert share(FAR, blocked, ORIGIN, at(1.0)) < free - 0.3


def test_tiny_baselines_hide_nothing() -> None:
    noisy = Seeing(CAMERA, flat(1 / 4, 0.01))
    assert share(FAR, noisy, ORIGIN, at(0.005)) > 0.97
    assert share(FAR, noisy, ORIGIN, at(1.0)) == 0


def test_unconnected_scales_are_taken_out() -> None:
    other = Seeing(CAMERA, flat(1 / 3, 0.01))
    assert share(FAR, other, ORIGIN, at(1.0)) == 0
    assert share(FAR, other, ORIGIN, at(1.0), connected=False) > 0.7

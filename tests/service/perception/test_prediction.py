import numpy as np
from covista_service.perception.camera import Camera, Floats, Pose, relative
from covista_service.perception.overlap import common_field
from covista_service.perception.prediction import overlaps, posed_pairs

from tests.service.perception.scenes import CAMERA, ORIGIN, beside, corner, plane, turn, wall
from tests.service.perception.test_overlap import OTHER, SMALL, random_scene

SLANTED = Camera(np.array([[300.0, 4.0, 150.0], [0, 310.0, 130.0], [0, 0, 1]]), 320, 240)


def foretold(poses: list[Pose], planes: list[Floats], cameras: tuple[Camera, Camera] = (CAMERA, CAMERA)) -> Floats:
    relatives = [relative(ORIGIN, pose) for pose in poses]
    rotations, translations = np.array([one[0] for one in relatives]), np.array([one[1] for one in relatives])
    return overlaps(posed_pairs([cameras] * len(poses), rotations, translations, planes))


def test_many_at_once_are_what_each_pair_alone_has_in_common() -> None:
    random = np.random.default_rng(0)
    for cameras in ((SMALL, OTHER), (CAMERA, SLANTED), (SLANTED, SMALL)):
        scenes = [random_scene(random) for _ in range(150)]
        fields = [common_field(*cameras, *relative(ORIGIN, pose), planes) for pose, planes in scenes]
        found = foretold([pose for pose, _ in scenes], [planes for _, planes in scenes], cameras)
        expected = [(field.overlap_first, field.overlap_second) for field in fields]
        np.testing.assert_allclose(found, expected, atol=1e-9)
        assert found.max() > 0.5


def test_the_length_of_the_baseline_does_not_matter() -> None:
    pose = beside(3)
    scaled = [Pose(pose.world_from_camera, w * pose.centre_m) for w in (1.0, 0.1, 0.5, 2.0, 10.0)]
    found = foretold(scaled, [corner() / w for w in (1.0, 0.1, 0.5, 2.0, 10.0)])
    np.testing.assert_allclose(found, np.tile(found[0], (5, 1)), atol=1e-9)


def test_opposite_sides_have_nothing_and_the_same_view_has_everything_in_common() -> None:
    behind, within = Pose(turn(0, np.pi, 0), np.array([0.0, 0.0, 12.0])), Pose(np.eye(3), np.array([0.0, 0.0, 6.0]))
    found = foretold([behind, ORIGIN, within], [wall(), corner(), np.array([plane((0, 0, 1), 6.0)])])
    np.testing.assert_allclose(found, [(0, 0), (1, 1), (0, 0)], atol=1e-12)


def test_without_planes_nothing_is_in_common() -> None:
    none = np.zeros((0, 3))
    np.testing.assert_array_equal(foretold([beside(), ORIGIN], [none, none]), np.zeros((2, 2)))
    np.testing.assert_allclose(foretold([ORIGIN, ORIGIN, ORIGIN], [none, wall(), none])[:, 0], [0, 1, 0], atol=1e-12)
    assert foretold([], []).shape == (0, 2)

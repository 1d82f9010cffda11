"""The swarm from above: robots in the colours of their groups, what they look at, who sees the same."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from covista_schemas.reports import GroupsReport, PairsReport, RobotReport, RobotsReport
from numpy.typing import NDArray

from covista_service.drawing import canvas
from covista_service.drawing.canvas import Colour, Picture
from covista_service.perception.camera import Floats, rotation_of

_MARGIN = 0.08
_LEAST_OVERLAP = 0.02
_LEGEND_PX = 26


@dataclass(frozen=True, slots=True, eq=False)
class _Ground:
    """From metres on the ground, x right and y up, to pixels."""

    low_m: Floats
    px_per_m: float
    height_px: int

    def px(self, points_m: NDArray[np.floating]) -> Floats:
        """Pixels (k, 2) of world points (k, 2 or 3)."""
        flat = (np.atleast_2d(points_m)[:, :2] - self.low_m) * self.px_per_m
        return np.column_stack([flat[:, 0], self.height_px - 1 - flat[:, 1]])


def swarm_map(
    robots: RobotsReport,
    pairs: PairsReport,
    groups: GroupsReport,
    *,
    walls: Sequence[NDArray[np.floating]] = (),
    reach_m: float = 3.0,
    size_px: tuple[int, int] = (900, 700),
) -> bytes:
    """PNG from above, looking down the world's z axis.

    `walls` are polygons (k, 3) of the world to show, in metres; a view is drawn as far as `reach_m`; an edge between
    two robots is as wide as the overlap of their views.
    """
    placed = [robot for robot in robots.robots if robot.pose is not None]
    views = {robot.id: _view(robot, reach_m) for robot in placed}
    ground = _ground([*views.values(), *walls], size_px)
    colours = {robot: canvas.palette(i) for i, group in enumerate(groups.groups) for robot in group.robots}
    picture: Picture = np.full((size_px[1], size_px[0], 3), canvas.PAPER, np.uint8)
    for wall in walls:
        canvas.line(picture, ground.px(wall), canvas.GREY, 2, closed=True)
    for robot in placed:
        canvas.fill(picture, ground.px(views[robot.id]), colours.get(robot.id, canvas.GREY), 0.18)
    places_px = {name: ground.px(view[0])[0] for name, view in views.items()}
    _draw_edges(picture, pairs, places_px)
    for name, view in views.items():
        canvas.line(picture, ground.px(view), colours.get(name, canvas.GREY), 2, closed=True)
    for name, place_px in places_px.items():
        _draw_robot(picture, name, place_px, colours.get(name, canvas.GREY))
    _draw_legend(picture, groups)
    _draw_scale(picture, ground)
    return canvas.png(picture)


def _view(robot: RobotReport, reach_m: float) -> Floats:
    """The camera's centre and the far corners of its field of view at mid-height, (3, 2) on the ground."""
    if robot.pose is None:
        raise ValueError(f"{robot.id} has no pose to draw")
    centre_m = np.array(robot.pose.position_m)
    camera = robot.camera
    sides = (
        (-0.5, 0.5)
        if camera is None
        else ((-0.5 - camera.cx) / camera.fx, (camera.width - 0.5 - camera.cx) / camera.fx)
    )
    rays = np.array([[side, 0.0, 1.0] for side in sides]) @ rotation_of(robot.pose.orientation_xyzw).T
    return np.vstack([centre_m, centre_m + reach_m * rays])[:, :2]


def _ground(shapes: Sequence[NDArray[np.floating]], size_px: tuple[int, int]) -> _Ground:
    """A scale at which all shapes fit, centred; a metre around the origin if there are none."""
    points_m = np.vstack([shape[:, :2] for shape in shapes] or [np.array([[-1.0, -1.0], [1.0, 1.0]])])
    low_m, high_m = points_m.min(axis=0), points_m.max(axis=0)
    extent_m = np.maximum(high_m - low_m, 1e-3)
    size = np.array(size_px, np.float64)
    px_per_m = float(((1.0 - 2.0 * _MARGIN) * size / extent_m).min())
    return _Ground((low_m + high_m) / 2.0 - size / (2.0 * px_per_m), px_per_m, size_px[1])


def _draw_edges(picture: Picture, pairs: PairsReport, places_px: dict[str, Floats]) -> None:
    for pair in pairs.pairs:
        overlap = max(pair.overlap_a or 0.0, pair.overlap_b or 0.0)
        if overlap >= _LEAST_OVERLAP and pair.a in places_px and pair.b in places_px:
            ends_px = np.vstack([places_px[pair.a], places_px[pair.b]])
            canvas.line(picture, ends_px, canvas.PENCIL, 1 + round(4 * overlap))


def _draw_robot(picture: Picture, name: str, place_px: Floats, colour: Colour) -> None:
    canvas.dot(picture, place_px, 9.0, colour)
    x, y = (int(value) for value in place_px)
    label_px = np.array([[0, -16], [canvas.text_width(name) + 6, -16], [canvas.text_width(name) + 6, 4], [0, 4]])
    canvas.fill(picture, label_px + np.array([x + 12.0, y - 10.0]), canvas.PAPER, 0.75)
    canvas.text(picture, name, (x + 15, y - 11))


def _draw_legend(picture: Picture, groups: GroupsReport) -> None:
    rows = [(group.label + ": " + " ".join(group.robots), canvas.palette(i)) for i, group in enumerate(groups.groups)]
    rows += [(f"{each.robot}: {each.reason.replace('_', ' ')}", canvas.GREY) for each in groups.ungrouped]
    for row, (words, colour) in enumerate(rows):
        y = 26 + row * _LEGEND_PX
        canvas.dot(picture, np.array([20.0, y - 5.0]), 7.0, colour)
        canvas.text(picture, words, (36, y))


def _draw_scale(picture: Picture, ground: _Ground) -> None:
    """A bar of a round length, about a fifth of the picture."""
    target_m = picture.shape[1] / 5 / ground.px_per_m
    power = 10.0 ** np.floor(np.log10(target_m))
    length_m = float(max(step * power for step in (1, 2, 5) if step * power <= target_m))
    right, foot = picture.shape[1] - 24, picture.shape[0] - 20
    left = right - length_m * ground.px_per_m
    canvas.line(picture, np.array([[left, foot - 5], [left, foot], [right, foot], [right, foot - 5]]), canvas.INK, 2)
    words = f"{length_m:g} m"
    canvas.text(picture, words, (int((left + right - canvas.text_width(words)) / 2), foot - 8))

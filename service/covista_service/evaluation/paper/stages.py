"""Scenarios as they are drawn: cameras in the colours of their groups."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from covista_clients.simulation.paper_scenes import Vantage
from covista_clients.simulation.viewing import ray_from_pixel, world_from_camera
from covista_schemas.messages import Camera

from covista_service.drawing.scenario import Stage, Standing
from covista_service.evaluation.paper.layouts import Scenario, rim_px
from covista_service.perception.camera import Floats

# How far from its centre a camera's image is drawn.
_PYRAMID_M = 0.9


def stage(
    scenario: Scenario,
    title: str,
    colour: Mapping[int, int] | None = None,
    *,
    names: Sequence[str] = (),
    mutual: Floats | None = None,
) -> Stage:
    """The scenario, its cameras called 1, 2, ... or by `names`; `colour`: the number of each one's colour."""
    drawn = [
        Standing(
            names[k] if names else str(k + 1),
            np.array(vantage.position_m),
            _rim_m(scenario.camera, vantage),
            view_m,
            colour[k + 1] if colour else 0,
        )
        for k, (vantage, view_m) in enumerate(zip(scenario.vantages, scenario.views_m, strict=True))
    ]
    return Stage(title, scenario.outline_m, drawn, mutual)


def _rim_m(camera: Camera, vantage: Vantage) -> Floats:
    rays = rim_px(camera) @ (world_from_camera(vantage.pose) @ ray_from_pixel(camera)).T
    return np.asarray(np.array(vantage.position_m) + _PYRAMID_M * rays, np.float64)

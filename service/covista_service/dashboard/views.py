"""What stands on pages: each view is a Vue component of its own in `web`, on modules that they share in `web/lib`."""

from __future__ import annotations

from pathlib import Path

from nicegui.element import Element

_WEB = Path(__file__).parent / "web"
STYLE = (_WEB / "covista.css").read_text()


class View(Element, esm={"covista": "web/lib"}):
    """A component with properties that do not change while the page stands."""

    def __init__(self, **properties: str) -> None:
        super().__init__()
        self._props.update(properties)


class Standing(View, component="web/standing.js"):
    """Whether the station answers, as whom one is logged in, light or dark."""


class Swarm(View, component="web/swarm.js"):
    """The map, the groups, and why two robots are apart or together."""


class Similarity(View, component="web/similarity.js"):
    """The matrix ordered by group, and the score of every number of groups."""


class Pair(View, component="web/pair.js"):
    """Both keyframes of a pair (`a`, `b`) with the common field, and its history."""


class Robot(View, component="web/robot.js"):
    """One `robot`."""


class Timeline(View, component="web/timeline.js"):
    """Groups over time; the map and the matrix of a moment."""


class WhatIf(View, component="web/what_if.js"):
    """Settings to try."""


class Health(View, component="web/health.js"):
    """The station's parts in plain words."""

"""Run the experiments, and write what they come to into a folder."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path

from covista_service.evaluation.files import make_folder
from covista_service.evaluation.paper.chapter import Experiment, Item, Tell
from covista_service.evaluation.paper.common_field import common_field
from covista_service.evaluation.paper.correlation import correlation
from covista_service.evaluation.paper.group_tables import group_tables
from covista_service.evaluation.paper.invariance import invariance
from covista_service.evaluation.paper.mover import mover
from covista_service.evaluation.paper.trade_off import trade_off

EXPERIMENTS: Mapping[str, Experiment] = {
    "common field": common_field,
    "invariance": invariance,
    "correlation": correlation,
    "group tables": group_tables,
    "trade-off": trade_off,
    "mover": mover,
}


def run(out: Path, experiments: Mapping[str, Experiment], tell: Tell) -> list[Item]:
    """All items; pictures are written as they come, and paper.json at the end. `tell` hears what is going on."""
    make_folder(out)
    items: list[Item] = []
    for experiment in experiments.values():
        chapter = experiment(tell)
        items += chapter.items
        for name, picture in chapter.pictures.items():
            (out / name).write_bytes(picture)
    lines = [item.as_json() for item in items]
    (out / "paper.json").write_text(json.dumps(lines, indent=1, allow_nan=False) + "\n", encoding="utf-8")
    return items

"""The least that a subscriber in Python can do: count."""

from __future__ import annotations

import zenoh
from covista_schemas import keys, zenoh_config
from covista_schemas.keys import RobotTopic

from covista_service.bench.load import SITE
from covista_service.demo.children import Line, end_soon


def play(line: Line, listen: str) -> None:
    """Listen as a router; say "ready", and answer every word with how many poses have come."""
    count = 0

    def hear(_sample: zenoh.Sample) -> None:
        nonlocal count
        count += 1

    with (
        zenoh.open(zenoh_config.config("router", listen=[listen])) as session,
        session.declare_subscriber(keys.every(SITE, RobotTopic.POSE), hear),
    ):
        line.send("ready")
        while line.receive() is not None:
            line.send(count)
        end_soon()

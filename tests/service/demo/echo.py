"""A role that says who it is, and then what it hears, until the line closes."""

from __future__ import annotations

import os

from covista_service.demo.children import Line


def play(line: Line, greeting: str) -> None:
    line.send((greeting, os.getpid()))
    while (message := line.receive()) is not None:
        line.send(message)

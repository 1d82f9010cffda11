"""A role that hears of its parent's end, and then hangs."""

from __future__ import annotations

import os
import threading

from covista_service.demo.children import Line, end_soon


def play(line: Line) -> None:
    line.send(os.getpid())
    line.receive()
    end_soon()
    threading.Event().wait()

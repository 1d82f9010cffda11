"""The swarm's process: rovers in a rendered world, told by the parent when to fall silent and when to leave."""

from __future__ import annotations

import threading

from covista_clients.simulation.swarm import KeyframeRecord, SwarmOptions, run_swarm

from covista_service.demo.children import Line, end_soon


def play(line: Line, options: SwarmOptions) -> None:
    """Drive; every keyframe that is handed to its rover goes to the parent as a KeyframeRecord."""
    quiet, leave = threading.Event(), threading.Event()
    listener = threading.Thread(target=_obey, args=(line, quiet, leave), name="orders", daemon=True)
    listener.start()

    def report(record: KeyframeRecord) -> None:
        line.send(record)

    run_swarm(options, quiet, on_keyframe=report, leave=leave)


def _obey(line: Line, quiet: threading.Event, leave: threading.Event) -> None:
    """Any word is the order to fall silent; a line that closes is the order to leave, at once."""
    while line.receive() is not None:
        quiet.set()
    end_soon()
    quiet.set()
    leave.set()

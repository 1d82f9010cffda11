"""Child processes that take orders over a pipe, and end when it closes: with their parent, however that ends.

A child is started afresh (no fork of threads and locks) in a session of its own, so that a terminal's Ctrl-C reaches
the parent alone.
"""

from __future__ import annotations

import importlib
import os
import signal
import subprocess
import sys
import threading
from dataclasses import dataclass
from multiprocessing import Pipe
from multiprocessing.connection import Connection
from typing import Any

# How long a child may take to end in order once its parent is gone, or has told it to.
GRACE_S = 3.0


class Line:
    """One end of the pipe between parent and child; any thread may send."""

    def __init__(self, connection: Connection) -> None:
        self.connection = connection
        self._lock = threading.Lock()

    def send(self, message: object) -> bool:
        """Send, and say whether the other end is still there."""
        with self._lock:
            try:
                self.connection.send(message)
            except OSError:
                return False
        return True

    def receive(self) -> Any:
        """The next message, or None when the other end is gone."""
        try:
            return self.connection.recv()
        except (EOFError, OSError):
            return None


@dataclass(frozen=True, slots=True, eq=False)
class Child:
    """A child process and the parent's end of its line."""

    process: subprocess.Popen[bytes]
    line: Line

    def ended(self, timeout_s: float) -> bool:
        """Wait for its end."""
        try:
            self.process.wait(timeout_s)
        except subprocess.TimeoutExpired:
            return False
        return True

    def end(self) -> None:
        """Close its line, which ends it, and kill it if that takes too long."""
        self.line.connection.close()
        if not self.ended(GRACE_S + 1.0):
            self.process.kill()
            self.process.wait()


def start(role: str, *arguments: object) -> Child:
    """Start a process that runs `play(line, *arguments)` of the module `role`; the arguments must pickle.

    The module goes by its name, so that the parent need not import what only the child uses.
    """
    ours, theirs = Pipe()
    command = [sys.executable, "-m", __name__, str(theirs.fileno())]
    process = subprocess.Popen(  # noqa: S603 - our own interpreter and module
        command, pass_fds=(theirs.fileno(),), start_new_session=True, stdin=subprocess.DEVNULL
    )
    theirs.close()
    child = Child(process, Line(ours))
    child.line.send((role, arguments))
    return child


def main(descriptor: int) -> None:
    """What a child does: be deaf to signals meant for the parent, take its role, and play it."""
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, signal.SIG_IGN)
    line = Line(Connection(descriptor))
    given = line.receive()
    if given is not None:
        role, arguments = given
        importlib.import_module(role).play(line, *arguments)


def end_soon() -> None:
    """End this process after `GRACE_S` at the latest, whatever it is doing."""
    last = threading.Timer(GRACE_S, os._exit, (1,))
    last.daemon = True
    last.start()


if __name__ == "__main__":
    main(int(sys.argv[1]))

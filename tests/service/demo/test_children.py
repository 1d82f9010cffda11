from __future__ import annotations

import os
import signal
import subprocess
import sys
import threading

import psutil
from covista_service.demo import children

ECHO, DEAF = "tests.service.demo.echo", "tests.service.demo.deaf"
DEADLINE_S = 20.0


def start_and_hang() -> None:
    """A parent whose child is told of its end by the line alone."""
    child = children.start(ECHO, "hello")
    _, pid = child.line.receive()
    sys.stdout.write(f"{pid}\n")
    sys.stdout.flush()
    threading.Event().wait()


def test_a_child_plays_its_role_and_ends_with_its_line() -> None:
    child = children.start(ECHO, "hello")
    assert child.line.receive() == ("hello", child.process.pid)
    for number in (signal.SIGINT, signal.SIGTERM):
        os.kill(child.process.pid, number)
    child.line.send("still there")
    assert child.line.receive() == "still there"
    child.end()
    assert child.process.returncode == 0


def test_a_child_that_hangs_ends_all_the_same() -> None:
    child = children.start(DEAF)
    child.line.receive()
    child.end()
    assert child.process.returncode is not None


def test_a_child_ends_with_a_parent_that_was_killed() -> None:
    code = "from tests.service.demo.test_children import start_and_hang; start_and_hang()"
    with subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE, text=True) as parent:
        assert parent.stdout is not None
        child = psutil.Process(int(parent.stdout.readline()))
        parent.kill()
    psutil.wait_procs([child], DEADLINE_S)
    assert not child.is_running()


def test_nobody_at_the_other_end_is_no_error() -> None:
    child = children.start(ECHO, "hello")
    child.line.receive()
    child.process.kill()
    child.process.wait()
    assert child.line.receive() is None
    assert not child.line.send("anybody?")
    child.end()

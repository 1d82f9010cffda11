"""The demo as a person starts it: `covista-station demo`."""

from __future__ import annotations

import json
import os
import queue
import signal
import socket
import subprocess
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import psutil
import pytest

START_S, END_S = 60.0, 15.0
REPORT = {
    "robots", "keyframes_sent", "keyframes_received", "surveys", "q_mae", "q_mae_seen", "latency_ms", "groups",
    "group_changes",
}  # fmt: skip


def free_port() -> int:
    with socket.create_server(("127.0.0.1", 0)) as probe:
        port: int = probe.getsockname()[1]
        return port


class Demo:
    """A demo under way: its lines as they come, and the processes that belong to it."""

    def __init__(self, process: subprocess.Popen[str]) -> None:
        self.process = process
        self.lines: queue.SimpleQueue[str | None] = queue.SimpleQueue()
        self._reader = threading.Thread(target=self._read)
        self._reader.start()

    def wait_for(self, text: str) -> str:
        """The first line from now on that has `text` in it."""
        seen = []
        while (line := self.lines.get(timeout=START_S)) is not None:
            seen.append(line)
            if text in line:
                return line
        raise AssertionError(f"{text!r} in none of {seen}")

    def family(self) -> list[psutil.Process]:
        """All processes of the demo but the first."""
        found: list[psutil.Process] = psutil.Process(self.process.pid).children(recursive=True)
        return found

    def close(self) -> None:
        if self.process.poll() is None:
            self.process.kill()
        self.process.wait()
        self._reader.join()

    def _read(self) -> None:
        assert self.process.stdout is not None
        with self.process.stdout as stream:
            for line in stream:
                self.lines.put(line)
        self.lines.put(None)


@contextmanager
def started(tmp_path: Path, *arguments: str, **where: str) -> Iterator[Demo]:
    """A demo at free ports, unless arguments or the environment say others."""
    command = [sys.executable, "-m", "covista_service", "demo", "--robots", "3", *arguments]
    free = {"COVISTA_API": f"127.0.0.1:{free_port()}", "COVISTA_LINK": f"tcp/127.0.0.1:{free_port()}"}
    demo = Demo(
        subprocess.Popen(
            command,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            env={**os.environ, "TMPDIR": str(tmp_path), **free, **where},
        )
    )
    try:
        yield demo
    finally:
        demo.close()


def all_ended(family: list[psutil.Process]) -> bool:
    _, alive = psutil.wait_procs(family, END_S)
    return not alive


def test_a_run_is_reported_and_leaves_nothing_behind(tmp_path: Path) -> None:
    report = tmp_path / "report.json"
    scratch = tmp_path / "scratch"
    scratch.mkdir()
    with started(scratch, "--seconds", "10.5", "--report", str(report)) as demo:
        for word in ("API", "docs", "zenoh", "g1"):
            demo.wait_for(word)
        family = demo.family()
        assert len(family) == 2
        assert demo.process.wait(START_S) == 0
    assert all_ended(family)
    assert not list(scratch.iterdir())
    found = json.loads(report.read_text())
    assert set(found) == REPORT
    assert found["robots"] == 3
    assert found["keyframes_sent"] > 3
    assert found["keyframes_received"] == found["keyframes_sent"]
    assert found["surveys"] > 0
    assert 0 <= found["q_mae"] < 0.5
    assert 0 < found["latency_ms"]["p50"] <= found["latency_ms"]["p99"]
    assert sorted(robot for group in found["groups"] for robot in group["robots"]) == ["r1", "r2", "r3"]
    assert found["group_changes"] >= 1


def test_ctrl_c_ends_all_at_once(tmp_path: Path) -> None:
    with started(tmp_path) as demo:
        demo.wait_for("g1")
        family = demo.family()
        demo.process.send_signal(signal.SIGINT)
        assert demo.process.wait(END_S) == 0
    assert all_ended(family)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("flag", ["--api", "--link"])
def test_a_taken_port_is_one_line_that_names_the_flag(tmp_path: Path, flag: str) -> None:
    with socket.create_server(("127.0.0.1", 0)) as taken:
        address = f"127.0.0.1:{taken.getsockname()[1]}"
        with started(tmp_path, flag, address if flag == "--api" else f"tcp/{address}") as demo:
            line = demo.wait_for(flag)
            assert address.rpartition(":")[2] in line
            assert demo.lines.get(timeout=START_S) is None
            assert demo.process.wait(START_S) == 1


def test_rovers_go_to_the_first_of_several_end_points(tmp_path: Path) -> None:
    ends = ", ".join(f"tcp/127.0.0.1:{free_port()}" for _ in range(2))
    with started(tmp_path, "--seconds", "1", COVISTA_LINK=ends) as demo:
        assert demo.process.wait(START_S) == 0


def test_the_environment_says_where_too(tmp_path: Path) -> None:
    with socket.create_server(("127.0.0.1", 0)) as taken:
        address = f"127.0.0.1:{taken.getsockname()[1]}"
        with started(tmp_path, COVISTA_API=address) as demo:
            assert address.rpartition(":")[2] in demo.wait_for("--api")
            assert demo.process.wait(START_S) == 1

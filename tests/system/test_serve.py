"""`covista-station serve` as a process: what stops it before it listens, and how it ends."""

import json
import os
import re
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import httpx
import psutil
import pytest

from tests.service.deadline import free_endpoint, wait_until

COMMAND = [sys.executable, "-m", "covista_service", "serve"]
STOP_S = 3.0


def environment(**variables: str) -> dict[str, str]:
    kept = {name: value for name, value in os.environ.items() if not name.startswith("COVISTA_")}
    return kept | variables


def refused(folder: Path, *flags: str, **variables: str) -> tuple[int, str]:
    """Serve in vain: the exit status and the one line said."""
    done = subprocess.run(
        [*COMMAND, *flags], cwd=folder, env=environment(**variables), capture_output=True, text=True, timeout=60
    )
    lines = done.stderr.strip().splitlines()
    assert done.stdout == ""
    assert len(lines) == 1, done.stderr
    return done.returncode, lines[0]


@contextmanager
def serving(folder: Path, *flags: str, **variables: str) -> Iterator[tuple[subprocess.Popen[str], str]]:
    """A station's process and its URL."""
    listening = ["--api", "127.0.0.1:0", "--link", free_endpoint()]
    # Ctrl-C is ignored at first, as it is for what a script starts in the background.
    process = subprocess.Popen(
        ["/bin/sh", "-c", 'trap "" INT; exec "$@"', "sh", *COMMAND, *listening, *flags],
        cwd=folder,
        env=environment(**variables),
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    assert process.stdout is not None
    assert process.stderr is not None
    with process.stdout, process.stderr:
        line = process.stdout.readline()
        found = re.search(r"http://[\d.:]+", line)
        assert found, line
        try:
            yield process, found[0]
        finally:
            process.kill()
            process.wait()


@pytest.mark.parametrize("workers", ["threads", "processes"])
def test_a_signal_ends_it_soon_while_code_is_compiled(tmp_path: Path, workers: str) -> None:
    """That takes half a minute where nothing is on disk yet."""
    cache = str(tmp_path / "cache")
    with serving(tmp_path, "--workers", workers, NUMBA_CACHE_DIR=cache) as (process, url):
        assert httpx.get(f"{url}/readyz").json()["status"] == "starting"
        family = psutil.Process(process.pid).children(recursive=True)
        process.send_signal(signal.SIGTERM)
        assert process.wait(10) == 0
        _, alive = psutil.wait_procs(family, timeout=5)
        assert not alive


@pytest.mark.parametrize(("workers", "number"), [("threads", signal.SIGTERM), ("processes", signal.SIGINT)])
def test_a_signal_ends_it_soon_with_0_and_nothing_left(tmp_path: Path, workers: str, number: signal.Signals) -> None:
    with serving(tmp_path, "--workers", workers) as (process, url):
        wait_until(lambda: httpx.get(f"{url}/readyz").json()["status"] == "ready", "it is ready", 60)
        family = psutil.Process(process.pid).children(recursive=True)
        assert bool(family) == (workers == "processes")
        # A connection that stays open does not keep it.
        with httpx.Client() as client:
            client.get(f"{url}/api/v1/groups")
            asked_s = time.monotonic()
            process.send_signal(number)
            assert process.wait(10) == 0
        assert time.monotonic() - asked_s < STOP_S
        _, alive = psutil.wait_procs(family, timeout=5)
        assert not alive
    assert (tmp_path / "covista.db").exists()


def test_its_log_is_json_where_asked_for_from_start_to_stop(tmp_path: Path) -> None:
    with serving(tmp_path, COVISTA_LOG_FORMAT="json", COVISTA_SITE="mill") as (process, url):
        wait_until(lambda: httpx.get(f"{url}/readyz").status_code == 200, "it is ready", 60)
        process.send_signal(signal.SIGTERM)
        _, log = process.communicate(timeout=10)
    lines = [json.loads(line) for line in log.splitlines()]
    assert all(line.keys() >= {"time", "level", "logger", "message"} for line in lines)
    (start,) = [line for line in lines if line["message"] == "starts"]
    assert (start["level"], start["site"], start["log_format"]) == ("info", "mill", "json")
    assert lines[-1]["message"] == "stops"


def test_a_taken_api_port_is_one_line_with_the_flag(tmp_path: Path) -> None:
    with socket.create_server(("127.0.0.1", 0)) as other:
        port = other.getsockname()[1]
        status, line = refused(tmp_path, "--api", f"127.0.0.1:{port}", "--link", free_endpoint())
    assert status == 1
    assert f"port {port} on 127.0.0.1 is taken" in line
    assert "--api" in line


def test_a_taken_link_port_is_one_line_with_the_flag(tmp_path: Path) -> None:
    with socket.create_server(("127.0.0.1", 0)) as other:
        port = other.getsockname()[1]
        status, line = refused(tmp_path, "--api", "127.0.0.1:0", "--link", f"tcp/127.0.0.1:{port}")
    assert status == 1
    assert f"tcp/127.0.0.1:{port}" in line
    assert "--link" in line


def test_beyond_this_machine_it_listens_only_when_told_that_it_is_insecure(tmp_path: Path) -> None:
    status, line = refused(tmp_path, "--api", "0.0.0.0:0", "--link", free_endpoint())
    assert status == 1
    assert "--insecure" in line
    with serving(tmp_path, "--insecure", "--api", "0.0.0.0:0") as (_, url):
        assert url.startswith("http://0.0.0.0:")


def test_settings_that_make_no_sense_stop_it_before_it_listens(tmp_path: Path) -> None:
    status, line = refused(tmp_path, COVISTA_ALPHA="2")
    assert status == 2
    assert line.startswith("setting alpha (COVISTA_ALPHA): Input should be less than or equal to 1")
    assert not (tmp_path / "covista.db").exists()


def test_a_database_without_a_driver_is_one_line(tmp_path: Path) -> None:
    status, line = refused(
        tmp_path, "--api", "127.0.0.1:0", "--link", free_endpoint(), "--database", "nonsense://somewhere/db"
    )
    assert status == 1
    assert "setting database" in line


def test_an_unusable_database_degrades_the_station_and_does_not_stop_it(tmp_path: Path) -> None:
    with serving(tmp_path, "--database", "sqlite:////absent/folder/covista.db") as (_, url):
        wait_until(lambda: httpx.get(f"{url}/readyz").json()["parts"]["workers"]["status"] == "ready", "warm", 60)
        answer = httpx.get(f"{url}/readyz")
        assert answer.status_code == 200
        assert answer.json()["status"] == "degraded"
        assert answer.json()["parts"]["store"]["status"] == "degraded"
        assert httpx.get(f"{url}/api/v1/groups").status_code == 200

"""Station and rovers in containers do the main job, as seen over REST from outside."""

import subprocess
from typing import Any

import cv2
import httpx
import numpy as np
import pytest

from tests.compose.conftest import ROBOTS
from tests.compose.stack import Stack, wait_for

pytestmark = [pytest.mark.compose, pytest.mark.timeout(1800)]

DATABASE = "/var/lib/covista/covista.db"
EVERY_ROBOT = {f"r{number}" for number in range(1, ROBOTS + 1)}


def ask(stack: Stack, path: str) -> Any:
    return httpx.get(f"{stack.url()}/api/v1/{path}", timeout=10).raise_for_status().json()


def test_every_rover_comes_to_stand_in_a_group(stack: Stack) -> None:
    def grouped() -> bool | None:
        groups = ask(stack, "groups")["groups"]
        return {robot for group in groups for robot in group["robots"]} == EVERY_ROBOT or None

    assert wait_for(grouped, within_s=120, what="every rover in a group")


def test_an_overlay_shows_a_picture(stack: Stack) -> None:
    def measured() -> dict[str, Any] | None:
        pairs = ask(stack, "pairs?min_overlap=0.1")["pairs"]
        # Read anew for where its robots stand now, it is `predicted` more often than not.
        return next((pair for pair in pairs if pair["inliers"]), None)

    pair = wait_for(measured, within_s=120, what="a pair that was measured in its images")
    url = f"{stack.url()}/api/v1/pairs/{pair['a']}/{pair['b']}/overlay.png?side=a"
    answer = httpx.get(url, timeout=10).raise_for_status()
    assert answer.headers["content-type"] == "image/png"
    picture = cv2.imdecode(np.frombuffer(answer.content, np.uint8), cv2.IMREAD_COLOR)
    assert picture is not None
    assert min(picture.shape[:2]) >= 240
    assert picture.std() > 10


def test_the_pages_are_there_and_show_every_rover(stack: Stack) -> None:
    page = httpx.get(f"{stack.url()}/", follow_redirects=True, timeout=10).raise_for_status()
    assert page.url.path == "/dashboard/"
    assert "Swarm - Covista" in page.text
    told = httpx.get(f"{stack.url()}/dashboard/data/swarm", timeout=10).raise_for_status().json()
    assert set(told["robots"]["id"]) == EVERY_ROBOT


def test_nobody_runs_as_root(stack: Stack) -> None:
    assert stack.run("exec", "-T", "station", "id", "-un").strip() == "covista"
    assert stack.run("exec", "-T", "r1", "id", "-un").strip() == "covista"


def test_the_history_is_written_to_the_volume(stack: Stack) -> None:
    script = f"import sqlite3; print(sqlite3.connect('{DATABASE}').execute('pragma page_count').fetchone()[0])"
    assert int(stack.run("exec", "-T", "station", "python", "-c", script)) > 1


def test_both_end_cleanly_when_asked(stack: Stack) -> None:
    stack.run("stop", "--timeout=10")
    for service in ("r1", "r2", "r3", "station"):
        state = ["docker", "inspect", "--format", "{{.State.ExitCode}}", stack.container(service)]
        code = subprocess.run(state, check=True, capture_output=True, text=True).stdout.strip()
        assert (service, code) == (service, "0")

"""Zenoh with certificates in containers, as docs/containers.md has it: who is let in, and who is not."""

import os
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import httpx
import pytest

from tests.compose.conftest import running
from tests.compose.stack import ROOT, Stack, of_this_tree, said, wait_for
from tests.system.certificates import make_certificates

pytestmark = [pytest.mark.compose, pytest.mark.timeout(1800)]

ROBOTS = ("r1", "r2", "r3")
HANDSHAKE = 'covista_link_refused_total{reason="handshake"} '


@dataclass(frozen=True)
class Locked:
    """A deployment behind a locked door, and the folder that its certificates lie in."""

    stack: Stack
    certs: Path
    url: str

    def ask(self, path: str) -> Any:
        return httpx.get(f"{self.url}/api/v1/{path}", timeout=10).raise_for_status().json()

    def robots(self) -> dict[str, dict[str, Any]]:
        """Reports by robot."""
        return {report["id"]: report for report in self.ask("robots")["robots"]}

    def grouped(self) -> set[str]:
        return {robot for group in self.ask("groups")["groups"] for robot in group["robots"]}

    def refused(self) -> float:
        """How many handshakes failed."""
        lines = httpx.get(f"{self.url}/metrics", timeout=10).raise_for_status().text.splitlines()
        return float(next(line for line in lines if line.startswith(HANDSHAKE)).removeprefix(HANDSHAKE))

    def let_in(self, *robots: str) -> None:
        """Put another list in the place of the one that is there."""
        beside = self.certs / "robots.new"
        beside.write_text("".join(f"{robot}\n" for robot in robots))
        beside.chmod(0o644)
        beside.rename(self.certs / "robots.txt")


def until(holds: Callable[[], bool], what: str, within_s: float = 60) -> None:
    wait_for(lambda: holds() or None, within_s, what)


@pytest.fixture(scope="module")
def locked(images: None, tmp_path_factory: pytest.TempPathFactory, request: pytest.FixtureRequest) -> Iterator[Locked]:
    certs = make_certificates(tmp_path_factory.mktemp("locked") / "certs", *ROBOTS)
    if os.geteuid():
        # They cannot be given to the containers' user.
        for name in ("station", *ROBOTS):
            (certs / f"{name}.key").chmod(0o644)
    overlay = ROOT / "docker" / "compose.tls.yaml"
    settings = {"COVISTA_LINK": "tls/0.0.0.0:7447", "COVISTA_ROVERS_CONNECT": "tls/station:7447"}
    stack = of_this_tree("locked", (overlay,), COVISTA_CERTS=str(certs), COVISTA_LIVE_AFTER_S="2", **settings)
    request.config.stash[running] = stack
    try:
        stack.start()
        yield Locked(stack, certs, stack.url())
    finally:
        stack.take_down()


@pytest.fixture
def plain_rover(locked: Locked) -> Iterator[str]:
    """A rover of the same network that has no certificate."""
    project, tag = (locked.stack.environment[name] for name in ("COMPOSE_PROJECT_NAME", "COVISTA_TAG"))
    name = f"{project}_plain"
    command = ["docker", "run", "--detach", "--init", f"--name={name}", f"--network={project}_rovers"]
    command += [f"covista-rover:{tag}", "covista", "swarm", "--robots=4", "--only=r4", "--connect=tcp/station:7447"]
    try:
        said(command, within_s=60)
        yield "r4"
    finally:
        said(["docker", "rm", "--force", name], within_s=60)


def test_robots_with_certificates_come_to_stand_in_groups(locked: Locked) -> None:
    until(lambda: locked.grouped() == set(ROBOTS), "every rover in a group")


def test_a_rover_without_a_certificate_is_refused_and_counted(locked: Locked, plain_rover: str) -> None:
    """It is no robot to the station; each of its tries counts as a handshake that failed."""
    before = locked.refused()
    until(lambda: locked.refused() > before + 2, "tries that are counted")
    assert plain_rover not in locked.robots()
    assert "received corrupt message" in locked.stack.logs()


def test_a_robot_that_is_taken_off_the_list_is_out_and_others_stay(locked: Locked) -> None:
    """What it goes on sending does not count any more; a list that is put in the place of the old one is seen."""
    until(lambda: locked.grouped() == set(ROBOTS), "every rover in a group")
    locked.let_in("r1", "r2")
    until(lambda: locked.robots()["r3"]["status"] == "stale", "r3 is not heard of")
    before = locked.robots()

    def go_on() -> bool:
        now = locked.robots()
        return all(now[robot]["keyframes"]["used"] > before[robot]["keyframes"]["used"] for robot in ("r1", "r2"))

    until(go_on, "new keyframes of the others")
    until(lambda: all(locked.robots()[robot]["status"] == "live" for robot in ("r1", "r2")), "the others are live")
    assert locked.robots()["r3"]["keyframes"]["received"] == before["r3"]["keyframes"]["received"]


def test_the_key_of_the_authority_cannot_be_read_by_the_station(locked: Locked) -> None:
    if os.geteuid():
        pytest.skip("keys are their owner's: only root can give them to somebody else")
    look = "import os; print(os.path.exists('/certs/ca.key'), os.access('/certs/ca.key', os.R_OK))"
    assert locked.stack.run("exec", "-T", "station", "python", "-c", look).split() == ["True", "False"]

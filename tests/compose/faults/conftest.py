from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import suppress
from typing import Any

import pytest

from tests.compose.faults.field import ROVERS, TOPICS, Field, check_sums, deploy, heard, last_accounts, said_by
from tests.compose.faults.record import Record

RUNS = int(os.environ.get("COVISTA_FAULT_RUNS", "1"))
SETTLED_S = 20.0
kept = pytest.StashKey[Record]()


class Deployments:
    """At most one at a time: it goes when another is asked for."""

    def __init__(self) -> None:
        self._present: Field | None = None

    def of(self, *, behind: bool) -> Field:
        if self._present is None or self._present.behind != behind:
            self.take_down()
            self._present = deploy(behind=behind)
        return self._present

    def take_down(self) -> None:
        if self._present is not None:
            self._present.take_down()
            self._present = None


class Books:
    """What rovers say that they have sent, against what the station says, from one moment on."""

    def __init__(self, field: Field) -> None:
        self._field = field
        # Boots that ended before, and accounts up to then.
        self._boots = {each["boot"] for robot in ROVERS for each in self._accounts(robot)}
        self._before = {robot: report for robot, report in field.robots().items() if robot in ROVERS}
        self._killed: dict[str, int] = {}
        self._anew = False

    def killed(self, robot: str) -> None:
        """Its last second is known to nobody but the station."""
        self._killed[robot] = self._killed.get(robot, 0) + 1

    def station_anew(self) -> None:
        """The station has begun its accounts anew."""
        self._anew = True

    def close(self, beside: list[dict[str, Any]] | None = None) -> dict[str, int]:
        """Have the rovers end, and compare; gives how many keyframes are missing of each."""
        self._field.stop(*ROVERS)
        sent = {robot: self._sent(robot, beside or []) for robot in ROVERS}
        # What came last may still wait for its turn.
        with suppress(TimeoutError):
            self._field.until(lambda: self._settled(sent), SETTLED_S, "all that was sent is on the books")
        reports, missing = self._field.robots(), {}
        for robot in ROVERS:
            report, before = reports[robot], self._before_of(robot)
            check_sums(report)
            for topic in TOPICS:
                counted = self._counted(report, topic)
                # Up to ten poses and two keyframes a second since the last account, and a late second.
                slack = self._killed.get(robot, 0) * (30 if topic == "poses" else 6)
                least = sent[robot][topic]
                assert least <= counted <= least + slack, (robot, topic, least, counted, report[topic], before)
            missing[robot] = report["keyframes"]["missing"] - (before["keyframes"]["missing"] if before else 0)
        return missing

    def _sent(self, robot: str, beside: list[dict[str, Any]]) -> dict[str, int]:
        fresh = [each for each in self._accounts(robot) if each["boot"] not in self._boots]
        fresh += [each for each in beside if each["robot"] == robot]
        return {topic: sum(each[topic] for each in fresh) for topic in TOPICS}

    def _before_of(self, robot: str) -> dict[str, Any] | None:
        return None if self._anew else self._before.get(robot)

    def _counted(self, report: dict[str, Any], topic: str) -> int:
        before = self._before_of(report["id"])
        return heard(report, topic) - (heard(before, topic) if before else 0)

    def _settled(self, sent: dict[str, dict[str, int]]) -> bool:
        known = self._field.robots()
        return all(
            self._counted(known[robot], topic) >= sent[robot][topic] and known[robot][topic]["waiting"] == 0
            for robot in ROVERS
            for topic in TOPICS
        )

    def _accounts(self, robot: str) -> list[dict[str, Any]]:
        return last_accounts(said_by(self._field.container(robot)))


def pytest_generate_tests(metafunc: pytest.Metafunc) -> None:
    """Timed tests run COVISTA_FAULT_RUNS times."""
    if "run" in metafunc.fixturenames:
        metafunc.parametrize("run", range(RUNS))


@pytest.fixture(scope="session")
def deployments(images: None) -> Iterator[Deployments]:
    made = Deployments()
    try:
        yield made
    finally:
        made.take_down()


@pytest.fixture
def behind() -> bool:
    """Whether router, PostgreSQL and Dask are in it; test modules overrule this."""
    return False


@pytest.fixture
def field(deployments: Deployments, behind: bool, books: Books) -> Iterator[Field]:
    """A swarm at work, whose containers say no traceback until the test is over."""
    deployed = deployments.of(behind=behind)
    deployed.start(*ROVERS)
    deployed.until(deployed.at_work, 60, "the swarm at work")
    yield deployed
    log = deployed.log()
    assert "Traceback (most recent call last)" not in log, log[-20_000:]


@pytest.fixture
def books(deployments: Deployments, behind: bool) -> Books:
    """Accounts from before the rovers of this test start."""
    deployed = deployments.of(behind=behind)
    deployed.stop(*ROVERS)
    return Books(deployed)


@pytest.fixture(scope="session")
def record(request: pytest.FixtureRequest) -> Record:
    return request.config.stash.setdefault(kept, Record())


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter, config: pytest.Config) -> None:
    """Show what was measured."""
    found = config.stash.get(kept, None)
    lines = list(found.lines()) if found is not None else []
    if lines:
        terminalreporter.section("faults")
        for line in lines:
            terminalreporter.write_line(line)

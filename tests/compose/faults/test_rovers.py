"""Rovers that die, stand still and start anew."""

import threading

import pytest
import zenoh
from covista_clients.rover.link import follow
from covista_schemas import keys
from covista_schemas.reports import OwnGroupReport
from covista_schemas.zenoh_config import config

from tests.compose.faults.conftest import Books
from tests.compose.faults.field import GONE_AFTER_S, LEASE_S, LIVE_AFTER_S, Field, docker
from tests.compose.faults.record import Record, Row

pytestmark = [pytest.mark.compose, pytest.mark.timeout(1800)]

# Beside the documented times: asking, and a machine that does other things too.
LATE_S = 10.0
OTHERS = ("r2", "r3", "r4")


class Told:
    """The groups that one robot is told of, as a subscriber outside of the containers hears them."""

    def __init__(self, field: Field, robot: str) -> None:
        self._heard = threading.Condition()
        self._robots: list[str] | None = None
        self._session = zenoh.open(config("client", connect=[field.link]))
        self._subscriber = follow(self._session, keys.own_group("default", robot), self._hear)

    def _hear(self, sample: zenoh.Sample) -> None:
        with self._heard:
            self._robots = OwnGroupReport.read(sample.payload.to_bytes()).robots
            self._heard.notify_all()

    def until_without(self, robot: str, within_s: float) -> None:
        """Wait until the newest group told of does not have this robot in it."""
        with self._heard:
            told = self._heard.wait_for(lambda: self._robots is not None and robot not in self._robots, within_s)
            assert told, self._robots

    def close(self) -> None:
        self._subscriber.undeclare()
        self._session.close()


def undisturbed(field: Field) -> bool:
    known = field.robots()
    return all(known[robot]["status"] == "live" for robot in OTHERS)


def lapses(field: Field, silent_after_s: float) -> dict[str, float]:
    """Seconds until r1 is stale and gone; meanwhile the others are live, and then they are told."""
    told = [Told(field, robot) for robot in OTHERS]
    try:
        stale_s = field.until_status("r1", "stale", silent_after_s + LIVE_AFTER_S + LATE_S)
        field.until(lambda: undisturbed(field), LATE_S, "the others as before")
        gone_s = stale_s + field.until_status("r1", "gone", GONE_AFTER_S + LATE_S)
        assert gone_s > LIVE_AFTER_S + GONE_AFTER_S - 1
        field.until(lambda: undisturbed(field), LATE_S, "the others as before")
        field.until(lambda: "r1" not in field.grouped(), 2, "r1 in no group")
        for each in told:
            each.until_without("r1", 5)
    finally:
        for each in told:
            each.close()
    return {"stale": stale_s, "gone": gone_s}


def test_a_rover_that_is_killed(field: Field, books: Books, record: Record, run: int) -> None:
    """Its mark turns stale, then gone; its group goes on without it and is told so; started, it stands in a group again
    under a new boot."""
    boot = field.robots()["r1"]["boot"]
    field.kill("r1")
    books.killed("r1")
    noticed = lapses(field, 0.5)
    field.start("r1")
    back_s = field.until(lambda: field.at_work(("r1",)) and field.robots()["r1"]["boot"] != boot, 30, "r1 back")
    missing = books.close()
    record.add(
        Row("rover killed", "stale, then gone; live under a new boot", noticed, back_s, f"{missing['r1']} keyframes")
    )
    assert missing["r2"] == missing["r3"] == missing["r4"] == 0


def test_a_rover_that_stands_still(field: Field, books: Books, record: Record, run: int) -> None:
    """As one that is killed, but its link has to fall silent first; when it goes on it is live under its old boot."""
    boot = field.robots()["r1"]["boot"]
    docker("pause", field.container("r1"))
    try:
        noticed = lapses(field, LEASE_S)
    finally:
        docker("unpause", field.container("r1"))
    back_s = field.until(lambda: field.at_work(("r1",)), 30, "r1 back")
    assert field.robots()["r1"]["boot"] == boot
    missing = books.close()
    record.add(Row("rover paused", "stale, then gone; live again", noticed, back_s, f"{missing['r1']} keyframes"))
    assert missing["r2"] == missing["r3"] == missing["r4"] == 0


def test_a_rover_that_boots_anew(field: Field, books: Books, record: Record, run: int) -> None:
    """It stays in its place, at most stale for a moment, and is never gone: its boot is another one."""
    boot = field.robots()["r1"]["boot"]
    field.kill("r1")
    books.killed("r1")
    field.start("r1")
    back_s = field.until(lambda: field.at_work(("r1",)) and field.robots()["r1"]["boot"] != boot, 30, "r1 back")
    field.until(lambda: undisturbed(field), LATE_S, "the others as before")
    missing = books.close()
    record.add(Row("rover rebooted", "stale for a moment; a new boot", {}, back_s, f"{missing['r1']} keyframes"))

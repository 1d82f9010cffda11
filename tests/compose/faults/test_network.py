"""Networks that break, and one that is slow."""

import shutil
import subprocess
import threading

import pytest

from tests.compose.faults.conftest import Books
from tests.compose.faults.field import GONE_AFTER_S, LEASE_S, LIVE_AFTER_S, Field, docker
from tests.compose.faults.record import Record, Row

pytestmark = [pytest.mark.compose, pytest.mark.timeout(1800)]

LATE_S = 10.0
CUT_S = 20.0
# A keyframe of the simulated rovers has some 20 kB, two of which go out a second; ten poses take 2 kB.
NARROW = ("tbf", "rate", "120kbit", "burst", "8kb", "limit", "64kb")


def test_a_rover_that_leaves_the_network(field: Field, books: Books, record: Record, run: int) -> None:
    """Its mark turns stale, then gone; in the network again it is live within seconds, under its old boot."""
    boot = field.robots()["r1"]["boot"]
    field.cut("r1")
    try:
        stale_s = field.until_status("r1", "stale", LEASE_S + LIVE_AFTER_S + LATE_S)
        gone_s = stale_s + field.until_status("r1", "gone", GONE_AFTER_S + LATE_S)
        field.until(lambda: field.at_work(("r2", "r3", "r4")), LATE_S, "the others as before")
    finally:
        field.join("r1")
    back_s = field.until(lambda: field.at_work(("r1",)), 30, "r1 back")
    assert field.robots()["r1"]["boot"] == boot
    missing = books.close()
    noticed = {"stale": stale_s, "gone": gone_s}
    record.add(
        Row("rover off the network", "stale, then gone; live again", noticed, back_s, f"{missing['r1']} keyframes")
    )


def test_half_of_the_rovers_are_cut_off(field: Field, books: Books, record: Record, run: int) -> None:
    """Two of four are gone after some seconds and stand in no group; the other two go on. After 20 s all are back."""
    half = ("r1", "r2")
    for robot in half:
        field.cut(robot)
    over = threading.Timer(CUT_S, lambda: [field.join(robot) for robot in half])
    over.start()
    try:
        stale_s = max(field.until_status(robot, "stale", LEASE_S + LIVE_AFTER_S + LATE_S) for robot in half)
        field.until(lambda: field.grouped() == {"r3", "r4"}, CUT_S - 6, "groups of those that are there")
        field.until(lambda: field.at_work(("r3", "r4")), LATE_S, "the others as before")
    finally:
        over.join()
    back_s = field.until(field.at_work, 30, "everybody back")
    missing = books.close()
    lost = f"{max(missing['r1'], missing['r2'])} keyframes a rover at most"
    record.add(Row("half of the rovers cut off", "stale, then gone; live again", {"stale": stale_s}, back_s, lost))
    assert missing["r3"] == missing["r4"] == 0


def test_a_rover_with_a_slow_link(field: Field, books: Books, record: Record) -> None:
    """It stays live and its poses keep coming, while of its keyframes fewer do."""
    tools = [shutil.which(name) for name in ("nsenter", "tc")]
    if not all(tools):
        pytest.skip("tc and nsenter are not on this machine")
    pid = docker("inspect", "--format={{.State.Pid}}", field.container("r1")).strip()
    shape = ["nsenter", "--target", pid, "--net", "tc", "qdisc"]
    asked = subprocess.run([*shape, "add", "dev", "eth0", "root", *NARROW], check=False, capture_output=True, text=True)
    if asked.returncode:
        pytest.skip(f"the link cannot be made slow here: {asked.stderr.strip()}")
    before = field.robots()["r1"]
    poses = before["poses"]["received"]
    # So many poses are ten seconds of them, or somewhat more.
    took_s = field.until(lambda: field.robots()["r1"]["poses"]["received"] >= poses + 80, 40, "eighty poses")
    after = field.robots()["r1"]
    field.until_status("r1", "live", LATE_S)
    keyframes = (after["keyframes"]["received"] - before["keyframes"]["received"]) / took_s
    assert keyframes < 1.5, keyframes
    assert 80 / took_s > 5
    subprocess.run([*shape, "del", "dev", "eth0", "root"], check=True)
    back = field.robots()["r1"]["keyframes"]["received"]
    back_s = field.until(lambda: field.robots()["r1"]["keyframes"]["received"] >= back + 2, 15, "keyframes again")
    missing = books.close()
    seen = f"live; {80 / took_s:.0f} poses and {keyframes:.1f} keyframes a second"
    record.add(Row("slow link (120 kbit/s)", seen, {}, back_s, f"{missing['r1']} keyframes"))

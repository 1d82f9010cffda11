"""Senders whose clocks are off, who share a name, or send what they should not."""

import pytest

from tests.compose.faults.conftest import Books
from tests.compose.faults.field import TOPICS, Field, check_sums, heard
from tests.compose.faults.record import Record, Row

pytestmark = [pytest.mark.compose, pytest.mark.timeout(1800)]

DAY_S = 86_400
# How long a machine may be busy with what was just sent.
LATE_S = 10.0


def swarm(robot: str, field: Field, *more: str) -> tuple[str, ...]:
    send = ("--robots", "6", "--only", robot, "--accounts", "1", "--connect", field.endpoint)
    return ("covista", "swarm", *send, *more)


def test_clocks_a_day_ahead_and_a_day_behind(field: Field, books: Books, record: Record) -> None:
    """Both rovers are live and grouped, and how far their clocks are off is shown."""
    field.beside("ahead", *swarm("r5", field, "--clock-offset", str(DAY_S)))
    field.beside("behind", *swarm("r6", field, "--clock-offset", str(-DAY_S)))
    took_s = field.until(lambda: field.at_work(("r5", "r6")), 60, "both at work")
    known = field.robots()
    assert known["r5"]["clock_offset_s"] == pytest.approx(DAY_S, abs=10)
    assert known["r6"]["clock_offset_s"] == pytest.approx(-DAY_S, abs=10)
    accounts = field.end_beside("ahead") + field.end_beside("behind")
    known = field.robots()
    for account in accounts:
        for topic in TOPICS:
            assert heard(known[account["robot"]], topic) == account[topic]
        check_sums(known[account["robot"]])
    books.close()
    record.add(Row("clocks a day off", "clock_offset_s; live, grouped", {"shown": took_s}))


def test_two_rovers_of_one_name(field: Field, books: Books, record: Record) -> None:
    """One is heard, `last_problem` of the robot says that another sends beside it, and everybody else goes on."""
    field.beside("double", *swarm("r1", field))

    def told() -> bool:
        return "do two robots share this id?" in (field.robots()["r1"]["last_problem"] or "")

    noticed_s = field.until(told, 60, "a problem is told of")
    field.until(lambda: field.at_work(("r2", "r3", "r4")), LATE_S, "the others as before")
    twin = field.end_beside("double")
    back_s = field.until(lambda: field.at_work(("r1",)), 30, "the first one alone is heard again")
    books.close(twin)
    record.add(Row("two rovers of one name", "last_problem", {"told": noticed_s}, back_s, "replaced ones"))


def test_garbage_at_full_speed(field: Field, books: Books, record: Record) -> None:
    """The others go on as if nothing were; each piece is counted at the robot that sent it, with a reason."""
    sent = field.send("garbage", "5")
    field.until(field.at_work, LATE_S, "the others as before")

    def counted() -> bool:
        report = field.robots()["g1"]
        return bool(report["keyframes"]["received"] == sent["garbage"])

    field.until(counted, 30, "all of it counted")
    report = field.robots()["g1"]
    check_sums(report)
    assert report["keyframes"]["dropped"] == {"malformed": sent["garbage"]}
    assert max(books.close().values()) == 0
    record.add(Row("garbage at full speed", f"{sent['garbage'] / 5:.0f} a second dropped, by reason"))


def test_image_bombs(field: Field, books: Books, record: Record) -> None:
    """Pictures that would unpack to gigabytes are refused by their heads, and counted; nobody is disturbed."""
    sent = field.send("bombs")
    field.until(lambda: field.robots()["b1"]["keyframes"]["received"] == sent["keyframes"], 30, "all counted")
    report = field.robots()["b1"]
    check_sums(report)
    assert set(report["keyframes"]["dropped"]) <= {"image_too_large", "bad_image"}
    assert report["keyframes"]["used"] == 0
    field.until(field.at_work, LATE_S, "the others as before")
    assert max(books.close().values()) == 0
    record.add(Row("image bombs", "dropped: image_too_large, bad_image"))


def test_a_rover_of_another_patch_version(field: Field, books: Books, record: Record) -> None:
    """Fields that nobody here knows are passed over: its messages are used."""
    sent = field.send("unknown_fields")
    field.until(lambda: field.robots()["u1"]["keyframes"]["waiting"] == 0, 30, "nothing waits")
    report = field.robots()["u1"]
    check_sums(report)
    for topic in TOPICS:
        assert heard(report, topic) == sent[topic]
        assert report[topic]["dropped"] == {}
        assert report[topic]["used"] > 0
    books.close()
    record.add(Row("unknown fields", "used like others"))

from dataclasses import dataclass

import pytest
from covista_service.link.admission import Admission
from covista_service.link.strangers import Strangers

ADMISSION = Admission(frozenset({"r1", "r2"}), frozenset({"station"}), "")


@dataclass(frozen=True)
class Line:
    auth_identifier: str | None
    dst: str


class Door:
    """A clock that is set, and who has stood there."""

    def __init__(self) -> None:
        self.now_s = 0.0
        self.strangers = Strangers(lambda: self.now_s)

    def look(self, *links: Line, after_s: float = 1.0, alive: tuple[str, ...] | None = ()) -> dict[str, int]:
        self.now_s += after_s
        self.strangers.look(links, ADMISSION, alive)
        return dict(self.strangers.refused)


def test_who_is_not_listed_is_counted_once_a_link_and_told_of(caplog: pytest.LogCaptureFixture) -> None:
    door, r3 = Door(), Line("r3", "tls/10.0.0.3:1")
    assert door.look(r3) == door.look(r3) == {"unlisted": 1, "mute": 0}
    assert door.look() == {"unlisted": 1, "mute": 0}
    assert door.look(r3, Line(None, "tls/10.0.0.4:1")) == {"unlisted": 3, "mute": 0}
    told = [record.fields for record in caplog.records]
    assert told[0] == {"robot": "r3", "address": "tls/10.0.0.3:1"}
    assert len(told) == 3


def test_a_robot_that_is_not_alive_under_its_own_name_is_told_of_after_a_while() -> None:
    door, r1 = Door(), Line("r1", "tls/10.0.0.1:1")
    assert door.look(r1)["mute"] == 0
    assert door.look(r1, after_s=9)["mute"] == 0
    assert door.look(r1)["mute"] == 1
    assert door.look(r1, after_s=60)["mute"] == 1


def test_robots_that_are_alive_and_stations_are_no_strangers() -> None:
    door, links = Door(), (Line("r1", "tls/10.0.0.1:1"), Line("station", "tls/10.0.0.2:1"))
    for _ in range(3):
        assert door.look(*links, after_s=20, alive=("r1",)) == {"unlisted": 0, "mute": 0}


def test_where_nobody_knows_who_is_alive_nobody_is_mute() -> None:
    door, r1 = Door(), Line("r1", "tls/10.0.0.1:1")
    for _ in range(3):
        assert door.look(r1, after_s=20, alive=None)["mute"] == 0

from collections import Counter
from dataclasses import replace
from typing import Any

import pytest
from covista_schemas import codec
from covista_schemas.reports import Health, PartHealth, Status
from covista_service.access import Refusal
from covista_service.api.connection import CROWD, SILENT
from covista_service.api.delivery import BUSY, SLOW
from covista_service.api.stream import BEHIND
from covista_service.dashboard.checkup import Checkup, Timings
from covista_service.dashboard.health_words import told
from covista_service.dashboard.reasons import (
    ACCESS_REFUSED,
    DROPPED,
    GIVEN_UP,
    LINK_REFUSED,
    TROUBLES,
    TURNED_AWAY,
    UNTOLD,
)
from covista_service.link.mailbox import OVERFLOW, TOO_MANY_ROBOTS, UNKNOWN_ROBOT, Depths
from covista_service.link.strangers import MUTE, UNLISTED
from covista_service.link.zenoh_log import HANDSHAKE
from covista_service.loop import CrewStatus, SinkStatus
from covista_service.loop.vitals import Vitals
from covista_service.station.census import Census
from covista_service.station.corrections import Correction
from covista_service.station.events import Topic
from covista_service.station.ledger import FORGOTTEN, Counts
from covista_service.station.snapshot import Reason, RobotView
from covista_service.station.workload import Workload
from covista_service.telemetry import WORKER_FAILED, Telemetry

READY = {name: PartHealth(status="ready") for name in ("link", "workers", "store", "loop", "access")}


def robot(name: str, **details: Any) -> RobotView:
    blank: dict[str, Any] = dict.fromkeys(RobotView.__dataclass_fields__) | {
        "id": name,
        "status": Status.LIVE,
        "keyframes": Counts(),
        "poses": Counts(),
    }
    return RobotView(**{**blank, **details})


def checkup(**details: Any) -> Checkup:
    """A station at which all is well, but for `details`."""
    robots = details.get("robots", [robot("r1")])
    well = Checkup(
        health=Health(status="ready", parts=READY),
        vitals=Vitals(Depths(0, 0, 0), CrewStatus("threads", 2), {"history": SinkStatus(0, 5, 0)}, {}, sessions=1),
        census=Census(
            accounts={"keyframe": Counts(), "pose": Counts()},
            robots=Counter(view.status for view in robots),
            ungrouped={},
            clocks_off=0,
            groups=2,
            revision=1,
            matrix_revision=1,
            keyframes=1,
            pairs=0,
            workload=Workload(waiting={"fresh": 3}),
        ),
        robots=robots,
        summary=Telemetry().summary(),
        timings=Timings(),
        refused={},
        given_up={},
        listeners=0,
        pages=1,
        most_pages=256,
    )
    return replace(well, **details)


def needs(found: Checkup) -> list[tuple[str, str]]:
    return [(each["level"], each["says"]) for each in told(found)["attention"]]


def count(found: Checkup, key: str) -> dict[str, Any]:
    found_counts: list[dict[str, Any]] = told(found)["counts"]
    (one,) = (each for each in found_counts if each["key"] == key)
    return one


def test_where_all_is_well_nothing_needs_attention() -> None:
    found = told(checkup())
    assert (found["sentence"], found["attention"]) == ("Every part of the station works.", [])
    assert all(part["todo"] == part["means"] == "" for part in found["parts"])


def test_the_worst_part_comes_first_with_what_it_means_and_what_to_do() -> None:
    parts = READY | {
        "workers": PartHealth(status="starting", detail="2 threads, loading compiled code"),
        "store": PartHealth(status="degraded", detail="no such host; 12 entries wait"),
    }
    broken = checkup(health=Health(status="degraded", parts=parts))
    found = told(broken)
    assert [part["name"] for part in found["parts"][:2]] == ["store", "workers"]
    assert found["sentence"] == "The station goes on, but something is wrong: Workers, Database."
    (first, says), (second, _) = needs(broken)
    assert (first, second) == ("bad", "warn")
    assert says.startswith("Database is degraded: no such host; 12 entries wait.")
    assert "history may get a gap" in says
    assert "disk has room" in found["attention"][0]["todo"]


@pytest.mark.parametrize(
    ("status", "words"), [("starting", "is starting: Main loop"), ("stopping", "is stopping, or has stopped working")]
)
def test_a_station_that_begins_or_ends_says_so(status: str, words: str) -> None:
    parts = {"loop": PartHealth.model_validate({"status": status})}
    assert words in told(checkup(health=Health.model_validate({"status": status, "parts": parts})))["sentence"]


def test_a_part_that_is_not_known_here_is_told_of_all_the_same() -> None:
    found = told(checkup(health=Health(status="degraded", parts={"mast": PartHealth(status="degraded")})))
    assert found["parts"][0]["title"] == "mast"
    assert "mast is degraded." in found["attention"][0]["says"]


def test_a_station_that_no_robot_speaks_to_says_so_without_alarm() -> None:
    assert needs(checkup(robots=[])) == [("note", "No robot has been heard yet.")]
    assert told(checkup(robots=[]))["robots"] == "No robot has been heard yet."


@pytest.mark.parametrize(
    ("statuses", "groups", "ungrouped", "words"),
    [
        ({"live": 1}, 1, {}, "1 robot (1 live) in 1 group."),
        ({"live": 3, "stale": 1}, 2, {}, "4 robots (3 live, 1 stale) in 2 groups."),
        ({"live": 2, "gone": 1}, 1, {"gone": 1}, "3 robots (2 live, 1 gone), 2 of them in 1 group."),
        ({"live": 3}, 2, {"no_pose": 1}, "3 robots (3 live), 2 of them in 2 groups. 1 has told no pose yet."),
        ({"live": 2}, 0, {"no_pose": 2}, "2 robots (2 live), in no group. 2 have told no pose yet."),
    ],
)
def test_robots_are_counted_by_presence(
    statuses: dict[str, int], groups: int, ungrouped: dict[Reason, int], words: str
) -> None:
    there = Counter({Status(status): count for status, count in statuses.items()})
    census = replace(checkup().census, robots=there, groups=groups, ungrouped=ungrouped)
    assert told(checkup(census=census))["robots"] == words


def test_a_need_keeps_its_key_while_its_numbers_change() -> None:
    def keys(more: int) -> list[str]:
        vitals = checkup().vitals
        sinks = {"history": SinkStatus(501 + more, told=0, lost=0), "zenoh": SinkStatus(501 + more, 0, 0)}
        vitals = replace(vitals, mail=Depths(3, 4, 200_000_000 + more * 10**6), sinks=sinks)
        robots = [robot(f"r{k}", clock_offset_s=11.0, correction=Correction(4, 1, 3 + more)) for k in range(1 + more)]
        parts = READY | {"store": PartHealth(status="degraded", detail=f"{more} entries wait")}
        health = Health(status="degraded", parts=parts)
        found = checkup(health=health, vitals=vitals, robots=robots, pages=250 + more)
        return [each["key"] for each in told(found)["attention"]]

    assert keys(0) == keys(3)
    assert len(set(keys(0))) == 7


def test_clocks_that_are_off_are_told_with_their_robots_and_small_offsets_are_not() -> None:
    robots = [robot("r1", clock_offset_s=9.9), robot("r2", clock_offset_s=-40.0), robot("r3", clock_offset_s=11.0)]
    found = told(checkup(robots=robots))
    assert found["attention"][0]["says"] == "r2 and r3 have a clock that is off by more than 10 s."
    assert found["attention"][0]["robots"] == ["r2", "r3"]
    assert [(each["robot"], each["clock_s"]) for each in found["odd_robots"]] == [("r2", -40.0), ("r3", 11.0)]


def test_of_many_robots_some_are_named() -> None:
    robots = [robot(f"r{number}", clock_offset_s=100.0) for number in range(1, 9)]
    (one,) = told(checkup(robots=robots))["attention"]
    assert one["says"].startswith("r1, r2, r3, r4, r5 and 3 more have a clock")
    assert len(one["robots"]) == 5


def test_poses_count_as_wrong_when_pictures_say_so_again_and_again() -> None:
    robots = [robot("r1", correction=Correction(4, 1, 2)), robot("r2", correction=Correction(1.26, 0.125, 3))]
    found = told(checkup(robots=robots))
    (one,) = found["attention"]
    assert one["says"].startswith("r2 has poses that keep disagreeing")
    assert found["odd_robots"] == [{"robot": "r2", "clock_s": None, "off_deg": 1.3, "off_m": 0.12}]


def test_too_much_that_waits_is_told() -> None:
    vitals = checkup().vitals
    sinks = {"history": SinkStatus(waiting=501, told=0, lost=0), "zenoh": SinkStatus(500, 0, 0)}
    found = needs(checkup(vitals=replace(vitals, mail=Depths(3, 4, 200_000_000), sinks=sinks), pages=250))
    assert [says.split(":")[0].split(";")[0] for _, says in found] == [
        "200 MB of mail wait unopened",
        "501 entries wait for history.",
        "250 of 256 pages are open",
    ]


def test_drops_are_told_by_topic_and_reason_with_the_robots_that_have_most() -> None:
    robots = [robot(f"r{k}", poses=Counts(dropped={"bad_pose": k, "malformed": 1})) for k in range(5)]
    accounts: dict[Topic, Counts] = {
        "keyframe": Counts(),
        "pose": Counts(received=30, used=9, dropped={"bad_pose": 11, "malformed": 5}),
    }
    found = checkup(robots=robots, census=replace(checkup().census, accounts=accounts))
    one = count(found, "Dropped a pose/bad_pose")
    assert (one["total"], one["robots"]) == (11, [("r4", 4), ("r3", 3), ("r2", 2)])
    assert "quaternion" in one["means"]
    assert one["bearable"] == 0
    (_, fates) = told(found)["fates"]
    assert (fates["topic"], fates["received"], fates["dropped"]) == ("pose", 30, 16)


def test_what_was_refused_and_lost_is_told_with_its_meaning() -> None:
    vitals = replace(
        checkup().vitals,
        turned_away={"wrong_key": 2},
        link_refused={"unlisted": 3},
        crew=CrewStatus("processes", 4, lost=5, given_up=6),
        sinks={"history": SinkStatus(0, 0, 7)},
    )
    found = checkup(vitals=vitals, timings=Timings(faults={"loop": 8}), refused={"unknown": 9}, given_up={"slow": 10})
    totals = {each["key"]: each["total"] for each in told(found)["counts"] if each["total"]}
    assert totals == {
        "Turned away on zenoh/wrong_key": 2,
        "Not let in on zenoh/unlisted": 3,
        "Trouble with workers/lost": 5,
        "Trouble with workers/given_up": 6,
        "News lost/history": 7,
        "Error of the station/loop": 8,
        "Not let in here/unknown": 9,
        "Client given up/slow": 10,
    }
    assert "is not in the list" in count(found, "Not let in on zenoh/unlisted")["means"]


def test_a_reason_without_words_is_counted_all_the_same() -> None:
    found = checkup(given_up={"bored": 1})
    assert count(found, "Client given up/bored")["means"] == UNTOLD.means


def test_every_reason_that_the_station_has_is_put_into_words() -> None:
    codes = {
        codec.MALFORMED, codec.WRONG_ID, codec.BAD_CAMERA, codec.BAD_POSE, codec.BAD_FEATURES, codec.NO_CONTENT,
        codec.UNKNOWN_DESCRIPTOR, codec.BAD_IMAGE, codec.IMAGE_TOO_LARGE, codec.TOO_LARGE, OVERFLOW, FORGOTTEN,
    }  # fmt: skip
    assert DROPPED.keys() == codes
    assert TURNED_AWAY.keys() == {"wrong_key", TOO_MANY_ROBOTS, UNKNOWN_ROBOT}
    assert LINK_REFUSED.keys() == {HANDSHAKE, UNLISTED, MUTE}
    assert ACCESS_REFUSED.keys() == {str(reason) for reason in Refusal}
    assert GIVEN_UP.keys() == {SLOW, SILENT, BEHIND, CROWD, BUSY}
    assert {"lost", "retried", "overdue", "given_up", WORKER_FAILED, "zenoh", "history", "missing"} <= TROUBLES.keys()


def test_what_waits_is_told_by_queue() -> None:
    found = checkup(summary=replace(Telemetry().summary(), under_way=7))
    waiting = {each["key"]: each["value"] for each in told(found)["waiting"]}
    assert waiting == {"mail": 0, "open": 0, "jobs": 7, "pairs.fresh": 3, "forecasts": 0, "news.history": 0}


def test_latencies_say_how_many_were_slow() -> None:
    timings = Timings(latency_sum_s=2.5, latencies=10, within_half_s=9)
    latency = told(checkup(timings=timings))["latency"]
    assert (latency["slow"], latency["count"], latency["p50_ms"]) == (1, 10, None)


def test_workers_that_work_elsewhere_than_they_should_say_why() -> None:
    crew = CrewStatus("dask", 8, warm=False, fallback="no scheduler", shipped_bytes=3_000_000, shipped_again=1)
    facts = dict(told(checkup(vitals=replace(checkup().vitals, crew=crew)))["facts"])
    assert facts["Workers"] == "8 jobs at a time, dask; still loading compiled code; no scheduler."
    assert facts["Sent to workers"] == "3 MB of features, 1 time again."
    assert facts["Database"] == "5 entries given to it, 0 waiting, 0 lost."

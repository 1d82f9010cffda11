"""What Prometheus is told: names and types as promtool wants them, numbers as in REST, and no count that falls."""

import re

import pytest
from covista_schemas.reports import Counters, Health, PartHealth, RobotsReport
from covista_service.station.events import MessageDropped
from covista_service.station.ledger import Counts

from tests.service.api.conftest import Desk
from tests.service.api.expositions import counts, families, values
from tests.service.station.scenes import Scene, pose

# Base units, in full.
_UNITS = re.compile(
    r"_(ms|millis\w*|micros\w*|us|ns|nanos\w*|minutes|hours|kb|kilobytes|mb|megabytes|mib|percent)(_|$)"
)
_TYPES = re.compile(r"_(gauge|counter|histogram|summary)(_|$)")


@pytest.fixture(scope="module")
def text(desk: Desk) -> str:
    response = desk.ask("/metrics")
    assert response.status_code == 200
    return response.text


def test_names_and_types_are_as_promtool_wants_them(text: str) -> None:
    for name, family in families(text).items():
        assert re.fullmatch(r"[a-z][a-z0-9_]*", name)
        assert family.documentation.strip()
        assert family.type in ("counter", "gauge", "histogram", "info")
        assert name.endswith("_total") is (family.type == "counter")
        assert not _UNITS.search(name)
        assert not _TYPES.search(name)
        if family.type == "histogram":
            assert name.endswith("_seconds")
        else:
            assert not re.search(r"_(count|sum|bucket)$", name)


def test_help_and_type_stand_once_before_the_samples_of_each(text: str) -> None:
    lines = text.splitlines()
    helped = [line.split()[2] for line in lines if line.startswith("# HELP")]
    typed = [line.split()[2] for line in lines if line.startswith("# TYPE")]
    assert helped == typed
    assert len(set(typed)) == len(typed)


def test_no_sample_stands_twice(text: str) -> None:
    samples = [line.rpartition(" ")[0] for line in text.splitlines() if not line.startswith("#")]
    assert len(set(samples)) == len(samples)


def test_no_robot_is_a_label(text: str) -> None:
    allowed = {"topic", "fate", "reason", "status", "queue", "kind", "sink", "part", "outcome", "where", "route", "le"}
    ours = [key for key in values(text) if key[0].startswith("covista_")]
    assert {name for _, labels in ours for name, _ in labels} <= allowed
    assert {value for _, labels in ours for _, value in labels}.isdisjoint({"r1", "r2", "r4"})


def test_the_numbers_are_those_of_the_parts(text: str, desk: Desk) -> None:
    told = values(text)
    for name, labels, value in [
        ("covista_messages_total", {"topic": "keyframe", "fate": "received"}, 2),
        ("covista_messages_total", {"topic": "pose", "fate": "used"}, 1),
        ("covista_messages_missing", {"topic": "pose"}, 0),
        ("covista_messages_waiting", {"topic": "keyframe"}, 0),
        ("covista_turned_away_total", {"reason": "wrong_key"}, 2),
        ("covista_robots", {"status": "live"}, 3),
        ("covista_robots", {"status": "gone"}, 0),
        ("covista_robots_ungrouped", {"reason": "gone"}, 0),
        ("covista_groups", {}, len(desk.scene.snapshot.groups.groups)),
        ("covista_revision", {}, desk.scene.snapshot.groups.revision),
        ("covista_matrix_revision", {}, desk.scene.snapshot.similarity.revision),
        ("covista_keyframes_held", {}, 2),
        ("covista_pair_records", {}, len(desk.scene.snapshot.records)),
        ("covista_mail_robots", {}, 3),
        ("covista_mail_messages", {}, 4),
        ("covista_mail_bytes", {}, 5),
        ("covista_link_sessions", {}, 13),
        ("covista_workers_capacity", {"kind": "threads"}, 2),
        ("covista_workers_warm", {"kind": "threads"}, 1),
        ("covista_workers_fallback", {"kind": "threads"}, 1),
        ("covista_workers_lost_total", {}, 1),
        ("covista_jobs_retried_total", {}, 6),
        ("covista_jobs_overdue_total", {}, 2),
        ("covista_jobs_given_up_total", {}, 3),
        ("covista_features_shipped_bytes_total", {}, 4),
        ("covista_features_shipped_again_total", {}, 0),
        ("covista_news_waiting", {"sink": "zenoh"}, 7),
        ("covista_news_told_total", {"sink": "zenoh"}, 8),
        ("covista_news_lost_total", {"sink": "history"}, 12),
        ("covista_surveys_outdated_total", {}, desk.scene.snapshot.workload.outdated),
        ("covista_forecasts_total", {}, desk.scene.snapshot.workload.forecasts),
        ("covista_part_ready", {"part": "link"}, 1),
        ("covista_surveys_total", {"outcome": "measured"}, 0),
        ("covista_faults_total", {"where": "loop"}, 0),
    ]:
        assert told[name, tuple(sorted(labels.items()))] == value, (name, labels)
    assert told["process_resident_memory_bytes", ()] > 1e6


def test_a_part_that_is_degraded_is_not_ready() -> None:
    health = Health(status="degraded", parts={"store": PartHealth(status="degraded", detail="full")})
    assert values(Desk(health=health).ask("/metrics").text)["covista_part_ready", (("part", "store"),)] == 0


def spoil(scene: Scene, robot: str, count: int) -> None:
    scene.receive(MessageDropped(robot, "pose", "malformed", "payload: not a Pose", scene.now_ns, False, count))


def reported(desk: Desk, topic: str) -> list[Counters]:
    report = RobotsReport.model_validate_json(desk.get("/robots").content)
    return [getattr(robot, f"{topic}s") for robot in report.robots]


@pytest.mark.parametrize("topic", ["keyframe", "pose"])
def test_sums_over_robots_are_those_of_rest(topic: str) -> None:
    desk = Desk()
    for number, robot in enumerate(["r1", "r2", "r3"]):
        desk.scene.send(robot, sequence=number)
        desk.scene.send_pose(robot, pose(number), sequence=2)
        spoil(desk.scene, robot, number + 1)
    desk.scene.settle()
    told = values(desk.ask("/metrics").text)
    for fate in ("received", "used", "replaced", "duplicate"):
        sample = told["covista_messages_total", (("fate", fate), ("topic", topic))]
        assert sample == sum(getattr(counters, fate) for counters in reported(desk, topic))
    for state in ("missing", "waiting"):
        sample = told[f"covista_messages_{state}", (("topic", topic),)]
        assert sample == sum(getattr(counters, state) for counters in reported(desk, topic))
    dropped = told.get(("covista_dropped_total", (("reason", "malformed"), ("topic", topic))), 0)
    assert dropped == sum(counters.dropped.get("malformed", 0) for counters in reported(desk, topic))


def test_no_count_falls_when_robots_are_forgotten_and_come_back() -> None:
    desk = Desk(Scene.of(live_after_s=1, gone_after_s=2, forget_after_s=4))
    before, known = counts(desk.ask("/metrics").text), set()
    for step in range(12):
        if step % 5 == 0:
            desk.scene.send("r1")
            desk.scene.send("r3", image=True)
            spoil(desk.scene, "r1", 3)
        desk.scene.send_pose("r2", pose(step))
        desk.scene.settle()
        after = counts(desk.ask("/metrics").text)
        fallen = [key for key, value in before.items() if after.get(key, -1) < value]
        assert fallen == []
        before = after
        known.add(frozenset(desk.scene.snapshot.robots))
        desk.scene.wait(1)
    # It has been put to the test.
    assert frozenset({"r2"}) in known
    assert frozenset({"r1", "r2", "r3"}) in known


def test_what_was_received_has_one_fate_also_after_a_robot_is_forgotten() -> None:
    scene = Scene.of(live_after_s=1, gone_after_s=2, forget_after_s=4)
    scene.send("r1")
    scene.send("r2", image=True)
    spoil(scene, "r1", 3)
    scene.wait(4)
    assert not scene.snapshot.robots
    for counted in scene.station.census().accounts.values():
        assert counted.received == counted.used + counted.replaced + counted.duplicate + sum(counted.dropped.values())
    assert scene.station.census().accounts["keyframe"] == Counts(received=2, used=1, dropped={"forgotten": 1})


def test_requests_are_counted_by_route_and_status_and_not_by_path() -> None:
    desk = Desk()
    desk.scene.send("r1")
    desk.scene.settle()
    desk.ask("/api/v1/robots/r1", method="HEAD")
    for path in ("/robots/r1", "/robots/r2", "/robots/r3", "/robots/NOT", "/groups"):
        desk.get(path)
    for number in range(50):
        desk.ask(f"/nothing/{number}")
    told = values(desk.ask("/metrics").text)

    def of(route: str, status: str) -> float | None:
        return told.get(("covista_requests_total", (("route", route), ("status", status))))

    assert of("/robots/{robot}", "200") == 2
    assert of("/robots/{robot}", "404") == 2
    assert of("/robots/{robot}", "422") == 1
    assert of("/groups", "200") == 1
    assert of("none", "404") == 50
    assert told["covista_request_seconds_count", (("route", "none"),)] == 50
    routes = {dict(labels)["route"] for name, labels in told if name == "covista_requests_total"}
    assert len(routes) == 3


def test_a_request_that_breaks_is_counted_as_such(monkeypatch: pytest.MonkeyPatch) -> None:
    desk = Desk()
    with monkeypatch.context() as broken:
        broken.setattr(desk.scene.station, "snapshot", lambda now_ns: 1 / 0)
        assert desk.get("/groups").status_code == 500
    told = values(desk.ask("/metrics").text)
    assert told["covista_requests_total", (("route", "/groups"), ("status", "500"))] == 1

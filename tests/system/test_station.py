"""A real station, real rovers over real zenoh, real questions over HTTP."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import cv2
import httpx
import numpy as np
import pytest
import zenoh
from covista_clients import MissionControl, Rover
from covista_schemas import codec, features, keys
from covista_schemas import robot_pb2 as pb
from covista_schemas.messages import Pose
from covista_schemas.reports import Counters, FoundBy, OwnGroupReport, RobotReport
from covista_schemas.zenoh_config import config
from covista_service.serve import Running

from tests.service.api.expositions import Key, values
from tests.service.deadline import wait_until
from tests.service.wall import (
    CAMERA,
    keyframe,
    keyframe_bytes,
    overlap,
    picture,
    picture_bytes,
    pose_bytes,
    seen_from,
)
from tests.system.running_station import running_station, settings_for


@dataclass(frozen=True)
class Site:
    """A station, a mission control, and a session like a rover's."""

    station: Running
    control: MissionControl
    air: zenoh.Session

    @property
    def endpoint(self) -> str:
        return self.station.link[0]

    def robot(self, robot: str) -> RobotReport | None:
        return next((each for each in self.control.robots().robots if each.id == robot), None)

    def settled(self, robot: str, received: int, topic: str = "keyframes") -> Counters:
        """Wait until so many messages of a robot have come and none waits; their accounts, which must balance."""

        def look() -> Counters | None:
            report = self.robot(robot)
            counters = None if report is None else getattr(report, topic)
            done = counters is not None and counters.received >= received and not counters.waiting
            return counters if done else None

        counters = wait_until(look, f"{received} {topic} of {robot}")
        settled = counters.used + counters.replaced + counters.duplicate + sum(counters.dropped.values())
        assert counters.received == settled == received
        return counters


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Site]:
    with running_station(settings_for(tmp_path_factory.mktemp("station"))) as station:
        air = zenoh.open(config("client", connect=[station.link[0]]))
        with MissionControl(station.url) as control:
            # Compiled code is loaded; on a fresh machine it is compiled first.
            wait_until(lambda: control.health().status == "ready", "the station is ready", deadline_s=100)
            yield Site(station, control, air)
        air.close()


def test_two_rovers_are_surveyed_grouped_and_told(site: Site) -> None:
    told: dict[str, list[OwnGroupReport]] = {"r1": [], "r2": []}
    with Rover("r1", CAMERA, site.endpoint) as first, Rover("r2", CAMERA, site.endpoint) as second:
        for rover, x_m in ((first, 0.0), (second, 1.0)):
            rover.on_group(told[rover.robot].append)
            rover.send_pose(Pose((x_m, 0, 0)))
            rover.send_keyframe(seen_from(x_m), Pose((x_m, 0, 0)))
        pair = wait_until(lambda: _measured(site), "the pair is measured")
        assert pair.overlap_a == pytest.approx(overlap(1.0), abs=0.05)
        assert pair.overlap_b == pytest.approx(overlap(1.0), abs=0.05)
        assert pair.planes
        group = wait_until(lambda: [each for each in told["r1"] if each.robots == ["r1", "r2"]], "the group is told")[0]
        wait_until(lambda: group.label in [each.label for each in told["r2"]], "to both")
        assert site.control.group(str(group.label)).robots == ["r1", "r2"]
        assert site.control.overlay("r2", "r1").startswith(b"\x89PNG")
        assert site.control.robot("r1").status == "live"


def _measured(site: Site):
    if site.robot("r1") is None or site.robot("r2") is None:
        return None
    pair = site.control.pair("r1", "r2")
    return pair if pair.found_by is FoundBy.IMAGE else None


def test_a_picture_s_features_are_extracted_on_the_ground(site: Site) -> None:
    with Rover("camera", CAMERA, site.endpoint) as rover:
        sent = rover.send_keyframe(picture(), Pose((50, 0, 0)))
        robot = wait_until(lambda: (found := site.robot("camera")) and found.keyframe and found)
        assert robot.keyframe == sent


def altered(**fields: object) -> bytes:
    message = pb.Keyframe.FromString(keyframe_bytes("bad"))
    for name, value in fields.items():
        owner: object = message
        *path, last = name.split("__")
        for part in path:
            owner = getattr(owner, part)
        if isinstance(value, list):
            del getattr(owner, last)[:]
            getattr(owner, last).extend(value)
        else:
            setattr(owner, last, value)
    return message.SerializeToString()


def huge() -> bytes:
    """A small PNG whose head claims 65535 x 65535 px, from a camera that claims the same."""
    data = bytearray(PNG)
    data[16:24] = (65_535).to_bytes(4) * 2
    camera = CAMERA.model_copy(update={"width": 65_535, "height": 65_535})
    return codec.encode_keyframe(replace(keyframe("bad"), image=bytes(data), features=None, camera=camera))


JPEG = features.encode_jpeg(picture())
PNG = cv2.imencode(".png", picture())[1].tobytes()
NAN = float("nan")
BAD_KEYFRAMES = {
    "foreign id": (keyframe_bytes("good"), codec.WRONG_ID),
    "invalid boot": (altered(boot="Boot!"), codec.WRONG_ID),
    "garbage": (b"\xff\xff\xff\xff", codec.MALFORMED),
    "nothing": (b"", codec.WRONG_ID),
    "points that do not multiply out": (altered(features__count=3), codec.BAD_FEATURES),
    "descriptors that do not multiply out": (altered(features__descriptors=b"123"), codec.BAD_FEATURES),
    "unknown descriptors": (altered(features__kind="surf"), codec.UNKNOWN_DESCRIPTOR),
    "position nan": (altered(world_from_camera__position_m=[NAN, 0, 0]), codec.BAD_POSE),
    "position infinite": (altered(world_from_camera__position_m=[0, float("inf"), 0]), codec.BAD_POSE),
    "quaternion not unit": (altered(world_from_camera__orientation_xyzw=[0, 0, 0, 2]), codec.BAD_POSE),
    "quaternion zero": (altered(world_from_camera__orientation_xyzw=[0, 0, 0, 0]), codec.BAD_POSE),
    "no pose": (altered(world_from_camera__position_m=[]), codec.BAD_POSE),
    "focal length zero": (altered(camera__fx=0.0), codec.BAD_CAMERA),
    "focal length negative": (altered(camera__fy=-300.0), codec.BAD_CAMERA),
    "focal length nan": (altered(camera__fx=NAN), codec.BAD_CAMERA),
    "size zero": (altered(camera__width=0), codec.BAD_CAMERA),
    "image truncated": (picture_bytes("bad", JPEG[: len(JPEG) // 2]), codec.BAD_IMAGE),
    "not an image": (picture_bytes("bad", b"hello"), codec.BAD_IMAGE),
    "an image that does not decode": (picture_bytes("bad", PNG[:33] + PNG[-12:]), codec.BAD_IMAGE),
    "50 megapixels claimed": (huge(), codec.IMAGE_TOO_LARGE),
}


@pytest.mark.parametrize("case", BAD_KEYFRAMES)
def test_a_bad_keyframe_is_dropped_counted_and_explained_and_nobody_is_disturbed(site: Site, case: str) -> None:
    payload, code = BAD_KEYFRAMES[case]
    bad = f"bad-{list(BAD_KEYFRAMES).index(case)}"
    if code != codec.WRONG_ID and payload[:1] != b"\xff":
        message = pb.Keyframe.FromString(payload)
        message.robot = bad
        payload = message.SerializeToString()
    site.air.put(keys.keyframe("default", bad), payload)
    counters = site.settled(bad, 1)
    assert counters.dropped == {code: 1}
    report = site.control.robot(bad)
    assert report.last_problem
    assert report.keyframe is None
    assert site.control.health().status == "ready"


def test_bad_poses_are_dropped_and_the_next_good_one_is_used(site: Site) -> None:
    message = pb.Pose.FromString(pose_bytes("poser", sequence=0))
    del message.world_from_camera.orientation_xyzw[:]
    message.world_from_camera.orientation_xyzw.extend([0, 0, 0, NAN])
    key = keys.pose("default", "poser")
    site.air.put(key, message.SerializeToString())
    site.settled("poser", 1, "poses")
    site.air.put(key, pose_bytes("someone-else", sequence=1))
    site.settled("poser", 2, "poses")
    site.air.put(key, pose_bytes("poser", 7.0, sequence=1))
    counters = site.settled("poser", 3, "poses")
    assert counters.dropped == {codec.BAD_POSE: 1, codec.WRONG_ID: 1}
    assert (counters.used, counters.missing) == (1, 0)
    robot = site.robot("poser")
    assert robot is not None
    assert robot.pose is not None
    assert robot.pose.position_m == (7, 0, 0)


def test_a_bad_robot_leaves_the_others_their_answers(site: Site) -> None:
    good = keys.keyframe("default", "steady")
    for sequence in range(20):
        site.air.put(keys.keyframe("default", "noisy"), b"\xff\xff garbage")
        site.air.put(good, keyframe_bytes("steady", 100.0, sequence=sequence))
    steady = site.settled("steady", 20)
    assert (steady.dropped, steady.missing) == ({}, 0)
    assert steady.used >= 1
    assert site.settled("noisy", 20).dropped == {codec.MALFORMED: 20}


def test_every_message_of_a_flood_is_accounted_for(site: Site) -> None:
    key = keys.pose("default", "flood")
    order = np.random.default_rng(0).permutation(2000).tolist()
    for sequence in [*order[:1500], *order[:100]]:
        site.air.put(key, pose_bytes("flood", sequence=sequence))
    counters = site.settled("flood", 1600, "poses")
    assert counters.duplicate == 100
    assert counters.missing == max(order[:1500]) + 1 - 1500


def test_a_clock_that_is_off_is_shown_and_not_punished(site: Site) -> None:
    for robot, time_ns in (("past", 0), ("future", 2**62)):
        site.air.put(keys.keyframe("default", robot), keyframe_bytes(robot, 200.0, time_ns=time_ns))
        assert site.settled(robot, 1).used == 1
        report = site.control.robot(robot)
        assert report.status == "live"
        assert report.clock_offset_s is not None
        assert abs(report.clock_offset_s) > 1e9


def test_a_key_with_an_invalid_id_counts_on_the_station(site: Site) -> None:
    site.air.put("covista/default/robots/Not_An_Id/pose", pose_bytes("r1"))
    wait_until(lambda: 'covista_turned_away_total{reason="wrong_key"} 1.0' in _metrics(site), "the count")


def _metrics(site: Site) -> str:
    return httpx.get(f"{site.station.url}/metrics").text


def test_questions_over_zenoh_have_rest_s_answers(site: Site) -> None:
    site.air.put(keys.pose("default", "asked"), pose_bytes("asked", 300.0))
    site.settled("asked", 1, "poses")
    (reply,) = list(site.air.get(keys.robot_report("default", "asked"), timeout=10.0))
    assert reply.ok is not None
    over_zenoh = RobotReport.model_validate_json(reply.ok.payload.to_bytes())
    over_rest = site.control.robot("asked")
    assert over_zenoh.model_dump(exclude={"group"}) == over_rest.model_dump(exclude={"group"})


def test_a_token_alone_makes_a_robot_live(site: Site) -> None:
    token = site.air.liveliness().declare_token(keys.alive("default", "quiet", "b0"))
    report = wait_until(lambda: site.robot("quiet"), "the token is seen")
    assert (report.status, report.pose, report.group) == ("live", None, None)
    token.undeclare()


def test_the_next_run_goes_on_counting(tmp_path: Path) -> None:
    revisions = []
    for robot in ("r1", "r2"):
        with running_station(settings_for(tmp_path)) as station, MissionControl(station.url) as control:
            air = zenoh.open(config("client", connect=[station.link[0]]))
            air.put(keys.keyframe("default", robot), keyframe_bytes(robot))
            revisions.append(wait_until(lambda: (found := control.groups()).groups and found).revision)
            air.close()
    assert revisions[1] > revisions[0] > 0


def test_many_stations_do_not_share_a_thing(tmp_path: Path) -> None:
    (tmp_path / "a").mkdir()
    (tmp_path / "b").mkdir()
    with (
        running_station(settings_for(tmp_path / "a")) as first,
        running_station(settings_for(tmp_path / "b", workers="processes", workers_count=1)) as second,
    ):
        air = zenoh.open(config("client", connect=[first.link[0]]))
        air.put(keys.keyframe("default", "r1"), keyframe_bytes("r1"))
        with MissionControl(first.url) as one, MissionControl(second.url) as other:
            wait_until(lambda: one.robots().robots)
            assert other.robots().robots == []
        air.close()


def test_prometheus_is_told_what_rest_is_told(site: Site) -> None:
    site.air.put(keys.pose("default", "counted"), pose_bytes("counted", 400.0))
    site.settled("counted", 1, "poses")

    def agreed() -> dict[Key, float] | None:
        told = values(_metrics(site))
        received = sum(robot.poses.received for robot in site.control.robots().robots)
        return told if told["covista_messages_total", (("fate", "received"), ("topic", "pose"))] == received else None

    told = wait_until(agreed, "the same accounts")
    assert told["covista_link_sessions", ()] >= 1
    assert told["covista_workers_capacity", (("kind", "threads"),)] == 2
    assert {told["covista_part_ready", (("part", part),)] for part in ("link", "workers", "store", "loop")} == {1.0}
    assert told["covista_turn_seconds_count", ()] > 0
    assert told["covista_news_told_total", (("sink", "history"),)] > 0
    assert told["covista_requests_total", (("route", "/robots"), ("status", "200"))] > 0

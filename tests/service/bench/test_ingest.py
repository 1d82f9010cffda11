import math
from collections import Counter
from collections.abc import Iterator

import pytest
import zenoh
from covista_schemas import codec, keys
from covista_schemas.errors import DecodeError
from covista_schemas.zenoh_config import config
from covista_service.bench import flood, ingest
from covista_service.demo import children

from tests.service.deadline import free_endpoint

SHORT = {codec.MALFORMED, codec.WRONG_ID, codec.BAD_POSE}


@pytest.fixture(scope="module")
def session() -> Iterator[zenoh.Session]:
    with zenoh.open(config("router", listen=[free_endpoint()])) as opened:
        yield opened


def test_a_flood_of_poses_is_of_good_poses_numbered_one_by_one(session: zenoh.Session) -> None:
    make = flood.poses(session, 3)
    seen: dict[str, list[int]] = {}
    for number in [*range(600), 3 * 2**33]:
        key, data = make(number)
        robot = keys.parse_robot_key(str(key)).robot
        pose = codec.decode_pose(data, robot=robot)
        seen.setdefault(robot, []).append(pose.sequence)
        assert pose.pose.position_m == pytest.approx((0.001 * (pose.sequence % 10_000), 0.0, 1.0))
    assert seen == {"f1": [*range(200), 2**33], "f2": [*range(200)], "f3": [*range(200)]}


def test_none_of_the_garbage_is_any_good_and_all_kinds_are_there(session: zenoh.Session) -> None:
    # Noise is of two kinds: poses and keyframes.
    assert faults(flood.garbage(session, 2)) == dict.fromkeys(SHORT | {codec.TOO_LARGE}, 100) | {codec.MALFORMED: 200}
    assert faults(flood.garbage_short(session, 2)) == dict.fromkeys(SHORT, 125) | {codec.MALFORMED: 250}
    assert faults(flood.garbage_long(session, 2)) == {codec.TOO_LARGE: 500}


def faults(make: flood.Make) -> Counter[str]:
    """What is wrong with five hundred messages."""
    codes: Counter[str] = Counter()
    for number in range(500):
        key, data = make(number)
        robot = keys.parse_robot_key(str(key)).robot
        decode = codec.decode_pose if str(key).endswith("pose") else codec.decode_keyframe
        with pytest.raises(DecodeError) as refused:
            decode(data, robot=robot)
        codes[refused.value.code] += 1
    return codes


def test_a_flood_of_keyframes_is_of_good_keyframes_numbered_one_by_one(session: zenoh.Session) -> None:
    make = flood.keyframes(session, 2)
    seen = []
    for number in range(6):
        key, data = make(number)
        keyframe = codec.decode_keyframe(data, robot=keys.parse_robot_key(str(key)).robot)
        assert keyframe.features is not None
        assert 60_000 < len(data) < 80_000
        seen.append((keyframe.robot, keyframe.sequence))
    assert seen == [("k1", 0), ("k2", 0), ("k1", 1), ("k2", 1), ("k1", 2), ("k2", 2)]


def test_every_message_of_a_flood_is_accounted_for() -> None:
    run = ingest.under_flood(3.0, "poses", 3000, robots=2)
    assert run.accounted
    assert run.sent > 0
    assert run.p50_ms > 0


def test_garbage_spoils_no_accounts_of_those_it_is_sent_beside() -> None:
    run = ingest.under_flood(3.0, "garbage", 2000, robots=2)
    assert run.accounted
    assert run.p50_ms > 0


def test_a_raw_subscriber_counts_what_is_sent() -> None:
    assert ingest.raw_rate(0.5) > 0


def test_a_flood_ends_with_its_parent() -> None:
    endpoint = free_endpoint()
    with zenoh.open(config("router", listen=[endpoint])):
        flooder = children.start(flood.__name__, flood.FloodOptions(endpoint, 60.0))
        assert flooder.line.receive() == "ready"
        flooder.line.send("go")
        flooder.end()
        assert flooder.process.returncode is not None


def test_what_a_message_costs_is_what_the_station_spends_beyond_its_own_needs() -> None:
    assert ingest.cost_us(0.75, 0.25, 1000) == 500.0
    # Of few messages, what the station does by itself may be more in the seconds without than in those with them.
    assert ingest.cost_us(0.25, 0.75, 1000) == -500.0


def test_what_a_message_costs_is_told_kind_by_kind_and_round_by_round() -> None:
    costs_us = ingest.costs_us(0.5, {"poses": 2000, "garbage_short": 2000, "keyframes": 20, "garbage_long": 500}, 2)
    assert set(costs_us) == {"poses", "garbage_short", "keyframes", "garbage_long"}
    assert all(len(rounds) == 2 and all(map(math.isfinite, rounds)) for rounds in costs_us.values())

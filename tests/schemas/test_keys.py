import pytest
from covista_schemas import keys
from covista_schemas.errors import KeyExpressionError
from covista_schemas.keys import RobotKey, RobotTopic, StationQuery
from hypothesis import given
from zenoh import KeyExpr

from tests.schemas.strategies import ids


@given(ids, ids, ids)
def test_what_robots_publish_on_is_parsed_back(site: str, robot: str, boot: str) -> None:
    built = {
        keys.keyframe(site, robot): RobotKey(site, robot, RobotTopic.KEYFRAME),
        keys.pose(site, robot): RobotKey(site, robot, RobotTopic.POSE),
        keys.alive(site, robot, boot): RobotKey(site, robot, RobotTopic.ALIVE, boot),
    }
    for key, parsed in built.items():
        assert keys.parse_robot_key(key) == parsed
        assert KeyExpr(keys.every(site, parsed.topic)).includes(KeyExpr(key))


@given(ids, ids, ids)
def test_what_the_station_answers_on_is_parsed_back(site: str, a: str, b: str) -> None:
    built = {
        keys.groups(site): StationQuery("groups", ()),
        keys.similarity(site): StationQuery("similarity", ()),
        keys.pair(site, a, b): StationQuery("pairs", (a, b)),
        keys.robot_report(site, a): StationQuery("robots", (a,)),
    }
    for key, parsed in built.items():
        assert keys.parse_station_query(site, key) == parsed
        assert any(KeyExpr(queryable).includes(KeyExpr(key)) for queryable in keys.queryables(site))


@given(ids, ids)
def test_what_the_station_publishes_on_is_none_of_the_robots_keys(site: str, robot: str) -> None:
    for key in (keys.groups(site), keys.own_group(site, robot), keys.events(site)):
        with pytest.raises(KeyExpressionError):
            keys.parse_robot_key(key)
        assert not any(KeyExpr(keys.every(site, topic)).intersects(KeyExpr(key)) for topic in RobotTopic)


@pytest.mark.parametrize(
    "bad", ["", "R1", "r 1", "r/1", "*", "**", "-r", "_r", "r\n", "é", "r" * 64, "$*", "r#1", "r?"]
)
def test_ids_that_are_none_are_refused(bad: str) -> None:
    builders = (
        lambda: keys.keyframe("default", bad),
        lambda: keys.keyframe(bad, "r1"),
        lambda: keys.pose("default", bad),
        lambda: keys.alive("default", "r1", bad),
        lambda: keys.every(bad, RobotTopic.POSE),
        lambda: keys.groups(bad),
        lambda: keys.pair("default", "r1", bad),
        lambda: keys.own_group("default", bad),
        lambda: keys.parse_robot_key(f"covista/default/robots/{bad}/pose"),
        lambda: keys.parse_robot_key(f"covista/{bad}/robots/r1/pose"),
        lambda: keys.parse_robot_key(f"covista/default/robots/r1/alive/{bad}"),
    )
    for build in builders:
        with pytest.raises(KeyExpressionError):
            build()


@pytest.mark.parametrize(
    "key",
    [
        "",
        "covista",
        "other/default/robots/r1/pose",
        "covista/default/robots/r1",
        "covista/default/robots/r1/picture",
        "covista/default/robots/r1/pose/extra",
        "covista/default/robots/r1/alive",
        "covista/default/station/groups",
    ],
)
def test_keys_of_others_are_refused(key: str) -> None:
    with pytest.raises(KeyExpressionError):
        keys.parse_robot_key(key)


@pytest.mark.parametrize(
    "key", ["covista/default/station", "covista/default/station/pairs/a", "covista/other/station/groups"]
)
def test_queries_that_nobody_answers_are_refused(key: str) -> None:
    with pytest.raises(KeyExpressionError):
        keys.parse_station_query("default", key)

import threading
from collections.abc import Iterator

import pytest
import zenoh
from covista_schemas import keys
from covista_schemas.reports import EventReport, GroupsReport, OwnGroupReport
from covista_service.answers import event_report
from covista_service.link.publish import MAX_EVENTS, Publisher
from covista_service.loop import News, SinkStatus
from covista_service.station.events import GroupsChanged, Happened
from zenoh import ext

from tests.service.deadline import DEADLINE_S, wait_until
from tests.service.link.conftest import Air
from tests.service.station.scenes import Scene

SITE = "publish"


@pytest.fixture
def publisher(air: Air) -> Iterator[Publisher]:
    publisher = Publisher(air.station, SITE)
    yield publisher
    publisher.close()


def news_of(scene: Scene) -> News:
    """What the scene has to tell when it has settled."""
    told = [*scene.settle()]
    changes = [effect for effect in told if isinstance(effect, GroupsChanged)]
    events = [event_report(i + 1, effect) for i, effect in enumerate(e for e in told if isinstance(e, Happened))]
    robots = tuple(robot for change in changes for robot in change.robots)
    return News(scene.snapshot, tuple(events), bool(changes), robots)


def two_robots() -> Scene:
    scene = Scene()
    scene.send("r1")
    scene.send("r2")
    return scene


def late_listener(session: zenoh.Session, key: str, heard: list[str]) -> ext.AdvancedSubscriber[None]:
    return ext.declare_advanced_subscriber(
        session,
        key,
        lambda sample: heard.append(sample.payload.to_string()),
        history=ext.HistoryConfig(detect_late_publishers=True),
    )


def test_groups_whole_and_own_reach_who_listens(air: Air, publisher: Publisher) -> None:
    whole: list[str] = []
    own: list[str] = []
    with (
        late_listener(air.rover, keys.groups(SITE), whole),
        late_listener(air.rover, keys.own_group(SITE, "r1"), own),
    ):
        publisher.take(news_of(two_robots()))
        groups = GroupsReport.model_validate_json(wait_until(lambda: whole)[-1])
        mine = OwnGroupReport.model_validate_json(wait_until(lambda: own)[-1])
    assert [group.robots for group in groups.groups] == [["r1", "r2"]]
    assert (mine.robot, mine.label, mine.robots) == ("r1", groups.groups[0].label, ["r1", "r2"])
    assert mine.revision == groups.revision


def test_the_last_value_reaches_who_comes_late(air: Air, publisher: Publisher) -> None:
    early: list[str] = []
    with late_listener(air.rover, keys.own_group(SITE, "r2"), early):
        publisher.take(news_of(two_robots()))
        wait_until(lambda: early)
    late: list[str] = []
    with late_listener(air.rover, keys.own_group(SITE, "r2"), late):
        assert wait_until(lambda: late) == early[-1:]


def test_events_go_out_in_order(air: Air, publisher: Publisher) -> None:
    heard: list[str] = []
    with late_listener(air.rover, keys.events(SITE), heard):
        news = news_of(two_robots())
        publisher.take(news)
        wait_until(lambda: len(heard) >= len(news.events))
    assert [EventReport.model_validate_json(text) for text in heard] == list(news.events)


def test_a_forgotten_robot_s_publisher_goes(air: Air, publisher: Publisher) -> None:
    scene = two_robots()
    publisher.take(news_of(scene))
    scene.wait(700)
    scene.send("r3")
    scene.send("r4")
    heard: list[str] = []
    with late_listener(air.rover, keys.own_group(SITE, "r4"), heard):
        publisher.take(news_of(scene))
        wait_until(lambda: heard)
    wait_until(lambda: keys.own_group(SITE, "r1") not in publisher.keys)
    assert keys.own_group(SITE, "r4") in publisher.keys


def test_closing_tells_what_is_waiting(air: Air) -> None:
    publisher = Publisher(air.station, "closing")
    heard: list[str] = []
    with late_listener(air.rover, keys.groups("closing"), heard):
        publisher.take(news_of(two_robots()))
        publisher.close()
        publisher.close()
        wait_until(lambda: heard)


def test_what_was_told_is_counted(air: Air, publisher: Publisher) -> None:
    news = news_of(two_robots())
    publisher.take(news)
    wait_until(lambda: publisher.status() == SinkStatus(0, len(news.events) + len(news.robots), 0))


def test_what_cannot_be_told_is_counted(
    air: Air, publisher: Publisher, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    news = news_of(two_robots())
    with monkeypatch.context() as broken:
        broken.setattr(publisher, "_put", lambda key, text: 1 / 0)
        publisher.take(news)
        wait_until(lambda: publisher.status().lost)
    assert publisher.status() == SinkStatus(0, 0, len(news.events) + len(news.robots))
    assert "ZeroDivisionError" in caplog.text


def test_events_that_nobody_takes_up_are_lost_and_counted(
    air: Air, publisher: Publisher, monkeypatch: pytest.MonkeyPatch
) -> None:
    event = news_of(two_robots()).events[0]
    entered, go_on = threading.Event(), threading.Event()

    def slow(key: str, text: str) -> None:
        entered.set()
        assert go_on.wait(DEADLINE_S)

    monkeypatch.setattr(publisher, "_put", slow)
    publisher.take(News(Scene().snapshot, (event,), False, ()))
    assert entered.wait(DEADLINE_S)
    publisher.take(News(Scene().snapshot, (event,) * (MAX_EVENTS + 5), False, ()))
    publisher.take(News(Scene().snapshot, (event,) * 2, False, ()))
    assert publisher.status() == SinkStatus(waiting=MAX_EVENTS, told=0, lost=7)
    go_on.set()
    wait_until(lambda: publisher.status() == SinkStatus(0, 1 + MAX_EVENTS, 7))


def await_heard(air: Air, *listened: str) -> None:
    """Wait until somebody who comes late has heard something on each of the keys."""
    for key in listened:
        heard: list[str] = []
        with late_listener(air.rover, key, heard):
            wait_until(heard.copy, key)


def test_in_another_session_the_groups_that_stand_are_told_again(air: Air, publisher: Publisher) -> None:
    scene, own, whole = two_robots(), keys.own_group(SITE, "r1"), keys.groups(SITE)
    publisher.part()
    news = news_of(scene)
    publisher.take(news)
    assert publisher.status() == SinkStatus(len(news.events) + len(news.robots), 0, 0)
    for _ in range(2):
        part = publisher.join(air.station)
        wait_until(lambda: {own, whole} <= publisher.keys, "they are told")
        wait_until(lambda: publisher.status().waiting == 0, "all is told")
        await_heard(air, own, whole)
        part()
        assert not publisher.keys
    assert publisher.status().lost == 0


def test_what_waits_for_a_session_that_never_comes_is_counted_as_lost() -> None:
    publisher = Publisher(None, "nowhere")
    news = news_of(two_robots())
    publisher.take(news)
    publisher.close()
    assert publisher.status().lost == len(news.events) + len(news.robots)

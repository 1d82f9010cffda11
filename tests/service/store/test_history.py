"""What was told is written once; a database that cannot be used is waited for, and what it costs is said."""

import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import pytest
from covista_schemas.reports import EventKind, EventReport, LiveSettings, time_of
from covista_service.answers import groups_report
from covista_service.loop import News, SinkStatus
from covista_service.store.archive import Archive
from covista_service.store.backlog import Loss
from covista_service.store.database import DatabaseError, check_url, open_engine
from covista_service.store.history import History
from covista_service.store.retention import Retention
from sqlalchemy import text

from tests.service.deadline import wait_until
from tests.service.link.test_publish import news_of, two_robots
from tests.service.station.scenes import START_NS, S, Scene, pose

QUICK_S = 0.01
# Scenes play in a year that is long past.
FOR_EVER = Retention(days=36_500)


@contextmanager
def kept(url: str, **options: object) -> Iterator[History]:
    history = History(
        url, **{"retention": FOR_EVER, "first_pause_s": QUICK_S, "period_s": 0.02, "start_s": 0.0, **options}
    )
    try:
        yield history
    finally:
        history.close()


@contextmanager
def opened(url: str) -> Iterator[Archive]:
    archive = Archive(url)
    try:
        yield archive
    finally:
        archive.close()


def ask(url: str, question: str) -> list[tuple]:
    engine = open_engine(url)
    try:
        with engine.begin() as connection:
            return [tuple(row) for row in connection.execute(text(question))]
    finally:
        engine.dispose()


def degraded(history: History) -> Callable[[], bool]:
    return lambda: history.health().status == "degraded"


def ready(history: History) -> Callable[[], bool]:
    return lambda: history.health().status == "ready"


def written(history: History) -> Callable[[], bool]:
    return lambda: history.status().waiting == 0 and history.status().told > 0


def numbered(news: News, *numbers: int) -> Iterator[News]:
    """News of one event each."""
    for number in numbers:
        yield News(news.snapshot, (news.events[0].model_copy(update={"id": number}),), False, ())


def test_revisions_and_events_are_written_as_they_were_told(url: str) -> None:
    news = news_of(two_robots())
    with kept(url) as history:
        history.take(news)
    with opened(url) as archive:
        assert archive.groups().items == [groups_report(news.snapshot)]
        assert archive.events().items == list(news.events)
        assert archive.groups_at(news.snapshot.wall_ns) == groups_report(news.snapshot)
    assert history.health().detail == f"{len(news.events) + 1} entries written"


def test_the_file_is_a_write_ahead_log_so_that_readers_do_not_wait(file: Path) -> None:
    with kept(f"sqlite:///{file}"):
        pass
    assert ask(f"sqlite:///{file}", "pragma journal_mode") == [("wal",)]


def test_flush_waits_until_all_that_was_taken_is_written(url: str) -> None:
    news = news_of(two_robots())
    with kept(url) as history, opened(url) as archive:
        assert history.flush(0)
        history.take(news)
        assert history.flush(10)
        assert archive.events().items == list(news.events)


def test_flush_says_when_nothing_can_be_written(tmp_path: Path) -> None:
    with kept(f"sqlite:///{tmp_path}/absent/covista.db", queue=2) as history:
        news = news_of(two_robots())
        history.take(news)
        assert not history.flush(0.01)
        (tmp_path / "absent").mkdir()
        # Some of it is lost already.
        wait_until(ready(history))
        history.take(news)
        assert not history.flush(10)


# Settings


def test_settings_that_were_given_are_known_again(url: str) -> None:
    news = news_of(two_robots())
    with kept(url) as history:
        assert history.stored_settings() == {}
        for patch in ({"alpha": 0.25, "hysteresis.gain": 0.1}, {"groups": {"min": 1, "max": 2}}, {"alpha": 0.75}):
            history.take(replace(news, settings=LiveSettings(), patch=patch))
    wanted = {"alpha": 0.75, "hysteresis.gain": 0.1, "groups": {"min": 1, "max": 2}}
    with kept(url) as history:
        assert history.stored_settings() == wanted
    told = LiveSettings.model_validate_json(ask(url, "select settings from settings_changes")[0][0])
    assert told == LiveSettings()


def test_who_gave_settings_is_written_with_them(url: str) -> None:
    event = EventReport(id=9, event=EventKind.SETTINGS, time=time_of(START_NS), by="ada", text="alpha is 0.25")
    news = News(two_robots().snapshot, (event,), False, (), LiveSettings(alpha=0.25), {"alpha": 0.25})
    with kept(url) as history:
        history.take(news)
    assert ask(url, "select by, patch from settings_changes") == [("ada", '{"alpha": 0.25}')]


# Samples


def test_the_station_is_looked_at_again_and_again(url: str) -> None:
    scene = two_robots()
    scene.settle()
    with kept(url) as history, opened(url) as archive:
        one_at_a_time = threading.Lock()

        def look() -> object:
            with one_at_a_time:
                return scene.snapshot

        history.follow(look)
        wait_until(written(history), "the first look is written")
        with one_at_a_time:
            scene.send("r1", pose(5.0))
            scene.now_ns += S
            scene.settle()
        wait_until(lambda: len(archive.track("r1").items) == 2, "the way of a robot is written")
        assert [point.position_m[0] for point in archive.track("r1").items] == [0.0, 5.0]
        assert len(archive.track("r2").items) == 1
        assert archive.pair("r2", "r1").items[0].overlap_a == pytest.approx(scene.snapshot.pair("r1", "r2").overlap_b)


def test_a_station_that_does_not_answer_costs_nothing_but_samples(url: str) -> None:
    asked: list[None] = []

    def busy() -> object:
        asked.append(None)
        raise (TimeoutError if len(asked) % 2 else ValueError)("busy")

    news = news_of(two_robots())
    with kept(url) as history:
        history.follow(busy)
        wait_until(lambda: len(asked) > 3)
        history.take(news)
        assert history.flush(10)
        assert history.health().status == "ready"


# Databases that cannot be used


def test_a_path_that_cannot_be_opened_degrades_and_heals(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    caplog.set_level("INFO", "covista_service.store.history")
    folder = tmp_path / "later"
    news = news_of(two_robots())
    with kept(f"sqlite:///{folder}/covista.db") as history:
        health = history.health()
        assert health.status == "degraded"
        assert "unable to open database file" in str(health.detail)
        history.take(news)
        folder.mkdir()
        wait_until(ready(history), "the history is written again")
    assert ask(f"sqlite:///{folder}/covista.db", "select count(*) from events") == [(len(news.events),)]
    # What waited is written late, and nothing is missing.
    assert ask(f"sqlite:///{folder}/covista.db", "select count(*) from gaps") == [(0,)]
    assert history.status() == SinkStatus(0, len(news.events) + 1, 0)
    told = [(record.levelname, record.msg) for record in caplog.records]
    assert told == [
        ("WARNING", "the history waits for its database"),
        ("WARNING", "the station starts without its database"),
        ("INFO", "the history is written again"),
    ]


def test_a_file_that_is_no_database_never_stops_the_station(file: Path) -> None:
    file.write_bytes(b"this is no database, but a text of some length" * 100)
    with kept(f"sqlite:///{file}") as history:
        history.take(news_of(two_robots()))
        assert history.health().status == "degraded"
        assert history.recall(600, 600).robots == ()


def test_a_database_of_a_newer_version_is_left_alone(url: str) -> None:
    with kept(url) as history:
        history.take(news_of(two_robots()))
    ask(url, "update alembic_version set version_num = '9999' returning 1")
    with kept(url) as history:
        assert history.health().status == "degraded"
        assert "newer version" in str(history.health().detail)
        history.take(next(numbered(news_of(two_robots()), 77)))
        assert not history.flush(0.1)
    assert ask(url, "select count(*) from events where number = 77") == [(0,)]


def test_a_full_queue_loses_its_oldest_and_the_gap_says_how_many(tmp_path: Path) -> None:
    url = f"sqlite:///{tmp_path}/absent/covista.db"
    news = news_of(two_robots())
    with kept(url, queue=3) as history:
        for each in numbered(news, *range(1, 11)):
            history.take(each)
        assert history.dropped == 7
        (tmp_path / "absent").mkdir()
        wait_until(ready(history))
    assert ask(url, "select number from events") == [(8,), (9,), (10,)]
    assert history.health().detail == "3 entries written; 7 entries lost"
    with opened(url) as archive:
        (gap,) = archive.events().gaps
    assert (gap.lost, gap.since, gap.until) == (7, news.events[0].time, news.events[0].time)
    assert "unable to open database file" in gap.reason


def test_what_is_sampled_does_not_push_out_what_was_told(tmp_path: Path) -> None:
    scene = Scene()
    for number in range(9):
        scene.send(f"r{number}")
    scene.settle()
    with kept(f"sqlite:///{tmp_path}/absent/covista.db", queue=5) as history:
        for each in numbered(news_of(two_robots()), 1, 2, 3, 4, 5):
            history.take(each)
        history.follow(lambda: scene.snapshot)
        wait_until(lambda: history.dropped > 3, "too much is sampled")
        (tmp_path / "absent").mkdir()
        wait_until(ready(history))
    assert ask(f"sqlite:///{tmp_path}/absent/covista.db", "select count(*) from events") == [(5,)]


def test_an_entry_that_cannot_be_stored_does_not_take_the_others_with_it(url: str) -> None:
    news = news_of(two_robots())
    told = [next(numbered(news, number)) for number in range(1, 40)]
    # Half a character: nothing that can be written.
    torn = news.events[0].model_copy(update={"id": 100, "text": "\ud800"})
    told.insert(17, News(news.snapshot, (torn,), False, ()))
    with kept(url) as history:
        for each in told:
            history.take(each)
        wait_until(lambda: history.status().waiting == 0)
        assert history.health().status == "ready"
    assert ask(url, "select number from events order by id") == [(number,) for number in range(1, 40)]
    assert history.dropped == 1
    assert ask(url, "select lost from gaps") == [(1,)]


def test_a_gap_that_cannot_be_stored_goes_and_holds_up_nobody(url: str, caplog: pytest.LogCaptureFixture) -> None:
    news = news_of(two_robots())
    with kept(url, first_pause_s=60.0) as history:
        with history._changed:
            # Counts that no database holds.
            history._backlog.put_back((), Loss(0, 0, 2**63))
            for each in numbered(news, 1, 2, 3):
                history.take(each)
        assert history.flush(10)
        assert history.health().status == "ready"
    assert ask(url, "select number from events order by id") == [(1,), (2,), (3,)]
    assert ask(url, "select count(*) from gaps") == [(0,)]
    assert caplog.text.count("a gap of the history cannot be stored") == 1
    assert history.dropped == 0


def test_a_gap_alone_that_cannot_be_stored_goes(url: str, caplog: pytest.LogCaptureFixture) -> None:
    history = History(url, retention=FOR_EVER, start_s=0.0)
    with history._changed:
        history._backlog.put_back((), Loss(0, 0, 2**63))
    history.close()
    assert not history._thread.is_alive()
    assert "a gap of the history cannot be stored" in caplog.text


@pytest.mark.parametrize(
    "url", ["nonsense://somewhere/db", "sqlite:///covista.db?timeout=long", "sqlite://", "sqlite:///:memory:"]
)
def test_a_url_that_can_never_work_is_a_mistake_in_the_settings(url: str) -> None:
    with pytest.raises(DatabaseError, match=r"setting database \(--database, COVISTA_DATABASE\)"):
        check_url(url)


def test_to_check_a_url_opens_no_database(file: Path) -> None:
    check_url(f"sqlite:///{file}")
    assert not file.exists()


def test_a_database_without_a_driver_is_a_mistake_in_the_settings() -> None:
    with pytest.raises(DatabaseError, match=r"setting database \(--database, COVISTA_DATABASE\)"):
        History("nonsense://somewhere/db")

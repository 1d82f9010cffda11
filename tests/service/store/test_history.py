import sqlite3
from collections.abc import Callable
from pathlib import Path

import pytest
from covista_schemas.reports import EventReport, GroupsReport
from covista_service.answers import groups_report
from covista_service.loop import News, SinkStatus
from covista_service.station.memory import Memory
from covista_service.store.database import DatabaseError, check_url
from covista_service.store.history import History

from tests.service.deadline import wait_until
from tests.service.link.test_publish import news_of, two_robots
from tests.service.station.scenes import Scene

QUICK_S = 0.01


@pytest.fixture
def file(tmp_path: Path) -> Path:
    return tmp_path / "covista.db"


def url(file: Path) -> str:
    return f"sqlite:///{file}"


def rows(file: Path, question: str) -> list[tuple]:
    connection = sqlite3.connect(file)
    try:
        return connection.execute(question).fetchall()
    finally:
        connection.close()


def test_revisions_and_events_are_written_as_they_were_told(file: Path) -> None:
    news = news_of(two_robots())
    history = History(url(file))
    history.take(news)
    history.close()
    ((revision, text),) = rows(file, "select revision, report from group_revisions")
    assert GroupsReport.model_validate_json(text) == groups_report(news.snapshot)
    assert revision == news.snapshot.groups.revision
    told = rows(file, "select number, kind, report from events order by number")
    assert [EventReport.model_validate_json(text) for _, _, text in told] == list(news.events)
    assert [(number, kind) for number, kind, _ in told] == [(event.id, event.event) for event in news.events]


def test_the_file_is_a_write_ahead_log_so_that_readers_do_not_wait(file: Path) -> None:
    History(url(file)).close()
    assert rows(file, "pragma journal_mode") == [("wal",)]


def test_numbering_goes_on_after_a_restart(file: Path) -> None:
    history = History(url(file))
    assert (history.last.revision, history.last.event) == (0, 0)
    news = news_of(two_robots())
    history.take(news)
    history.close()

    again = History(url(file))
    assert again.last.event == news.events[-1].id
    assert again.last.revision == news.snapshot.groups.revision > 0
    scene = Scene(memory=Memory(revision=again.last.revision))
    scene.send("r1")
    later = news_of(scene)
    again.take(later)
    again.close()
    assert rows(file, "select max(revision) from group_revisions") == [(later.snapshot.groups.revision,)]
    assert later.snapshot.groups.revision > news.snapshot.groups.revision


def degraded(history: History) -> Callable[[], bool]:
    return lambda: history.health().status == "degraded"


def ready(history: History) -> Callable[[], bool]:
    return lambda: history.health().status == "ready"


def test_a_path_that_cannot_be_opened_degrades_and_heals(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    caplog.set_level("INFO", "covista_service.store.history")
    folder = tmp_path / "later"
    history = History(url(folder / "covista.db"), first_pause_s=QUICK_S)
    health = history.health()
    assert health.status == "degraded"
    assert health.detail is not None
    assert "unable to open database file" in health.detail
    news = news_of(two_robots())
    history.take(news)
    folder.mkdir()
    wait_until(ready(history), "the history is written again")
    history.close()
    assert rows(folder / "covista.db", "select count(*) from events") == [(len(news.events),)]
    assert history.status() == SinkStatus(0, len(news.events) + 1, 0)
    told = [(record.levelname, record.msg) for record in caplog.records]
    assert told == [
        ("WARNING", "the history waits for its database"),
        ("INFO", "the history is written again"),
    ]


def test_a_file_that_was_removed_is_begun_anew(file: Path) -> None:
    history = History(url(file))
    news = news_of(two_robots())
    history.take(news)
    wait_until(lambda: history.health().detail != "0 entries written", "the first entries are written")
    for each in file.parent.glob("covista.db*"):
        each.unlink()
    history.take(news)
    history.close()
    assert history.health().status == "ready"
    assert rows(file, "select count(*) from events") == [(len(news.events),)]


def test_a_file_that_is_no_database_never_stops_the_station(file: Path) -> None:
    file.write_bytes(b"this is no database, but a text of some length" * 100)
    history = History(url(file), first_pause_s=QUICK_S)
    history.take(news_of(two_robots()))
    assert history.health().status == "degraded"
    history.close()


def test_a_locked_database_is_written_once_it_is_free(file: Path) -> None:
    history = History(url(file), first_pause_s=QUICK_S)
    lock = sqlite3.connect(file, isolation_level=None)
    lock.execute("begin exclusive")
    history.take(news_of(two_robots()))
    wait_until(degraded(history), "the lock is noticed")
    detail = history.health().detail
    assert detail is not None
    assert "locked" in detail
    lock.execute("rollback")
    lock.close()
    wait_until(ready(history), "the lock is gone")
    history.close()
    assert rows(file, "select count(*) from group_revisions") == [(1,)]


def test_a_full_queue_loses_its_oldest_and_says_how_many(tmp_path: Path) -> None:
    history = History(url(tmp_path / "absent" / "covista.db"), queue=3, first_pause_s=QUICK_S)
    news = news_of(two_robots())
    told = [news.events[0].model_copy(update={"id": number}) for number in range(1, 11)]
    for event in told:
        history.take(News(news.snapshot, (event,), False, ()))
    wait_until(lambda: history.dropped == 7, "the oldest are dropped")
    (tmp_path / "absent").mkdir()
    wait_until(ready(history))
    history.close()
    assert rows(tmp_path / "absent" / "covista.db", "select number from events") == [(8,), (9,), (10,)]
    assert history.health().detail == "3 entries written; 7 entries lost"


@pytest.mark.parametrize("url", ["nonsense://somewhere/db", "sqlite:///covista.db?timeout=long"])
def test_a_url_that_can_never_work_is_a_mistake_in_the_settings(url: str) -> None:
    with pytest.raises(DatabaseError, match=r"setting database \(--database, COVISTA_DATABASE\)"):
        check_url(url)


def test_to_check_a_url_opens_no_database(file: Path) -> None:
    check_url(f"sqlite:///{file}")
    assert not file.exists()


def test_a_database_without_a_driver_is_a_mistake_in_the_settings() -> None:
    with pytest.raises(DatabaseError, match=r"setting database \(--database, COVISTA_DATABASE\)"):
        History("nonsense://somewhere/db")

"""Databases fail for real: the file is deleted, the disk is full, the server stops; the history goes on by itself."""

import os
import sqlite3
import subprocess
import sys
import time
from contextlib import closing
from pathlib import Path

import pytest
from covista_schemas.reports import LiveSettings
from covista_service.answers.past import HistoryUnavailableError
from covista_service.loop import News
from covista_service.store.database import CONNECT_S, SILENCE_S
from covista_service.store.history import CLOSE_S
from sqlalchemy import event

from tests.service.deadline import wait_until
from tests.service.link.test_publish import news_of, two_robots
from tests.service.store.server import Server
from tests.service.store.test_history import ask, degraded, kept, numbered, opened, ready


@pytest.fixture
def news() -> News:
    return news_of(two_robots())


def test_a_file_that_was_removed_is_begun_anew_and_the_gap_is_told(file: Path, news: News) -> None:
    url = f"sqlite:///{file}"
    with kept(url) as history, opened(url) as archive:
        history.take(News(news.snapshot, news.events, True, (), LiveSettings(alpha=0.25), {"alpha": 0.25}))
        assert history.flush(10)
        assert len(archive.events().items) == len(news.events)
        for each in file.parent.glob("covista.db*"):
            each.unlink()
        with pytest.raises(HistoryUnavailableError):
            archive.events()
        history.take(next(numbered(news, 100)))
        assert history.flush(10)
        assert history.health().status == "ready"
        # Who has read the file before reads the new one.
        page = archive.events()
        assert [event.id for event in page.items] == [100]
        (gap,) = page.gaps
        assert gap.since == news.events[0].time
        assert "removed" in gap.reason
    with kept(url) as history:
        assert history.stored_settings() == {"alpha": 0.25}
        assert history.last.event == 100


def test_a_locked_database_is_written_once_it_is_free(file: Path, news: News) -> None:
    url = f"sqlite:///{file}"
    with kept(url) as history, opened(url) as archive:
        history.take(news)
        assert history.flush(10)
        with closing(sqlite3.connect(file, isolation_level=None)) as lock:
            lock.execute("begin immediate")
            history.take(next(numbered(news, 100)))
            wait_until(degraded(history), "the lock is noticed")
            assert "locked" in str(history.health().detail)
            # Readers do not care.
            assert len(archive.events().items) == len(news.events)
            lock.execute("rollback")
        wait_until(ready(history), "the lock is gone")
        assert len(archive.events().items) == len(news.events) + 1


def test_closing_does_not_wait_for_who_has_the_database_locked(file: Path, news: News) -> None:
    with closing(sqlite3.connect(file, isolation_level=None)) as lock:
        with kept(f"sqlite:///{file}") as history:
            lock.execute("begin immediate")
            history.take(news)
            began_s = time.monotonic()
        assert time.monotonic() - began_s < CLOSE_S + 0.5
        lock.execute("rollback")


FULL = """
import subprocess, sys
from pathlib import Path
from tests.service.deadline import wait_until
from tests.service.link.test_publish import news_of, two_robots
from tests.service.store.test_history import degraded, kept, numbered, ready

folder, fault = Path(sys.argv[1]), sys.argv[2]
run = lambda *words: subprocess.run(words, check=True)
run("mount", "-t", "tmpfs", "-o", "size=1m", "none", str(folder))
news = news_of(two_robots())
ballast = folder / "ballast"
if fault == "read-only":
    with kept(f"sqlite:///{folder}/covista.db"):
        pass
    run("mount", "-o", "remount,ro", str(folder))
with kept(f"sqlite:///{folder}/covista.db") as history:
    history.take(news)
    assert history.flush(10) == (fault == "full")
    if fault == "full":
        try:
            ballast.write_bytes(bytes(1 << 21))
        except OSError:
            pass
    told = 0
    while history.health().status != "degraded":
        told += 1
        for each in numbered(news, 1000 + told):
            history.take(each)
        history.flush(0.05)
    print(history.health().detail, flush=True)
    if fault == "full":
        ballast.unlink()
    else:
        run("mount", "-o", "remount,rw", str(folder))
    wait_until(ready(history), "it is written again")
    assert history.flush(10)
    assert history.status().told == len(news.events) + 1 + told, history.status()
    assert history.dropped == 0
print("well")
"""


@pytest.mark.parametrize(("fault", "said"), [("full", "full"), ("read-only", "unable")])
def test_a_disk_that_is_full_or_read_only_is_waited_for(tmp_path: Path, fault: str, said: str) -> None:
    """In a mount namespace, on a disk of 1 MB: nobody else notices."""
    alone = ["unshare", "-m", "--propagation", "private"]
    if os.geteuid() != 0 or subprocess.run([*alone, "true"], check=False, capture_output=True).returncode:
        pytest.skip("no mount namespace can be made here")
    script = [*alone, sys.executable, "-c", FULL, str(tmp_path), fault]
    done = subprocess.run(script, check=False, capture_output=True, text=True, timeout=100)
    assert done.returncode == 0, done.stderr
    detail, well = done.stdout.splitlines()[-2:]
    assert said in detail
    assert well == "well"


def grow_no_more(connection: sqlite3.Connection, *_: object) -> None:
    """Let the file have the pages that it has, and no more."""
    connection.execute("pragma max_page_count = 1").close()


def test_a_database_that_may_not_grow_is_waited_for(file: Path, news: News) -> None:
    """As a full disk, also where no disk can be made."""
    url = f"sqlite:///{file}"
    with kept(url) as history:
        history.take(news)
        assert history.flush(10)
        engine = history._writer._engine
        # Whenever a connection is taken: one that is made anew has no limit of its own.
        event.listen(engine, "checkout", grow_no_more)
        told = 0
        while history.health().status != "degraded":
            told += 1
            history.take(next(numbered(news, 1000 + told)))
            history.flush(0.05)
        assert "full" in str(history.health().detail)
        event.remove(engine, "checkout", grow_no_more)
        wait_until(lambda: engine.pool.checkedout() == 0)
        engine.dispose()
        wait_until(ready(history))
        assert history.flush(10)
    assert ask(url, "select count(*) from events") == [(len(news.events) + told,)]


@pytest.fixture
def url_of_server(server: Server) -> str:
    return server.new_database()


def test_a_server_that_is_frozen_is_given_up_and_comes_back(server: Server, url_of_server: str, news: News) -> None:
    with kept(url_of_server) as history, opened(url_of_server) as archive:
        history.take(news)
        assert history.flush(10)
        assert len(archive.events().items) == len(news.events)
        with server.frozen():
            history.take(next(numbered(news, 100)))
            began_s = time.monotonic()
            wait_until(degraded(history), "the silence is noticed")
            assert time.monotonic() - began_s < SILENCE_S + 2
            with pytest.raises(HistoryUnavailableError):
                archive.events()
            assert time.monotonic() - began_s < 3 * SILENCE_S + 2
            history.take(next(numbered(news, 101)))
        wait_until(ready(history), "the server is back", 30)
        assert history.flush(10)
        assert [event.id for event in archive.events_after(99)] == [100, 101]
        assert archive.events().gaps == []


def test_a_station_that_starts_does_not_wait_long_for_a_frozen_server(
    server: Server, url_of_server: str, news: News
) -> None:
    with kept(url_of_server) as history:
        history.take(news)
    began_s = time.monotonic()
    with server.frozen(), kept(url_of_server) as history:
        assert history.recall(1e9, 1e9).robots == ()
        assert history.health().status == "degraded"
        assert time.monotonic() - began_s < CONNECT_S + 1


def test_closing_does_not_wait_for_a_frozen_server(server: Server, url_of_server: str, news: News) -> None:
    with kept(url_of_server) as history:
        history.take(news)
        assert history.flush(10)
        with server.frozen():
            history.take(next(numbered(news, 100)))
            began_s = time.monotonic()
            history.close()
            assert time.monotonic() - began_s < CLOSE_S + 0.5
        wait_until(lambda: not history._thread.is_alive(), "the thread has ended")


def test_a_server_that_was_stopped_comes_back(server: Server, url_of_server: str, news: News) -> None:
    with kept(url_of_server) as history, opened(url_of_server) as archive:
        history.take(news)
        assert history.flush(10)
        server.stop()
        history.take(next(numbered(news, 100)))
        try:
            wait_until(degraded(history), "the server is missed")
            with pytest.raises(HistoryUnavailableError):
                archive.groups()
        finally:
            server.start()
        wait_until(ready(history), "the server is back", 30)
        assert history.flush(10)
        assert len(archive.events().items) == len(news.events) + 1

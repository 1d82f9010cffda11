"""What is too old goes, and what is too much, the oldest first, while the history is written."""

import json
import time
from pathlib import Path

import pytest
from covista_schemas.reports import FoundBy
from covista_service.store import retention
from covista_service.store.backlog import Loss
from covista_service.store.database import open_engine
from covista_service.store.migrations import upgrade
from covista_service.store.numbers import LastNumbers
from covista_service.store.retention import Retention, drop_older, drop_oldest, drop_superseded
from covista_service.store.rows import PairEntry, SettingsChange, TrackEntry
from covista_service.store.size import ServerSize, size_of
from covista_service.store.tables import events, group_revisions, tracks
from covista_service.store.writer import Writer
from sqlalchemy import Engine, func, select, text

from tests.service.deadline import wait_until
from tests.service.store.test_archive import POSE, T0_NS, at, event, groups, put, us
from tests.service.store.test_history import LiveSettings, ask, kept

DAY_S = 86_400.0
# No number is a whole one, which SQLite would keep in less room.
WAY = tuple(0.1 + number for number in range(7))


def kept_of(engine: Engine, table: object, column: str) -> list[int]:
    with engine.begin() as connection:
        return list(connection.execute(select(table.c[column]).order_by(table.c.id)).scalars())


def test_what_is_older_goes_and_the_rest_stays(engine: Engine) -> None:
    put(engine, *(event(number, number) for number in range(10)))
    put(engine, *(TrackEntry("r1", us(second), POSE) for second in range(2500)))
    # Written late: it goes later, when what came before it is old too.
    put(engine, TrackEntry("r1", us(1), POSE))
    with engine.begin() as connection:
        while drop_older(connection, us(5)):
            pass
    assert kept_of(engine, events, "number") == [5, 6, 7, 8, 9]
    assert kept_of(engine, tracks, "time_us")[0] == us(5)


def test_the_revision_in_force_at_the_limit_stays(engine: Engine) -> None:
    put(engine, groups(1, 1), groups(2, 2), groups(3, 30))
    with engine.begin() as connection:
        while drop_older(connection, us(10)):
            pass
    assert kept_of(engine, group_revisions, "revision") == [2, 3]


def test_the_oldest_goes_first_whatever_it_is(engine: Engine) -> None:
    day = [at_s * 3600.0 for at_s in range(24)]
    put(engine, *(event(number, second) for number, second in enumerate(day)))
    put(engine, *(TrackEntry("r1", us(second + 1), POSE) for second in day))
    put(engine, *(PairEntry("a", "b", us(second + 2), 0.5, 0.5, FoundBy.IMAGE) for second in day))
    put(engine, groups(1, 0), groups(2, 12 * 3600.0))
    before = None
    while True:
        oldest = [
            ask(str(engine.url), f"select min(time_us) from {name}")[0][0]
            for name in ("events", "tracks", "pair_overlaps")
        ]
        if None in oldest:
            break
        assert max(oldest) - min(oldest) <= 3600 * 1e6 + 600e6
        assert before is None or oldest >= before
        before = oldest
        with engine.begin() as connection:
            assert drop_oldest(connection)
    with engine.begin() as connection:
        while drop_oldest(connection):
            pass
        # Of revisions the last one stays: it is in force.
        assert connection.execute(select(func.count()).select_from(group_revisions)).scalar() == 1


def test_settings_that_stand_are_kept_however_old(engine: Engine) -> None:
    given = [{"alpha": 0.1}, {"alpha": 0.2, "sigma": "std"}, {"alpha": 0.3}, {"groups": 2}]
    put(engine, *(SettingsChange(at(second), None, patch, LiveSettings()) for second, patch in enumerate(given)))
    with engine.begin() as connection:
        drop_superseded(connection, us(100))
        kept = list(connection.execute(text("select patch from settings_changes order by id")).scalars())
    assert kept == ['{"alpha": 0.2, "sigma": "std"}', '{"alpha": 0.3}', '{"groups": 2}']


def test_settings_given_without_end_stay_few_and_what_stands_is_kept(
    engine: Engine, url: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(retention, "READ_CHANGES", 100)
    monkeypatch.setattr(retention, "MOST_CHANGES", 20)
    monkeypatch.setattr(retention, "STEP", 30)
    given = [{"sigma": "std"}] + [{"alpha": number / 1000} for number in range(500)]
    put(engine, *(SettingsChange(at(second), None, patch, LiveSettings()) for second, patch in enumerate(given)))
    writer = Writer(url, Retention(days=36_500))
    writer.start()
    # Only so many are read.
    assert writer.patch == {"alpha": 0.499}
    while writer.tidy():
        pass
    writer.dispose()
    # The newest, and the one that alone names what it names; none was too old.
    kept = ask(url, "select patch from settings_changes order by id")
    assert [json.loads(patch) for (patch,) in kept] == [given[0], *given[-20:]]
    writer = Writer(url, Retention(days=36_500))
    writer.start()
    assert writer.patch == {"sigma": "std", "alpha": 0.499}
    writer.dispose()


def test_age_is_held_while_the_history_is_written(url: str) -> None:
    now_s = time.time()
    engine = open_engine(url)
    with engine.begin() as connection:
        upgrade(connection)
    put(engine, event(1, now_s - T0_NS / 1e9 - 3 * DAY_S), event(2, now_s - T0_NS / 1e9 - DAY_S))
    with kept(url, retention=Retention(days=2)):
        wait_until(lambda: ask(url, "select number from events") == [(2,)])
    engine.dispose()


def test_a_file_does_not_grow_beyond_its_limit(tmp_path: Path) -> None:
    file, limits = tmp_path / "covista.db", Retention(days=36_500, mb=8)
    writer = Writer(f"sqlite:///{file}", limits)
    writer.start()
    largest = second = 0
    for _ in range(120):
        batch = [
            TrackEntry(f"r{robot}", us(second + robot / 20), WAY)
            for second in range(second, second + 50)
            for robot in range(20)
        ]
        second += 50
        writer.write(batch, None, "", LastNumbers())
        writer._size_s = 0.0
        while writer.tidy():
            writer._size_s = 0.0
        largest = max(largest, sum(each.stat().st_size for each in tmp_path.iterdir()))
    engine = open_engine(f"sqlite:///{file}")
    with engine.begin() as connection:
        rows, newest = connection.execute(select(func.count(), func.max(tracks.c.time_us))).one()
        assert connection.exec_driver_sql("pragma integrity_check").scalar() == "ok"
    engine.dispose()
    writer.dispose()
    assert largest <= limits.limit_bytes
    # It is used, and what is kept is the newest.
    assert rows > 20_000
    assert newest == us(second - 1 + 19 / 20)


def test_a_server_does_not_grow_far_beyond_its_limit(server: object) -> None:
    url = server.new_database()
    limits = Retention(days=36_500, mb=8)
    writer = Writer(url, limits)
    writer.start()
    size, second, sizes = size_of(open_engine(url)), 0, []
    for _ in range(150):
        batch = [
            TrackEntry(f"r{robot}", us(second + robot / 20), WAY)
            for second in range(second, second + 50)
            for robot in range(20)
        ]
        second += 50
        writer.write(batch, None, "", LastNumbers())
        writer._size_s = 0.0
        writer.tidy()
        sizes.append(size._taken())
    writer.dispose()
    size._engine.dispose()
    assert max(sizes) <= 1.3 * limits.limit_bytes
    assert min(sizes[75:]) >= 0.5 * limits.limit_bytes


def test_a_server_that_cannot_vacuum_loses_no_more_than_one_look_takes(
    server: object, caplog: pytest.LogCaptureFixture
) -> None:
    engine, now_s = open_engine(server.new_database()), 0.0
    with engine.begin() as connection:
        upgrade(connection)
    size = ServerSize(engine, lambda: now_s)

    def grow(begun: int) -> None:
        put(engine, *(TrackEntry("r1", us(begun + second), WAY) for second in range(20_000)))

    def rows() -> int:
        with engine.begin() as connection:
            return int(connection.execute(select(func.count()).select_from(tracks)).scalar_one())

    grow(0)
    with engine.begin() as lock:
        # Rows come and go, but nobody vacuums.
        lock.execute(text("lock table tracks in share update exclusive mode"))
        assert not size.fit(1000)
        left = rows()
        assert 0 < left < 20_000
        for look in range(5):
            now_s += 1.0
            grow(20_000 * (look + 1))
            assert not size.fit(1000)
            assert rows() == left + 20_000 * (look + 1)
    assert caplog.text.count("cannot be vacuumed") == 1
    # Free again: first room is made, table by table, and only then the oldest go.
    now_s += 100.0
    for _ in range(5):
        size.fit(1000)
        assert rows() == left + 100_000
    assert not size._due
    grow(120_000)
    size.fit(1000)
    assert rows() < left + 120_000
    engine.dispose()


def test_a_gap_is_kept_as_long_as_what_it_is_of(engine: Engine, url: str) -> None:
    writer = Writer(url, Retention())
    writer.start()
    writer.write([event(1, 0)], Loss(us(1), us(20), 3), "locked", LastNumbers())
    writer.dispose()
    with engine.begin() as connection:
        while drop_older(connection, us(10)):
            pass
    assert ask(url, "select lost from gaps") == [(3,)]

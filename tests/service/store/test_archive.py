"""Pages tell all there is, once, in the order of time; what cannot be told is an error or a gap."""

from collections.abc import Callable
from datetime import UTC, datetime, timedelta

import pytest
from covista_schemas.reports import EventKind, EventReport, FoundBy, GroupsReport, LiveSettings, time_of
from covista_service.answers import past
from covista_service.answers.past import CursorError, HistoryUnavailableError
from covista_service.store import pages
from covista_service.store.archive import Archive
from covista_service.store.rows import Entry, PairEntry, TrackEntry, write
from covista_service.store.tables import gaps
from sqlalchemy import Engine, insert, text

T0_NS = 1_700_000_000_000_000_000
S = 1_000_000_000
POSE = (1.0, 2.0, 3.0, 0.0, 0.0, 0.0, 1.0)


def us(seconds: float) -> int:
    return T0_NS // 1000 + round(seconds * 1e6)


def at(seconds: float) -> datetime:
    return time_of(T0_NS) + timedelta(seconds=seconds)


def ns(seconds: float) -> int:
    return T0_NS + round(seconds * S)


def event(number: int, seconds: float, kind: EventKind = EventKind.JOIN, robots: tuple[str, ...] = ()) -> EventReport:
    return EventReport(id=number, event=kind, time=at(seconds), robots=list(robots), text=f"event {number}")


def groups(revision: int, seconds: float) -> GroupsReport:
    return GroupsReport(
        revision=revision,
        time=at(seconds),
        groups=[],
        ungrouped=[],
        criterion="adaptive",
        scores=[],
        settings=LiveSettings(),
    )


def put(engine: Engine, *entries: Entry) -> None:
    with engine.begin() as connection:
        write(connection, entries)


def put_gap(engine: Engine, since_s: float, until_s: float, lost: int = 1) -> None:
    row = {"since_us": us(since_s), "until_us": us(until_s), "lost": lost, "reason": "locked"}
    with engine.begin() as connection:
        connection.execute(insert(gaps), row)


def all_pages(ask: Callable[[str | None], past.EventsHistory]) -> list[list[int]]:
    found, cursor = [], None
    while True:
        page = ask(cursor)
        found.append([item.id for item in page.items])
        cursor = page.next
        if cursor is None:
            return found


def test_an_archive_is_what_the_interfaces_ask(archive: Archive) -> None:
    asked: past.Archive = archive
    assert asked.groups().items == []
    assert asked.groups_at(T0_NS) is None
    assert asked.oldest_event() is None
    assert asked.events_after(0) == []


@pytest.mark.parametrize("limit", [1, 2, 3, 7, 100])
def test_pages_hold_everything_once_also_where_times_are_equal(engine: Engine, archive: Archive, limit: int) -> None:
    # Three of each second, and the last second is written late.
    seconds = [1, 1, 1, 2, 2, 2, 3, 3, 3, 0]
    put(engine, *(event(number, at_s) for number, at_s in enumerate(seconds, 1)))
    told = all_pages(lambda cursor: archive.events(cursor=cursor, limit=limit))
    assert [number for page in told for number in page] == [10, *range(1, 10)]
    assert all(len(page) == limit for page in told[:-1])
    assert 0 < len(told[-1]) <= limit


def test_bounds_are_since_and_before(engine: Engine, archive: Archive) -> None:
    put(engine, *(event(number, number) for number in range(1, 6)))
    page = archive.events(since_ns=ns(2), until_ns=ns(4))
    assert [item.id for item in page.items] == [2, 3]
    assert archive.events(since_ns=ns(2) + 1, until_ns=ns(4) + 1).items == [event(3, 3), event(4, 4)]
    assert archive.events(since_ns=ns(4), until_ns=ns(2)).items == []
    assert len(archive.events(since_ns=-(2**80), until_ns=2**80).items) == 5


@pytest.mark.parametrize("cursor", ["", "x", "ä", "%%%%", "AAAA", "A" * 1000, "AAYI0b0yQAAAAAAAAAAAAB==", "null", "0"])
def test_what_is_no_cursor_is_refused(archive: Archive, cursor: str) -> None:
    for ask in (archive.groups, archive.events):
        with pytest.raises(CursorError):
            ask(cursor=cursor)
    for ask in (lambda: archive.pair("a", "b", cursor=cursor), lambda: archive.track("a", cursor=cursor)):
        with pytest.raises(CursorError):
            ask()


def test_events_of_kinds_are_merged_in_the_order_of_time(engine: Engine, archive: Archive) -> None:
    kinds = [EventKind.JOIN, EventKind.LEAVE, EventKind.WARNING]
    put(engine, *(event(number, number // 2, kinds[number % 3]) for number in range(30)))
    wanted = [EventKind.LEAVE, EventKind.WARNING]
    told = all_pages(lambda cursor: archive.events(cursor=cursor, limit=4, kinds=wanted))
    assert [number for page in told for number in page] == [number for number in range(30) if number % 3]


def test_events_of_a_robot_are_found_however_far_apart(
    engine: Engine, archive: Archive, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(pages, "LOOK", 5)
    # Ids that contain each other, and one that says what LIKE would take for any sign.
    robots = ["r1", "r11", "r_", "rx"]
    kinds = [EventKind.JOIN, EventKind.STATUS]
    put(engine, *(event(n, n // 7, kinds[n // 4 % 2], (robots[n % 4],)) for n in range(60)))
    for k, robot in enumerate(robots):
        told = all_pages(lambda cursor, robot=robot: archive.events(cursor=cursor, limit=3, robot=robot))
        assert [number for page in told for number in page] == list(range(k, 60, 4))
    told = all_pages(lambda cursor: archive.events(cursor=cursor, robot="r1", kinds=[EventKind.JOIN]))
    assert [number for page in told for number in page] == list(range(0, 60, 8))
    assert archive.events(robot='r1"').items == []


def test_events_after_a_number_and_the_oldest_one(engine: Engine, archive: Archive) -> None:
    put(engine, *(event(number, number) for number in range(5, 12)))
    assert [each.id for each in archive.events_after(7, 3)] == [8, 9, 10]
    assert [each.id for each in archive.events_after(-5, 100)] == list(range(5, 12))
    assert archive.events_after(2**70) == []
    assert archive.oldest_event() == 5


def test_the_groups_at_a_moment_are_those_in_force_then(engine: Engine, archive: Archive) -> None:
    put(engine, groups(1, 10), groups(2, 20), groups(3, 20))
    at_9, at_10, at_15, at_20, later = (archive.groups_at(ns(second)) for second in (9.999, 10, 15, 20, 10**9))
    assert at_9 is None
    assert at_10 == at_15 == groups(1, 10)
    assert at_20 == later == groups(3, 20)
    assert [each.revision for each in archive.groups(since_ns=ns(15)).items] == [2, 3]


def test_a_pair_is_told_in_the_order_asked_for(engine: Engine, archive: Archive) -> None:
    put(
        engine,
        PairEntry("r1", "r2", us(1), 0.25, 0.75, FoundBy.IMAGE),
        PairEntry("r1", "r3", us(1), 0.1, 0.2, FoundBy.IMAGE),
        PairEntry("r1", "r2", us(2), None, None, FoundBy.UNKNOWN),
    )
    one, other = archive.pair("r1", "r2"), archive.pair("r2", "r1")
    assert [(m.time, m.overlap_a, m.overlap_b, m.found_by) for m in one.items] == [
        (at(1), 0.25, 0.75, FoundBy.IMAGE),
        (at(2), None, None, FoundBy.UNKNOWN),
    ]
    assert [(m.overlap_a, m.overlap_b) for m in other.items] == [(0.75, 0.25), (None, None)]
    assert (other.a, other.b) == ("r2", "r1")
    assert archive.pair("r2", "r3").items == []
    first = archive.pair("r2", "r1", limit=1)
    assert archive.pair("r2", "r1", cursor=first.next).items == other.items[1:]


def test_a_track_is_one_robots(engine: Engine, archive: Archive) -> None:
    put(engine, TrackEntry("r1", us(1), POSE), TrackEntry("r2", us(2), POSE), TrackEntry("r1", us(3), POSE))
    track = archive.track("r1")
    assert [(p.time, p.position_m, p.orientation_xyzw) for p in track.items] == [
        (at(1), (1.0, 2.0, 3.0), (0.0, 0.0, 0.0, 1.0)),
        (at(3), (1.0, 2.0, 3.0), (0.0, 0.0, 0.0, 1.0)),
    ]
    assert archive.track("r1", since_ns=ns(2)).items == track.items[1:]


def test_pages_carry_the_gaps_within_their_time(engine: Engine, archive: Archive) -> None:
    put(engine, *(event(number, 10 * number) for number in range(1, 5)))
    put_gap(engine, 12, 14, lost=3)
    put_gap(engine, 32, 33)
    put_gap(engine, 50, 60)
    first = archive.events(limit=2)
    assert [(gap.since, gap.until, gap.lost, gap.reason) for gap in first.gaps] == [(at(12), at(14), 3, "locked")]
    second = archive.events(limit=2, cursor=first.next)
    assert [gap.since for gap in second.gaps] == [at(32), at(50)]
    assert [gap.since for gap in archive.track("r9", since_ns=ns(13), until_ns=ns(15)).gaps] == [at(12)]
    assert archive.groups(since_ns=ns(15), until_ns=ns(30)).gaps == []


def test_an_entry_that_cannot_be_read_does_not_take_the_others_with_it(engine: Engine, archive: Archive) -> None:
    put(engine, event(1, 1), event(2, 2), event(3, 3))
    with engine.begin() as connection:
        connection.execute(text("update events set report = 'torn' where number = 2"))
    assert [each.id for each in archive.events().items] == [1, 3]


def test_what_cannot_be_read_says_so(tmp_path: object) -> None:
    for url in (f"sqlite:///{tmp_path}/none.db", "postgresql+psycopg://covista@127.0.0.1:1/none"):
        archive = Archive(url)
        with pytest.raises(HistoryUnavailableError):
            archive.groups_at(T0_NS)
        archive.close()
    assert not list(tmp_path.iterdir())


def test_readers_do_not_wait_for_who_writes(engine: Engine, archive: Archive) -> None:
    put(engine, event(1, 1))
    with engine.begin() as connection:
        write(connection, [event(2, 2)])
        assert [each.id for each in archive.events().items] == [1]
    assert [each.id for each in archive.events().items] == [1, 2]


def test_no_reader_changes_anything(archive: Archive, url: str) -> None:
    with pytest.raises(Exception, match=r"readonly|read-only"), archive._engine.begin() as connection:
        connection.execute(text("delete from events"))


def test_times_are_utc(engine: Engine, archive: Archive) -> None:
    put(engine, event(1, 0))
    assert archive.events().items[0].time.tzinfo is UTC

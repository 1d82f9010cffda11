"""A moment of the past is what the last rows before it say, told by another way: all rows, one after the other."""

import random
from itertools import pairwise

import pytest
from covista_schemas.reports import FoundBy
from covista_service.answers import past
from covista_service.answers.past import HistoryUnavailableError
from covista_service.store.archive import Archive
from covista_service.store.rows import Entry, PairEntry, TrackEntry
from covista_service.store.tables import pair_overlaps, tracks
from sqlalchemy import Engine, event, insert, text

from tests.service.store.test_archive import POSE, T0_NS, at, groups, ns, put, us

REACH_S = 600.0


def point(robot: str, seconds: float, x_m: float = 1.0) -> TrackEntry:
    return TrackEntry(robot, us(seconds), (x_m, *POSE[1:]))


def pair(a: str, b: str, seconds: float, of_a: float | None, of_b: float | None) -> PairEntry:
    return PairEntry(a, b, us(seconds), of_a, of_b, FoundBy.UNKNOWN if of_a is None else FoundBy.IMAGE)


def places(moment: past.Moment) -> dict[str, float]:
    return {robot: found.position_m[0] for robot, found in moment.points.items()}


def test_of_nothing_nothing_is_known(archive: Archive) -> None:
    moment = archive.moment(T0_NS, REACH_S)
    assert moment.groups is None
    assert not moment.points
    assert not moment.overlaps


def test_a_moment_is_of_the_last_rows_that_are_not_after_it(engine: Engine, archive: Archive) -> None:
    put(engine, groups(1, 0), groups(2, 20), point("r1", 0, 1), point("r1", 10, 2), point("r2", 15, 3))
    put(engine, pair("r1", "r2", 15, 0.5, 0.25), pair("r1", "r2", 20, 0.75, 0.5), pair("r2", "r3", 5, 0.0, 0.0))
    before, then, later = (archive.moment(ns(seconds), REACH_S) for seconds in (9.9, 15, 20))
    assert [each.groups.revision for each in (before, then, later) if each.groups] == [1, 1, 2]
    assert [places(each) for each in (before, then, later)] == [{"r1": 1}, {"r1": 2, "r2": 3}, {"r1": 2, "r2": 3}]
    assert [each.overlaps for each in (before, then, later)] == [
        {},
        {("r1", "r2"): (0.5, 0.25)},
        {("r1", "r2"): (0.75, 0.5)},
    ]
    assert then.points["r1"].time == at(10)


def test_who_parted_or_became_unknown_has_nothing_in_common(engine: Engine, archive: Archive) -> None:
    put(engine, pair("r1", "r2", 0, 0.5, 0.5), pair("r1", "r2", 5, None, None))
    put(engine, pair("r1", "r3", 0, 0.5, 0.5), pair("r1", "r3", 5, 0.0, 0.0))
    assert len(archive.moment(ns(4), REACH_S).overlaps) == 2
    assert not archive.moment(ns(5), REACH_S).overlaps


def test_what_is_older_than_the_reach_says_nothing_but_the_groups_do(engine: Engine, archive: Archive) -> None:
    put(engine, groups(1, 0), point("r1", 0), pair("r1", "r2", 0, 0.5, 0.5))
    reached, lost = archive.moment(ns(60), 60.0), archive.moment(ns(60.001), 60.0)
    assert reached.points
    assert reached.overlaps
    assert lost.groups is not None
    assert not lost.points
    assert not lost.overlaps


def test_of_two_rows_of_one_microsecond_the_later_one_counts(engine: Engine, archive: Archive) -> None:
    put(engine, point("r1", 5, 1), point("r1", 5, 2), pair("r1", "r2", 5, 0.1, 0.1), pair("r1", "r2", 5, 0.2, 0.2))
    moment = archive.moment(ns(5), REACH_S)
    assert places(moment) == {"r1": 2}
    assert moment.overlaps == {("r1", "r2"): (0.2, 0.2)}


@pytest.mark.parametrize("seed", range(3))
def test_a_moment_is_what_reading_all_rows_would_tell(engine: Engine, archive: Archive, seed: int) -> None:
    chance = random.Random(seed)
    robots = [f"r{k}" for k in range(12)] + ["a-b", "a_b", "z"]
    entries: list[Entry] = []
    for _ in range(600):
        a, b = sorted(chance.sample(robots, 2))
        shares = chance.choice([(None, None), (0.0, 0.0), (chance.random(), chance.random())])
        entries += [pair(a, b, chance.uniform(0, 2000), *shares), point(a, chance.uniform(0, 2000), chance.random())]
    # Rows that were written late lie behind younger ones.
    put(engine, *entries)
    for seconds in [*(chance.uniform(0, 2100) for _ in range(20)), 0.0, 5000.0]:
        moment = archive.moment(ns(seconds), REACH_S)
        within = [each for each in entries if us(seconds - REACH_S) <= time_us(each) <= us(seconds)]
        within.sort(key=time_us)
        assert places(moment) == {each.robot: each.pose[0] for each in within if isinstance(each, TrackEntry)}
        last = {(each.a, each.b): each for each in within if isinstance(each, PairEntry)}
        assert moment.overlaps == {
            which: (each.overlap_a, each.overlap_b) for which, each in last.items() if each.overlap_a or each.overlap_b
        }


def time_us(entry: Entry) -> int:
    assert isinstance(entry, TrackEntry | PairEntry)
    return entry.time_us


def test_a_thousand_robots_are_read_by_the_index_alone(engine: Engine, archive: Archive) -> None:
    """No table is read from end to end: neither takes longer for rows that lie between those that are wanted."""
    robots = [f"r{k:04}" for k in range(200)]
    with engine.begin() as connection:
        for begin in range(0, 100, 20):
            told = [us(begin + k) for k in range(20)]
            pose = dict(zip(("x", "y", "z", "qx", "qy", "qz", "qw"), POSE, strict=True))
            connection.execute(
                insert(tracks), [{"robot": robot, "time_us": when, **pose} for robot in robots for when in told]
            )
            connection.execute(
                insert(pair_overlaps),
                [
                    {"a": a, "b": b, "time_us": when, "overlap_a": 0.5, "overlap_b": 0.5, "found_by": "image"}
                    for a, b in pairwise(robots)
                    for when in told
                ],
            )
        if engine.dialect.name == "postgresql":
            connection.execute(text("ANALYZE"))
    read = statements(archive)
    moment = archive.moment(ns(50), REACH_S)
    assert len(moment.points) == 200
    assert len(moment.overlaps) == 199
    explain = "EXPLAIN QUERY PLAN" if engine.dialect.name == "sqlite" else "EXPLAIN"
    for statement, parameters in read:
        with engine.begin() as connection:
            plan = "\n".join(map(str, connection.exec_driver_sql(f"{explain} {statement}", parameters)))
        for table in ("tracks", "pair_overlaps"):
            assert f"SCAN {table}" not in plan, plan
            assert f"Seq Scan on {table}" not in plan, plan


def statements(archive: Archive) -> list[tuple[str, tuple[object, ...]]]:
    """What the archive will have asked its database of tracks and pairs."""
    read: list[tuple[str, tuple[object, ...]]] = []

    @event.listens_for(archive._engine, "before_cursor_execute")
    def note(*told: object) -> None:
        statement, parameters = told[2], told[3]
        if "tracks" in str(statement) or "pair_overlaps" in str(statement):
            read.append((str(statement), parameters))  # type: ignore[arg-type]

    return read


def test_a_database_that_is_gone_is_said_so() -> None:
    with pytest.raises(HistoryUnavailableError):
        Archive("sqlite:////nowhere/covista.db").moment(T0_NS, REACH_S)

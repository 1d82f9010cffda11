"""Bands tell in which group each robot stood when, and long times are thinned and say so."""

import random
import time
from itertools import pairwise

import pytest
from covista_schemas.reports import GroupsReport
from covista_service.dashboard import bands as subject
from covista_service.dashboard.bands import ABSENT, bands, order

from tests.service.dashboard.conftest import PagesDesk, at, groups, ms, ns

Runs = dict[str, list[tuple[int, str | None]]]


def standing_at(runs: Runs, robot: str, when_ms: int) -> str | None:
    found: str | None = ABSENT
    for since_ms, label in runs.get(robot, []):
        if since_ms <= when_ms:
            found = label
    return found


def recorded_at(reports: list[GroupsReport], robot: str, seconds: float) -> str | None:
    before = [report for report in reports if report.time <= at(seconds)]
    if not before:
        return ABSENT
    label_of = {name: group.label for group in before[-1].groups for name in group.robots}
    absent = robot not in label_of and robot not in {each.robot for each in before[-1].ungrouped}
    return ABSENT if absent else label_of.get(robot)


def history(seed: int, count: int) -> list[GroupsReport]:
    """Robots that come, go and change groups, a second each."""
    chance = random.Random(seed)
    found = []
    for revision in range(1, count + 1):
        present = chance.sample(["r1", "r2", "r3", "r4", "r10"], chance.randrange(1, 6))
        gone = present[: chance.randrange(2)]
        standing: dict[str, list[str]] = {}
        for robot in present:
            if robot not in gone:
                standing.setdefault(f"g{chance.randrange(1, 4)}", []).append(robot)
        found.append(groups(revision, revision, standing, gone))
    return found


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("page", [7, 200])
def test_bands_are_the_recorded_groups(
    pages_desk: PagesDesk, monkeypatch: pytest.MonkeyPatch, seed: int, page: int
) -> None:
    monkeypatch.setattr(subject, "_PAGE", page)
    reports = history(seed, 50)
    pages_desk.write(*reports)
    told = bands(pages_desk.archive, ns(10.5), ns(40))
    assert not told["thinned"]
    for tenth in range(105, 400):
        for robot in ("r1", "r2", "r3", "r4", "r10"):
            wanted = recorded_at(reports, robot, tenth / 10)
            assert standing_at(told["runs"], robot, ms(tenth / 10)) == wanted, (robot, tenth)
    for runs in told["runs"].values():
        assert all(first[0] <= second[0] and first[1] != second[1] for first, second in pairwise(runs))
        assert runs[0][0] >= ms(10.5)
    assert sorted(told["robots"]) == sorted(told["runs"])


def test_what_stood_before_the_time_began_stands_at_its_beginning(pages_desk: PagesDesk) -> None:
    pages_desk.write(groups(1, 0, {"g1": ["r1"]}))
    told = bands(pages_desk.archive, ns(100), ns(200))
    assert told["runs"] == {"r1": [(ms(100), "g1")]}
    assert (told["since_ms"], told["until_ms"]) == (ms(100), ms(200))
    assert bands(pages_desk.archive, ns(-100), ns(-50))["runs"] == {}


def test_a_long_time_is_thinned_and_says_so(pages_desk: PagesDesk, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(subject, "_CELLS", 100)
    monkeypatch.setattr(subject, "_PAGE", 20)
    pages_desk.write(*(groups(k, k, {f"g{1 + k // 100}": ["r1", "r2"]}) for k in range(1, 1000)))
    asked: list[int] = []
    archive = pages_desk.archive
    read = archive.groups

    def counted(*arguments: object) -> object:
        page = read(*arguments)  # type: ignore[arg-type]
        asked.append(len(page.items))
        return page

    monkeypatch.setattr(archive, "groups", counted)
    told = bands(archive, ns(0), ns(1000))
    assert told["thinned"]
    assert sum(asked) < 200
    # Runs that are long are there, and begin nearly when they did.
    for robot in ("r1", "r2"):
        for k in range(1, 10):
            assert standing_at(told["runs"], robot, ms(100 * k + 60)) == f"g{1 + k}"


def test_the_last_state_of_a_thinned_time_is_exact(pages_desk: PagesDesk, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(subject, "_CELLS", 20)
    monkeypatch.setattr(subject, "_PAGE", 5)
    pages_desk.write(*(groups(k, k, {"g1": ["r1"]}) for k in range(1, 100)), groups(100, 99.9, {"g2": ["r1"]}))
    told = bands(pages_desk.archive, ns(0), ns(100))
    assert told["thinned"]
    assert standing_at(told["runs"], "r1", ms(100)) == "g2"


def test_what_stood_for_long_is_drawn_where_it_had_come_just_after_another(
    pages_desk: PagesDesk, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(subject, "_CELLS", 100)
    monkeypatch.setattr(subject, "_PAGE", 20)
    busy = [groups(k, k / 10, {"g1": ["r1", "r2"]}) for k in range(1, 100)]
    # Both in one part of the thinned time, and then nothing for very long.
    pages_desk.write(*busy, groups(100, 501, {"g1": ["r1", "r2"]}), groups(101, 501.1, {"g2": ["r1"], "g1": ["r2"]}))
    pages_desk.write(groups(102, 990, {"g1": ["r1", "r2"]}))
    told = bands(pages_desk.archive, ns(0), ns(1000))
    assert told["thinned"]
    assert standing_at(told["runs"], "r1", ms(501.1)) == "g2"
    assert standing_at(told["runs"], "r1", ms(980)) == "g2"
    assert told["runs"]["r1"][-2:] == [(ms(501.1), "g2"), (ms(990), "g1")]


def test_no_more_is_read_where_the_time_begins_before_the_history(
    pages_desk: PagesDesk, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(subject, "_CELLS", 500)
    robots = [f"r{k}" for k in range(50)]
    pages_desk.write(*(groups(k, k, {"g1": robots}) for k in range(1, 150)))
    archive, cells = pages_desk.archive, 0
    read = archive.groups

    def counted(*arguments: object) -> object:
        nonlocal cells
        page = read(*arguments)  # type: ignore[arg-type]
        cells += subject._read(page.items)
        return page

    monkeypatch.setattr(archive, "groups", counted)
    assert bands(archive, ns(-1000), ns(200))["thinned"]
    # What tells that it is too much, and then a revision of each part at most.
    assert cells <= 2 * 500 + 20 * 52


def test_gaps_come_with_their_reason_once(pages_desk: PagesDesk, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(subject, "_PAGE", 2)
    pages_desk.write(*(groups(k, k, {"g1": ["r1"]}) for k in range(1, 20)))
    pages_desk.write_gap(3, 8, "the disk was full")
    pages_desk.write_gap(300, 308, "later")
    told = bands(pages_desk.archive, ns(0), ns(20))
    assert told["gaps"] == [{"since_ms": ms(3), "until_ms": ms(8), "reason": "the disk was full"}]


def test_robots_that_are_together_stand_together() -> None:
    names = ["r1", "r2", "r3", "r10", "r20", "r30"]
    runs: Runs = {name: [(0, f"g{1 + k % 2}")] for k, name in enumerate(names)}
    assert order(runs, 1000) == ["r1", "r3", "r20", "r2", "r10", "r30"]
    # Who came a little later than the others is no stranger for it.
    assert order(runs | {"r3": [(5, "g1")]}, 1000) == ["r1", "r3", "r20", "r2", "r10", "r30"]


@pytest.mark.parametrize("names", [[], ["r1"], ["r10", "r2"], ["r10", "r9", "r1"]])
def test_few_robots_and_alike_ones_stand_in_the_order_of_names(names: list[str]) -> None:
    found = order({name: [(0, "g1")] for name in names}, 1000)
    assert found == sorted(names, key=lambda name: int(name[1:]))


def test_who_were_together_for_long_stand_nearer_than_who_were_for_short() -> None:
    runs: Runs = {
        "r1": [(0, "g1")],
        "r2": [(0, "g2"), (900, "g1")],
        "r3": [(0, "g1"), (950, "g3")],
        "r4": [(0, "g2")],
    }
    found = order(runs, 1000)
    assert abs(found.index("r1") - found.index("r3")) == 1
    assert abs(found.index("r2") - found.index("r4")) == 1


def test_very_many_robots_stand_in_the_order_of_their_last_groups() -> None:
    names = [f"r{k}" for k in range(subject._MANY + 2)]
    runs: Runs = {name: [(0, "g1"), (500, f"g{10 - k % 2 * 8}")] for k, name in enumerate(names)}
    runs |= {"r0": [(0, "g2"), (900, None)], "r1": [(0, "g2"), (900, ABSENT)]}
    assert order(runs, 1000) == [*names[3::2], *names[2::2], "r0", "r1"]


def test_the_page_asks_for_the_last_minutes_or_since(pages_desk: PagesDesk) -> None:
    pages_desk.write(*(groups(k, k, {f"g{k}": ["r1"]}) for k in range(1, 10)))
    told = pages_desk.data(f"/bands?span_s=5&until_ms={ms(8)}")
    assert (told["since_ms"], told["until_ms"]) == (ms(3), ms(8))
    assert told["runs"]["r1"][0] == [ms(3), "g3"]
    since = pages_desk.data(f"/bands?since_ms={ms(6)}&until_ms={ms(8)}")
    assert since["runs"]["r1"] == [[ms(6), "g6"], [ms(7), "g7"]]
    ahead = pages_desk.data(f"/bands?span_s=60&until_ms={time.time_ns() // 10**6 + 3_600_000}")
    assert ahead["until_ms"] == ahead["now_ms"]
    now = pages_desk.data("/bands?span_s=60")
    assert now["until_ms"] == now["now_ms"]
    assert now["since_ms"] == now["now_ms"] - 60_000


@pytest.mark.parametrize("query", ["span_s=0", "span_s=-1", "span_s=nan", "span_s=1e12", "since_ms=-1", "until_ms=x"])
def test_times_that_make_no_sense_are_refused(pages_desk: PagesDesk, query: str) -> None:
    assert pages_desk.ask(f"/dashboard/data/bands?{query}").status_code == 422

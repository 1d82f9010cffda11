"""What the routes of the history say, on a real database."""

import itertools
from collections.abc import Iterator
from contextlib import closing
from datetime import datetime, timedelta
from pathlib import Path
from typing import Any

import pytest
from covista_schemas.reports import (
    EventsHistory,
    GroupsHistory,
    GroupsReport,
    HistoryPage,
    PairHistory,
    Problem,
    RobotTrack,
)
from covista_service.answers.past import Archive, HistoryUnavailableError
from covista_service.loop import News
from covista_service.store.history import History

from tests.service.api.conftest import Desk
from tests.service.api.live import FOR_EVER, event, news_of
from tests.service.deadline import wait_until

HISTORIES = ["/groups/history", "/events/history", "/pairs/r1/r2/history", "/robots/r1/track"]
MODELS = dict(zip(HISTORIES, [GroupsHistory, EventsHistory, PairHistory, RobotTrack], strict=True))


@pytest.fixture(scope="module")
def desk(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Desk]:
    """Groups of two robots, then of three; twelve events; and what the history notes of robots and pairs."""
    folder: Path = tmp_path_factory.mktemp("history")
    desk = Desk(database=f"sqlite:///{folder / 'covista.db'}")
    with closing(History(desk.database, retention=FOR_EVER, period_s=0.05)) as history, closing(desk.archive):
        for robot in ("r1", "r2", "r3"):
            desk.scene.send(robot)
            desk.scene.settle()
            history.take(News(desk.scene.snapshot, (), True, ()))
            desk.scene.wait(1.0)
        for number in range(1, 13):
            history.take(news_of(desk, [number]))
        snapshot = desk.scene.snapshot
        history.follow(lambda: snapshot)
        assert history.flush(10)
        wait_until(lambda: desk.archive.track("r1").items and desk.archive.pair("r1", "r2").items, "all is noted")
        yield desk


def items(desk: Desk, path: str) -> list[dict[str, Any]]:
    response = desk.get(path)
    assert response.status_code == 200, response.text
    return list(response.json()["items"])


@pytest.mark.parametrize("path", HISTORIES)
def test_every_history_is_told_with_its_model(desk: Desk, path: str) -> None:
    response = desk.get(path)
    assert (response.status_code, response.headers["content-type"]) == (200, "application/json")
    page = MODELS[path].model_validate_json(response.content)
    assert isinstance(page, HistoryPage)
    assert response.json()["items"]
    assert (page.next, page.gaps) == (None, [])


@pytest.mark.parametrize("path", ["/groups/history", "/events/history"])
@pytest.mark.parametrize("limit", [1, 2, 5])
def test_pages_put_together_are_the_whole(desk: Desk, path: str, limit: int) -> None:
    got, cursor = [], ""
    while True:
        page = desk.get(f"{path}?limit={limit}{cursor}").json()
        assert len(page["items"]) <= limit
        got += page["items"]
        if page["next"] is None:
            break
        cursor = f"&cursor={page['next']}"
    assert got == items(desk, path)


def test_a_span_holds_its_beginning_and_not_its_end(desk: Desk) -> None:
    times = [event(number).time for number in (4, 9)]
    since, until = (time.isoformat().replace("+00:00", "Z") for time in times)
    assert [each["id"] for each in items(desk, f"/events/history?from={since}&to={until}")] == [4, 5, 6, 7, 8]


def test_events_are_narrowed_by_kinds_and_robot(desk: Desk) -> None:
    assert len(items(desk, "/events/history?kind=status&kind=groups&robot=r1")) == 12
    assert items(desk, "/events/history?kind=merge") == items(desk, "/events/history?robot=r2") == []


def test_the_groups_of_a_time_are_those_that_stood_then(desk: Desk) -> None:
    revisions = [GroupsReport.model_validate(each) for each in items(desk, "/groups/history")]
    assert len(revisions) >= 3
    for earlier, later in itertools.pairwise(revisions):
        between = earlier.time + (later.time - earlier.time) / 2
        assert GroupsReport.model_validate(at(desk, between)).revision == earlier.revision
    assert at(desk, revisions[-1].time + timedelta(days=1))["revision"] == revisions[-1].revision


def at(desk: Desk, time: datetime) -> dict[str, Any]:
    response = desk.get(f"/groups/at?time={time.isoformat().replace('+', '%2B')}")
    assert response.status_code == 200, response.text
    return dict(response.json())


def test_before_there_were_groups_there_are_none(desk: Desk) -> None:
    response = desk.get("/groups/at?time=1999-12-31T23:59:59Z")
    assert response.status_code == 404
    assert Problem.model_validate_json(response.content).title == "No groups then"


def test_a_pair_is_told_in_the_order_asked_for(desk: Desk) -> None:
    one, other = desk.get("/pairs/r1/r2/history").json(), desk.get("/pairs/r2/r1/history").json()
    assert (one["a"], one["b"], other["a"], other["b"]) == ("r1", "r2", "r2", "r1")
    assert [each["overlap_a"] for each in one["items"]] == [each["overlap_b"] for each in other["items"]]


def test_who_was_never_there_has_no_past(desk: Desk) -> None:
    assert items(desk, "/robots/r99/track") == items(desk, "/pairs/r98/r99/history") == []


TIMES = [
    ("2026-05-04T12:30:15Z", "2026-05-04T12:30:15Z"),
    ("2026-05-04t12:30:15.5z", "2026-05-04T12:30:15.500000Z"),
    ("2026-05-04T14:30:15%2B02:00", "2026-05-04T12:30:15Z"),
    ("2026-05-04T14:30:15+02:00", "2026-05-04T12:30:15Z"),
    ("2016-12-31T23:59:60Z", "2016-12-31T23:59:59.999999Z"),
    ("0001-01-01T00:00:00%2B14:00", None),
    ("9999-12-31T23:59:59-14:00", None),
]


@pytest.mark.parametrize(("said", "meant"), TIMES)
@pytest.mark.parametrize("path", HISTORIES)
def test_times_are_those_of_rfc_3339(desk: Desk, path: str, said: str, meant: str | None) -> None:
    assert desk.get(f"{path}?from={said}").status_code == 200
    if meant is not None:
        asked: list[tuple[int | None, int | None]] = []
        span = answers_with(desk, asked)
        for each in (said, meant):
            span.get(f"/groups/history?from={each}&to={each}")
        assert asked[0] == asked[1]


def answers_with(desk: Desk, asked: list[tuple[int | None, int | None]]) -> Desk:
    """A desk whose history notes what it is asked for."""

    class Noting:
        def groups(self, since_ns: int | None, until_ns: int | None, *_: object) -> GroupsHistory:
            asked.append((since_ns, until_ns))
            return GroupsHistory(items=[])

    return with_archive(Noting())


def with_archive(archive: object) -> Desk:
    desk = Desk()
    object.__setattr__(desk.parts, "archive", archive)
    return desk


BAD_TIMES = ["", "now", "0", "1700000000", "2026-05-04", "2026-05-04T12:30:15", "2026-13-04T12:30:15Z", "null"]


@pytest.mark.parametrize("said", BAD_TIMES)
@pytest.mark.parametrize("path", HISTORIES)
def test_what_is_no_time_is_malformed(desk: Desk, path: str, said: str) -> None:
    assert desk.get(f"{path}?from={said}").status_code == 422
    assert desk.get(f"{path}?to={said}").status_code == 422
    assert desk.get(f"/groups/at?time={said}").status_code == 422


@pytest.mark.parametrize("path", HISTORIES)
@pytest.mark.parametrize(
    ("query", "status"),
    [
        ("cursor=nonsense", 422),
        ("cursor=%00", 422),
        ("cursor=" + "x" * 501, 422),
        ("limit=0", 422),
        ("limit=1001", 422),
        ("limit=many", 422),
        ("from=2026-05-04T12:30:16Z&to=2026-05-04T12:30:15Z", 409),
        ("from=2026-05-04T12:30:15Z&to=2026-05-04T12:30:15Z", 200),
    ],
)
def test_what_makes_no_sense_is_a_problem(desk: Desk, path: str, query: str, status: int) -> None:
    response = desk.get(f"{path}?{query}")
    assert response.status_code == status
    if status != 200:
        assert Problem.model_validate_json(response.content).status == status


def test_a_time_is_asked_for_and_kinds_are_known(desk: Desk) -> None:
    assert desk.get("/groups/at").status_code == 422
    assert desk.get("/events/history?kind=nonsense").status_code == 422
    assert desk.get("/pairs/r1/r1/history").status_code == 404


@pytest.mark.parametrize("path", [*HISTORIES, "/groups/at?time=2026-05-04T12:30:15Z"])
def test_a_history_that_cannot_be_read_is_worth_another_try(path: str) -> None:
    response = Desk().get(path)
    assert (response.status_code, response.headers["retry-after"]) == (503, "5")
    assert Problem.model_validate_json(response.content).title == "The history cannot be read"


def test_the_reader_keeps_what_it_promises(desk: Desk) -> None:
    archive: Archive = desk.archive
    assert archive.oldest_event() == 1
    with pytest.raises(HistoryUnavailableError):
        Desk().archive.oldest_event()

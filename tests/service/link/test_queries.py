import threading
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import zenoh
from covista_schemas import keys
from covista_schemas.reports import GroupsReport, PairReport, Problem, RobotReport, SimilarityReport
from covista_schemas.zenoh_config import MAX_REPLY_BYTES
from covista_service import answers
from covista_service.link.queries import MAX_WAITING, Queries, Replies
from covista_service.station.snapshot import SimilarityView, Snapshot

from tests.service.deadline import wait_until
from tests.service.link.conftest import Air
from tests.service.station.scenes import Scene

SITE = "queries"


@pytest.fixture(scope="module")
def snapshot() -> Snapshot:
    scene = Scene()
    scene.send("r1")
    scene.send("r2")
    scene.settle()
    return scene.snapshot


@pytest.fixture(scope="module")
def _answering(air: Air, snapshot: Snapshot) -> Iterator[None]:
    queries = Queries(air.station, SITE, lambda: snapshot)
    yield
    queries.close()


def ask(air: Air, key: str) -> zenoh.Reply:
    (reply,) = list(air.rover.get(key, timeout=10.0))
    return reply


@pytest.mark.usefixtures("_answering")
def test_answers_are_those_of_rest(air: Air, snapshot: Snapshot) -> None:
    expected: list[tuple[str, Any]] = [
        (keys.groups(SITE), answers.groups_report(snapshot)),
        (keys.similarity(SITE), answers.similarity_report(snapshot)),
        (keys.pair(SITE, "r2", "r1"), answers.pair_report(snapshot, "r2", "r1")),
        (keys.robot_report(SITE, "r1"), answers.robot_report(snapshot, "r1")),
    ]
    models = (GroupsReport, SimilarityReport, PairReport, RobotReport)
    for (key, report), model in zip(expected, models, strict=True):
        reply = ask(air, key)
        assert reply.ok is not None
        assert reply.ok.encoding == zenoh.Encoding.APPLICATION_JSON
        assert model.model_validate_json(reply.ok.payload.to_bytes()) == report


@pytest.mark.usefixtures("_answering")
@pytest.mark.parametrize(
    ("tail", "title"),
    [
        ("robots/r9", "Unknown robot"),
        ("robots/*", "Unknown robot"),
        ("pairs/r1/r9", "Unknown robot"),
        ("pairs/r1/r1", "Unknown pair"),
    ],
)
def test_what_is_not_there_is_an_error_reply_with_a_problem(air: Air, tail: str, title: str) -> None:
    reply = ask(air, f"covista/{SITE}/station/{tail}")
    assert reply.err is not None
    problem = Problem.model_validate_json(reply.err.payload.to_bytes())
    assert (problem.title, problem.status) == (title, 404)


def test_a_station_that_is_busy_says_so(air: Air) -> None:
    def busy() -> Snapshot:
        raise TimeoutError

    queries = Queries(air.station, "busy", busy)
    reply = ask(air, keys.groups("busy"))
    queries.close()
    assert reply.err is not None
    assert Problem.model_validate_json(reply.err.payload.to_bytes()).status == 503


def test_who_comes_when_many_wait_is_told_so_and_the_others_are_answered(air: Air, snapshot: Snapshot) -> None:
    asked, go_on = threading.Event(), threading.Event()

    def slowly() -> Snapshot:
        asked.set()
        assert go_on.wait(10.0)
        return snapshot

    queries = Queries(air.station, "crowd", slowly)
    replies: list[zenoh.Reply] = []
    key, more = keys.groups("crowd"), 3 * MAX_WAITING
    try:
        air.rover.get(key, replies.append, timeout=20.0)
        assert asked.wait(10.0)
        for _ in range(MAX_WAITING + more):
            air.rover.get(key, replies.append, timeout=20.0)
        wait_until(lambda: len(replies) == more, "those turned away")
        problems = [Problem.model_validate_json(reply.err.payload.to_bytes()) for reply in replies if reply.err]
        assert [(problem.title, problem.status) for problem in problems] == [("The station is busy", 503)] * more
        go_on.set()
        wait_until(lambda: len(replies) == 1 + MAX_WAITING + more, "the others")
        assert all(reply.ok for reply in replies[more:])
    finally:
        go_on.set()
        queries.close()


def test_who_still_waits_at_the_end_is_told_so(air: Air, snapshot: Snapshot) -> None:
    asked, go_on = threading.Event(), threading.Event()

    def slowly() -> Snapshot:
        asked.set()
        assert go_on.wait(10.0)
        return snapshot

    queries = Queries(air.station, "ending", slowly)
    replies: list[zenoh.Reply] = []
    for _ in range(3):
        air.rover.get(keys.groups("ending"), replies.append, timeout=20.0)
    assert asked.wait(10.0)
    wait_until(lambda: len(queries._waiting) == 2)
    closing = threading.Thread(target=queries.close)
    closing.start()
    wait_until(lambda: queries._closing)
    go_on.set()
    closing.join()
    wait_until(lambda: len(replies) == 3, "an answer for everybody")
    assert sorted(bool(reply.ok) for reply in replies) == [False, False, True]


def test_what_is_large_is_made_once_while_it_stands(snapshot: Snapshot) -> None:
    replies = Replies(SITE)
    for key in (keys.similarity(SITE), keys.groups(SITE)):
        first = replies.to(key, snapshot)
        assert replies.to(key, replace(snapshot, now_ns=snapshot.now_ns + 1)) is first
    later = replace(
        snapshot,
        similarity=replace(snapshot.similarity, revision=snapshot.similarity.revision + 1),
        groups=replace(snapshot.groups, scores=((2, 0.5),)),
    )
    similarity = SimilarityReport.model_validate_json(replies.to(keys.similarity(SITE), later).to_bytes())
    assert similarity == answers.similarity_report(later)
    assert GroupsReport.model_validate_json(replies.to(keys.groups(SITE), later).to_bytes()).scores[0].score == 0.5


def test_what_is_larger_than_clients_take_is_refused_with_where_to_get_it(air: Air, snapshot: Snapshot) -> None:
    n = 1000
    matrix = np.random.default_rng(0).random((n, n))
    large = replace(
        snapshot,
        similarity=SimilarityView(5, tuple(f"r{i}" for i in range(n)), 1.0, matrix, matrix, matrix, matrix),
    )
    queries = Queries(air.station, "large", lambda: large)
    try:
        problems = []
        for _ in range(2):
            reply = ask(air, keys.similarity("large"))
            assert reply.err is not None
            problems.append(Problem.model_validate_json(reply.err.payload.to_bytes()))
    finally:
        queries.close()
    assert {(problem.title, problem.status) for problem in problems} == {("Too large for zenoh", 413)}
    assert "GET /api/v1/similarity" in str(problems[0].detail)


def test_what_clients_just_take_arrives(air: Air, snapshot: Snapshot, monkeypatch: pytest.MonkeyPatch) -> None:
    text = "x" * (MAX_REPLY_BYTES - 2)
    monkeypatch.setattr(answers, "similarity_json", lambda snapshot: iter([f'"{text}"'.encode()]))
    queries = Queries(air.station, "brim", lambda: snapshot)
    try:
        reply = ask(air, keys.similarity("brim"))
    finally:
        queries.close()
    assert reply.ok is not None
    assert len(reply.ok.payload) == MAX_REPLY_BYTES


def test_a_fault_in_one_answer_costs_that_answer_alone(
    air: Air, snapshot: Snapshot, caplog: pytest.LogCaptureFixture
) -> None:
    faults = [ZeroDivisionError()]

    def faulty() -> Snapshot:
        if faults:
            raise faults.pop()
        return snapshot

    queries = Queries(air.station, "faulty", faulty)
    assert not list(air.rover.get(keys.groups("faulty"), timeout=10.0))
    assert ask(air, keys.groups("faulty")).ok is not None
    assert "ZeroDivisionError" in caplog.text
    queries.close()

from collections.abc import Iterator
from typing import Any

import pytest
import zenoh
from covista_schemas import keys
from covista_schemas.reports import GroupsReport, PairReport, Problem, RobotReport, SimilarityReport
from covista_service import answers
from covista_service.link.queries import Queries
from covista_service.station.snapshot import Snapshot

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

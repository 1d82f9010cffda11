"""Pages of robots and pairs."""

import itertools

import pytest
from covista_schemas.reports import Problem

from tests.service.api.conftest import Desk


@pytest.fixture(scope="module")
def desk() -> Desk:
    desk = Desk()
    for number in range(7):
        desk.scene.send(f"r{number}")
    desk.scene.settle()
    desk.scene.send_pose("r9", desk.scene.keyframe("r9").pose)
    desk.scene.settle()
    return desk


@pytest.mark.parametrize("limit", [1, 2, 3, 8, 50])
@pytest.mark.parametrize(
    ("path", "noun"),
    [
        ("/robots?", "robots"),
        ("/pairs?", "pairs"),
        ("/pairs?robot=r3", "pairs"),
        ("/pairs?min_overlap=0.3", "pairs"),
        ("/pairs?robot=r9&min_overlap=0", "pairs"),
        ("/pairs?min_overlap=1", "pairs"),
    ],
)
def test_pages_put_together_are_the_whole(desk: Desk, path: str, noun: str, limit: int) -> None:
    whole = desk.get(path).json()
    assert whole["next"] is None
    got, cursor = [], ""
    for page in itertools.count(1):
        answer = desk.get(f"{path}&limit={limit}{cursor}").json()
        assert len(answer[noun]) <= limit
        got += answer[noun]
        if answer["next"] is None:
            break
        assert len(answer[noun]) == limit
        cursor = f"&cursor={answer['next']}"
        assert page < 50
    assert got == whole[noun]


def test_the_rest_after_a_cursor_comes_without_a_limit(desk: Desk) -> None:
    first = desk.get("/robots?limit=2").json()
    rest = desk.get(f"/robots?cursor={first['next']}").json()
    assert first["robots"] + rest["robots"] == desk.get("/robots").json()["robots"]


def test_a_page_goes_on_after_a_robot_that_is_gone_by_then() -> None:
    desk = Desk()
    for number in range(3):
        desk.scene.send(f"r{number}")
    desk.scene.settle()
    cursor = desk.get("/robots?limit=2").json()["next"]
    desk.ask("/api/v1/robots/r1", "DELETE")
    assert [robot["id"] for robot in desk.get(f"/robots?cursor={cursor}").json()["robots"]] == ["r2"]


@pytest.mark.parametrize("path", ["/robots", "/pairs"])
@pytest.mark.parametrize("cursor", ["nonsense", "", ".", "%00", "R1.", "r1.r2.r3", "r1.%0A", "ä."])
def test_what_no_page_has_given_is_malformed(desk: Desk, path: str, cursor: str) -> None:
    response = desk.get(f"{path}?cursor={cursor}")
    assert response.status_code == 422
    assert "cursor" in Problem.model_validate_json(response.content).detail


@pytest.mark.parametrize("path", ["/robots", "/pairs"])
@pytest.mark.parametrize("limit", ["0", "-1", "1001", "x", ""])
def test_limits_are_bounded(desk: Desk, path: str, limit: str) -> None:
    assert desk.get(f"{path}?limit={limit}").status_code == 422

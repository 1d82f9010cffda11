import pytest
from covista_schemas.reports import (
    Group,
    GroupsReport,
    PairReport,
    PairsReport,
    Problem,
    Report,
    RobotReport,
    RobotsReport,
    SimilarityReport,
)

from tests.service.api.conftest import Desk


@pytest.mark.parametrize(
    ("path", "model"),
    [
        ("/robots", RobotsReport),
        ("/robots/r1", RobotReport),
        ("/pairs", PairsReport),
        ("/pairs?robot=r1&min_overlap=0.1", PairsReport),
        ("/pairs/r2/r1", PairReport),
        ("/similarity", SimilarityReport),
        ("/groups", GroupsReport),
        ("/groups/g1", Group),
    ],
)
def test_every_question_is_answered_with_its_model(desk: Desk, path: str, model: type[Report]) -> None:
    response = desk.get(path)
    assert response.status_code == 200
    assert response.headers["content-type"] == "application/json"
    report = model.model_validate_json(response.content)
    assert response.json().keys() == model.model_fields.keys()
    assert report.model_dump(mode="json") == response.json()


def test_pairs_are_narrowed_by_robot_and_overlap(desk: Desk) -> None:
    def names(path: str) -> list[tuple[str, str]]:
        return [(pair["a"], pair["b"]) for pair in desk.get(path).json()["pairs"]]

    assert names("/pairs") == [("r1", "r2"), ("r1", "r4"), ("r2", "r4")]
    assert names("/pairs?robot=r4") == [("r1", "r4"), ("r2", "r4")]
    assert names("/pairs?min_overlap=0.55") == [("r1", "r2")]
    assert names("/pairs?min_overlap=0.65") == []


def test_a_pair_without_an_overlap_is_an_answer(desk: Desk) -> None:
    answer = desk.get("/pairs/r4/r1").json()
    assert (answer["found_by"], answer["overlap_a"], answer["overlap_b"]) == ("unknown", None, None)


@pytest.mark.parametrize("side", ["", "?side=a", "?side=b"])
def test_the_overlay_is_a_picture(desk: Desk, side: str) -> None:
    response = desk.get(f"/pairs/r1/r2/overlay.png{side}")
    assert response.status_code == 200
    assert response.headers["content-type"] == "image/png"
    assert response.content.startswith(b"\x89PNG")


@pytest.mark.parametrize(
    ("path", "status", "title"),
    [
        ("/robots/r9", 404, "Unknown robot"),
        ("/pairs/r1/r9", 404, "Unknown robot"),
        ("/pairs/r9/r1", 404, "Unknown robot"),
        ("/pairs/r1/r1", 404, "Unknown pair"),
        ("/pairs?robot=r9", 404, "Unknown robot"),
        ("/pairs/r1/r4/overlay.png", 404, "No picture"),
        ("/pairs/r1/r9/overlay.png", 404, "Unknown robot"),
        ("/groups/g99", 404, "Unknown group"),
        ("/nonsense", 404, "Not Found"),
        ("/robots/Not-An-Id", 422, "Malformed request"),
        ("/pairs?robot=Not-An-Id", 422, "Malformed request"),
        ("/pairs?min_overlap=much", 422, "Malformed request"),
        ("/pairs?min_overlap=2", 422, "Malformed request"),
        ("/pairs?min_overlap=nan", 422, "Malformed request"),
        ("/pairs/r1/r2/overlay.png?side=c", 422, "Malformed request"),
    ],
)
def test_what_goes_wrong_is_a_problem(desk: Desk, path: str, status: int, title: str) -> None:
    response = desk.get(path)
    assert response.status_code == status
    assert response.headers["content-type"] == "application/problem+json"
    problem = Problem.model_validate_json(response.content)
    assert (problem.status, problem.title) == (status, title)
    assert problem.instance == f"/api/v1{path.partition('?')[0]}"
    assert problem.detail


def test_what_is_malformed_is_named(desk: Desk) -> None:
    detail = desk.get("/pairs?min_overlap=2").json()["detail"]
    assert "min_overlap" in detail
    assert "less than or equal to 1" in detail


def test_methods_that_are_not_there_are_a_problem_that_names_those_that_are(desk: Desk) -> None:
    for path, allowed in (
        ("/robots", "GET, HEAD"),
        ("/robots/r1", "DELETE, GET, HEAD"),
        ("/settings", "GET, HEAD, PATCH"),
        ("/pairs/r1/r2/overlay.png", "GET, HEAD"),
    ):
        response = desk.ask(f"/api/v1{path}", "PUT")
        assert (response.status_code, response.headers["content-type"]) == (405, "application/problem+json")
        assert response.headers["allow"] == allowed


def test_a_bug_of_ours_is_a_problem_without_details(desk: Desk, monkeypatch: pytest.MonkeyPatch) -> None:
    def broken(now_ns: int) -> None:
        raise ZeroDivisionError("secret")

    monkeypatch.setattr(desk.scene.station, "snapshot", broken)
    response = desk.get("/robots")
    assert (response.status_code, response.headers["content-type"]) == (500, "application/problem+json")
    assert "secret" not in response.text


@pytest.mark.parametrize("path", ["/groups", "/similarity"])
def test_who_has_this_version_is_not_sent_it_again(path: str) -> None:
    desk = Desk()
    desk.scene.send("r1")
    desk.scene.settle()
    tag = desk.get(path).headers["etag"]
    for known in (tag, f"W/{tag}", f'"other", {tag}', "*"):
        again = desk.get(path, **{"if-none-match": known})
        assert (again.status_code, again.content, again.headers["etag"]) == (304, b"", tag)
    desk.scene.send("r2")
    desk.scene.settle()
    changed = desk.get(path, **{"if-none-match": tag})
    assert changed.status_code == 200
    assert changed.headers["etag"] != tag


@pytest.mark.parametrize("path", ["/robots", "/pairs/r1/r2", "/groups", "/similarity", "/robots/r99"])
def test_head_is_answered_as_get_is(desk: Desk, path: str) -> None:
    asked, known = desk.ask(f"/api/v1{path}", "HEAD"), desk.get(path)
    assert asked.status_code == known.status_code
    assert asked.headers["content-type"] == known.headers["content-type"]


def test_of_a_keyframe_of_before_the_station_started_there_is_no_picture(desk: Desk) -> None:
    again = Desk(scene=desk.scene.restarted(1))
    told = again.get("/pairs/r1/r2")
    assert told.json()["found_by"] == "decayed"
    assert told.json()["keyframes"] == desk.get("/pairs/r1/r2").json()["keyframes"]
    assert again.get("/pairs/r1/r2/overlay.png").status_code == 404
    assert again.get("/pairs/r1/r2/overlay.png").json()["title"] == "No picture"

import json
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest
from covista_schemas.reports import EventKind, GroupsReport, Hysteresis, LiveSettings, Problem
from covista_service import answers
from covista_service.access import Gate, Keyring, Scope
from covista_service.loop import News

from tests.service.access.sources import Shelf
from tests.service.api.conftest import Desk
from tests.service.api.live import Ear, site


class Notebook:
    def __init__(self) -> None:
        self.news: list[News] = []

    def take(self, news: News) -> None:
        self.news.append(news)


@pytest.fixture
def shelf() -> Shelf:
    """Where there are no tokens, everybody may change settings."""
    return Shelf()


@pytest.fixture
def desk(shelf: Shelf) -> Desk:
    keyring = Keyring()
    keyring.take(shelf.read())
    desk = Desk(gate=Gate(keyring, any_host=True))
    for number in range(4):
        desk.scene.send(f"r{number}")
    desk.scene.settle()
    return desk


@pytest.fixture
def notebook(desk: Desk) -> Notebook:
    notebook = Notebook()
    desk.parts.loop._sinks = (notebook,)
    return notebook


def test_the_settings_in_force_are_told(desk: Desk) -> None:
    assert LiveSettings.model_validate_json(desk.get("/settings").content) == LiveSettings()


def test_a_patch_changes_what_it_names_and_nothing_else(desk: Desk) -> None:
    response = desk.send("PATCH", "/settings", {"alpha": 0.9, "hysteresis": {"gain": 0.2}})
    assert response.status_code == 200
    wanted = LiveSettings(alpha=0.9, hysteresis=Hysteresis(gain=0.2))
    assert LiveSettings.model_validate_json(response.content) == wanted
    assert desk.get("/settings").json() == desk.get("/groups").json()["settings"] == response.json()
    assert desk.send("PATCH", "/settings", {"hysteresis": {"smoothing": 1.0}}).json()["hysteresis"] == {
        "gain": 0.2,
        "persistence_s": 5.0,
        "smoothing": 1.0,
    }


def test_a_patch_takes_effect_before_it_is_answered(desk: Desk) -> None:
    assert len(desk.get("/groups").json()["groups"]) == 1
    desk.send("PATCH", "/settings", {"groups": 2})
    groups = GroupsReport.model_validate_json(desk.get("/groups").content)
    assert len(groups.groups) == 2
    assert groups.settings.groups == 2


def test_a_patch_is_an_event_with_who_and_what_and_the_history_is_told(
    desk: Desk, notebook: Notebook, shelf: Shelf
) -> None:
    token = shelf.add("ada", Scope.OPERATE)
    desk.gate.keyring.take(shelf.read())
    patch = {"groups": {"min": 1, "max": 3}, "hysteresis": {"gain": 0.2}}
    assert desk.send("PATCH", "/settings", patch, authorization=f"Bearer {token}").status_code == 200
    (news,) = (each for each in notebook.news if each.settings is not None)
    (event,) = (each for each in news.events if each.event is EventKind.SETTINGS)
    assert (event.by, event.text) == ("ada", "groups is 1 to 3, was auto; hysteresis.gain is 0.2, was 0.05")
    assert news.patch == {"groups": {"min": 1, "max": 3}, "hysteresis.gain": 0.2}
    assert json.loads(json.dumps(news.patch)) == news.patch
    assert news.settings == answers.live_settings(desk.scene.snapshot.groups.settings)


def test_an_empty_patch_changes_nothing_and_is_no_event(desk: Desk, notebook: Notebook) -> None:
    assert desk.send("PATCH", "/settings", {}).json() == LiveSettings().model_dump(mode="json")
    assert desk.send("PATCH", "/settings", {"hysteresis": {}}).status_code == 200
    assert notebook.news == []


def test_what_is_set_as_it_is_already_is_written_down_all_the_same(desk: Desk, notebook: Notebook) -> None:
    """It was asked for, and is to hold after a restart with another file."""
    desk.send("PATCH", "/settings", {"alpha": 0.5})
    assert [news.patch for news in notebook.news] == [{"alpha": 0.5}]


BAD = [
    ({"alpha": "0.5"}, "alpha"),
    ({"alpha": 2}, "alpha"),
    ({"alpha": True}, "alpha"),
    ({"alpha": None}, "alpha"),
    ({"groups": 0}, "groups"),
    ({"groups": "3"}, "groups"),
    ({"groups": 2.5}, "groups"),
    ({"groups": {"min": "1", "max": 2}}, "groups"),
    ({"groups": {"min": 1}}, "groups"),
    ({"groups": 10**9}, "groups"),
    ({"min_group_size": 0}, "min_group_size"),
    ({"sigma": -1}, "sigma"),
    ({"criterion": "best"}, "criterion"),
    ({"hysteresis": {"gain": "0.1"}}, "gain"),
    ({"hysteresis": {"colour": 1}}, "colour"),
    ({"hysteresis": None}, "hysteresis"),
    ({"colour": "red"}, "colour"),
    ([], "body"),
    (None, "body"),
    ("", "body"),
]


@pytest.mark.parametrize(("method", "path"), [("PATCH", "/settings"), ("POST", "/groups/preview")])
@pytest.mark.parametrize(("body", "named"), BAD, ids=str)
def test_what_makes_no_sense_is_named_and_changes_nothing(
    method: str, path: str, body: object, named: str, desk: Desk, notebook: Notebook
) -> None:
    response = desk.send(method, path, body)
    assert response.status_code == 422
    assert named in Problem.model_validate_json(response.content).detail
    assert notebook.news == []


@pytest.mark.parametrize(("method", "path"), [("PATCH", "/settings"), ("POST", "/groups/preview")])
def test_bounds_that_contradict_each_other_are_a_conflict(
    method: str, path: str, desk: Desk, notebook: Notebook
) -> None:
    """No schema can say which is the larger."""
    response = desk.send(method, path, {"groups": {"min": 3, "max": 2}})
    assert response.status_code == 409
    assert "min must not be larger than max" in Problem.model_validate_json(response.content).detail
    assert notebook.news == []


@pytest.mark.parametrize(("method", "path"), [("PATCH", "/settings"), ("POST", "/groups/preview")])
@pytest.mark.parametrize("body", ["{", '{"alpha": NaN}', '{"alpha": 1e999}', "\0", '{"groups": ' + "9" * 5000 + "}"])
def test_what_is_no_json_is_refused(method: str, path: str, body: str, desk: Desk) -> None:
    response = desk.send(method, path, body)
    assert response.status_code in (400, 422)
    Problem.model_validate_json(response.content)


def test_text_that_a_page_of_others_may_send_unasked_is_no_patch(desk: Desk) -> None:
    """Browsers send it to anybody without asking first."""
    response = desk.send("PATCH", "/settings", '{"alpha": 0.9}', **{"content-type": "text/plain"})
    assert response.status_code == 422
    assert desk.get("/settings").json()["alpha"] == 0.5


def test_a_whole_number_may_be_written_with_a_point(desk: Desk) -> None:
    settings = desk.send("PATCH", "/settings", '{"groups": 2.0, "min_group_size": 1e0}').json()
    assert (settings["groups"], settings["min_group_size"]) == (2, 1)
    bounds = desk.send("PATCH", "/settings", '{"groups": {"min": 1.0, "max": 2.0}}').json()["groups"]
    assert bounds == {"min": 1, "max": 2}


def test_more_groups_than_robots_is_a_note(desk: Desk) -> None:
    assert desk.send("PATCH", "/settings", {"groups": 50}).status_code == 200
    assert "cannot form 50 groups" in desk.get("/groups").json()["note"]


def test_patches_at_the_same_time_are_laid_one_over_the_other(tmp_path: Path) -> None:
    patches = [
        {"alpha": 0.25},
        {"groups": 1},
        {"criterion": "gain"},
        {"sigma": 3.5},
        {"hysteresis": {"gain": 0.25}},
        {"hysteresis": {"persistence_s": 1.5}},
    ]
    with site(tmp_path) as station, ThreadPoolExecutor(len(patches)) as clients, Ear(station) as ear:
        ear.heartbeat()
        answers = list(clients.map(lambda patch: station.ask("PATCH", "/settings", json=patch), patches))
        assert [answer.status_code for answer in answers] == [200] * len(patches)
        wanted = LiveSettings(
            alpha=0.25, groups=1, criterion="gain", sigma=3.5, hysteresis=Hysteresis(gain=0.25, persistence_s=1.5)
        )
        assert LiveSettings.model_validate(station.get("/settings").json()) == wanted
        told = [ear.next() for _ in range(len(patches))]
        assert [each.event for each in told] == ["settings"] * len(patches)


def test_a_station_that_does_not_turn_says_so(desk: Desk, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("covista_service.loop.task.DO_TIMEOUT_S", 0.05)
    monkeypatch.setattr(desk.parts.loop, "turn", lambda: False)
    response = desk.send("PATCH", "/settings", {"alpha": 0.9})
    assert (response.status_code, response.headers["retry-after"]) == (503, "5")
    assert Problem.model_validate_json(response.content).title == "The station is too busy"


def test_a_preview_shows_other_groups_and_changes_nothing(desk: Desk, notebook: Notebook) -> None:
    before = desk.get("/groups").json()
    response = desk.send("POST", "/groups/preview", {"groups": 2})
    assert response.status_code == 200
    shown = GroupsReport.model_validate_json(response.content)
    assert shown.settings == LiveSettings(groups=2)
    assert len(shown.groups) == 2
    assert before["groups"][0]["label"] in {group.label for group in shown.groups}
    assert desk.get("/groups").json() == before
    assert notebook.news == []


def test_a_preview_of_nothing_else_is_what_stands(desk: Desk) -> None:
    assert desk.send("POST", "/groups/preview", {}).json()["groups"] == desk.get("/groups").json()["groups"]


def test_a_robot_is_forgotten_with_who_wanted_it(desk: Desk, notebook: Notebook, shelf: Shelf) -> None:
    may = {"authorization": f"Bearer {shelf.add('ada', Scope.OPERATE)}"}
    desk.gate.keyring.take(shelf.read())
    response = desk.ask("/api/v1/robots/r1", "DELETE", **may)
    assert (response.status_code, response.content) == (204, b"")
    assert desk.get("/robots/r1", **may).status_code == 404
    assert "r1" not in str(desk.get("/groups", **may).json()["groups"])
    events = [event for news in notebook.news for event in news.events if event.event is EventKind.STATUS]
    assert [(event.by, event.robots) for event in events] == [("ada", ["r1"])]
    assert desk.ask("/api/v1/robots/r1", "DELETE", **may).status_code == 404


def test_what_was_refused_for_want_of_a_turn_is_not_done_later(desk: Desk, monkeypatch: pytest.MonkeyPatch) -> None:
    loop = desk.parts.loop
    with monkeypatch.context() as patch:
        patch.setattr("covista_service.loop.task.DO_TIMEOUT_S", 0.05)
        patch.setattr(loop, "turn", lambda: False)
        assert desk.send("PATCH", "/settings", {"alpha": 0.9}).status_code == 503
        assert desk.ask("/api/v1/robots/r1", "DELETE").status_code == 503
    before = desk.get("/settings").json()
    loop.turn()
    assert desk.get("/settings").json() == before
    assert before["alpha"] != 0.9
    assert desk.get("/robots/r1").status_code == 200

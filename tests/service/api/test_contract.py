from typing import Any

import pytest
from covista_schemas import reports
from covista_service.access import Gate, Keyring, Scope

from tests.service.access.sources import Shelf
from tests.service.api.conftest import Desk


@pytest.fixture(scope="module")
def description(desk: Desk) -> dict[str, Any]:
    response = desk.ask("/openapi.json")
    assert response.status_code == 200
    return response.json()


GETS = [
    "/robots",
    "/robots/{robot}",
    "/robots/{robot}/track",
    "/pairs",
    "/pairs/{a}/{b}",
    "/pairs/{a}/{b}/history",
    "/pairs/{a}/{b}/overlay.png",
    "/similarity",
    "/groups",
    "/groups/history",
    "/groups/at",
    "/groups/{label}",
    "/events",
    "/events/history",
    "/settings",
]
OTHERS = [("/groups/preview", "post"), ("/settings", "patch"), ("/robots/{robot}", "delete")]
ALL = [*((noun, "get") for noun in GETS), *OTHERS]
# Errors beside those that every route may answer with.
ALWAYS = {"401", "403", "422", "429", "500", "503"}
ERRORS = {
    ("/robots/{robot}", "get"): {"404"},
    ("/robots/{robot}", "delete"): {"404"},
    ("/robots/{robot}/track", "get"): {"409"},
    ("/pairs", "get"): {"404"},
    ("/pairs/{a}/{b}", "get"): {"404"},
    ("/pairs/{a}/{b}/history", "get"): {"404", "409"},
    ("/pairs/{a}/{b}/overlay.png", "get"): {"404"},
    ("/similarity", "get"): {"406"},
    ("/groups/history", "get"): {"409"},
    ("/groups/at", "get"): {"404"},
    ("/groups/preview", "post"): {"400", "408", "409", "413"},
    ("/groups/{label}", "get"): {"404"},
    ("/events/history", "get"): {"409"},
    ("/settings", "patch"): {"400", "408", "409", "413"},
}
NO_JSON = {("/pairs/{a}/{b}/overlay.png", "get"), ("/events", "get"), ("/robots/{robot}", "delete")}


def test_it_is_openapi_3_1_and_names_every_route(description: dict[str, Any]) -> None:
    assert description["openapi"].startswith("3.1")
    named = {(path, method) for path, methods in description["paths"].items() for method in methods}
    assert named == {(f"/api/v1{noun}", method) for noun, method in ALL} | {
        (path, "get") for path in ("/healthz", "/readyz", "/metrics")
    }


@pytest.mark.parametrize(("noun", "method"), [each for each in ALL if each not in NO_JSON])
def test_every_answer_has_its_model_and_an_example_of_it(description: dict[str, Any], noun: str, method: str) -> None:
    answer = description["paths"][f"/api/v1{noun}"][method]["responses"]["200"]["content"]["application/json"]
    model = getattr(reports, answer["schema"]["$ref"].rpartition("/")[2])
    model.model_validate(answer["example"])


@pytest.mark.parametrize(("noun", "method"), ALL)
def test_every_error_is_a_problem_with_its_schema_and_what_it_means(
    description: dict[str, Any], noun: str, method: str
) -> None:
    responses = description["paths"][f"/api/v1{noun}"][method]["responses"]
    errors = {status: response for status, response in responses.items() if int(status) >= 400}
    assert errors.keys() == ALWAYS | ERRORS.get((noun, method), set())
    for response in errors.values():
        assert response["content"] == {"application/problem+json": {"schema": {"$ref": "#/components/schemas/Problem"}}}
        assert len(response["description"]) > 10


@pytest.mark.parametrize(("noun", "method"), [("/groups/preview", "post"), ("/settings", "patch")])
def test_bodies_have_a_model_and_examples_of_it(description: dict[str, Any], noun: str, method: str) -> None:
    content = description["paths"][f"/api/v1{noun}"][method]["requestBody"]["content"]["application/json"]
    assert content["schema"]["$ref"].endswith("/SettingsPatch")
    for example in content["examples"].values():
        reports.SettingsPatch.model_validate(example["value"])
    patch = description["components"]["schemas"]["SettingsPatch"]
    assert not any("default" in each for each in patch["properties"].values())
    assert patch["additionalProperties"] is False


def test_other_representations_are_described(description: dict[str, Any]) -> None:
    def content(noun: str) -> dict[str, Any]:
        return description["paths"][f"/api/v1{noun}"]["get"]["responses"]["200"]["content"]

    assert content("/similarity").keys() == {"application/json", "application/x-npy", "text/csv"}
    assert content("/events").keys() == {"text/event-stream"}
    assert content("/events")["text/event-stream"]["example"].startswith("id: 118\nevent: join\ndata: {")


def test_every_parameter_says_what_it_is(description: dict[str, Any]) -> None:
    silent = [
        (path, each["name"])
        for path, methods in description["paths"].items()
        for operation in methods.values()
        for each in operation.get("parameters", [])
        if not each.get("description")
    ]
    assert silent == []


def test_the_overlay_is_described_as_a_picture(description: dict[str, Any]) -> None:
    overlay = description["paths"]["/api/v1/pairs/{a}/{b}/overlay.png"]["get"]
    assert overlay["responses"]["200"]["content"].keys() == {"image/png"}


def test_every_reference_leads_somewhere(description: dict[str, Any]) -> None:
    def references(part: object) -> set[str]:
        if isinstance(part, dict):
            own = {part["$ref"]} if isinstance(part.get("$ref"), str) else set()
            return own.union(*(references(value) for value in part.values()))
        return set().union(*(references(value) for value in part)) if isinstance(part, list) else set()

    schemas = {f"#/components/schemas/{name}" for name in description["components"]["schemas"]}
    assert references(description) <= schemas


def test_no_parameter_may_be_null(description: dict[str, Any]) -> None:
    for path in description["paths"].values():
        for operation in path.values():
            assert "null" not in str([each["schema"] for each in operation.get("parameters", [])])


def test_a_station_without_tokens_says_that_none_is_needed_and_one_with_tokens_that_one_is() -> None:
    shelf, keyring = Shelf(), Keyring()
    desk = Desk(gate=Gate(keyring, any_host=True))
    keyring.take([])

    def wanted() -> list[dict[str, list[str]]]:
        paths = desk.ask("/openapi.json").json()["paths"]
        return list(paths["/api/v1/settings"]["patch"]["security"])

    assert wanted() == [{}, {"token": ["operate"]}]
    shelf.add("ada", Scope.OPERATE)
    keyring.take(shelf.read())
    assert wanted() == [{"token": ["operate"]}]

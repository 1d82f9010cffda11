from typing import Any

import pytest
from covista_schemas import reports

from tests.service.api.conftest import Desk


@pytest.fixture(scope="module")
def description(desk: Desk) -> dict[str, Any]:
    response = desk.ask("/openapi.json")
    assert response.status_code == 200
    return response.json()


NOUNS = [
    "/robots",
    "/robots/{robot}",
    "/pairs",
    "/pairs/{a}/{b}",
    "/pairs/{a}/{b}/overlay.png",
    "/similarity",
    "/groups",
    "/groups/{label}",
]


def test_it_is_openapi_3_1_and_names_every_route(description: dict[str, Any]) -> None:
    assert description["openapi"].startswith("3.1")
    assert {f"/api/v1{noun}" for noun in NOUNS} | {"/healthz", "/readyz", "/metrics"} == description["paths"].keys()


@pytest.mark.parametrize("noun", [noun for noun in NOUNS if not noun.endswith(".png")])
def test_every_answer_has_its_model_and_an_example_of_it(description: dict[str, Any], noun: str) -> None:
    answer = description["paths"][f"/api/v1{noun}"]["get"]["responses"]["200"]["content"]["application/json"]
    model = getattr(reports, answer["schema"]["$ref"].rpartition("/")[2])
    model.model_validate(answer["example"])


@pytest.mark.parametrize("noun", NOUNS)
def test_every_error_is_a_problem_with_its_schema(description: dict[str, Any], noun: str) -> None:
    responses = description["paths"][f"/api/v1{noun}"]["get"]["responses"]
    errors = {status: response for status, response in responses.items() if int(status) >= 400}
    assert {"422", "500"} <= errors.keys()
    assert ("404" in errors) == (noun not in ("/robots", "/similarity", "/groups"))
    for response in errors.values():
        assert response["content"] == {"application/problem+json": {"schema": {"$ref": "#/components/schemas/Problem"}}}


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

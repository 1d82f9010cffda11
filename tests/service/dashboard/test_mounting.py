"""A station with its pages and one that was installed without them."""

import pytest
from covista_schemas.reports import Problem
from covista_service.dashboard import mounting, places
from covista_service.dashboard.places import PAGES

from tests.service.api.conftest import Desk


@pytest.mark.parametrize("path", ["", "/", "/similarity", "/pairs/r1/r2", "/log-in"])
def test_without_pages_there_is_a_word_about_that_and_about_what_to_install(
    monkeypatch: pytest.MonkeyPatch, path: str
) -> None:
    monkeypatch.setattr(places, "find_spec", lambda name: None)
    desk = Desk()
    mounting.add_pages(desk.app)
    answer = desk.ask(f"{PAGES.prefix}{path}")
    assert answer.status_code == 404
    assert answer.headers["content-type"] == "application/problem+json"
    problem = Problem.model_validate_json(answer.content)
    assert problem.title == "No dashboard"
    assert "pip install 'covista[dashboard]'" in str(problem.detail)
    assert desk.get("/groups").status_code == 200

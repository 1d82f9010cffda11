import re

import pytest

from tests.service.api.conftest import Desk


def test_the_page_takes_nothing_from_elsewhere(desk: Desk) -> None:
    page = desk.ask("/docs")
    assert page.status_code == 200
    links = re.findall(r'(?:src|href)="([^"]+)"', page.text)
    assert len(links) == 3
    assert all(link.startswith("/docs/files/") for link in links)
    for link in links:
        assert desk.ask(link).status_code == 200, link


def test_the_root_leads_there(desk: Desk) -> None:
    answer = desk.ask("/")
    assert (answer.status_code, answer.headers["location"]) == (307, "/docs")


@pytest.mark.parametrize("path", ["/docs/files/", "/docs/files/../docs_page.py", "/docs/files/nothing.js"])
def test_no_other_file_is_served(desk: Desk, path: str) -> None:
    answer = desk.ask(path)
    assert answer.status_code == 404
    assert answer.headers["content-type"] == "application/problem+json"

"""A station with its pages and one that was installed without them."""

import subprocess
import sys
from pathlib import Path

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


SERVED = """
import asyncio, sys
import httpx
from covista_service import config
from covista_service.app import create_app

async def main():
    settings = {"api": "127.0.0.1:0", "link": "tcp/127.0.0.1:0", "database": f"sqlite:///{sys.argv[1]}/covista.db"}
    app = create_app(config.load(settings))
    async with app.router.lifespan_context(app) as state:
        async def stated(scope, receive, send):
            await app({**scope, "state": dict(state)}, receive, send)
        client = httpx.AsyncClient(transport=httpx.ASGITransport(stated), base_url="http://127.0.0.1")
        async def status(path):
            return (await client.get(path)).status_code
        print(await status("/api/v1/groups"), await status("/dashboard/data/health"), "nicegui" in sys.modules)
        print(*await asyncio.gather(*(status(path) for path in ("/dashboard/", "/dashboard/health", "/dashboard/no"))))
        print("nicegui" in sys.modules)

asyncio.run(main())
"""


def test_what_serves_pages_starts_with_the_first_that_is_asked_for(tmp_path: Path) -> None:
    command = [sys.executable, "-c", SERVED, str(tmp_path)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=60, check=False)
    assert done.stdout.splitlines() == ["200 200 False", "200 200 404", "True"], done.stderr

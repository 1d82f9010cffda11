import asyncio
from datetime import datetime
from types import SimpleNamespace
from typing import Any

import httpx
import pytest
from covista_schemas.reports import time_of
from covista_service.dashboard.data_pairs import router
from covista_service.dashboard.looks import Looks
from covista_service.dashboard.sources import sources_of
from covista_service.loop.rooms import Room
from fastapi import FastAPI

from tests.service.answers.test_answers import FIRST, SECOND, both_see_the_wall
from tests.service.station.scenes import Scene


@pytest.fixture(scope="module")
def app() -> FastAPI:
    scene = Scene()
    scene.send("r1", FIRST)
    scene.send("r2", SECOND)
    scene.settle(both_see_the_wall)
    snapshot = scene.snapshot
    sources = SimpleNamespace(loop=SimpleNamespace(snapshot=lambda: snapshot), looks=Looks(), drawing=Room(1, 9))
    app = FastAPI()
    app.include_router(router)
    app.dependency_overrides[sources_of] = lambda: sources
    return app


def ask(app: FastAPI, path: str) -> Any:
    async def asking() -> Any:
        async with httpx.AsyncClient(transport=httpx.ASGITransport(app), base_url="http://station") as client:
            response = await client.get(path)
            return response.json() if response.status_code == 200 else response.status_code

    return asyncio.run(asking())


def test_who_makes_no_pair_is_an_answer_and_no_error(app: FastAPI) -> None:
    told = ask(app, "/pair?a=r1&b=r9")
    assert (told["a"], told["b"], told["problem"]) == ("r1", "r9", "no robot 'r9' is known")
    assert "with itself" in ask(app, "/pair?a=r1&b=r1")["problem"]


def test_the_time_is_that_of_the_station_for_who_makes_no_pair_too(app: FastAPI) -> None:
    sources = app.dependency_overrides[sources_of]()
    now = time_of(sources.loop.snapshot().wall_ns)
    for other in ("r2", "r9"):
        assert datetime.fromisoformat(ask(app, f"/pair?a=r1&b={other}")["time"]) == now


def test_what_is_no_name_is_refused(app: FastAPI) -> None:
    assert ask(app, "/pair?a=r1&b=%3Cb%3E") == 422
    assert ask(app, "/pair/look?a=R1&b=r2") == 422


def test_facts_and_look_are_of_the_pair_in_the_order_asked(app: FastAPI) -> None:
    facts, look = ask(app, "/pair?a=r2&b=r1"), ask(app, "/pair/look?a=r2&b=r1")
    assert (facts["overlap_a"], facts["overlap_b"]) == (0.75, 0.25)
    assert (look["pair"]["a"], look["pair"]["overlap_a"]) == ("r2", 0.75)
    assert len(look["pictures"]) == 2
    assert look["since_s"] == 0


def test_who_has_a_version_is_sent_no_pictures_again(app: FastAPI) -> None:
    version = ask(app, "/pair/look?a=r1&b=r2")["version"]
    assert ask(app, f"/pair/look?a=r1&b=r2&known={version}") == {"version": version, "since_s": 0}
    assert "pictures" in ask(app, "/pair/look?a=r1&b=r2&known=another")

"""Every route of a whole station, asked all that the description allows and much that it does not.

Schemathesis makes the questions and holds the answers to the description, with all its checks: examples, the bounds of
every parameter, random ones, and sequences that use what earlier answers told. The short run belongs to every check;
`make api-test` asks thousands.
"""

import os
import re
import subprocess
import sys
from collections.abc import Iterator
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path

import httpx
import pytest
import zenoh
from covista_schemas import keys
from covista_schemas.zenoh_config import config
from covista_service.access import Attempts, Scope
from covista_service.access.tokens import new_secret
from covista_service.api import stream
from covista_service.store.history import History
from covista_service.store.tokens import Tokens

from tests.service.deadline import wait_until
from tests.service.wall import keyframe_bytes
from tests.system.running_station import running_station, settings_for

# Random questions to each route, and how many cases there are at least.
EXAMPLES = int(os.environ.get("COVISTA_API_EXAMPLES", "2"))
CASES = int(os.environ.get("COVISTA_API_CASES", "300"))
# Who is not let in waits each time for tokens that may be new: three minutes even of few questions, and no more.
WITH = ("open", "operator", "stranger") if EXAMPLES > 10 else ("open", "operator")
ROBOTS = 6


@dataclass(frozen=True)
class Asked:
    """A station, and what is asked with."""

    url: str
    token: str | None
    stranger: bool


@pytest.fixture(scope="module", params=WITH)
def asked(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Asked]:
    """A station that has heard of some robots, whose streams of events end soon: they are read to the end.

    It asks nobody for a token, or has some: that of an operator is sent along, or one that lets nobody in.
    """
    settings = settings_for(tmp_path_factory.mktemp("station"))
    token = None if request.param == "open" else _operator(settings.database)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(stream, "LONGEST_S", 0.05)
        # Who asks so much without a token hears 429 before long, and no more of why.
        patch.setattr(Attempts.__init__, "__defaults__", (10**9,))
        with running_station(settings) as station:
            wait_until(lambda: httpx.get(f"{station.url}/readyz").json()["status"] == "ready", "it is ready", 100)
            air = zenoh.open(config("client", connect=[station.link[0]]))
            headers = {} if token is None else {"authorization": f"Bearer {token}"}
            with httpx.Client(base_url=f"{station.url}/api/v1", headers=headers) as client:
                wait_until(lambda: _heard(client, air), "all robots are heard of")
                wait_until(lambda: _measured(client), "all pairs are measured")
            stranger = request.param == "stranger"
            yield Asked(station.url, new_secret() if stranger else token, stranger)
            air.close()


def _operator(database: str) -> str:
    with closing(History(database)), closing(Tokens(database)) as tokens:
        return tokens.add("operator", frozenset({Scope.OPERATE}))


def _heard(client: httpx.Client, air: zenoh.Session) -> bool:
    """Are all robots known? Who is not says again what he sees."""
    known = {robot["id"] for robot in client.get("/robots").json()["robots"]}
    missing = [number for number in range(ROBOTS) if f"r{number}" not in known]
    for number in missing:
        air.put(keys.keyframe("default", f"r{number}"), keyframe_bytes(f"r{number}", 0.4 * number))
    return not missing


def _measured(client: httpx.Client) -> bool:
    pairs = client.get("/pairs").json()["pairs"]
    return len(pairs) == ROBOTS * (ROBOTS - 1) // 2 and any(pair["overlap_a"] for pair in pairs)


@pytest.mark.timeout(3600)
def test_no_answer_is_outside_of_the_description(asked: Asked, tmp_path: Path) -> None:
    examples, cases = (2, 300) if asked.stranger else (EXAMPLES, CASES)
    header = [] if asked.token is None else ["--header", f"Authorization: Bearer {asked.token}"]
    ran = subprocess.run(
        [
            Path(sys.executable).with_name("st"),
            "run",
            f"{asked.url}/openapi.json",
            "--checks=all",
            f"--max-examples={examples}",
            "--seed=7",
            "--workers=1",
            "--no-color",
            *header,
        ],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        check=False,
    )
    assert ran.returncode == 0, ran.stdout[-20_000:] + ran.stderr[-2000:]
    for phase in ("Examples", "Coverage", "Fuzzing", "Stateful"):
        assert re.search(rf"✅ {phase}$", ran.stdout, re.MULTILINE), ran.stdout[-3000:]
    generated = re.search(r"(\d[\d,]*) generated", ran.stdout)
    assert generated is not None
    assert int(generated[1].replace(",", "")) >= cases, ran.stdout[-800:]
    sys.stdout.write(ran.stdout[-800:])

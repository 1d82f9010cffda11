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
from pathlib import Path

import httpx
import pytest
import zenoh
from covista_schemas import keys
from covista_schemas.zenoh_config import config
from covista_service.api import stream

from tests.service.deadline import wait_until
from tests.service.wall import keyframe_bytes
from tests.system.running_station import running_station, settings_for

# Random questions to each route, and how many cases there are at least.
EXAMPLES = int(os.environ.get("COVISTA_API_EXAMPLES", "2"))
CASES = int(os.environ.get("COVISTA_API_CASES", "300"))
ROBOTS = 6


@pytest.fixture(scope="module")
def url(tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    """A station that has heard of some robots, whose streams of events end soon: they are read to the end."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(stream, "LONGEST_S", 0.05)
        with running_station(settings_for(tmp_path_factory.mktemp("station"))) as station:
            wait_until(lambda: httpx.get(f"{station.url}/readyz").json()["status"] == "ready", "it is ready", 100)
            air = zenoh.open(config("client", connect=[station.link[0]]))
            wait_until(lambda: _heard(station.url, air), "all robots are heard of")
            wait_until(lambda: _measured(station.url), "all pairs are measured")
            yield station.url
            air.close()


def _heard(url: str, air: zenoh.Session) -> bool:
    """Are all robots known? Who is not says again what he sees."""
    known = {robot["id"] for robot in httpx.get(f"{url}/api/v1/robots").json()["robots"]}
    missing = [number for number in range(ROBOTS) if f"r{number}" not in known]
    for number in missing:
        air.put(keys.keyframe("default", f"r{number}"), keyframe_bytes(f"r{number}", 0.4 * number))
    return not missing


def _measured(url: str) -> bool:
    pairs = httpx.get(f"{url}/api/v1/pairs").json()["pairs"]
    return len(pairs) == ROBOTS * (ROBOTS - 1) // 2 and any(pair["overlap_a"] for pair in pairs)


@pytest.mark.timeout(3600)
@pytest.mark.parametrize("token", [None], ids=["no token asked for"])
def test_no_answer_is_outside_of_the_description(url: str, token: str | None, tmp_path: Path) -> None:
    header = [] if token is None else ["--header", f"Authorization: Bearer {token}"]
    ran = subprocess.run(
        [
            Path(sys.executable).with_name("st"),
            "run",
            f"{url}/openapi.json",
            "--checks=all",
            f"--max-examples={EXAMPLES}",
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
    assert int(generated[1].replace(",", "")) >= CASES
    sys.stdout.write(ran.stdout[-800:])

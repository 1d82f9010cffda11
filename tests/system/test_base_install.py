"""What `pip install covista` gives, without extras: a rover that is light and works."""

import json
import socket
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from queue import SimpleQueue

import pytest
import zenoh
from covista_schemas import codec, keys
from covista_schemas.zenoh_config import config

from tests import wheel

HEAVY = {"cv2", "dask", "fastapi", "matplotlib", "nicegui", "numba", "scipy", "sklearn", "sqlalchemy", "uvicorn"}
MOST_DISTRIBUTIONS = 25
INSTALLERS = {"pip", "setuptools"}
SCRIPT = Path(__file__).with_name("light_rover.py")


@pytest.fixture(scope="module")
def light_python(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Python of a fresh environment in which the base alone is installed."""
    folder = tmp_path_factory.mktemp("light")
    python = folder / "venv" / "bin" / "python"
    subprocess.run([sys.executable, "-m", "venv", folder / "venv"], check=True)
    command = [python, "-m", "pip", "install", "--quiet", "--disable-pip-version-check", wheel.build(folder)]
    subprocess.run(command, check=True)
    return python


@pytest.fixture
def endpoint() -> str:
    with socket.create_server(("127.0.0.1", 0)) as server:
        return f"tcp/127.0.0.1:{server.getsockname()[1]}"


@pytest.fixture
def arrivals(endpoint: str) -> Iterator[SimpleQueue[bytes]]:
    """Keyframes of r1 as they arrive at a router of this process."""
    arrived: SimpleQueue[bytes] = SimpleQueue()
    with zenoh.open(config("router", listen=[endpoint])) as session:
        session.declare_subscriber(
            keys.keyframe("default", "r1"), lambda sample: arrived.put(sample.payload.to_bytes())
        )
        yield arrived


def test_a_rover_needs_the_base_alone(light_python: Path, endpoint: str, arrivals: SimpleQueue[bytes]) -> None:
    command = [light_python, "-I", "-W", "error", SCRIPT, endpoint]
    done = subprocess.run(command, check=True, capture_output=True, text=True, timeout=60)
    keyframe = codec.decode_keyframe(arrivals.get(timeout=10), robot="r1")
    assert keyframe.sequence == 0
    assert keyframe.pose.position_m == (1.0, 2.0, 3.0)
    assert keyframe.features is not None
    assert len(keyframe.features) == 50

    told = json.loads(done.stdout)
    assert not HEAVY & {name.split(".")[0] for name in told["modules"]}
    assert len(set(told["installed"]) - INSTALLERS - {"covista"}) <= MOST_DISTRIBUTIONS


def test_a_command_that_needs_an_extra_says_which(light_python: Path) -> None:
    command = [light_python.with_name("covista-station"), "serve"]
    done = subprocess.run(command, check=False, capture_output=True, text=True, timeout=60)
    said = (done.stdout + done.stderr).strip()
    assert done.returncode != 0
    assert "covista[station]" in said
    assert len(said.splitlines()) == 1


def test_the_simulated_swarm_says_that_it_needs_pictures(light_python: Path) -> None:
    command = [light_python.with_name("covista"), "swarm"]
    done = subprocess.run(command, check=False, capture_output=True, text=True, timeout=60)
    said = (done.stdout + done.stderr).strip()
    assert done.returncode != 0
    assert "covista[vision]" in said
    assert len(said.splitlines()) == 1

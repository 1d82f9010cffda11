"""Station and rovers in containers, under a project name of their own and on ports that nobody else has."""

import os
import subprocess
import threading
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from subprocess import CalledProcessError, TimeoutExpired
from typing import TypeVar

ROOT = Path(__file__).parents[2]
# Of the images that the tests build.
TAG = "test"
Answer = TypeVar("Answer")


@dataclass(frozen=True, slots=True)
class Stack:
    """One deployment of docker/compose.yaml."""

    command: tuple[str, ...]
    environment: Mapping[str, str]

    def run(self, *arguments: str, within_s: float = 120) -> str:
        """Run a compose command and give what it said; CalledProcessError carries it where it failed."""
        return said([*self.command, *arguments], within_s, self.environment)

    def start(self) -> None:
        """Start the station, wait until it is healthy, start the rovers."""
        try:
            self.run("up", "--detach", within_s=180)
        except (CalledProcessError, TimeoutExpired) as error:
            error.add_note(self.logs())
            raise

    def url(self) -> str:
        """Where the station's REST is published on this machine."""
        return f"http://{self.port('station', 8000)}"

    def port(self, service: str, port: int) -> str:
        """Address and port of this machine where a service's port is published."""
        return self.run("port", service, str(port)).strip()

    def container(self, service: str) -> str:
        """Id of the service's container, running or not."""
        return self.run("ps", "--all", "--quiet", service).strip()

    def logs(self) -> str:
        """The last lines of every container."""
        return self.run("logs", "--no-color", "--tail=200")

    def take_down(self) -> None:
        """End the containers, and remove them with their network and volume."""
        self.run("down", "--volumes", "--remove-orphans", "--timeout=10")


def of_this_tree(
    name: str = "", more: tuple[Path, ...] = (), profiles: tuple[str, ...] = (), **environment: str
) -> Stack:
    """A deployment of docker/compose.yaml, with more files laid over it: not yet built, not yet running."""
    project = "-".join(filter(None, ("covista-test", str(os.getpid()), name)))
    settled = {
        "BASE_IMAGE": said([str(ROOT / "docker" / "base.sh")], within_s=600).strip(),
        # Compose of all versions names the operators' network by it.
        "COMPOSE_PROJECT_NAME": project,
        "COVISTA_TAG": TAG,
        "COVISTA_API_AT": "127.0.0.1:0",
        "COVISTA_LINK_AT": "127.0.0.1:0",
        "COVISTA_ROUTER_AT": "127.0.0.1:0",
    }
    files = (ROOT / "docker" / "compose.yaml", *more)
    options = [option for file in files for option in ("--file", str(file))]
    options += [option for profile in profiles for option in ("--profile", profile)]
    return Stack((*compose(), "--project-name", project, *options), {**settled, **environment})


def compose() -> tuple[str, ...]:
    """Docker's own subcommand on some machines, a program on others."""
    asked = subprocess.run(["docker", "compose", "version"], check=False, capture_output=True)
    return ("docker", "compose") if asked.returncode == 0 else ("docker-compose",)


def engine_answers() -> bool:
    """Whether there is a Docker engine to run the tests on."""
    try:
        return subprocess.run(["docker", "info"], check=False, capture_output=True, timeout=30).returncode == 0
    except (FileNotFoundError, TimeoutExpired):
        return False


def said(command: list[str], within_s: float, environment: Mapping[str, str] | None = None) -> str:
    """Standard output of a command; where it fails, both its outputs are noted on the error."""
    env = {**os.environ, **(environment or {})}
    done = subprocess.run(command, check=False, capture_output=True, text=True, timeout=within_s, env=env)
    if done.returncode:
        error = CalledProcessError(done.returncode, command)
        error.add_note(done.stdout + done.stderr)
        raise error
    return done.stdout


def wait_for(ask: Callable[[], Answer | None], within_s: float, what: str, every_s: float = 0.5) -> Answer:
    """The first answer that is not None, asked again and again."""
    ends = time.monotonic() + within_s
    between = threading.Event()
    while time.monotonic() < ends:
        if (answer := ask()) is not None:
            return answer
        between.wait(every_s)
    raise TimeoutError(f"not within {within_s} s: {what}")

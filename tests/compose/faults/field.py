"""A deployment that tests break: what they do to its containers, and what they ask its station."""

from __future__ import annotations

import json
import os
import socket
import subprocess
import time
from collections import Counter
from collections.abc import Callable, Iterable, Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import httpx

from tests.compose.stack import ROOT, Stack, compose, said, wait_for

HERE = Path(__file__).parent
ROVERS = ("r1", "r2", "r3", "r4")
TOPICS = ("keyframes", "poses")
IMAGES = {"station": "covista-test-station", "rover": "covista-test-rover"}
# As compose.yaml sets them, and how often presence is looked at beside what the machine takes.
LIVE_AFTER_S, GONE_AFTER_S = 2.0, 4.0
# A link that falls silent is given up after its lease.
LEASE_S = 2.0


@dataclass(frozen=True, slots=True, eq=False)
class Field:
    """Station and four rovers, each a container; `behind` says that a router, a server and a cluster stand between."""

    stack: Stack
    project: str
    api_port: int
    link_port: int
    behind: bool
    extras: list[str] = field(default_factory=list)

    @property
    def endpoint(self) -> str:
        """Where robots inside the rovers' network find zenoh."""
        return f"tcp/{'router' if self.behind else 'station'}:7447"

    def ask(self, path: str) -> Any:
        """What the station answers; an exception of httpx where it does not."""
        answer = httpx.get(f"http://127.0.0.1:{self.api_port}/{path}", timeout=5)
        return answer.raise_for_status().json()

    def robots(self) -> dict[str, dict[str, Any]]:
        """Reports by robot."""
        return {report["id"]: report for report in self.ask("api/v1/robots")["robots"]}

    def grouped(self) -> set[str]:
        """Robots that stand in a group."""
        return {robot for group in self.ask("api/v1/groups")["groups"] for robot in group["robots"]}

    def until(self, holds: Callable[[], object], within_s: float, what: str) -> float:
        """Seconds until it holds; a station that does not answer makes it not hold."""
        began = time.monotonic()

        def look() -> float | None:
            try:
                return time.monotonic() - began if holds() else None
            except (httpx.HTTPError, KeyError):
                return None

        return wait_for(look, within_s, what, every_s=0.05)

    def until_status(self, robot: str, status: str, within_s: float) -> float:
        """Seconds until the robot is live, stale or gone."""
        return self.until(lambda: self.robots()[robot]["status"] == status, within_s, f"{robot} {status}")

    def at_work(self, robots: Iterable[str] = ROVERS) -> bool:
        """Whether these are live, in groups, and had a keyframe used whose boot is their present one."""
        known, grouped = self.robots(), self.grouped()
        return all(
            robot in grouped
            and known[robot]["status"] == "live"
            and known[robot]["keyframes"]["used"] > 0
            and (known[robot]["keyframe"] or {}).get("boot") == known[robot]["boot"]
            for robot in robots
        )

    def container(self, service: str) -> str:
        """Id of a service's container."""
        return self.stack.container(service).splitlines()[0]

    def start(self, *services: str) -> None:
        """Start containers that stand still."""
        docker("start", *map(self.container, services))

    def stop(self, *services: str) -> None:
        """Ask containers to end, side by side, and wait for it."""
        with ThreadPoolExecutor(len(services)) as pool:
            list(pool.map(lambda each: docker("stop", "--time=10", each), map(self.container, services)))

    def kill(self, service: str) -> None:
        """kill -9 of a container that stays down."""
        docker("kill", "--signal=KILL", self.container(service))

    def crash(self, service: str) -> None:
        """kill -9 of all processes in a container, as a bug would; its restart policy takes over."""
        subprocess.run(["docker", "exec", self.container(service), "sh", "-c", "kill -9 -1"], check=False, timeout=60)

    def cut(self, service: str, network: str = "rovers") -> None:
        """Take a container off a network."""
        docker("network", "disconnect", f"{self.project}_{network}", self.container(service))

    def join(self, service: str, network: str = "rovers") -> None:
        """Put it back, under its name."""
        docker("network", "connect", f"--alias={service}", f"{self.project}_{network}", self.container(service))

    def beside(self, name: str, *command: str) -> None:
        """Run a rover's image in the rovers' network, in the background, until `end_beside`."""
        labelled = f"{self.project}_{name}"
        network = f"--network={self.project}_rovers"
        docker("run", "--detach", "--init", f"--name={labelled}", network, IMAGES["rover"], *command)
        self.extras.append(labelled)

    def end_beside(self, name: str) -> list[dict[str, Any]]:
        """End it in order, and give its accounts."""
        labelled = f"{self.project}_{name}"
        docker("stop", "--time=10", labelled)
        return last_accounts(said_by(labelled))

    def send(self, script: str, *arguments: str) -> dict[str, Any]:
        """Run a script of this folder on the rover's image to its end; gives what it says that it has sent."""
        command = ["docker", "run", "--rm", "--interactive", f"--network={self.project}_rovers", IMAGES["rover"]]
        code = (HERE / "senders" / f"{script}.py").read_text("utf-8")
        done = subprocess.run(
            [*command, "python", "-", *arguments, self.endpoint],
            input=code,
            capture_output=True,
            text=True,
            timeout=120,
        )
        assert done.returncode == 0, done.stderr
        told: dict[str, Any] = json.loads(done.stdout)
        return told

    def log(self) -> str:
        """All that all containers have said."""
        return self.stack.run("logs", "--no-color") + "".join(map(said_by, self.extras))

    def take_down(self) -> None:
        """Remove everything."""
        for name in self.extras:
            subprocess.run(["docker", "rm", "--force", name], check=False, capture_output=True)
        self.stack.take_down()


def docker(*arguments: str) -> str:
    """What the engine answers."""
    return said(["docker", *arguments], within_s=120)


def said_by(container: str) -> str:
    """Both outputs of a container."""
    done = subprocess.run(["docker", "logs", container], check=True, capture_output=True, text=True, timeout=60)
    return done.stdout + done.stderr


def last_accounts(text: str) -> list[dict[str, Any]]:
    """Of each boot the last account in a log."""
    lines = (line.split("|", 1)[-1].strip() for line in text.splitlines())
    accounts = [json.loads(line) for line in lines if line.startswith('{"robot"')]
    return list({(each["robot"], each.get("boot")): each for each in accounts}.values())


def heard(report: Mapping[str, Any], topic: str) -> int:
    """How many messages a robot must have sent, by the station's account."""
    counts = report[topic]
    return int(counts["received"] - counts["duplicate"] + counts["missing"])


def check_sums(report: Mapping[str, Any]) -> None:
    """received = used + replaced + duplicate + waiting + dropped."""
    for topic in TOPICS:
        counts = report[topic]
        parts = sum(counts[fate] for fate in ("used", "replaced", "duplicate", "waiting"))
        assert counts["received"] == parts + sum(counts["dropped"].values()), (report["id"], topic, counts)


def sums(accounts: Iterable[Mapping[str, Any]]) -> Counter[tuple[str, str]]:
    """Messages by robot and topic."""
    total: Counter[tuple[str, str]] = Counter()
    for each in accounts:
        for topic in TOPICS:
            total[each["robot"], topic] += each[topic]
    return total


def deploy(*, behind: bool) -> Field:
    """Start a deployment of images that are built, and wait until the swarm is at work."""
    project = f"covista-test-{os.getpid()}-{'behind' if behind else 'plain'}"
    ports = free_ports(2)
    environment = {"API_PORT": str(ports[0]), "LINK_PORT": str(ports[1])}
    profile: tuple[str, ...] = ()
    if behind:
        profile = ("--profile", "behind")
        environment |= {
            "ROVERS_CONNECT": "router",
            "STATION_COMMAND": "covista-station serve --connect tcp/router:7447",
            "STATION_DATABASE": "postgresql+psycopg://postgres@postgres/postgres",
            "STATION_WORKERS": "dask://scheduler:8786",
        }
    command = (*compose(), "--project-name", project, "--file", str(HERE / "compose.yaml"), *profile)
    deployed = Field(Stack(command, environment), project, ports[0], ports[1], behind)
    try:
        deployed.stack.start()
        deployed.until(deployed.at_work, 120, "the swarm at work")
    except BaseException as error:
        error.add_note(deployed.stack.logs())
        deployed.take_down()
        raise
    return deployed


def build() -> None:
    """The images of this tree, and a PostgreSQL on the same base."""
    base = f"BASE_IMAGE={said([str(ROOT / 'docker' / 'base.sh')], within_s=600).strip()}"
    for target, image in IMAGES.items():
        build_image(image, "--file", str(ROOT / "docker" / "Dockerfile"), "--target", target, "--build-arg", base)
    docker_file = HERE / "postgres.Dockerfile"
    build_image("covista-test-postgres", "--file", str(docker_file), "--build-arg", base, context=HERE)


def build_image(tag: str, *arguments: str, context: Path = ROOT) -> None:
    """Build one image."""
    said(["docker", "build", "--quiet", "--tag", tag, *arguments, str(context)], within_s=1200)


def relabel(target: str, tag: str, version: str) -> None:
    """An image that is another version by its label, and the same by what it does."""
    label = f"org.opencontainers.image.version={version}"
    command = ["docker", "build", "--quiet", "--tag", tag, "--label", label, "-"]
    subprocess.run(command, input=f"FROM {IMAGES[target]}\n", text=True, check=True, capture_output=True, timeout=300)


def free_ports(count: int) -> list[int]:
    """Ports of loopback that nobody has."""
    servers = [socket.create_server(("127.0.0.1", 0)) for _ in range(count)]
    try:
        return [server.getsockname()[1] for server in servers]
    finally:
        for server in servers:
            server.close()

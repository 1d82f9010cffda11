"""A deployment that tests break: what they do to its containers, and what they ask its station."""

from __future__ import annotations

import json
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

from tests.compose.stack import ROOT, TAG, Stack, of_this_tree, said, wait_for

HERE = Path(__file__).parent
ROVERS = ("r1", "r2", "r3", "r4")
TOPICS = ("keyframes", "poses")
IMAGES = {target: f"covista-{target}:{TAG}" for target in ("station", "rover", "postgres")}
# Seconds instead of minutes.
LIVE_AFTER_S, GONE_AFTER_S = 2.0, 4.0
# Router, database and cluster between: as docs/containers.md says.
BEHIND_PROFILES = ("router", "postgres", "scale")
BEHIND = {
    "COVISTA_STATION_NETWORK": "backbone",
    "COVISTA_LINK": "",
    "COVISTA_CONNECT": "tcp/router:7447",
    "COVISTA_ROVERS_CONNECT": "tcp/router:7447",
    "COVISTA_DATABASE": "postgresql+psycopg://covista@postgres/covista",
    "COVISTA_POSTGRES_PASSWORD": "for-tests",
    "COVISTA_POSTGRES_IMAGE": IMAGES["postgres"],
    "COVISTA_WORKERS": "dask://scheduler:8786",
}
# A link that falls silent is given up after its lease.
LEASE_S = 2.0


@dataclass(frozen=True, slots=True, eq=False)
class Field:
    """Station and four rovers, each a container; `behind` says that a router, a server and a cluster stand between."""

    stack: Stack
    behind: bool
    # Where REST answers, and where zenoh does, for who is no container.
    url: str
    link: str
    extras: list[str] = field(default_factory=list)

    @property
    def project(self) -> str:
        """What the names of networks and containers begin with."""
        return self.stack.environment["COMPOSE_PROJECT_NAME"]

    @property
    def endpoint(self) -> str:
        """Where robots inside the rovers' network find zenoh."""
        return f"tcp/{'router' if self.behind else 'station'}:7447"

    def ask(self, path: str) -> Any:
        """What the station answers; an exception of httpx where it does not."""
        answer = httpx.get(f"{self.url}/{path}", timeout=5)
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
    api, link = free_ports(2)
    # Fixed: a container that starts anew is found where it was.
    settings = {
        "COVISTA_API_AT": f"127.0.0.1:{api}",
        "COVISTA_ROUTER_AT" if behind else "COVISTA_LINK_AT": f"127.0.0.1:{link}",
        "COVISTA_LIVE_AFTER_S": f"{LIVE_AFTER_S:g}",
        "COVISTA_GONE_AFTER_S": f"{GONE_AFTER_S:g}",
    }
    if behind:
        build_postgres()
    name, profiles, more = ("behind", tuple(BEHIND_PROFILES), BEHIND) if behind else ("plain", (), {})
    stack = of_this_tree(name, (HERE / "compose.yaml",), profiles, **settings, **more)
    deployed = Field(stack, behind, f"http://127.0.0.1:{api}", f"tcp/127.0.0.1:{link}")
    try:
        deployed.stack.start()
        deployed.until(deployed.at_work, 120, "the swarm at work")
    except BaseException as error:
        error.add_note(deployed.stack.logs())
        deployed.take_down()
        raise
    return deployed


def build_postgres() -> None:
    """What takes the place of the public image."""
    base = said([str(ROOT / "docker" / "base.sh")], within_s=600).strip()
    command = ["docker", "build", "--quiet", "--build-arg", f"BASE_IMAGE={base}", "--tag", IMAGES["postgres"]]
    said([*command, str(ROOT / "docker" / "postgres")], within_s=1200)


def relabel(target: str, tag: str, version: str) -> None:
    """The same image under another tag, and of another version by its label."""
    label = f"org.opencontainers.image.version={version}"
    command = ["docker", "build", "--quiet", "--tag", f"covista-{target}:{tag}", "--label", label, "-"]
    subprocess.run(command, input=f"FROM {IMAGES[target]}\n", text=True, check=True, capture_output=True, timeout=300)


def free_ports(count: int) -> list[int]:
    """Ports of loopback that nobody has."""
    servers = [socket.create_server(("127.0.0.1", 0)) for _ in range(count)]
    try:
        return [server.getsockname()[1] for server in servers]
    finally:
        for server in servers:
            server.close()

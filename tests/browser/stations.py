"""A station's process with rovers around it, as a browser comes to it."""

from __future__ import annotations

import re
import signal
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import httpx
from covista_clients import MissionControl
from covista_service.access import Scope
from covista_service.store.tokens import Tokens

from tests.browser.rovers import OTHERS, ROBOTS, TOGETHER, Rovers
from tests.service.deadline import free_endpoint, wait_until
from tests.system.certificates import Pair
from tests.system.station_commands import COMMAND, environment

# A machine that has never run it compiles first.
READY_S = 240.0


@dataclass
class BrowsedStation:
    """A station's process: `url` stays the same when it is started again, and so do its link and its database."""

    folder: Path
    tls: Pair | None = None
    settings: dict[str, str] = field(default_factory=dict)
    link: str = field(default_factory=free_endpoint)
    url: str = ""
    rovers: Rovers = field(init=False)

    def __post_init__(self) -> None:
        self._process: subprocess.Popen[bytes] | None = None

    @property
    def data_url(self) -> str:
        """Where pages ask for what REST does not have."""
        return f"{self.url}/dashboard/data"

    @property
    def pid(self) -> int:
        """The process that runs now."""
        assert self._process is not None
        return self._process.pid

    @property
    def log(self) -> str:
        """What it has said so far, over all its starts."""
        return (self.folder / "station.log").read_text("utf-8")

    def start(self) -> None:
        """Start it, also again, and wait until it is ready."""
        api = self.url.partition("://")[2] or "127.0.0.1:0"
        flags = ["serve", "--api", api, "--link", self.link, "--database", f"sqlite:///{self.folder / 'covista.db'}"]
        tls = {} if self.tls is None else {"COVISTA_TLS_CERT": str(self.tls.cert), "COVISTA_TLS_KEY": str(self.tls.key)}
        with (self.folder / "station.log").open("ab") as log:
            self._process = subprocess.Popen(
                [*COMMAND, *flags],
                cwd=self.folder,
                env=environment(**tls, **self.settings),
                stdout=subprocess.PIPE,
                stderr=log,
            )
        assert self._process.stdout is not None
        line = self._process.stdout.readline().decode()
        found = re.search(r"https?://[\d.:]+\d", line)
        assert found, line + self.log
        self.url = found[0]
        with self.client() as client:
            wait_until(lambda: client.get("/readyz").json()["status"] == "ready", "it is ready", READY_S)

    def kill(self) -> None:
        """End it as a power cut would."""
        self.signal(signal.SIGKILL)
        self._wait()

    def stop(self) -> None:
        """End it in order."""
        self.signal(signal.SIGTERM)
        self._wait()

    def signal(self, number: signal.Signals) -> None:
        """Send its process a signal."""
        assert self._process is not None
        self._process.send_signal(number)

    def client(self, **options: Any) -> httpx.Client:
        """For questions over HTTP without a browser."""
        return httpx.Client(base_url=self.url, verify=self.tls is None, timeout=10, **options)

    def control(self, token: str | None = None) -> MissionControl:
        """REST, as missions use it."""
        return MissionControl(self.url, token=token)

    def token(self, name: str, *scopes: Scope) -> str:
        """Make a token while it runs, and wait until it is known."""
        tokens = Tokens(f"sqlite:///{self.folder / 'covista.db'}")
        try:
            secret = tokens.add(name, frozenset(scopes))
        finally:
            tokens.close()
        wait_until(lambda: self._status(authorization=f"Bearer {secret}") == 200, "the token is known")
        wait_until(lambda: self._status() == 401, "it is locked")
        return secret

    def revoke(self, name: str) -> None:
        """Revoke a token."""
        tokens = Tokens(f"sqlite:///{self.folder / 'covista.db'}")
        try:
            tokens.revoke(name)
        finally:
            tokens.close()

    def settle(self) -> None:
        """Wait until the rovers stand in two groups, as they do by themselves."""
        with self.control() as control:
            wait_until(lambda: _grouped(control) == {frozenset(TOGETHER), frozenset(OTHERS)}, "two groups", 60)

    def _status(self, **headers: str) -> int:
        """How it answers; 0 where the door is locked while it does, which cuts the answer short."""
        with self.client(headers=headers) as client, suppress(httpx.RemoteProtocolError):
            return client.get("/api/v1/groups").status_code
        return 0

    def _wait(self) -> None:
        assert self._process is not None
        self._process.wait(20)
        assert self._process.stdout is not None
        self._process.stdout.close()


def _grouped(control: MissionControl) -> set[frozenset[str]]:
    return {frozenset(group.robots) for group in control.groups().groups}


@contextmanager
def browsed_station(
    folder: Path, *, tls: Pair | None = None, rovers: bool = True, **settings: str
) -> Iterator[BrowsedStation]:
    """A station that is ready, with six rovers in two groups unless told otherwise; both are gone at the end."""
    station = BrowsedStation(folder, tls, settings)
    try:
        station.start()
        with Rovers(station.link) as station.rovers:
            if rovers:
                station.rovers.come(*ROBOTS)
                station.settle()
            yield station
    finally:
        # One that hangs, or never came to be ready, goes too.
        station.kill()

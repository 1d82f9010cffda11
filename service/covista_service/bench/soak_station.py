"""The station of the soak: `covista-station serve` as anybody runs it, and what can be seen of it from outside."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import httpx
from covista_schemas.reports import RobotReport
from prometheus_client.parser import text_string_to_metric_families

from covista_service.bench.rig import LoadError, free_endpoint

_READY_S, _END_S, _ASK_S, _POLL_S = 300.0, 10.0, 5.0, 0.1
_MB = 1e6
_LATENCY = "covista_keyframe_to_groups_seconds_bucket"
RETENTION_MB = 8
# Short, so that robots are forgotten and met again. Long enough for who is only paused.
_SETTINGS = {"COVISTA_RETENTION_MB": str(RETENTION_MB), "COVISTA_FORGET_AFTER_S": "60"}
_PAGE_BYTES = os.sysconf("SC_PAGE_SIZE")

# Samples by name and labels, as "name{a=b,c=d}" or "name".
Samples = Mapping[str, float]


@dataclass(frozen=True, slots=True, eq=False)
class Look:
    """The station at a moment, with robots that it knows and sessions of zenoh.

    `buckets` are keyframes by latency so far: (s, so many took no longer).
    """

    at_s: float
    resident_mb: float
    files: int
    threads: int
    database_mb: float
    wal_mb: float
    robots: int
    sessions: int
    buckets: tuple[tuple[float, float], ...]


class SoakStation:
    """A station with its database in `folder`, from start to end. Raises LoadError where it does not do its part."""

    def __init__(self, folder: Path, log: Path) -> None:
        self.link = free_endpoint()
        self.database, self.log = folder / "covista.db", log
        url = free_endpoint().removeprefix("tcp/")
        words = ["serve", "--api", url, "--link", self.link, "--database", f"sqlite:///{self.database}"]
        kept = {name: value for name, value in os.environ.items() if not name.startswith("COVISTA_")}
        with self.log.open("wb") as lines:
            self._process = subprocess.Popen(  # noqa: S603 - our own interpreter and module
                [sys.executable, "-m", "covista_service", *words],
                env=kept | _SETTINGS,
                stdin=subprocess.DEVNULL,
                stdout=lines,
                stderr=subprocess.STDOUT,
                start_new_session=True,
            )
        self._client = httpx.Client(base_url=f"http://{url}", timeout=_ASK_S)

    def await_ready(self) -> None:
        """Wait until it says that it is."""
        deadline_s = time.monotonic() + _READY_S
        while not self._ready():
            if time.monotonic() > deadline_s or self._process.poll() is not None:
                raise LoadError(f"the station is not ready within {_READY_S:g} s: {self.log.read_text()[-500:]}")
            time.sleep(_POLL_S)

    def samples(self) -> Samples:
        """What it tells Prometheus."""
        try:
            text = self._client.get("/metrics").raise_for_status().text
        except httpx.HTTPError as error:
            raise LoadError(f"the station does not tell its metrics: {error}") from error
        return {
            _named(sample.name, sample.labels): sample.value
            for family in text_string_to_metric_families(text)
            for sample in family.samples
        }

    def look(self) -> Look:
        """What it is like now."""
        samples, process = self.samples(), Path(f"/proc/{self._process.pid}")
        resident = int((process / "statm").read_text().split()[1]) * _PAGE_BYTES
        wal = self.database.with_name(f"{self.database.name}-wal")
        return Look(
            at_s=time.monotonic(),
            resident_mb=resident / _MB,
            files=len(list((process / "fd").iterdir())),
            threads=len(list((process / "task").iterdir())),
            database_mb=_size_mb(self.database),
            wal_mb=_size_mb(wal),
            robots=round(sum(value for name, value in samples.items() if name.startswith("covista_robots{"))),
            sessions=round(samples["covista_link_sessions"]),
            buckets=tuple(sorted(_buckets(samples))),
        )

    def heard(self, robot: str) -> int | None:
        """How many messages it says that the robot has sent, garbage included; None where it knows none."""
        try:
            answer = self._client.get(f"/api/v1/robots/{robot}")
            if answer.status_code == httpx.codes.NOT_FOUND:
                return None
            report = RobotReport.model_validate_json(answer.raise_for_status().content)
        except (httpx.HTTPError, ValueError) as error:
            raise LoadError(f"the station does not tell of {robot}: {error}") from error
        return sum(each.received + each.missing - each.duplicate for each in (report.keyframes, report.poses))

    def end(self) -> int | None:
        """Tell it to stop; its exit status, None if it had to be killed."""
        self._client.close()
        if self._process.poll() is None:
            self._process.send_signal(signal.SIGTERM)
        try:
            return self._process.wait(_END_S)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()
            return None

    def _ready(self) -> bool:
        try:
            return self._client.get("/readyz").is_success
        except httpx.HTTPError:
            return False


def quantile_s(before: Look, after: Look, share: float) -> float | None:
    """What a share of the keyframes between two looks did not exceed, s; None where there were none.

    Within a bucket keyframes count as evenly spread.
    """
    counts = [(edge, now - was) for (edge, now), (_, was) in zip(after.buckets, before.buckets, strict=True)]
    if not counts or not counts[-1][1]:
        return None
    wanted, low, below = share * counts[-1][1], 0.0, 0.0
    for edge, count in counts:
        if count >= wanted:
            return low if edge == float("inf") else low + (edge - low) * (wanted - below) / max(count - below, 1e-9)
        low, below = edge, count
    return low


def _buckets(samples: Samples) -> list[tuple[float, float]]:
    edge = f"{_LATENCY}{{le="
    return [(float(name[len(edge) : -1]), value) for name, value in samples.items() if name.startswith(edge)]


def _named(name: str, labels: Mapping[str, str]) -> str:
    words = ",".join(f"{key}={value}" for key, value in sorted(labels.items()))
    return f"{name}{{{words}}}" if words else name


def _size_mb(file: Path) -> float:
    return file.stat().st_size / _MB if file.exists() else 0.0

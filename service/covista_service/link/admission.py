"""Who is let in on zenoh: the robots of a list, with certificates of one authority; read from files that may change."""

from __future__ import annotations

import hashlib
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from covista_schemas import keys
from covista_schemas.errors import KeyExpressionError, LinkError
from covista_schemas.zenoh_tls import Tls

from covista_service.access.stamps import Stamp, stamps_of
from covista_service.link.rules import access_control

# How many a list may have; `session.MAX_SESSIONS` has room for them.
MAX_ROBOTS = 10_000
# What is longer is no list of robots.
_MAX_BYTES = 1_000_000


@dataclass(frozen=True, slots=True)
class Admission:
    """Whom zenoh lets in: `robots` speak for themselves, `stations` may do all."""

    robots: frozenset[str]
    stations: frozenset[str]
    # Of what is in the certificates and the key: others need a new session too.
    digest: str

    def rules(self, site: str) -> dict[str, Any]:
        """As zenoh's configuration."""
        return access_control(site, self.robots, self.stations)

    def admits(self, name: str | None) -> bool:
        """Whether who has a certificate of this name may do anything at all."""
        return name in self.robots or name in self.stations


@dataclass(frozen=True, slots=True)
class Lock:
    """The files that say who is let in: certificates, and a list with a robot a line.

    Without a list no robot is. `peers` are the common names of other stations and routers, which may do all.
    """

    tls: Tls
    robots: Path | None = None
    peers: tuple[str, ...] = ()

    def read(self) -> Admission:
        """What the files say now. Raises LinkError, whose text is one line that says what to change."""
        digest = _digest_of(self._certificates)
        stations = frozenset((self.tls.common_name(listens=self.robots is not None), *self.peers))
        robots = read_robots(self.robots, stations) if self.robots is not None else frozenset[str]()
        return Admission(robots, stations, digest)

    def stamp(self) -> Stamp:
        """Another one when a file was changed."""
        return stamps_of(self._certificates if self.robots is None else [*self._certificates, self.robots])

    @property
    def _certificates(self) -> list[Path]:
        return [Path(self.tls.ca), Path(self.tls.cert), Path(self.tls.key)]


def _digest_of(paths: Iterable[Path]) -> str:
    found = hashlib.sha256()
    for path in paths:
        try:
            found.update(hashlib.sha256(path.read_bytes()).digest())
        except OSError:
            # Whoever makes use of the file says what is wrong with it.
            found.update(b"absent")
    return found.hexdigest()


def read_robots(path: Path, taken: Iterable[str] = ()) -> frozenset[str]:
    """The ids in a file, one a line; what follows # is a comment. Raises LinkError with the line that is none.

    `taken` are names that no robot may have.
    """
    try:
        with path.open("rb") as file:
            text = file.read(_MAX_BYTES + 1)
        lines = text.decode().splitlines()
    except OSError as error:
        raise LinkError(f"the list of robots {path} cannot be read: {error.strerror}") from error
    except UnicodeDecodeError as error:
        raise LinkError(f"the list of robots {path} is not a text file in UTF-8") from error
    found = set()
    for number, line in enumerate(lines, 1):
        robot = line.partition("#")[0].strip()
        if not robot:
            continue
        try:
            keys.check_id(robot, "robot")
        except KeyExpressionError as error:
            raise LinkError(f"the list of robots {path}, line {number}: {error}") from error
        if robot in taken:
            raise LinkError(f"the list of robots {path}, line {number}: {robot} is the name of a station or router")
        found.add(robot)
    if len(found) > MAX_ROBOTS or len(text) > _MAX_BYTES:
        raise LinkError(f"the list of robots {path} is longer than {MAX_ROBOTS} robots or {_MAX_BYTES} bytes")
    return frozenset(found)

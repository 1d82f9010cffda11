"""Who stands at the door and is not let in, as far as zenoh tells: links of certificates that may do nothing."""

from __future__ import annotations

import logging
import time
from collections import Counter
from collections.abc import Callable, Collection, Iterable
from typing import Protocol

from covista_service.link.admission import Admission
from covista_service.telemetry import about

UNLISTED, MUTE = "unlisted", "mute"
# A robot comes alive as soon as it is connected.
_MUTE_AFTER_S = 10.0

log = logging.getLogger(__name__)


class Link(Protocol):
    """A connection, as zenoh has it."""

    @property
    def dst(self) -> str:
        """The other end."""

    @property
    def auth_identifier(self) -> str | None:
        """The common name of its certificate."""


class Strangers:
    """Counts each link once, `refused` by reason: robots that are not listed, and those that say nothing of their own.

    The latter may call itself by another name than its certificate's: what it says is dropped by zenoh without a word.
    """

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        self.refused: Counter[str] = Counter({UNLISTED: 0, MUTE: 0})
        self._clock = clock
        self._since_s: dict[tuple[str, str], float] = {}
        self._told: set[tuple[str, str]] = set()

    def look(self, links: Iterable[Link], admission: Admission, alive: Collection[str] | None) -> None:
        """See who is connected now; `alive` are the robots with a token, None where nobody knows."""
        now_s = self._clock()
        there = {(link.auth_identifier or "", link.dst) for link in links}
        self._since_s = {each: self._since_s.get(each, now_s) for each in there}
        self._told &= there
        for name, address in there - self._told:
            if not admission.admits(name):
                self._tell(UNLISTED, "a robot is not in the list and can do nothing", name, address)
            elif alive is None or name in admission.stations or name in alive:
                continue
            elif now_s - self._since_s[name, address] >= _MUTE_AFTER_S:
                self._tell(MUTE, "a robot is connected and not alive under the name of its certificate", name, address)

    def _tell(self, reason: str, words: str, name: str, address: str) -> None:
        self.refused[reason] += 1
        self._told.add((name, address))
        log.warning(words, extra=about(robot=name, address=address))

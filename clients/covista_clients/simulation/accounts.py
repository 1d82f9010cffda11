"""What simulated rovers say that they have sent, to be held against what a station says that it has received."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Protocol


@dataclass(frozen=True, slots=True)
class Account:
    """Of one boot of one robot: keyframes and poses that were put, each number once.

    Besides: keyframes that gave way to newer ones before they were put, and what was put a second time after the link
    broke. What a station has received and misses of a boot, without duplicates, is what was put.
    """

    robot: str
    boot: str
    keyframes: int
    poses: int
    replaced: int = 0
    keyframes_resent: int = 0
    poses_resent: int = 0


Tell = Callable[[Account], object]


class Counting(Protocol):
    """A rover, as far as it counts."""

    @property
    def robot(self) -> str:
        """Its id."""

    @property
    def boot(self) -> str:
        """Its boot."""

    @property
    def keyframes_sent(self) -> int:
        """Keyframes put, each number once."""

    @property
    def poses_sent(self) -> int:
        """Poses put, each number once."""

    @property
    def replaced(self) -> int:
        """Keyframes that gave way before they were put."""

    @property
    def keyframes_resent(self) -> int:
        """Keyframes put a second time."""

    @property
    def poses_resent(self) -> int:
        """Poses put a second time."""


def account(rover: Counting) -> Account:
    """What a rover has sent so far."""
    return Account(
        rover.robot,
        rover.boot,
        rover.keyframes_sent,
        rover.poses_sent,
        rover.replaced,
        rover.keyframes_resent,
        rover.poses_resent,
    )


class Accountant:
    """Tells the accounts of a swarm every `every_s` seconds, when it is asked often enough, and whenever told to."""

    def __init__(self, every_s: float, tell: Tell, clock: Callable[[], float] = time.monotonic) -> None:
        self._every_s = every_s
        self._tell = tell
        self._clock = clock
        self._due_s = clock() + every_s

    def look(self, rovers: Sequence[Counting]) -> None:
        """Tell if it is time."""
        if self._clock() >= self._due_s:
            self._due_s = self._clock() + self._every_s
            self.tell(account(rover) for rover in rovers)

    def tell(self, accounts: Iterable[Account]) -> None:
        """Tell these."""
        for each in accounts:
            self._tell(each)

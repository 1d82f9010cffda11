"""What rovers have sent, against what the station has heard: to the message where nobody was killed."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

from covista_service.bench.soak_rover import POSE_RATE_HZ, RATE_HZ, TELL_S, Told

# What a boot sent so shortly before it was killed may be lost unheard, and that it was sent is not known for so long.
LAST_S = 1.0
# A station that forgets after a minute has surely not done so, and surely has, after a silence of so long.
KNOWN_S, FORGOTTEN_S = 45.0, 75.0

# What a station has heard of a robot, garbage included, since it first heard of it; None where it knows none.
Heard = Callable[[int], int | None]


@dataclass(slots=True)
class Sent:
    """What all boots that are over have sent, at least and at most, and garbage."""

    least: int = 0
    most: int = 0
    garbage: int = 0


@dataclass(slots=True)
class Account:
    """What a robot has sent since the station has known it. `exact` until a boot of it is killed."""

    sent: int = 0
    exact: bool = True
    silent_since_s: float | None = None


@dataclass(slots=True)
class Books:
    """Accounts of all robots. `compared` were found to be so many messages `off`."""

    heard: Heard
    sent: Sent = field(default_factory=Sent)
    compared: int = 0
    off: int = 0
    _accounts: dict[int, Account] = field(default_factory=dict)

    @property
    def accounts(self) -> Mapping[int, Account]:
        """By robot."""
        return self._accounts

    def join(self, robot: int, now_s: float) -> None:
        """A boot begins. A robot that may have been forgotten or not has no exact account until it surely is."""
        account = self._accounts.setdefault(robot, Account())
        silent_s = 0.0 if account.silent_since_s is None else now_s - account.silent_since_s
        if silent_s > FORGOTTEN_S:
            self._accounts[robot] = Account()
        elif silent_s > KNOWN_S:
            account.exact = False

    def garbage(self, robot: int, messages: int) -> None:
        """Somebody has sent garbage in the name of a robot that is there."""
        self.sent.garbage += messages
        self._accounts[robot].sent += messages

    def over(self, robot: int, told: Sequence[tuple[float, Told]], now_s: float) -> None:
        """A boot has ended."""
        least, most = bounds(told, now_s)
        self.sent.least += least
        self.sent.most += most
        account = self._accounts[robot]
        account.sent += least
        account.exact &= bool(told) and told[-1][1].over
        account.silent_since_s = now_s

    def agrees(self, robot: int) -> bool:
        """Has the station heard all that the robot sent, and no more? Of who has no exact account nothing is asked."""
        account = self._accounts[robot]
        return not account.exact or self.heard(robot) == account.sent

    def compare(self, robot: int) -> None:
        """Write down by how much the two are apart."""
        account = self._accounts[robot]
        if account.exact:
            self.compared += 1
            self.off += abs((self.heard(robot) or 0) - account.sent)


def bounds(told: Sequence[tuple[float, Told]], ended_s: float) -> tuple[int, int]:
    """Least and most messages that a station has to know of, of a boot that said so much and ended at `ended_s`."""
    last = told[-1][1] if told else Told(0, 0)
    if last.over:
        return last.messages, last.messages
    least = max((said.messages for at_s, said in told if at_s < ended_s - LAST_S), default=0)
    unsaid = (RATE_HZ + POSE_RATE_HZ) * (LAST_S + 2 * TELL_S) + 2
    return least, last.messages + round(unsaid)

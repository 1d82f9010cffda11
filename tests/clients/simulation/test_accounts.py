from __future__ import annotations

from dataclasses import dataclass

from covista_clients.simulation.accounts import Account, Accountant


@dataclass
class Counted:
    robot: str = "r1"
    boot: str = "b"
    keyframes_sent: int = 0
    poses_sent: int = 0
    replaced: int = 0
    keyframes_resent: int = 0
    poses_resent: int = 0


def test_accounts_are_told_when_they_are_due_and_not_before() -> None:
    told: list[Account] = []
    now_s = [0.0]
    accountant = Accountant(2.0, told.append, lambda: now_s[0])
    rover = Counted()
    for now_s[0] in (0.5, 1.9, 2.0, 3.9, 4.5):
        rover.keyframes_sent += 1
        accountant.look([rover])
    assert [each.keyframes for each in told] == [3, 5]


def test_an_account_says_everything_that_a_rover_counts() -> None:
    told: list[Account] = []
    Accountant(0.0, told.append, lambda: 1.0).look([Counted("r7", "boot", 6, 5, 4, 3, 2)])
    assert told == [
        Account("r7", "boot", keyframes=6, poses=5, replaced=4, keyframes_resent=3, poses_resent=2),
    ]

"""Verdicts over stations that are made up, among rovers that come and go as the script of the soak has it."""

import random

import numpy as np
import pytest
from covista_service.bench.soak_judge import LIMITS, judged, seen_in
from covista_service.bench.soak_script import roster, turns
from covista_service.bench.soak_station import Look

SECONDS, ROBOTS, TRIES = 1800, 12, 60
EDGES_S = np.array([0.01, 0.02, 0.03, 0.05, 0.075, 0.1, 0.15, 0.2, 0.3, 0.5, 1.0, np.inf])


def swarm(seed: int) -> tuple[np.ndarray, np.ndarray]:
    """How many rovers are there each second, and how many boots there have been."""
    chance = random.Random(seed)
    there, boots, at_s = set(roster(chance, ROBOTS)), 0, 0.0
    sessions, booted = np.zeros(SECONDS), np.zeros(SECONDS)
    script = turns(chance, ROBOTS)
    turn = next(script)
    for second in range(SECONDS):
        while at_s + turn.gap_s <= second:
            at_s += turn.gap_s
            boots += turn.robot not in there or turn.act == "reboot"
            if turn.robot not in there:
                there.add(turn.robot)
            elif turn.act in ("leave", "kill"):
                there.remove(turn.robot)
            turn = next(script)
        sessions[second], booted[second] = len(there), boots
    return sessions, booted


def station(seed: int, **leaks: float) -> list[Look]:
    """Looks at a station that goes with its swarm and jitters, and leaks by the boot or slows down by the hour."""
    rng = np.random.default_rng(seed)
    sessions, boots = swarm(seed)
    jitter = np.convolve(rng.normal(size=SECONDS + 19), np.ones(20) / 20, "valid")
    slow = 1 + leaks.get("slower_per_h", 0.0) * np.arange(SECONDS) / 3600
    counts = np.zeros(len(EDGES_S))
    looks = []
    for second in range(SECONDS):
        keyframes = rng.gamma(4, 0.0125, rng.poisson(sessions[second] / 2)) * slow[second]
        counts = counts + (keyframes[:, None] <= EDGES_S).sum(axis=0)
        looks.append(
            Look(
                at_s=float(second),
                resident_mb=400 + 0.8 * sessions[second] + jitter[second] + leaks.get("mb", 0) * boots[second],
                files=round(50 + 2 * sessions[second] + rng.normal() + leaks.get("files", 0) * boots[second]),
                threads=round(30 + 0.5 * rng.normal() + leaks.get("threads", 0) * boots[second]),
                database_mb=6.0,
                wal_mb=4.0 + 0.05 * rng.normal(),
                robots=round(sessions[second]),
                sessions=round(sessions[second]),
                buckets=tuple(zip(EDGES_S.tolist(), counts.tolist(), strict=True)),
            )
        )
    return looks


def verdicts(looks: list[Look]) -> dict[str, str]:
    return {each.name: each.verdict for each in judged(seen_in(looks))}


def test_a_station_that_does_not_leak_is_flat() -> None:
    told = [verdicts(station(seed)) for seed in range(TRIES)]
    flat = {name: sum(each[name] == "flat" for each in told) / TRIES for name in LIMITS}
    assert min(flat.values()) >= 0.95, flat


@pytest.mark.parametrize(
    ("leak", "by", "name"),
    [
        ("files", 1.0, "files"),
        ("files", 0.1, "files"),
        ("threads", 1.0, "threads"),
        ("mb", 0.2, "resident"),
        ("slower_per_h", 1.0, "p50"),
        ("slower_per_h", 4.0, "p99"),
    ],
)
def test_a_station_that_leaks_is_not_flat(leak: str, by: float, name: str) -> None:
    told = [verdicts(station(seed, **{leak: by})) for seed in range(TRIES // 6)]
    assert all(each[name] != "flat" for each in told), told
    if by >= 1.0:
        assert all(each[name] == "grows" for each in told), told


def test_of_a_few_looks_nothing_is_said() -> None:
    assert set(verdicts(station(0)[:5]).values()) == {"cannot say"}
    assert all(each.row().spread is None and not each.row().holds for each in judged(seen_in(station(0)[:5])))


def test_files_that_go_with_rovers_are_no_growth_though_rovers_become_fewer() -> None:
    looks = [look for look in station(1) if look.sessions]
    fewer = sorted(looks, key=lambda look: -look.sessions)
    told = {each.name: each for each in judged(seen_in([_at(look, k) for k, look in enumerate(fewer)]))}
    assert abs(told["files"].trend.grown) < 3
    assert told["files"].verdict != "grows"


def _at(look: Look, second: int) -> Look:
    return Look(float(second), *(getattr(look, name) for name in Look.__slots__[1:]))

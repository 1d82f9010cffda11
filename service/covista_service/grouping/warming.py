"""Warm machine code: every compiled function of grouping runs once, so that no robot waits for a compiler."""

from __future__ import annotations

from functools import cache
from typing import get_args

import numpy as np

from covista_service.grouping import similarity
from covista_service.grouping.affinity import Affinity
from covista_service.grouping.hysteresis import held
from covista_service.grouping.selection import Criterion, SelectionOptions, choose


@cache
def warm_up() -> None:
    """Compile what no earlier process has left in numba's cache, and load the rest; once per process.

    Robots, some of whose overlaps are unknown, are grouped by every criterion. An affinity reads parts of its matrices,
    or whole ones when its room is full, as it is with one robot: those are other functions to the compiler.
    """
    two = np.eye(2)
    similarity.matrix(1 - two, two, 0.5, "shared")
    affinity = Affinity()
    for number in range(6):
        affinity.add(f"r{number}", (number % 3, 20.0 * (number // 3), 0.0))
    for one, other in ((0, 1), (1, 2), (3, 4), (4, 5)):
        affinity.see(f"r{one}", f"r{other}", 0.9, 0.8)
    affinity.remove("r5")
    affinity.sigma_m("std")
    S = affinity.similarity(0.5)
    for criterion in get_args(Criterion):
        choose(S, SelectionOptions(criterion=criterion), np.zeros(len(S), np.intp))
    choice = choose(S, SelectionOptions(2, min_group_size=2))
    held(S, choice.labels, 0.05)

import pytest

from tests.service.warmed import compiled

_IMPORTS = """
from typing import get_args
import numpy as np
from covista_service.grouping.affinity import Affinity
from covista_service.grouping.bounds import Bounds
from covista_service.grouping.components import components
from covista_service.grouping.hysteresis import held
from covista_service.grouping.selection import Criterion, SelectionOptions, choose, contributions
"""
_AFTERWARDS = """
rng = np.random.default_rng(0)
# Rooms of all fillings: a matrix that is read whole is another type to the compiler than a part of one.
small = Affinity()
for number in range(18):
    small.add(f"r{number:02}", rng.uniform(0, 9, 3))
    for sigma in ("shared", "std"):
        small.similarity(0.5, sigma)
affinity = Affinity(0.3)
for number in range(40):
    affinity.add(f"r{number}", rng.uniform(0, 9, 3))
for number in range(39):
    affinity.see(f"r{number}", f"r{number + 1}", *rng.uniform(0, 1, 2))
affinity.remove("r7")
for sigma in ("shared", "std", 2.0):
    S = affinity.similarity(0.5, sigma)
for criterion in get_args(Criterion):
    for groups, size in (("auto", 1), ("auto", 2), ((6, 9), 4), (3, 1)):
        options = SelectionOptions(groups, criterion, size)
        choice = choose(S, options)
        contributions(S, options)(choice.labels)
        choose(S, options, choice.labels)
components(S, 0.5, Bounds("auto", 2))
held(S, choice.labels, 0.05)
"""


@pytest.mark.timeout(300)
def test_after_warming_up_nothing_is_compiled() -> None:
    warm, afterwards = compiled("grouping", _IMPORTS, _AFTERWARDS)
    assert 0 < warm == afterwards

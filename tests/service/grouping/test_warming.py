import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[3]

_AFTERWARDS = """
import sys
from typing import get_args
import numpy as np
from covista_service.grouping.affinity import Affinity
from covista_service.grouping.bounds import Bounds
from covista_service.grouping.components import components
from covista_service.grouping.selection import Criterion, SelectionOptions, choose, contributions
from covista_service.grouping.warming import warm_up
from numba.core.registry import CPUDispatcher

def compiled():
    ours = [module for name, module in sys.modules.items() if name.startswith("covista_service.grouping.")]
    found = {id(each): each for module in ours for each in vars(module).values() if isinstance(each, CPUDispatcher)}
    return sum(len(each.signatures) for each in found.values())

warm_up()
warm = compiled()

rng = np.random.default_rng(0)
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
print(warm, compiled())
"""


# On a fresh machine the compiler is most of it.
@pytest.mark.timeout(300)
def test_after_warming_up_nothing_is_compiled() -> None:
    said = subprocess.run(
        [sys.executable, "-c", _AFTERWARDS], cwd=ROOT, capture_output=True, text=True, timeout=290, check=False
    )
    assert said.returncode == 0, said.stderr
    warm, afterwards = map(int, said.stdout.split())
    assert 0 < warm == afterwards

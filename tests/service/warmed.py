"""What is compiled after a room has been warmed up, in a process of its own."""

import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parents[2]
# On a fresh machine the compiler is most of it.
DEADLINE_S = 290

_FRAME = """
import sys
from numba.core.registry import CPUDispatcher
from covista_service.{room}.warming import warm_up

def compiled():
    ours = [module for name, module in sys.modules.items() if name.startswith("covista_service.{room}.")]
    found = {{id(each): each for module in ours for each in vars(module).values() if isinstance(each, CPUDispatcher)}}
    return sum(len(each.signatures) for each in found.values())

{imports}
warm_up()
warm = compiled()
{afterwards}
print(warm, compiled())
"""


def compiled(room: str, imports: str, afterwards: str) -> tuple[int, int]:
    """How many functions of a room are compiled, by argument types, when it is warm, and when all that has run."""
    said = subprocess.run(
        [sys.executable, "-c", _FRAME.format(room=room, imports=imports, afterwards=afterwards)],
        cwd=ROOT,
        capture_output=True,
        text=True,
        timeout=DEADLINE_S,
        check=False,
    )
    assert said.returncode == 0, said.stderr
    warm, after = map(int, said.stdout.split())
    return warm, after

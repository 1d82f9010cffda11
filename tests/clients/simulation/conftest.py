from __future__ import annotations

from collections.abc import Callable
from functools import cache

import pytest
from covista_clients.simulation import worlds
from covista_clients.simulation.world import World


@pytest.fixture(scope="session")
def world() -> Callable[[str], World]:
    """Worlds of seed 0, each built once."""
    return cache(worlds.build)

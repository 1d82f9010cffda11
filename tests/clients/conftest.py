import threading
from collections.abc import Iterator

import pytest

from tests.clients.ground import Ground, free_endpoint


@pytest.fixture
def endpoint() -> str:
    return free_endpoint()


@pytest.fixture
def ground(endpoint: str) -> Iterator[Ground]:
    with Ground(endpoint) as ground:
        yield ground


@pytest.fixture
def no_thread_left() -> Iterator[None]:
    yield
    # Zenoh's threads for callbacks are daemons where a daemon declares them: at the program's end they would abort it.
    assert not [thread for thread in threading.enumerate() if thread.name.startswith("rover-")]
    assert not [thread for thread in threading.enumerate() if thread.daemon and "pyo3" in thread.name]

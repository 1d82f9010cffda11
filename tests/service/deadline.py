"""Waiting for what happens in other threads: no sleep longer than it takes, and an end."""

import socket
import threading
import time
from collections.abc import Callable
from typing import TypeVar

_T = TypeVar("_T")
DEADLINE_S = 10.0
_pause = threading.Event()


def wait_until(look: Callable[[], _T], what: str = "", deadline_s: float = DEADLINE_S) -> _T:
    """Look again and again until there is something true to see, and return it."""
    end_s = time.monotonic() + deadline_s
    while True:
        seen = look()
        if seen:
            return seen
        assert time.monotonic() < end_s, f"{what or look} did not come true, but {seen!r}"
        _pause.wait(0.01)


def free_endpoint() -> str:
    """A zenoh end point on loopback that nobody listens on."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return f"tcp/127.0.0.1:{probe.getsockname()[1]}"

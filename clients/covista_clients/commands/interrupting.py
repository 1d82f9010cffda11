"""Ctrl-C and SIGTERM end a command that runs until it is told to stop, and that is no error."""

from __future__ import annotations

import signal
from collections.abc import Iterator
from contextlib import contextmanager, suppress


@contextmanager
def ends_by_interrupt() -> Iterator[None]:
    """Leave the block at Ctrl-C or SIGTERM; blocks inside are left in order, as by an exception."""
    before = signal.signal(signal.SIGTERM, signal.default_int_handler)
    try:
        with suppress(KeyboardInterrupt):
            yield
    finally:
        signal.signal(signal.SIGTERM, before)

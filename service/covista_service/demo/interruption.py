"""Ctrl-C and SIGTERM as something that can be waited for."""

from __future__ import annotations

import os
import signal
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from multiprocessing import connection
from types import FrameType

SIGNALS = (signal.SIGINT, signal.SIGTERM)


class Interruption:
    """Counts signals; `wait` returns early when one comes."""

    def __init__(self, read_end: int) -> None:
        self._read_end = read_end
        self.count = 0

    def wait(self, others: Sequence[connection.Connection], timeout_s: float) -> list[connection.Connection]:
        """Those of `others` that have something to read, after `timeout_s` at the latest, or at once on a signal."""
        ready = connection.wait([*others, self._read_end], max(0.0, timeout_s))
        if self._read_end in ready:
            self.count += len(os.read(self._read_end, 64))
        return [other for other in others if other in ready]


@contextmanager
def listening() -> Iterator[Interruption]:
    """Take the signals over for a while; must be called in the main thread."""
    read_end, write_end = os.pipe()
    os.set_blocking(write_end, False)

    def note(_number: int, _frame: FrameType | None) -> None:
        os.write(write_end, b"!")

    before = {number: signal.signal(number, note) for number in SIGNALS}
    try:
        yield Interruption(read_end)
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
        os.close(read_end)
        os.close(write_end)

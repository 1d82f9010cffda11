"""Work that nobody waits for at the end: compiling code may take half a minute, and cannot be told to stop."""

from __future__ import annotations

import threading
from collections.abc import Callable
from concurrent.futures import Future
from typing import TypeVar

_T = TypeVar("_T")


def start(work: Callable[[], _T], name: str) -> Future[_T]:
    """Begin to work in a thread that ends with the process, wherever it is then."""
    result: Future[_T] = Future()
    # Whoever does not wait any more cannot cancel it.
    result.set_running_or_notify_cancel()

    def run() -> None:
        try:
            done = work()
        except BaseException as error:  # noqa: BLE001 - whoever waits has it
            result.set_exception(error)
        else:
            result.set_result(done)

    threading.Thread(target=run, name=name, daemon=True).start()
    return result

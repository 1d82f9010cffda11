"""Backpressure of a rover: one place for a keyframe that waits to be sent, in which the newest wins."""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import Generic, TypeVar

_Item = TypeVar("_Item")


class Outbox(Generic[_Item]):
    """One item between a caller that never waits and a thread that sends, numbered in the order of sending.

    An item that replaces a waiting one takes over its number, so that numbers have no gaps: what was never sent never
    had a number of its own.
    """

    def __init__(self) -> None:
        self.replaced = 0
        self._changed = threading.Condition()
        self._item: _Item | None = None
        self._sequence = -1
        self._sending = False
        self._woken = False
        self._closed = False

    def offer(self, item: _Item) -> int:
        """Leave `item` to be sent in place of what still waits; returns the number that it will have."""
        with self._changed:
            if self._item is None:
                self._sequence += 1
            else:
                self.replaced += 1
            self._item = item
            self._changed.notify_all()
            return self._sequence

    def take(self, wanted: Callable[[], bool], within_s: float | None = None) -> tuple[int, _Item] | None:
        """Wait for an item (at most `within_s`), and take it if it is `wanted`; None too when woken, or closed."""
        with self._changed:
            self._sending = False
            self._changed.notify_all()
            self._changed.wait_for(lambda: self._woken or self._closed or self._item is not None, within_s)
            self._woken = False
            if self._item is None or self._closed or not wanted():
                return None
            item, self._item, self._sending = self._item, None, True
            return self._sequence, item

    def wake(self) -> None:
        """Let `take` look again, or return."""
        with self._changed:
            self._woken = True
            self._changed.notify_all()

    def drain(self, timeout_s: float) -> bool:
        """Wait until nothing waits and nothing is being sent; False after `timeout_s`."""
        with self._changed:
            return self._changed.wait_for(lambda: self._item is None and not self._sending, timeout_s)

    @property
    def waits(self) -> bool:
        """Whether an item waits."""
        return self._item is not None

    @property
    def closed(self) -> bool:
        """Whether nothing will be taken any more."""
        return self._closed

    def close(self) -> None:
        """End `take` for good; what still waits is dropped."""
        with self._changed:
            self._closed = True
            self._changed.notify_all()

"""Threads for what takes long, so many at a time and so many waiting: whoever is one too many hears so at once."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from typing import TypeVar

from covista_schemas.errors import CovistaError

_T = TypeVar("_T")


class FullError(CovistaError):
    """As many wait as may."""


class Room:
    """Work in threads, `at_once` at a time, with `waiting` more before the door."""

    def __init__(self, at_once: int, waiting: int) -> None:
        self._door = asyncio.Semaphore(at_once)
        self._most = at_once + waiting
        self._inside = 0

    async def run(self, work: Callable[[], _T], *, patient: bool = False) -> _T:
        """Do it in a thread, when it is its turn. Raises FullError, but not to who is `patient`."""
        if self._inside >= self._most and not patient:
            raise FullError("too many ask for what takes long")
        self._inside += 1
        try:
            async with self._door:
                return await asyncio.to_thread(work)
        finally:
            self._inside -= 1

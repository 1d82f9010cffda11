"""Jobs that do anything at a worker: said in words, for no test module is known there."""

from __future__ import annotations

import operator
from pathlib import Path
from typing import Any

from covista_service.workers.jobs import Job


class _Order:
    """Evaluated where it is unpickled."""

    def __init__(self, words: str) -> None:
        self._words = words

    def __reduce__(self) -> tuple[Any, ...]:
        return eval, (f"({self._words},)",)


def order(words: str) -> Job[tuple[Any, ...]]:
    """Evaluate an expression; the result is a tuple of one."""
    return Job(operator.add, (_Order(words),))


def die() -> Job[tuple[Any, ...]]:
    """End the process without a word."""
    return order(_DIE)


def die_once(mark: Path) -> Job[tuple[Any, ...]]:
    """End the first process that tries."""
    return order(
        f"'survived' if __import__('os').path.exists({str(mark)!r}) else (open({str(mark)!r}, 'w').close(), {_DIE})"
    )


def stay_once(mark: Path) -> Job[tuple[Any, ...]]:
    """Never return from the first process that tries."""
    stay = "__import__('threading').Event().wait()"
    return order(
        f"'returned' if __import__('os').path.exists({str(mark)!r}) else (open({str(mark)!r}, 'w').close(), {stay})"
    )


def pid() -> Job[tuple[Any, ...]]:
    """Which process it is."""
    return order("__import__('os').getpid()")


_DIE = "__import__('os').kill(__import__('os').getpid(), 9)"

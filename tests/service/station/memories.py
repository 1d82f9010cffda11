"""Memories as plain numbers and words, to be compared."""

from dataclasses import fields, is_dataclass, replace

import numpy as np
from covista_service.station.memory import Memory


def plain(memory: Memory, **other: int) -> object:
    """All that a memory holds, in an order that does not matter, with some numbers replaced."""
    told = replace(memory, **other)
    return _plain(
        replace(
            told,
            robots=tuple(sorted(told.robots, key=lambda robot: robot.id)),
            pairs=tuple(sorted(told.pairs, key=lambda pair: pair.pair)),
        )
    )


def _plain(value: object) -> object:
    if isinstance(value, np.ndarray):
        return value.tolist()
    if is_dataclass(value):
        return {field.name: _plain(getattr(value, field.name)) for field in fields(value)}
    if isinstance(value, tuple):
        return tuple(map(_plain, value))
    if isinstance(value, dict):
        return {key: _plain(each) for key, each in value.items()}
    return value

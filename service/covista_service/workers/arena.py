"""Memory that worker processes share with the station.

It has no name in any folder: a file in memory that only descriptors hold, so that nothing of it is left when the
station ends, however it ends.
"""

from __future__ import annotations

import mmap
import os
from bisect import insort
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from covista_service.perception.camera import Features

# What is not written takes no memory: this bounds what is shared, 10 000 keyframes of 700 features.
ARENA_BYTES = 1 << 30


@dataclass(frozen=True, slots=True)
class Slip:
    """Where features lie: `size` bytes from `start`, keypoints (`points`, 2) and then descriptors of this shape."""

    kind: str
    start: int
    size: int
    points: int
    names: tuple[int, ...]


class Arena:
    """The station's side: features in, slips out."""

    def __init__(self, size: int = ARENA_BYTES) -> None:
        """Raises OSError or AttributeError where the system has no such files."""
        self._file = os.memfd_create("covista-features")
        os.ftruncate(self._file, size)
        self._memory = mmap.mmap(self._file, size)
        self._free = [(0, size)]

    @property
    def path(self) -> str:
        """Where processes of the same user open it."""
        return f"/proc/{os.getpid()}/fd/{self._file}"

    def put(self, features: Features) -> Slip | None:
        """Lay features down; None if there is no room."""
        points = np.ascontiguousarray(features.keypoints_px, np.float32)
        names = np.ascontiguousarray(features.descriptors, np.uint8)
        size = points.nbytes + names.nbytes
        start = self._take(_whole_pages(size))
        if start is None:
            return None
        self._memory[start : start + points.nbytes] = points.tobytes()
        self._memory[start + points.nbytes : start + size] = names.tobytes()
        return Slip(features.kind, start, size, len(points), names.shape)

    def free(self, slip: Slip) -> None:
        """Give back the room, and the memory behind it."""
        start, end = slip.start, slip.start + _whole_pages(slip.size)
        self._memory.madvise(mmap.MADV_REMOVE, start, end - start)
        for before, size in [(at, size) for at, size in self._free if at == end or at + size == start]:
            self._free.remove((before, size))
            start, end = min(start, before), max(end, before + size)
        insort(self._free, (start, end - start))

    def close(self) -> None:
        """Let go of it."""
        self._memory.close()
        os.close(self._file)

    def _take(self, size: int) -> int | None:
        """The first gap that is large enough."""
        for k, (start, room) in enumerate(self._free):
            if room >= size:
                self._free[k : k + 1] = [(start + size, room - size)] if room > size else []
                return start
        return None


class Lent:
    """A worker's side: slips in, features out."""

    def __init__(self, path: str) -> None:
        """Raises OSError where it cannot be opened."""
        with open(path, "rb") as file:
            self._memory = mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ)

    def features(self, slip: Slip) -> Features:
        """A copy of what was laid down."""
        edge = slip.start + 8 * slip.points
        points = self._array(slip.start, edge).view(np.float32).reshape(-1, 2)
        return Features(slip.kind, points, self._array(edge, slip.start + slip.size).reshape(slip.names))

    def close(self) -> None:
        """Let go of it."""
        self._memory.close()

    def _array(self, start: int, end: int) -> NDArray[np.uint8]:
        return np.frombuffer(self._memory[start:end], np.uint8).copy()


def _whole_pages(size: int) -> int:
    return max(1, -(-size // mmap.PAGESIZE)) * mmap.PAGESIZE

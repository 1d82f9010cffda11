"""Files that are looked at now and then: another stamp when one was changed or replaced."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

# Of each file: inode, size in bytes, times of the last change in nanoseconds, of what is in it and of who may read it;
# zeros where there is none.
Stamp = tuple[tuple[int, int, int, int], ...]


def stamps_of(paths: Iterable[Path]) -> Stamp:
    """The stamps of files as they are now."""
    return tuple(_stamp_of(path) for path in paths)


def _stamp_of(path: Path) -> tuple[int, int, int, int]:
    try:
        found = path.stat()
    except OSError:
        return (0, 0, 0, 0)
    return (found.st_ino, found.st_size, found.st_mtime_ns, found.st_ctime_ns)

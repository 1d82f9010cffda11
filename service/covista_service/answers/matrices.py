"""The matrices as text, row by row: a million numbers at once would keep the interpreter from everybody else."""

from __future__ import annotations

import time
from collections.abc import Iterator

from pydantic_core import to_json

from covista_service.grouping.similarity import Floats
from covista_service.station.snapshot import Snapshot


def similarity_json(snapshot: Snapshot) -> Iterator[bytes]:
    """The report of the matrices as JSON, in pieces; unknown overlaps are null. For a thread of its own."""
    view = snapshot.similarity
    yield b'{"revision":%d,"robots":%b' % (view.revision, to_json(view.robots))
    for name, matrix in (
        ("similarity", view.similarity),
        ("overlap", view.overlap),
        ("closeness", view.closeness),
        ("distance_m", view.distance_m),
    ):
        yield b',"%b":[' % name.encode()
        yield from _rows(matrix)
        yield b"]"
    yield b"}"


def _rows(matrix: Floats) -> Iterator[bytes]:
    for i, row in enumerate(matrix):
        text = to_json(row.tolist(), inf_nan_mode="null")
        yield b"," + text if i else text
        # Whoever waits for the interpreter has it now, and not after a switch interval.
        time.sleep(0)

"""What is large, as text in pieces: a million numbers at once would keep the interpreter from everybody else.

For a thread of its own, which lets go of the interpreter after each piece.
"""

from __future__ import annotations

import time
from collections.abc import Iterator

from pydantic_core import to_json

from covista_service.answers.pairs import pair_summaries
from covista_service.grouping.similarity import Floats
from covista_service.station.snapshot import Snapshot

_PAIRS_AT_A_TIME = 20


def similarity_json(snapshot: Snapshot) -> Iterator[bytes]:
    """`similarity_report` as JSON; unknown overlaps are null."""
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


def pairs_json(snapshot: Snapshot, min_overlap: float | None = None) -> Iterator[bytes]:
    """`pairs_report` of all robots as JSON."""
    yield b'{"pairs":['
    comma = b""
    for looked, summary in enumerate(pair_summaries(snapshot, None, min_overlap)):
        if summary is not None:
            yield comma + summary.model_dump_json().encode()
            comma = b","
        if looked % _PAIRS_AT_A_TIME == 0:
            time.sleep(0)
    yield b'],"next":null}'


def _rows(matrix: Floats) -> Iterator[bytes]:
    for i, row in enumerate(matrix):
        text = to_json(row.tolist(), inf_nan_mode="null")
        yield b"," + text if i else text
        # Whoever waits for the interpreter has it now, and not after a switch interval.
        time.sleep(0)

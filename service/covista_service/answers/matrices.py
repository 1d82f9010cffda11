"""One matrix of the similarity as a file: NumPy's own format, or a table of text."""

from __future__ import annotations

import io
import time
from collections.abc import Iterator
from typing import Literal

import numpy as np
from pydantic_core import to_json

from covista_service.grouping.similarity import Floats
from covista_service.station.snapshot import SimilarityView, Snapshot

Matrix = Literal["similarity", "overlap", "closeness", "distance_m"]
# In one piece they would be copied in one.
_ROWS_AT_A_TIME = 64


def matrix_npy(snapshot: Snapshot, matrix: Matrix) -> Iterator[bytes | memoryview]:
    """A matrix (N, N) of float64 as NumPy writes it, unknown being NaN; then the ids of its robots, written after it.

    A file of two arrays: who loads one has the matrix, who loads once more from the same file has the ids, as bytes. So
    both are of one moment, and no header has to hold a thousand ids.
    """
    view = snapshot.similarity
    values = np.ascontiguousarray(_matrix(view, matrix), np.float64)
    yield _npy_head(values)
    for first in range(0, len(values), _ROWS_AT_A_TIME):
        yield values[first : first + _ROWS_AT_A_TIME].data.cast("B")
    names = io.BytesIO()
    np.save(names, np.array([robot.encode() for robot in view.robots], np.bytes_), allow_pickle=False)
    yield names.getvalue()


def matrix_csv(snapshot: Snapshot, matrix: Matrix) -> Iterator[bytes]:
    """A matrix as RFC 4180 has it; its first row and its first column are the ids of robots, and unknown is empty."""
    view = snapshot.similarity
    yield b",".join([b"robot", *(robot.encode() for robot in view.robots)]) + b"\r\n"
    for robot, row in zip(view.robots, _matrix(view, matrix), strict=True):
        numbers = to_json(row.tolist(), inf_nan_mode="null")[1:-1].replace(b"null", b"")
        yield robot.encode() + b"," + numbers + b"\r\n"
        # As for JSON: whoever waits for the interpreter has it now.
        time.sleep(0)


def _matrix(view: SimilarityView, matrix: Matrix) -> Floats:
    match matrix:
        case "similarity":
            return view.similarity
        case "overlap":
            return view.overlap
        case "closeness":
            return view.closeness
        case "distance_m":
            return view.distance_m


def _npy_head(values: Floats) -> bytes:
    head = io.BytesIO()
    np.lib.format.write_array_header_1_0(head, np.lib.format.header_data_from_array_1_0(values))
    return head.getvalue()

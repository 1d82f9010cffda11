"""A matrix of all robots as an array."""

from __future__ import annotations

import io
from typing import Literal

import httpx
import numpy as np
from covista_schemas.errors import ApiError
from numpy.typing import NDArray

MatrixName = Literal["similarity", "overlap", "closeness", "distance_m"]


def read_matrix(response: httpx.Response) -> tuple[list[str], NDArray[np.float64]]:
    """The robots and their matrix (N, N), from two arrays in .npy: the matrix, and ids as bytes. Raises ApiError."""
    file = io.BytesIO(response.content)
    try:
        matrix, ids = (np.load(file, allow_pickle=False) for _ in range(2))
    except (ValueError, EOFError, OSError) as error:
        raise _odd(response, str(error)) from error
    told = (matrix.dtype.kind, ids.dtype.kind, matrix.shape)
    if told != ("f", "S", (ids.size, ids.size)) or ids.ndim != 1:
        raise _odd(response, f"{matrix.dtype} {matrix.shape} for ids {ids.dtype} {ids.shape}")
    return [robot.decode("ascii", "replace") for robot in ids.tolist()], np.asarray(matrix, np.float64)


def _odd(response: httpx.Response, detail: str) -> ApiError:
    return ApiError(f"{response.url} does not answer as a station does", detail=detail)

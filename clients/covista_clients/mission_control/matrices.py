"""A matrix of all robots as an array."""

from __future__ import annotations

import io
from collections.abc import Callable
from typing import Literal

import httpx
import numpy as np
from covista_schemas.errors import ApiError
from numpy.typing import NDArray

MatrixName = Literal["similarity", "overlap", "closeness", "distance_m"]


def read_matrix(response: httpx.Response, robots: Callable[[], list[str]]) -> tuple[list[str], NDArray[np.float64]]:
    """The robots and their matrix (N, N) in .npy. Raises ApiError for what is not that."""
    try:
        matrix = np.load(io.BytesIO(response.content), allow_pickle=False)
    except (ValueError, EOFError, OSError) as error:
        raise _odd(response, str(error)) from error
    named = response.headers.get("Covista-Robots")
    order = robots() if named is None else [name.strip() for name in named.split(",") if name.strip()]
    if not isinstance(matrix, np.ndarray) or matrix.dtype.kind != "f" or matrix.shape != (len(order), len(order)):
        raise _odd(response, f"an array {getattr(matrix, 'shape', '')} for {len(order)} robots")
    return order, np.asarray(matrix, np.float64)


def _odd(response: httpx.Response, detail: str) -> ApiError:
    return ApiError(f"{response.url} does not answer as a station does", detail=detail)

"""One thread for OpenCV and BLAS, so that figures are those of one core."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import cv2
from covista_schemas.errors import MissingExtraError


@contextmanager
def one_thread() -> Iterator[None]:
    """Limit the libraries to one thread; raises MissingExtraError."""
    try:
        from threadpoolctl import threadpool_limits
    except ImportError as error:
        raise MissingExtraError("a benchmark on one core", "bench") from error
    before = cv2.getNumThreads()
    cv2.setNumThreads(1)
    try:
        with threadpool_limits(limits=1):
            yield
    finally:
        cv2.setNumThreads(before)

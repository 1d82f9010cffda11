"""Loops that arrays cannot say, compiled to machine code by numba; they release the GIL."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar, cast

from numba import njit

_F = TypeVar("_F", bound=Callable[..., Any])


def compiled(function: _F) -> _F:
    """The same function, compiled when first called with such arguments and kept on disk for the next process.

    Sums may be reordered, but infinities and NaN keep their meaning. Dividing by zero gives them, as in arrays: asking
    before each division whether to raise doubles the time of a tight loop.
    """
    decorate = njit(cache=True, nogil=True, error_model="numpy", fastmath={"reassoc", "contract", "arcp", "nsz"})
    return cast(_F, decorate(function))

"""What the C library keeps of memory that nobody uses. Only glibc is told anything; others are left alone.

It gives each thread a heap of its own, up to eight a core. Keyframes are read in one thread and let go of in another,
so that each heap comes to hold the most that it ever needed, and a station of thirty threads grows for hours. So its
threads share a few heaps, and what is free within those goes back to the system now and then.
"""

from __future__ import annotations

import asyncio
import ctypes
import os
import platform

# mallopt(3)
_M_ARENA_MAX = -8
_HEAPS = 2
_TRIM_S = 60.0


def bound() -> None:
    """Have threads share heaps; before there are any. Who has set MALLOC_ARENA_MAX has chosen."""
    if _is_glibc() and "MALLOC_ARENA_MAX" not in os.environ:
        ctypes.CDLL(None).mallopt(_M_ARENA_MAX, _HEAPS)


async def keep_trim() -> None:
    """Give back what is free each minute, until cancelled: some milliseconds in a thread of its own."""
    while _is_glibc():
        await asyncio.sleep(_TRIM_S)
        await asyncio.to_thread(ctypes.CDLL(None).malloc_trim, 0)


def _is_glibc() -> bool:
    return platform.libc_ver()[0] == "glibc"

"""Memory that is used again: arrays that stay in cache, pages that are not given back."""

from __future__ import annotations

from contextlib import suppress
from functools import cache

import numpy as np

__all__ = ["CHUNK", "keep_pages"]

CHUNK = 8192  # solved at a time: the arrays of a walk stay in cache
BLOCK = 30 * 2**20  # bytes; glibc learns from blocks of up to 32 MiB


@cache
def keep_pages() -> None:
    """Let the C library keep the pages of arrays that are freed, for the next ones.

    glibc returns freed memory at the top of its heap to the system beyond a threshold of 128 KiB, and what is asked for
    anew then costs a page fault every 4 KiB: half the time of a walk over 20 000 positions. It raises the threshold to
    twice the size of a mapped block that is freed (mallopt(3), M_MMAP_THRESHOLD), here without touching the block. Some
    60 MiB at most stay with the process; other C libraries see an allocation and nothing else.
    """
    with suppress(MemoryError):
        np.empty(BLOCK, np.uint8)

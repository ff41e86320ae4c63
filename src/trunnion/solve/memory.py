"""Memory that is used again: arrays that stay in cache, pages that are not given back."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import suppress
from functools import cache

import numpy as np
from numpy.typing import NDArray

__all__ = ["CHUNK", "blocks", "in_blocks", "keep_pages"]

Array = NDArray[np.float64]
Looked = tuple[Array, NDArray[np.integer]]

CHUNK = 8192  # solved at a time: the arrays of a walk stay in cache
JOINTS = 2**18  # at all the positions that are solved at a time: each takes some 300 bytes
BLOCK = 30 * 2**20  # bytes; glibc learns from blocks of up to 32 MiB


def blocks(count: int, joints: int) -> Iterator[slice]:
    """Parts of some positions that are solved at a time, so that memory does not grow with how many there are."""
    size = max(1, min(CHUNK, JOINTS // max(1, joints)))
    yield from (slice(low, min(low + size, count)) for low in range(0, count, size))


def in_blocks(look: Callable[[Array], Looked], joints: int) -> Callable[[Array], Looked]:
    """What is looked up at times, rows (row, time) and states, a block of them at a time."""

    def looked(time: Array) -> Looked:
        rows, states = zip(*(look(time[block]) for block in blocks(len(time), joints)), strict=True)
        return np.concatenate(rows, axis=1), np.concatenate(states)

    return looked


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

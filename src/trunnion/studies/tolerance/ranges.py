"""Ranges of blocks: which are left, and in what portions they are handed out."""

from __future__ import annotations

import math
from collections.abc import Iterable

from trunnion.studies.tolerance.protocol import Blocks

__all__ = ["Portions", "count", "gaps"]


def count(ranges: Iterable[Blocks]) -> int:
    """Number of blocks in disjoint ranges."""
    return sum(last - first for first, last in ranges)


def gaps(done: Iterable[Blocks], blocks: int) -> list[Blocks]:
    """What is missing of 0 … blocks - 1, in order; done: sorted, disjoint."""
    ends = [0, *(end for pair in done for end in pair), blocks]
    return [(first, last) for first, last in zip(ends[::2], ends[1::2], strict=True) if first < last]


EACH = 0.05  # s for every worker: ten times what one portion costs the main process (`python -m benchmarks.spread`)
LEAST = 16  # part of a full portion that is not worth dividing further


class Portions:
    """Hands out the blocks that are not yet done, in order: so many as stated, or what takes `seconds` at this pace.

    With many workers portions are longer, so that this process, which merges what all of them send, is busy a tenth of
    the time at most. Near the end they shrink with what is left, so that all workers end at about the same time. Where
    no size is stated it is a power of two that divides the first block: the tally is one node of the binary tree then.
    """

    def __init__(self, done: Iterable[Blocks], blocks: int, stated: int | None, seconds: float) -> None:
        self._gaps = gaps(done, blocks)[::-1]
        self._stated = stated
        self._seconds = seconds
        self._per_block = math.nan

    @property
    def left(self) -> int:
        """Blocks not yet handed out."""
        return count(self._gaps)

    def take(self, workers: int) -> Blocks:
        """The next portion."""
        size = self.size(workers)
        first, last = self._gaps.pop()
        size = min(size, last - first)
        if self._stated is None:
            size = 1 << (size.bit_length() - 1)
            size = min(size, first & -first) if first else size
        if first + size < last:
            self._gaps.append((first + size, last))
        return first, first + size

    def size(self, workers: int) -> int:
        """Blocks of the next portion, at most."""
        if self._stated is not None:
            return self._stated
        if math.isnan(self._per_block):
            return 1
        full = int(max(self._seconds, EACH * workers) / max(self._per_block, 1e-9))
        share = math.ceil(self.left / (2 * workers)) if workers > 1 else self.left
        return max(1, full // LEAST, min(share, full))

    def seen(self, blocks: Blocks, seconds: float) -> None:
        """Blocks took so long; half the weight to the news, for the first portion may have included compilation."""
        now = seconds / count([blocks])
        self._per_block = now if math.isnan(self._per_block) else (self._per_block + now) / 2

"""Ranges of blocks: which are left, and in what portions they are handed out."""

from __future__ import annotations

import math
from collections.abc import Iterable

from trunnion.studies.tolerance.protocol import Blocks

__all__ = ["BlockRanges", "Pace", "count", "gaps", "union"]


def count(ranges: Iterable[Blocks]) -> int:
    """Number of blocks in disjoint ranges."""
    return sum(last - first for first, last in ranges)


def gaps(done: Iterable[Blocks], blocks: int) -> list[Blocks]:
    """What is missing of 0 … blocks - 1, in order; done: sorted, disjoint."""
    ends = [0, *(end for pair in done for end in pair), blocks]
    return [(first, last) for first, last in zip(ends[::2], ends[1::2], strict=True) if first < last]


def union(ranges: Iterable[Blocks]) -> tuple[Blocks, ...]:
    """Disjoint ranges sorted, neighbours joined."""
    joined: list[Blocks] = []
    for first, last in sorted(ranges):
        if joined and first == joined[-1][1]:
            joined[-1] = (joined[-1][0], last)
        else:
            joined.append((first, last))
    return tuple(joined)


class BlockRanges:
    """Hands out the blocks that are not yet done, in order."""

    def __init__(self, done: Iterable[Blocks], blocks: int) -> None:
        self._gaps = gaps(done, blocks)[::-1]

    @property
    def left(self) -> int:
        """Blocks not yet handed out."""
        return count(self._gaps)

    def take(self, most: int, aligned: bool) -> Blocks:
        """The next range, at most `most` blocks (at least one).

        aligned: a power of two that divides the first block, so that the range is one node of a binary tree over the
        blocks and its tally has one node too.
        """
        first, last = self._gaps.pop()
        size = min(max(most, 1), last - first)
        if aligned:
            size = 1 << (size.bit_length() - 1)
            size = min(size, first & -first) if first else size
        if first + size < last:
            self._gaps.append((first + size, last))
        return first, first + size


EACH = 0.05  # s for every worker: ten times what one portion costs the main process (`python -m benchmarks.spread`)
LEAST = 16  # part of a full portion that is not worth dividing further


class Pace:
    """How many blocks make a portion: those stated, or what takes `seconds` at the pace measured so far.

    With many workers portions are longer, so that this process, which merges what all of them send, is busy a tenth of
    the time at most. Near the end they shrink with what is left, so that all workers end at about the same time.
    """

    def __init__(self, stated: int | None, seconds: float) -> None:
        self._stated = stated
        self._seconds = seconds
        self._per_block = math.nan

    @property
    def aligned(self) -> bool:
        """Whether portions are to be nodes of the binary tree."""
        return self._stated is None

    def seen(self, blocks: int, seconds: float) -> None:
        """Blocks took so long; half the weight to the news, for the first portion may have included compilation."""
        now = seconds / blocks
        self._per_block = now if math.isnan(self._per_block) else (self._per_block + now) / 2

    def blocks(self, left: int, workers: int) -> int:
        """Blocks of the next portion."""
        if self._stated is not None:
            return self._stated
        if math.isnan(self._per_block):
            return 1
        seconds = max(self._seconds, EACH * workers)
        full = int(seconds / max(self._per_block, 1e-9))
        share = math.ceil(left / (2 * workers)) if workers > 1 else left
        return max(1, full // LEAST, min(share, full))

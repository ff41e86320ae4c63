"""Where in the cycle something is: ranges of the driver's angle, and the part in which most of a misfit lies."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

__all__ = ["Concentration", "arcs", "concentration"]

Array = NDArray[np.float64]
APART = 0.03  # of the cycle: what lies nearer to each other is one range
FEW = 0.05  # of all, that a range has to hold to be one
HALF = 0.5  # of a mean square, from which it is said where it lies
NARROW = 0.3  # of the cycle, up to which that is a place


def arcs(angle: Array, start: float, cycle: float) -> list[tuple[float, float]]:
    """Ranges of an angle, rad, from `start` within a cycle, in which nearly all of the angles given lie.

    A range over the end of the cycle ends below where it begins.
    """
    at = np.sort(np.mod(angle[np.isfinite(angle)] - start, cycle))
    if not at.size:
        return []
    gaps = np.diff(at, append=at[0] + cycle)
    ends = np.flatnonzero(gaps > APART * cycle)
    if not ends.size:
        return [(start, start + cycle)]
    found = []
    for k, end in enumerate(ends):
        first = (int(ends[k - 1]) + 1) % at.size
        if (int(end) - first) % at.size + 1 >= FEW * at.size:
            found.append((start + float(at[first]), start + float(at[end])))
    return sorted(found)


class Concentration(NamedTuple):
    """Positions from first to last, over the end of the cycle if last < first, and their share of the mean square."""

    first: int
    last: int
    share: float


def concentration(residual: Array, closed: bool = True) -> Concentration | None:
    """The part of the cycle with most of the mean square of a residual; None where it is spread over the cycle.

    residual: (position,), NaN where there is none; closed: whether the end of the cycle is next to its start. The part
    is the one run of positions in which the square exceeds its mean by most (Kadane's largest sum).
    """
    square = np.where(np.isfinite(residual), residual, 0.0) ** 2
    known = int(np.count_nonzero(np.isfinite(residual)))
    total = float(np.sum(square))
    if known < 2 or not (np.isfinite(total) and total > 0):
        return None
    over = np.where(np.isfinite(residual), square - total / known, 0.0)
    first, length = _largest_run(np.concatenate([over, over]) if closed else over, len(over))
    run = (first + np.arange(length)) % len(over)
    share = float(np.sum(square[run])) / total
    if share < HALF or np.count_nonzero(np.isfinite(residual[run])) > NARROW * known:
        return None
    return Concentration(int(run[0]), int(run[-1]), share)


def _largest_run(values: Array, longest: int) -> tuple[int, int]:
    """Begin and length of the run with the largest sum."""
    sums = np.concatenate([[0.0], np.cumsum(values)])
    lowest, low, best, found = 0.0, 0, 0.0, (0, 1)
    for end in range(1, len(sums)):
        if sums[end] - lowest > best and end - low <= longest:
            best, found = sums[end] - lowest, (low, end - low)
        if sums[end] < lowest:
            lowest, low = sums[end], end
    return found

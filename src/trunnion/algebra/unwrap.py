"""Angles that run on over whole turns."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["unwrap_row"]

CHUNK = 8192  # positions at a time, to save memory


def unwrap_row(angle: NDArray[np.float64], rate: NDArray[np.float64], step: float) -> None:
    """Add whole turns in place so that the angle follows its rate from position to position (`step` s apart).

    A gap of NaN is bridged to the nearest turn. Some positions at a time, to save memory.
    """
    turns, last, last_rate, last_at = 0.0, np.nan, 0.0, -1
    for low in range(0, len(angle), CHUNK):
        part = angle[low : low + CHUNK]
        solved = np.flatnonzero(np.isfinite(part))
        if not len(solved):
            continue
        values, rates = part[solved], np.nan_to_num(rate[low : low + CHUNK][solved])
        before = np.concatenate([[last if np.isfinite(last) else values[0]], values[:-1]])
        mean_rate = (np.concatenate([[last_rate], rates[:-1]]) + rates) / 2
        next_to = np.diff(np.concatenate([[last_at], solved + low])) == 1
        expected = np.where(next_to & np.isfinite(before), mean_rate * step, 0.0)
        if not np.isfinite(last):
            expected[0] = 0.0
        added = np.cumsum(np.rint((expected - (values - before)) / (2 * np.pi)))
        part[solved] = values + 2 * np.pi * (turns + added)
        turns, last, last_rate, last_at = turns + added[-1], values[-1], rates[-1], int(solved[-1]) + low

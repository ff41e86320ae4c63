"""Times or angles of the pulses of a shaft that are known to a sample: the smoothest that agree with all of them.

At a steady speed sampling and pulses are easily in a fixed ratio. The error of each pulse, up to half a sample, is then
the same in every turn, and averaging over turns leaves it. What lessens it is the shaft: it cannot follow such errors.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import minimum_filter1d, uniform_filter1d
from scipy.signal import savgol_filter

__all__ = ["seen_edges", "smoothed", "unresolved"]

Array = NDArray[np.float64]
SPANS = (2.0, 1.0, 0.5, 0.25, 0.125, 0.0625)  # turns over which it is tried, the longest first
ORDER = 3
FEWEST = 5  # pulses in a span
BOUND = 1.1  # of what a pulse may be off: more tells that the shaft itself runs unevenly
EVEN = 1.1 / np.sqrt(3.0)  # the same of the root mean square, of errors spread evenly


def smoothed(values: Array, off: float, per_turn: float) -> tuple[Array, Array]:
    """Values at pulses by local cubics (Savitzky and Golay, doi:10.1021/ac60214a047), and the turns of each span.

    values: times, s, of pulses one count apart, or angles, rad, of pulses one sample apart; off: by which each may be
    off, as uniformly as rounding; per_turn: pulses of a turn. Each takes the longest span in which no value is farther
    from the cubic than it may be, and their root mean square is that of rounding; none, 0, where not even the shortest
    is so.
    """
    found, spans = values.copy(), np.zeros(values.size)
    if off <= 0:
        return found, spans
    trend = np.linspace(values[0], values[-1], values.size)
    for span in SPANS:
        width = 2 * int(span * per_turn / 2) + 1
        if width < FEWEST or width > values.size:
            continue
        fitted = trend + savgol_filter(values - trend, width, ORDER)
        left = np.abs(values - fitted)
        even = np.sqrt(np.maximum(uniform_filter1d(left**2, width, mode="mirror"), 0.0)) <= EVEN * off
        good = minimum_filter1d(((left <= BOUND * off) & even).astype(np.int8), width, mode="mirror") > 0
        taken = good & (spans == 0)
        found[taken], spans[taken] = fitted[taken], span
    return found, spans


def unresolved(off: Array, step: float) -> float:
    """Standard uncertainty left in the mean of values rounded to a step, by what each was off the smooth ones.

    Where sampling and pulses are in step, these are off by few amounts only, and rounding shifts all by up to half of
    what lies between two of them: a rectangular distribution (GUM, JCGM 100:2008, 4.3.7).
    """
    if off.size < 2:
        return 0.0
    few = int(0.005 * off.size)
    told = np.sort(off)[few : off.size - few]
    between = max(float(np.max(np.diff(told), initial=0.0)), step - float(told[-1] - told[0]))
    return min(between, step) / math.sqrt(12.0)


def seen_edges(index: Array, turns: float, step: float) -> Array:
    """Rising edges of an index that is too narrow for the sampling to see it in every turn.

    index: taken in the middle between two samples; turns: from the first to the last of them. One that is seen in a
    share of the turns is as wide as that share of a sample, and rose at most so long before the sample that saw it.
    """
    share = min((index.size - 1) / max(turns, 1.0), 1.0)
    return index + 0.5 * step * (1.0 - share) if share < 0.95 else index

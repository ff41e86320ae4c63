"""Local polynomials through evenly spaced values: the filter of Savitzky and Golay.

By hand, on `scipy.ndimage`: `scipy.signal` has it too, and brings `scipy.stats`, which takes longer to import than
the reading of a whole measurement.

Source: A. Savitzky, M. J. E. Golay, Smoothing and differentiation of data by simplified least squares procedures,
Analytical Chemistry 36 (1964) 1627-1639, doi:10.1021/ac60214a047.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import convolve1d

__all__ = ["by_local_polynomials"]

Array = NDArray[np.float64]


def by_local_polynomials(values: Array, width: int, order: int) -> Array:
    """Each value by the polynomial nearest to the `width` values around it; near the ends by that of the outermost.

    width: odd, above the order, at most as many as there are values.
    """
    half = width // 2
    places = np.arange(-half, half + 1) / half  # of one size, so that no power is lost beside another
    wanted = np.zeros(order + 1)
    wanted[0] = 1.0  # the polynomial in the middle, not one of its derivatives
    weights = np.linalg.lstsq(places ** np.arange(order + 1)[:, None], wanted, rcond=None)[0]
    found: Array = convolve1d(values, weights[::-1], mode="constant")
    for end, inside in ((slice(0, width), slice(0, half)), (slice(-width, None), slice(-half, None))):
        found[inside] = np.polyval(np.polyfit(np.arange(width), values[end], order), np.arange(width)[inside])
    return found

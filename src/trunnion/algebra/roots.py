"""Places where a number falls to 0, in many lanes at once."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

__all__ = ["root"]

Array = NDArray[np.float64]
ROUNDS = 60


def root(off: Callable[[Array], Array], low: Array, high: Array) -> Array:
    """Where a number gets from above 0 to it, by regula falsi (Illinois); the low end if it is not above there."""
    at_low, at_high = off(low), off(high)
    found, left = np.where(at_low <= 0.0, low, high), at_low > 0.0
    for _ in range(ROUNDS):
        place = high - at_high * (high - low) / (at_high - at_low)
        value = off(np.where(left, place, found))
        found = np.where(left, place, found)
        above = value > 0.0
        at_high = np.where(above, 0.5 * at_high, value)
        at_low = np.where(above, value, 0.5 * at_low)
        low, high = np.where(above, place, low), np.where(above, high, place)
        left = left & (np.abs(high - low) > 1e-13 * np.abs(high)) & (value != 0.0)
        if not np.any(left):
            break
    return found

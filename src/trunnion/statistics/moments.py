"""Moments of samples, some of which may have no value."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

__all__ = ["Moments", "moments_of"]

Floats = NDArray[np.float64]


class Moments(NamedTuple):
    """Number of values, mean, standard deviation by n − 1, skewness and kurtosis (3 of a normal distribution).

    Those that do not exist are NaN: the deviation of one value, skewness and kurtosis where nothing varies.
    """

    number: Floats
    mean: Floats
    deviation: Floats
    skewness: Floats
    kurtosis: Floats


def moments_of(values: Floats) -> Moments:
    """Moments along the last axis; NaN are left out."""
    known = ~np.isnan(values)
    number = np.sum(known, axis=-1, dtype=float)
    divisor = np.maximum(number, 1.0)
    with np.errstate(all="ignore"):
        mean = np.sum(values, axis=-1, where=known) / divisor
        # with what rounding left in the mean
        mean = mean + np.nan_to_num(np.sum(values - mean[..., None], axis=-1, where=known) / divisor)
        apart = np.where(known, values - mean[..., None], 0.0)
        square = apart * apart
        second, third, fourth = (np.sum(one, axis=-1) / divisor for one in (square, square * apart, square * square))
        return Moments(
            number,
            np.where(number > 0, mean, np.nan),
            np.where(number > 1, np.sqrt(second * divisor / np.maximum(number - 1, 1.0)), np.nan),
            np.where(second > 0, third / second**1.5, np.nan),
            np.where(second > 0, fourth / second**2, np.nan),
        )

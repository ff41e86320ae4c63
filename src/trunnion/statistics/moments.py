"""Moments of samples, some of which may have no value."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

__all__ = ["Moments", "moments_of"]

Floats = NDArray[np.float64]


class Moments(NamedTuple):
    """Number of values, mean, standard deviation by n − 1, skewness and kurtosis (3 of a normal distribution).

    Those that do not exist are NaN: the deviation of one value, skewness and kurtosis where nothing varies, and all but
    the mean, which is infinite, of values some of which are.
    """

    number: Floats
    mean: Floats
    deviation: Floats
    skewness: Floats
    kurtosis: Floats


def moments_of(values: Floats) -> Moments:
    """Moments along the last axis; NaN are left out."""
    rows = np.array([_moments_of(row[~np.isnan(row)]) for row in values.reshape(-1, values.shape[-1])])
    return Moments(*np.moveaxis(rows.reshape(*values.shape[:-1], len(Moments._fields)), -1, 0))


def _moments_of(values: Floats) -> tuple[float, ...]:
    number = len(values)
    if not number:
        return 0.0, np.nan, np.nan, np.nan, np.nan
    with np.errstate(all="ignore"):
        mean = np.mean(values)
        apart = values - mean
        if np.isfinite(mean):
            mean += np.mean(apart)  # what rounding left in the mean
            apart = values - mean
        size = np.max(np.abs(apart))
        scaled = apart / size if size > 0.0 else apart  # so that no power leaves the range of floats
        square = scaled * scaled
        second, third, fourth = (np.mean(array) for array in (square, square * scaled, square * square))
        deviation = size * np.sqrt(second * number / (number - 1)) if number > 1 else np.nan
        shape = (third / second**1.5, fourth / second**2) if second > 0 else (np.nan, np.nan)
    return float(number), float(mean), float(deviation), *map(float, shape)

"""Angles that run on over whole turns."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["unwrap_row"]


def unwrap_row(angle: NDArray[np.float64], rate: NDArray[np.float64], step: float) -> None:
    """Add whole turns in place so that the angle follows its rate from position to position (`step` s apart).

    A gap of NaN is bridged to the nearest turn.
    """
    solved = np.flatnonzero(np.isfinite(angle))
    rates = np.nan_to_num(rate[solved])
    expected = np.where(np.diff(solved) == 1, (rates[:-1] + rates[1:]) / 2 * step, 0.0)
    added = np.cumsum(np.rint((expected - np.diff(angle[solved])) / (2 * np.pi)))
    angle[solved[1:]] += 2 * np.pi * added

"""Places where a number passes 0, in many lanes at once.

T. R. Chandrupatla, A new hybrid quadratic/bisection algorithm, Adv. Eng. Softw. 28 (1997) 145-149,
doi:10.1016/S0965-9978(96)00051-8.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

__all__ = ["root"]

Array = NDArray[np.float64]
ROUNDS = 60


def root(
    off: Callable[[Array], Array], low: Array, high: Array, at_low: Array, at_high: Array, settled: Array
) -> Array:
    """Where a number is 0 between two places at which it has other signs, by inverse quadratic interpolation where that
    is sure to converge, else bisection. at_low, at_high: the number there; settled: how near that is to be found."""
    a, b, fa, fb = low.copy(), high.copy(), at_low, at_high
    with np.errstate(all="ignore"):
        share = np.clip(fa / (fa - fb), 0.0, 1.0)
        for _ in range(ROUNDS):
            at = a + share * (b - a)
            value = off(at)
            same = np.sign(value) == np.sign(fa)
            c, fc = np.where(same, a, b), np.where(same, fa, fb)
            b, fb = np.where(same, b, a), np.where(same, fb, fa)
            a, fa = at, value
            if np.all((np.abs(b - a) <= settled) | (fa == 0) | (fb == 0) | np.isnan(fa)):
                break
            xi, phi = (a - b) / (c - b), (fa - fb) / (fc - fb)
            sure = (phi**2 < xi) & ((1 - phi) ** 2 < 1 - xi)
            inverse = fa / (fb - fa) * fc / (fb - fc) + (c - a) / (b - a) * fa / (fc - fa) * fb / (fc - fb)
            least = np.minimum(0.5, settled / np.abs(b - c))
            share = np.clip(np.where(sure & np.isfinite(inverse), inverse, 0.5), least, 1 - least)
    return np.where(np.abs(fa) <= np.abs(fb), a, b)

"""Closure by hand: points as complex numbers, m. What the facts of the gallery are held against."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np


def corner(a: complex, b: complex, ac: float, bc: float, side: int) -> complex:
    """C with |AC| = ac and |BC| = bc, left of the line from A to B if side is +1, right of it if −1. Takes arrays.

    With u = AB/|AB|: C = A + (p + i side q) u, p = (AB² + ac² − bc²)/(2 AB), q² = ac² − p².
    """
    d = np.abs(b - a)
    p = (d**2 + ac**2 - bc**2) / (2 * d)
    return a + (p + 1j * side * np.sqrt(ac**2 - p**2)) * (b - a) / d


def slope(f: Callable[[float], complex], x: float, h: float = 1e-4) -> complex:
    """f'(x) by differences of fourth order."""
    return (8 * (f(x + h) - f(x - h)) - (f(x + 2 * h) - f(x - 2 * h))) / (12 * h)


def bend(f: Callable[[float], complex], x: float, h: float = 1e-3) -> complex:
    """f''(x) by differences of fourth order."""
    return (16 * (f(x + h) + f(x - h)) - (f(x + 2 * h) + f(x - 2 * h)) - 30 * f(x)) / (12 * h * h)

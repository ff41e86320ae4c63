"""Cubic splines through points: twice continuously differentiable, on any number, ends at rest, free or periodic."""

from __future__ import annotations

import functools
from collections.abc import Sequence
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from trunnion.algebra.dual import primal
from trunnion.algebra.namespace import Number, namespace

__all__ = ["Ends", "Spline", "spline"]

Ends = Literal["clamped", "natural", "periodic"]


class Spline(NamedTuple):
    """A spline by its knots with value and slope there; beyond its ends the last cubic goes on.

    table: knot, value, slope and the coefficients of x² and x³ of every interval, if all numbers are plain.
    """

    knots: tuple[Number, ...]
    values: tuple[Number, ...]
    slopes: tuple[Number, ...]
    table: NDArray[np.float64] | None = None

    def at(self, place: Number) -> tuple[Number, Number, Number]:
        """Value, first and second derivative."""
        knot, value, slope, c2, c3 = self._interval(place)
        x = place - knot
        return value + x * (slope + x * (c2 + x * c3)), slope + x * (2 * c2 + 3 * x * c3), 2 * c2 + 6 * x * c3

    def _interval(self, place: Number) -> Sequence[Number]:
        """The row of the table for the interval in which each place lies."""
        if self.table is not None:
            index = np.searchsorted(self.table[0], primal(place), side="right") - 1
            return [namespace(index).take(row, np.maximum(index, 0)) for row in self.table]
        found = self._row(0)
        xp = namespace(place, *self.knots, *self.values)
        for k in range(1, len(self.knots) - 1):
            beyond = primal(place) >= primal(self.knots[k])
            found = [xp.where(beyond, new, old) for new, old in zip(self._row(k), found, strict=True)]
        return found

    def _row(self, k: int) -> list[Number]:
        """Knot, value, slope and the coefficients of x² and x³, x counted from the knot, of one interval."""
        h = self.knots[k + 1] - self.knots[k]
        mean = (self.values[k + 1] - self.values[k]) / h
        here, there = self.slopes[k], self.slopes[k + 1]
        return [
            self.knots[k],
            self.values[k],
            here,
            (3 * mean - 2 * here - there) / h,
            (here + there - 2 * mean) / (h * h),
        ]


def spline(knots: Sequence[Number], values: Sequence[Number], ends: Ends) -> Spline:
    """The spline through at least two points, three if periodic.

    ends: clamped has slope 0 there, natural no curvature, periodic the same slope and curvature at both (its
    values may differ: it then advances by their difference every period).
    Source: C. de Boor, A Practical Guide to Splines, Springer 1978, chapter IV: continuity of the second
    derivative, h = distance of the knots, d = slope of the chord, m = slope of the spline:
    m₋/h₋ + 2 m (1/h₋ + 1/h₊) + m₊/h₊ = 3 (d₋/h₋ + d₊/h₊).
    """
    if all(isinstance(number, (int, float)) for number in (*knots, *values)):
        return _plain(tuple(map(float, knots)), tuple(map(float, values)), ends)
    return _fitted(knots, values, ends)


@functools.lru_cache(maxsize=64)
def _plain(knots: tuple[float, ...], values: tuple[float, ...], ends: Ends) -> Spline:
    """The same for plain numbers, kept, with its table."""
    found = _fitted(knots, values, ends)
    rows = np.array([found._row(k) for k in range(len(knots) - 1)])
    return found._replace(table=rows.T.copy())


def _fitted(knots: Sequence[Number], values: Sequence[Number], ends: Ends) -> Spline:
    n = len(knots)
    w = [1.0 / (knots[k + 1] - knots[k]) for k in range(n - 1)]  # 1/h
    r = [3 * (values[k + 1] - values[k]) * w[k] * w[k] for k in range(n - 1)]  # 3 d/h
    inner = [2 * (w[k - 1] + w[k]) for k in range(1, n - 1)]
    right = [r[k - 1] + r[k] for k in range(1, n - 1)]
    slopes: list[Number]
    if ends == "periodic":
        slopes = _cyclic(w, [2 * (w[-1] + w[0]), *inner], [r[-1] + r[0], *right])
        slopes.append(slopes[0])
    elif ends == "clamped":
        slopes = [0.0, *_tridiagonal(w[1:-1], inner, right), 0.0]
    else:
        slopes = _tridiagonal(w, [2 * w[0], *inner, 2 * w[-1]], [r[0], *right, r[-1]])
    return Spline(tuple(knots), tuple(values), tuple(slopes))


def _tridiagonal(side: Sequence[Number], main: Sequence[Number], right: Sequence[Number]) -> list[Number]:
    """Solution of a symmetric, diagonally dominant tridiagonal system, by elimination."""
    main, right = list(main), list(right)
    for k in range(1, len(main)):
        factor = side[k - 1] / main[k - 1]
        main[k] = main[k] - factor * side[k - 1]
        right[k] = right[k] - factor * right[k - 1]
    for k in reversed(range(len(main))):
        above = side[k] * right[k + 1] if k + 1 < len(main) else 0.0
        right[k] = (right[k] - above) / main[k]
    return right


def _cyclic(side: Sequence[Number], main: Sequence[Number], right: Sequence[Number]) -> list[Number]:
    """The same with side[-1] joining the first and the last unknown (Sherman and Morrison)."""
    corner = side[-1]
    reduced = [main[0] * 2, *main[1:-1], main[-1] + corner * corner / main[0]]  # less u uᵀ / −main[0]
    u = [-main[0], *([0.0] * (len(main) - 2)), corner]
    x, z = _tridiagonal(side, reduced, right), _tridiagonal(side, reduced, u)
    ratio = corner / main[0]
    factor = (x[0] - ratio * x[-1]) / (1 + z[0] - ratio * z[-1])
    return [a - factor * b for a, b in zip(x, z, strict=True)]

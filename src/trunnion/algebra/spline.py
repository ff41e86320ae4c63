"""Numbers between points: cubic splines, and the values of a table, linear or by a spline; on any number."""

from __future__ import annotations

import functools
from collections.abc import Sequence
from itertools import pairwise
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from trunnion.algebra.dual import primal
from trunnion.algebra.namespace import Number, namespace

Ends = Literal["clamped", "natural", "periodic"]
STRAIGHT = 0.0  # coefficient of a power that a straight line does not have
SLACK = 1e-9  # of the table's extent: a cycle that ends where the table does is inside, whatever the rounding


class Spline(NamedTuple):
    """A cubic of each interval between knots, with values and slopes there; beyond the ends the first and last go on.

    rows: knot, and value, slope and coefficients of x² and x³ there, of every interval; table: the same as an array,
    (number, interval), if all numbers are plain.
    """

    knots: Sequence[Number]
    values: Sequence[Number]
    slopes: Sequence[Number]
    rows: Sequence[Sequence[Number]]
    table: NDArray[np.float64] | None = None

    def at(self, place: Number) -> tuple[Number, Number, Number]:
        """Value, first and second derivative."""
        knot, value, slope, c2, c3 = self._interval(place)
        x = place - knot
        return value + x * (slope + x * (c2 + x * c3)), slope + x * (2 * c2 + 3 * x * c3), 2 * c2 + 6 * x * c3

    def _interval(self, place: Number) -> Sequence[Number]:
        """The row of the interval in which each place lies."""
        if self.table is not None:
            index = np.searchsorted(self.table[0], primal(place), side="right") - 1
            return [namespace(index).take(row, np.maximum(index, 0)) for row in self.table]
        row = list(self.rows[0])
        xp = namespace(place, *(number for numbers in self.rows for number in numbers))
        for later in self.rows[1:]:
            after = primal(place) >= primal(later[0])
            row = [old if new is old else xp.where(after, new, old) for new, old in zip(later, row, strict=True)]
        return row


def spline(knots: Sequence[Number], values: Sequence[Number], ends: Ends | None) -> Spline:
    """The twice continuously differentiable spline through at least two points, three if periodic.

    ends: clamped has slope 0 there, natural no curvature, periodic the same slope and curvature at both (its
    values may differ: it then advances by their difference every period); None: straight lines between the points.
    That of plain numbers is kept, with its table.
    Source: C. de Boor, A Practical Guide to Splines, Springer 1978, chapter IV: continuity of the second
    derivative, h = distance of the knots, d = slope of the chord, m = slope of the spline:
    m₋/h₋ + 2 m (1/h₋ + 1/h₊) + m₊/h₊ = 3 (d₋/h₋ + d₊/h₊).
    """
    if all(isinstance(number, (int, float)) for number in (*knots, *values)):
        return _plain(tuple(map(float, knots)), tuple(map(float, values)), ends)
    return _fitted(knots, values, ends)


def look_up(
    knots: Sequence[Number], values: Sequence[Number], place: Number, smooth: bool = False, periodic: bool = False
) -> Number:
    """The value at a place: NaN outside a table that is not periodic; knots must rise.

    smooth: by the natural or periodic cubic spline, not linear. A periodic table repeats after its last knot.
    """
    low, extent = knots[0], knots[-1] - knots[0]
    if periodic:
        place = place - extent * np.floor(primal((place - low) / extent))
    value = spline(knots, values, ("periodic" if periodic else "natural") if smooth else None).at(place)[0]
    if periodic:
        return value
    share = primal((place - low) / extent)
    return namespace(value).where((share >= -SLACK) & (share <= 1 + SLACK), value, np.nan)


@functools.lru_cache(maxsize=64)
def _plain(knots: tuple[float, ...], values: tuple[float, ...], ends: Ends | None) -> Spline:
    fitted = _fitted(knots, values, ends)
    return fitted._replace(table=np.array(fitted.rows).T.copy())


def _fitted(knots: Sequence[Number], values: Sequence[Number], ends: Ends | None) -> Spline:
    steps = [after - before for before, after in pairwise(knots)]
    chords = [(after - before) / h for (before, after), h in zip(pairwise(values), steps, strict=True)]
    if ends is None:
        slopes, curved = chords, [(STRAIGHT, STRAIGHT)] * len(chords)
    else:
        slopes = _slopes(knots, values, ends)
        curved = [
            ((3 * chord - 2 * here - after_knot) / h, (here + after_knot - 2 * chord) / (h * h))
            for chord, h, (here, after_knot) in zip(chords, steps, pairwise(slopes), strict=True)
        ]
    rows = [[*row, *more] for *row, more in zip(knots, values, slopes, curved, strict=False)]
    return Spline(knots, values, slopes, rows)


def _slopes(knots: Sequence[Number], values: Sequence[Number], ends: Ends) -> list[Number]:
    """Of the spline at its knots."""
    n = len(knots)
    w = [1.0 / (knots[k + 1] - knots[k]) for k in range(n - 1)]  # 1/h
    r = [3 * (values[k + 1] - values[k]) * w[k] * w[k] for k in range(n - 1)]  # 3 d/h
    inner = [2 * (w[k - 1] + w[k]) for k in range(1, n - 1)]
    right = [r[k - 1] + r[k] for k in range(1, n - 1)]
    if ends == "periodic":
        # Sherman and Morrison: w[-1] joins the first and the last unknown; less u uᵀ / −main[0]
        main, right, corner = [2 * (w[-1] + w[0]), *inner], [r[-1] + r[0], *right], w[-1]
        reduced = [main[0] * 2, *main[1:-1], main[-1] + corner * corner / main[0]]
        x = _tridiagonal(w, reduced, right)
        z = _tridiagonal(w, reduced, [-main[0], *([0.0] * (len(main) - 2)), corner])
        ratio = corner / main[0]
        factor = (x[0] - ratio * x[-1]) / (1 + z[0] - ratio * z[-1])
        slopes = [a - factor * b for a, b in zip(x, z, strict=True)]
        return [*slopes, slopes[0]]
    if ends == "clamped":
        return [0.0, *_tridiagonal(w[1:-1], inner, right), 0.0]
    return _tridiagonal(w, [2 * w[0], *inner, 2 * w[-1]], [r[0], *right, r[-1]])


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

"""What is read of polynomials on panels: extremes, means, shares above a level; of one mechanism or of many at once.

On every panel a number is the polynomial with some Chebyshev coefficients in its spot, −1 at the start of the panel and
1 at its end: arrays (…, lane, panel, coefficient), a lane for each mechanism, of floats or of dual numbers. Values at a
spot that stays have the derivatives of the coefficients, so those of an extreme are these at its place, where the
course is level; the place itself moves by −ḟ′/f̈, f′ being the dual part.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.polynomial import chebyshev, legendre
from numpy.typing import NDArray

from trunnion.algebra.dual import Dual, derivative, primal
from trunnion.algebra.namespace import Number

Array = NDArray[np.float64]
Made = Callable[[Any], Number]  # of some rows, (row, …), one number, (…)

ORDER = 12  # coefficients of a panel
POINTS = -np.cos(np.pi * (np.arange(ORDER) + 0.5) / ORDER)
ON_POINTS = chebyshev.chebvander(POINTS, ORDER - 1).T
FIT = np.linalg.inv(ON_POINTS.T)
GRID = np.linspace(-1.0, 1.0, 33)  # places of a panel among which extremes are looked for first
CELL = GRID[1] - GRID[0]
ON_GRID = chebyshev.chebvander(GRID, ORDER - 1).T
GAUSS, GAUSS_WEIGHTS = legendre.leggauss(ORDER)
ON_GAUSS = chebyshev.chebvander(GAUSS, ORDER - 1).T
ENDS = np.array([(-1.0) ** np.arange(ORDER), np.ones(ORDER)]).T
INTEGRAL = ON_GAUSS @ GAUSS_WEIGHTS  # of every Chebyshev polynomial over a panel
RATE = np.zeros((ORDER, ORDER))  # coefficients of a derivative by the spot
RATE[:, :-1] = chebyshev.chebder(np.eye(ORDER), axis=1)
NEAR = 0.02  # of the range of a course: panels whose highest place of the grid is lower by less are looked at closely
FLAT = 1e-9  # of its size: a course that changes less is constant, and of tops that differ less the first counts
ROUNDING = 1e-14
TIED = 1e-7  # of its range: tops of which either may be the highest in mechanisms that differ by little
ROUGH, NARROWED = 1e-7, 12  # last coefficients of a polynomial, of the others, and rounds in which it is narrowed
CANCELLED = 1e-12  # of a mean of magnitudes: less than this is what rounding leaves of one that is zero
NEWTONS, LEADING, SETTLED = 5, 8, 1e-3
DOUBLE = 1e-7  # imaginary part of a root that counts as real: of a double root it is the square root of rounding
STILL = 1e-5  # step of Newton's method from where a course is level


class Top(NamedTuple):
    """An extreme of every lane, (lane,).

    value: NaN where no panel has one; panel, spot: its place; constant: whether the course does not change.
    """

    value: Number
    panel: NDArray[np.intp]
    spot: Number
    constant: NDArray[np.bool_]


def linear(number: Number, of: Callable[[Any], Any]) -> Number:
    """A linear function of an array, of both parts of a dual number."""
    return Dual(linear(number.real, of), linear(number.dual, of)) if isinstance(number, Dual) else of(number)


def selected(condition: Any, number: Number, other: Any) -> Number:
    """`numpy.where` for numbers of any kind; the other has no derivative."""
    if isinstance(number, Dual):
        return Dual(np.where(condition, number.real, other), np.where(condition, number.dual, 0.0 * other))
    return np.where(condition, number, other)


def weighted(number: Number, weights: Number) -> Number:
    """Mean over panels of a number at the Gauss nodes, (lane, panel, node), each with its weight of time."""
    parts = linear(number * weights, lambda array: np.sum(array @ GAUSS_WEIGHTS, axis=-1))
    total = linear(weights, lambda array: np.sum(np.broadcast_to(array, np.shape(primal(number))) @ GAUSS_WEIGHTS, -1))
    return parts / total


def spread_out(coefficients: Array, low: Array, half: Array, time: Array) -> Array:
    """Rows at rising times, (row, lane, time), of coefficients, (row, lane, panel, coefficient); at an edge later ones.

    low, half: starts and half widths of the panels, (lane, panel), one lane if they are those of all.
    """
    values, near = np.full((*coefficients.shape[:2], len(time)), np.nan), 1e-12 * np.ptp(time)
    width = 2.0 * half
    first, last = np.searchsorted(time, [np.min(low, axis=0) - near, np.max(low + width, axis=0) + near])
    shared = np.all((low == low[0]) & (width == width[0]), axis=0)
    scale = 2.0 / np.where(width > 0.0, width, np.nan)
    for k in np.flatnonzero((last > first) & np.any(width > 0.0, axis=0)):
        part = slice(first[k], last[k])
        if shared[k]:
            values[..., part] = coefficients[:, :, k] @ _basis((time[part] - low[0, k]) * scale[0, k] - 1.0)
            continue
        spot = (time[part] - low[:, k, None]) * scale[:, k, None] - 1.0
        inside = np.abs(spot) <= 1.0 + 1e-9
        values[..., part] = np.where(inside, _clenshaw(coefficients[:, :, k], spot), values[..., part])
    return values


def _clenshaw(coefficients: Array, spot: Array) -> Array:
    """Values of polynomials, (row, lane, coefficient), at spots of each lane, (lane, place)."""
    twice, after = 2.0 * spot, np.zeros(np.broadcast_shapes((*coefficients.shape[:-1], 1), spot.shape))
    value, new = after + coefficients[..., -1:], np.empty_like(after)
    for k in range(ORDER - 2, 0, -1):
        np.multiply(twice, value, out=new)
        new -= after
        new += coefficients[..., k, None]
        after, value, new = value, new, after
    return np.asarray(coefficients[..., :1] + spot * value - after)


class OnGrid(NamedTuple):
    """A number at the places of the grid, (lane, panel, place), and its extremes there, (lane, panel)."""

    values: Array
    least: Array
    most: Array

    @classmethod
    def of(cls, coefficients: Number, made: Made) -> OnGrid:
        """Of a number made of some rows."""
        values = np.asarray(primal(made(primal(coefficients) @ ON_GRID)), float)
        return cls(values, np.min(values, axis=2), np.max(values, axis=2))


def extreme(
    coefficients: Number,
    of: Made,
    sign: float = 1.0,
    allowed: Any = True,
    floor: float = 0.0,
    grid: OnGrid | None = None,
) -> Top:
    """The largest value of a number made of some rows, (row, lane, panel, coefficient), or with sign −1 its least.

    Every panel whose best place of a grid is nearly as high as the best of all is looked at closely: there the number
    is taken as a polynomial between the neighbours of that place, and its top is found by Newton's method.

    Parameters
    ----------
    of
        Such as `lambda rows: rows[0]`.
    allowed
        Panels among which it is looked for, (lane, panel).
    floor
        What is rounding of the number: a smaller change is none.
    grid
        The number at the places of the grid, if they are known.
    """
    grid = OnGrid.of(coefficients, of) if grid is None else grid
    tops, bottoms = (grid.most, grid.least) if sign > 0 else (-grid.least, -grid.most)
    finite = np.isfinite(tops) & allowed
    tops = np.where(finite, tops, -np.inf)
    high, low = np.max(tops, axis=1), np.min(np.where(finite, bottoms, np.inf), axis=1)
    finite_rows = np.isfinite(high)
    high, low = np.where(finite_rows, high, 0.0), np.where(finite_rows, low, 0.0)
    flat = np.maximum(FLAT * np.maximum(np.abs(high), np.abs(low)), floor)
    lane, panel = np.nonzero(finite_rows[:, None] & (tops >= (high - NEAR * (high - low))[:, None]))
    middle = GRID[np.clip(np.argmax(sign * grid.values[lane, panel], axis=1), 1, len(GRID) - 2)]
    width, pairs = np.full(len(lane), CELL), linear(coefficients, lambda array: array[:, lane, panel])
    rows = np.asarray(_fitted(primal(pairs), of, sign, middle, width))
    middle, width = _narrowed(primal(pairs), of, sign, (rows, middle, width))
    if np.any(width < CELL):
        rows = np.asarray(_fitted(primal(pairs), of, sign, middle, width))
    spot, value, level = _top(rows)
    best = np.maximum.reduceat(value, np.searchsorted(lane, np.flatnonzero(finite_rows))) if len(lane) else value
    most = np.full(len(tops), np.nan)
    most[finite_rows] = best
    first = np.zeros(len(tops), np.intp)
    constant = (grid.most - grid.least)[lane, panel] <= flat[lane]  # a plateau is told by where it begins
    place: Number = np.where(constant, -1.0, middle + width * spot)
    # one that is not level goes on rising beside its panel: only what is as high but for rounding counts there
    slack = np.where(level, flat[lane], ROUNDING * np.maximum(np.abs(high), np.abs(low))[lane])
    good = np.flatnonzero(value >= most[lane] - slack)  # all these lanes have one
    first[finite_rows] = good[np.append(True, np.diff(lane[good]) > 0)] if len(good) else good
    pick = first
    if isinstance(pairs, Dual):
        slopes = np.broadcast_to(derivative(_fitted(pairs, of, sign, middle, width)), rows.shape)
        changes = _at(slopes, spot)
        tied = value >= (most - flat - TIED * (high - low))[lane]
        larger = np.lexsort((-np.abs(changes), ~tied, lane)) if len(lane) else lane
        pick = first.copy()
        pick[finite_rows] = larger[np.searchsorted(lane, np.flatnonzero(finite_rows))]
        slope, rate, bend = _at(slopes @ RATE, spot), _at(rows @ RATE, spot), _at(rows @ RATE @ RATE, spot)
        still = ~constant & (bend < 0.0) & (np.abs(rate) <= STILL * np.abs(bend))  # also at an edge that is no break
        place = Dual(place, width * np.where(still, -slope / np.where(bend == 0.0, 1.0, bend), 0.0))
        reached: Number = Dual(sign * most, _picked(sign * changes, pick, finite_rows))
    else:
        reached = sign * most
    panels = np.where(finite_rows, _picked(panel.astype(float), first, finite_rows), 0)
    return Top(
        reached,
        panels.astype(np.intp),
        linear(place, lambda array: _picked(array, first, finite_rows)),
        finite_rows & (high - low <= flat),
    )


def _picked(array: Array, pick: NDArray[np.intp], finite: NDArray[np.bool_]) -> Array:
    values = np.full(len(pick), np.nan)
    values[finite] = array[pick[finite]]
    return values


def _fitted(pairs: Number, of: Made, sign: float, middle: Array, width: Array) -> Number:
    """A number made of rows, (row, entry, coefficient), as a polynomial about a spot of each entry."""
    basis = _basis(middle[:, None] + width[:, None] * POINTS)
    values = sign * of(linear(pairs, lambda array: np.einsum("rec,cen->ren", array, basis)))
    return linear(values, lambda array: array @ FIT.T)


def _narrowed(pairs: Array, of: Made, sign: float, first: tuple[Array, Array, Array]) -> tuple[Array, Array]:
    """Spots and widths about them within which a number is a polynomial, or that are very narrow: it may have a corner
    at its top, as the size of a vector that passes zero."""
    rows, middle, width = first
    middle, width, left = middle.copy(), width.copy(), np.arange(len(middle))
    for _ in range(NARROWED):
        size = ROUGH * np.max(np.abs(rows[:, 1:]), axis=1) + ROUNDING * np.abs(rows[:, 0])
        rough = np.max(np.abs(rows[:, -2:]), axis=1) > size
        left, rows = left[rough], rows[rough]
        if not len(left):
            break
        best = np.clip(np.argmax(rows @ ON_POINTS, axis=1), 1, ORDER - 2)
        low, high = (middle[left] + width[left] * POINTS[best + k] for k in (-1, 1))
        middle[left], width[left] = (low + high) / 2, (high - low) / 2
        rows = np.asarray(_fitted(pairs[:, left], of, sign, middle[left], width[left]))
    return middle, width


def _at(coefficients: Array, spot: Array) -> Array:
    """Values of polynomials, (entry, coefficient), each at its spot."""
    return np.asarray(np.einsum("ce,ec->e", _basis(spot), coefficients))


def _top(coefficients: Array) -> tuple[Array, Array, NDArray[np.bool_]]:
    """Spot and value of the largest value of polynomials that have one top, and whether they are level there."""
    lead = coefficients[:, :LEADING]  # what is about a top is a parabola and little more
    slope, bend = lead @ RATE[:LEADING, :LEADING], lead @ (RATE @ RATE)[:LEADING, :LEADING]
    spot = POINTS[np.argmax(coefficients @ ON_POINTS, axis=1)]
    for _ in range(NEWTONS):
        basis = _basis(spot, LEADING)
        rate, second = np.einsum("ce,ec->e", basis, slope), np.einsum("ce,ec->e", basis, bend)
        step = np.where(second < 0.0, -rate / np.where(second < 0.0, second, 1.0), np.sign(rate))
        spot = np.clip(spot + np.clip(step, -0.5, 0.5), -1.0, 1.0)
    level = (np.abs(spot) < 1.0) & (np.abs(step) < SETTLED)
    ends = coefficients @ ENDS
    value, at_ends = _at(coefficients, spot), np.max(ends, axis=1)
    spot = np.where(at_ends > value, np.where(ends[:, 1] >= ends[:, 0], 1.0, -1.0), spot)
    return spot, np.maximum(value, at_ends), level & (value >= at_ends)


def _basis(spot: Array, count: int = ORDER) -> Array:
    """Chebyshev polynomials at spots, one after the other along a new first axis."""
    basis = np.empty((count, *spot.shape))
    basis[0], basis[1] = 1.0, spot
    twice = 2.0 * spot
    for k in range(2, count):
        np.multiply(twice, basis[k - 1], out=basis[k])
        basis[k] -= basis[k - 2]
    return basis


# ---- shares above a level -------------------------------------------------------------------------------------


def above(coefficients: Number, level: float) -> Number:
    """How much of every panel, of the length 2 of its spots, a number, (lane, panel, coefficient), is above a level."""
    shifted = coefficients - level * (np.arange(ORDER) == 0)
    real = np.asarray(primal(shifted))
    slopes = np.broadcast_to(derivative(shifted), real.shape)
    share, moved = np.where(real[..., 0] >= 0.0, 2.0, 0.0), np.zeros(real.shape[:-1])
    for place in zip(*np.nonzero(np.abs(real[..., 0]) <= np.sum(np.abs(real[..., 1:]), axis=-1)), strict=True):
        series, inner = real[place], _roots(real[place])
        spots = np.concatenate([[-1.0], inner, [1.0]])
        up = chebyshev.chebval((spots[1:] + spots[:-1]) / 2, series) >= 0.0
        share[place] = np.sum(np.diff(spots)[up])
        passed = inner[up[1:] != up[:-1]]
        rates = np.abs(chebyshev.chebval(passed, series @ RATE))
        moved[place] = np.sum(chebyshev.chebval(passed, slopes[place]) / np.where(rates > 0.0, rates, np.nan))
    share = np.where(np.any(np.isnan(real), axis=-1), np.nan, share)
    return Dual(share, moved) if isinstance(shifted, Dual) else share


def _roots(series: Array) -> Array:
    """Where a polynomial passes or touches 0 inside its panel, rising."""
    trimmed = chebyshev.chebtrim(series, ROUNDING * np.max(np.abs(series)))
    roots = chebyshev.chebroots(trimmed) if len(trimmed) > 1 else np.zeros(0)
    spots = np.sort(np.real(roots[(np.abs(np.imag(roots)) <= DOUBLE) & (np.abs(np.real(roots)) < 1.0)]))
    slope = chebyshev.chebval(spots, series @ RATE)
    step = chebyshev.chebval(spots, series) / np.where(slope == 0.0, np.inf, slope)
    return np.sort(np.clip(spots - np.clip(step, -DOUBLE, DOUBLE), -1.0, 1.0))

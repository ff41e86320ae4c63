"""Loops that ask for more than their coordinates can give: least squares for motion and for reactions.

A planar four-bar drawn in space, Bennett's and Sarrus' linkages close although their equations outnumber their
coordinates. Newton's method then takes the step of least squares, and a position counts where the gap closes. Statics
does not tell what the redundant constraints add to the reactions. Those returned have the least elastic energy of the
joints, Σ F²/k + M²/κ (theorem of Castigliano and Menabrea): without stated stiffnesses every joint is as stiff as the
others across and along its axis, k, and against tilting κ = k h² of the two ends of its bearing at ±h. Real numbers
only: a small change of a dimension takes such a linkage apart, so there is no derivative, and dual parts are NaN.
"""

from __future__ import annotations

import functools
import operator
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple, cast

import numpy as np
from numpy.typing import NDArray

from trunnion.algebra.dual import Dual, primal
from trunnion.algebra.namespace import Number

Array = NDArray[np.float64]
RANK = 1e-7  # of the largest singular value: below it a direction counts as lost; rounding leaves some 1e-15


def stacked(matrix: Sequence[Sequence[Number]]) -> Array:
    """(lane, row, column) of a matrix whose entries broadcast over the lanes."""
    if not matrix[0]:
        return np.zeros((1, len(matrix), 0))
    flat = np.broadcast_arrays(*(np.asarray(primal(entry), float) for row in matrix for entry in row), np.zeros(1))[:-1]
    table = np.stack(flat, axis=-1)
    return cast(Array, table.reshape(*table.shape[:-1], len(matrix), len(matrix[0])))


def _finite(*tables: Array) -> tuple[NDArray[np.bool_], list[Array]]:
    """Lanes in which an entry is not finite, and the tables with 0 in these."""
    bad = np.asarray(~functools.reduce(operator.and_, (np.isfinite(table).all(axis=(-2, -1)) for table in tables)))
    return bad, [np.where(bad[..., None, None], 0.0, table) for table in tables]


def _rows(table: NDArray[Any], bad: NDArray[np.bool_], matrix: Sequence[Sequence[Number]]) -> list[list[Number]]:
    """A result as rows; NaN in bad lanes, and for its dual parts."""
    table[bad] = np.nan
    dual = any(isinstance(entry, Dual) for row in matrix for entry in row)
    rows = [[table[..., i, j] for j in range(table.shape[-1])] for i in range(table.shape[-2])]
    return [[Dual(entry, np.nan) for entry in row] for row in rows] if dual else rows


def pseudo_inverse(matrix: Sequence[Sequence[Number]]) -> list[list[Number]]:
    """J⁺ as rows; NaN where an entry is."""
    bad, (table,) = _finite(stacked(matrix))
    return _rows(np.linalg.pinv(table, rcond=RANK), bad, matrix)


def condition(matrix: Sequence[Sequence[Number]]) -> Array:
    """2/n √(Σ σ²) √(Σ 1/σ²) over the n singular values, ∞ where a freedom is not determined, NaN where an entry is."""
    bad, (table,) = _finite(stacked(matrix))
    values = np.linalg.svd(table, compute_uv=False)
    columns = table.shape[-1]
    with np.errstate(divide="ignore", invalid="ignore"):
        lost = (values[..., -1] <= RANK * values[..., 0]) | (values.shape[-1] < columns)
        number = 2 / columns * np.sqrt(np.sum(values**2, axis=-1) * np.sum(1 / values**2, axis=-1))
    return np.where(bad, np.nan, np.where(lost, np.inf, number))


def least_squares(matrix: Sequence[Sequence[Number]], side: Sequence[Number]) -> list[Number]:
    """x of least |A x − b|, and of those the shortest."""
    bad, (table, right) = _finite(stacked(matrix), stacked([[entry] for entry in side]))
    return [row[0] for row in _rows(np.linalg.pinv(table, rcond=RANK) @ right, bad, matrix)]


class Support(NamedTuple):
    """How a joint holds its second link: stiffness across and along its axis, N/m or relative, and against tilting.

    middle: of its bearing along the axis from the joint's point, m. arm: half the length of its bearing, m, which gives
    the stiffness against tilting where `tilting`, N m/rad, is None; None where nothing says how long it is.
    """

    radial: Number = 1.0
    axial: Number = 1.0
    tilting: Number | None = None
    arm: Number | None = None
    middle: Number = 0.0


def weighed(
    algebra: Any, wrenches: Sequence[Any], elements: Sequence[Any], supports: Sequence[Support], size: Number
) -> Array:
    """(lane, entry): forces and moments of all joints over the roots of the stiffnesses, whose squares are energies.

    A joint without a length has the shortest that is stated, and that of the size where none is.
    """
    arms = [support.arm for support in supports if support.arm is not None]
    shortest: Number = functools.reduce(np.minimum, arms) if arms else size
    rows: list[Number] = []
    for k, (_, second, *_) in enumerate(elements):
        support = supports[k] if k < len(supports) else Support()
        arm = shortest if support.arm is None else support.arm
        tilting = support.radial * arm * arm if support.tilting is None else support.tilting
        across, along, moments = algebra.on_axis(wrenches[k], second, support.middle)
        rows += [part / np.sqrt(support.radial) for part in across]
        rows += [part / np.sqrt(support.axial) for part in along]
        rows += [part / np.sqrt(tilting) for part in moments]
    flat = np.broadcast_arrays(*(np.asarray(primal(row), float) for row in rows), np.zeros(1))[:-1]
    return np.stack(flat, axis=-1)


def least(
    jacobian: Sequence[Sequence[Number]],
    reactions: Callable[[Sequence[Number], bool], Array],
    multipliers: Sequence[Number],
) -> list[Number]:
    """The multipliers of the least energy: λ + N y, with N the null space of Jᵀ and y by least squares.

    reactions(multipliers, loaded): (lane, entry), weighed, of all joints, with the loads of the links or without.
    """
    start = reactions(multipliers, True)
    count = len(multipliers)
    columns = []
    for j in range(count):
        unit = [1.0 if i == j else 0.0 for i in range(count)]
        columns.append(reactions(unit, False))
    shape = np.broadcast_shapes(start.shape, *(column.shape for column in columns))
    effect = np.stack([np.broadcast_to(column, shape) for column in columns], axis=-1)
    bad, (safe, _) = _finite(stacked(jacobian), start[..., None])
    project = np.eye(count) - safe @ np.linalg.pinv(safe, rcond=RANK)  # onto the null space of Jᵀ
    moves = np.where(bad[..., None, None], 0.0, effect @ project)
    target = np.where(bad[..., None], 0.0, np.broadcast_to(start, shape))
    change = (project @ np.linalg.pinv(moves, rcond=RANK) @ target[..., None])[..., 0]
    change = np.where(bad[..., None], np.nan, change)
    return [primal(value) - change[..., j] for j, value in enumerate(multipliers)]

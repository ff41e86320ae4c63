"""Loops that ask for more than their coordinates can give: least squares for motion and for reactions.

A planar four-bar drawn in space, Bennett's and Sarrus' linkages close although their equations outnumber their
coordinates. Newton's method then takes the step of least squares, and a position counts where the gap closes. Statics
does not tell what the redundant constraints add to the reactions; those returned are the smallest: the least sum of
squares of forces, and of moments at the joints over the size. Real numbers only: a small change of a dimension
takes such a linkage apart, so there is no derivative, and dual parts come out as NaN.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import cast

import numpy as np
from numpy.typing import NDArray

from trunnion.algebra.dual import Dual, primal
from trunnion.algebra.namespace import Number

__all__ = ["RANK", "condition", "least", "least_squares", "pseudo_inverse"]

Array = NDArray[np.float64]
RANK = 1e-7  # of the largest singular value: below it a direction counts as lost; rounding leaves some 1e-15


def stacked(matrix: Sequence[Sequence[Number]]) -> Array:
    """(lane, row, column) of a matrix whose entries broadcast over the lanes."""
    if not matrix[0]:
        return np.zeros((1, len(matrix), 0))
    flat = np.broadcast_arrays(*(np.asarray(primal(entry), float) for row in matrix for entry in row), np.zeros(1))[:-1]
    table = np.stack(flat, axis=-1)
    return cast(Array, table.reshape(*table.shape[:-1], len(matrix), len(matrix[0])))


def pseudo_inverse(matrix: Sequence[Sequence[Number]]) -> list[list[Number]]:
    """J⁺ as rows; NaN where an entry is."""
    table = stacked(matrix)
    bad = np.asarray(~np.isfinite(table).all(axis=(-2, -1)))
    found = np.linalg.pinv(np.where(bad[..., None, None], 0.0, table), rcond=RANK)
    found[bad] = np.nan
    dual = any(isinstance(entry, Dual) for row in matrix for entry in row)
    rows = [[found[..., i, j] for j in range(found.shape[-1])] for i in range(found.shape[-2])]
    return [[Dual(entry, np.nan) for entry in row] for row in rows] if dual else rows


def condition(matrix: Sequence[Sequence[Number]]) -> Array:
    """2/n √(Σ σ²) √(Σ 1/σ²) over the n singular values, ∞ where a freedom is not determined, NaN where an entry is."""
    table = stacked(matrix)
    bad = np.asarray(~np.isfinite(table).all(axis=(-2, -1)))
    values = np.linalg.svd(np.where(bad[..., None, None], 1.0, table), compute_uv=False)
    columns = table.shape[-1]
    with np.errstate(divide="ignore"):
        lost = (values[..., -1] <= RANK * values[..., 0]) | (values.shape[-1] < columns)
        found = 2 / columns * np.sqrt(np.sum(values**2, axis=-1) * np.sum(1 / values**2, axis=-1))
    return np.where(bad, np.nan, np.where(lost, np.inf, found))


def least_squares(matrix: Sequence[Sequence[Number]], side: Sequence[Number]) -> list[Number]:
    """x of least |A x − b|, and of those the shortest."""
    table = stacked(matrix)
    right = stacked([[entry] for entry in side])
    bad = np.asarray(~(np.isfinite(table).all(axis=(-2, -1)) & np.isfinite(right).all(axis=(-2, -1))))
    found = np.linalg.pinv(np.where(bad[..., None, None], 0.0, table), rcond=RANK) @ right
    found[bad] = np.nan
    dual = any(isinstance(entry, Dual) for row in matrix for entry in row)
    values = [found[..., i, 0] for i in range(found.shape[-2])]
    return [Dual(value, np.nan) for value in values] if dual else values


def least(
    jacobian: Sequence[Sequence[Number]],
    reactions: Callable[[Sequence[Number], bool], Array],
    multipliers: Sequence[Number],
) -> list[Number]:
    """The multipliers of the smallest reactions: λ + N y, with N the null space of Jᵀ and y by least squares.

    reactions(multipliers, loaded): (lane, entry), of all joints, with the loads of the links or without.
    """
    start = reactions(multipliers, True)
    count = len(multipliers)
    columns = []
    for j in range(count):
        unit = [1.0 if i == j else 0.0 for i in range(count)]
        columns.append(reactions(unit, False))
    shape = np.broadcast_shapes(start.shape, *(column.shape for column in columns))
    effect = np.stack([np.broadcast_to(column, shape) for column in columns], axis=-1)
    table = stacked(jacobian)
    bad = np.asarray(~(np.isfinite(table).all(axis=(-2, -1)) & np.isfinite(start).all(axis=-1)))
    safe = np.where(bad[..., None, None], 0.0, table)
    project = np.eye(count) - safe @ np.linalg.pinv(safe, rcond=RANK)  # onto the null space of Jᵀ
    moves = np.where(bad[..., None, None], 0.0, effect @ project)
    wanted = np.where(bad[..., None], 0.0, np.broadcast_to(start, shape))
    change = (project @ np.linalg.pinv(moves, rcond=RANK) @ wanted[..., None])[..., 0]
    change = np.where(bad[..., None], np.nan, change)
    return [primal(value) - change[..., j] for j, value in enumerate(multipliers)]

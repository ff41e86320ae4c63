"""Small dense systems, unrolled: the matrix is a list of rows whose entries broadcast over the whole batch.

An entry is any number of `algebra.namespace`, so dual numbers flow through a solve as through everything else.
`numpy.linalg.solve` on stacks is the oracle in the tests.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from trunnion.algebra.dual import primal
from trunnion.algebra.literal import is_zero, plus
from trunnion.algebra.namespace import Number, namespace

Vector = tuple[Number, Number]
Table = NDArray[np.float64]
SEVERAL, FEW_LANES = 4, 512  # rows from which, and lanes up to which whole rows are quicker
_SCALARS = frozenset({float, int, np.float64})


def dot(a: Vector, b: Vector) -> Number:
    """a · b of planar vectors."""
    return a[0] * b[0] + a[1] * b[1]


def cross(a: Vector, b: Vector) -> Number:
    """z component of a × b of planar vectors."""
    return a[0] * b[1] - a[1] * b[0]


def weighted(weights: Sequence[Number], values: Sequence[Number]) -> Number:
    """Σ wᵢ vᵢ; a literal zero costs nothing."""
    total: Number = 0.0
    for weight, value in zip(weights, values, strict=True):
        if not (is_zero(weight) or is_zero(value)):
            total = plus(total, weight * value)
    return total


def solve(matrix: Sequence[Sequence[Number]], *sides: Sequence[Number]) -> tuple[list[list[Number]], Number]:
    """Solutions x of A x = b for each right-hand side b in `sides`, by elimination with row pivoting per lane.

    matrix: n rows of n entries; sides: n entries each. Returns one list of n entries for each side, and det A.
    A singular lane comes out non-finite (a zero pivot divides), its determinant NaN or 0.
    """
    n = len(matrix)
    columns = n + len(sides)
    rows = [[*row, *(side[i] for side in sides)] for i, row in enumerate(matrix)]
    if (table := _table(rows)) is not None:
        return _solve_table(table)
    xp = namespace(*(entry for row in rows for entry in row))
    # Python's own numbers raise where NumPy's divide by zero quietly
    rows = [[np.float64(entry) if isinstance(entry, (int, float)) else entry for entry in row] for row in rows]
    product: Number = 1.0
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        for k in range(n):
            sign = _pivot(rows, k, columns, xp)
            product = product * sign * rows[k][k]
            for i in range(k + 1, n):
                factor = rows[i][k] / rows[k][k]
                for j in range(k + 1, columns):
                    rows[i][j] = rows[i][j] - factor * rows[k][j]
        solutions: list[list[Number]] = []
        for column in range(n, columns):
            x: list[Number] = [0.0] * n
            for i in reversed(range(n)):
                total = rows[i][column]
                for j in range(i + 1, n):
                    total = total - rows[i][j] * x[j]
                x[i] = total / rows[i][i]
            solutions.append(x)
    return solutions, product


def _table(rows: Sequence[Sequence[Number]]) -> Table | None:
    """Entries (row, column, …lanes) of several rows of plain numbers with few lanes; None of anything else.

    There calls cost more than numbers do, and whole rows are eliminated at a time. What is done to each number and in
    which order is the same as entry by entry, so that the bits do not depend on how many lanes there are.
    """
    if len(rows) < SEVERAL:
        return None
    entries = [entry for row in rows for entry in row]
    arrays = [entry for entry in entries if type(entry) is np.ndarray]
    plain = len(arrays) + sum(type(entry) in _SCALARS for entry in entries) == len(entries)
    if not plain or any(array.dtype != np.float64 for array in arrays):
        return None
    shapes = {array.shape for array in arrays}
    shape = shapes.pop() if len(shapes) == 1 else np.broadcast_shapes(*shapes)
    if math.prod(shape) > FEW_LANES:
        return None
    table = np.empty((len(rows), len(rows[0]), *shape))
    for i, row in enumerate(rows):
        for j, entry in enumerate(row):
            table[i, j] = entry
    return table


def _solve_table(table: Table) -> tuple[list[list[Number]], Number]:
    """`solve` of a table, the sides in its last columns."""
    n = len(table)
    product: Number = 1.0
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        for k in range(n):
            sign: Number = 1.0
            sizes = np.abs(table[k:, k])
            largest = sizes[0]
            for i in range(k + 1, n) if (sizes[1:] > largest).any() else ():  # the pivot, as in `_pivot`
                swap = sizes[i - k] > largest
                if not swap.any():
                    continue
                sign, largest = np.where(swap, -sign, sign), np.where(swap, sizes[i - k], largest)
                upper, lower = table[k, k:], table[i, k:]
                if swap.all():
                    table[k, k:], table[i, k:] = lower.copy(), upper.copy()
                else:
                    table[k, k:], table[i, k:] = np.where(swap, lower, upper), np.where(swap, upper, lower)
            product = product * sign * table[k, k]
            factor = table[k + 1 :, k] / table[k, k]
            table[k + 1 :, k + 1 :] -= factor[:, None] * table[k, k + 1 :]
        x = np.empty_like(table[:, n:])
        for i in reversed(range(n)):
            total = table[i, n:]
            for j in range(i + 1, n):
                total = total - table[i, j] * x[j]
            x[i] = total / table[i, i]
    return [[x[i, side] for i in range(n)] for side in range(table.shape[1] - n)], product


def _pivot(rows: list[list[Number]], k: int, columns: int, xp: Number) -> Number:
    """Bring the largest entry of column k from row k on into row k, lane by lane; −1 for an odd number of swaps."""
    sign: Number = 1.0
    for i in range(k + 1, len(rows)):
        swap = np.abs(primal(rows[i][k])) > np.abs(primal(rows[k][k]))
        if not np.any(swap):
            continue
        sign = np.where(swap, -sign, sign)
        everywhere = bool(np.all(swap))
        for j in range(k, columns):
            upper, lower = rows[k][j], rows[i][j]
            if everywhere:
                rows[k][j], rows[i][j] = lower, upper
            else:
                rows[k][j], rows[i][j] = xp.where(swap, lower, upper), xp.where(swap, upper, lower)
    return sign


def inverse(matrix: Sequence[Sequence[Number]]) -> tuple[list[list[Number]], Number]:
    """A⁻¹ as rows, and det A, by elimination with row pivoting per lane; non-finite where a lane is singular."""
    n = len(matrix)
    columns, determinant = solve(matrix, *([1.0 if i == j else 0.0 for i in range(n)] for j in range(n)))
    return [[columns[j][i] for j in range(n)] for i in range(n)], determinant

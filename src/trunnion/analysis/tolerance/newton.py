"""The last digits of a convex allocation: Newton's method on its optimality conditions, and the proof.

With multipliers λ ≥ 0 of the active sides, L(u) = cost(u) + Σ λ_k (g_k(u) − 1) is convex and below the cost wherever
the limits are kept. So cost* ≥ L(û) + min over the box of ∇L(û)·(u − û): the bound behind the gap.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from trunnion.analysis.tolerance.task import Task

__all__ = ["Point", "polished"]

Array = NDArray[np.float64]
Rows = NDArray[np.intp]
STEPS = 30
CHANGES = 60  # of the set of active sides and bounds
SMALL = 1e-13  # relative step at which Newton's method has arrived
BEYOND = 1e-12  # of a limit: a side that is broken
NEGATIVE = -1e-11  # of the largest slope: a multiplier of the wrong sign


@dataclass(frozen=True)
class Point:
    """Where the conditions hold: unknowns u, active sides with their multipliers, how well, and the proof.

    scale: the part of the cost that tolerances change; residual: of stationarity, relative to the largest slope, and of
    the active sides; gap: cost minus its lower bound, in units of scale.
    """

    u: Array
    rows: Rows
    weights: Array
    residual: float
    gap: float
    scale: float
    rounds: int = 0


def polished(task: Task, u: Array, rows: Rows, weights: Array) -> Point:
    """The optimum from a point close to it; the better of the two if the set of active sides is not found."""
    low, high = task.low, task.high
    first = point_of(task, np.clip(u, low, high), rows, weights)
    u = np.clip(u, low, high)
    held = _at_bound(task, u)
    for _ in range(CHANGES):
        u, weights = _newton(task, u, rows, weights, held == 0)
        change = _change(task, u, rows, weights, held)
        if change is None:
            break
        u, rows, weights, held = change
    last = point_of(task, u, rows, np.maximum(weights, 0.0))
    kept = bool(np.all(task.sides.value(task.tolerances(last.u)) <= 1 + 1e-10))
    return last if kept and last.gap <= first.gap else first


def point_of(task: Task, u: Array, rows: Rows, weights: Array) -> Point:
    """A point with its residual and gap."""
    t = task.tolerances(u)
    slope, jacobian = task.slope(u), task.sides.gradient(t, rows) @ task.spans * task.unit
    over = task.sides.value(t, rows) - 1
    lagrange = slope + weights @ jacobian
    low, high = task.low, task.high
    scale = float(np.sum(np.abs(slope * u))) or 1.0
    with np.errstate(invalid="ignore"):
        rise = np.where(lagrange > 0, lagrange * (low - u), np.where(lagrange < 0, lagrange * (high - u), 0.0))
    gap = -(float(weights @ over) + float(np.sum(rise))) / scale
    largest = float(np.max(np.abs(slope), initial=0.0)) or 1.0
    edge = ((u <= low * (1 + 1e-9)) & (lagrange > 0)) | ((u >= high * (1 - 1e-9)) & (lagrange < 0))
    residual = max(
        float(np.max(np.abs(np.where(edge, 0.0, lagrange)), initial=0.0)) / largest,
        float(np.max(np.abs(over * (weights > 0)), initial=0.0)),
        float(np.max(task.sides.value(t), initial=0.0)) - 1.0,
    )
    return Point(u, rows, weights, residual, gap, scale)


def _at_bound(task: Task, u: Array) -> NDArray[np.int8]:
    """-1 at the lower bound, 1 at the upper, 0 between."""
    near = 1e-5 * np.maximum(np.abs(u), 1e-3)
    return np.where(u <= task.low + near, -1, np.where(u >= task.high - near, 1, 0)).astype(np.int8)


def _newton(task: Task, u: Array, rows: Rows, weights: Array, free: NDArray[np.bool_]) -> tuple[Array, Array]:
    """Newton's method with these sides active and the other unknowns at their bounds."""
    u = np.where(free, u, np.where(np.abs(u - task.low) <= np.abs(u - task.high), task.low, task.high))
    for _ in range(STEPS):
        t = task.tolerances(u)
        jacobian = (task.sides.gradient(t, rows) @ task.spans * task.unit)[:, free]
        bend = task.spans.T @ task.sides.curvature(t, weights, rows) @ task.spans * np.outer(task.unit, task.unit)
        whole = (bend + np.diag(task.curvature(u)))[np.ix_(free, free)]
        slope = task.slope(u)[free]
        size = float(np.max(np.abs(slope), initial=0.0)) or 1.0
        count, limits = len(slope), len(rows)
        matrix = np.zeros((count + limits, count + limits))
        matrix[:count, :count], matrix[:count, count:], matrix[count:, :count] = whole / size, jacobian.T, jacobian
        right = -np.concatenate([slope / size, task.sides.value(t, rows) - 1])
        step = np.linalg.lstsq(matrix, right, rcond=None)[0]
        weights = size * step[count:]
        move = step[:count]
        shrink = np.max(-move / (0.9 * u[free]), initial=0.0) if count else 0.0
        u = u.copy()
        u[free] += move / max(1.0, shrink)
        if np.max(np.abs(move) / np.maximum(np.abs(u[free]), 1e-300), initial=0.0) < SMALL:
            break
    return u, weights


def _change(
    task: Task, u: Array, rows: Rows, weights: Array, held: NDArray[np.int8]
) -> tuple[Array, Rows, Array, NDArray[np.int8]] | None:
    """What to begin again with: a side to drop or to add, a bound to hold or to leave; None if nothing is wrong."""
    t, slope = task.tolerances(u), task.slope(u)
    largest = float(np.max(np.abs(slope), initial=0.0)) or 1.0
    if len(weights) and np.min(weights) < NEGATIVE * largest:
        stay = np.arange(len(rows)) != int(np.argmin(weights))
        return u, rows[stay], weights[stay], held
    beyond = np.maximum(task.low - u, u - task.high) / np.maximum(np.abs(u), 1e-300)
    if len(u) and np.max(beyond) > BEYOND:
        g = int(np.argmax(beyond))
        held = held.copy()
        held[g] = -1 if u[g] < task.low[g] else 1
        return np.clip(u, task.low, task.high), rows, weights, held
    over = task.sides.value(t) - 1
    over[rows] = -1.0
    if len(over) and np.max(over) > BEYOND:
        k = int(np.argmax(over))
        return u, np.append(rows, k), np.append(weights, 0.0), held
    lagrange = slope + weights @ (task.sides.gradient(t, rows) @ task.spans * task.unit)
    wrong = np.where(held != 0, held * lagrange, -np.inf) / largest
    if len(u) and np.max(wrong) > 1e-10:
        held = held.copy()
        held[int(np.argmax(wrong))] = 0
        return u, rows, weights, held
    return None

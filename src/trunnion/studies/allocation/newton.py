"""The last digits of a convex allocation, and the proof: Newton's method, each step a quadratic program of Clarabel.

The cone solver leaves half widths open by some 1e-5 of the largest where costs are flat. A step is the least of the
Lagrange function to second order, with the sides as planes (R. B. Wilson, A simplicial algorithm for concave
programming, thesis, Harvard 1963); on the sides that hold in it, linear equations take away what the solver leaves.

The proof needs no method. With any λ ≥ 0, L(u) = cost(u) + Σ λ_k (g_k(u) − 1) is convex and below the cost wherever the
limits are kept. So cost* ≥ L(û) + min over the box of ∇L(û)·(u − û): that is the bound behind the gap.
"""

from __future__ import annotations

from dataclasses import replace

import clarabel
import numpy as np
from numpy.typing import NDArray

from trunnion.studies.allocation.cones import Optimum, Rows, solver
from trunnion.studies.allocation.task import Task

__all__ = ["judged", "sharpened", "within"]

Array = NDArray[np.float64]
NEAR = 0.9  # of a limit: sides above it are looked at
STEP = 1e-5  # of an unknown: differences of slopes give second derivatives
STAY = 0.1  # of an unknown is kept in any step: costs may be infinite at 0
SMALL = 1e-2  # an unknown below it may go to its bound at once
FINE = {  # of Clarabel: what plain quadratic programs allow
    "tol_gap_abs": 1e-14,
    "tol_gap_rel": 1e-14,
    "tol_feas": 1e-14,
    "static_regularization_constant": 1e-12,
    "iterative_refinement_abstol": 1e-16,
    "iterative_refinement_reltol": 1e-16,
}


def sharpened(task: Task, point: Optimum) -> Optimum:
    """The point one step on, with its gap: of the program's own and the refined one the better."""
    u, count, scale = point.u, len(point.u), task.scale(point.u)
    value = task.sides.value(task.tolerances(u))
    rows = np.flatnonzero(value > NEAR)
    moves = STEP * np.where(u > 0, u, 1.0)
    rise = [_slope(task, u + move, point) - _slope(task, u - move, point) for move in np.diag(moves)]
    bend, slope = np.array(rise) / (2 * scale * moves[:, None]), task.slope(u) / scale
    bend = (bend + bend.T) / 2
    planes = np.concatenate([-np.eye(count), np.eye(count), _jacobian(task, u, rows)])
    floor = np.maximum(task.low, np.where(u > SMALL, STAY * u, 0.0))
    room = np.concatenate([u - floor, task.high - u, 1 - value[rows]])
    found = solver(bend, slope, planes, room, [clarabel.NonnegativeConeT(len(room))], **FINE).solve()
    x, z = np.asarray(found.x), np.asarray(found.z)
    held = z > np.asarray(found.s)  # of slack and multiplier one is 0
    z, active = np.where(held, z, 0.0), planes[held]
    matrix = np.block([[bend, active.T], [active, np.zeros((len(active), len(active)))]])
    missed = np.concatenate([slope + bend @ x + z @ planes, active @ x - room[held]])
    more = np.linalg.lstsq(matrix, -missed, rcond=None)[0]
    exact = z.copy()
    exact[held] = np.maximum(z[held] + more[count:], 0.0)
    points = []
    low, high, sides = held[:count], held[count : 2 * count], held[2 * count :]
    for ahead, weights in ((u + x, z), (u + x + more[:count], exact)):
        ahead = np.where(low, floor, np.where(high, task.high, np.clip(ahead, floor, task.high)))
        ahead = ahead if np.isfinite(task.cost(ahead)) else (u + ahead) / 2
        points.append(replace(point, u=ahead, rows=rows[sides], weights=scale * weights[2 * count :][sides]))
    return min((judged(task, one) for one in points), key=lambda one: one.gap)


def judged(task: Task, point: Optimum) -> Optimum:
    """The point with the gap that it has within the limits."""
    u = within(task, point.u)
    slope, room = _slope(task, u, point), 1 - task.sides.value(task.tolerances(u), point.rows)
    fall = np.where(slope > 0, slope * (u - task.low), slope * (u - task.high))
    return replace(point, gap=max(float(point.weights @ room + np.sum(fall)), 0.0) / task.scale(u))


def within(task: Task, u: Array) -> Array:
    """The same brought back within the limits, which a solver keeps to its tolerance only."""
    over, least = (np.max(task.sides.value(task.tolerances(one)), initial=0.0) for one in (u, task.low))
    if over <= 1 or least >= 1:
        return u
    return task.low + (1 - least) / (over - least) * (u - task.low)  # on a line to the least the sides are convex


def _slope(task: Task, u: Array, point: Optimum) -> Array:
    """∂L/∂u with the multipliers of the point, (unknown,)."""
    return np.asarray(task.slope(u) + point.weights @ _jacobian(task, u, point.rows), float)


def _jacobian(task: Task, u: Array, rows: Rows) -> Array:
    """∂g/∂u, (side, unknown)."""
    return np.asarray(task.sides.gradient(task.tolerances(u), rows) @ task.spans * task.unit, float)

"""The last digits of a convex allocation: Newton's method on its optimality conditions, and the proof.

The conditions are taken with s_j λ_j = μ in place of 0 (slack times multiplier, of limits and of bounds) and μ is led
to 0: a primal-dual interior-point method, with the predictor of S. Mehrotra, On the implementation of a primal-dual
interior point method, SIAM Journal on Optimization 2 (1992) 575–601. It works on the costs as they are, not on cones.
By hand, because Clarabel's own answer leaves half widths open by up to 1e-3 of the largest where costs are flat.

The proof needs no method. With any λ ≥ 0, L(u) = cost(u) + Σ λ_k (g_k(u) − 1) is convex and below the cost wherever the
limits are kept. So cost* ≥ L(û) + min over the box of ∇L(û)·(u − û): that is the bound behind the gap.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from trunnion.studies.allocation.task import Task

__all__ = ["Optimum", "polished"]

Array = NDArray[np.float64]
Rows = NDArray[np.intp]
STEPS = 60
LEAST = 1e-17  # slack or multiplier that is kept, in units of a limit and of the cost
ENOUGH = 1e-14  # gap at which there is nothing left to gain
CLEAR = 1e-3  # of an unknown: how far from its bounds the method begins
NEAR = 0.9  # of a limit: sides above it are looked at
MOST = 200  # sides looked at
AT_ONCE = 16  # broken sides added at once
BEYOND = 1e-12  # of a limit: a side that is broken
NOTHING = 1e-13  # of the cost: a multiplier that is left of the method
SAME = 1e-11  # of the upper bound: at the lower bound
STAY = 1e-3  # of an unknown is kept in any step: costs may be infinite at 0
HALVINGS = 12  # of a step that leads away
FRACTION = 0.995  # of the way to where a slack or multiplier would be 0


@dataclass(frozen=True)
class Optimum:
    """Where the conditions hold: unknowns u, sides with their multipliers, how well, and the proof.

    scale: the part of the cost that tolerances change; residual: of stationarity, relative to the largest slope, of
    complementarity and of the limits; gap: cost minus its lower bound, in units of scale.
    """

    u: Array
    rows: Rows
    weights: Array
    residual: float
    gap: float
    scale: float
    rounds: int = 0


def polished(task: Task, u: Array, rows: Rows, weights: Array) -> Optimum:
    """The optimum from a point near it; the best point known if Newton's method does not arrive."""
    value = task.sides.value(task.tolerances(u))
    near = np.argsort(-value, kind="stable")[:MOST]
    more = np.setdiff1d(near[value[near] > NEAR], rows)
    rows, weights = np.concatenate([rows, more]), np.concatenate([weights, np.zeros(len(more))])
    best = point_of(task, _kept(task, np.clip(u, task.low, task.high)), rows, weights)
    while True:
        point = _led(task, u, rows, weights)
        over = task.sides.value(task.tolerances(point.u)) - 1
        over[rows] = 0.0
        if np.max(over, initial=0.0) <= BEYOND:
            weights = np.where(point.weights > NOTHING * point.scale, point.weights, 0.0)
            u = np.where(point.u - task.low < SAME * task.high, task.low, point.u)
            u = u if np.isfinite(task.cost(u)) else point.u
            kept = point_of(task, _kept(task, u), point.rows, weights)
            return min(best, kept, key=lambda one: one.gap)
        broken = np.argsort(-over, kind="stable")[:AT_ONCE]
        broken = broken[over[broken] > BEYOND]
        rows, weights = np.append(rows, broken), np.append(point.weights, np.zeros(len(broken)))


def point_of(task: Task, u: Array, rows: Rows, weights: Array) -> Optimum:
    """A point with its residual and gap."""
    t = task.tolerances(u)
    slope, jacobian = task.slope(u), _jacobian(task, t, rows)
    over = task.sides.value(t, rows) - 1
    lagrange = slope + weights @ jacobian
    scale = task.scale(u)
    rise = np.where(lagrange > 0, lagrange * (task.low - u), lagrange * (task.high - u))
    largest = float(np.max(np.abs(slope), initial=0.0)) or 1.0
    room = np.where(lagrange > 0, u - task.low, task.high - u) / np.maximum(task.high - task.low, 1e-300)
    residual = max(
        float(np.max(np.minimum(np.abs(lagrange) / largest, room), initial=0.0)),
        float(np.max(weights * np.abs(over), initial=0.0)) / scale,
        float(np.max(task.sides.value(t), initial=0.0)) - 1.0,
    )
    return Optimum(u, rows, weights, residual, -(float(weights @ over) + float(np.sum(rise))) / scale, scale)


def _kept(task: Task, u: Array) -> Array:
    """The same brought back within the limits, where that is a matter of rounding or of a solver's tolerance."""
    over = float(np.max(task.sides.value(task.tolerances(u)), initial=0.0)) - 1
    if not 0 < over < CLEAR:
        return u
    least = float(np.max(task.sides.value(task.tolerances(task.low)), initial=0.0))
    share = (1 - least) / (1 + over - least) if least < 1 else 1.0  # on a line to the least the sides are convex
    return task.low + share * (u - task.low)


def _jacobian(task: Task, t: Array, rows: Rows) -> Array:
    """∂g/∂u, (side, unknown)."""
    return np.asarray(task.sides.gradient(t, rows) @ task.spans * task.unit, float)


class _State:
    """Cost, limits and bounds at a point: everything as c(u) ≤ 0, rows first, then lower and upper bounds."""

    def __init__(self, task: Task, u: Array, rows: Rows, scale: float) -> None:
        t, one = task.tolerances(u), np.eye(len(u))
        self.over = np.concatenate([task.sides.value(t, rows) - 1, task.low - u, u - task.high])
        self.jacobian = np.concatenate([_jacobian(task, t, rows), -one, one])
        self.slope = task.slope(u) / scale

    @staticmethod
    def bend(task: Task, u: Array, rows: Rows, weights: Array, scale: float) -> Array:
        """Second derivative of the Lagrange function."""
        inner = task.sides.curvature(task.tolerances(u), weights[: len(rows)], rows)
        own = task.spans.T @ inner @ task.spans * np.outer(task.unit, task.unit)
        return np.asarray(own + np.diag(task.curvature(u) / scale), float)


def _led(task: Task, u: Array, rows: Rows, weights: Array) -> Optimum:
    """The path of the method from a point near the optimum; the point of least gap on it."""
    gap = task.high - task.low
    u = np.clip(u, task.low + np.minimum(CLEAR * np.maximum(u, CLEAR), 0.4 * gap), task.high - CLEAR * gap)
    scale = task.scale(u)
    state = _State(task, u, rows, scale)
    slack = np.maximum(-state.over, CLEAR)
    slack[len(rows) :] = -state.over[len(rows) :]
    slack = np.maximum(slack, 1e-12)
    lamda = np.maximum(np.concatenate([weights / scale, np.zeros(2 * len(u))]), CLEAR)
    best: Optimum | None = None
    for _ in range(STEPS):
        aim = float(slack @ lamda) / len(slack)
        bend = _State.bend(task, u, rows, lamda, scale)
        move = _step(state, bend, slack, lamda, np.zeros(len(slack)))
        reach = _reach(slack, lamda, move, 1.0)
        ahead = float((slack + reach * move[1]) @ (lamda + reach * move[2])) / len(slack)
        target = (ahead / aim) ** 3 * aim if aim > 0 else 0.0
        move = _step(state, bend, slack, lamda, np.full(len(slack), target) - move[1] * move[2])
        reach = _reach(slack, lamda, move, max(FRACTION, 1 - aim))
        missed = _missed(state, slack, lamda, target)
        for _ in range(HALVINGS):
            ahead_u = np.maximum(u + reach * move[0], STAY * u)
            ahead_s = np.maximum(slack + reach * move[1], LEAST)
            ahead_l = np.maximum(lamda + reach * move[2], LEAST)
            ahead_state = _State(task, ahead_u, rows, scale)
            if _missed(ahead_state, ahead_s, ahead_l, target) <= max(missed, 1e-9):
                break
            reach /= 2
        u, slack, lamda, state = ahead_u, ahead_s, ahead_l, ahead_state
        point = point_of(task, u, rows, lamda[: len(rows)] * scale)
        broken = point.residual > 1 or not np.all(np.isfinite(u))
        if not broken and (best is None or max(point.gap, point.residual) < max(best.gap, best.residual)):
            best = point
        if best and (max(abs(best.gap), best.residual) < ENOUGH or aim < LEAST):
            break
    return best or point_of(task, u, rows, weights)


def _step(state: _State, bend: Array, slack: Array, lamda: Array, target: Array) -> tuple[Array, Array, Array]:
    """Newton's step of u, slack and multiplier towards slack · multiplier = target."""
    count, limits = len(bend), len(slack)
    matrix = np.zeros((count + limits, count + limits))
    matrix[:count, :count], matrix[:count, count:], matrix[count:, :count] = bend, state.jacobian.T, state.jacobian
    matrix[range(count, count + limits), range(count, count + limits)] = -slack / lamda
    first = -(state.slope + lamda @ state.jacobian)
    second = -(state.over + target / lamda)
    found = np.linalg.solve(matrix, np.concatenate([first, second]))
    du, dl = found[:count], found[count:]
    return du, -(state.over + slack) - state.jacobian @ du, dl


def _missed(state: _State, slack: Array, lamda: Array, target: float) -> float:
    """How far the conditions with slack · multiplier = target are from being met."""
    first, second = state.slope + lamda @ state.jacobian, state.over + slack
    return float(np.sqrt(first @ first + second @ second + np.sum((slack * lamda - target) ** 2)))


def _reach(slack: Array, lamda: Array, move: tuple[Array, Array, Array], fraction: float) -> float:
    """How far a step may go with slacks and multipliers above 0."""
    down = max(float(np.max(-move[1] / slack, initial=0.0)), float(np.max(-move[2] / lamda, initial=0.0)))
    return min(1.0, fraction / down) if down > 0 else 1.0

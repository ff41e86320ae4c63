"""An allocation as a conic program: power and exponential cones for costs, second-order cones for RSS rows.

P. J. Goulart and Y. Chen, Clarabel: an interior-point solver for conic programs with quadratic objectives,
arXiv:2405.12762
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any

import clarabel
import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from trunnion.statistics.costs import COST_MODELS
from trunnion.studies.allocation.task import Task

__all__ = ["Optimum", "Rows", "settled", "solver"]

Array = NDArray[np.float64]
Rows = NDArray[np.intp]
SOUND = ("Solved", "AlmostSolved", "InsufficientProgress")
CLOSE = 1e-4  # residuals of an answer that goes into Newton's method; the proof is of what comes out
BROKEN = 1e-7  # of a limit: a row to add
ACTIVE = 1e-6  # of the largest multiplier: a side that limits
AT_ONCE = 16  # rows added in one round


@dataclass
class _Cones:
    """Blocks A x + s = b, s in cones, as they are gathered."""

    columns: int
    blocks: list[Array] = field(default_factory=list)
    right: list[Array] = field(default_factory=list)
    cones: list[Any] = field(default_factory=list)
    rows: int = 0

    def add(self, cone: Any, block: Array, right: Array) -> int:
        """One block of rows, its last columns 0 where it is narrow; the number of its first row."""
        whole = np.zeros((len(right), self.columns))
        whole[:, : block.shape[1]] = block
        self.blocks.append(whole)
        self.right.append(right)
        self.cones.append(cone)
        self.rows += len(right)
        return self.rows - len(right)


@dataclass(frozen=True)
class Optimum:
    """Unknowns u, the sides that hold them with their multipliers, and how good they are.

    gap: cost from its lower bound, in units of the cost that tolerances change; wider: the share by which all limits
    had to be widened; rounds: of the solver.
    """

    u: Array
    rows: Rows
    weights: Array
    wider: float = 0.0
    gap: float = np.nan
    rounds: int = 0


def settled(task: Task, relaxed: bool = False) -> Optimum | None:
    """The point of least cost; None if the solver did not come to an end.

    Sides that the answer breaks are added until there is none: thousands of rows cost little.
    relaxed: the least share by which all limits have to be widened, in place of the least cost.
    """
    rows, rounds = _first(task), 0
    while True:
        point = _solved(task, rows, relaxed)
        rounds += 1
        if point is None:
            return None
        value = task.sides.value(task.tolerances(point.u)) - point.wider
        value[rows] = 0.0
        broken = np.flatnonzero(value > 1 + BROKEN)
        if not len(broken):
            break
        rows = np.concatenate([rows, broken[np.argsort(-value[broken], kind="stable")[:AT_ONCE]]])
    return replace(point, rounds=rounds)


def _first(task: Task) -> Rows:
    """Sides to begin with: for each unknown the one that bounds it most, and the nearest at the start."""
    t = task.tolerances(np.ones(len(task.unit)))
    steep = task.sides.gradient(t) @ task.spans
    picked = {int(np.argmax(column)) for column in steep.T} if len(steep) else set()
    picked |= {int(k) for k in np.argsort(-task.sides.value(t), kind="stable")[:4]}
    return np.array(sorted(picked), np.intp)


def _solved(task: Task, rows: Rows, relaxed: bool) -> Optimum | None:
    """What the solver finds with these sides alone."""
    count, priced = len(task.unit), [] if relaxed else task.costs
    cones = _Cones(count + len(priced) + int(relaxed))
    bounds, right = np.concatenate([-np.eye(count), np.eye(count)]), np.concatenate([-task.low, task.high])
    stated = np.isfinite(right)
    if stated.any():
        cones.add(clarabel.NonnegativeConeT(int(stated.sum())), bounds[stated], right[stated])
    firsts = [_side(task, int(k), cones, relaxed) for k in rows]
    aim, scale = np.zeros(cones.columns), 1.0
    if relaxed:
        aim[-1] = 1.0
        cones.add(clarabel.NonnegativeConeT(1), -np.eye(cones.columns)[-1:], np.zeros(1))
    else:
        shares = [_epigraph(task, place, cones) for place in range(len(priced))]
        scale = sum(shares) or 1.0
        aim[count:] = np.array(shares) / scale
    nothing, whole = np.zeros((cones.columns, cones.columns)), np.vstack(cones.blocks)
    found = solver(nothing, aim, whole, np.concatenate(cones.right), cones.cones).solve()
    if str(found.status) not in SOUND or found.r_prim > CLOSE or found.r_dual > CLOSE:
        return None
    x, weights = np.asarray(found.x), scale * np.maximum(np.asarray(found.z)[firsts], 0.0)
    active = weights > ACTIVE * np.max(weights, initial=0.0)
    wider = float(x[-1]) if relaxed else 0.0
    return Optimum(np.clip(x[:count], task.low, task.high), rows[active], weights[active], wider)


def _side(task: Task, k: int, cones: _Cones, relaxed: bool) -> int:
    """The cone of one side: (1 − linear·t, K (spread ∘ t)), or its first component ≥ 0 alone."""
    sides = task.sides
    span = task.spans * task.unit
    head = np.zeros((1, cones.columns))
    head[0, : len(task.unit)] = sides.linear[k] @ span
    if relaxed:
        head[0, -1] = -1.0
    first = np.array([1.0 - sides.linear[k] @ task.base])
    across = np.diag(sides.spread[k]) if sides.factor is None else sides.factor * sides.spread[k]
    across = across[np.any(across != 0, axis=1)]
    if not len(across):
        return cones.add(clarabel.NonnegativeConeT(1), head, first)
    tail = np.zeros((len(across), cones.columns))
    tail[:, : len(task.unit)] = -across @ span
    right = np.concatenate([first, across @ task.base])
    return cones.add(clarabel.SecondOrderConeT(len(right)), np.vstack([head, tail]), right)


def _epigraph(task: Task, place: int, cones: _Cones) -> float:
    """The cone of one cost, z ≥ u^−k or z ≥ exp(−k u), and what z costs."""
    g, cost = task.costs[place]
    given = {name: one.default for name, one in COST_MODELS[cost.model].parameters.items()} | dict(cost.parameters)
    k, ratio = float(given["k"] or 0.0), float(task.unit[g] / (given["unit"] or 1.0))
    column = len(task.unit) + place
    block, right = np.zeros((3, cones.columns)), np.zeros(3)
    if COST_MODELS[cost.model].cone == "power":  # z^α u^(1−α) ≥ 1 with α = 1/(1 + k)
        block[0, column] = block[1, g] = -1.0
        right[2] = 1.0
        cones.add(clarabel.PowerConeT(1 / (1 + k)), block, right)
        return float((given["B"] or 0.0) * ratio**-k)
    block[0, g], block[2, column], right[1] = k * ratio, -1.0, 1.0  # 1 · exp(−k u / 1) ≤ z
    cones.add(clarabel.ExponentialConeT(), block, right)
    return float(given["B"] or 0.0)


def solver(square: Array, aim: Array, whole: Array, right: Array, cones: list[Any], **settings: float) -> Any:
    """Least ½ x·square·x + aim·x with right − whole x in the cones; settings: other than Clarabel's own."""
    chosen = clarabel.DefaultSettings()
    for name, value in ({"verbose": False} | settings).items():
        setattr(chosen, name, value)
    upper, rows = sparse.csc_matrix(np.triu(square)), sparse.csc_matrix(whole)
    return clarabel.DefaultSolver(upper, aim, rows, right, cones, chosen)

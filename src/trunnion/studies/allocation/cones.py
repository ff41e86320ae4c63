"""Least cost over half widths that may be anything between bounds: a conic program, solved by Clarabel.

Costs are power and exponential cones, rows with a root of squares are second-order cones. The solver also finds a
point of the dual problem, whose value no allocation undercuts: that is the lower bound of the cost.

P. J. Goulart and Y. Chen, Clarabel: an interior-point solver for conic programs with quadratic objectives,
arXiv:2405.12762
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import clarabel
import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from trunnion.errors import Finding
from trunnion.statistics.costs import COST_MODELS
from trunnion.studies.allocation.problem import AllocationProblem, Answer, none, optimum, shortfalls
from trunnion.studies.allocation.task import Task, sides, task_of

__all__ = ["Optimum", "allocate_continuous", "minimise", "unbounded"]

Array = NDArray[np.float64]
Rows = NDArray[np.intp]
ACCEPTED = ("Solved", "AlmostSolved", "InsufficientProgress")
TOLERANCE = 1e-12  # of the solver, far below what its own gap is held to
RESIDUAL = 1e-4  # of the solver's equations: above it its point is none; the gap is that of the point brought back
BROKEN = 1e-9  # of a limit: a side to add
ACTIVE = 1e-6  # of the largest multiplier: a side that limits
ADDED = 16  # sides that one round adds


@dataclass(frozen=True)
class Optimum:
    """Unknowns u, the sides that hold them, with their multipliers, and the lower bound of the cost.

    gap: cost minus bound, as a share of the cost that tolerances change; wider: the share by which all limits had to
    be widened; rounds: how often the solver was called.
    """

    u: Array
    rows: Rows
    multipliers: Array
    bound: float
    gap: float
    wider: float = 0.0
    rounds: int = 0


def allocate_continuous(problem: AllocationProblem) -> Answer:
    """The half widths of least cost where all costs are formulas, or why there are none."""
    task = task_of(problem, sides(problem))
    early = shortfalls(problem, task.tolerances(task.low)) if np.any(task.sides.room < 0) else []
    trouble = early or unbounded(task) or _unmet(problem, task)
    if trouble:
        return none(problem, trouble)
    point = minimise(task)
    if point is None:
        what = "the solver found no allocation, although the limits may be feasible"
        remedy = "check the orders of magnitude of costs and bounds"
        return none(problem, [Finding.error("allocation.not_found", "costs", what, remedy)])
    tolerances = task.tolerances(point.u)
    price = np.zeros(len(problem.effects.worst))
    np.add.at(price, task.sides.row[point.rows], point.multipliers / task.sides.room[point.rows])
    costs = problem.costs(tolerances)
    return optimum(problem, tolerances, costs, point.bound, point.gap, price, point.rounds, {})


def unbounded(task: Task) -> list[Finding]:
    """Tolerances that neither a limit nor a bound holds."""
    what, free = "no limit bounds this tolerance, and wider is cheaper", np.flatnonzero(~np.isfinite(task.most))
    return [Finding.error("allocation.unbounded", f"costs.{task.names[g]}", what, "state `most`") for g in free]


def _unmet(problem: AllocationProblem, task: Task) -> list[Finding]:
    """Why no half widths keep the limits; empty if some do."""
    least = task.tolerances(task.low)
    if task.sides.rising or not np.all(task.sides.room > 0):
        return shortfalls(problem, least)
    if np.all(task.sides.value(least) <= 1):
        return []
    nearest = minimise(task, relaxed=True)
    return shortfalls(problem, task.tolerances(nearest.u)) if nearest else []


def minimise(task: Task, relaxed: bool = False) -> Optimum | None:
    """The point of least cost; None if the solver did not come to an end.

    Sides that the point breaks are added until there is none: so thousands of rows cost little.
    relaxed: the least share by which all limits have to be widened, in place of the least cost.
    """
    start = task.tolerances(np.ones(len(task.unit)))
    steep = task.sides.gradient(start) @ task.spans
    nearest = np.argsort(-task.sides.value(start), kind="stable")[:4]
    rows = np.union1d(np.argmax(steep, axis=0) if len(steep) else nearest, nearest).astype(np.intp)
    for rounds in range(1, len(task.sides) + 2):
        point = _solved(task, rows, relaxed, rounds)
        if point is None:
            return None
        value = task.sides.value(task.tolerances(point.u)) - point.wider
        value[rows] = 0.0
        broken = np.flatnonzero(value > 1 + BROKEN)
        if not len(broken):
            break
        rows = np.concatenate([rows, broken[np.argsort(-value[broken], kind="stable")[:ADDED]]])
    return point


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
        padded = np.zeros((len(right), self.columns))
        padded[:, : block.shape[1]] = block
        self.blocks.append(padded)
        self.right.append(right)
        self.cones.append(cone)
        self.rows += len(right)
        return self.rows - len(right)


def _solved(task: Task, rows: Rows, relaxed: bool, rounds: int) -> Optimum | None:
    """The solver's point with these sides alone, brought back within them."""
    count, priced = len(task.unit), [] if relaxed else task.costs
    cones = _Cones(count + len(priced) + int(relaxed))
    bounds, right = np.concatenate([-np.eye(count), np.eye(count)]), np.concatenate([-task.low, task.high])
    bounded = np.isfinite(right)
    if bounded.any():
        cones.add(clarabel.NonnegativeConeT(int(bounded.sum())), bounds[bounded], right[bounded])
    firsts = [_side(task, int(k), cones, relaxed) for k in rows]
    aim, scale = np.zeros(cones.columns), 1.0
    if relaxed:
        aim[-1] = 1.0
        cones.add(clarabel.NonnegativeConeT(1), -np.eye(cones.columns)[-1:], np.zeros(1))
    else:
        shares = [_epigraph(task, place, cones) for place in range(len(priced))]
        scale = sum(shares) or 1.0
        aim[count:] = np.array(shares) / scale
    settings = clarabel.DefaultSettings()
    settings.verbose, settings.max_threads = False, 1
    settings.direct_solve_method = "faer"  # its factors leave half widths less open than those of the default
    settings.tol_gap_abs = settings.tol_gap_rel = settings.tol_feas = TOLERANCE
    square, matrix = sparse.csc_matrix((cones.columns, cones.columns)), sparse.csc_matrix(np.vstack(cones.blocks))
    solution = clarabel.DefaultSolver(square, aim, matrix, np.concatenate(cones.right), cones.cones, settings).solve()
    if str(solution.status) not in ACCEPTED or max(solution.r_prim, solution.r_dual) > RESIDUAL:
        return None
    x, multipliers = np.asarray(solution.x), scale * np.maximum(np.asarray(solution.z)[firsts], 0.0)
    active = multipliers > ACTIVE * np.max(multipliers, initial=0.0)
    u = np.clip(x[:count], task.low, task.high)
    if relaxed:
        return Optimum(u, rows[active], multipliers[active], np.nan, np.nan, float(x[-1]), rounds)
    u = _within(task, u, rows)
    varying, bound = task.cost(u) - task.constant, scale * float(solution.obj_val_dual)
    gap = max(varying - bound, 0.0) / (varying or 1.0)
    bound = task.constant + min(bound, varying)
    return Optimum(u, rows[active], multipliers[active], bound, gap, 0.0, rounds)


def _within(task: Task, u: Array, rows: Rows) -> Array:
    """The same brought back within the limits, which a solver keeps to its tolerance only."""
    over, least = (np.max(task.sides.value(task.tolerances(each), rows), initial=0.0) for each in (u, task.low))
    if over <= 1 or least >= 1:
        return u
    return task.low + (1 - least) / (over - least) * (u - task.low)  # on a line to the least the sides are convex


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
    numbers = cost.numbers()
    k, ratio = numbers["k"], float(task.unit[g] / numbers["unit"])
    column = len(task.unit) + place
    block, right = np.zeros((3, cones.columns)), np.zeros(3)
    if COST_MODELS[cost.model].cone == "power":  # z^α u^(1−α) ≥ 1 with α = 1/(1 + k)
        block[0, column] = block[1, g] = -1.0
        right[2] = 1.0
        cones.add(clarabel.PowerConeT(1 / (1 + k)), block, right)
        return numbers["B"] * float(ratio**-k)
    block[0, g], block[2, column], right[1] = k * ratio, -1.0, 1.0  # 1 · exp(−k u / 1) ≤ z
    cones.add(clarabel.ExponentialConeT(), block, right)
    return numbers["B"]

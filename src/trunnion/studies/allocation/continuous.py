"""Least cost over half widths that may be anything between bounds: a convex problem, solved and proven.

Clarabel solves it as a conic program, with power and exponential cones for costs and second-order cones for RSS rows;
its dual objective, a lower bound of the cost, proves the answer.

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

from trunnion.errors import Finding
from trunnion.results.sentences import told
from trunnion.statistics.costs import COST_MODELS
from trunnion.studies.allocation.problem import PROVEN, Answer, Problem, none, shortfalls
from trunnion.studies.allocation.task import Task, sides, task_of

__all__ = ["Point", "allocate_continuous", "minimise", "settled"]

Array = NDArray[np.float64]
ACTIVE = 1e-6  # of the largest multiplier: a side that limits
NEAR = 1e-3  # of the first units: the least unit to try again with
Rows = NDArray[np.intp]
SOUND = ("Solved", "AlmostSolved", "InsufficientProgress")
FINE = 1e-11
CLOSE = 1e-4  # residuals of an answer that is taken; what is beyond a limit is brought back
BROKEN = 1e-7  # of a limit: a row to add
AT_ONCE = 16  # rows added in one round


def allocate_continuous(problem: Problem) -> Answer:
    """The half widths of least cost, or why there are none."""
    problem.check()
    chosen = [one.name for one in problem.contributions if one.options]
    if chosen:
        what = "has a table of processes, which is no continuous choice"
        return none(problem, [Finding(what, f"costs.{chosen[0]}", "choose discrete, or give it a cost model")])
    task = task_of(problem, sides(problem))
    early = shortfalls(problem, task.tolerances(task.low)) if np.any(task.sides.room < 0) else []
    trouble = early or unbounded(task) or unmet(problem, task)
    if trouble:
        return none(problem, trouble)
    point = minimise(task)
    if point is None:
        return none(problem, [told("allocation.not_found", "costs")])
    return answer_of(problem, task, point)


def answer_of(problem: Problem, task: Task, point: Point) -> Answer:
    """A point of the task in the terms of the problem."""
    tolerances = task.tolerances(point.u)
    pairs = zip(problem.contributions, tolerances, strict=True)
    costs = np.array([one.cost.value(float(t)) if one.cost else 0.0 for one, t in pairs])
    cost, gap = float(np.sum(costs)), gap_of(task, point)
    price = np.zeros(len(problem.effects.worst))
    np.add.at(price, task.sides.row[point.rows], point.weights / task.sides.room[point.rows])
    doubt = told("allocation.proven_roughly", "costs", gap=gap)
    return Answer(
        problem,
        tolerances,
        costs,
        cost,
        bound=cost - gap * task.scale(point.u),
        gap=gap,
        proven=gap <= PROVEN,
        price=price,
        findings=() if gap <= PROVEN else (doubt,),
        rounds=point.rounds,
    )


def unbounded(task: Task) -> list[Finding]:
    """What no limit and no bound holds."""
    free = np.flatnonzero(~np.isfinite(task.most))
    return [told("allocation.unbounded", f"costs.{task.names[one]}") for one in free]


def unmet(problem: Problem, task: Task) -> list[Finding]:
    """Why no half widths keep the limits; empty if some do."""
    least = task.tolerances(task.low)
    if task.sides.rising or not np.all(task.sides.room > 0):
        return shortfalls(problem, least)
    if np.all(task.sides.value(least) <= 1):
        return []
    found = settled(task, relaxed=True)
    return shortfalls(problem, task.tolerances(found.u)) if found else []


def minimise(task: Task) -> Point | None:
    """The point of least cost of a task whose limits can be kept; None if it was not found.

    It is found twice: first to know how large the unknowns are, then with all of them near 1.
    """
    first = _within(task, settled(task))
    if first is None:
        return None
    unit = task.unit * np.maximum(first.u, NEAR)
    again = replace(task, unit=unit)
    second = _within(again, settled(again))
    if second is None or gap_of(again, second) > max(gap_of(task, first), PROVEN):
        return first
    return replace(second, u=second.u * unit / task.unit)


def gap_of(task: Task, point: Point) -> float:
    """Cost from its lower bound, either way, in units of what tolerances change."""
    return abs(task.cost(point.u) - point.bound) / task.scale(point.u)


def _within(task: Task, point: Point | None) -> Point | None:
    """The same brought back within the limits, where it is beyond them by the solver's tolerance."""
    if point is None:
        return None
    active = point.weights > ACTIVE * np.max(point.weights, initial=0.0)
    point = replace(point, rows=point.rows[active], weights=point.weights[active])
    over = float(np.max(task.sides.value(task.tolerances(point.u)), initial=0.0))
    if over <= 1:
        return point
    least = float(np.max(task.sides.value(task.tolerances(task.low)), initial=0.0))
    share = (1 - least) / (over - least) if least < 1 else 1.0  # on a line to the least the sides are convex
    return replace(point, u=task.low + share * (point.u - task.low))


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
class Point:
    """What the solver found: unknowns u, the sides that were needed with their multipliers, and the dual objective.

    bound: no cost is lower, to the solver's precision; wider: by what share of themselves all limits are widened.
    """

    u: Array
    rows: Rows
    weights: Array
    bound: float
    wider: float = 0.0
    rounds: int = 0


def settled(task: Task, relaxed: bool = False) -> Point | None:
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
            return replace(point, rounds=rounds)
        rows = np.concatenate([rows, broken[np.argsort(-value[broken], kind="stable")[:AT_ONCE]]])


def _first(task: Task) -> Rows:
    """Sides to begin with: for each unknown the one that bounds it most, and the nearest at the start."""
    t = task.tolerances(np.ones(len(task.unit)))
    steep = task.sides.gradient(t) @ task.spans
    picked = {int(np.argmax(column)) for column in steep.T} if len(steep) else set()
    picked |= {int(k) for k in np.argsort(-task.sides.value(t), kind="stable")[:4]}
    return np.array(sorted(picked), np.intp)


def _solved(task: Task, rows: Rows, relaxed: bool) -> Point | None:
    """The point of least cost with these sides alone."""
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
        weights = [_epigraph(task, place, cones) for place in range(len(priced))]
        scale = sum(weights) or 1.0
        aim[count:] = np.array(weights) / scale
    nothing = sparse.csc_matrix((cones.columns, cones.columns))
    whole, b = sparse.csc_matrix(np.vstack(cones.blocks)), np.concatenate(cones.right)
    found = clarabel.DefaultSolver(nothing, aim, whole, b, cones.cones, _settings()).solve()
    if str(found.status) not in SOUND or found.r_prim > CLOSE or found.r_dual > CLOSE:
        return None
    prices, kept = scale * np.maximum(np.asarray(found.z)[firsts], 0.0), np.clip(found.x[:count], task.low, task.high)
    bound = sum(cost.values()["A"] for _, cost in priced) + scale * found.obj_val_dual
    return Point(kept, rows, prices, bound, float(found.x[-1]) if relaxed else 0.0)


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
    given = cost.values()
    k, ratio = given["k"], float(task.unit[g] / given["unit"])
    column = len(task.unit) + place
    block, right = np.zeros((3, cones.columns)), np.zeros(3)
    if COST_MODELS[cost.model].cone == "power":  # z^α u^(1−α) ≥ 1 with α = 1/(1 + k)
        block[0, column] = block[1, g] = -1.0
        right[2] = 1.0
        cones.add(clarabel.PowerConeT(1 / (1 + k)), block, right)
        return float(given["B"] * ratio**-k)
    block[0, g], block[2, column], right[1] = k * ratio, -1.0, 1.0  # 1 · exp(−k u / 1) ≤ z
    cones.add(clarabel.ExponentialConeT(), block, right)
    return given["B"]


def _settings() -> clarabel.DefaultSettings:
    settings = clarabel.DefaultSettings()
    settings.verbose = False
    settings.tol_gap_abs = settings.tol_gap_rel = settings.tol_feas = FINE
    return settings

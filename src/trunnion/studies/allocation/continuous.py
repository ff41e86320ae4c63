"""Least cost over half widths that may be anything between bounds: a convex problem, solved and proven.

Clarabel solves it as a conic program, Newton's method takes the answer to rounding, and a lower bound of the cost over
the box of the bounds proves it.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from trunnion.errors import Finding
from trunnion.results.sentences import finding_for
from trunnion.studies.allocation.cones import settled
from trunnion.studies.allocation.interior import Optimum, polished
from trunnion.studies.allocation.problem import PROVEN, AllocationProblem, Answer, none, shortfalls
from trunnion.studies.allocation.task import Task, sides, task_of

__all__ = ["allocate_continuous", "minimise"]

Array = NDArray[np.float64]
ACTIVE = 1e-6  # of the largest multiplier: a side to begin Newton's method with
NEAR = 1e-3  # of the first units: the least unit to try again with


def allocate_continuous(problem: AllocationProblem) -> Answer:
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
        return none(problem, [finding_for("allocation.not_found", "costs")])
    return answer_of(problem, task, point)


def answer_of(problem: AllocationProblem, task: Task, point: Optimum) -> Answer:
    """A point of the task in the terms of the problem."""
    tolerances = task.tolerances(point.u)
    pairs = zip(problem.contributions, tolerances, strict=True)
    costs = np.array([one.cost.value(float(t)) if one.cost else 0.0 for one, t in pairs])
    cost, gap = float(np.sum(costs)), max(point.gap, 0.0)
    price = np.zeros(len(problem.effects.worst))
    np.add.at(price, task.sides.row[point.rows], point.weights / task.sides.room[point.rows])
    doubt = finding_for("allocation.proven_roughly", "costs", gap=gap)
    return Answer(
        problem,
        tolerances,
        costs,
        cost,
        bound=cost - gap * point.scale,
        gap=gap,
        proven=gap <= PROVEN,
        residual=point.residual,
        price=price,
        findings=() if gap <= PROVEN else (doubt,),
        rounds=point.rounds,
    )


def unbounded(task: Task) -> list[Finding]:
    """What no limit and no bound holds."""
    free = np.flatnonzero(~np.isfinite(task.most))
    return [finding_for("allocation.unbounded", f"costs.{task.names[one]}") for one in free]


def unmet(problem: AllocationProblem, task: Task) -> list[Finding]:
    """Why no half widths keep the limits; empty if some do."""
    least = task.tolerances(task.low)
    if task.sides.rising or not np.all(task.sides.room > 0):
        return shortfalls(problem, least)
    if np.all(task.sides.value(least) <= 1):
        return []
    found = settled(task, relaxed=True)
    return shortfalls(problem, task.tolerances(found[0])) if found else []


def minimise(task: Task) -> Optimum | None:
    """The point of least cost of a task whose limits can be kept; None if it was not found."""
    found = settled(task) or _inside(task)
    if found is None:
        return None
    point = _polished(task, *found)
    if point.gap > PROVEN:  # again, with all unknowns near 1
        unit = task.unit * np.maximum(point.u, NEAR)
        again = replace(task, unit=unit)
        found = settled(again)
        if found is not None:
            other = _polished(again, *found)
            point = min(point, replace(other, u=other.u * unit / task.unit), key=lambda one: one.gap)
    return point


def _inside(task: Task) -> tuple[Array, NDArray[np.intp], Array, int] | None:
    """A point within the limits to begin with, should the solver of cones not come to an end."""
    for halved in range(60):
        u = np.clip(task.low + 0.5**halved, task.low, task.high)
        value = task.sides.value(task.tolerances(u))
        if np.max(value, initial=0.0) < 1:
            return u, np.argsort(-value)[:1], np.zeros(1), 0
    return None


def _polished(task: Task, u: Array, rows: NDArray[np.intp], weights: Array, rounds: int) -> Optimum:
    active = weights > ACTIVE * np.max(weights, initial=0.0)
    return replace(polished(task, u, rows[active], weights[active]), rounds=rounds)

"""Least cost over half widths that may be anything between bounds: a convex problem, solved and proven.

Clarabel solves it as a conic program; its dual objective, a lower bound of the cost, proves the answer.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from trunnion.errors import Finding
from trunnion.results.sentences import finding_for
from trunnion.studies.allocation.cones import Optimum, settled
from trunnion.studies.allocation.problem import PROVEN, AllocationProblem, Answer, none, shortfalls
from trunnion.studies.allocation.task import Task, sides, task_of

__all__ = ["allocate_continuous", "minimise"]

Array = NDArray[np.float64]
NEAR = 1e-3  # of the first units: the least unit of the second time


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
    cost = float(np.sum(costs))
    price = np.zeros(len(problem.effects.worst))
    np.add.at(price, task.sides.row[point.rows], point.weights / task.sides.room[point.rows])
    doubt = finding_for("allocation.proven_roughly", "costs", gap=point.gap)
    return Answer(
        problem,
        tolerances,
        costs,
        cost,
        bound=min(point.bound, cost),
        gap=point.gap,
        proven=point.gap <= PROVEN,
        price=price,
        findings=() if point.gap <= PROVEN else (doubt,),
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
    return shortfalls(problem, task.tolerances(found.u)) if found else []


def minimise(task: Task) -> Optimum | None:
    """The point of least cost of a task whose limits can be kept; None if it was not found.

    It is found twice: first to know how large the unknowns are, then with all of them near 1.
    """
    first = settled(task)
    if first is None:
        return None
    unit = task.unit * np.maximum(first.u, NEAR)
    second = settled(replace(task, unit=unit))
    if second is None or second.gap > first.gap:
        return first
    return replace(second, u=second.u * unit / task.unit)

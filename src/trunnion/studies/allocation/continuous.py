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
from trunnion.studies.allocation.cones import Optimum, settled
from trunnion.studies.allocation.newton import judged, sharpened, within
from trunnion.studies.allocation.problem import PROVEN, AllocationProblem, Answer, none, shortfalls
from trunnion.studies.allocation.task import Task, sides, task_of

__all__ = ["allocate_continuous", "minimise"]

Array = NDArray[np.float64]
NEAR = 1e-3  # of the first units: the least unit in Newton's method
STEPS = 20  # of Newton's method: two or three do mostly
ENOUGH = 1e-14  # gap at which there is nothing left to gain


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
        bound=cost - point.gap * task.scale(point.u),
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
    """The point of least cost of a task whose limits can be kept; None if it was not found."""
    first = settled(task)
    if first is None:
        return None
    unit = task.unit * np.maximum(first.u, NEAR)
    scaled = replace(task, unit=unit)  # all unknowns near 1
    best = point = judged(scaled, replace(first, u=first.u * task.unit / unit))
    for _ in range(STEPS):
        if best.gap < ENOUGH or not np.isfinite(point.gap):
            break
        point = sharpened(scaled, point)
        best = min(best, point, key=lambda one: one.gap)
    return replace(best, u=within(scaled, best.u) * unit / task.unit)

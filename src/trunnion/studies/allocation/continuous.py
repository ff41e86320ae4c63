"""Least cost over half widths that may be anything between bounds: a convex problem, solved and proven.

Clarabel solves it as a conic program; its dual objective, a lower bound of the cost, proves the answer.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from trunnion.errors import Finding
from trunnion.results.sentences import told
from trunnion.studies.allocation.cones import Point, settled
from trunnion.studies.allocation.problem import PROVEN, Answer, Problem, none, shortfalls
from trunnion.studies.allocation.sides import sides
from trunnion.studies.allocation.task import Task, task_of

__all__ = ["allocate_continuous", "minimise"]

Array = NDArray[np.float64]
ACTIVE = 1e-6  # of the largest multiplier: a side that limits
NEAR = 1e-3  # of the first units: the least unit to try again with


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

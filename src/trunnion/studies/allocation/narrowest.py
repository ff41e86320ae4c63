"""The narrowest half widths to be had: what each limit fails with them, no purchase mends.

A row whose scatter is mostly of what is not bought cannot have any margin asked of it. How many standard deviations it
has room for with the narrowest half widths is its cap; with margins below the caps (`AllocationProblem.margins`) a
yield is looked for up to what these half widths have, and not only up to the margin at which the first row gives in.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize

from trunnion.studies.allocation.normal import normal_yield, plain_yield
from trunnion.studies.allocation.problem import FAR, AllocationProblem, Answer, common_options
from trunnion.studies.allocation.task import sides, task_of

__all__ = ["bought_at", "freed", "narrowest", "with_caps"]

Array = NDArray[np.float64]
RARE = 1e-12  # failures that are no longer told apart
CLOSE = 1e-3  # of z: how closely the largest margin that all rows can have is looked for


def narrowest(problem: AllocationProblem) -> Array:
    """The least half width of everything, m or rad, (contribution,); of a group the option that is narrowest."""
    place = {one.name: i for i, one in enumerate(problem.contributions)}
    t = np.array([one.value if one.fixed else 0.0 for one in problem.contributions])
    for members in problem.groups().values():
        options = common_options(members)
        if members[0].options and not options:
            continue
        least = np.full(len(members), max(one.least for one in members))
        if options:
            table = np.array([[option.tolerance for option in each] for each in options.values()])
            scale = np.maximum(np.min(table, axis=0), np.finfo(float).tiny)
            least = table[int(np.argmin(np.sum(table / scale, axis=1)))]
        t[[place[one.name] for one in members]] = least
    return t


def with_caps(
    problem: AllocationProblem, most: float, solve: Callable[[AllocationProblem], Answer]
) -> tuple[AllocationProblem, Array | None]:
    """The problem with the caps of its rows, and half widths that have them, (contribution,); None without caps.

    Where narrower is better for every row, these are the narrowest. Where it is not (correlation, a mean that moves),
    they are those of the highest yield that is found from the largest margin that all rows can have at once, and none
    if that is up to `most`; solve: of a problem with z.
    """
    bare = replace(problem, caps=None)
    t = narrowest(bare)
    if not sides(bare).rising:
        even = replace(bare, ratios=None)
        found = solve(replace(even, z=most))
        low, high = 0.0, most
        while not found.found and high - low > CLOSE:
            half = (low + high) / 2
            tried = solve(replace(even, z=half))
            low, high = (half, high) if tried.found else (low, half)
            t = tried.tolerances if tried.found else t
        if found.found:
            return bare, None
        t = _likeliest(bare, [t, narrowest(bare)])
    middle, deviation = replace(bare, z=1.0, ratios=None).extent(t)
    room = np.minimum(bare.effects.upper - middle, middle - bare.effects.lower)
    with np.errstate(divide="ignore", invalid="ignore"):
        caps = np.where(deviation > 0, room / deviation, np.where(room >= 0, np.inf, -np.inf))
    return (replace(bare, caps=caps) if np.any(caps < FAR) else bare), t


def _likeliest(problem: AllocationProblem, starts: list[Array]) -> Array:
    """Half widths of a high yield of normal deviations: the best to begin with, and up from there by its slopes."""
    task = task_of(problem, sides(problem))
    best = max(starts, key=lambda t: normal_yield(problem, t))
    bounds = list(zip(task.low, np.where(np.isfinite(task.high), task.high, np.inf), strict=True))
    if not bounds:
        return best
    others = best - task.tolerances(np.zeros(len(task.unit)))  # options, which stay
    first = np.linalg.lstsq(task.spans * task.unit, others, rcond=None)[0]
    others = others - task.spans @ (task.unit * first)

    def fails(u: Array) -> float:
        return float(np.log(max(1 - plain_yield(problem, task.tolerances(u) + others), RARE)))

    found = minimize(fails, np.clip(first, task.low, task.high), method="L-BFGS-B", bounds=bounds)
    return max([best, task.tolerances(found.x) + others], key=lambda t: normal_yield(problem, t))


def freed(answer: Answer) -> Answer:
    """The same without caps where these are no more than what its rows can have at once, with the same margins.

    Where narrower is not better for every row, one row may have more than its cap if another has less.
    """
    problem = answer.problem
    if problem.caps is None or sides(problem).rising:
        return answer
    margins = problem.margins()
    z = float(np.mean(margins))
    return replace(answer, problem=replace(problem, z=z, ratios=margins / z, caps=None))


def bought_at(problem: AllocationProblem, tolerances: Array, bound: float) -> Answer | None:
    """The allocation of half widths that can be had; None if they cost without end. bound: of the cost."""
    costs, choices = np.zeros(len(tolerances)), {}
    for i, (one, t) in enumerate(zip(problem.contributions, tolerances, strict=True)):
        if one.cost:
            costs[i] = one.cost.value(float(t)) if t > 0 else np.inf
        elif one.options:
            option = min(one.options, key=lambda each: (abs(each.tolerance - float(t)), each.cost))
            costs[i], choices[one.name] = option.cost, option.name
    cost = float(np.sum(costs))
    if not np.isfinite(cost):
        return None
    nothing = np.full(len(problem.effects.worst), np.nan)
    return Answer(problem, tolerances, costs, cost, bound, np.nan, proven=False, choices=choices, price=nothing)

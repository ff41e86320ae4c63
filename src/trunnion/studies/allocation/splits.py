"""The permitted failures of a yield split over the measures by what their margins cost.

With one margin z for all measures the cheapest half widths meet a yield, but not at least cost: room is better given
where it is cheap. Let z_k be the margin of measure k, C the least cost, Y the yield. At the least cost the price of a
share of failures is the same everywhere,

    ∂C/∂z_k = λ ∂Y/∂z_k.

The left side is a sum of the multipliers of the rows of k (envelope theorem): a row's price times its standard
deviation. The right side is the yield with the rooms of k a little wider. As ∂Y/∂z_k falls like exp(−z_k²/2), and the
cost changes slowly, a step of z_k by the logarithm of how far both sides part, over z_k, leads there. Each step is
settled at the yield asked for, and only taken if it costs less: the split is never dearer than one margin for all.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from trunnion.studies.allocation.normal import by_measure
from trunnion.studies.allocation.problem import AllocationProblem, Answer

__all__ = ["split"]

Array = NDArray[np.float64]
ROUNDS = 12
WIDER = 1e-3  # of the rooms of a measure, for the change of the yield
LARGEST = 0.5  # standard deviations that a margin is moved at once
LEAST = 0.05  # of the mean margin: what a margin does not go below
FREE = 2.0  # times the margin asked for: more than that of what limits nothing does not count
NOTHING = 1e-3  # of the price, and of the gain in yield, of all measures: what is not worth a change
SAME = 1e-5  # of the cost: a gain that ends it
SMALL = 1e-3  # standard deviations: a step that ends it
HALVINGS = 5  # of a step that costs more


def split(
    start: Answer, expected: Callable[[AllocationProblem], Answer], share: Callable[[AllocationProblem, Array], float]
) -> Answer:
    """The answer with margins split by cost, or the one it starts from where that is as cheap.

    expected: the cheapest answer of a problem with its `ratios` that meets the yield; share: the yield of half widths.
    """
    groups = list(by_measure(start.problem).values())
    if len(groups) < 2 or not start.found or not np.all(np.isfinite(start.price)):
        return start
    best = start
    for _ in range(ROUNDS):
        step = _step(best, groups, share)
        better = None if step is None else _shorter(best, groups, *step, expected)
        if better is None:
            break
        gain, best = best.cost - better.cost, better
        if gain <= SAME * abs(start.cost):
            break
    return best


def _shorter(
    best: Answer,
    groups: list[NDArray[np.intp]],
    margins: Array,
    step: Array,
    expected: Callable[[AllocationProblem], Answer],
) -> Answer | None:
    """What is cheaper along a step of the margins, halved as often as it takes; None if nothing is."""
    for halved in range(HALVINGS):
        moved = np.maximum(margins + 0.5**halved * step, LEAST * np.mean(margins))
        ratios = np.ones(len(best.problem.effects.worst))
        for own, margin in zip(groups, moved / np.mean(moved), strict=True):
            ratios[own] = margin
        tried = expected(replace(best.problem, z=float(np.mean(moved)), ratios=ratios))
        if tried.found and not tried.findings and tried.cost < best.cost:
            return tried
    return None


def _step(
    answer: Answer, groups: list[NDArray[np.intp]], share: Callable[[AllocationProblem, Array], float]
) -> tuple[Array, Array] | None:
    """Margins of the measures and their change towards equal prices of failures; None where there is none to make."""
    problem, t = answer.problem, answer.tolerances
    # a row's price is of one unit of its room, and the half width it takes is margin · deviation
    dear = answer.price * problem.extent(t)[1]
    asked = np.array([float(np.sum(dear[own])) for own in groups])
    sure = share(problem, t)
    gained = np.array([max(share(_wider(problem, t, own), t) - sure, 0.0) for own in groups])
    concerned = (asked > NOTHING * np.sum(asked)) | (gained > NOTHING * np.sum(gained))
    if np.sum(concerned) < 2 or not np.any(gained) or not np.any(asked):
        return None
    used = np.array([float(np.max(answer.used[own])) for own in groups])
    asks = problem.z * (np.ones(len(problem.effects.worst)) if problem.ratios is None else problem.ratios)
    margins = np.array([float(asks[own[int(np.argmax(answer.used[own]))]]) for own in groups])
    margins = np.where(concerned, margins / np.clip(used, 1 / FREE, 1.0), margins)  # what limits nothing has more
    tiny = np.finfo(float).tiny
    part = np.log(np.maximum(asked / np.sum(asked), tiny)) - np.log(np.maximum(gained / np.sum(gained), tiny))
    middle = float(np.average(part, weights=asked))
    step = np.where(concerned, -np.clip((part - middle) / margins, -LARGEST, LARGEST), 0.0)
    return (margins, step) if np.max(np.abs(step)) > SMALL else None


def _wider(problem: AllocationProblem, t: Array, own: NDArray[np.intp]) -> AllocationProblem:
    """The problem with the rooms of some rows wider, as they are seen from the middle of what the rows do."""
    effects, middle = problem.effects, problem.extent(t)[0]
    upper, lower = effects.upper.copy(), effects.lower.copy()
    upper[own] += WIDER * (upper[own] - middle[own])
    lower[own] -= WIDER * (middle[own] - lower[own])
    return replace(problem, effects=replace(effects, upper=upper, lower=lower))

"""Allocate: continuous or discrete, under any criterion, and the curve of cost against accuracy."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Literal

from trunnion.errors import Finding, MechanismError
from trunnion.studies.allocation.cones import allocate_continuous
from trunnion.studies.allocation.discrete import allocate_discrete
from trunnion.studies.allocation.problem import AllocationProblem, Answer
from trunnion.studies.allocation.yields import Check, Verify, meet

__all__ = ["CHOICES", "Choice", "solve", "trade_off"]

Choice = Literal["continuous", "discrete"]
CHOICES: dict[Choice, Callable[[AllocationProblem], Answer]] = {
    "continuous": allocate_continuous,
    "discrete": allocate_discrete,
}


def solve(
    problem: AllocationProblem,
    choice: Choice = "continuous",
    target: float | None = None,
    verify: Verify | None = None,
    check: Check | None = None,
) -> Answer:
    """The allocation of least cost.

    target: yield to meet, for the criterion `yield`; without it the problem's z is kept. verify: half widths
    (contribution,) → sampled yield, low and high end of its interval; the margin is then corrected until it is met.
    check: half widths and the number of a stream, from 1 → the same of samples that `verify` never has.
    """
    if problem.criterion != "yield" or target is None:
        return CHOICES[choice](problem)
    if not 0 < target < 1:
        raise MechanismError(Finding(f"a yield of {target:g} is not possible", "yield", "above 0 and below 1"))
    return meet(problem, target, CHOICES[choice], verify, check)


def trade_off(
    problem: AllocationProblem, factors: Sequence[float], choice: Choice = "continuous", target: float | None = None
) -> list[Answer]:
    """One answer for each factor by which all limits are multiplied; `found` is False where there is none."""
    return [solve(replace(problem, effects=problem.effects.scaled(factor)), choice, target) for factor in factors]

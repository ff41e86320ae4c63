"""Allocate: continuous or discrete, under any criterion, and the curve of cost against accuracy."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Literal

from trunnion.errors import Finding, MechanismError
from trunnion.studies.allocation.cones import allocate_continuous
from trunnion.studies.allocation.discrete import allocate_discrete
from trunnion.studies.allocation.problem import AllocationProblem, Answer
from trunnion.studies.allocation.yields import Verify, meet

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
    sure: bool = False,
) -> Answer:
    """The allocation of least cost.

    target: yield to meet, for the criterion `yield`; without it the problem's z is its margin. verify, sure: see
    `yields.meet`.
    """
    if problem.criterion != "yield" or target is None:
        return CHOICES[choice](problem)
    if not 0 < target < 1:
        raise MechanismError(Finding(f"a yield of {target:g} is not possible", "yield", "above 0 and below 1"))
    return meet(problem, target, CHOICES[choice], verify, sure)


def trade_off(problem: AllocationProblem, factors: Sequence[float], choice: Choice = "continuous") -> list[Answer]:
    """One answer for each factor by which all limits are multiplied; `found` is False where there is none."""
    return [solve(replace(problem, effects=problem.effects.scaled(factor)), choice) for factor in factors]

"""Allocate under any criterion, and the curve of cost against accuracy."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from trunnion.errors import Finding, MechanismError
from trunnion.studies.allocation.discrete import cheapest
from trunnion.studies.allocation.problem import AllocationProblem, Answer
from trunnion.studies.allocation.yields import Verify, meet

__all__ = ["solve", "trade_off"]


def solve(
    problem: AllocationProblem, target: float | None = None, verify: Verify | None = None, sure: bool = False
) -> Answer:
    """The allocation of least cost.

    target: yield to meet, for the criterion `yield`; without it the problem's z is its margin. verify, sure: see
    `yields.meet`.
    """
    if problem.criterion != "yield" or target is None:
        return cheapest(problem)
    if not 0 < target < 1:
        raise MechanismError(Finding(f"a yield of {target:g} is not possible", "yield", "above 0 and below 1"))
    return meet(problem, target, cheapest, verify, sure)


def trade_off(problem: AllocationProblem, factors: Sequence[float]) -> list[Answer]:
    """One answer for each factor by which all limits are multiplied; `found` is False where there is none."""
    return [cheapest(replace(problem, effects=problem.effects.scaled(factor))) for factor in factors]

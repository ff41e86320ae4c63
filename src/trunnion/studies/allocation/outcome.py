"""An allocation: what was asked for, and what was found."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from trunnion.errors import Finding
from trunnion.model.mechanism import Mechanism
from trunnion.model.tolerances import Price
from trunnion.solve.friction_method import FrictionMethod
from trunnion.studies.allocation.problem import Answer, Criterion
from trunnion.studies.allocation.rows import Rows
from trunnion.studies.allocation.solve import Choice as Way
from trunnion.studies.tolerance.first_order import ToleranceStudy, study

__all__ = ["CLOSE", "DEFAULT_YIELD", "Allocated", "AllocationRequest", "Choice", "share_of"]


DEFAULT_YIELD = 0.9973

CLOSE = 1e-6  # of a limit: how close to it the worst case found is brought


@dataclass(frozen=True)
class AllocationRequest:
    """What was asked for; see `allocate`. measures: those with limits; target: the yield, for that criterion."""

    mechanism: Mechanism
    measures: Sequence[str]
    criterion: Criterion
    target: float
    choice: Choice
    steps: int
    at: float | str | None
    samples: int
    seed: int
    friction: FrictionMethod | None
    jobs: int | None
    curve: int
    exact: bool

    def studied(self, bought: Mapping[str, float]) -> ToleranceStudy:
        """First order of the mechanism with these half widths and clearances, by path."""
        mechanism = self.mechanism.with_tolerances(bought)
        return study(mechanism, self.measures, self.steps, self.at, self.friction)


@dataclass(frozen=True, eq=False)
class Allocated:
    """What was found. study: of the tolerances that the rows of the answer belong to; way: how it was solved.

    prices: of what could be bought, by path; before: half widths as stated; tight: what limits were multiplied by, by
    measure, so that the mechanism itself keeps them; offers: factors of all limits with their answers.
    """

    asked: AllocationRequest
    study: ToleranceStudy
    rows: Rows
    answer: Answer
    way: Way
    prices: Mapping[str, Price]
    before: Mapping[str, float]
    findings: tuple[Finding, ...]
    tight: Mapping[str, float] = field(default_factory=dict)
    offers: tuple[tuple[float, Answer], ...] = field(default=())

    @property
    def bought(self) -> dict[str, float]:
        """Half widths that were found, and radial clearances, by path, SI."""
        return {name: t for name, t in self.answer.by_name.items() if name in self.prices}


def share_of(value: float, limit: float) -> float:
    """A deviation as a share of a limit to the same side; 0 of another side, or without a limit."""
    return max(value / limit, 0.0) if np.isfinite(limit) and limit != 0 and np.isfinite(value) else 0.0


Choice = Literal["auto", "continuous", "discrete"]

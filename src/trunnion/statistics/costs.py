"""What a tolerance costs, by its half width t (of a clearance: the radial clearance).

A model is a function, of the cost and its slope over t, and one entry of `COST_MODELS`. Both models fall and are convex
in t wherever B ≥ 0 and k > 0; the power model is convex in log t too, the exponential one only where k t ≥ unit. So an
allocation is solved in t, where it is convex with either.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Literal

import numpy as np


@dataclass(frozen=True)
class CostModel:
    """A cost of a tolerance, with its derivative with respect to the half width.

    of: (t, *, A, B, k, unit) → cost and slope, t the half width, m or rad; parameters: what each means; cone: the cone
    of a conic program that its epigraph is: of z ≥ x^−k, or of z ≥ exp(−k x), with x = t/unit.
    """

    of: Callable[..., tuple[float, float]]
    parameters: Mapping[str, str]
    formula: str
    source: str
    cone: Literal["power", "exponential"]


def power(t: float, *, A: float, B: float, k: float, unit: float) -> tuple[float, float]:
    """A + B/(t/unit)^k, and −k B/unit (t/unit)^(−k − 1); unbounded as t falls to 0, unless nothing depends on t."""
    if not B or t <= 0:
        return (np.inf, -np.inf) if B else (A, 0.0)
    varying = B * (t / unit) ** -k
    return A + varying, -k * varying / t


def exponential(t: float, *, A: float, B: float, k: float, unit: float) -> tuple[float, float]:
    """A + B exp(−k t/unit), and −k B/unit exp(−k t/unit); A + B at t = 0."""
    varying = B * float(np.exp(-k * t / unit))
    return A + varying, -k * varying / unit


_PARAMETERS = {
    "A": "cost that no tolerance changes",
    "B": "cost that the tolerance changes",
    "k": "how fast the cost falls as the tolerance widens",
    "unit": "the half width that counts as 1",
}

COST_MODELS: dict[str, CostModel] = {
    "power": CostModel(
        power,
        _PARAMETERS,
        "A + B/(t/unit)^k",
        "G. H. Sutherland and B. Roth, Mechanism design: accounting for manufacturing tolerances and costs in "
        "function generating problems, ASME Journal of Engineering for Industry 97 (1975) 283–286 (reciprocal power)",
        "power",
    ),
    "exponential": CostModel(
        exponential,
        _PARAMETERS,
        "A + B exp(−k t/unit)",
        "F. H. Speckhart, Calculation of tolerance based on a minimum cost approach, ASME Journal of Engineering for "
        "Industry 94 (1972) 447–453",
        "exponential",
    ),
}


@dataclass(frozen=True)
class Cost:
    """What one tolerance costs: a name of `COST_MODELS` and its parameters (A; B; k; unit in m or rad)."""

    model: str
    parameters: Mapping[str, float] = field(default_factory=dict)

    def numbers(self) -> dict[str, float]:
        """The parameters by name, A being 0 where it is not stated."""
        return {"A": 0.0, **self.parameters}

    def value(self, t: float) -> float:
        """Cost of a half width t, m or rad."""
        return COST_MODELS[self.model].of(t, **self.numbers())[0]

    def slope(self, t: float) -> float:
        """Rise of the cost with t: never above zero."""
        return COST_MODELS[self.model].of(t, **self.numbers())[1]

"""An allocation as unknowns, bounds, costs and sides: what the solvers work on."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from trunnion.statistics.costs import Cost
from trunnion.studies.allocation.problem import Problem
from trunnion.studies.allocation.sides import Sides

__all__ = ["Task", "task_of"]

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Task:
    """Least Σ cost(t) with g(t) ≤ 1, t = base + spans · (unit ∘ u): one unknown u a group.

    spans: (contribution, unknown), 0 or 1; unit: m or rad, (unknown,); least, most: bounds of the half width, m or rad;
    costs: (unknown, cost) of each contribution with one; names: of a contribution of each unknown.
    """

    sides: Sides
    base: Array
    spans: Array
    unit: Array
    least: Array
    most: Array
    costs: list[tuple[int, Cost]]
    names: list[str]

    def tolerances(self, u: Array) -> Array:
        """Half widths of all contributions, m or rad."""
        return np.asarray(self.base + self.spans @ (self.unit * u), float)

    def cost(self, u: Array) -> float:
        """What the unknowns cost."""
        return sum(cost.value(float(self.unit[g] * u[g])) for g, cost in self.costs)

    def slope(self, u: Array) -> Array:
        """∂cost/∂u, (unknown,)."""
        total = np.zeros(len(u))
        for g, cost in self.costs:
            total[g] += self.unit[g] * cost.slope(float(self.unit[g] * u[g]))
        return total

    def scale(self, u: Array) -> float:
        """The part of the cost that tolerances change at u, but for what is lost in the rounding of the whole."""
        return max(float(np.sum(np.abs(self.slope(u) * u))), 1e-9 * abs(self.cost(u))) or 1.0

    @property
    def low(self) -> Array:
        """Lower bounds of u."""
        return self.least / self.unit

    @property
    def high(self) -> Array:
        """Upper bounds of u."""
        return self.most / self.unit


def task_of(problem: Problem, limits: Sides) -> Task:
    """The task of a problem's contributions with a cost; those with options are left at 0."""
    groups = {name: members for name, members in problem.groups().items() if not members[0].options}
    place = {one.name: i for i, one in enumerate(problem.contributions)}
    spans = np.zeros((len(place), len(groups)))
    least, most, costs, names = np.zeros(len(groups)), np.zeros(len(groups)), [], []
    for g, members in enumerate(groups.values()):
        rows = [place[one.name] for one in members]
        spans[rows, g] = 1.0
        least[g] = max(one.least for one in members)
        most[g] = min(min(one.most for one in members), float(np.min(limits.most[rows])))
        costs += [(g, one.cost) for one in members if one.cost]
        names.append(members[0].name)
    base = np.array([one.value if one.fixed else 0.0 for one in problem.contributions])
    unit = np.where(np.isfinite(most) & (most > 0), np.maximum(most / max(len(groups), 1), least), 1.0)
    return Task(limits, base, spans, unit, least, most, costs, names)

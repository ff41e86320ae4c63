"""An allocation as unknowns, bounds, costs and sides: what the solvers work on.

Sides are the limits as convex functions of the half widths, one for each that can bind.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from trunnion.statistics.costs import Cost
from trunnion.statistics.streams import factor
from trunnion.studies.allocation.problem import AllocationProblem

__all__ = ["Sides", "Task", "sides", "task_of"]

Array = NDArray[np.float64]
Rows = NDArray[np.intp]


@dataclass(frozen=True)
class Sides:
    """g_k(t) = linear_k·t + ‖K (spread_k ∘ t)‖ ≤ 1, with the room to the limit as unit.

    linear, spread: (side, contribution), 1/m or 1/rad; factor: K, Kᵀ K the correlation, None: independent;
    row: whose side it is; room: its unit, that of the measure. most: a bound of each half width that the limits imply,
    (contribution,), infinite where they imply none. rising: whether every g_k rises with every t.
    """

    linear: Array
    spread: Array
    factor: Array | None
    row: Rows
    room: Array
    most: Array
    rising: bool

    def __len__(self) -> int:
        return len(self.linear)

    def value(self, t: Array, which: Rows | slice = slice(None)) -> Array:
        """g_k(t), (side,)."""
        return np.asarray(self.linear[which] @ t + np.sqrt(np.sum(self.parts(t, which) ** 2, axis=1)), float)

    def parts(self, t: Array, which: Rows | slice = slice(None)) -> Array:
        """K (spread ∘ t), (side, part)."""
        deviation = self.spread[which] * t
        return deviation if self.factor is None else deviation @ self.factor.T

    def gradient(self, t: Array, which: Rows | slice = slice(None)) -> Array:
        """∂g_k/∂t, (side, contribution); where ‖…‖ is 0 the derivative of its linear part alone, a subgradient."""
        parts = self.parts(t, which)
        norm = np.sqrt(np.sum(parts**2, axis=1))[:, None]
        along = np.divide(parts, norm, out=np.zeros_like(parts), where=norm > 0)
        back = along if self.factor is None else along @ self.factor
        return np.asarray(self.linear[which] + self.spread[which] * back, float)


def sides(problem: AllocationProblem) -> Sides:
    """The sides of a problem's rows that can bind; of a symmetric row only the nearer one."""
    effects = problem.effects
    none = np.zeros_like(effects.worst)
    middle = effects.middle()
    room = np.stack([effects.upper - middle, middle - effects.lower])
    worst, spread, drift = none, none, none
    if problem.criterion == "worst-case":
        worst = effects.worst
    elif problem.criterion == "rss":
        spread = effects.spread()
    else:
        spread, drift = problem.margins()[:, None] * effects.sigma(), effects.drift()
    one_sided = np.asarray(~np.any(drift, axis=1))
    keep = np.asarray(np.isfinite(room))
    keep &= ~(one_sided & (room > room[::-1]))
    keep[1] &= ~(one_sided & (room[0] == room[1]))
    matrix, root, least = effects.correlation, None, 1.0
    if matrix is not None and spread.any() and not np.array_equal(matrix, np.eye(len(matrix))):
        root, least = factor(matrix).T, float(np.sqrt(max(np.linalg.eigvalsh(matrix)[0], 0.0)))
    half = worst + least * np.abs(spread)
    linear = np.concatenate([(worst + drift)[keep[0]], (worst - drift)[keep[1]]])
    both = np.concatenate([spread[keep[0]], spread[keep[1]]])
    rooms = np.concatenate([room[0, keep[0]], room[1, keep[1]]])
    rising = np.min(linear, axis=1, initial=0.0) >= 0
    with np.errstate(divide="ignore", invalid="ignore"):  # no effect, no bound; no room is told before it is used
        alone = np.where(rising[:, None], rooms[:, None] / (linear + least * np.abs(both)), np.inf)
        linear, both = linear / rooms[:, None], both / rooms[:, None]
        pair = ((effects.upper - effects.lower) / 2)[:, None] / half
    bounds = np.concatenate([alone, pair])
    return Sides(
        linear,
        both,
        root,
        np.concatenate([np.flatnonzero(keep[0]), np.flatnonzero(keep[1])]),
        rooms,
        np.min(np.where(np.isnan(bounds), np.inf, bounds), axis=0, initial=np.inf),
        root is None and bool(np.all(rising)),
    )


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

    @property
    def constant(self) -> float:
        """The part of the cost that no half width changes."""
        return sum(cost.numbers()["A"] for _, cost in self.costs)

    @property
    def low(self) -> Array:
        """Lower bounds of u."""
        return self.least / self.unit

    @property
    def high(self) -> Array:
        """Upper bounds of u."""
        return self.most / self.unit


def task_of(problem: AllocationProblem, limits: Sides) -> Task:
    """The task of a problem's contributions with a cost; those with options are left at 0."""
    groups = {name: members for name, members in problem.groups().items() if not members[0].options}
    place = {item.name: i for i, item in enumerate(problem.contributions)}
    spans = np.zeros((len(place), len(groups)))
    least, most, costs, names = np.zeros(len(groups)), np.zeros(len(groups)), [], []
    for g, members in enumerate(groups.values()):
        rows = [place[item.name] for item in members]
        spans[rows, g] = 1.0
        least[g] = max(item.least for item in members)
        most[g] = min(min(item.most for item in members), float(np.min(limits.most[rows])))
        costs += [(g, item.cost) for item in members if item.cost]
        names.append(members[0].name)
    base = np.array([item.value if item.fixed else 0.0 for item in problem.contributions])
    unit = np.where(np.isfinite(most) & (most > 0), np.maximum(most / max(len(groups), 1), least), 1.0)
    return Task(limits, base, spans, unit, least, most, costs, names)

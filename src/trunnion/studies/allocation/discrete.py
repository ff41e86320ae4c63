"""Least cost where tolerances are chosen from tables of processes: mixed-integer, by HiGHS.

One 0/1 number says whether a group takes an option. In them a worst-case row is linear and so is the square of an RSS
row; other rows (a yield with a shift of the mean, correlation) and the half widths and costs of contributions that
have a cost model enter by tangent planes, which lie below what is convex. The answer of the linear problem is therefore
a lower bound. It is completed to an allocation: with its options, the convex problem in the other half widths. Planes
at both points are added, and its options forbidden once they are settled, until the bound meets the best allocation
(outer approximation, M. A. Duran and I. E. Grossmann, An outer-approximation algorithm for a class of mixed-integer
nonlinear programs, Mathematical Programming 36 (1986) 307–339). So a mixture of both kinds is solved exactly too.

Q. Huangfu and J. A. J. Hall, Parallelizing the dual revised simplex method, Mathematical Programming Computation 10
(2018) 119–142 (HiGHS)
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from itertools import accumulate

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import Bounds, LinearConstraint, milp

from trunnion.errors import Finding
from trunnion.studies.allocation.cones import Optimum, allocate_continuous, minimise, unbounded
from trunnion.studies.allocation.problem import (
    ALLOWED,
    PROVEN,
    AllocationProblem,
    Answer,
    Contribution,
    common_options,
    none,
    shortfalls,
)
from trunnion.studies.allocation.task import Sides, Task, sides, task_of

__all__ = ["allocate_discrete"]

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]
STARTS = (0.02, 0.06, 0.2, 0.5, 1.0)  # of the largest half width: first tangents of a cost
AT_ONCE = 16  # rows added in one round
ROUNDS = 2000


def allocate_discrete(problem: AllocationProblem) -> Answer:
    """The processes, and the half widths of contributions with a cost model, of least cost; or why there are none."""
    problem.check()
    groups = [members for members in problem.groups().values() if members[0].options]
    if not groups:
        return allocate_continuous(problem)
    search = _Search(problem, groups)
    early = search.unmet() if np.any(search.limits.room < 0) else []
    trouble = early or unbounded(search.task) or search.unmet()
    return none(problem, trouble) if trouble else search.run()


@dataclass
class _Best:
    """The best allocation so far: its total cost, the options taken, the half widths left, the gap of these."""

    cost: float = np.inf
    taken: Flags = field(default_factory=lambda: np.zeros(0, bool))
    point: Optimum | None = None


class _Search:
    """Outer approximation: unknowns are [0/1 of all options, u of the groups with a cost model, their costs]."""

    def __init__(self, problem: AllocationProblem, groups: list[list[Contribution]]) -> None:
        self.problem = problem
        place = {one.name: i for i, one in enumerate(problem.contributions)}
        self.limits: Sides = sides(problem)
        self.task: Task = task_of(problem, self.limits)
        options = [common_options(members) for members in groups]
        self.names = [list(each) for each in options]
        self.widths = [len(names) for names in self.names]
        self.starts = [0, *accumulate(self.widths)]
        self.members = [[place[one.name] for one in members] for members in groups]
        self.table = np.zeros((len(place), self.starts[-1]))  # half widths by option
        self.prices = np.zeros((len(place), self.starts[-1]))
        for start, own, members in zip(self.starts, options, self.members, strict=False):
            for k, each in enumerate(own.values(), start):
                self.table[members, k] = [option.tolerance for option in each]
                self.prices[members, k] = [option.cost for option in each]
        self.scale = float(np.sum(np.abs(self.prices))) or 1.0
        self.rows: list[Array] = []  # rows · unknowns ≤ right
        self.right: list[float] = []
        self.listed: set[int] = set()

    # Sizes of the linear problem

    @property
    def chosen(self) -> int:
        """How many 0/1 numbers there are."""
        return self.starts[-1]

    @property
    def columns(self) -> int:
        """How many unknowns there are."""
        return self.chosen + len(self.task.unit) + len(self.task.costs)

    def unmet(self) -> list[Finding]:
        """Why no choice keeps the limits: told only where the narrowest half widths are the best to be had."""
        if any(not names for names in self.names):
            which = next(k for k, names in enumerate(self.names) if not names)
            one = self.problem.contributions[self.members[which][0]]
            return [
                Finding(
                    "no option of the group lies within the bounds of all its members",
                    f"costs.{one.name}",
                    "widen the bounds",
                )
            ]
        if not self.limits.rising and np.all(self.limits.room > 0):
            return []
        return shortfalls(self.problem, self.narrowest())

    def narrowest(self) -> Array:
        """The least half widths of all, m or rad."""
        t = self.task.tolerances(self.task.low)
        for start, width, members in zip(self.starts, self.widths, self.members, strict=False):
            t[members] = np.min(self.table[members, start : start + width], axis=1)
        return t

    def run(self) -> Answer:
        """Rounds of linear problem and completion until they meet."""
        best, bound = _Best(), -np.inf
        for g, cost in self.task.costs:
            del cost
            for share in STARTS:
                self._price_tangents(share * self.task.high, only=g)
        rounds = 0
        while rounds < ROUNDS:
            rounds += 1
            found = self._linear()
            if found is None:
                bound = best.cost
                break
            unknowns, bound = found
            if bound >= best.cost - PROVEN * self.scale:
                break
            taken = unknowns[: self.chosen] > 0.5
            u = np.clip(unknowns[self.chosen :][: len(self.task.unit)], self.task.low, self.task.high)
            self._break(taken, u)
            self._complete(taken, u, best)
        return self._answer(best, bound, rounds)

    def _linear(self) -> tuple[Array, float] | None:
        """The linear problem's unknowns and cost; None if no choice is left."""
        task, count = self.task, len(self.task.unit)
        aim = np.concatenate([self.prices.sum(axis=0), np.zeros(count), np.ones(len(task.costs))]) / self.scale
        once = np.zeros((len(self.widths), self.columns))
        for row, (start, width) in enumerate(zip(self.starts, self.widths, strict=False)):
            once[row, start : start + width] = 1.0
        rules = [LinearConstraint(once, 1.0, 1.0)]
        if self.rows:
            rules.append(LinearConstraint(np.array(self.rows), -np.inf, np.array(self.right)))
        low = np.concatenate([np.zeros(self.chosen), task.low, np.full(len(task.costs), -np.inf)])
        high = np.concatenate([np.ones(self.chosen), task.high, np.full(len(task.costs), np.inf)])
        kinds = np.concatenate([np.ones(self.chosen), np.zeros(count + len(task.costs))])
        found = milp(aim, integrality=kinds, bounds=Bounds(low, high), constraints=rules, options={"mip_rel_gap": 0.0})
        if found.x is None:
            return None
        bound = found.fun if found.mip_dual_bound is None else min(found.fun, found.mip_dual_bound)
        return np.asarray(found.x), float(bound) * self.scale

    def _tolerances(self, taken: Flags, u: Array) -> Array:
        return np.asarray(self.task.tolerances(u) + self.table @ taken, float)

    def _break(self, taken: Flags, u: Array) -> None:
        """Add the rows that this answer breaks."""
        t = self._tolerances(taken, u)
        value = self.limits.value(t)
        broken = np.flatnonzero(value > 1 + ALLOWED)
        for k in broken[np.argsort(-value[broken], kind="stable")[:AT_ONCE]]:
            self._limit(int(k), t, u)

    def _limit(self, k: int, t: Array, u: Array) -> None:
        """A row of the linear problem for one side, unless it is there in full already."""
        limits, task = self.limits, self.task
        row = np.zeros(self.columns)
        inner = slice(self.chosen, self.chosen + len(task.unit))
        span = task.spans * task.unit
        if not limits.spread[k].any():
            if k in self.listed:
                return
            self.listed.add(k)
            row[: self.chosen], row[inner] = limits.linear[k] @ self.table, limits.linear[k] @ span
            self._add(row, 1.0 - limits.linear[k] @ task.base)
            return
        if limits.factor is None and not limits.linear[k].any():
            squares = limits.spread[k] ** 2
            if k in self.listed and not len(task.unit):
                return
            self.listed.add(k)
            row[: self.chosen] = squares @ self.table**2
            row[inner] = 2 * (squares @ span**2) * u  # u² ≥ 2 û u − û²
            self._add(row, 1.0 - squares @ task.base**2 + float((squares @ span**2) @ u**2))
            return
        gradient = limits.gradient(t, np.array([k]))[0]
        row[: self.chosen], row[inner] = gradient @ self.table, gradient @ span
        self._add(row, 1.0 - float(limits.value(t, np.array([k]))[0]) + gradient @ (t - task.base))

    def _add(self, row: Array, right: float) -> None:
        self.rows.append(row)
        self.right.append(float(right))

    def _price_tangents(self, u: Array, only: int | None = None) -> None:
        """Tangents of the costs at half widths: cost ≥ value + slope (u − û)."""
        for place, (g, cost) in enumerate(self.task.costs):
            t = float(self.task.unit[g] * u[g])
            if (only is not None and g != only) or not t > 0:
                continue
            row = np.zeros(self.columns)
            slope = cost.slope(t) * self.task.unit[g]
            row[self.chosen + g], row[self.chosen + len(self.task.unit) + place] = slope, -1.0
            size = max(abs(slope), 1.0)
            self._add(row / size, (slope * u[g] - cost.value(t)) / size)

    def _complete(self, taken: Flags, u: Array, best: _Best) -> None:
        """With these options: the best half widths of the others; the options are settled and not asked for again."""
        price, point = float(np.sum(self.prices @ taken)), None
        self._forbid(taken)
        if len(self.task.unit):
            self._price_tangents(u)
            part = replace(self.task, base=self.task.base + self.table @ taken)
            least = part.tolerances(part.low)
            if self.limits.rising and np.any(self.limits.value(least) > 1 + ALLOWED):
                self._break(taken, part.low)
                return
            point = minimise(part)
            if point is None:
                return
            price += part.cost(point.u)
            self._price_tangents(point.u)
            for k in point.rows:
                self._limit(int(k), part.tolerances(point.u), point.u)
        elif np.any(self.limits.value(self._tolerances(taken, u)) > 1 + ALLOWED):
            return
        if price < best.cost:
            best.cost, best.taken, best.point = price, taken, point

    def _forbid(self, taken: Flags) -> None:
        row = np.zeros(self.columns)
        row[: self.chosen] = taken
        self._add(row, len(self.widths) - 1.0)

    def _answer(self, best: _Best, bound: float, rounds: int) -> Answer:
        problem = self.problem
        if not np.isfinite(best.cost):
            doubt = Finding(
                "no choice of processes meets the limits", "processes", "widen a limit or add a finer process"
            )
            return none(problem, shortfalls(problem, self.narrowest()) or [doubt])
        u = best.point.u if best.point else np.zeros(0)
        gap = max(best.cost - bound, 0.0) / self.scale + (best.point.gap if best.point else 0.0)
        costs = self.prices @ best.taken
        t = self._tolerances(best.taken, u)
        costs += [one.cost.value(float(t[i])) if one.cost else 0.0 for i, one in enumerate(problem.contributions)]
        flat = [name for names in self.names for name in names]
        choices = {
            problem.contributions[i].name: flat[int(np.flatnonzero(best.taken[start : start + width])[0]) + start]
            for start, width, members in zip(self.starts, self.widths, self.members, strict=False)
            for i in members
        }
        proven = gap <= PROVEN
        what = f"the optimality gap is {gap:.1e} of the cost of the tolerances"
        remedy = "check the orders of magnitude of costs and bounds"
        doubt = Finding.warning("allocation.proven_roughly", "processes", what, remedy, gap=gap)
        nothing = np.full(len(problem.effects.worst), np.nan)
        return Answer(
            problem,
            t,
            costs,
            best.cost,
            min(bound, best.cost),
            gap,
            proven,
            choices=choices,
            price=nothing,
            findings=() if proven else (doubt,),
            rounds=rounds,
        )

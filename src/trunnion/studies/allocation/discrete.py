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

from dataclasses import replace
from itertools import accumulate, pairwise

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
    optimum,
    shortfalls,
)
from trunnion.studies.allocation.task import Sides, Task, sides, task_of

__all__ = ["cheapest"]

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]
STARTS = (0.02, 0.06, 0.2, 0.5, 1.0)  # of the largest half width: first tangents of a cost
AT_ONCE = 16  # rows added in one round
ROUNDS = 2000


def cheapest(problem: AllocationProblem) -> Answer:
    """The processes and the half widths of least cost, or why there are none; without processes a conic program."""
    groups = [members for members in problem.groups().values() if members[0].options]
    if not groups:
        return allocate_continuous(problem)
    search = _Search(problem, groups)
    early = search.unmet() if np.any(search.limits.room < 0) else []
    trouble = early or unbounded(search.task) or search.unmet()
    return none(problem, trouble) if trouble else search.run()


class _Search:
    """Outer approximation: unknowns are [0/1 of all options, u of the groups with a cost model, their costs].

    table, prices: half width and cost of every contribution by option, 0 of options of others; parts: the options of
    each group; best: the least cost so far, the options taken, the half widths left.
    """

    def __init__(self, problem: AllocationProblem, groups: list[list[Contribution]]) -> None:
        self.problem = problem
        place = {contribution.name: i for i, contribution in enumerate(problem.contributions)}
        self.limits: Sides = sides(problem)
        self.task: Task = task_of(problem, self.limits)
        self.options = [common_options(members) for members in groups]
        self.members = [[place[contribution.name] for contribution in members] for members in groups]
        ends = [0, *accumulate(map(len, self.options))]
        self.parts = [slice(*pair) for pair in pairwise(ends)]
        self.count = ends[-1]  # of 0/1 numbers
        self.table, self.prices = np.zeros((2, len(place), self.count))
        for part, members, options in zip(self.parts, self.members, self.options, strict=True):
            for k, each in enumerate(options.values(), part.start):
                self.table[members, k] = [option.tolerance for option in each]
                self.prices[members, k] = [option.cost for option in each]
        self.scale = float(np.sum(np.abs(self.prices))) or 1.0
        self.free = slice(self.count, self.count + len(self.task.unit))  # the unknowns u
        self.columns = self.free.stop + len(self.task.costs)
        self.rows: list[Array] = []  # rows · unknowns ≤ right
        self.right: list[float] = []
        self.listed: set[int] = set()  # sides whose row is there in full
        self.best: tuple[float, Flags, Optimum | None] = np.inf, np.zeros(self.count, bool), None

    def unmet(self) -> list[Finding]:
        """Why no choice keeps the limits: told only where the narrowest half widths are the best to be had."""
        for options, members in zip(self.options, self.members, strict=True):
            if not options:
                what = "no option of the group lies within the bounds of all its members"
                return [Finding(what, f"costs.{self.problem.contributions[members[0]].name}", "widen the bounds")]
        if not self.limits.rising and np.all(self.limits.room > 0):
            return []
        return shortfalls(self.problem, self.narrowest())

    def narrowest(self) -> Array:
        """The least half widths of all, m or rad."""
        t = self.task.tolerances(self.task.low)
        for part, members in zip(self.parts, self.members, strict=True):
            t[members] = np.min(self.table[members, part], axis=1)
        return t

    def run(self) -> Answer:
        """Rounds of linear problem and completion until they meet."""
        bound, rounds = -np.inf, 0
        for place in range(len(self.task.costs)):
            for share in STARTS:
                self._price_tangent(place, share * self.task.high)
        while rounds < ROUNDS:
            rounds += 1
            solution = self._linear()
            if solution is None:
                bound = self.best[0]
                break
            unknowns, bound = solution
            if bound >= self.best[0] - PROVEN * self.scale:
                break
            picked = unknowns[: self.count] > 0.5
            u = np.clip(unknowns[self.free], self.task.low, self.task.high)
            self._break(picked, u)
            self._complete(picked, u)
        return self._answer(bound, rounds)

    def _linear(self) -> tuple[Array, float] | None:
        """The linear problem's unknowns and cost; None if no choice is left."""
        task, inner = self.task, self.columns - self.count
        aim = np.concatenate([self.prices.sum(axis=0), np.zeros(len(task.unit)), np.ones(len(task.costs))]) / self.scale
        once = np.zeros((len(self.parts), self.columns))
        for row, part in zip(once, self.parts, strict=True):
            row[part] = 1.0
        rules = [LinearConstraint(once, 1.0, 1.0)]
        if self.rows:
            rules.append(LinearConstraint(np.array(self.rows), -np.inf, np.array(self.right)))
        costs = np.full(len(task.costs), np.inf)
        low, high = (
            np.concatenate(ends)
            for ends in ([np.zeros(self.count), task.low, -costs], [np.ones(self.count), task.high, costs])
        )
        kinds = np.concatenate([np.ones(self.count), np.zeros(inner)])
        optimum = milp(
            aim, integrality=kinds, bounds=Bounds(low, high), constraints=rules, options={"mip_rel_gap": 0.0}
        )
        if optimum.x is None:
            return None
        bound = optimum.fun if optimum.mip_dual_bound is None else min(optimum.fun, optimum.mip_dual_bound)
        return np.asarray(optimum.x), float(bound) * self.scale

    def _tolerances(self, picked: Flags, u: Array) -> Array:
        return np.asarray(self.task.tolerances(u) + self.table @ picked, float)

    def _break(self, picked: Flags, u: Array) -> None:
        """Add the rows that this answer breaks."""
        t = self._tolerances(picked, u)
        value = self.limits.value(t)
        broken = np.flatnonzero(value > 1 + ALLOWED)
        for k in broken[np.argsort(-value[broken], kind="stable")[:AT_ONCE]]:
            self._limit(int(k), t, u)

    def _limit(self, k: int, t: Array, u: Array) -> None:
        """A row of the linear problem for a side: its square where that is linear in 0/1 numbers, else its tangent."""
        limits, task = self.limits, self.task
        flat = not limits.spread[k].any()
        squared = not flat and limits.factor is None and not limits.linear[k].any()
        if k in self.listed and (flat or (squared and not len(task.unit))):
            return
        if flat or squared:
            self.listed.add(k)
        row, span = np.zeros(self.columns), task.spans * task.unit
        if squared:
            squares = limits.spread[k] ** 2
            row[: self.count], free = squares @ self.table**2, squares @ span**2
            row[self.free] = 2 * free * u  # u² ≥ 2 û u − û²
            right = 1.0 - squares @ task.base**2 + free @ u**2
        else:
            gradient = limits.gradient(t, np.array([k]))[0]
            row[: self.count], row[self.free] = gradient @ self.table, gradient @ span
            right = 1.0 - limits.value(t, np.array([k]))[0] + gradient @ (t - task.base)
        self._add(row, right)

    def _add(self, row: Array, right: float) -> None:
        self.rows.append(row)
        self.right.append(float(right))

    def _price_tangent(self, place: int, u: Array) -> None:
        """The tangent of a cost at a half width: cost ≥ value + slope (u − û)."""
        g, cost = self.task.costs[place]
        t = float(self.task.unit[g] * u[g])
        if not t > 0:
            return
        row, slope = np.zeros(self.columns), cost.slope(t) * self.task.unit[g]
        row[self.count + g], row[self.free.stop + place] = slope, -1.0
        size = max(abs(slope), 1.0)
        self._add(row / size, (slope * u[g] - cost.value(t)) / size)

    def _complete(self, picked: Flags, u: Array) -> None:
        """With these options: the best half widths of the others; the options are settled and not asked for again."""
        price, point = float(np.sum(self.prices @ picked)), None
        forbidden = np.zeros(self.columns)
        forbidden[: self.count] = picked
        self._add(forbidden, len(self.parts) - 1.0)
        if len(self.task.unit):
            part = replace(self.task, base=self.task.base + self.table @ picked)
            for place in range(len(self.task.costs)):
                self._price_tangent(place, u)
            if self.limits.rising and np.any(self.limits.value(part.tolerances(part.low)) > 1 + ALLOWED):
                self._break(picked, part.low)
                return
            point = minimise(part)
            if point is None:
                return
            price += part.cost(point.u)
            for place in range(len(self.task.costs)):
                self._price_tangent(place, point.u)
            for k in point.rows:
                self._limit(int(k), part.tolerances(point.u), point.u)
        elif np.any(self.limits.value(self._tolerances(picked, u)) > 1 + ALLOWED):
            return
        if price < self.best[0]:
            self.best = price, picked, point

    def _answer(self, bound: float, rounds: int) -> Answer:
        problem, (cost, picked, point) = self.problem, self.best
        if not np.isfinite(cost):
            remedy = "widen a limit or add a finer process"
            doubt = Finding("no choice of processes meets the limits", "processes", remedy)
            return none(problem, shortfalls(problem, self.narrowest()) or [doubt])
        gap = max(cost - bound, 0.0) / self.scale + (point.gap if point else 0.0)
        t = self._tolerances(picked, point.u if point else np.zeros(0))
        choices = {
            problem.contributions[i].name: list(options)[int(np.flatnonzero(picked[part])[0])]
            for part, members, options in zip(self.parts, self.members, self.options, strict=True)
            for i in members
        }
        no_price = np.full(len(problem.effects.worst), np.nan)
        return optimum(problem, t, self.prices @ picked + problem.costs(t), bound, gap, no_price, rounds, choices)

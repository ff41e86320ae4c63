"""Half widths of least cost that keep all limits: a conic program, mixed-integer where there are options to choose.

Limits are sides, convex functions of the half widths; costs are power and exponential cones, sides with a root of
squares second-order cones. Clarabel also finds a point of the dual problem, whose value no allocation undercuts: that
is the lower bound of the cost.

Where options are to be chosen, one 0/1 number says whether a group takes an option, and sides and costs enter a linear
problem of HiGHS by tangent planes, which lie below what is convex: its answer is a lower bound. Its options are
completed by the conic program in the other half widths, planes at both points are added and the options forbidden,
until the bound meets the best allocation.

P. J. Goulart and Y. Chen, Clarabel: an interior-point solver for conic programs with quadratic objectives,
arXiv:2405.12762. M. A. Duran and I. E. Grossmann, An outer-approximation algorithm for a class of mixed-integer
nonlinear programs, Mathematical Programming 36 (1986) 307–339. Q. Huangfu and J. A. J. Hall, Parallelizing the dual
revised simplex method, Mathematical Programming Computation 10 (2018) 119–142 (HiGHS).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import clarabel
import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.optimize import Bounds, LinearConstraint, milp

from trunnion.errors import Finding
from trunnion.statistics.costs import COST_MODELS, Cost
from trunnion.statistics.distributions import factor
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

Array = NDArray[np.float64]
Rows = NDArray[np.intp]
ACCEPTED = ("Solved", "AlmostSolved", "InsufficientProgress")
INFEASIBLE = ("PrimalInfeasible", "AlmostPrimalInfeasible")
TOLERANCE = 1e-12  # of the solver, far below what its own gap is held to
RESIDUAL = 1e-4  # of the solver's equations: above it its point is none; the gap is that of the point brought back
BROKEN = 1e-9  # of a limit: a side to add
ACTIVE = 1e-6  # of the largest multiplier: a side that limits
ADDED = 16  # sides that one round adds
STARTS = (0.02, 0.06, 0.2, 0.5, 1.0)  # of the largest half width: first tangents of a cost
ROUNDS = 2000  # of the linear problem


def cheapest(problem: AllocationProblem) -> Answer:
    """The half widths and options of least cost with the problem's margin, or why there are none."""
    task = task_of(problem)
    groups = [members for members in problem.groups().values() if members[0].options]
    trouble = [
        Finding("no option of the group lies within the bounds of all its members", f"costs.{members[0].name}",
                "widen the bounds")
        for members in groups if not common_options(members)
    ]  # fmt: skip
    least = problem.narrowest()
    if not trouble and (task.rising or np.any(task.room <= 0)):
        trouble = shortfalls(problem, least)
    what, free = "no limit bounds this tolerance, and wider is cheaper", np.flatnonzero(~np.isfinite(task.most))
    trouble = trouble or [
        Finding.error("allocation.unbounded", f"costs.{task.names[g]}", what, "state `most`") for g in free
    ]
    if trouble:
        return none(problem, trouble)
    answer = None
    try:
        if groups:
            answer = _Choices(problem, task, groups).cheapest()
        elif (point := minimise(task)) is not None:
            tolerances = task.tolerances(point.u)
            price, costs = np.zeros(len(problem.effects.offset)), problem.costs(tolerances)
            np.add.at(price, task.row[point.rows], point.multipliers / task.room[point.rows])
            answer = Answer(problem, tolerances, costs, min(point.bound, float(np.sum(costs))), point.gap, price)
    except ArithmeticError:
        what = "the solver found no allocation, although the limits may be feasible"
        remedy = "check the orders of magnitude of costs and bounds"
        return none(problem, [Finding.error("allocation.not_found", "costs", what, remedy)])
    if answer is None:
        doubt = Finding("no tolerances keep all limits together", "costs", "widen a limit, or add a finer process")
        return none(problem, shortfalls(problem, least) or [doubt])
    return answer


# ---- unknowns, bounds and sides -------------------------------------------------------------------------------


@dataclass(frozen=True)
class Task:
    """Least Σ cost(t) with all sides g_k(t) = linear_k·t + ‖K (spread_k ∘ t)‖ ≤ 1, t = base + spans · (unit ∘ u).

    linear, spread: (side, contribution), in units of the room to the limit; factor: K, Kᵀ K the correlation, None:
    independent; row: whose side it is; room: its unit, that of the measure; rising: whether every g_k rises with every
    t. spans: (contribution, unknown), 0 or 1, an unknown u for each group with a cost; unit: m or rad, (unknown,);
    least, most: bounds of the half width; costs: (unknown, cost) of each contribution with a cost; names: of a
    contribution of each unknown. Contributions with options are left at 0.
    """

    linear: Array
    spread: Array
    factor: Array | None
    row: Rows
    room: Array
    rising: bool
    base: Array
    spans: Array
    unit: Array
    least: Array
    most: Array
    costs: list[tuple[int, Cost]]
    names: list[str]

    def value(self, t: Array, which: Rows | slice = slice(None)) -> Array:
        """g_k(t), (side,)."""
        return np.asarray(self.linear[which] @ t + np.sqrt(np.sum(self._parts(t, which) ** 2, axis=1)), float)

    def gradient(self, t: Array, which: Rows | slice = slice(None)) -> Array:
        """∂g_k/∂t, (side, contribution); where ‖…‖ is 0 the derivative of its linear part alone, a subgradient."""
        parts = self._parts(t, which)
        norm = np.sqrt(np.sum(parts**2, axis=1))[:, None]
        along = np.divide(parts, norm, out=np.zeros_like(parts), where=norm > 0)
        back = along if self.factor is None else along @ self.factor
        return np.asarray(self.linear[which] + self.spread[which] * back, float)

    def _parts(self, t: Array, which: Rows | slice) -> Array:
        deviation = self.spread[which] * t
        return deviation if self.factor is None else deviation @ self.factor.T

    def tolerances(self, u: Array) -> Array:
        """Half widths of all contributions, m or rad."""
        return np.asarray(self.base + self.spans @ (self.unit * u), float)

    def cost(self, u: Array) -> float:
        """What the unknowns cost."""
        return sum(cost.value(float(self.unit[g] * u[g])) for g, cost in self.costs)

    @property
    def low(self) -> Array:
        """Lower bounds of u."""
        return self.least / self.unit

    @property
    def high(self) -> Array:
        """Upper bounds of u."""
        return self.most / self.unit


def task_of(problem: AllocationProblem) -> Task:
    """The sides of a problem's rows that can bind, of a symmetric row only the nearer one, and its unknowns."""
    effects, middle, drift = problem.effects, problem.effects.offset, problem.effects.drift
    spread = problem.margins()[:, None] * effects.spread
    room = np.stack([effects.upper - middle, middle - effects.lower])
    one_sided = np.asarray(~np.any(drift, axis=1))
    keep = np.asarray(np.isfinite(room))
    keep &= ~(one_sided & (room > room[::-1]))
    keep[1] &= ~(one_sided & (room[0] == room[1]))
    matrix, root, least_share = effects.correlation, None, 1.0
    if matrix is not None and spread.any() and not np.array_equal(matrix, np.eye(len(matrix))):
        root, least_share = factor(matrix).T, float(np.sqrt(max(np.linalg.eigvalsh(matrix)[0], 0.0)))
    linear = np.concatenate([(effects.linear + drift)[keep[0]], (effects.linear - drift)[keep[1]]])
    both, rooms = (np.concatenate([part[0][keep[0]], part[1][keep[1]]]) for part in ((spread, spread), room))
    up = np.min(linear, axis=1, initial=0.0) >= 0
    with np.errstate(divide="ignore", invalid="ignore"):  # no effect, no bound; no room is told before it is used
        alone = np.where(up[:, None], rooms[:, None] / (linear + least_share * np.abs(both)), np.inf)
        linear, both = linear / rooms[:, None], both / rooms[:, None]
        pair = ((effects.upper - effects.lower) / 2)[:, None] / (effects.linear + least_share * np.abs(spread))
    bounds = np.concatenate([alone, pair])  # of each half width, as the limits imply them
    implied = np.min(np.where(np.isnan(bounds), np.inf, bounds), axis=0, initial=np.inf)

    groups = [members for members in problem.groups().values() if not members[0].options]
    place = {item.name: i for i, item in enumerate(problem.contributions)}
    spans = np.zeros((len(place), len(groups)))
    least, most, costs = np.zeros(len(groups)), np.zeros(len(groups)), []
    for g, members in enumerate(groups):
        rows = [place[item.name] for item in members]
        spans[rows, g] = 1.0
        least[g] = max(item.least for item in members)
        most[g] = min(min(item.most for item in members), float(np.min(implied[rows])))
        costs += [(g, item.cost) for item in members if item.cost]
    base = np.array([item.value if item.fixed else 0.0 for item in problem.contributions])
    unit = np.where(np.isfinite(most) & (most > 0), np.maximum(most / max(len(groups), 1), least), 1.0)
    side_rows = np.concatenate([np.flatnonzero(keep[0]), np.flatnonzero(keep[1])])
    rising, names = root is None and bool(np.all(up)), [members[0].name for members in groups]
    return Task(linear, both, root, side_rows, rooms, rising, base, spans, unit, least, most, costs, names)


# ---- half widths that may be anything between bounds ----------------------------------------------------------


@dataclass(frozen=True)
class Optimum:
    """Unknowns u, the sides that hold them, with their multipliers, and the lower bound of the cost.

    gap: cost minus bound, as a share of the cost that tolerances change.
    """

    u: Array
    rows: Rows
    multipliers: Array
    bound: float
    gap: float


def minimise(task: Task) -> Optimum | None:
    """The point of least cost; None if none keeps the limits. Raises ArithmeticError if the solver comes to no end.

    Sides that the point breaks are added until there is none: so thousands of rows cost little.
    """
    start = task.tolerances(np.ones(len(task.unit)))
    steep = task.gradient(start) @ task.spans
    nearest = np.argsort(-task.value(start), kind="stable")[:4]
    rows = np.union1d(np.argmax(steep, axis=0) if len(steep) else nearest, nearest).astype(np.intp)
    while True:
        point = _conic(task, rows)
        if point is None:
            return None
        value = task.value(task.tolerances(point.u))
        value[rows] = 0.0
        broken = np.flatnonzero(value > 1 + BROKEN)
        if not len(broken):
            return point
        rows = np.concatenate([rows, broken[np.argsort(-value[broken], kind="stable")[:ADDED]]])


def _conic(task: Task, rows: Rows) -> Optimum | None:
    """The solver's point with these sides alone, brought back within them; A x + s = b with s in cones."""
    count = len(task.unit)
    columns = count + len(task.costs)
    blocks: list[tuple[Any, Array, Array]] = []
    bounds, right = np.zeros((2 * count, columns)), np.concatenate([-task.low, task.high])
    bounds[:count, :count], bounds[count:, :count] = -np.eye(count), np.eye(count)
    bounded = np.isfinite(right)
    if bounded.any():
        blocks.append((clarabel.NonnegativeConeT(int(bounded.sum())), bounds[bounded], right[bounded]))
    for k in rows.tolist():  # (1 − linear·t, K (spread ∘ t)) in a cone, or its first component ≥ 0 alone
        across = np.diag(task.spread[k]) if task.factor is None else task.factor * task.spread[k]
        across = across[np.any(across != 0, axis=1)]
        weights = np.vstack([task.linear[k], -across])
        block = np.zeros((len(weights), columns))
        block[:, :count] = weights @ (task.spans * task.unit)
        right = np.append(1.0, np.zeros(len(across))) - weights @ task.base
        cone = clarabel.SecondOrderConeT(len(right)) if len(across) else clarabel.NonnegativeConeT(1)
        blocks.append((cone, block, right))
    firsts = np.cumsum([0, *(len(right) for _, _, right in blocks)])[len(blocks) - len(rows) : -1]
    shares = np.zeros(columns)
    for place, (g, cost) in enumerate(task.costs, count):
        block, right = np.zeros((3, columns)), np.zeros(3)
        k, ratio = cost.numbers()["k"], float(task.unit[g] / cost.numbers()["unit"])
        if COST_MODELS[cost.model].cone == "power":  # z^α u^(1−α) ≥ 1 with α = 1/(1 + k): z ≥ u^−k
            block[0, place] = block[1, g] = -1.0
            right[2], shares[place] = 1.0, cost.numbers()["B"] * ratio**-k
            blocks.append((clarabel.PowerConeT(1 / (1 + k)), block, right))
        else:  # 1 · exp(−k u / 1) ≤ z
            block[0, g], block[2, place] = k * ratio, -1.0
            right[1], shares[place] = 1.0, cost.numbers()["B"]
            blocks.append((clarabel.ExponentialConeT(), block, right))
    scale = sum(shares.tolist()) or 1.0
    settings = clarabel.DefaultSettings()
    settings.verbose, settings.max_threads = False, 1
    settings.direct_solve_method = "faer"  # its factors leave half widths less open than those of the default
    settings.tol_gap_abs = settings.tol_gap_rel = settings.tol_feas = TOLERANCE
    cones, matrices, rights = zip(*blocks, strict=True)
    square, matrix = sparse.csc_matrix((columns, columns)), sparse.csc_matrix(np.vstack(matrices))
    arguments = square, shares / scale, matrix, np.concatenate(rights), list(cones), settings
    solution = clarabel.DefaultSolver(*arguments).solve()
    if str(solution.status) in INFEASIBLE and not task.rising:  # else the least half widths are within the limits
        return None
    if str(solution.status) not in ACCEPTED or max(solution.r_prim, solution.r_dual) > RESIDUAL:
        raise ArithmeticError(f"the solver ended with {solution.status}")
    u, multipliers = np.asarray(solution.x)[:count], scale * np.maximum(np.asarray(solution.z)[firsts], 0.0)
    u = np.clip(u, task.low, task.high)
    over, least = (np.max(task.value(task.tolerances(at), rows), initial=0.0) for at in (u, task.low))
    if over > 1 > least:  # the solver keeps limits to its tolerance only; on a line to the least the sides are convex
        u = task.low + (1 - least) / (over - least) * (u - task.low)
    active = multipliers > ACTIVE * np.max(multipliers, initial=0.0)
    constant = sum(cost.numbers()["A"] for _, cost in task.costs)
    varying, bound = task.cost(u) - constant, scale * float(solution.obj_val_dual)
    gap = max(varying - bound, 0.0) / (varying or 1.0)
    return Optimum(u, rows[active], multipliers[active], constant + min(bound, varying), gap)


# ---- options of which one is taken ----------------------------------------------------------------------------


class _Choices:
    """Outer approximation: unknowns x are [0/1 of all options, u of the groups with a cost model, their costs].

    span: t = base + span · x; owner: the group of each option; table, prices: half width and cost of every
    contribution by option, 0 of options of others; cuts: rows · x ≤ right; best: the least cost so far, the options
    taken, the other half widths.
    """

    def __init__(self, problem: AllocationProblem, task: Task, groups: list[list[Contribution]]) -> None:
        self.problem, self.task = problem, task
        place = {contribution.name: i for i, contribution in enumerate(problem.contributions)}
        offers = [(g, name, members, each) for g, members in enumerate(groups)
                  for name, each in common_options(members).items()]  # fmt: skip
        self.names = [{place[member.name]: name for member in members} for _, name, members, _ in offers]
        self.count, self.owner = len(offers), np.array([g for g, *_ in offers])
        self.table, self.prices = np.zeros((2, len(place), self.count))
        for k, (_, _, members, each) in enumerate(offers):
            rows = [place[member.name] for member in members]
            self.table[rows, k], self.prices[rows, k] = [each.tolerance for each in each], [each.cost for each in each]
        price = self.prices.sum(axis=0)  # of every option to all of its group
        lowest = np.array([np.min(price[self.owner == g]) for g in range(len(groups))])
        self.excess, self.lowest = price - lowest[self.owner], float(np.sum(lowest))
        self.base_cost = self.lowest + sum(cost.numbers()["A"] for _, cost in task.costs)
        self.free = slice(self.count, self.count + len(task.unit))  # the unknowns u
        self.columns = self.free.stop + len(task.costs)
        self.span = np.zeros((len(place), self.columns))
        self.span[:, : self.count], self.span[:, self.free] = self.table, task.spans * task.unit
        self.cuts: list[tuple[Array, float]] = []
        self.best: tuple[float, NDArray[np.bool_], Optimum | None] = np.inf, np.zeros(self.count, bool), None

    def cheapest(self) -> Answer | None:
        """Rounds of linear problem and completion until they meet; None if no choice keeps the limits."""
        bound = -np.inf
        for share in STARTS:
            self._cut_costs(share * self.task.high)
        for _ in range(ROUNDS):
            solution = self._linear()
            if solution is None:  # no choice is left
                bound = self.best[0]
                break
            x, bound = solution
            if self._gap(bound) <= PROVEN:
                break
            picked, u = x[: self.count] > 0.5, np.clip(x[self.free], self.task.low, self.task.high)
            self._cut_sides(picked, u)
            self._complete(picked, u)
        cost, picked, point = self.best
        if not np.isfinite(cost):
            return None
        t = self.task.tolerances(point.u if point else self.task.low) + self.table @ picked
        places = {i: name for k in np.flatnonzero(picked) for i, name in self.names[k].items()}
        choices = {self.problem.contributions[i].name: name for i, name in places.items()}
        costs = self.prices @ picked + self.problem.costs(t)
        gap = self._gap(bound) + (point.gap if point else 0.0)
        no_price = np.full(len(self.problem.effects.offset), np.nan)
        return Answer(self.problem, t, costs, min(bound, float(np.sum(costs))), gap, no_price, choices)

    def _gap(self, bound: float) -> float:
        """How far the best choice is from a bound, as a share of what it costs beyond the least of any choice."""
        cost = self.best[0]
        return max(cost - bound, 0.0) / ((cost - self.base_cost) or 1.0) if np.isfinite(cost) else np.inf

    def _linear(self) -> tuple[Array, float] | None:
        """The linear problem's unknowns and a lower bound of the cost; None if no choice is left.

        An option that costs more beyond the cheapest of its group than the best choice does in all cannot be part of a
        better one: it is left out, and no price of it makes the problem coarse.
        """
        task, inner = self.task, self.columns - self.count
        allowed = self.excess <= self.best[0] - self.base_cost
        scale = float(np.max(self.excess[allowed], initial=0.0)) or 1.0
        zeros, ones = np.zeros(len(task.unit)), np.ones(len(task.costs))
        aim = np.concatenate([np.where(allowed, self.excess, 0.0), zeros, ones]) / scale
        once = (self.owner == np.unique(self.owner)[:, None]).astype(float)
        rules = [LinearConstraint(np.pad(once, ((0, 0), (0, inner))), 1.0, 1.0)]
        if self.cuts:
            rows, right = zip(*self.cuts, strict=True)
            rules.append(LinearConstraint(np.array(rows), -np.inf, np.array(right)))
        low = np.concatenate([np.zeros(self.count), task.low, -np.inf * ones])
        high = np.concatenate([allowed.astype(float), task.high, np.inf * ones])
        kinds = np.concatenate([np.ones(self.count), np.zeros(inner)])
        answer = milp(aim, integrality=kinds, bounds=Bounds(low, high), constraints=rules, options={"mip_rel_gap": 0.0})
        if answer.x is None:
            return None
        bound = answer.fun if answer.mip_dual_bound is None else min(answer.fun, answer.mip_dual_bound)
        return np.asarray(answer.x), float(bound) * scale + self.lowest

    def _cut_sides(self, picked: NDArray[np.bool_], u: Array, rows: Rows | None = None) -> None:
        """Add planes of these sides, else of those that a point breaks most: the square of a side without a linear part
        where all half widths are options, which is linear in 0/1 numbers, else the tangent."""
        task, x = self.task, np.concatenate([picked, u, np.zeros(self.columns - self.free.stop)])
        t = task.base + self.span @ x
        value = task.value(t)
        if rows is None:
            broken = np.flatnonzero(value > 1 + ALLOWED)
            rows = broken[np.argsort(-value[broken], kind="stable")[:ADDED]]
        for k, slope in zip(rows.tolist(), task.gradient(t, rows), strict=True):
            if not len(u) and task.factor is None and not task.linear[k].any():
                square = task.spread[k] ** 2
                self.cuts.append((square @ self.span**2, float(1.0 - square @ task.base**2)))
            else:
                row = slope @ self.span
                self.cuts.append((row, float(1.0 - value[k] + row @ x)))

    def _cut_costs(self, u: Array) -> None:
        """Add the tangents of all costs at half widths: cost ≥ value + slope (u − û)."""
        for place, (g, cost) in enumerate(self.task.costs, self.free.stop):
            t = float(self.task.unit[g] * u[g])
            if t > 0:
                row, slope = np.zeros(self.columns), cost.slope(t) * self.task.unit[g]
                row[self.count + g], row[place] = slope, -1.0
                size = max(abs(slope), 1.0)
                self.cuts.append((row / size, float(slope * u[g] - cost.value(t)) / size))

    def _complete(self, picked: NDArray[np.bool_], u: Array) -> None:
        """With these options: the best half widths of the others; the options are settled and not asked for again."""
        price, point = float(np.sum(self.prices @ picked)), None
        again = np.append(picked.astype(float), np.zeros(self.columns - self.count))
        self.cuts.append((again, float(np.sum(picked)) - 1.0))
        part = replace(self.task, base=self.task.base + self.table @ picked)
        least = part.low if self.task.rising else u
        if (self.task.rising or not len(u)) and np.any(part.value(part.tolerances(least)) > 1 + ALLOWED):
            self._cut_sides(picked, least)
            return
        if len(u):
            point = minimise(part)
            if point is None:
                return
            price += part.cost(point.u)
            self._cut_costs(u)
            self._cut_costs(point.u)
            self._cut_sides(picked, point.u, point.rows)
        if price < self.best[0]:
            self.best = price, picked, point

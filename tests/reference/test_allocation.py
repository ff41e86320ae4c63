"""Allocation: reference values, closed forms, SciPy's optimisers, what cannot be met, and many rows."""

from __future__ import annotations

import time
from dataclasses import replace

import numpy as np
import pytest
from allocations import FOUR_BAR, PRICES, bought, four_bar, random_costs, rocker_sensitivities, rows
from numpy.typing import NDArray
from scipy.optimize import NonlinearConstraint, minimize

from trunnion.statistics.costs import Cost
from trunnion.studies.allocation.problem import AllocationProblem, Answer, Criterion, RowEffects
from trunnion.studies.allocation.solve import solve, trade_off

Array = NDArray[np.float64]
# The cost is flat at its least: half widths that are off by a share ε cost ε² more. The gap that is claimed, 1e-6,
# leaves them open by 1e-3; what the solver comes to at its own tolerance is below 1e-8 of the cost.
COST, HALF_WIDTH = 1e-8, 1e-5


def slsqp(problem: AllocationProblem, start: Array) -> tuple[float, Array]:
    """SciPy's SLSQP from a start, in log t; half widths and cost."""
    costs = [one.cost for one in problem.contributions]

    def cost(x: Array) -> float:
        return sum(one.value(float(t)) for one, t in zip(costs, np.exp(x), strict=True) if one)

    limits = {"type": "ineq", "fun": lambda x: 1 - problem.used(np.exp(x))}
    bounds = [(np.log(max(one.least, 1e-9)), np.log(min(one.most, 1e9))) for one in problem.contributions]
    found = minimize(
        cost, np.log(start), method="SLSQP", bounds=bounds, constraints=limits, options={"ftol": 1e-14, "maxiter": 2000}
    )
    return float(found.fun), np.exp(found.x)


def test_sensitivities_of_the_test_are_those_of_theory() -> None:
    assert rocker_sensitivities(np.radians([60.0]))[0] == pytest.approx(
        (0.013654, -0.013401, -0.015623, 0.006323), abs=5e-7
    )
    assert FOUR_BAR == (100, 30, 90, 70)


def test_four_bar_has_the_allocation_of_theory_and_six_starts_agree() -> None:
    problem = four_bar()
    answer = solve(problem)
    assert answer.tolerances == pytest.approx((0.035238, 0.021336, 0.028878, 0.034654), abs=5e-7)
    assert answer.cost == pytest.approx(16.456705, abs=5e-7)
    assert answer.proven
    assert answer.gap < 1e-9
    assert answer.cost * (1 - 1e-9) <= answer.bound <= answer.cost
    falls = 0.45 * np.array(PRICES) * answer.tolerances**-1.45  # −dC/dt is what the rows take, at their prices
    assert answer.price @ problem.effects.worst == pytest.approx(falls, rel=1e-6)
    rng = np.random.default_rng(0)
    for _ in range(6):
        cost, t = slsqp(problem, np.exp(rng.uniform(-9, -5, 4)))
        assert cost == pytest.approx(answer.cost, rel=1e-8)
        assert t == pytest.approx(answer.tolerances, rel=1e-3)


def test_price_of_a_row_is_what_a_wider_limit_saves() -> None:
    limit, h = np.radians(0.1), 1e-7
    saved = (solve(four_bar(limit=limit - h)).cost - solve(four_bar(limit=limit + h)).cost) / (2 * h)
    answer = solve(four_bar())
    assert np.sum(answer.price) == pytest.approx(saved, rel=1e-6)
    assert set(np.flatnonzero(answer.price)) <= set(answer.active)


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("criterion", ["worst-case", "rss", "yield"])
def test_one_row_has_its_closed_form(criterion: Criterion, seed: int) -> None:
    """Worst case t ∝ (k B/|S|)^(1/(k+1)), else (k B/S²)^(1/(k+2)), with the same k: scaled to the limit."""
    rng = np.random.default_rng(seed)
    k, s, b, limit = rng.uniform(0.3, 2.5), rng.uniform(-3, 3, 6), rng.uniform(0.1, 5, 6), rng.uniform(1e-4, 1)
    costs = [Cost("power", {"B": one, "k": k, "unit": 1e-3}) for one in b]
    answer = solve(AllocationProblem(bought(costs), rows(s[None], limit), criterion, z=2.5))
    if criterion == "worst-case":
        t = (k * b / np.abs(s)) ** (1 / (k + 1))
        t *= limit / np.sum(np.abs(s) * t)
    else:
        t = (k * b / s**2) ** (1 / (k + 2))
        t *= limit / np.sqrt(np.sum((s * t) ** 2)) * (1.0 if criterion == "rss" else 3 / 2.5)
    assert answer.tolerances == pytest.approx(t, rel=HALF_WIDTH)
    assert answer.proven


def test_exponential_costs_of_one_row_have_their_closed_form() -> None:
    """B_i k_i exp(−k_i t_i) = λ S_i: linear in log λ, with all t above 0."""
    s, b, k, limit = np.array([1.0, 2.0, 0.5]), np.array([5.0, 4.0, 3.0]), np.array([3.0, 2.0, 4.0]), 2.0
    costs = [Cost("exponential", {"B": b[i], "k": k[i], "unit": 1.0}) for i in range(3)]
    answer = solve(AllocationProblem(bought(costs), rows(s[None], limit)))
    log_price = (np.sum(s / k * np.log(b * k / s)) - limit) / np.sum(s / k)
    assert answer.tolerances == pytest.approx((np.log(b * k / s) - log_price) / k, rel=HALF_WIDTH)
    assert answer.proven


@pytest.mark.parametrize("seed", range(20))
def test_the_dual_of_a_worst_case_is_worth_its_cost(seed: int) -> None:
    """With prices λ of the rows each half width is by itself where k B/t^(k+1) = Σ λ|S|, or at a bound: six decades."""
    rng = np.random.default_rng(seed)
    effect, limit = rng.normal(size=(12, 5)) * 10 ** rng.uniform(-3, 3, 5), rng.uniform(0.1, 0.5, 12)
    k, b, low, high = rng.uniform(0.3, 2.5, 5), rng.uniform(0.5, 5, 5), 1e-5, 0.2
    costs = [Cost("power", {"B": b[i], "k": k[i], "unit": 1.0}) for i in range(5)]
    answer = solve(AllocationProblem(bought(costs, least=low, most=high), rows(effect, limit)))
    taken = answer.price @ np.abs(effect)
    t = np.clip((k * b / taken) ** (1 / (k + 1)), low, high)
    assert answer.cost == pytest.approx(np.sum(b * t**-k + taken * t) - answer.price @ limit, rel=COST)
    assert np.all(answer.costs * (answer.tolerances / t - 1) ** 2 < 1e-6 * answer.cost)  # six decades of shares of it


@pytest.mark.spread(12)
@pytest.mark.parametrize("seed", range(12))
@pytest.mark.parametrize("criterion", ["worst-case", "rss", "yield"])
def test_random_problems_agree_with_scipy(criterion: Criterion, seed: int) -> None:
    rng = np.random.default_rng(seed)
    count, many = int(rng.integers(2, 7)), int(rng.integers(2, 30))
    effect = rng.normal(size=(many, count))
    more: dict[str, Array] = {}
    if seed % 2:
        more["offset"] = rng.uniform(-0.05, 0.05, many)
        more["mean"] = 0.1 * rng.normal(size=(many, count))
    if seed % 3 == 0:
        more["correlation"] = np.full((count, count), 0.4) + 0.6 * np.eye(count)
    effects = rows(effect, rng.uniform(0.1, 0.5, many), **more)
    problem = AllocationProblem(bought(random_costs(rng, count), least=1e-4, most=0.2), effects, criterion)
    answer = solve(problem)
    assert answer.proven, answer
    assert np.max(answer.used) <= 1 + 1e-9
    cost = min(slsqp(problem, np.full(count, start))[0] for start in (1e-3, 0.01))
    assert answer.cost <= cost * (1 + 1e-7)
    assert answer.cost == pytest.approx(cost, rel=1e-5)


def test_trust_region_agrees_on_the_four_bar_by_rss() -> None:
    problem = four_bar("rss")
    answer = solve(problem)

    def cost(t: Array) -> float:
        return float(sum(one.cost.value(float(x)) for one, x in zip(problem.contributions, t, strict=True) if one.cost))

    inside = NonlinearConstraint(problem.used, -1.0, 1.0)
    found = minimize(
        cost,
        np.full(4, 0.03),
        method="trust-constr",
        bounds=[(1e-3, 1)] * 4,
        constraints=[inside],
        options={"gtol": 1e-9},
    )
    assert answer.cost == pytest.approx(found.fun, rel=1e-6)


def test_fixed_grouped_and_bounded_tolerances() -> None:
    problem = four_bar()
    l1, l2, l3, l4 = problem.contributions
    mixed = replace(
        problem,
        contributions=(
            replace(l1, group="both"),
            replace(l2, cost=None, value=0.02),
            replace(l3, most=0.025),
            replace(l4, group="both"),
        ),
    )
    answer = solve(mixed)
    t = answer.tolerances
    assert answer.proven
    assert t[0] == t[3]
    assert t[1] == 0.02
    assert t[2] == pytest.approx(0.025)
    assert np.max(answer.used) == pytest.approx(1, abs=1e-9)
    assert answer.costs[1] == 0
    worst = np.abs(rocker_sensitivities(np.arange(72) * 2 * np.pi / 72))
    room = np.min((np.radians(0.1) - worst[:, 1] * t[1] - worst[:, 2] * t[2]) / (worst[:, 0] + worst[:, 3]))
    assert t[0] == pytest.approx(room, rel=1e-9)


def test_limits_on_one_side_and_off_the_middle() -> None:
    """0.3 of the room is taken by the middle of the tolerances; the other side has no limit."""
    costs = [Cost("power", {"B": 1.0, "k": 1.0, "unit": 1.0})]
    effects = RowEffects(np.ones((1, 1)), np.array([-np.inf]), np.ones(1), offset=np.array([0.3]))
    assert solve(AllocationProblem(bought(costs), effects)).tolerances[0] == pytest.approx(0.7, rel=1e-12)


def test_what_cannot_be_met_says_where_and_by_how_much() -> None:
    problem = four_bar()
    held = tuple(replace(one, least=0.05) for one in problem.contributions)
    answer = solve(replace(problem, contributions=held))
    assert not answer.found
    text = str(answer.findings[0])
    worst = np.max(np.abs(problem.effects.worst).sum(axis=1)) * 0.05
    assert f"the deviation is {worst:+.6g}" in text
    assert "times the limit" in text
    fixed = (replace(problem.contributions[0], cost=None, value=0.5), *problem.contributions[1:])
    said = str(solve(replace(problem, contributions=fixed)).findings[0])
    assert "first narrow 'l1', which has no cost" in said


def test_a_tolerance_that_nothing_limits_is_refused() -> None:
    costs = [Cost("power", {"B": 1.0, "k": 1.0, "unit": 1.0})] * 2
    effects = rows(np.array([[1.0, 0.0]]), 1.0)
    assert "state `most`" in str(solve(AllocationProblem(bought(costs), effects)).findings[0])
    assert solve(AllocationProblem(bought(costs, most=3.0), effects)).tolerances == pytest.approx([1.0, 3.0])


def test_curve_of_cost_against_accuracy_is_a_power_law_for_power_costs() -> None:
    factors = np.geomspace(0.1, 10, 7)
    costs = [one.cost for one in trade_off(four_bar(), list(factors))]
    assert costs == pytest.approx(16.456705 * factors**-0.45, rel=1e-7)


def test_thousands_of_rows_are_fast() -> None:
    rng = np.random.default_rng(3)
    effect = rng.normal(size=(20_000, 15)) * (1 + 0.2 * rng.normal(size=(20_000, 1)))
    for criterion in ("worst-case", "rss", "yield"):
        began = time.process_time()
        answer: Answer = solve(AllocationProblem(bought(random_costs(rng, 15), most=1.0), rows(effect, 0.2), criterion))
        assert answer.proven
        assert time.process_time() - began < 10

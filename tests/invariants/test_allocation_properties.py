"""An allocation does not depend on units, on the order of anything, or on rows that cannot bind."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from allocations import bought, random_costs, rows
from hypothesis import given, settings
from hypothesis import strategies as st

from trunnion.statistics.costs import Cost
from trunnion.studies.allocation.problem import AllocationProblem, Criterion
from trunnion.studies.allocation.solve import solve

COST, HALF_WIDTH = 1e-6, 1e-3  # the gap that is claimed, and its root: the cost is flat at its least
SEEDS = st.integers(0, 10**6)
CRITERIA = st.sampled_from(["worst-case", "rss", "yield"])


def case(seed: int, criterion: Criterion) -> AllocationProblem:
    """Six rows, four tolerances."""
    rng = np.random.default_rng(seed)
    return AllocationProblem(
        bought(random_costs(rng, 4), most=0.3), rows(rng.normal(size=(6, 4)), rng.uniform(0.1, 0.5, 6)), criterion
    )


@settings(max_examples=15, deadline=None)
@given(SEEDS, CRITERIA, st.floats(-4, 4), st.floats(-4, 4))
def test_units(seed: int, criterion: Criterion, length: float, money: float) -> None:
    """Half widths in another unit, costs in another currency, rows each in their own unit."""
    problem, a, c = case(seed, criterion), 10.0**length, 10.0**money
    first, rng = solve(problem), np.random.default_rng(seed + 1)
    own = rng.uniform(0.01, 100, (6, 1))
    parts = []
    for one in problem.contributions:
        assert one.cost is not None
        given = one.cost.parameters
        cost = Cost(one.cost.model, {**given, "A": c * given["A"], "B": c * given["B"], "unit": a * given["unit"]})
        parts.append(replace(one, cost=cost, most=a * one.most))
    assert problem.effects.half is not None
    effects = rows(own * problem.effects.half / a, own[:, 0] * problem.effects.upper)
    second = solve(replace(problem, contributions=tuple(parts), effects=effects))
    assert second.tolerances == pytest.approx(a * first.tolerances, rel=HALF_WIDTH)
    assert second.cost == pytest.approx(c * first.cost, rel=COST)
    assert second.proven


@settings(max_examples=15, deadline=None)
@given(SEEDS, CRITERIA)
def test_order_and_rows_that_do_not_bind(seed: int, criterion: Criterion) -> None:
    problem, rng = case(seed, criterion), np.random.default_rng(seed + 1)
    first, order, lines = solve(problem), rng.permutation(4), rng.permutation(6)
    assert problem.effects.half is not None
    effect, limit = problem.effects.half[lines][:, order], problem.effects.upper[lines]
    more = rows(np.concatenate([effect, effect, 0.5 * effect]), np.tile(limit, 3))
    parts = tuple(problem.contributions[i] for i in order)
    second = solve(replace(problem, contributions=parts, effects=more))
    assert second.tolerances == pytest.approx(first.tolerances[order], rel=HALF_WIDTH)
    assert second.cost == pytest.approx(first.cost, rel=COST)
    assert first.proven
    assert second.proven


@settings(max_examples=15, deadline=None)
@given(SEEDS)
def test_the_criteria_are_in_order(seed: int) -> None:
    """Worst case costs most; a yield at z = 3 of independent deviations without shift is RSS."""
    worst, rss, share = (solve(case(seed, criterion)) for criterion in ("worst-case", "rss", "yield"))
    assert worst.cost >= rss.cost * (1 - COST)
    assert share.cost == pytest.approx(rss.cost, rel=COST)
    assert share.tolerances == pytest.approx(rss.tolerances, rel=HALF_WIDTH)

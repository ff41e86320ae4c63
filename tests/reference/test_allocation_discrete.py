"""Choice of processes against exhaustive search, alone and mixed with half widths that may be anything."""

from __future__ import annotations

import itertools
from dataclasses import replace

import numpy as np
import pytest
from allocations import random_costs, random_options, rows

from trunnion.model.tolerances import ProcessChoice
from trunnion.studies.allocation.problem import AllocationProblem, Contribution, Criterion
from trunnion.studies.allocation.solve import solve


def exhaustive(problem: AllocationProblem) -> float:
    """The least cost of all choices, infinite if none keeps the limits."""
    best = np.inf
    for picked in itertools.product(*(one.options for one in problem.contributions)):
        cost = sum(one.cost for one in picked)
        if cost < best and np.max(problem.used(np.array([one.tolerance for one in picked]))) <= 1 + 1e-9:
            best = cost
    return best


@pytest.mark.sample(9)
@pytest.mark.spread(20)
@pytest.mark.parametrize("seed", range(24))
@pytest.mark.parametrize("criterion", ["worst-case", "rss", "yield"])
def test_four_dimensions_by_six_processes_equal_exhaustive_search(criterion: Criterion, seed: int) -> None:
    rng = np.random.default_rng(seed)
    many = int(rng.integers(1, 40))
    effect, limit = rng.normal(size=(many, 4)), rng.uniform(0.15, 0.5, many)
    more = {"mean": 0.1 * rng.normal(size=(many, 4))} if seed % 2 else {}
    if seed % 5 == 4:
        more["correlation"] = np.eye(4) + 0.6 * (np.eye(4, k=1) + np.eye(4, k=-1)) * np.array([1, 1, 0, 0])[:, None]
        more["correlation"] = (more["correlation"] + more["correlation"].T) / 2
    parts = tuple(Contribution(f"p{i}", options=random_options(rng, 6)) for i in range(4))
    problem = AllocationProblem(parts, rows(effect, limit, **more), criterion)
    answer, best = solve(problem), exhaustive(problem)
    assert answer.found == np.isfinite(best)
    if answer.found:
        assert answer.cost == pytest.approx(best, abs=1e-9)
        assert answer.proven
        assert np.max(answer.used) <= 1 + 1e-9
        assert list(answer.choices) == ["p0", "p1", "p2", "p3"]
    else:
        assert answer.findings


@pytest.mark.spread(12)
@pytest.mark.parametrize("seed", range(8))
@pytest.mark.parametrize("criterion", ["worst-case", "rss", "yield"])
def test_a_mixture_equals_the_best_of_all_choices(criterion: Criterion, seed: int) -> None:
    rng = np.random.default_rng(100 + seed)
    many = int(rng.integers(1, 20))
    effects = rows(rng.normal(size=(many, 4)), rng.uniform(0.1, 0.5, many))
    free = tuple(Contribution(f"q{i}", cost=cost, most=0.3) for i, cost in enumerate(random_costs(rng, 2)))
    chosen = tuple(Contribution(f"p{i}", options=random_options(rng, 4)) for i in range(2))
    problem = AllocationProblem(chosen + free, effects, criterion)
    answer, best = solve(problem), np.inf
    for picked in itertools.product(*(one.options for one in chosen)):
        held = tuple(Contribution(one.name, value=each.tolerance) for one, each in zip(chosen, picked, strict=True))
        part = solve(replace(problem, contributions=held + free))
        if part.found:
            best = min(best, part.cost + sum(one.cost for one in picked))
    assert answer.found == np.isfinite(best)
    if answer.found:
        assert answer.cost == pytest.approx(best, rel=1e-8)
        assert answer.proven


def test_a_group_takes_the_option_of_one_name() -> None:
    grades = (ProcessChoice("IT7", 0.01, 9.0), ProcessChoice("IT8", 0.02, 5.0), ProcessChoice("IT9", 0.03, 2.0))
    larger = tuple(ProcessChoice(one.name, 1.5 * one.tolerance, one.cost + 1) for one in grades)
    parts = (Contribution("a", options=grades, group="g"), Contribution("b", options=larger, group="g"))
    answer = solve(AllocationProblem(parts, rows(np.ones((1, 2)), 0.05)))
    assert answer.choices == {"a": "IT8", "b": "IT8"}
    assert answer.tolerances == pytest.approx([0.02, 0.03])
    assert answer.cost == 11


def test_no_choice_says_what_the_finest_take() -> None:
    parts = (Contribution("a", options=(ProcessChoice("fine", 0.01, 9.0), ProcessChoice("rough", 0.1, 1.0))),)
    answer = solve(AllocationProblem(parts, rows(np.ones((1, 1)), 0.005)))
    assert not answer.found
    assert "+0.01, 2 times the limit" in str(answer.findings[0])

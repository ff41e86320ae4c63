"""Allocation by yield: the margin that normal deviations need, and its correction by what is sampled."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from allocations import bought, four_bar, random_options, rows
from numpy.typing import NDArray
from scipy.special import ndtr, ndtri
from scipy.stats import multivariate_normal

from trunnion.errors import Severity
from trunnion.statistics.costs import Cost
from trunnion.studies.allocation.problem import AllocationProblem, Contribution, SampledYield
from trunnion.studies.allocation.solve import solve, trade_off
from trunnion.studies.allocation.yields import Verify, normal_yield

Array = NDArray[np.float64]
PLAIN = Cost("power", {"B": 1.0, "k": 1.0, "unit": 1.0})


def sampled(problem: AllocationProblem, wider: float = 1.0, count: int = 100_000) -> Verify:
    """A yield of normal deviations by plain samples, with standard deviations `wider` than reckoned."""

    def verify(t: Array, number: int) -> SampledYield:
        rng = np.random.default_rng(5 + number)
        draws = rng.normal(size=(count, len(t))) @ (wider * problem.effects.sigma() * t).T
        share = float(np.mean(np.all((draws <= problem.effects.upper) & (draws >= problem.effects.lower), axis=1)))
        half = 1.96 * float(np.sqrt(share * (1 - share) / count))
        return SampledYield(share, share - half, share + half)

    return verify


@pytest.mark.parametrize("target", [0.9, 0.9973, 0.999999])
def test_one_row_has_the_margin_of_the_normal_distribution(target: float) -> None:
    problem = AllocationProblem(bought([PLAIN] * 3), rows(np.array([[1.0, -2.0, 0.5]]), 0.1), "yield")
    answer = solve(problem, target=target)
    assert answer.problem.z == pytest.approx(ndtri((1 + target) / 2), rel=1e-6)
    assert answer.expected == pytest.approx(target, abs=1e-9)


def test_independent_rows_multiply() -> None:
    problem = AllocationProblem(bought([PLAIN] * 3), rows(np.diag([1.0, 2.0, 3.0]), 0.1), "yield")
    t = np.array([0.15, 0.07, 0.04])
    each = 2 * ndtr(0.1 / (np.array([1.0, 2.0, 3.0]) * t / 3)) - 1
    assert normal_yield(problem, t) == pytest.approx(float(np.prod(each)), abs=3e-4)


def test_dependent_shifted_rows_agree_with_scipy() -> None:
    """Two rows of three deviations, the first with a shift: the normal distribution of two numbers over a box."""
    effect, mean = np.array([[1.0, 2.0, -1.0], [0.5, -1.0, 2.0]]), np.array([[0.3, 0.0, 0.2], [0.0, 0.0, 0.0]])
    problem = AllocationProblem(bought([PLAIN] * 3), rows(effect, np.array([0.1, 0.12]), mean=mean), "yield")
    t = np.array([0.06, 0.05, 0.07])
    sigma = effect * t / 3
    box = multivariate_normal(mean @ t, sigma @ sigma.T)
    exact = box.cdf(np.array([0.1, 0.12]), lower_limit=np.array([-0.1, -0.12]))
    assert normal_yield(problem, t) == pytest.approx(float(exact), abs=3e-4)


@pytest.mark.slow
def test_four_bar_meets_its_yield_when_sampled() -> None:
    problem = four_bar("yield")
    reckoned = solve(problem, target=0.9973)
    answer = solve(problem, target=0.9973, verify=sampled(problem, count=400_000))
    assert answer.sampled is not None
    assert answer.sampled.low <= 0.9973 <= answer.sampled.high
    assert answer.checked is not None
    assert answer.checked.high >= 0.9973
    assert len(answer.trials) <= 8
    assert answer.cost == pytest.approx(reckoned.cost, rel=5e-3)
    assert solve(four_bar("rss")).cost < reckoned.cost < solve(four_bar()).cost


@pytest.mark.slow
@pytest.mark.parametrize("wider", [0.7, 1.3])
def test_what_is_sampled_tightens_and_loosens(wider: float) -> None:
    """Deviations wider than reckoned by a factor need half widths narrower by it."""
    problem = four_bar("yield")
    answer = solve(problem, target=0.99, verify=sampled(problem, wider))
    assert answer.sampled is not None
    assert answer.sampled.low <= 0.99 <= answer.sampled.high
    assert 2 <= len(answer.trials) <= 10
    assert answer.tolerances == pytest.approx(solve(problem, target=0.99).tolerances / wider, rel=2e-2)


@pytest.mark.slow
@pytest.mark.parametrize("sure", [False, True])
def test_fresh_samples_correct_those_that_chose(sure: bool) -> None:
    """Samples that chose flatter the answer (here by 3 % of its deviations): fresh ones raise the margin."""
    problem = four_bar("yield")
    flattering, honest, numbers = sampled(problem, 0.97), sampled(problem), []

    def verify(t: Array, number: int) -> SampledYield:
        if number:
            numbers.append(number)
        return (honest if number else flattering)(t, number)

    answer = solve(problem, target=0.99, verify=verify, sure=sure)
    plain = solve(problem, target=0.99, verify=flattering)
    assert answer.checked is not None
    assert answer.sampled is not None
    assert plain.sampled is not None
    assert 0.99 <= plain.sampled.share < answer.sampled.share
    assert (answer.checked.low if sure else answer.checked.high) >= 0.99 > honest(plain.tolerances, 1).high
    assert answer.cost > plain.cost
    assert numbers == [*range(1, len(numbers) + 1)]
    assert all(finding.severity is Severity.NOTE for finding in answer.findings)


@pytest.mark.parametrize("sure", [False, True])
@pytest.mark.parametrize("low_and_high", [(0.45, 0.55), (0.87, 0.91)])
def test_a_yield_that_fresh_samples_never_have_is_told(low_and_high: tuple[float, float], sure: bool) -> None:
    """An error, but a note if it may be chance and nobody asks to be sure."""
    problem, fresh = four_bar("yield", positions=12), SampledYield(sum(low_and_high) / 2, *low_and_high)
    chosen = SampledYield(0.901, 0.9005, 0.92)
    answer = solve(problem, target=0.9, verify=lambda t, number: fresh if number else chosen, sure=sure)
    (finding,) = answer.findings
    assert finding.code == "yield.missed"
    assert finding.figures["share"] == fresh.share
    assert finding.severity is (Severity.NOTE if fresh.high >= 0.9 and not sure else Severity.ERROR)


def bounded(problem: AllocationProblem, count: int = 20_000) -> Verify:
    """A yield with every contribution at either end of its tolerance, half and half: no tail at all."""

    def verify(t: Array, number: int) -> SampledYield:
        rng = np.random.default_rng(5 + number)
        draws = rng.choice([-1.0, 1.0], size=(count, len(t))) @ (problem.effects.sigma() * t).T
        share = float(np.mean(np.all((draws <= problem.effects.upper) & (draws >= problem.effects.lower), axis=1)))
        half = 1.96 * float(np.sqrt(max(share * (1 - share), 1e-9) / count))
        return SampledYield(share, share - half, share + half)

    return verify


@pytest.mark.parametrize(("room", "kept"), [(0.12, True), (0.09, False)])
def test_samples_decide_where_the_distribution_has_no_tail(room: float, kept: bool) -> None:
    """A fixed contribution that is ±0.1 at either end, and another limit: z σ = 0.26 for normal ones is far beyond."""
    parts = (Contribution("fixed", 1.0), *bought([PLAIN] * 2))
    effects = replace(
        rows(np.array([[0.3, 0.0, 0.0], [0.0, 1.0, 1.0]]), np.array([room, 0.1])), labels=("measures.a", "measures.b")
    )
    problem = AllocationProblem(parts, effects, "yield")
    assert [finding.code for finding in solve(problem, target=0.99).findings] == ["yield.missed"]
    answer = solve(problem, target=0.99, verify=bounded(problem))
    if kept:
        assert not answer.findings
        assert answer.sampled is not None
        assert answer.sampled.share >= 0.99
        assert answer.expected < 0.99
        assert answer.tolerances[1:] == pytest.approx([0.15, 0.15], rel=0.01)  # two of a third at once are 0.1
        costs = [one.cost for one in trade_off(answer.problem, [1.0, 1.2])]
        assert costs[0] == pytest.approx(answer.cost, rel=1e-6)
        assert costs[1] < costs[0]
    else:
        assert [finding.severity for finding in answer.findings] == [Severity.ERROR]


PLAY = 0.038  # of two pins in the direction of the limit, of ±0.08 m: within it, though normal deviations are not


def with_pins(t: Array, seed: int, count: int = 100_000) -> SampledYield:
    """A yield with two pins anywhere in their holes, and three lengths that are normal."""
    rng = np.random.default_rng(seed)
    holes = PLAY * np.sqrt(rng.random((2, count))) * np.cos(2 * np.pi * rng.random((2, count)))
    share = float(np.mean(np.abs(np.sum(holes, axis=0) + rng.normal(size=(count, 3)) @ t[2:] / 3) <= 0.08))
    half = 1.96 * float(np.sqrt(share * (1 - share) / count))
    return SampledYield(share, share - half, share + half)


def test_plays_that_nearly_fill_a_limit_leave_the_others_what_samples_say() -> None:
    """Normal deviations would fail whatever is bought. Three equal lengths have one half width, found by bisection."""
    pins = (Contribution("one", 1.0), Contribution("other", 1.0))
    effects = rows(np.array([[1.5 * PLAY, 1.5 * PLAY, 1.0, 1.0, 1.0]]), 0.08)
    problem = AllocationProblem((*pins, *bought([PLAIN] * 3, least=0.002)), effects, "yield")
    assert solve(problem, target=0.998).findings
    answer = solve(problem, target=0.998, verify=lambda t, number: with_pins(t, 1 + number))
    low, high = 0.002, 0.08
    while high - low > 1e-6:
        half = (low + high) / 2
        enough = with_pins(np.array([1.0, 1.0, half, half, half]), 99, 400_000)[0] >= 0.998
        low, high = (half, high) if enough else (low, half)
    assert answer.cost == pytest.approx(3 / low, rel=0.05)
    assert answer.cost < 0.2 * 3 / 0.002
    assert len(answer.trials) <= 12
    assert all(finding.severity is Severity.NOTE for finding in answer.findings)


@pytest.mark.slow
def test_processes_meet_a_yield_at_least_cost() -> None:
    rng = np.random.default_rng(2)
    parts = tuple(Contribution(f"p{i}", options=random_options(rng, 6)) for i in range(4))
    problem = AllocationProblem(parts, rows(rng.normal(size=(5, 4)), 0.12), "yield")
    answer = solve(problem, 0.95, sampled(problem, count=100_000))
    assert answer.sampled is not None
    assert answer.sampled.share >= 0.95
    assert not answer.findings


def test_a_yield_out_of_reach_is_told() -> None:
    problem = four_bar("yield")
    held = tuple(replace(one, least=0.08) for one in problem.contributions)
    answer = solve(replace(problem, contributions=held), target=0.9999)
    assert answer.findings
    assert "yield" in str(answer.findings[0]) or not answer.found


def test_cost_falls_along_the_curve() -> None:
    costs = [one.cost for one in trade_off(four_bar("yield", positions=36), [0.5, 1.0, 2.0])]
    assert costs == sorted(costs, reverse=True)


@pytest.mark.parametrize("mean", [0.4, -0.4])
def test_a_shift_counts_on_the_side_it_moves_to(mean: float) -> None:
    """A deviation of mean m t and standard deviation t/3 keeps z of them within ±0.1: (z/3 + |m|) t = 0.1."""
    effects = rows(np.array([[1.0]]), 0.1, mean=np.array([[mean]]))
    answer = solve(AllocationProblem(bought([PLAIN]), effects, "yield", z=2.5))
    assert answer.tolerances == pytest.approx(0.1 / (2.5 / 3 + 0.4), rel=1e-9)

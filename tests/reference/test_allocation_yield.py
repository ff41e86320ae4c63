"""Allocation by yield: the margin that normal deviations need, and its correction by what is sampled."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from allocations import bought, four_bar, random_options, rows
from numpy.typing import NDArray
from scipy.special import ndtr, ndtri
from scipy.stats import multivariate_normal

from trunnion.statistics.costs import Cost
from trunnion.studies.allocation.problem import AllocationProblem, Contribution
from trunnion.studies.allocation.solve import solve, trade_off
from trunnion.studies.allocation.yields import normal_yield

Array = NDArray[np.float64]
PLAIN = Cost("power", {"B": 1.0, "k": 1.0, "unit": 1.0})


def sampled(problem: AllocationProblem, wider: float = 1.0, count: int = 400_000) -> object:
    """A yield of normal deviations by plain samples, with standard deviations `wider` than reckoned."""

    def verify(t: Array) -> tuple[float, float, float]:
        rng = np.random.default_rng(5)
        draws = rng.normal(size=(count, len(t))) @ (wider * problem.effects.sigma() * t).T
        share = float(np.mean(np.all((draws <= problem.effects.upper) & (draws >= problem.effects.lower), axis=1)))
        half = 1.96 * float(np.sqrt(share * (1 - share) / count))
        return share, share - half, share + half

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
    answer = solve(problem, target=0.9973, verify=sampled(problem))  # type: ignore[arg-type]
    assert answer.sampled is not None
    assert answer.sampled.low <= 0.9973 <= answer.sampled.high
    assert len(answer.trials) <= 3
    assert answer.cost == pytest.approx(reckoned.cost, rel=5e-3)
    assert solve(four_bar("rss")).cost < reckoned.cost < solve(four_bar()).cost


@pytest.mark.slow
@pytest.mark.parametrize("wider", [0.7, 1.3])
def test_what_is_sampled_tightens_and_loosens(wider: float) -> None:
    """Deviations wider than reckoned by a factor need half widths narrower by it."""
    problem = four_bar("yield")
    answer = solve(problem, target=0.99, verify=sampled(problem, wider))  # type: ignore[arg-type]
    assert answer.sampled is not None
    assert answer.sampled.low <= 0.99 <= answer.sampled.high
    assert 2 <= len(answer.trials) <= 6
    assert answer.tolerances == pytest.approx(solve(problem, target=0.99).tolerances / wider, rel=2e-2)


@pytest.mark.slow
def test_fresh_samples_correct_those_that_chose() -> None:
    """Samples that chose flatter the answer (here by 3 % of its deviations): fresh ones raise the margin."""
    problem = four_bar("yield")
    chosen = solve(problem, target=0.99, verify=sampled(problem, 0.97))  # type: ignore[arg-type]
    fresh, streams = sampled(problem), []

    def check(t: Array, stream: int) -> tuple[float, float, float]:
        streams.append(stream)
        return fresh(t)  # type: ignore[operator,no-any-return]

    answer = solve(problem, "continuous", 0.99, sampled(problem, 0.97), check)  # type: ignore[arg-type]
    assert answer.checked is not None
    assert answer.sampled is not None
    assert chosen.sampled is not None
    assert chosen.sampled.share >= 0.99
    assert chosen.sampled.share < answer.sampled.share
    assert answer.checked.high >= 0.99 > fresh(chosen.tolerances)[2]  # type: ignore[operator]
    assert answer.cost > chosen.cost
    assert streams == [*range(1, len(streams) + 1)]
    assert not answer.findings


@pytest.mark.parametrize(("check", "code"), [((0.5, 0.45, 0.55), "yield.check_missed"),
                                             ((0.89, 0.87, 0.91), "yield.check_uncertain")])  # fmt: skip
def test_a_yield_that_fresh_samples_never_have_is_told(check: tuple[float, float, float], code: str) -> None:
    problem = four_bar("yield", positions=12)
    answer = solve(problem, "continuous", 0.9, lambda t: (0.901, 0.88, 0.92), lambda t, stream: check)
    (finding,) = answer.findings
    assert finding.code == code
    assert finding.figures["share"] == check[0]
    assert finding.figures["chosen"] == 0.901


def bounded(problem: AllocationProblem, count: int = 20_000) -> object:
    """A yield with every contribution at either end of its tolerance, half and half: no tail at all."""

    def verify(t: Array) -> tuple[float, float, float]:
        rng = np.random.default_rng(5)
        draws = rng.choice([-1.0, 1.0], size=(count, len(t))) @ (problem.effects.sigma() * t).T
        share = float(np.mean(np.all((draws <= problem.effects.upper) & (draws >= problem.effects.lower), axis=1)))
        half = 1.96 * float(np.sqrt(max(share * (1 - share), 1e-9) / count))
        return share, share - half, share + half

    return verify


@pytest.mark.parametrize(("room", "kept"), [(0.12, True), (0.09, False)])
def test_samples_decide_where_the_distribution_has_no_tail(room: float, kept: bool) -> None:
    """A fixed contribution that is ±0.1 at either end, and another limit: z σ = 0.26 for normal ones is far beyond."""
    parts = (Contribution("fixed", 1.0), *bought([PLAIN] * 2))
    effects = replace(
        rows(np.array([[0.3, 0.0, 0.0], [0.0, 1.0, 1.0]]), np.array([room, 0.1])), labels=("measures.a", "measures.b")
    )
    problem = AllocationProblem(parts, effects, "yield")
    assert not solve(problem, target=0.99).found
    answer = solve(problem, target=0.99, verify=bounded(problem))  # type: ignore[arg-type]
    assert answer.found == kept
    (finding,) = answer.findings
    if kept:
        assert finding.code == "yield.not_normal"
        assert finding.figures["measures"] == ["a"]
        assert answer.sampled is not None
        assert answer.sampled.share >= 0.99
        assert answer.expected < 0.99
        costs = [one.cost for one in trade_off(answer.problem, [0.9, 1.0, 1.2], target=answer.expected)]
        assert costs[1] == pytest.approx(answer.cost, rel=1e-3)
    else:
        assert finding.code == "allocation.impossible"


PLAY = 0.038  # of two pins in the direction of the limit, of ±0.08 m: within it, though normal deviations are not


def with_pins(t: Array, seed: int, count: int = 100_000) -> tuple[float, float, float]:
    """A yield with two pins anywhere in their holes, and three lengths that are normal."""
    rng = np.random.default_rng(seed)
    holes = PLAY * np.sqrt(rng.random((2, count))) * np.cos(2 * np.pi * rng.random((2, count)))
    share = float(np.mean(np.abs(np.sum(holes, axis=0) + rng.normal(size=(count, 3)) @ t[2:] / 3) <= 0.08))
    half = 1.96 * float(np.sqrt(share * (1 - share) / count))
    return share, share - half, share + half


def test_plays_that_nearly_fill_a_limit_leave_the_others_what_samples_say() -> None:
    """Normal deviations would fail whatever is bought. Three equal lengths have one half width, found by bisection."""
    pins = (Contribution("one", 1.0), Contribution("other", 1.0))
    effects = rows(np.array([[1.5 * PLAY, 1.5 * PLAY, 1.0, 1.0, 1.0]]), 0.08)
    problem = AllocationProblem((*pins, *bought([PLAIN] * 3, least=0.002)), effects, "yield")
    assert solve(problem, target=0.998).findings
    answer = solve(problem, "continuous", 0.998, lambda t: with_pins(t, 1), lambda t, stream: with_pins(t, 1 + stream))
    low, high = 0.002, 0.08
    while high - low > 1e-6:
        half = (low + high) / 2
        enough = with_pins(np.array([1.0, 1.0, half, half, half]), 99, 400_000)[0] >= 0.998
        low, high = (half, high) if enough else (low, half)
    assert answer.cost == pytest.approx(3 / low, rel=0.05)
    assert answer.cost < 0.2 * 3 / 0.002
    assert len(answer.trials) <= 8
    assert [one.code for one in answer.findings] == ["yield.not_normal"]


@pytest.mark.slow
def test_processes_meet_a_yield_at_least_cost() -> None:
    rng = np.random.default_rng(2)
    parts = tuple(Contribution(f"p{i}", options=random_options(rng, 6)) for i in range(4))
    problem = AllocationProblem(parts, rows(rng.normal(size=(5, 4)), 0.12), "yield")
    answer = solve(problem, "discrete", 0.95, sampled(problem, count=100_000))  # type: ignore[arg-type]
    assert answer.sampled is not None
    assert answer.sampled.high >= 0.95
    assert not answer.findings


def test_a_yield_out_of_reach_is_told() -> None:
    problem = four_bar("yield")
    held = tuple(replace(one, least=0.08) for one in problem.contributions)
    answer = solve(replace(problem, contributions=held), target=0.9999)
    assert answer.findings
    assert "yield" in str(answer.findings[0]) or not answer.found


def test_cost_falls_along_the_curve() -> None:
    costs = [one.cost for one in trade_off(four_bar("yield", positions=36), [0.5, 1.0, 2.0], target=0.9973)]
    assert costs == sorted(costs, reverse=True)


@pytest.mark.parametrize("mean", [0.4, -0.4])
def test_a_shift_counts_on_the_side_it_moves_to(mean: float) -> None:
    """A deviation of mean m t and standard deviation t/3 keeps z of them within ±0.1: (z/3 + |m|) t = 0.1."""
    effects = rows(np.array([[1.0]]), 0.1, mean=np.array([[mean]]))
    answer = solve(AllocationProblem(bought([PLAIN]), effects, "yield", z=2.5))
    assert answer.tolerances == pytest.approx(0.1 / (2.5 / 3 + 0.4), rel=1e-9)

"""An allocation does not depend on units or order; a wider limit costs no more, what is known to do is not refused."""

import itertools
from dataclasses import replace

import numpy as np
import pytest
from allocations import bought, random_costs, rows, solve
from hypothesis import given, settings
from hypothesis import strategies as st

from trunnion.errors import Severity
from trunnion.model.tolerances import ProcessChoice
from trunnion.statistics.costs import Cost
from trunnion.studies.allocation.problem import AllocationProblem, Contribution, SampledYield

COST, HALF_WIDTH = 1e-6, 1e-3  # the gap that is claimed, and its root: the cost is flat at its least
SEEDS = st.integers(0, 10**6)
CRITERIA = st.sampled_from(["worst-case", "rss", "yield"])


def case(seed, criterion):
    """Six rows, four tolerances."""
    rng = np.random.default_rng(seed)
    return AllocationProblem(
        bought(random_costs(rng, 4), most=0.3),
        rows(rng.normal(size=(6, 4)), rng.uniform(0.1, 0.5, 6), criterion),
        3.0 if criterion == "yield" else 1.0,
    )


@settings(max_examples=15, deadline=None)
@given(SEEDS, CRITERIA, st.floats(-4, 4), st.floats(-4, 4))
def test_units(seed, criterion, length, money):
    """Half widths in another unit, costs in another currency, rows each in their own unit."""
    problem, a, c = case(seed, criterion), 10.0**length, 10.0**money
    first, rng = solve(problem), np.random.default_rng(seed + 1)
    own = rng.uniform(0.01, 100, (6, 1))
    parts = []
    for one in problem.contributions:
        given = one.cost.parameters
        cost = Cost(one.cost.model, {**given, "A": c * given["A"], "B": c * given["B"], "unit": a * given["unit"]})
        parts.append(replace(one, cost=cost, most=a * one.most))
    before = problem.effects
    effects = replace(
        before, linear=own * before.linear / a, spread=own * before.spread / a, upper=own[:, 0] * before.upper,
        lower=own[:, 0] * before.lower,
    )  # fmt: skip
    second = solve(replace(problem, contributions=tuple(parts), effects=effects))
    assert second.tolerances == pytest.approx(a * first.tolerances, rel=HALF_WIDTH, abs=1e-9 * a)
    assert second.cost == pytest.approx(c * first.cost, rel=COST)
    assert second.proven


@settings(max_examples=15, deadline=None)
@given(SEEDS)
def test_the_criteria_are_in_order(seed):
    """Worst case costs most; a yield at z = 3 of independent deviations without shift is RSS."""
    worst, rss, share = (solve(case(seed, criterion)) for criterion in ("worst-case", "rss", "yield"))
    assert worst.cost >= rss.cost * (1 - COST)
    assert share.cost == pytest.approx(rss.cost, rel=COST)
    assert share.tolerances == pytest.approx(rss.tolerances, rel=HALF_WIDTH)


TARGET = 0.995


def press(room, discrete=False):
    """A stroke within ±0.1 that four dimensions and a play move, and a torque that scatters by what is not bought.

    room: of the torque, in standard deviations of what is not bought.
    """
    costs = [Cost("power", {"B": b, "k": 0.6, "unit": 1.0}) for b in (0.9, 0.8, 2.2, 0.7)]
    parts = (*bought(costs, least=0.005, most=0.3), _play(discrete), Contribution("friction", 1.0))
    effect = np.array([[1.0, 1.0, 1.0, 1.0, 1.5, 0.0], [0.09, 0.0, 0.0, 0.02, 0.17, 0.0677 * 3]])
    labels = ("measures.stroke", "measures.torque")
    return AllocationProblem(
        parts, rows(effect, np.array([0.1, room * 0.0677]), "yield", labels=labels, lower=np.array([-0.1, -np.inf]))
    )


def _play(discrete):
    if not discrete:
        return Contribution("play", cost=Cost("power", {"B": 0.8, "k": 0.6, "unit": 1.0}), least=0.01, most=0.06)
    options = (
        ProcessChoice("fine", 0.015, 14.0),
        ProcessChoice("usual", 0.025, 8.0),
        ProcessChoice("coarse", 0.045, 5.0),
    )
    return Contribution("play", options=options)


def sampled(problem, count=100_000, seed=5):
    """A yield of normal deviations by plain samples, the same ones each time, and by fresh ones."""
    draws, others = np.random.default_rng(seed).normal(size=(2, count, len(problem.contributions)))

    def verify(t, number):
        moved = (draws if not number else others) @ (problem.effects.spread * t).T
        share = float(np.mean(np.all((moved <= problem.effects.upper) & (moved >= problem.effects.lower), axis=1)))
        half = 1.96 * float(np.sqrt(max(share * (1 - share), 1e-9) / count))
        return SampledYield(share, share - half, share + half)

    return verify


def refused(answer):
    return not answer.found or any(one.severity is Severity.ERROR for one in answer.findings)


@pytest.mark.slow
@pytest.mark.parametrize("discrete", [False, True])
@pytest.mark.parametrize("samples", [0, 100_000])
def test_a_wider_limit_costs_no_more(discrete, samples):
    """From a limit that what is not bought breaks in 0.494 % to one that it never does; samples scatter by 2 %."""
    costs = []
    for room in (2.58, 2.63, 2.7, 2.78, 2.8, 2.805, 2.83, 3.0, 4.0):
        problem = press(room, discrete)
        answer = solve(problem, TARGET, sampled(problem, samples) if samples else None)
        assert not refused(answer), room
        costs.append(answer.cost)
    allowed = 1.02 if samples else 1 + 1e-4
    assert all(after <= allowed * before for before, after in itertools.pairwise(costs)), costs
    assert costs[-1] < 0.85 * costs[0]


def test_a_limit_next_to_impossible_leaves_the_others_their_room():
    """The margin of the torque is below the one that both limits could have together, and its price is finite."""
    answer = solve(press(2.8), target=TARGET)
    stroke, torque = answer.problem.margins()
    assert 2.57 < torque < 2.8 < stroke < 3.5
    assert np.all(answer.price * 0.1 < answer.cost)


@pytest.mark.parametrize("discrete", [False, True])
def test_a_yield_that_no_half_widths_have_is_refused(discrete):
    """What is not bought breaks a limit more often than all may, by normal deviations and by samples."""
    problem = press(2.5, discrete)
    for verify in (None, sampled(problem)):
        answer = solve(problem, TARGET, verify)
        (finding,) = answer.findings
        assert refused(answer)
        assert finding.code == "yield.missed"
        assert finding.figures["share"] < TARGET

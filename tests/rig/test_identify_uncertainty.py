"""Uncertainty of a fitted constant against closed forms: few turns, turns that follow each other, a shared misfit."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from numpy.typing import NDArray

from trunnion.rig.identification.fit import Block, Fit, evaluations
from trunnion.rig.identification.uncertainty import spread_of
from trunnion.rig.reading.measurement import Signal

Array = NDArray[np.float64]
FAR = 1e3  # of the constant: the same figures wherever it lies


def constant(conditions):
    """The mean of one channel in all conditions as the only unknown; turns: (turn, position) by condition."""

    def courses(x):
        sizes = [one.shape[1] for one in conditions]
        return [SimpleNamespace(values={"torque": np.full(size, x[0])}, slopes={"torque": np.ones((1, size))})
                for size in sizes]  # fmt: skip

    measure = SimpleNamespace(turning=lambda system: False)
    model = SimpleNamespace(
        unknowns=[SimpleNamespace(lower=-np.inf, upper=np.inf)],
        courses=courses,
        measures={"torque": measure},
        run=SimpleNamespace(system=None),
    )
    blocks = [Block(k, "torque", Signal("torque", "effort:A", "N m", turns)) for k, turns in enumerate(conditions)]
    fit = Fit(model, evaluations(model), blocks, [])
    return replace(fit, masks=[np.ones(one.shape[1], bool) for one in conditions], variances=fit.scatter())


@pytest.mark.parametrize("count", [2, 3, 8])
def test_variance_of_a_mean_of_few_turns(count):
    """s²/n with s² of a sample, and n − 1 degrees of freedom."""
    turns = FAR + np.random.default_rng(count).normal(size=(count, 1))
    found = spread_of(constant([turns]), np.array([turns.mean()]))
    assert set(found.parts) == {"scatter"}
    assert found.parts["scatter"][0, 0] == pytest.approx(float(np.var(turns, ddof=1)) / count, rel=1e-9)
    assert found.freedom[0] == pytest.approx(count - 1)


def test_conditions_of_few_turns_join_their_freedoms():
    """Of the mean of two means: (s₁²/n₁ + s₂²/n₂)/4 with the freedom of Welch and Satterthwaite, for equal weights."""
    random = np.random.default_rng(5)
    one = random.normal(size=(4, 1))
    other = one[::-1] * 1.0
    turns = [FAR + one, FAR + other]
    found = spread_of(constant(turns), np.array([np.mean(turns)]))
    own = float(np.var(one, ddof=1)) / 4
    assert found.parts["scatter"][0, 0] == pytest.approx(2 * own / 4, rel=1e-9)
    assert found.freedom[0] == pytest.approx(2 * 3)


def test_how_a_turn_follows_the_one_before():
    """Σ mₖ mₖ₊₁/Σ mₖ² + 1/n: of +1, −1, … twelve times −11/12 + 1/12, and its spread is left as it is."""
    turns = FAR + np.tile([[1.0], [-1.0]], (6, 1))
    found = spread_of(constant([turns]), np.array([FAR]))
    assert found.follows == pytest.approx(-10 / 12, rel=1e-9)
    assert found.parts["scatter"][0, 0] == pytest.approx(12 / 11 / 12, rel=1e-9)


def test_turns_that_are_alike_count_as_fewer():
    """Six up, then six down: (10 − 1)/12 + 1/12 = 10/12; the variance grows by (1 + r)/(1 − r) = 11."""
    turns = FAR + np.repeat([[1.0], [-1.0]], 6, axis=0)
    found = spread_of(constant([turns]), np.array([FAR]))
    assert found.follows == pytest.approx(10 / 12, rel=1e-9)
    assert found.parts["scatter"][0, 0] == pytest.approx(11 * 12 / 11 / 12, rel=1e-9)


def test_freedom_of_the_lack_of_fit_of_turns_with_one_far_off():
    """g χ²_h with the mean and the variance of the squares of the turns, 2 m²/v: those of a sample, (1 + 1/n) of it.

    Deviations n − 1, −1, −1, …: their squares over the mean one are n − 1 and 1/(n − 1); one unknown takes half.
    """
    n = 8
    turns = FAR + np.append(n - 1.0, -np.ones(n - 1))[:, None]
    shares = np.append(n - 1.0, np.full(n - 1, 1 / (n - 1)))
    assert shares.mean() == pytest.approx(1.0)
    found = spread_of(constant([turns]), np.array([FAR]))
    assert found.test.freedom == pytest.approx(2 * 0.5**2 / (np.var(shares, ddof=1) * (1 + 1 / n)), rel=1e-9)


def test_variance_of_a_mean_of_the_turns_that_have_a_value():
    """s²/m with s² of the m turns that are there, wherever the others are missing."""
    turns = FAR + np.random.default_rng(4).normal(size=(9, 1))
    there = turns[[0, 2, 3, 7]]
    turns[[1, 4, 5, 6, 8]] = np.nan
    found = spread_of(constant([turns]), np.array([there.mean()]))
    assert found.parts["scatter"][0, 0] == pytest.approx(float(np.var(there, ddof=1)) / 4, rel=1e-9)


@pytest.mark.parametrize("length", [1, 20])
@pytest.mark.parametrize("share", [0.0, 0.1, 0.4])
def test_lack_of_fit_of_a_true_model_is_one_where_values_are_missing(share, length):
    """White noise about a constant, a share of its values lost singly or in bursts: χ² is 1 in the mean of 60 draws."""
    random, found = np.random.default_rng(12), []
    for _ in range(60):
        turns = FAR + random.normal(size=(15, 180))
        starts = random.random(size=turns.size) < share / length
        lost = np.convolve(starts, np.ones(length), "full")[: turns.size] > 0
        turns[lost.reshape(turns.shape)] = np.nan
        found.append(spread_of(constant([turns]), np.array([np.nanmean(turns)])).test)
    assert np.mean([one.reduced for one in found]) == pytest.approx(1.0, abs=0.04)
    assert not any(one.misfit for one in found)


@pytest.mark.parametrize("count", [2, 3])
def test_a_misfit_that_conditions_share_is_not_independent(count):
    """The same wave left over in each of C conditions tells C times the variance of waves a share of a turn apart."""
    positions, turns = 32, 6
    angle = 2 * np.pi * np.arange(positions) / positions
    noise = 0.01 * np.random.default_rng(1).normal(size=(turns, positions))
    noise -= noise.mean(axis=0)

    def misfit(apart):
        waves = [FAR + np.sin(angle + k * apart) + noise for k in range(count)]
        found = spread_of(constant(waves), np.array([FAR]))
        assert found.test.misfit
        return found.parts["misfit"]

    shared, own = misfit(0.0), misfit({2: np.pi / 2, 3: 2 * np.pi / 3}[count])
    assert shared[0, 0] / own[0, 0] == pytest.approx(count, rel=1e-9)

"""The search for extremes between positions: order, invariance, jumps, gaps, derivatives."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from trunnion.algebra.dual import Dual, derivative, primal
from trunnion.measures.extremes import Grid, largest

TURN = 2 * np.pi


def series(seed: int, orders: int = 4) -> Any:
    """A periodic function with a few harmonics and its derivative."""
    rng = np.random.default_rng(seed)
    a, phase = rng.normal(size=orders) / np.arange(1, orders + 1) ** 2, rng.uniform(0, TURN, orders)
    k = np.arange(1, orders + 1)

    def value(x: Any) -> Any:
        return np.sum(a * np.cos(k * np.asarray(x)[..., None] + phase), axis=-1)

    return value


def top_of(value: Any) -> tuple[float, float]:
    """Highest value and its place, by a fine grid and Newton's method on it."""
    x = np.linspace(0, TURN, 20_001)
    best = x[np.argmax(value(x))]
    h = 1e-3
    for _ in range(6):
        slope = (value(best + h) - value(best - h)) / (2 * h) - (
            value(best + 2 * h) - 2 * value(best + h) + 2 * value(best - h) - value(best - 2 * h)
        ) / (12 * h)
        best = best - slope / ((value(best + h) - 2 * value(best) + value(best - h)) / h**2)
    return float(value(best)), float(best)


def grid(count: int, start: float = 0.0) -> Grid:
    return Grid(start + TURN * np.arange(count) / count, TURN)


@given(st.integers(0, 10_000), st.floats(0, TURN))
def test_does_not_depend_on_where_the_positions_lie(seed: int, start: float) -> None:
    value = series(seed)
    best, _ = top_of(value)
    positions = grid(90, start)
    found = largest(value(positions.at), positions)
    assert found.value == pytest.approx(best, abs=2e-7)
    assert value(found.place) == pytest.approx(best, abs=2e-7)


@pytest.mark.spread(1)
@pytest.mark.parametrize("periodic", [True, False])
def test_order(periodic: bool) -> None:
    """Value of seventh order, place of sixth, in a period and in a range."""
    errors = []
    for count in (60, 120, 240):
        worst = np.zeros(2)
        for seed in range(20):
            value = series(seed, 3)
            best, place = top_of(value)
            for shift in np.linspace(0, TURN / 60, 7):
                positions = grid(count, place - 2.0 + shift)
                if not periodic:
                    positions = Grid(positions.at)
                found = largest(value(positions.at), positions)
                worst = np.maximum(worst, [abs(found.value - best), abs((found.place - place + 1) % TURN - 1)])
        errors.append(worst)
    rates = np.log2(errors[0] / errors[1])
    assert rates[0] > 6.5
    assert rates[1] > 5.5


@given(st.integers(0, 10_000), st.floats(1e-9, 1e9), st.floats(-1e3, 1e3))
def test_scale_and_shift(seed: int, scale: float, shift: float) -> None:
    positions = grid(72)
    curve = series(seed)(positions.at)
    found, other = largest(curve, positions), largest(scale * (curve + shift), positions)
    assert other.value == pytest.approx(scale * (found.value + shift), rel=1e-9, abs=1e-9 * scale)
    rolled = largest(np.roll(curve, 17), positions)
    assert rolled.value == pytest.approx(found.value, rel=1e-13, abs=1e-13)


@pytest.mark.slow
@given(st.integers(0, 10_000), st.floats(0.1, 5.0))
def test_a_jump_adds_nothing(seed: int, step: float) -> None:
    """Never above what smooth parts and the jump together have: no overshoot where a curve jumps or has a kink."""
    positions = grid(60)
    value = series(seed)
    rng = np.random.default_rng(seed)
    first, last = np.sort(rng.uniform(0, TURN, 2))
    x = np.linspace(0, TURN, 100_001)

    def jumping(place: Any) -> Any:
        return value(place) + step * ((place > first) & (place < last))

    found = largest(jumping(positions.at), positions).value
    supremum = max(np.max(value(x)), np.max(value(x) + step * ((x > first) & (x < last))))
    assert found <= supremum + 2e-4 * np.ptp(value(x))
    assert found >= np.max(jumping(positions.at))


def test_of_a_kink() -> None:
    """The highest position, as it is."""
    positions = grid(60)
    curve = -np.abs(np.sin((positions.at - 1.03) / 2))
    found = largest(curve, positions)
    assert found.value == np.max(curve)
    assert found.inside  # it turns back there all the same
    assert found.place == positions.at[np.argmax(curve)]


def test_ends_of_a_range() -> None:
    """A rising line is highest at its end; a top between the first two positions is found; few positions do."""
    positions = Grid(np.linspace(0, 1, 11))
    found = largest(np.array([positions.at, -positions.at]), positions)
    np.testing.assert_array_equal(found.value, [1.0, 0.0])
    np.testing.assert_array_equal(found.inside, [False, False])
    for place in (0.03, 0.07, 0.96, 0.5):
        found = largest(-((positions.at - place) ** 2), positions)
        assert found.value == pytest.approx(0, abs=1e-14)
        assert found.place == pytest.approx(place, abs=1e-13)
        assert found.inside
    for count in (1, 2, 3, 4, 5, 6):
        at = np.linspace(0, 1, count)
        assert largest(-((at - 0.4) ** 2), Grid(at)).value == pytest.approx(0 if count > 2 else -0.16, abs=1e-14)
        assert np.isfinite(largest(np.cos(TURN * at), Grid(at, 1.5)).value)


def test_positions_at_other_distances() -> None:
    """Where the first and the last step are shorter, as at the ends of a window."""
    at = np.concatenate([[0.03], np.linspace(0.1, 0.9, 17), [0.913]])
    for place in (0.05, 0.12, 0.5, 0.905):
        found = largest(np.cos(at - place), Grid(at))
        assert found.value == pytest.approx(1, abs=1e-11)
        assert found.place == pytest.approx(place, abs=1e-8)


def test_gaps_and_equal_values() -> None:
    positions = grid(12)
    curve = np.array([np.cos(positions.at), np.cos(positions.at), np.full(12, 3.0), np.zeros(12)])
    curve[1, 5] = np.nan
    found = largest(curve, positions)
    np.testing.assert_allclose(found.value, [1, np.nan, 3, 0], atol=1e-15)
    assert np.isnan(found.place[1])


@given(st.integers(0, 10_000))
def test_derivatives(seed: int) -> None:
    """Of value and place by a parameter, against two searches; lanes of parameters beside lanes of samples."""
    positions = grid(72)
    curve, change = series(seed)(positions.at), series(seed + 1)(positions.at)
    step = 1e-6
    found = largest(Dual(curve, np.array([change, 2 * change])), positions)
    plus, minus = largest(curve + step * change, positions), largest(curve - step * change, positions)
    if not (plus.inside and minus.inside and found.inside.all()):
        return
    slope = (plus.value - minus.value) / (2 * step)
    moved = (plus.place - minus.place) / (2 * step)
    np.testing.assert_allclose(derivative(found.value), [slope, 2 * slope], rtol=1e-5, atol=1e-7)
    np.testing.assert_allclose(derivative(found.place), [moved, 2 * moved], rtol=1e-4, atol=1e-5)
    np.testing.assert_allclose(primal(found.value), largest(curve, positions).value, rtol=1e-13)
    coordinate = found.of(3.0 * positions.at + 1.0, 3.0 * TURN)
    np.testing.assert_allclose(derivative(coordinate), 3 * derivative(found.place), rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(primal(coordinate), 3 * primal(found.place) + 1, rtol=1e-12)

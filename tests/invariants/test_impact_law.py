"""Impacts of rigid bodies keep their law, and never gain energy."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from trunnion.dynamics.impact_law import OPEN, STICK, strike

seeds = st.integers(0, 2**32 - 1)


@given(seeds, st.integers(1, 3), st.integers(0, 2), st.floats(0, 1), st.floats(0, 2))
def test_an_impact_keeps_its_law_and_gains_nothing(
    seed: int, places: int, more: int, restitution: float, friction: float
) -> None:
    """Random masses, ways and rates, with as many coordinates as places or more."""
    random = np.random.default_rng(seed)
    count = places + 1 + more
    root = random.normal(size=(count, count))
    mass = root @ root.T + 0.05 * np.eye(count)
    ways = random.normal(size=(2 * places, count))
    rate = random.normal(size=count)
    before = ways @ rate
    spread = np.linalg.solve(mass, ways.T)
    own, rough = np.full(places, restitution), np.full(places, friction)
    found = strike(ways @ spread, before, own, rough)
    assert found is not None
    after = rate + spread @ found.impulse
    energy = 0.5 * rate @ mass @ rate
    assert 0.5 * after @ mass @ after <= energy * (1 + 1e-9)
    assert energy - 0.5 * after @ mass @ after - found.loss <= 1e-9 * (energy + abs(found.loss))
    assert 0.0 <= found.kept <= 1.0
    normal, tangent = found.impulse[:places], found.impulse[places:]
    small = 1e-8 * max(np.max(np.abs(found.impulse)), 1e-300)
    speed = 1e-8 * np.max(np.abs(before))
    back = -found.kept * own * np.minimum(before[:places], 0.0)
    for k, case in enumerate(found.cases):
        assert found.after[k] >= back[k] - speed
        assert normal[k] >= -small
        assert abs(tangent[k]) <= friction * normal[k] + small
        if case is OPEN:
            assert normal[k] == 0.0
            continue
        assert abs(found.after[k] - back[k]) <= speed
        slip = found.after[places + k]
        if case == STICK:
            assert abs(slip) <= speed
        elif friction > 0.0:
            assert slip * case >= -speed
            assert abs(tangent[k] + case * friction * normal[k]) <= small


def test_two_places_on_one_wall_share_an_impulse() -> None:
    """Their slips are one, so that the tangential equations are singular."""
    ways = np.array([[1.0, -0.5, 0.0], [1.0, 0.5, 0.0], [0.0, 0.0, 1.0], [0.0, 0.0, 1.0]])
    spread = np.linalg.solve(np.diag([1.0, 0.1, 1.0]), ways.T)
    found = strike(ways @ spread, ways @ np.array([-1.0, 0.0, 0.3]), np.full(2, 0.5), np.full(2, 2.0))
    assert found is not None
    assert abs(found.after - [0.5, 0.5, 0.0, 0.0]).max() < 1e-14
    assert abs(found.impulse[2:].sum() + 0.3) < 1e-14

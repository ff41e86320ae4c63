"""Every friction law at one load and slip against its formula, worked out here from the numbers."""

from __future__ import annotations

from math import exp, tanh

import pytest

from trunnion.joints.friction import FRICTION_LAWS

N, V = 50.0, 0.02  # N, m/s
NUMBERS = {
    "coefficient": 0.12,
    "static": 0.2,
    "stribeck_speed": 0.01,
    "transition_speed": 0.01,
    "viscous": 0.5,
    "stiffness": 2e4,
    "damping": 30.0,
    "pair_factor": 4 / 3,
    "arm": 5e-4,
}
CURVE = 0.12 + 0.08 * exp(-4.0)  # f + (f_s − f) exp(−(v/v_s)²), v = 2 v_s
FORCES = {
    "coulomb": -4 / 3 * 0.12 * N,
    "viscous": -(4 / 3 * 0.12 + 0.5 * V) * N,
    "stiction": -0.12 * N,
    "stribeck": -(CURVE + 0.5 * V) * N,
    "brown-mcphee": -(0.12 * tanh(8.0) + 0.08 * 2 / 1.75**2 + 0.5 * V) * N,
    "dahl": -0.12 * N,
    "lugre": -(CURVE + 0.5 * V) * N,
    "rolling-bearing": -0.12 * N,
    "rolling": -N,
}


def force(law: str, slip: float, **more: float) -> float:
    known = FRICTION_LAWS[law]
    numbers = {name: NUMBERS[name] for name, declared in known.parameters.items() if not declared.optional}
    return float(known.function(N, slip, **numbers, **more))


@pytest.mark.parametrize("law", FRICTION_LAWS)
def test_force_of_sliding(law: str) -> None:
    assert force(law, V) == pytest.approx(FORCES[law], rel=1e-12)
    assert force(law, -V) == pytest.approx(-FORCES[law], rel=1e-12)


@pytest.mark.parametrize("deflection", [0.0, 2e-6, -3e-6])
def test_bristles_pull_by_their_deflection_its_rate_and_the_speed(deflection: float) -> None:
    """LuGre: −(κ z + σ ż + c v) N with ż = v − κ |v| z/g(v); Dahl: −κ z N."""
    rate = V - 2e4 * V * deflection / CURVE
    assert force("lugre", V, deflection=deflection) == pytest.approx(
        -(2e4 * deflection + 30.0 * rate + 0.5 * V) * N, rel=1e-12
    )
    assert force("dahl", V, deflection=deflection) == pytest.approx(-2e4 * deflection * N, rel=1e-12)


def test_bristles_forget_over_the_way_that_bends_them() -> None:
    """ż = v − d z: steady sliding bends them by v/d = g(v)/κ, Dahl's by f/κ."""
    for law, bent in (("lugre", CURVE / 2e4), ("dahl", 0.12 / 2e4)):
        known = FRICTION_LAWS[law]
        assert known.relaxation is not None
        decay = known.relaxation(V, **{name: NUMBERS[name] for name in known.parameters})
        assert V / decay == pytest.approx(bent, rel=1e-12)


def test_what_jumps_where_sliding_begins_is_larger_at_rest() -> None:
    """The value at rest has the sense of the slip about to begin, as that of sliding has."""
    for law in FRICTION_LAWS.values():
        if law.at_rest is not None:
            numbers = {name: NUMBERS[name] for name in law.parameters}
            assert law.at_rest(N, 1e-300, **numbers) == pytest.approx(-0.2 * N, rel=1e-12)
            assert law.at_rest(N, -1e-300, **numbers) == pytest.approx(0.2 * N, rel=1e-12)
            assert law.interval_at_rest

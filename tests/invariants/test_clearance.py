"""What holds for the play of every pair: turned, mirrored, scaled, named otherwise, it is the same play."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from trunnion.algebra.dual import Dual, derivative
from trunnion.algebra.space import ORIGIN, Frame, compose, relative, turned
from trunnion.joints.clearance import (
    CLEARANCE_MODELS,
    described,
    describing,
    ellipse_error,
    leaning,
    pin_transform,
    pressed,
    turned_by_friction,
    worst_case,
)

angles = st.floats(-3.1, 3.1)
radii = st.floats(1e-7, 1e-2)
lengths = st.floats(5e-3, 1.0)
components = st.floats(-1e4, 1e4).filter(lambda n: n == 0 or abs(n) > 1e-6)
frictions = st.floats(0, 2)
rates = st.floats(-50, 50).filter(lambda n: n == 0 or abs(n) > 1e-9)
MODELS = [model for models in CLEARANCE_MODELS.values() for model in models.values()]
PINS = [CLEARANCE_MODELS["spatial"][kind] for kind in ("revolute", "cylindrical")]


def entries(frame: Frame) -> Any:
    return np.array([[float(n) for n in vector] for vector in frame])


def vectors(count: int) -> Any:
    return st.tuples(*[components] * count)


def spun(vector: Any, angle: float) -> tuple[float, ...]:
    """A vector in x and y turned about z."""
    x, y = np.cos(angle) * vector[0] - np.sin(angle) * vector[1], np.sin(angle) * vector[0] + np.cos(angle) * vector[1]
    return (float(x), float(y), *vector[2:])


# ---- the shift ------------------------------------------------------------------------------------------------


@given(radii, lengths, angles, angles)
def test_names_of_one_seat(rho: float, length: float, beta: float, xi: float) -> None:
    """(β, ξ) ~ (β − 2π, ξ + π) ~ (β, ξ + 2π): one shift."""
    one = entries(pin_transform(rho, length, beta, xi))
    for other in ((beta - 2 * np.pi, xi + np.pi), (beta + 2 * np.pi, xi + np.pi), (beta, xi + 2 * np.pi)):
        np.testing.assert_allclose(entries(pin_transform(rho, length, *other)), one, rtol=0, atol=2e-15)


@given(radii, lengths, angles, angles, angles)
def test_shift_turns_with_its_seat(rho: float, length: float, beta: float, xi: float, turn: float) -> None:
    """Â(β, ξ + φ) = Z(φ) Â(β, ξ) Z(−φ): no direction of the hole is special."""
    about = turned(ORIGIN, turn)
    expected = compose(compose(about, pin_transform(rho, length, beta, xi)), turned(ORIGIN, -turn))
    found = pin_transform(rho, length, beta, xi + turn)
    np.testing.assert_allclose(entries(found), entries(expected), rtol=0, atol=2e-15)


@given(radii, lengths, angles, angles)
def test_shift_in_a_mirror(rho: float, length: float, beta: float, xi: float) -> None:
    """In the mirror y → −y: ξ → −ξ and β → −β. Seen from the other end: β → −β."""
    one = entries(pin_transform(rho, length, beta, xi))
    mirror = np.array([1.0, -1.0, 1.0])
    expected = one * mirror * np.array([[1.0], [-1.0], [1.0], [1.0]])
    np.testing.assert_allclose(entries(pin_transform(rho, length, -beta, -xi)), expected, rtol=0, atol=1e-15)
    opposite = np.array([1.0, 1.0, -1.0])  # z → −z swaps the ends
    expected = one * opposite * np.array([[1.0], [1.0], [-1.0], [1.0]])
    np.testing.assert_allclose(entries(pin_transform(rho, length, -beta, xi)), expected, rtol=0, atol=1e-15)


@given(radii, lengths, angles, angles, st.floats(0.01, 100))
def test_shift_scales(rho: float, length: float, beta: float, xi: float, factor: float) -> None:
    """Twice as large all over: the same rotation, twice the displacement."""
    one, other = (entries(pin_transform(f * rho, f * length, beta, xi)) for f in (1.0, factor))
    np.testing.assert_allclose(other[:3], one[:3], rtol=0, atol=1e-15)
    np.testing.assert_allclose(other[3], factor * one[3], rtol=0, atol=1e-14 * factor * rho)


@given(radii, lengths, angles, angles)
def test_shift_of_the_described_ends(rho: float, length: float, beta: float, xi: float) -> None:
    """[P]'s description and its end offsets are one pin; the offsets come back as β and ξ."""
    ends = described(rho, beta, xi)
    for play in PINS:
        found = entries(play.shift(ends, length))
        np.testing.assert_allclose(found, entries(pin_transform(rho, length, beta, xi)), rtol=0, atol=1e-15)
    found_beta, found_xi = describing(*ends)
    assert float(found_beta) == pytest.approx(beta, abs=1e-14)
    assert np.cos(float(found_xi) - xi) == pytest.approx(1, abs=1e-14)
    assert [np.hypot(*end) for end in ends] == pytest.approx([rho, rho])


@given(st.tuples(angles, angles), st.tuples(angles, angles))
def test_leaning_is_the_shortest_turn(across: tuple[float, float], place: tuple[float, float]) -> None:
    """A rotation whose axis is in x, y: R_xy = R_yx, trace 1 + 2 cos of the lean, and back again by −R's lean."""
    frame = entries(leaning(across, 0.3, place))
    axes = frame[:3]
    np.testing.assert_allclose(axes @ axes.T, np.eye(3), rtol=0, atol=1e-15)
    assert np.linalg.det(axes) == pytest.approx(1, abs=1e-15)
    assert axes[0, 1] == axes[1, 0]
    assert np.trace(axes) == pytest.approx(1 + 2 / np.sqrt(1 + across[0] ** 2 + across[1] ** 2), abs=1e-15)
    assert axes[2] / axes[2, 2] == pytest.approx([*across, 1.0], abs=1e-13)
    there = compose(leaning(across), leaning((-across[0], -across[1])))
    np.testing.assert_allclose(entries(there)[:3], np.eye(3), rtol=0, atol=1e-15)
    back = relative(ORIGIN, leaning(across))
    np.testing.assert_allclose(entries(back)[:3], axes.T, rtol=0, atol=1e-15)


# ---- seats ----------------------------------------------------------------------------------------------------


@given(st.integers(1, 3).flatmap(vectors), radii, st.floats(1e-3, 1e3))
def test_a_seat_depends_on_the_direction_of_the_load(load: tuple[float, ...], rho: float, factor: float) -> None:
    """Odd, the same for any size of load, on the wall; in the middle without load."""
    seat = pressed(load, rho)
    size = float(np.linalg.norm(load))
    if size == 0:
        assert seat == (0.0,) * len(load)
        return
    assert np.linalg.norm(seat) == pytest.approx(rho, rel=1e-15)
    assert pressed(tuple(-n for n in load), rho) == tuple(-n for n in seat)
    np.testing.assert_allclose(pressed(tuple(factor * n for n in load), rho), seat, rtol=1e-14)
    assert float(np.dot(load, seat)) == pytest.approx(float(worst_case([load], [rho])), rel=1e-14)
    assert pressed(tuple(float(n) for n in seat), rho) == pytest.approx(seat, rel=1e-14)


@given(st.integers(1, 3).flatmap(vectors), radii, st.floats(1e-3, 1e5))
def test_a_seat_below_the_least_load_goes_to_the_middle(load: tuple[float, ...], rho: float, least: float) -> None:
    """c = ρ Q/least, along the load; the plain seat above it."""
    seat, plain, size = pressed(load, rho, least), pressed(load, rho), float(np.linalg.norm(load))
    share = min(size / least, 1.0)
    np.testing.assert_allclose(seat, share * np.array(plain), rtol=1e-13, atol=1e-300)


@pytest.mark.slow
@given(st.sampled_from(MODELS), vectors(3), vectors(3), lengths, radii, st.randoms(use_true_random=False))
def test_no_place_in_the_play_does_more_work(
    model: Any, force: tuple[float, ...], moment: tuple[float, ...], length: float, rho: float, random: Any
) -> None:
    """Σ Qᵢ · cᵢ ≤ Σ ρᵢ |Qᵢ| for any offsets in the play."""
    loads = model.loads(force, moment, length)
    most = float(worst_case(loads, [rho] * len(loads)))
    for _ in range(10):
        work = 0.0
        for load in loads:
            offset = np.array([random.uniform(-1, 1) for _ in load])
            work += rho * float(np.dot(load, offset / max(1.0, float(np.linalg.norm(offset)))))
        assert work <= most * (1 + 1e-12)


@given(vectors(3), vectors(3), lengths, angles)
def test_ends_of_a_pin_turn_with_the_load(
    force: tuple[float, ...], moment: tuple[float, ...], length: float, turn: float
) -> None:
    """Loads at the ends of a load turned about the axis are the loads at the ends, turned."""
    for play in PINS:
        plain = play.loads(force, moment, length)
        turned_ = play.loads(spun(force, turn), spun(moment, turn), length)
        scale = 1e-12 * (np.linalg.norm(force) + np.linalg.norm(moment) / length + 1e-300)
        for one, other in zip(plain[:2], turned_[:2], strict=True):
            np.testing.assert_allclose(other, spun(one, turn), rtol=0, atol=scale)


@given(vectors(2), radii, angles)
def test_derivative_of_the_worst_case_is_the_seat(load: tuple[float, float], rho: float, way: float) -> None:
    """∂(ρ |Q|)/∂Q = c: what a little more load adds to the worst case is where the pin lies."""
    assume(np.hypot(*load) > 0)
    direction = (np.cos(way), np.sin(way))
    lifted = tuple(Dual(q, d) for q, d in zip(load, direction, strict=True))
    slope = float(derivative(worst_case([lifted], [rho])))
    assert slope == pytest.approx(float(np.dot(pressed(load, rho), direction)), rel=1e-12, abs=1e-15 * rho)


# ---- friction -------------------------------------------------------------------------------------------------


@given(vectors(2), frictions, rates)
def test_friction_turns_without_changing_the_size(load: tuple[float, float], mu: float, rate: float) -> None:
    """|n| = |Q|; slip the other way turns the other way; the mirror image is turned back; odd in the load."""
    found = np.array(turned_by_friction(load, mu, (rate,)))
    assert np.hypot(*found) == pytest.approx(np.hypot(*load), rel=1e-14)
    other = np.array(turned_by_friction(load, mu, (-rate,)))
    mirrored = np.array(turned_by_friction((load[0], -load[1]), mu, (-rate,)))
    np.testing.assert_allclose(mirrored, found * [1, -1], rtol=1e-14)
    np.testing.assert_allclose(turned_by_friction((-load[0], -load[1]), mu, (rate,)), -found, rtol=1e-14)
    cosine = 1 / np.hypot(1, mu) if rate else 1.0
    np.testing.assert_allclose(found + other, 2 * cosine * np.array(load), rtol=0, atol=1e-14 * np.hypot(*load))


@given(vectors(3), frictions, st.tuples(rates, rates, rates), angles, st.floats(1e-3, 1e3))
def test_friction_of_a_ball_has_no_axes_of_its_own(
    load: tuple[float, ...], mu: float, spin: tuple[float, ...], turn: float, factor: float
) -> None:
    """Turned about z and mirrored with load and spin; any size of spin; |n| = |Q|."""
    size, rate = np.linalg.norm(load), np.linalg.norm(spin)
    assume(size > 0 and rate > 0)
    # near the cone where the ball gets on its pole the contact moves as a square root
    cosine = abs(np.dot(load, spin)) / (size * rate)
    assume(abs(cosine - 1 / np.hypot(1, mu)) > 1e-3)
    found = np.array(turned_by_friction(load, mu, spin), float)
    assert np.linalg.norm(found) == pytest.approx(size, rel=1e-12)
    near = {"rtol": 0.0, "atol": 1e-10 * size}
    np.testing.assert_allclose(turned_by_friction(load, mu, tuple(factor * n for n in spin)), found, **near)
    np.testing.assert_allclose(turned_by_friction(spun(load, turn), mu, spun(spin, turn)), spun(found, turn), **near)
    cycled = turned_by_friction((load[2], load[0], load[1]), mu, (spin[2], spin[0], spin[1]))
    np.testing.assert_allclose(cycled, [found[2], found[0], found[1]], **near)
    # a spin is an axial vector: in the mirror x → −x its other components change sign
    mirrored = turned_by_friction((-load[0], load[1], load[2]), mu, (spin[0], -spin[1], -spin[2]))
    np.testing.assert_allclose(mirrored, [-found[0], found[1], found[2]], **near)
    flat = turned_by_friction((load[0], load[1], 0.0), mu, (0.0, 0.0, spin[2]))
    expected = turned_by_friction((load[0], load[1]), mu, (spin[2],))
    np.testing.assert_allclose(flat[:2], expected, **near)
    assert flat[2] == 0


@given(radii, st.floats(1e-3, 0.1), lengths, angles)
def test_ellipse_error(rho: float, radius: float, length: float, beta: float) -> None:
    """None of a pin that does not lean, most at β = π, the same for ±β, without unit."""
    error = float(ellipse_error(rho, radius, length, beta))
    assert 0 <= error <= float(ellipse_error(rho, radius, length))
    assert float(ellipse_error(rho, radius, length, -beta)) == error
    assert float(ellipse_error(rho, radius, length, 0.0)) == 0
    assert float(ellipse_error(2 * rho, 2 * radius, 2 * length, beta)) == pytest.approx(error, rel=1e-14)


@pytest.mark.parametrize("model", PINS)
def test_a_force_at_one_end_of_a_pin_presses_there_alone(model: Any) -> None:
    """A force at z = ±H/2 has the moment r × F about mid-length; the other end feels nothing of it."""
    force, length = np.array([30.0, -40.0, 0.0]), 0.08
    for end, z in ((0, -length / 2), (1, length / 2)):
        moment = np.cross([0.0, 0.0, z], force)
        loads = model.loads(tuple(force), tuple(moment), length)
        np.testing.assert_allclose(loads[end], force[:2], atol=1e-12)
        np.testing.assert_allclose(loads[1 - end], 0.0, atol=1e-12)

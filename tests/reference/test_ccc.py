"""The spherical kernel and, by transference, the spatial one: closure, published motion, rates, both branches."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mechanisms import Array
from spatial_numbers import apart
from trunnion.algebra.dual import Dual, derivative, functions, parts, primal, seed, spatial
from trunnion.algebra.line import line
from trunnion.algebra.pose import compose, inverse, link
from trunnion.algebra.vector import cross, dot
from trunnion.groups import GROUPS, ccc

COUNT = 4000
TWISTS, DISTANCES = np.radians([25, 70, 55, 60]), [1.0, 3.0, 2.5, 2.8]  # links 12, 23, 34, 41
RCCC = [spatial(alpha, a) for alpha, a in zip(TWISTS, DISTANCES, strict=True)]


def turns(rng: np.random.Generator, count: int) -> list[Dual]:
    """Random joint angles θ + ε s."""
    return [spatial(rng.uniform(-np.pi, np.pi, COUNT), rng.uniform(-2, 2, COUNT)) for _ in range(count)]


def links(rng: np.random.Generator, count: int) -> list[Dual]:
    """Random twists α + ε a, not near 0 and π."""
    return [spatial(rng.uniform(0.3, np.pi - 0.3, COUNT), rng.uniform(-2, 2, COUNT)) for _ in range(count)]


@pytest.mark.parametrize("branch", ccc.BRANCHES)
def test_the_dual_matrices_of_random_chains_close(branch: int) -> None:
    """∏ Z(θ̂) X(α̂) = I on all random chains that can be assembled, but where the axes are within 1e-3 of a plane."""
    rng = np.random.default_rng(5)
    (first,), twists = turns(rng, 1), links(rng, 4)
    loop = ccc.position(first, twists, branch)
    fine = np.isfinite(primal(loop.angles[3])) & (ccc.condition(loop.axes) < 1e3)
    assert np.sum(fine) > COUNT / 3
    real, dual = ccc.closure(loop, twists)
    scale = 1 + sum(np.abs(parts(angle)[1]) for angle in loop.angles)
    assert np.max(real[fine]) < 1e-12
    assert np.max((dual / scale)[fine]) < 1e-12


def test_a_chain_is_found_again_on_one_of_the_branches() -> None:
    """Angles and slides of chains made to close: Z₁X₁Z₂X₂Z₃X₃ is random, Z₄X₄Z(δ̂) undoes it, δ̂ belongs to θ̂₁."""
    rng = np.random.default_rng(8)
    angles, twists = turns(rng, 3), links(rng, 3)
    back = inverse(compose(*(link(angle, twist) for angle, twist in zip(angles, twists, strict=True))))
    x, y, z = back[0][2], back[1][2], back[2][2]
    fourth, rest = functions.arctan2(x, -y), functions.arctan2(back[2][0], back[2][1])
    twists.append(functions.arctan2(functions.sqrt(x * x + y * y), z))
    wanted = [*angles[1:], fourth]
    loops = [ccc.position(angles[0] + rest, twists, branch) for branch in ccc.BRANCHES]
    errors = [sum(missed(a, b) for a, b in zip(loop.angles[1:], wanted, strict=True)) for loop in loops]
    fine = (ccc.condition(loops[0].axes) < 100) & (np.sin(primal(twists[3])) > 0.1)
    assert np.sum(fine) > COUNT / 2
    assert np.max(np.fmin(*errors)[fine]) < 1e-9
    np.testing.assert_array_equal((errors[0] < errors[1])[fine], (np.sin(primal(angles[2])) < 0)[fine])


def missed(found: Dual, wanted: Dual) -> Array:
    """Distance of two dual angles, whole turns aside."""
    return np.abs(np.exp(1j * found.real) - np.exp(1j * wanted.real)) + np.abs(found.dual - wanted.dual)


@given(
    st.lists(st.floats(0.02, np.pi - 0.02), min_size=4, max_size=4),
    st.lists(st.floats(-5, 5), min_size=5, max_size=5),
    st.floats(-np.pi, np.pi),
    st.sampled_from(ccc.BRANCHES),
)
def test_a_chain_closes_or_is_nan(alphas: list[float], lengths: list[float], theta: float, branch: int) -> None:
    twists = [spatial(alpha, a) for alpha, a in zip(alphas, lengths[:4], strict=True)]
    loop = ccc.position(spatial(theta, lengths[4]), twists, branch)
    real, dual = ccc.closure(loop, twists)
    k = ccc.condition(loop.axes)
    if np.isfinite(primal(loop.angles[3])) and k < 1e4:
        assert real < 1e-12
        assert dual < 1e-12 * k * (1 + sum(abs(float(parts(angle)[1])) for angle in loop.angles))


def test_rccc() -> None:
    """Computed for this project by another program from the same closure; θ̂₁ = 60° + ε 0.6."""
    loop = ccc.position(seed(spatial(np.pi / 3, 0.6)), RCCC, -1)
    both = [parts(angle) for angle in loop.angles[1:]]
    theta, s = [primal(real) for real, _ in both], [primal(dual) for _, dual in both]
    np.testing.assert_allclose(theta, [1.238548888088, 1.667054049815, 1.420323026783], rtol=0, atol=1e-12)
    np.testing.assert_allclose(s, [-2.984988238051, -1.044125830083, -2.090785153014], rtol=0, atol=1e-11)
    slope = parts(derivative(loop.angles[3]))
    np.testing.assert_allclose(slope, [-0.489974942726, 0.360995313300], rtol=0, atol=1e-12)


@pytest.mark.parametrize("branch", ccc.BRANCHES)
def test_rates_are_the_derivatives(branch: int) -> None:
    """The dual 3 × 3 system against nested dual numbers, over the turn."""
    theta = np.linspace(0, 2 * np.pi, 73)
    first = spatial(theta, 0.6)
    exact = ccc.position(seed(first), RCCC, branch)
    found = ccc.rates(ccc.position(first, RCCC, branch).axes, (0.0, 0.0, -1.0))
    for rate, angle in zip(found, exact.angles[1:], strict=True):
        for part, expected in zip(parts(rate), parts(derivative(angle)), strict=True):
            np.testing.assert_allclose(part, expected, rtol=1e-11, atol=1e-12)


def test_transference() -> None:
    """The same function on plain angles is the spherical linkage, the real part of the spatial one."""
    theta = np.linspace(0, 2 * np.pi, 73)
    for branch in ccc.BRANCHES:
        spherical = ccc.position(theta, list(TWISTS), branch)
        spatial_loop = ccc.position(spatial(theta, 0.6), RCCC, branch)
        for plain, number in zip(spherical.angles[1:], spatial_loop.angles[1:], strict=True):
            assert not isinstance(plain, Dual)
            np.testing.assert_allclose(plain, number.real, rtol=0, atol=1e-14)


@pytest.mark.parametrize("branch", ccc.BRANCHES)
@pytest.mark.parametrize("delta", np.radians([1.0, 15.0, 45.0]))
def test_ideal_cardan(delta: float, branch: int) -> None:
    """tan θ₁ tan θ₄ = cos δ, γ = θ − 90°: ω₂/ω₁ = cos δ/(1 − sin²δ sin²γ₁)."""
    theta = np.linspace(0.01, 6.27, 97)
    right = spatial(np.pi / 2, 0.0)
    loop = ccc.position(seed(spatial(theta, 0.0)), [right, right, right, spatial(delta, 0.0)], branch)
    output = parts(loop.angles[3])
    np.testing.assert_allclose(np.tan(theta) * np.tan(primal(output[0])), np.cos(delta), rtol=1e-9)
    gamma = theta - np.pi / 2
    ratio = np.cos(delta) / (1 - np.sin(delta) ** 2 * np.sin(gamma) ** 2)
    np.testing.assert_allclose(np.abs(derivative(output[0])), ratio, rtol=1e-12)
    for _, slide in map(parts, loop.angles[1:]):
        np.testing.assert_allclose(primal(slide), 0.0, rtol=0, atol=1e-14)


@pytest.mark.parametrize("twist", [0.0, 0.01, 0.2, 0.5])
@pytest.mark.parametrize("offset", [0.05e-3, 0.5e-3])
def test_imperfect_cardan_closes(twist: float, offset: float) -> None:
    """Twist errors of 0.01° to 0.5° and offsets of 0.05 mm to 0.5 mm: 1e-12 at every position."""
    nominal = np.radians([90 - twist, 90 + twist, 90 - twist, 135 - twist])
    twists = [spatial(alpha, offset * k) for k, alpha in enumerate(nominal, start=-1)]
    for branch in ccc.BRANCHES:
        loop = ccc.position(spatial(np.linspace(0, 2 * np.pi, 361), 0.0), twists, branch)
        real, dual = ccc.closure(loop, twists)
        assert np.max(real) < 1e-12
        assert np.max(dual) < 1e-12


@given(st.floats(0.05, 1.5), st.floats(0.05, 1.5), st.floats(-2, 2), st.floats(-2, 2), st.sampled_from(ccc.BRANCHES))
def test_meet_has_both_angles(alpha: float, beta: float, a: float, c: float, branch: int) -> None:
    """ĉ is a line at the dual angles asked for, on the side of the plane that the branch says; −branch mirrors it."""
    b = line((0.0, 0.0, 0.0), (0.0, 0.0, 1.0))
    d = line((0.3, 0.4, 0.0), (np.sin(1.2), 0.0, np.cos(1.2)))
    bc, cd = spatial(alpha, a), spatial(beta, c)
    found = ccc.meet(b, d, bc, cd, branch)
    if not np.isfinite(primal(found[0])) or abs(primal(dot(found, cross(b, d)))) < 1e-3:
        return
    for cosine, angle in ((dot(found, b), bc), (dot(found, d), cd)):
        for part, expected in zip(parts(cosine), (np.cos(angle.real), -angle.dual * np.sin(angle.real)), strict=True):
            assert float(part) == pytest.approx(expected, abs=1e-10)
    square = dot(found, found)
    assert float(square.real) == pytest.approx(1.0, abs=1e-13)
    assert float(square.dual) == pytest.approx(0.0, abs=1e-10)
    assert np.sign(primal(dot(found, cross(b, d)))) == branch


def test_small_angles_keep_their_digits() -> None:
    """A spherical triangle of a millionth of a radian is a plane one: sides 3, 4, 5."""
    small = 1e-6
    found = ccc.meet((0.0, 0.0, 1.0), (np.sin(3 * small), 0.0, np.cos(3 * small)), 4 * small, 5 * small, 1)
    assert float(found[0]) == pytest.approx(0.0, abs=1e-10 * small)
    assert float(abs(found[1])) == pytest.approx(4 * small, rel=1e-10)


def test_no_silent_number() -> None:
    """Parallel axes, triangles that do not close, dead centres of dual angles, a link without twist."""
    z = line((0.0, 0.0, 0.0), (0.0, 0.0, 1.0))
    beside = line((1.0, 0.0, 0.0), (0.0, 0.0, 1.0))
    angle = spatial(0.5, 0.1)
    assert np.isnan(apart(ccc.meet(z, beside, angle, angle, 1))[0]).all()
    x = line((0.0, 0.0, 0.0), (1.0, 0.0, 0.0))
    assert np.isnan(apart(ccc.meet(z, x, spatial(0.3, 0.0), spatial(0.3, 0.0), 1))[0]).all()
    flat = ccc.meet((0.0, 0.0, 1.0), (1.0, 0.0, 0.0), np.pi / 4, np.pi / 4, 1)
    np.testing.assert_allclose(flat, [np.sqrt(0.5), 0.0, np.sqrt(0.5)], rtol=0, atol=1e-7)
    assert np.isnan(apart(ccc.meet(z, x, spatial(np.pi / 4, 0.0), spatial(np.pi / 4, 0.0), 1))[1]).all()
    loop = ccc.position(angle, [spatial(0.0, 1.0), *RCCC[1:]], 1)
    assert np.isfinite(primal(loop.angles[3])), "joints 1 and 2 may be parallel"
    assert np.isnan(primal(ccc.position(angle, [*RCCC[:2], spatial(0.0, 1.0), RCCC[3]], 1).angles[3]))
    assert "CCC" not in GROUPS, "the table holds planar groups"

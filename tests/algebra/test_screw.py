"""exp and log of screws against SciPy's matrix functions, at every angle and at the two ends of the range."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.linalg import expm

from mechanisms import Array
from spatial_numbers import apart, random_directions, random_rotations, rows, stacked, vector
from trunnion.algebra import pose as poses
from trunnion.algebra import screw as screws
from trunnion.algebra.dual import Dual, derivative, primal, seed
from trunnion.algebra.line import line
from trunnion.algebra.vector import product, scaled, spatial_vector

COUNT = 300
RNG = np.random.default_rng(11)
U, P = random_directions(RNG, COUNT), RNG.normal(size=(COUNT, 3))
ANGLES = [
    0.0,
    1e-300,
    1e-160,
    1e-12,
    1e-8,
    1e-4,
    0.1,
    0.499,
    0.501,
    1.0,
    2.0,
    2.2,
    3.0,
    3.14,
    np.pi - 1e-8,
    np.pi - 1e-13,
]


def screw(theta: Any, s: Any) -> Any:
    return scaled(Dual(theta, s), line(vector(P), vector(U)))


def six_by_six(screw: Any) -> Array:
    """[ω]× and [v]× as the 6 × 6 matrix of v̂ ×."""
    omega, v = apart(screw)
    zero = np.zeros(omega.shape[:-1])

    def tilde(a: Array) -> Array:
        x, y, z = a[..., 0], a[..., 1], a[..., 2]
        return np.moveaxis(np.array([[zero, -z, y], [z, zero, -x], [-y, x, zero]]), (0, 1), (-2, -1))

    w, m = tilde(omega), tilde(v)
    return np.concatenate([np.concatenate([w, 0 * w], -1), np.concatenate([m, w], -1)], -2)


def six(pose: Any) -> Array:
    return np.stack([stacked(row) for row in poses.adjoint(pose)], axis=-2)


@pytest.mark.parametrize("theta", ANGLES)
def test_exp_is_the_matrix_exponential(theta: float) -> None:
    one = screw(np.full(COUNT, theta), RNG.normal(size=COUNT))
    np.testing.assert_allclose(six(screws.exp(one)), expm(six_by_six(one)), rtol=0, atol=1e-13)


@pytest.mark.parametrize("theta", ANGLES)
def test_log_undoes_exp(theta: float) -> None:
    one = screw(np.full(COUNT, theta), RNG.normal(size=COUNT))
    found = screws.log(screws.exp(one))
    for part, expected in zip(apart(found), apart(one), strict=True):
        np.testing.assert_allclose(part, expected, rtol=0, atol=3e-13)


def test_exp_undoes_log_of_any_pose() -> None:
    pose = poses.pose(rows(random_rotations(RNG, COUNT)), vector(P))
    for part, expected in zip(apart(screws.exp(screws.log(pose))), apart(pose), strict=True):
        np.testing.assert_allclose(part, expected, rtol=0, atol=2e-14)


@pytest.mark.slow
def test_half_turn() -> None:
    """Of ± û one is given, with the slide along it; about every axis, those of the frame included."""
    directions = np.concatenate([np.eye(3), -np.eye(3), U])
    for direction in directions:
        one = scaled(Dual(np.pi, 0.7), line((0.3, -0.2, 0.5), tuple(direction)))
        pose = screws.exp(one)
        found = screws.log(pose)
        for part, expected in zip(apart(screws.exp(found)), apart(pose), strict=True):
            np.testing.assert_allclose(part, expected, rtol=0, atol=2e-14)
        assert np.linalg.norm(apart(found)[0]) == pytest.approx(np.pi, abs=1e-15)


def test_pure_translation_and_identity() -> None:
    pose = poses.pose(((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)), (1.0, 2.0, 3.0))
    real, dual = apart(screws.log(pose))
    np.testing.assert_array_equal(real, np.zeros(3))
    np.testing.assert_allclose(dual, [1.0, 2.0, 3.0], rtol=1e-15)
    np.testing.assert_array_equal(stacked(screws.log(poses.compose())), np.zeros(3))
    np.testing.assert_array_equal(stacked(screws.exp((0.0, 0.0, 0.0))), np.eye(3))


@pytest.mark.parametrize("theta", [0.0, 1e-9, 0.05, 0.2, 1.0, 2.5, 3.1])
def test_derivatives(theta: float) -> None:
    """∂/∂t of exp(t û) is û × exp(t û), and log brings it back; at 0 too."""
    one = line((0.3, -0.2, 0.5), (1.0, 2.0, -2.0))
    pose = screws.exp(scaled(seed(Dual(theta, 0.4)), one))
    slopes = tuple(tuple(derivative(entry) for entry in row) for row in pose)
    x, y, z = one
    generator: Any = ((0.0, -z, y), (z, 0.0, -x), (-y, x, 0.0))
    values = tuple(tuple(entry.real for entry in row) for row in pose)
    for part, expected in zip(apart(slopes), apart(product(generator, values)), strict=True):  # type: ignore[arg-type]
        np.testing.assert_allclose(part, expected, rtol=0, atol=2e-13)
    back = tuple(derivative(entry) for entry in screws.log(pose))
    for part, expected in zip(apart(back), apart(one), strict=True):
        np.testing.assert_allclose(part, expected, rtol=0, atol=2e-12)


def test_power_does_not_depend_on_the_origin() -> None:
    """F · v + M · ω, the same for every frame."""
    force, moment, omega, v = RNG.normal(size=(4, COUNT, 3))
    wrench, twist = spatial_vector(vector(force), vector(moment)), spatial_vector(vector(omega), vector(v))
    expected = np.sum(force * v + moment * omega, axis=-1)
    np.testing.assert_allclose(screws.power(wrench, twist), expected, rtol=0, atol=1e-14)
    pose = poses.pose(rows(random_rotations(RNG, COUNT)), vector(P))
    moved = [poses.transform(pose, one) for one in (wrench, twist)]
    np.testing.assert_allclose(screws.power(*moved), expected, rtol=0, atol=1e-12)


def test_bracket_is_the_rate_of_a_carried_screw() -> None:
    carrier, carried = line((0.1, 0.2, 0.3), (1.0, 0.0, 1.0)), line((1.0, -1.0, 0.0), (0.0, 2.0, 1.0))
    pose = screws.exp(scaled(seed(Dual(0.0, 0.0)), carrier))
    rate = tuple(derivative(entry) for entry in poses.transform(pose, carried))
    for part, expected in zip(apart(rate), apart(screws.bracket(carrier, carried)), strict=True):
        np.testing.assert_allclose(part, expected, rtol=0, atol=1e-15)


def test_a_pose_that_is_not_a_number_stays_so() -> None:
    pose = poses.turn_z(Dual(np.array([0.3, np.nan]), np.array([0.0, 0.0])))
    found = np.stack([np.broadcast_to(primal(entry), 2) for entry in screws.log(pose)])
    assert np.isfinite(found[:, 0]).all()
    assert np.isnan(found[:, 1]).any()

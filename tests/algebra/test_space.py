"""Lines, poses and screws against points, directions, 4 × 4 matrices and SciPy's matrix functions; [P 1-7]."""

import numpy as np
import pytest
from scipy.linalg import expm

from spatial_numbers import apart, random_directions, random_rotations, rows, stacked, vector
from trunnion.algebra import lines
from trunnion.algebra.dual import Dual, derivative, parts, primal, seed, spatial
from trunnion.algebra.lines import line
from trunnion.algebra.vector import (
    IDENTITY,
    apply,
    cross,
    plus,
    product,
    scaled,
    skew,
    spatial_vector,
    transpose,
    vector_parts,
)

COUNT = 500
RNG = np.random.default_rng(7)
U, V = random_directions(RNG, COUNT), random_directions(RNG, COUNT)
P, Q = RNG.normal(size=(COUNT, 3)), RNG.normal(size=(COUNT, 3))
FIRST, SECOND = lines.line(vector(P), vector(3 * U)), lines.line(vector(Q), vector(0.1 * V))


def homogeneous(a):
    """4 × 4 matrices of a pose."""
    rotation, point = lines.rotation_and_point(a)
    found = np.zeros((*np.broadcast_shapes(stacked(rotation).shape[:-2], stacked(point).shape[:-1]), 4, 4))
    found[..., :3, :3], found[..., :3, 3], found[..., 3, 3] = stacked(rotation), stacked(point), 1.0
    return found


def same(a, b, tolerance=1e-13):
    np.testing.assert_allclose(a, b, rtol=0, atol=tolerance * max(1.0, float(np.nanmax(np.abs(b)))))


# equations of [P]
def test_p2_dual_angle_is_angle_and_distance():
    """E₁ turned by θ counterclockwise about E₁₂ and moved by s along it lies on E₂."""
    theta, s = RNG.uniform(-np.pi, np.pi, COUNT), RNG.normal(size=COUNT)
    place = lines.pose(rows(random_rotations(RNG, COUNT)), vector(P))
    axis, first = (apply(place, lines.line((0.0, 0.0, 0.0), one)) for one in ((0.0, 0.0, 1.0), (1.0, 0.0, 0.0)))
    moved = product(place, lines.turn_z(spatial(theta, s)))
    angle = lines.angle_about(axis, first, apply(moved, lines.line((0.0, 0.0, 0.0), (1.0, 0.0, 0.0))))
    same(angle.real, theta)
    same(angle.dual, s, 1e-12)


def test_p3_to_p7_dual_frame():
    """Columns î = i + ε [P]× i, k̂ = k + ε [P]× k, ĵ = [k̂]× î."""
    rotation = random_rotations(RNG, COUNT)
    i, j, k = (rotation[..., :, column] for column in range(3))
    found = lines.frame(vector(P), vector(2 * i + 0.3 * k), vector(5 * k))
    tilde = stacked(skew(vector(P)))
    real, dual = apart(found)
    for column, one in enumerate((i, j, k)):
        same(real[..., column], one)
        same(dual[..., column], np.einsum("nij,nj->ni", tilde, one))
    i_hat, j_hat, k_hat = zip(*found, strict=True)
    for part, expected in zip(apart(j_hat), apart(apply(skew(k_hat), i_hat)), strict=True):
        same(part, expected)
    for part, expected in zip(apart(found), apart(lines.pose(rows(rotation), vector(P))), strict=True):
        same(part, expected)


# lines
def test_common_perpendicular():
    found = lines.perpendicular(FIRST, SECOND)
    a, b = (stacked(one) for one in found.feet)
    for foot, point, direction in ((a, P, U), (b, Q, V)):
        same(np.cross(foot - point, direction), np.zeros_like(P), 1e-10)
    normal = stacked(vector_parts(found.line)[0])
    same(np.einsum("ni,ni->n", normal, U), np.zeros(COUNT))
    theta, s = parts(found.angle)
    assert np.all((theta >= 0) & (theta <= np.pi))
    same(np.cos(theta), np.einsum("ni,ni->n", U, V))
    same(b - a, s[:, None] * normal, 1e-10)
    direction, moment = apart(found.line)
    same(np.cross(a, direction), moment, 1e-10)


def test_reciprocal_product():
    angle = lines.dual_angle(FIRST, SECOND)
    same(lines.reciprocal(FIRST, SECOND), -angle.dual * np.sin(angle.real), 1e-12)
    same(lines.reciprocal(FIRST, FIRST), np.zeros(COUNT))


@pytest.mark.parametrize("sense", [1, -1])
def test_parallel_lines_and_lines_without_a_direction_have_no_answer(sense):
    found = lines.perpendicular(FIRST, lines.line(vector(Q), vector(sense * U)))
    for part in (*parts(found.angle), *(primal(entry) for entry in found.line)):
        assert np.isnan(part).all()
    assert all(np.isnan(primal(entry)) for entry in lines.line((0.0, 0.0, 0.0), (0.0, 0.0, 0.0)))


# poses
def random_poses(seed_number):
    rng = np.random.default_rng(seed_number)
    return lines.pose(rows(random_rotations(rng, COUNT)), vector(rng.normal(size=(COUNT, 3))))


def test_product_and_inverse_are_those_of_homogeneous_matrices():
    a, b = random_poses(1), random_poses(2)
    same(homogeneous(product(a, b)), homogeneous(a) @ homogeneous(b))
    same(homogeneous(transpose(a)), np.linalg.inv(homogeneous(a)))


def test_denavit_hartenberg():
    theta, s, alpha, a = RNG.normal(size=(4, COUNT))
    found = homogeneous(lines.link(spatial(theta, s), spatial(alpha, a)))
    c, n, ca, na, zero, one = np.cos(theta), np.sin(theta), np.cos(alpha), np.sin(alpha), 0 * s, 0 * s + 1
    expected = [[c, -n * ca, n * na, a * c], [n, c * ca, -c * na, a * n], [zero, na, ca, s], [zero, zero, zero, one]]
    same(found, np.moveaxis(np.array(expected), (0, 1), (-2, -1)))


def test_lines_and_points_move_together():
    a = random_poses(3)
    rotation, point = lines.rotation_and_point(a)
    moved = lines.line(plus(point, apply(rotation, vector(P))), apply(rotation, vector(U)))
    for part, expected in zip(apart(apply(a, FIRST)), apart(moved), strict=True):
        same(part, expected)


def test_adjoint():
    a = random_poses(4)
    six = np.stack([stacked(row) for row in lines.adjoint(a)], axis=-2)
    screw = np.concatenate(apart(FIRST), axis=-1)
    same((six @ screw[..., None])[..., 0], np.concatenate(apart(apply(a, FIRST)), axis=-1))


def test_the_public_modules_of_dual_vectors_and_screws_go_together():
    from trunnion import dual

    screw = dual.lines.log(dual.lines.frame(point=(0.3, 0.0, 0.1), x=(0, 1, 0), z=(0, 0, 1)))
    size = dual.vectors.length(screw)
    assert float(size.real) == pytest.approx(np.pi / 2)
    assert float(size.dual) == pytest.approx(0.1)


ANGLES = [
    0.0, 1e-300, 1e-160, 1e-12, 1e-8, 1e-4, 0.1, 0.499, 0.501, 1.0, 2.0, 2.2, 3.0, 3.14, np.pi - 1e-8, np.pi - 1e-13,
]  # fmt: skip


def screw(theta, s):
    return scaled(Dual(theta, s), line(vector(P), vector(U)))


def six_by_six(screw):
    """[ω]× and [v]× as the 6 × 6 matrix of v̂ ×."""
    omega, v = apart(screw)
    zero = np.zeros(omega.shape[:-1])

    def tilde(a):
        x, y, z = a[..., 0], a[..., 1], a[..., 2]
        return np.moveaxis(np.array([[zero, -z, y], [z, zero, -x], [-y, x, zero]]), (0, 1), (-2, -1))

    w, m = tilde(omega), tilde(v)
    return np.concatenate([np.concatenate([w, 0 * w], -1), np.concatenate([m, w], -1)], -2)


def six(pose):
    return np.stack([stacked(row) for row in lines.adjoint(pose)], axis=-2)


@pytest.mark.parametrize("theta", ANGLES)
def test_exp_is_the_matrix_exponential(theta):
    one = screw(np.full(COUNT, theta), RNG.normal(size=COUNT))
    np.testing.assert_allclose(six(lines.exp(one)), expm(six_by_six(one)), rtol=0, atol=1e-13)


@pytest.mark.parametrize("theta", ANGLES)
def test_log_undoes_exp(theta):
    one = screw(np.full(COUNT, theta), RNG.normal(size=COUNT))
    for part, expected in zip(apart(lines.log(lines.exp(one))), apart(one), strict=True):
        np.testing.assert_allclose(part, expected, rtol=0, atol=3e-13)


def test_exp_undoes_log_of_any_pose():
    pose = lines.pose(rows(random_rotations(RNG, COUNT)), vector(P))
    for part, expected in zip(apart(lines.exp(lines.log(pose))), apart(pose), strict=True):
        np.testing.assert_allclose(part, expected, rtol=0, atol=2e-14)


@pytest.mark.slow
def test_half_turn():
    """Of ± û one is given, with the slide along it; about every axis, those of the frame included."""
    for direction in np.concatenate([np.eye(3), -np.eye(3), U]):
        pose = lines.exp(scaled(Dual(np.pi, 0.7), line((0.3, -0.2, 0.5), tuple(direction))))
        found = lines.log(pose)
        for part, expected in zip(apart(lines.exp(found)), apart(pose), strict=True):
            np.testing.assert_allclose(part, expected, rtol=0, atol=2e-14)
        assert np.linalg.norm(apart(found)[0]) == pytest.approx(np.pi, abs=1e-15)


def test_pure_translation_and_identity():
    pose = lines.pose(((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)), (1.0, 2.0, 3.0))
    real, dual = apart(lines.log(pose))
    np.testing.assert_array_equal(real, np.zeros(3))
    np.testing.assert_allclose(dual, [1.0, 2.0, 3.0], rtol=1e-15)
    np.testing.assert_array_equal(stacked(lines.log(IDENTITY)), np.zeros(3))
    np.testing.assert_array_equal(stacked(lines.exp((0.0, 0.0, 0.0))), np.eye(3))


@pytest.mark.parametrize("theta", [0.0, 1e-9, 0.05, 0.2, 1.0, 2.5, 3.1])
def test_derivatives(theta):
    """∂/∂t of exp(t û) is û × exp(t û), and log brings it back; at 0 too."""
    one = line((0.3, -0.2, 0.5), (1.0, 2.0, -2.0))
    pose = lines.exp(scaled(seed(Dual(theta, 0.4)), one))
    slopes = tuple(tuple(derivative(entry) for entry in row) for row in pose)
    x, y, z = one
    generator = ((0.0, -z, y), (z, 0.0, -x), (-y, x, 0.0))
    values = tuple(tuple(entry.real for entry in row) for row in pose)
    for part, expected in zip(apart(slopes), apart(product(generator, values)), strict=True):
        np.testing.assert_allclose(part, expected, rtol=0, atol=2e-13)
    back = tuple(derivative(entry) for entry in lines.log(pose))
    for part, expected in zip(apart(back), apart(one), strict=True):
        np.testing.assert_allclose(part, expected, rtol=0, atol=2e-12)


def test_bracket_is_the_rate_of_a_carried_screw():
    carrier, carried = line((0.1, 0.2, 0.3), (1.0, 0.0, 1.0)), line((1.0, -1.0, 0.0), (0.0, 2.0, 1.0))
    pose = lines.exp(scaled(seed(Dual(0.0, 0.0)), carrier))
    rate = tuple(derivative(entry) for entry in apply(pose, carried))
    for part, expected in zip(apart(rate), apart(cross(carrier, carried)), strict=True):
        np.testing.assert_allclose(part, expected, rtol=0, atol=1e-15)


def test_a_pose_that_is_not_a_number_stays_so():
    pose = lines.turn_z(Dual(np.array([0.3, np.nan]), np.array([0.0, 0.0])))
    found = np.stack([np.broadcast_to(primal(entry), 2) for entry in lines.log(pose)])
    assert np.isfinite(found[:, 0]).all()
    assert np.isnan(found[:, 1]).any()


def test_plain_numbers_are_rotations():
    w = vector(2.0 * U)
    real, _ = apart(lines.exp(screw(np.full(COUNT, 2.0), 0.0)))
    np.testing.assert_allclose(stacked(lines.exp(w)), real, rtol=0, atol=1e-15)
    np.testing.assert_allclose(stacked(lines.log(lines.exp(w))), 2.0 * U, rtol=0, atol=1e-14)


def test_power_does_not_depend_on_the_origin():
    """F · v + M · ω, the same for every frame."""
    force, moment, omega, v = RNG.normal(size=(4, COUNT, 3))
    wrench, twist = spatial_vector(vector(force), vector(moment)), spatial_vector(vector(omega), vector(v))
    expected = np.sum(force * v + moment * omega, axis=-1)
    np.testing.assert_allclose(lines.reciprocal(wrench, twist), expected, rtol=0, atol=1e-14)
    pose = lines.pose(rows(random_rotations(RNG, COUNT)), vector(P))
    moved = [apply(pose, one) for one in (wrench, twist)]
    np.testing.assert_allclose(lines.reciprocal(*moved), expected, rtol=0, atol=1e-12)

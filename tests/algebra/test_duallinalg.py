"""Dual factors put together again, and against the derivative along A + t B by central differences."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from mechanisms import Array
from spatial_numbers import random_rotations
from trunnion.algebra import duallinalg as dl
from trunnion.algebra.dual import Dual

LANES = 200
TIGHT = 1e-14
SHAPES = [(1, 1), (2, 2), (3, 3), (6, 6), (4, 2), (6, 3), (9, 6)]
SQUARE = [(n, n) for n in (1, 2, 3, 6)]
STEP = 1e-5


def random(shape: tuple[int, int], seed: int = 0) -> Dual:
    """Stacks with singular values from 1 to 2, evenly apart: the figures then test the formulas, not the condition."""
    rng = np.random.default_rng([*shape, seed])
    m, n = shape
    k = min(m, n)
    u = np.linalg.qr(rng.normal(size=(LANES, m, k)))[0]
    v = np.linalg.qr(rng.normal(size=(LANES, n, k)))[0]
    real = (u * np.linspace(2, 1, k)) @ np.swapaxes(v, -1, -2)
    return Dual(real, rng.normal(size=real.shape))


def symmetric(n: int, seed: int = 0) -> Dual:
    """Positive definite stacks with a symmetric dual part."""
    a = random((n, n), seed)
    b = a.dual + np.swapaxes(a.dual, -1, -2)
    return Dual(a.real @ np.swapaxes(a.real, -1, -2), b)


def same(found: Any, expected: Any, tolerance: float = TIGHT) -> None:
    """Equal to a tolerance relative to the largest entry of each part, over all lanes."""
    for part, other in zip(split(found), split(expected), strict=True):
        scale = max(1.0, float(np.max(np.abs(other))))
        np.testing.assert_allclose(part, np.broadcast_to(other, part.shape), rtol=0, atol=tolerance * scale)


def gives(factors: list[Any], expected: Any, tolerance: float = TIGHT) -> None:
    """The product is what is expected, to a tolerance relative to the largest sum of the sizes of its terms."""
    found = dl.matmul(*factors)
    sizes = dl.matmul(*(Dual(*(np.abs(part) for part in split(one))) for one in factors))
    for part, other, size in zip(split(found), split(expected), split(sizes), strict=True):
        atol = tolerance * float(np.max(size))
        np.testing.assert_allclose(part, np.broadcast_to(other, part.shape), rtol=0, atol=atol)


def split(a: Any) -> tuple[Array, Array]:
    return (a.real, a.dual) if isinstance(a, Dual) else (a, np.zeros_like(a))


def along(a: Dual, t: float) -> Array:
    return a.real + t * a.dual


def difference(function: Any, a: Dual) -> Array:
    """Central difference of fourth order of a function of A + t B at 0."""
    near = function(along(a, STEP)) - function(along(a, -STEP))
    far = function(along(a, 2 * STEP)) - function(along(a, -2 * STEP))
    return (8 * near - far) / (12 * STEP)


def identity(n: int) -> Array:
    return np.eye(n)


# ---- systems --------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("shape", SQUARE)
def test_inverse(shape: tuple[int, int]) -> None:
    a = random(shape)
    gives([a, dl.inverse(a)], identity(shape[0]))
    gives([dl.inverse(a), a], identity(shape[0]))


@pytest.mark.parametrize("shape", SQUARE)
def test_solve(shape: tuple[int, int]) -> None:
    a, b = random(shape), random((shape[0], 2), 1)
    gives([a, dl.solve(a, b)], b)
    vector = Dual(b.real[..., 0], b.dual[..., 0])
    x = dl.solve(a, vector)
    whole = dl.solve(a, b)
    same(x, Dual(whole.real[..., 0], whole.dual[..., 0]))
    one = dl.solve(Dual(a.real[0], a.dual[0]), Dual(vector.real[0], vector.dual[0]))
    same(one, Dual(x.real[0], x.dual[0]))


@pytest.mark.parametrize("shape", SQUARE)
def test_determinant(shape: tuple[int, int]) -> None:
    """det A + ε det A · tr(A⁻¹ B), that of a product, and that of a dual rotation."""
    a, b = random(shape), random(shape, 1)
    found, inverse = dl.determinant(a), np.linalg.inv(a.real)
    trace = np.trace(inverse @ a.dual, axis1=-2, axis2=-1)
    same(found, Dual(np.linalg.det(a.real), np.linalg.det(a.real) * trace))
    same(dl.determinant(dl.matmul(a, b)), dl.determinant(a) * dl.determinant(b))


def test_determinant_of_a_singular_matrix() -> None:
    """tr(adj(A) B), of rank n − 1 and n − 2, against the cofactors."""
    a = random((3, 3))
    for gone in (1, 2):
        u, s, vt = np.linalg.svd(a.real)
        s[..., -gone:] = 0.0
        real = (u * s[..., None, :]) @ vt
        cofactors = np.cross(np.roll(real, -1, axis=-2), np.roll(real, -2, axis=-2))
        found = dl.determinant(Dual(real, a.dual))
        same(found, Dual(np.zeros(LANES), np.sum(cofactors * a.dual, axis=(-2, -1))))
    zero = dl.determinant(Dual(np.zeros((3, 3)), np.eye(3)))
    assert (zero.real, zero.dual) == (0.0, 0.0)


@pytest.mark.parametrize("shape", SHAPES)
def test_pseudoinverse(shape: tuple[int, int]) -> None:
    """The four conditions of Penrose."""
    a = random(shape)
    found = dl.pseudoinverse(a)
    gives([found, a], identity(shape[1]))
    gives([a, found, a], a)
    gives([found, a, found], found)
    onto = dl.matmul(a, found)
    same(dl.transpose(onto), onto, 3 * TIGHT)
    same(found.real, np.linalg.pinv(a.real))


# ---- factors --------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("shape", SHAPES)
def test_qr(shape: tuple[int, int]) -> None:
    a = random(shape)
    q, r = dl.qr(a)
    gives([q, r], a)
    gives([dl.transpose(q), q], identity(shape[1]))
    for part in (r.real, r.dual):
        assert np.all(np.tril(part, -1) == 0)
    assert np.all(np.diagonal(r.real, axis1=-2, axis2=-1) > 0)
    same(r.dual, difference(lambda one: dl.qr(one).r.real, a), 1e-9)


@pytest.mark.parametrize("n", [1, 2, 3, 6])
def test_cholesky(n: int) -> None:
    a = symmetric(n)
    found = dl.cholesky(a)
    gives([found, dl.transpose(found)], a)
    for part in (found.real, found.dual):
        assert np.all(np.triu(part, 1) == 0)
    same(found.dual, difference(np.linalg.cholesky, a), 1e-9)


@pytest.mark.parametrize("n", [1, 2, 3, 6])
def test_eigen(n: int) -> None:
    a = symmetric(n)
    values, vectors = dl.eigh(a)
    spread = Dual(*(part[..., None, :] * np.eye(n) for part in split(values)))
    gives([vectors, spread, dl.transpose(vectors)], a)
    gives([dl.transpose(vectors), vectors], identity(n))
    same(values.dual, difference(np.linalg.eigvalsh, a), 1e-9)


@pytest.mark.parametrize("shape", [*SHAPES, (2, 5)])
def test_svd(shape: tuple[int, int]) -> None:
    a = random(shape)
    u, s, vt = dl.svd(a)
    k = min(shape)
    spread = Dual(*(part[..., None, :] * np.eye(k) for part in split(s)))
    gives([u, spread, vt], a)
    gives([dl.transpose(u), u], identity(k))
    gives([vt, dl.transpose(vt)], identity(k))
    same(s.dual, difference(lambda one: np.linalg.svd(one, compute_uv=False), a), 1e-9)


@pytest.mark.parametrize("shape", SQUARE)
def test_polar(shape: tuple[int, int]) -> None:
    """The nearest rotation: R̂ᵀ R̂ = I, det R̂ = 1, P̂ symmetric, R̂ P̂ = Â; also where det A < 0."""
    a = random(shape)
    r, p = dl.polar(a)
    gives([r, p], a)
    gives([dl.transpose(r), r], identity(shape[0]))
    same(dl.transpose(p), p)
    same(dl.determinant(r), Dual(np.ones(LANES), np.zeros(LANES)), 3 * TIGHT)
    same(r.dual, difference(lambda one: dl.polar(one).rotation.real, a), 1e-9)
    definite = np.linalg.det(a.real) > 0
    assert np.all(np.linalg.eigvalsh(p.real[definite]) > 0)


def test_polar_of_a_pose_is_the_pose() -> None:
    rng = np.random.default_rng(3)
    rotation = random_rotations(rng, LANES)
    tilde = rng.normal(size=(LANES, 3, 3))
    pose = Dual(rotation, (tilde - np.swapaxes(tilde, -1, -2)) @ rotation)
    same(dl.polar(pose).rotation, pose)
    off = Dual(pose.real + 1e-3 * rng.normal(size=pose.real.shape), pose.dual + 1e-3 * rng.normal(size=pose.real.shape))
    back = dl.polar(off).rotation
    gives([dl.transpose(back), back], identity(3))
    same(back, pose, 0.02)


# ---- where there is no dual part ------------------------------------------------------------------------------


def test_singular_lanes_alone_are_nan() -> None:
    real = np.array([np.eye(3), np.diag([1.0, 1.0, 0.0]), np.full((3, 3), np.nan), 2 * np.eye(3)])
    a = Dual(real, np.ones((4, 3, 3)))
    for found in (dl.inverse(a), dl.solve(a, np.ones((4, 3, 1))), dl.pseudoinverse(a), dl.cholesky(a), *dl.qr(a)):
        fine = np.isfinite(found.dual).all(axis=(-2, -1))
        np.testing.assert_array_equal(fine, [True, False, False, True])
    assert np.isfinite(dl.pseudoinverse(a).real[1]).all()
    np.testing.assert_array_equal(np.isnan(dl.determinant(a).dual), [False, False, True, False])
    assert np.isnan(dl.inverse(np.zeros((2, 2))).real).all()
    assert np.isnan(dl.cholesky(-np.eye(2)).real).all()


def test_equal_values_have_no_derivative() -> None:
    """The columns concerned are NaN, the others not."""
    real, dual = np.diag([3.0, 1.0, 1.0]), np.array([[1.0, 2.0, 3.0], [2.0, 4.0, 5.0], [3.0, 5.0, 6.0]])
    values, vectors = dl.eigh(Dual(real, dual))
    np.testing.assert_array_equal(np.isnan(values.dual), [True, True, False])
    np.testing.assert_array_equal(np.isnan(vectors.dual).all(axis=0), [True, True, False])
    assert values.dual[2] == pytest.approx(1.0)
    u, s, vt = dl.svd(Dual(real, dual))
    for part in (np.isnan(s.dual), np.isnan(u.dual).all(axis=0), np.isnan(vt.dual).all(axis=1)):
        np.testing.assert_array_equal(part, [False, True, True])
    assert np.isfinite(u.dual[:, 0]).all()
    assert np.isfinite(dl.polar(Dual(real, dual)).rotation.dual).all(), "the polar factor needs no distinct values"
    gone = dl.svd(Dual(np.diag([2.0, 1.0, 0.0]), dual))
    np.testing.assert_array_equal(np.isnan(gone.s.dual), [False, False, True])
    assert np.isnan(dl.polar(Dual(np.diag([1.0, 0.0, 0.0]), dual)).rotation.dual).any()
    assert np.isfinite(dl.polar(Dual(np.diag([2.0, 1.0, 0.0]), dual)).rotation.dual).all()


def test_one_epsilon_only() -> None:
    with pytest.raises(TypeError, match="one ε"):
        dl.inverse(Dual(Dual(np.eye(2)), np.eye(2)))


def test_public_namespace() -> None:
    """Everything by one import; the package itself loads it when it is asked for."""
    import trunnion
    from trunnion import dual

    assert trunnion.dual is dual
    assert all(hasattr(dual, name) for name in dual.__all__)
    assert dual.linalg is dl

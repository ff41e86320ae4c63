"""Unrolled solves against numpy.linalg on stacks, dual systems and eigenvalues against formulas and differences."""

import numpy as np
import pytest

from trunnion.algebra import duallinalg as dl
from trunnion.algebra import linalg
from trunnion.algebra.dual import Dual, derivative, primal

SIZES = [1, 2, 3, 4, 6]
LANES = 400


def stack(n, seed):
    """Random matrices (lane, n, n); half need row swaps: zeros on the diagonal or a reversed order of rows."""
    rng = np.random.default_rng(seed)
    a = rng.normal(size=(LANES, n, n))
    if n > 1:
        a[::4, range(n), range(n)] = 0.0
        a[1::4] = np.diag(rng.uniform(1, 2, n))[::-1] + 0.01 * a[1::4]
    keep = np.linalg.cond(a) < 1e4
    return a[keep]


def rows_of(a):
    return [[a[..., i, j] for j in range(a.shape[-1])] for i in range(a.shape[-2])]


def stacked(rows):
    return np.moveaxis(np.array([np.broadcast_arrays(*row) for row in rows]), (0, 1), (-2, -1))


@pytest.mark.parametrize("n", SIZES)
def test_solve(n):
    a = stack(n, n)
    b = np.random.default_rng(99).normal(size=(len(a), n, 2))
    found, _ = linalg.solve(rows_of(a), list(b[:, :, 0].T), list(b[:, :, 1].T))
    expected = np.linalg.solve(a, b)
    for k in range(2):
        np.testing.assert_allclose(np.array(found[k]).T, expected[..., k], rtol=1e-10, atol=1e-11)


@pytest.mark.parametrize("n", SIZES)
def test_inverse_and_determinant(n):
    a = stack(n, 10 + n)
    inverse, determinant = linalg.inverse(rows_of(a))
    np.testing.assert_allclose(stacked(inverse), np.linalg.inv(a), rtol=1e-9, atol=1e-10)
    np.testing.assert_allclose(determinant, np.linalg.det(a), rtol=1e-11, atol=1e-13)


@pytest.mark.parametrize("n", SIZES)
def test_dual_solve(n):
    """x₀ = A⁻¹ b₀, x₁ = A⁻¹ (b₁ − B x₀)."""
    a = stack(n, 30 + n)
    rng = np.random.default_rng(5)
    slope = rng.normal(size=a.shape)
    b, b1 = rng.normal(size=(2, len(a), n))
    matrix = [[Dual(a[:, i, j], slope[:, i, j]) for j in range(n)] for i in range(n)]
    (found,), _ = linalg.solve(matrix, [Dual(b[:, i], b1[:, i]) for i in range(n)])
    x0 = np.linalg.solve(a, b[..., None])[..., 0]
    x1 = np.linalg.solve(a, (b1 - (slope @ x0[..., None])[..., 0])[..., None])[..., 0]
    size = np.abs(x1).max(axis=1, keepdims=True)
    np.testing.assert_allclose(np.array([primal(x) for x in found]).T, x0, rtol=1e-9, atol=1e-10)
    assert np.all(np.abs(np.array([derivative(x) for x in found]).T - x1) <= 1e-9 * size + 1e-10)


@pytest.mark.parametrize("n", SIZES)
def test_dual_inverse_and_determinant(n):
    """(A + ε B)⁻¹ = A⁻¹ − ε A⁻¹ B A⁻¹ and det = det A (1 + ε tr(A⁻¹ B))."""
    a = stack(n, 40 + n)
    slope = np.random.default_rng(6).normal(size=a.shape)
    matrix = [[Dual(a[:, i, j], slope[:, i, j]) for j in range(n)] for i in range(n)]
    rows, product = linalg.inverse(matrix)
    inverse, found = np.linalg.inv(a), stacked([[derivative(x) for x in row] for row in rows])
    expected = -inverse @ slope @ inverse
    scale = np.abs(expected).max(axis=(1, 2), keepdims=True)
    assert np.all(np.abs(found - expected) <= 1e-10 * scale + 1e-10)
    trace = np.trace(inverse @ slope, axis1=1, axis2=2)
    np.testing.assert_allclose(derivative(product), np.linalg.det(a) * trace, rtol=1e-9, atol=1e-9)


SINGULAR = {
    "floats": [[0.0, 1.0], [0.0, 2.0]],
    "proportional": [[1.0, 2.0], [2.0, 4.0]],
    "arrays": [[np.zeros(2), np.ones(2)], [np.zeros(2), np.ones(2)]],
    "duals": [[Dual(0.0, 1.0), Dual(1.0, 0.0)], [Dual(0.0, 2.0), Dual(1.0, 0.0)]],
    "floats and duals": [[0.0, Dual(1.0, 0.0)], [0.0, Dual(2.0, 1.0)]],
    "zero": [[0.0, 0.0], [0.0, 0.0]],
}


@pytest.mark.parametrize("name", SINGULAR)
def test_singular_is_data_not_an_exception(name):
    """Non-finite solutions, determinant 0 or NaN, whatever kind of numbers."""
    (x,), _ = linalg.solve(SINGULAR[name], [1.0, 1.0])
    assert not np.all(np.isfinite([np.ravel(primal(value))[0] for value in x]))
    inverse, determinant = linalg.inverse(SINGULAR[name])
    assert np.all((np.ravel(primal(determinant)) == 0) | np.isnan(np.ravel(primal(determinant))))
    assert not np.all(np.isfinite([np.ravel(primal(v))[0] for row in inverse for v in row]))


def test_a_large_entry_does_not_hide_a_small_pivot():
    """Without row pivoting the first unknown would come out 0."""
    (x,), _ = linalg.solve([[1e-20, 1.0], [1.0, 1.0]], [1.0, 2.0])
    np.testing.assert_allclose([float(v) for v in x], [1.0, 1.0], rtol=1e-12)


TIGHT = 1e-14
SQUARE = [(n, n) for n in (1, 2, 3, 6)]
STEP = 1e-5


def random(shape, seed=0):
    """Stacks with singular values from 1 to 2, evenly apart: the figures then test the formulas, not the condition."""
    rng = np.random.default_rng([*shape, seed])
    m, n = shape
    k = min(m, n)
    u = np.linalg.qr(rng.normal(size=(LANES, m, k)))[0]
    v = np.linalg.qr(rng.normal(size=(LANES, n, k)))[0]
    real = (u * np.linspace(2, 1, k)) @ np.swapaxes(v, -1, -2)
    return Dual(real, rng.normal(size=real.shape))


def symmetric(n, seed=0):
    """Positive definite stacks with a symmetric dual part."""
    a = random((n, n), seed)
    b = a.dual + np.swapaxes(a.dual, -1, -2)
    return Dual(a.real @ np.swapaxes(a.real, -1, -2), b)


def same(found, expected, tolerance=TIGHT):
    """Equal to a tolerance relative to the largest entry of each part, over all lanes."""
    for part, other in zip(split(found), split(expected), strict=True):
        scale = max(1.0, float(np.max(np.abs(other))))
        np.testing.assert_allclose(part, np.broadcast_to(other, part.shape), rtol=0, atol=tolerance * scale)


def times(*factors):
    """Â B̂ …: A B + ε (A B₁ + A₁ B)."""
    real, dual = split(factors[0])
    for other in factors[1:]:
        second, slope = split(other)
        real, dual = real @ second, real @ slope + dual @ second
    return Dual(real, dual)


def gives(factors, expected, tolerance=TIGHT):
    """The product is what is expected, to a tolerance relative to the largest sum of the sizes of its terms."""
    found = times(*factors)
    sizes = times(*(Dual(*(np.abs(part) for part in split(one))) for one in factors))
    for part, other, size in zip(split(found), split(expected), split(sizes), strict=True):
        atol = tolerance * float(np.max(size))
        np.testing.assert_allclose(part, np.broadcast_to(other, part.shape), rtol=0, atol=atol)


def split(a):
    return (a.real, a.dual) if isinstance(a, Dual) else (a, np.zeros_like(a))


def along(a, t):
    return a.real + t * a.dual


def difference(function, a):
    """Central difference of fourth order of a function of A + t B at 0."""
    near = function(along(a, STEP)) - function(along(a, -STEP))
    far = function(along(a, 2 * STEP)) - function(along(a, -2 * STEP))
    return (8 * near - far) / (12 * STEP)


# systems
@pytest.mark.parametrize("shape", SQUARE)
def test_inverse(shape):
    a = random(shape)
    gives([a, dl.inverse(a)], np.eye(shape[0]))
    gives([dl.inverse(a), a], np.eye(shape[0]))


@pytest.mark.parametrize("shape", SQUARE)
def test_solve_of_dual_stacks(shape):
    a, b = random(shape), random((shape[0], 2), 1)
    gives([a, dl.solve(a, b)], b)
    vector = Dual(b.real[..., 0], b.dual[..., 0])
    x = dl.solve(a, vector)
    whole = dl.solve(a, b)
    same(x, Dual(whole.real[..., 0], whole.dual[..., 0]))
    one = dl.solve(Dual(a.real[0], a.dual[0]), Dual(vector.real[0], vector.dual[0]))
    same(one, Dual(x.real[0], x.dual[0]))


# eigenvalues
@pytest.mark.parametrize("n", [1, 2, 3, 6])
def test_eigen(n):
    a = symmetric(n)
    values, vectors = dl.eigh(a)
    spread = Dual(*(part[..., None, :] * np.eye(n) for part in split(values)))
    back = Dual(*(np.swapaxes(part, -1, -2) for part in split(vectors)))
    gives([vectors, spread, back], a)
    gives([back, vectors], np.eye(n))
    same(values.dual, difference(np.linalg.eigvalsh, a), 1e-9)


# where there is no dual part
def test_singular_lanes_alone_are_nan():
    real = np.array([np.eye(3), np.diag([1.0, 1.0, 0.0]), np.full((3, 3), np.nan), 2 * np.eye(3)])
    a = Dual(real, np.ones((4, 3, 3)))
    for found in (dl.inverse(a), dl.solve(a, np.ones((4, 3, 1)))):
        fine = np.isfinite(found.dual).all(axis=(-2, -1))
        np.testing.assert_array_equal(fine, [True, False, False, True])
    assert np.isnan(dl.inverse(np.zeros((2, 2))).real).all()


def test_equal_values_have_no_derivative():
    """The columns concerned are NaN, the others not."""
    real, dual = np.diag([3.0, 1.0, 1.0]), np.array([[1.0, 2.0, 3.0], [2.0, 4.0, 5.0], [3.0, 5.0, 6.0]])
    values, vectors = dl.eigh(Dual(real, dual))
    np.testing.assert_array_equal(np.isnan(values.dual), [True, True, False])
    np.testing.assert_array_equal(np.isnan(vectors.dual).all(axis=0), [True, True, False])
    assert values.dual[2] == pytest.approx(1.0)


def test_public_namespace():
    """Everything by one import; the package itself loads it when it is asked for."""
    import trunnion
    from trunnion import dual

    assert trunnion.dual is dual
    assert all(hasattr(dual, name) for name in dual.__all__)
    assert dual.linalg is dl

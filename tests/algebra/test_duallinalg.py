"""Dual systems and eigenvalues put together again, and against the derivative along A + t B by central differences."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from mechanisms import Array
from trunnion.algebra import duallinalg as dl
from trunnion.algebra.dual import Dual

LANES = 200
TIGHT = 1e-14
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


# ---- systems --------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("shape", SQUARE)
def test_inverse(shape: tuple[int, int]) -> None:
    a = random(shape)
    gives([a, dl.inverse(a)], np.eye(shape[0]))
    gives([dl.inverse(a), a], np.eye(shape[0]))


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


# ---- eigenvalues --------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("n", [1, 2, 3, 6])
def test_eigen(n: int) -> None:
    a = symmetric(n)
    values, vectors = dl.eigh(a)
    spread = Dual(*(part[..., None, :] * np.eye(n) for part in split(values)))
    gives([vectors, spread, dl.transpose(vectors)], a)
    gives([dl.transpose(vectors), vectors], np.eye(n))
    same(values.dual, difference(np.linalg.eigvalsh, a), 1e-9)


# ---- where there is no dual part ------------------------------------------------------------------------------


def test_singular_lanes_alone_are_nan() -> None:
    real = np.array([np.eye(3), np.diag([1.0, 1.0, 0.0]), np.full((3, 3), np.nan), 2 * np.eye(3)])
    a = Dual(real, np.ones((4, 3, 3)))
    for found in (dl.inverse(a), dl.solve(a, np.ones((4, 3, 1)))):
        fine = np.isfinite(found.dual).all(axis=(-2, -1))
        np.testing.assert_array_equal(fine, [True, False, False, True])
    assert np.isnan(dl.inverse(np.zeros((2, 2))).real).all()


def test_equal_values_have_no_derivative() -> None:
    """The columns concerned are NaN, the others not."""
    real, dual = np.diag([3.0, 1.0, 1.0]), np.array([[1.0, 2.0, 3.0], [2.0, 4.0, 5.0], [3.0, 5.0, 6.0]])
    values, vectors = dl.eigh(Dual(real, dual))
    np.testing.assert_array_equal(np.isnan(values.dual), [True, True, False])
    np.testing.assert_array_equal(np.isnan(vectors.dual).all(axis=0), [True, True, False])
    assert values.dual[2] == pytest.approx(1.0)


def test_public_namespace() -> None:
    """Everything by one import; the package itself loads it when it is asked for."""
    import trunnion
    from trunnion import dual

    assert trunnion.dual is dual
    assert all(hasattr(dual, name) for name in dual.__all__)
    assert dual.linalg is dl

"""Unrolled solves against numpy.linalg on stacks, and dual numbers through them against the formulas."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from mechanisms import Array
from trunnion.algebra import linalg
from trunnion.algebra.dual import Dual, derivative, primal

SIZES = [1, 2, 3, 4, 6]
LANES = 400


def stack(n: int, seed: int) -> Array:
    """Random matrices (lane, n, n); half need row swaps: zeros on the diagonal or a reversed order of rows."""
    rng = np.random.default_rng(seed)
    a = rng.normal(size=(LANES, n, n))
    if n > 1:
        a[::4, range(n), range(n)] = 0.0
        a[1::4] = np.diag(rng.uniform(1, 2, n))[::-1] + 0.01 * a[1::4]
    keep = np.linalg.cond(a) < 1e4
    return a[keep]


def rows_of(a: Array) -> list[list[Any]]:
    return [[a[..., i, j] for j in range(a.shape[-1])] for i in range(a.shape[-2])]


def stacked(rows: list[list[Any]]) -> Array:
    return np.moveaxis(np.array([np.broadcast_arrays(*row) for row in rows]), (0, 1), (-2, -1))


@pytest.mark.parametrize("n", SIZES)
def test_solve(n: int) -> None:
    a = stack(n, n)
    b = np.random.default_rng(99).normal(size=(len(a), n, 2))
    found = linalg.solve(rows_of(a), list(b[:, :, 0].T), list(b[:, :, 1].T))
    expected = np.linalg.solve(a, b)
    for k in range(2):
        np.testing.assert_allclose(np.array(found[k]).T, expected[..., k], rtol=1e-10, atol=1e-11)


@pytest.mark.parametrize("n", SIZES)
def test_inverse_and_determinant(n: int) -> None:
    a = stack(n, 10 + n)
    np.testing.assert_allclose(stacked(linalg.inverse(rows_of(a))), np.linalg.inv(a), rtol=1e-9, atol=1e-10)
    np.testing.assert_allclose(linalg.determinant(rows_of(a)), np.linalg.det(a), rtol=1e-11, atol=1e-13)


@pytest.mark.parametrize("n", SIZES)
def test_condition(n: int) -> None:
    a = stack(n, 20 + n)
    np.testing.assert_allclose(linalg.condition(rows_of(a)), np.linalg.cond(a), rtol=1e-9)


@pytest.mark.parametrize("n", SIZES)
def test_dual_solve(n: int) -> None:
    """x₀ = A⁻¹ b₀, x₁ = A⁻¹ (b₁ − B x₀)."""
    a = stack(n, 30 + n)
    rng = np.random.default_rng(5)
    slope = rng.normal(size=a.shape)
    b, b1 = rng.normal(size=(2, len(a), n))
    matrix = [[Dual(a[:, i, j], slope[:, i, j]) for j in range(n)] for i in range(n)]
    (found,) = linalg.solve(matrix, [Dual(b[:, i], b1[:, i]) for i in range(n)])
    x0 = np.linalg.solve(a, b[..., None])[..., 0]
    x1 = np.linalg.solve(a, (b1 - (slope @ x0[..., None])[..., 0])[..., None])[..., 0]
    size = np.abs(x1).max(axis=1, keepdims=True)
    np.testing.assert_allclose(np.array([primal(x) for x in found]).T, x0, rtol=1e-9, atol=1e-10)
    assert np.all(np.abs(np.array([derivative(x) for x in found]).T - x1) <= 1e-9 * size + 1e-10)


@pytest.mark.parametrize("n", SIZES)
def test_dual_inverse_and_determinant(n: int) -> None:
    """(A + ε B)⁻¹ = A⁻¹ − ε A⁻¹ B A⁻¹ and det = det A (1 + ε tr(A⁻¹ B))."""
    a = stack(n, 40 + n)
    slope = np.random.default_rng(6).normal(size=a.shape)
    matrix = [[Dual(a[:, i, j], slope[:, i, j]) for j in range(n)] for i in range(n)]
    inverse, product = np.linalg.inv(a), linalg.determinant(matrix)
    found = stacked([[derivative(x) for x in row] for row in linalg.inverse(matrix)])
    expected = -inverse @ slope @ inverse
    scale = np.abs(expected).max(axis=(1, 2), keepdims=True)
    assert np.all(np.abs(found - expected) <= 1e-10 * scale + 1e-10)
    trace = np.trace(inverse @ slope, axis1=1, axis2=2)
    np.testing.assert_allclose(derivative(product), np.linalg.det(a) * trace, rtol=1e-9, atol=1e-9)


def test_lanes_are_independent() -> None:
    """A lane that needs a swap, one that does not, and a singular one beside each other, entries broadcasting."""
    rows = [[np.array([0.0, 2.0, 1.0]), 1.0], [1.0, np.array([0.0, 0.0, 1.0])]]
    (x,) = linalg.solve(rows, [3.0, 4.0])
    np.testing.assert_allclose(np.array(x)[:, :2], [[4.0, 4.0], [3.0, -5.0]])
    assert not np.any(np.isfinite(np.array(x)[:, 2]))


SINGULAR: dict[str, list[list[Any]]] = {
    "floats": [[0.0, 1.0], [0.0, 2.0]],
    "proportional": [[1.0, 2.0], [2.0, 4.0]],
    "arrays": [[np.zeros(2), np.ones(2)], [np.zeros(2), np.ones(2)]],
    "duals": [[Dual(0.0, 1.0), Dual(1.0, 0.0)], [Dual(0.0, 2.0), Dual(1.0, 0.0)]],
    "floats and duals": [[0.0, Dual(1.0, 0.0)], [0.0, Dual(2.0, 1.0)]],
    "zero": [[0.0, 0.0], [0.0, 0.0]],
}


@pytest.mark.parametrize("name", SINGULAR)
def test_singular_is_data_not_an_exception(name: str) -> None:
    """Non-finite solutions, determinant 0 or NaN, whatever kind of numbers."""
    (x,) = linalg.solve(SINGULAR[name], [1.0, 1.0])
    assert not np.all(np.isfinite([np.ravel(primal(value))[0] for value in x]))
    determinant = np.ravel(primal(linalg.determinant(SINGULAR[name])))
    assert np.all((determinant == 0) | np.isnan(determinant))
    assert not np.all(np.isfinite([np.ravel(primal(v))[0] for row in linalg.inverse(SINGULAR[name]) for v in row]))


def test_a_large_entry_does_not_hide_a_small_pivot() -> None:
    """Without row pivoting the first unknown would come out 0."""
    (x,) = linalg.solve([[1e-20, 1.0], [1.0, 1.0]], [1.0, 2.0])
    np.testing.assert_allclose([float(v) for v in x], [1.0, 1.0], rtol=1e-12)

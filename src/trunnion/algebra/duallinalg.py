"""Systems and eigenvalues of dual matrices A + ε B: a `Dual` of two stacks, matrices in their last two axes.

The dual part of a result is its derivative in the direction B. Where there is none, because A is singular or
eigenvalues are equal (to `EQUAL` of the largest), it is NaN: in that lane and in the columns of the eigenvectors
concerned. Lanes that NumPy cannot factor are NaN altogether.

Source: J. R. Magnus and H. Neudecker, Matrix Differential Calculus, Wiley 1988, chapters 8 and 9.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from trunnion.algebra.dual import Dual

__all__ = ["EQUAL", "Eigen", "eigh", "inverse", "matmul", "solve", "transpose"]

Array = NDArray[np.float64]

EQUAL = 1e-13  # of the largest: eigenvalues closer than that are taken for equal


class Eigen(NamedTuple):
    """Â = V̂ diag(λ̂) V̂ᵀ, λ̂ rising."""

    values: Dual
    vectors: Dual


# ---- products -------------------------------------------------------------------------------------------------


def transpose(a: Dual | Array) -> Dual:
    """Âᵀ."""
    real, dual = _split(a)
    return Dual(_t(real), _t(dual))


def matmul(a: Dual | Array, *others: Dual | Array) -> Dual:
    """Â B̂ …: A B + ε (A B₁ + A₁ B)."""
    real, dual = _split(a)
    for other in others:
        second, slope = _split(other)
        real, dual = real @ second, real @ slope + dual @ second
    return Dual(real, dual)


# ---- systems --------------------------------------------------------------------------------------------------


def inverse(a: Dual | Array) -> Dual:
    """A⁻¹ − ε A⁻¹ B A⁻¹; NaN where A is singular."""
    real, dual = _split(a)
    (found,) = _each(np.linalg.inv, real)
    return Dual(found, -found @ dual @ found)


def solve(a: Dual | Array, b: Dual | Array) -> Dual:
    """x̂ of Â x̂ = b̂: x₀ = A⁻¹ b₀, x₁ = A⁻¹ (b₁ − B x₀); NaN where A is singular.

    b: vectors if it has one axis less than A, else matrices.
    """
    real, dual = _split(a)
    b0, b1 = _split(b)
    if b0.ndim < real.ndim:
        found = solve(a, Dual(b0[..., None], b1[..., None]))
        return Dual(found.real[..., 0], found.dual[..., 0])
    b0, b1 = np.broadcast_arrays(b0, b1)
    x0 = _solved(real, b0)
    return Dual(x0, _solved(real, b1 - dual @ x0))


def _solved(a: Array, b: Array) -> Array:
    both = np.concatenate([np.broadcast_to(a, (*b.shape[:-2], *a.shape[-2:])), b], axis=-1)
    n = a.shape[-1]
    (found,) = _each(lambda rows: np.linalg.solve(rows[..., :n], rows[..., n:]), both)
    return found


# ---- eigenvalues --------------------------------------------------------------------------------------------------


def eigh(a: Dual | Array) -> Eigen:
    """Eigenvalues and orthonormal eigenvectors of a symmetric Â, of the lower triangles of both parts.

    With M = Vᵀ B V: λ̇ᵢ = Mᵢᵢ, V̇ = V (F ∘ M), Fᵢⱼ = 1/(λⱼ − λᵢ). NaN for equal eigenvalues.
    """
    real, dual = _split(a)
    values, vectors = _each(np.linalg.eigh, real)
    m = _t(vectors) @ _symmetric(dual) @ vectors
    factors = _gaps(values, np.max(np.abs(values), axis=-1))
    slopes = np.where(np.isnan(factors).any(axis=-2), np.nan, _diagonal(m))
    return Eigen(Dual(values, slopes), Dual(vectors, vectors @ (factors * m)))


# ---- help -----------------------------------------------------------------------------------------------------


def _split(a: Dual | Array) -> tuple[Array, Array]:
    """Both parts as stacks of one shape."""
    real, dual = (a.real, a.dual) if isinstance(a, Dual) else (a, 0.0)
    if isinstance(real, Dual) or isinstance(dual, Dual):
        raise TypeError("dual matrices have one ε: both parts must be arrays")
    both = np.broadcast_arrays(np.asarray(real, float), np.asarray(dual, float))
    return both[0], both[1]


def _each(factor: Callable[[Array], Any], a: Array) -> tuple[Array, ...]:
    """Results of a function of NumPy for the whole stack, lane by lane only where it refuses one: that lane is NaN."""
    try:
        return _tuple(factor(a))
    except np.linalg.LinAlgError:
        lanes = a.reshape(-1, *a.shape[-2:])
        example = _tuple(factor(np.eye(*a.shape[-2:])))
        found = [np.full((len(lanes), *one.shape), np.nan) for one in example]
        for i, lane in enumerate(lanes):
            try:
                results = _tuple(factor(lane))
            except np.linalg.LinAlgError:
                continue
            for where, result in zip(found, results, strict=True):
                where[i] = result
        return tuple(one.reshape(*a.shape[:-2], *one.shape[1:]) for one in found)


def _tuple(found: Any) -> tuple[Array, ...]:
    return tuple(found) if isinstance(found, tuple) else (found,)


def _t(a: Array) -> Array:
    return np.swapaxes(a, -1, -2)


def _diagonal(a: Array) -> Array:
    return np.diagonal(a, axis1=-2, axis2=-1)


def _symmetric(a: Array) -> Array:
    """The symmetric matrix of a lower triangle."""
    return np.tril(a) + _t(np.tril(a, -1))


def _gaps(values: Array, largest: Array) -> Array:
    """1/(vⱼ − vᵢ), 0 on the diagonal, NaN where two values are equal."""
    steps = values[..., None, :] - values[..., :, None]
    steps = np.where(np.abs(steps) <= EQUAL * largest[..., None, None], np.nan, steps)
    n = values.shape[-1]
    steps[..., range(n), range(n)] = np.inf
    found: Array = 1.0 / steps
    return found

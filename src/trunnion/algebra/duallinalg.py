"""Systems and eigenvalues of dual matrices A + ε B: a `Dual` of two stacks, matrices in their last two axes.

The dual part of a result is its derivative in the direction B. Where there is none, because A is singular or
eigenvalues are equal (to `EQUAL` of the largest), it is NaN: in that lane and in the columns of the eigenvectors
concerned. Lanes that cannot be factored are NaN altogether.

Source: J. R. Magnus and H. Neudecker, Matrix Differential Calculus, Wiley 1988, chapters 8 and 9.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from trunnion.algebra.dual import Dual

Array = NDArray[np.float64]

EQUAL = 1e-13  # of the largest: eigenvalues closer than that are taken for equal


class Eigen(NamedTuple):
    """Â = V̂ diag(λ̂) V̂ᵀ, λ̂ rising."""

    values: Dual
    vectors: Dual


# ---- systems --------------------------------------------------------------------------------------------------


def inverse(a: Dual | Array) -> Dual:
    """A⁻¹ − ε A⁻¹ B A⁻¹; NaN where A is singular."""
    real, dual = _split(a)
    inverted = np.linalg.inv(_regular(real))
    return Dual(inverted, -inverted @ dual @ inverted)


def solve(a: Dual | Array, b: Dual | Array) -> Dual:
    """x̂ of Â x̂ = b̂: x₀ = A⁻¹ b₀, x₁ = A⁻¹ (b₁ − B x₀); NaN where A is singular.

    b: vectors if it has one axis less than A, else matrices.
    """
    real, dual = _split(a)
    b0, b1 = _split(b)
    if b0.ndim < real.ndim:
        solution = solve(a, Dual(b0[..., None], b1[..., None]))
        return Dual(solution.real[..., 0], solution.dual[..., 0])
    real = _regular(real)
    x0 = np.linalg.solve(real, b0)
    return Dual(x0, np.linalg.solve(real, b1 - dual @ x0))


# ---- eigenvalues ----------------------------------------------------------------------------------------------


def eigh(a: Dual | Array) -> Eigen:
    """Eigenvalues and orthonormal eigenvectors of a symmetric Â, of the lower triangles of both parts.

    With M = Vᵀ B V: λ̇ᵢ = Mᵢᵢ, V̇ = V (F ∘ M), Fᵢⱼ = 1/(λⱼ − λᵢ). NaN for equal eigenvalues.
    """
    real, dual = _split(a)
    lost = np.asarray(~np.isfinite(real).all(axis=(-2, -1)))
    values, vectors = np.linalg.eigh(np.where(lost[..., None, None], np.eye(real.shape[-1]), real))
    values, vectors = np.where(lost[..., None], np.nan, values), np.where(lost[..., None, None], np.nan, vectors)
    symmetric = np.tril(dual) + np.tril(dual, -1).swapaxes(-1, -2)
    m = vectors.swapaxes(-1, -2) @ symmetric @ vectors
    factors = _gaps(values, np.max(np.abs(values), axis=-1))
    slopes = np.where(np.isnan(factors).any(axis=-2), np.nan, np.diagonal(m, axis1=-2, axis2=-1))
    return Eigen(Dual(values, slopes), Dual(vectors, vectors @ (factors * m)))


# ---- help -----------------------------------------------------------------------------------------------------


def _split(a: Dual | Array) -> tuple[Array, Array]:
    """Both parts as stacks of one shape."""
    real, dual = (a.real, a.dual) if isinstance(a, Dual) else (a, 0.0)
    if isinstance(real, Dual) or isinstance(dual, Dual):
        raise TypeError("dual matrices have one ε: both parts must be arrays")
    both = np.broadcast_arrays(np.asarray(real, float), np.asarray(dual, float))
    return both[0], both[1]


def _regular(a: Array) -> Array:
    """The matrices with NaN in place of those that elimination finds singular, which NumPy refuses."""
    with np.errstate(invalid="ignore"):
        sign, _ = np.linalg.slogdet(a)
    return np.where((sign == 0.0)[..., None, None], np.nan, a)


def _gaps(values: Array, largest: Array) -> Array:
    """1/(vⱼ − vᵢ), 0 on the diagonal, NaN where two values are equal."""
    steps = values[..., None, :] - values[..., :, None]
    steps = np.where(np.abs(steps) <= EQUAL * largest[..., None, None], np.nan, steps)
    n = values.shape[-1]
    steps[..., range(n), range(n)] = np.inf
    gaps: Array = 1.0 / steps
    return gaps

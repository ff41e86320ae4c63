"""Linear algebra of dual matrices A + ε B: a `Dual` of two stacks, matrices in their last two axes, of any size.

The dual part of a factor is the derivative of the factor of A in the direction B. Where there is none, because A is
singular or singular values or eigenvalues are equal (to `EQUAL` of the largest), it is NaN: in that lane and, for
singular and eigenvectors, in the columns concerned. Lanes that NumPy cannot factor are NaN altogether.

Sources: J. R. Magnus and H. Neudecker, Matrix Differential Calculus, Wiley 1988, chapters 8 and 9 (inverse,
determinant, eigenvalues); G. H. Golub and V. Pereyra, SIAM J. Numer. Anal. 10 (1973) 413-432 (pseudoinverse);
M. B. Giles, Collected matrix derivative results, 2008 (QR by its triangles, Cholesky, singular values). Dual parts of
the factors are checked by putting the matrix together again.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from trunnion.algebra.dual import Dual

__all__ = [
    "EQUAL",
    "Eigen",
    "Polar",
    "SingularValues",
    "Triangular",
    "cholesky",
    "determinant",
    "eigh",
    "inverse",
    "matmul",
    "polar",
    "pseudoinverse",
    "qr",
    "solve",
    "svd",
    "transpose",
]

Array = NDArray[np.float64]

EQUAL = 1e-13  # of the largest: singular values and eigenvalues closer than that are taken for equal


class Triangular(NamedTuple):
    """Â = Q̂ R̂: Q̂ᵀ Q̂ = I, R̂ upper triangular with a positive diagonal."""

    q: Dual
    r: Dual


class SingularValues(NamedTuple):
    """Â = Û diag(ŝ) V̂ᵀ, ŝ falling; vt is V̂ᵀ."""

    u: Dual
    s: Dual
    vt: Dual


class Eigen(NamedTuple):
    """Â = V̂ diag(λ̂) V̂ᵀ, λ̂ rising."""

    values: Dual
    vectors: Dual


class Polar(NamedTuple):
    """Â = R̂ P̂: R̂ the nearest dual rotation, P̂ symmetric, positive definite where det A > 0."""

    rotation: Dual
    stretch: Dual


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


def determinant(a: Dual | Array) -> Dual:
    """det A + ε tr(adj(A) B), also of a singular A.

    adj(A) = det U det V · V diag(∏ of the other singular values) Uᵀ.
    """
    real, dual = _split(a)
    u, s, vt = _each(np.linalg.svd, real)
    others = np.stack([np.prod(np.delete(s, i, axis=-1), axis=-1) for i in range(s.shape[-1])], axis=-1)
    sense = _det(u) * _det(vt)
    along = _diagonal(_t(u) @ dual @ _t(vt))
    return Dual(_det(real), sense * np.sum(others * along, axis=-1))


def pseudoinverse(a: Dual | Array) -> Dual:
    """A⁺ = (AᵀA)⁻¹ Aᵀ of full column rank, and ε (−A⁺ B A⁺ + (AᵀA)⁻¹ Bᵀ (I − A A⁺)); dual part NaN at lower rank."""
    real, dual = _split(a)
    u, s, vt = _each(lambda one: np.linalg.svd(one, full_matrices=False), real)
    full = (s[..., -1] > EQUAL * s[..., 0]) & (real.shape[-2] >= real.shape[-1])
    weights = np.where(full[..., None], _reciprocal(s), np.nan)
    found = (_t(vt) * weights[..., None, :]) @ _t(u)
    outside = np.eye(real.shape[-2]) - real @ found
    slope = found @ _t(found) @ _t(dual) @ outside - found @ dual @ found
    (plain,) = _each(np.linalg.pinv, real)
    return Dual(np.where(full[..., None, None], found, plain), slope)


# ---- factors --------------------------------------------------------------------------------------------------


def qr(a: Dual | Array) -> Triangular:
    """Q̂ (m × n) and R̂ (n × n) of an m × n matrix, m ≥ n; dual parts NaN where its columns are dependent.

    With M = Qᵀ B R⁻¹ and Ω the skew matrix of the lower triangle of M: Ṙ = (M − Ω) R, Q̇ = Q Ω + (I − Q Qᵀ) B R⁻¹.
    """
    real, dual = _split(a)
    q, r = _each(np.linalg.qr, real)
    sense = np.where(_diagonal(r) < 0, -1.0, 1.0)
    q, r = q * sense[..., None, :], sense[..., :, None] * r
    size = _diagonal(r)
    whole = (np.abs(size) > EQUAL * np.max(np.abs(r), axis=(-2, -1))[..., None]).all(axis=-1)[..., None, None]
    (back,) = _each(np.linalg.inv, np.where(whole, r, np.nan))
    ahead = dual @ back
    m = _t(q) @ ahead
    lower = np.tril(m, -1)
    turn = lower - _t(lower)
    return Triangular(Dual(q, q @ (turn - m) + ahead), Dual(r, np.triu((m - turn) @ r)))


def cholesky(a: Dual | Array) -> Dual:
    """Lower triangular L̂ with L̂ L̂ᵀ = Â, of the lower triangles of both parts; NaN unless A is positive definite.

    L̇ = L Φ(L⁻¹ B L⁻ᵀ), Φ the lower triangle with half the diagonal.
    """
    real, dual = _split(a)
    (lower,) = _each(np.linalg.cholesky, real)
    (back,) = _each(np.linalg.inv, lower)
    inside = back @ _symmetric(dual) @ _t(back)
    half = np.tril(inside) - 0.5 * _as_diagonal(_diagonal(inside))
    return Dual(lower, lower @ half)


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


def svd(a: Dual | Array) -> SingularValues:
    """Reduced singular value decomposition. NaN in the dual part for equal singular values and for one of 0.

    With M = Uᵀ B V and S the singular values: ṡ = diag M; U̇ = U (F ∘ (M S + S Mᵀ)) + (I − U Uᵀ) B V S⁻¹ and
    V̇ = V (F ∘ (S M + Mᵀ S)) + (I − V Vᵀ) Bᵀ U S⁻¹, Fᵢⱼ = 1/(sⱼ² − sᵢ²).
    """
    real, dual = _split(a)
    u, s, vt = _each(lambda one: np.linalg.svd(one, full_matrices=False), real)
    m = _t(u) @ dual @ _t(vt)
    largest = s[..., 0]
    alike = _gaps(s, largest)
    factors = alike * _reciprocal(s[..., None, :] + s[..., :, None])
    left = m * s[..., None, :] + s[..., :, None] * _t(m)
    right = s[..., :, None] * m + _t(m) * s[..., None, :]
    alone = ~np.isnan(alike).any(axis=-2) & (s > EQUAL * largest[..., None])
    over = np.where(alone, _reciprocal(s), np.nan)[..., None, :]
    outside = dual @ _t(vt) - u @ m
    beyond = _t(dual) @ u - _t(vt) @ _t(m)
    u_slope = u @ (factors * left) + outside * over
    v_slope = _t(vt) @ (factors * right) + beyond * over
    return SingularValues(Dual(u, u_slope), Dual(s, np.where(alone, _diagonal(m), np.nan)), Dual(vt, _t(v_slope)))


def polar(a: Dual | Array) -> Polar:
    """Nearest dual rotation R̂ to a square Â, and P̂ = R̂ᵀ Â: a matrix near a pose is brought back to a pose.

    R = U V with the last singular value taken negative where det(U V) < 0. Ṙ = R Ω, Ω the skew solution of
    P Ω + Ω P = Rᵀ B − Bᵀ R, which takes a sum of two singular values; NaN where one is 0.
    """
    real, dual = _split(a)
    u, s, vt = _each(np.linalg.svd, real)
    sense = np.ones_like(s)
    sense[..., -1] = np.sign(_det(u) * _det(vt))
    u, s = u * sense[..., None, :], s * sense
    rotation = u @ vt
    twist = _t(rotation) @ dual
    sums = s[..., None, :] + s[..., :, None]
    n = s.shape[-1]
    equal = np.abs(sums) <= EQUAL * np.abs(s[..., :1, None])
    sums = np.where(equal, np.nan, sums)
    sums[..., range(n), range(n)] = 1.0  # the diagonal of a skew matrix is 0
    turn = _t(vt) @ ((vt @ (twist - _t(twist)) @ _t(vt)) / sums) @ vt
    stretch = _t(vt) @ (s[..., :, None] * vt)
    return Polar(Dual(rotation, rotation @ turn), Dual(stretch, _even(twist - turn @ stretch)))


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


def _det(a: Array) -> Array:
    """Determinants; NumPy's warns of lanes that are not numbers."""
    with np.errstate(invalid="ignore"):
        found: Array = np.linalg.det(a)
        return found


def _tuple(found: Any) -> tuple[Array, ...]:
    return tuple(found) if isinstance(found, tuple) else (found,)


def _t(a: Array) -> Array:
    return np.swapaxes(a, -1, -2)


def _diagonal(a: Array) -> Array:
    return np.diagonal(a, axis1=-2, axis2=-1)


def _as_diagonal(a: Array) -> Array:
    return a[..., :, None] * np.eye(a.shape[-1])


def _symmetric(a: Array) -> Array:
    """The symmetric matrix of a lower triangle."""
    return np.tril(a) + _t(np.tril(a, -1))


def _even(a: Array) -> Array:
    return 0.5 * (a + _t(a))


def _reciprocal(a: Array) -> Array:
    """1/a, NaN at 0."""
    found: Array = 1.0 / np.where(a == 0, np.nan, a)
    return found


def _gaps(values: Array, largest: Array) -> Array:
    """1/(vⱼ − vᵢ), 0 on the diagonal, NaN where two values are equal."""
    steps = values[..., None, :] - values[..., :, None]
    steps = np.where(np.abs(steps) <= EQUAL * largest[..., None, None], np.nan, steps)
    n = values.shape[-1]
    steps[..., range(n), range(n)] = np.inf
    found: Array = 1.0 / steps
    return found

"""How straight a path is: the direction of the least-squares line through it; how far a link in space has turned.

ISO 12780-1:2011 has this reference line, for which the sum of the squares of the local deviations, at right angles to
it, is least, and the straightness as the width from the lowest to the highest of them. The positions count by the time
they stand for, so that the figure does not depend on how many there are. In space the distance is to the line as such,
and the figure the diameter of the cylinder about it that holds the path.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from trunnion.algebra.dual import Dual, derivative, primal
from trunnion.algebra.duallinalg import eigh
from trunnion.algebra.namespace import Number, namespace

__all__ = ["direction", "turn"]

Array = NDArray[np.float64]
SMALL = 1e-3  # below it six terms of the series are exact to rounding


def direction(moments: Sequence[Sequence[Number]]) -> list[Number]:
    """Direction of the least-squares line through a path, of its second moments about its middle; a component each.

    It has no derivative where the path is as wide as long.
    """
    if len(moments) == 2:
        twice = 2.0 * moments[0][1], moments[0][0] - moments[1][1]
        xp = namespace(*twice)
        angle = 0.5 * xp.arctan2(*twice)
        return [xp.cos(angle), xp.sin(angle)]
    return _axis(moments)


def turn(axes: Sequence[Number], before: Sequence[Number], axis: str) -> Number:
    """Component about a global axis of the rotation vector, rad, from one attitude of a link to another.

    axes, before: of its frame, one after the other, nine numbers each. ½ Σ eᵢ⁰ × eᵢ is n sin θ, ½ (Σ eᵢ⁰ · eᵢ − 1) is
    cos θ; θ/sin θ by its series in 1 − cos θ where that is small, so that there is a derivative at no turn.
    """
    sines: list[Number] = [0.0, 0.0, 0.0]
    cosine: Number = -0.5
    for k in (0, 3, 6):
        x, y, z = axes[k : k + 3]
        a, b, c = before[k : k + 3]
        sines = [
            sine + 0.5 * part
            for sine, part in zip(sines, (b * z - c * y, c * x - a * z, a * y - b * x), strict=True)
        ]  # fmt: skip
        cosine = cosine + 0.5 * (a * x + b * y + c * z)
    small = 1.0 - cosine
    series = 1 + small * (1 / 3 + small * (2 / 15 + small * (2 / 35 + small * (8 / 315 + small * (8 / 693)))))
    square = sines[0] * sines[0] + sines[1] * sines[1] + sines[2] * sines[2]
    xp = namespace(square, cosine)
    far = primal(small) > SMALL
    sine = xp.sqrt(xp.where(far, square, 1.0))
    factor = xp.where(far, xp.arctan2(sine, cosine) / sine, series)
    return sines["xyz".index(axis)] * factor


def _axis(moments: Sequence[Sequence[Number]]) -> list[Number]:
    """The axis of least inertia of the path: the eigenvector of the largest eigenvalue of its moments."""
    real = np.stack([np.stack([np.asarray(primal(n)) for n in row], axis=-1) for row in moments], axis=-2)
    if not any(isinstance(n, Dual) for row in moments for n in row):
        vectors = _eigenvectors(real)
        return [vectors[..., k, -1] for k in range(3)]
    slopes = np.stack([np.stack([np.asarray(derivative(n)) for n in row], axis=-1) for row in moments], axis=-2)
    both = np.broadcast_arrays(real, slopes)
    turned = eigh(Dual(*both)).vectors
    return [turned[..., k, -1] for k in range(3)]


def _eigenvectors(matrices: Array) -> Array:
    """Eigenvectors by rising eigenvalue; NaN where a matrix is."""
    sound = np.all(np.isfinite(matrices), axis=(-2, -1), keepdims=True)
    vectors: Array = np.linalg.eigh(np.where(sound, matrices, np.eye(3))).eigenvectors
    return np.where(sound, vectors, np.nan)

"""What first order makes of a number, and of a place in a zone: a circle, a ring, or the hole of a pin.

A zone moves a measure by Q·(c − c₀), c₀ where it lies nominally. On a circle, over all directions, the first harmonic
of the measure is H = Q r: the deviation lies within −H·u₀ ± |H| and has the mean −H·u₀ and the variance |H|²/2, u₀
being the nominal direction. In a ring the size varies too, by d: H + d G instead of H. In a hole the middle is nominal:
worst case ϱ |Q|, variance E|c|² |Q|²/n of n components.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from trunnion.model.tolerances import Tolerance

__all__ = [
    "Far", "Spread", "Vector", "added", "along", "angle", "direction", "farthest", "number", "play", "reach", "run_out",
    "scatter", "size", "worst",
]  # fmt: skip

Array = NDArray[np.float64]
Vector = NDArray[np.float64]  # (component, …)
Radii = Sequence[tuple[float, float]]  # of each end: the largest, and E|c|²


class Spread(NamedTuple):
    """What first order makes of every varying number, (parameter, …), or of all: deviation of a measure from nominal.

    lower, upper: least and largest; half: of the classical sum of squares; shift: of the mean; deviation: standard.
    """

    lower: Array
    upper: Array
    half: Array
    shift: Array
    deviation: Array

    @property
    def worst(self) -> Array:
        """The largest deviation to either side."""
        return np.maximum(-self.lower, self.upper)


class Far(NamedTuple):
    """Where a size does most: its deviation, the harmonic there, and what it adds to that of the nominal size."""

    deviation: float
    place: Vector = np.zeros(2)
    more: Vector = np.zeros(2)


def size(load: Vector) -> Array:
    """|Q|."""
    return np.asarray(np.sqrt(np.sum(load**2, axis=0)), float)


def along(load: Vector, direction: float) -> Array:
    """Q·u of a direction."""
    found: Array = load[0] * np.cos(direction) + load[1] * np.sin(direction)
    return found


def angle(load: Vector, sign: float) -> float:
    """The direction of Q, or against it."""
    return float(np.arctan2(sign * load[1], sign * load[0]))


# ---- numbers --------------------------------------------------------------------------------------------------


def number(slope: Array, one: Tolerance, mean: float, deviation: float) -> Spread:
    """A number with the derivative S."""
    ends = slope * one.lower, slope * one.upper
    half = np.abs(slope) * one.half_width
    return Spread(np.minimum(*ends), np.maximum(*ends), half, slope * mean, np.abs(slope) * deviation)


def added(alone: Spread, circle: Vector, ring: Vector, one: Tolerance, deviation: float) -> Spread:
    """A number that is, or widens, a size in a direction over the whole turn: what it adds to the circle.

    circle: the harmonic of that direction at the nominal size, ring: its derivative by the number.
    """
    more = np.maximum(*(size(circle + end * ring) for end in (one.lower, one.upper))) - size(circle)
    scatter = np.sqrt(alone.deviation**2 + 0.5 * (deviation * size(ring)) ** 2)
    return Spread(alone.lower - more, alone.upper + more, alone.half + np.abs(more), alone.shift, scatter)


# ---- circles and rings ----------------------------------------------------------------------------------------


def direction(circle: Vector, wider: Sequence[Vector], at: float) -> Spread:
    """A direction over the whole turn. wider: what the means of sizes that point there add; at: nominal direction."""
    most, middle = size(circle), -along(circle, at)
    mean = circle + np.sum(wider, axis=0) if wider else circle
    return Spread(middle - most, middle + most, most, middle, np.sqrt(0.5) * size(mean))


def run_out(
    circle: Vector, ring: Vector, limits: tuple[float, float], mean: float, deviation: float, at: float
) -> Spread:
    """A size between limits that points anywhere; circle: harmonic of the nominal size, ring: its derivative."""
    most = np.maximum(*(size(circle + end * ring) for end in limits))
    middle = -along(circle, at)
    variance = 0.5 * (size(circle + mean * ring) ** 2 + (deviation * size(ring)) ** 2)
    return Spread(middle - most, middle + most, most, middle, np.sqrt(variance))


def farthest(circle: Vector, ring: Vector, one: Tolerance, steady: float = 0.0) -> Far:
    """The limit of a size at which it does most; steady: what it does in every direction, a unit."""
    ends = [Far(end, circle + end * ring, end * ring) for end in (one.upper, one.lower)]
    return max(ends, key=lambda far: steady * far.deviation + float(size(far.place)))


# ---- plays ----------------------------------------------------------------------------------------------------


def worst(loads: Sequence[Vector], radii: Radii) -> Array:
    """Σ ϱ |Q| over the ends."""
    return np.asarray(np.sum([most * size(load) for load, (most, _) in zip(loads, radii, strict=True)], axis=0), float)


def reach(loads: Sequence[Vector]) -> Array:
    """Σ |Q| over the ends."""
    return np.asarray(np.sum([size(load) for load in loads], axis=0), float)


def play(carriers: Sequence[tuple[Sequence[Vector], Radii]]) -> Spread:
    """A pin anywhere in its hole: the worst of all links that may carry its seat, the scatter with the first."""
    most = np.max([worst(loads, radii) for loads, radii in carriers], axis=0)
    return Spread(-most, most, most, np.zeros_like(most), scatter(*carriers[0]))


def scatter(loads: Sequence[Vector], radii: Radii) -> Array:
    """Standard deviation, every place in each end as likely as any other."""
    parts = [square * size(load) ** 2 / len(load) for load, (_, square) in zip(loads, radii, strict=True)]
    return np.asarray(np.sqrt(np.sum(parts, axis=0)), float)

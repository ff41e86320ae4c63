"""Values between the points of a table: linear or by a spline, on any number, once or periodic."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from trunnion.algebra.dual import primal
from trunnion.algebra.namespace import Number, namespace
from trunnion.algebra.spline import spline

__all__ = ["look_up"]

SLACK = 1e-9  # of the table's extent: a cycle that ends where the table does is inside, whatever the rounding


def look_up(
    knots: Sequence[Number], values: Sequence[Number], place: Number, smooth: bool = False, periodic: bool = False
) -> Number:
    """The value at a place: NaN outside a table that is not periodic; knots must rise.

    smooth: by the natural or periodic cubic spline, not linear. A periodic table repeats after its last knot.
    """
    low, extent = knots[0], knots[-1] - knots[0]
    if periodic:
        place = place - extent * np.floor(primal((place - low) / extent))
    if smooth:
        found = spline(knots, values, "periodic" if periodic else "natural").at(place)[0]
    else:
        found = _linear(knots, values, place)
    if periodic:
        return found
    beside = primal((place - low) / extent)
    return namespace(found).where((beside >= -SLACK) & (beside <= 1 + SLACK), found, np.nan)


def _linear(knots: Sequence[Number], values: Sequence[Number], place: Number) -> Number:
    """Straight from point to point: in each interval value + slope · (place − knot)."""
    slopes = [(values[k + 1] - values[k]) / (knots[k + 1] - knots[k]) for k in range(len(knots) - 1)]
    if all(isinstance(number, (int, float)) for number in (*knots, *values)):
        index = np.clip(np.searchsorted(np.array(knots), primal(place), side="right") - 1, 0, len(slopes) - 1)
        knot, value, slope = (namespace(index).take(np.array(row), index) for row in (knots, values, slopes))
        return value + slope * (place - knot)
    found = values[0] + slopes[0] * (place - knots[0])
    xp = namespace(place, *knots, *values)
    for knot, value, slope in zip(knots[1:-1], values[1:-1], slopes[1:], strict=True):
        found = xp.where(primal(place) >= primal(knot), value + slope * (place - knot), found)
    return found

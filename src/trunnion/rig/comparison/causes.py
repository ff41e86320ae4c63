"""What one error would explain of a residual: of the zero, the gain, the crank angle, or the friction of the model."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

__all__ = ["KINDS", "Cause", "causes"]

Array = NDArray[np.float64]
KINDS = ("zero", "gain", "angle", "friction")


class Cause(NamedTuple):
    """An error by itself: its size, and the share of the mean square of the residual that goes away with it."""

    size: float = np.nan
    share: float = np.nan


def causes(
    residual: Array, model: Array, datum: float = 0.0, drive: Array | None = None, frictionless: Array | None = None
) -> dict[str, Cause]:
    """Fit the shape of each error to a residual by least squares, one coefficient each, to first order.

    Parameters
    ----------
    residual : (position,), measured minus model; NaN where the two are not compared.
    model : (position,), the course of the model.
    datum : value at which the sensor reads 0: from there an error of its gain acts.
    drive : (position,), angle of the driver, rad; None if turns of a driver do not name the positions.
    frictionless : (position,), the model without its friction; None if it has none.

    Returns
    -------
    By kind, of those that change the course: the size of a zero in the unit of the course; of a gain relative; of the
    angle in rad by which the readings are ahead of the model; of friction relative to the model's.
    """
    shapes = {"zero": np.ones_like(model), "gain": model - datum}
    if drive is not None and len(drive) > 1:
        shapes["angle"] = np.gradient(model) / np.gradient(drive)
    if frictionless is not None:
        shapes["friction"] = model - frictionless
    found = {}
    for kind, shape in shapes.items():
        there = np.isfinite(residual) & np.isfinite(shape)
        gap, along = residual[there], shape[there]
        square, whole = float(along @ along), float(gap @ gap)
        if square > 0 and whole > 0:
            size = float(along @ gap) / square
            found[kind] = Cause(size, size**2 * square / whole)
    return found

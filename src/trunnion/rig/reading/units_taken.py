"""Gains that a unit taken for another leaves behind: readings in lbf ft that are taken for N m have one of 0.738."""

from __future__ import annotations

from collections.abc import Sequence

from trunnion.model.units import UnitError
from trunnion.rig.reading.sensor_quantity import alike, dimensions

__all__ = ["read_as"]

USUAL = (
    "N m", "N cm", "N mm", "kN m", "lbf ft", "lbf in", "ozf in", "kgf m", "kgf cm", "N", "kN", "lbf", "kgf", "rpm",
    "rad/s", "deg/s", "m/s", "mm/s", "km/h", "ft/s", "in/s", "deg", "rad", "mm", "cm", "m", "in", "ft",
)  # fmt: skip
NEAR = 0.03  # of a ratio: the model beside the data need not be right
WIDE, THOUSAND = 0.5, 100.0  # the same of a ratio from which on friction or a load explains none
APART = 0.1  # from 1: nearer, a gain is that of a sensor


def read_as(gains: Sequence[float], unit: str, size: float) -> str:
    """`near 0.7376, as of lbf ft read as N m`, where all gains are near such a ratio; empty if they are not.

    gains: reading by true value; unit, size: that the readings are taken for, and its factor to SI.
    """
    try:
        taken = dimensions(unit)[1]
    except UnitError:
        return ""
    for other in USUAL:
        factor, own = dimensions(other)
        if alike(own, taken) and abs(size / factor - 1) > APART:
            ratio = size / factor
            near = WIDE if not 1 / THOUSAND < ratio < THOUSAND else NEAR
            if all(abs(gain / ratio - 1) <= near for gain in gains):
                return f"near {ratio:.4g}, as of {other} read as {unit}"
    return ""

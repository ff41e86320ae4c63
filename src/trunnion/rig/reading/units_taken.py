"""Gains that a unit taken for another leaves behind: readings in lbf ft that are taken for N m have one of 0.738."""

from __future__ import annotations

import math
from collections.abc import Sequence

from trunnion.model.units import UnitError
from trunnion.rig.reading.sensor_quantity import alike, dimensions

__all__ = ["read_as"]

USUAL = (  # of all that a sensor measures
    "N m", "N cm", "N mm", "kN m", "daN m", "lbf ft", "lbf in", "ozf in", "kgf m", "kgf cm", "gf cm", "N", "mN", "daN",
    "kN", "lbf", "ozf", "kgf", "gf", "rad/s", "deg/s", "rpm", "rev/s", "m/s", "cm/s", "mm/s", "m/min", "km/h", "ft/s",
    "in/s", "mph", "rad", "mrad", "deg", "gon", "turn", "m", "cm", "mm", "µm", "in", "ft", "thou", "m/s^2", "mm/s^2",
    "ft/s^2", "in/s^2", "rad/s^2", "deg/s^2", "W", "kW", "hp",
)  # fmt: skip
NEAR = 0.03  # of a ratio: neither the gain of the sensor nor the model beside the data need be right
WIDE, THOUSAND = 0.5, 100.0  # the same of a ratio from which on friction or a load explains none
ALIKE = 0.01  # of a ratio: by which another may be farther that is told as well
APART = 0.1  # from 1: nearer, a gain is that of a sensor


def read_as(gains: Sequence[float], unit: str, size: float) -> str:
    """`near 0.7376, as of lbf ft read as N m`, where all gains are near such a ratio; empty if they are not.

    gains: reading by true value; unit, size: that the readings are taken for, and its factor to SI. Either may be the
    one that is read as the other; the nearest is told, and a second one that may be meant as well.
    """
    try:
        taken = dimensions(unit)[1]
    except UnitError:
        return ""
    found: dict[float, tuple[float, str]] = {}
    factors = {other: dimensions(other) for other in USUAL}
    alikes = [(other, size / factor) for other, (factor, own) in factors.items() if alike(own, taken)]
    for ratio, mistake in [
        *((ratio, f"{other} read as {unit}") for other, ratio in alikes),
        *((1 / ratio, f"{unit} read as {other}") for other, ratio in alikes),
    ]:
        off = max((abs(math.log(gain / ratio)) if gain > 0 else math.inf for gain in gains), default=math.inf)
        near = NEAR if 1 / THOUSAND < ratio < THOUSAND else WIDE
        if abs(ratio - 1) > APART and off <= math.log1p(near):
            found.setdefault(float(f"{ratio:.4g}"), (off, mistake))
    rows = sorted((off, ratio, mistake) for ratio, (off, mistake) in found.items())
    told = [f"near {ratio:.4g}, as of {mistake}" for off, ratio, mistake in rows[:2] if off <= rows[0][0] + ALIKE]
    return ", or ".join(told)

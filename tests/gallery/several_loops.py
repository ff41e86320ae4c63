"""Linkages of several loops of the gallery."""

from __future__ import annotations

import numpy as np

from gallery.entry import Entry, Outcome
from gallery.plane import corner

# ---- indexing-press: lift of the punch ----------------------------------------------------------------------------


def lift(one: Outcome) -> float:
    """Over the whole cycle: the ram is at rest at both its ends, so that the grid has them."""
    y = one.track("punch.P")[1]
    return float(y.max() - y.min())


def lift_by_hand() -> float:
    """Knee A between O and the rod's pin D, punch B below it on the y axis; at both ends of the ram."""

    def punch(ram: float) -> float:
        knee = corner(0.4j, ram - 0.2 + 0.2j, 0.2, 0.1, 1)
        return float(knee.imag - np.sqrt(0.04 - knee.real**2))

    return abs(punch(0.08) - punch(0.0))


ENTRIES = {
    "indexing-press": Entry(
        says="Lift of the punch",
        unit="m",
        found=lift,
        expected=lift_by_hand,
        source="intersecting circles at both ends of the ram",
        tolerance=1e-12,
        figures=("mechanism", "motion"),
    ),
}

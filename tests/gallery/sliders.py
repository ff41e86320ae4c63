"""Linkages with slides of the gallery."""

from __future__ import annotations

import numpy as np

import trunnion
from gallery.entry import Entry, Outcome
from trunnion.algebra.dual import Dual, derivative

# ---- toleranced-slider-crank: ∂x/∂r of the piston at 60° ----------------------------------------------------------


def sensitivity(one: Outcome) -> float:
    run = trunnion.prepare(one.mechanism)
    sixth = run.cycle.times(6)[1:2]
    back = run.solve(sixth, one.mechanism.parameters({"dimensions.crank": Dual(0.05, 1.0)}))
    return float(np.ravel(derivative(back.walk.point("piston", "Q").place[0]))[0])


def sensitivity_by_hand() -> float:
    """Of x = r cos θ + √(l² − r² sin² θ), m/m."""
    r, length, q = 0.05, 0.2, np.pi / 3
    return float(np.cos(q) - r * np.sin(q) ** 2 / np.sqrt(length**2 - (r * np.sin(q)) ** 2))


ENTRIES = {
    "toleranced-slider-crank": Entry(
        says="Shift of the piston at 60° of the crank per shift of the crank pin along the crank",
        unit="1",
        found=sensitivity,
        expected=sensitivity_by_hand,
        source="the derivative of x = r cos θ + √(l² − r² sin² θ)",
        tolerance=1e-12,
        figures=("mechanism", "torque"),
    ),
}

"""Linkages with play and misaligned axes of the gallery."""

from __future__ import annotations

import numpy as np

import trunnion
from gallery.entry import STEPS, Entry, Outcome
from gallery.plane import corner
from gallery.spatial import rocker_of_rssr

__all__ = ["ENTRIES"]


def ideal_rocker(one: Outcome) -> float:
    """Angle of the rocker at 60° of the crank, every pin centred."""
    centred = one.mechanism.with_values({"joint_defaults.seat": "free"})
    result = trunnion.analyse(centred, 6)
    return float(result["joint_rotation"].sel(joint="D")[1])


def ideal_output(one: Outcome) -> float:
    """The same of the spatial linkage."""
    result = trunnion.analyse(one.mechanism.with_values({"joints.D.seat": "free"}), 6)
    return float(result["joint_rotation"].sel(joint="D")[1])


def smallest(one: Outcome) -> float:
    """The clearance, the same in every pin, that lets it turn all the way, m."""
    return float(trunnion.assemble(one.mechanism, 36)["smallest_clearance"])


def rocker_of_fourbar() -> float:
    """Angle of the 70 mm rocker at 60° of the 30 mm crank, ground 100 mm, coupler 90 mm."""
    c = corner(0.03 * np.exp(1j * np.pi / 3), 0.1, 0.09, 0.07, 1)
    return float(np.angle(c - 0.1))


def leaned_hinges() -> float:
    """ρ = δ H (2 D + H − f)/(4 (D + H)): pins of 80 mm, 1 m apart, one hole leaned by 0.1°, end float of 1 mm.

    The line of the pins goes through the middle of the leaned hole; with the float it is half of it off, where the
    hole's axis has come nearer to the other by δ f/2.
    """
    lean, pin, apart, play = np.radians(0.1), 0.08, 1.0, 1e-3
    return float(lean * pin * (2 * apart + pin - play) / (4 * (apart + pin)))


ENTRIES = {
    "fourbar-with-play": Entry(
        says="Angle of the rocker at 60° of the crank with every pin centred",
        unit="rad",
        found=ideal_rocker,
        expected=rocker_of_fourbar,
        source="the triangle of diagonal, coupler and rocker",
        tolerance=1e-12,
        figures=("mechanism", "torque"),
    ),
    "rssr-with-play": Entry(
        says="Angle of the rocker at 60° of the crank with its shaft centred",
        unit="rad",
        found=ideal_output,
        expected=lambda: rocker_of_rssr(np.pi / 3),
        source="the one equation that the length of the rod leaves",
        tolerance=1e-12,
    ),
    "misaligned-fourbar": Entry(
        says="Smallest clearance, the same in all four pins, with which it turns",
        unit="m",
        found=smallest,
        expected=lambda: float(0.01 * np.tan(np.radians(0.2) / 4)),
        source="the closed form ½ H tan(δ/4), four pins that take up a quarter of the error each",
        tolerance=1e-11,
        figures=("assemble",),
        report=False,
        lost=STEPS,
        errors=("cannot be assembled",),
    ),
    "misaligned-hinges": Entry(
        says="Smallest clearance, the same in both pins, with which it swings",
        unit="m",
        found=smallest,
        expected=leaned_hinges,
        source="the closed form δ H (2 D + H − f)/(4 (D + H)) of the line through two holes, f the end float",
        tolerance=1e-10,
        figures=("assemble",),
        report=False,
        lost=STEPS,
        errors=("cannot be assembled",),
    ),
}

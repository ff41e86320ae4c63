"""Linkages with play and misaligned axes of the gallery."""

from __future__ import annotations

import numpy as np

import trunnion
from gallery.entry import Entry, Outcome
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


def true_rocker(one: Outcome) -> float:
    """Angle of the rocker at 60° of the crank, every axis true."""
    result = trunnion.analyse(one.mechanism.with_values({"joints.C.misalignment.tilt": 0}), 6)
    return float(result["joint_rotation"].sel(joint="D")[1])


def rocker_of_fourbar() -> float:
    """Angle of the 70 mm rocker at 60° of the 30 mm crank, ground 100 mm, coupler 90 mm."""
    c = corner(0.03 * np.exp(1j * np.pi / 3), 0.1, 0.09, 0.07, 1)
    return float(np.angle(c - 0.1))


def hold(one: Outcome) -> float:
    """Effort of the hinge at the start of the swing, with every axis true."""
    result = trunnion.analyse(one.mechanism.with_values({"joints.upper.misalignment.tilt": 0}), 6)
    return float(result["drive_effort"].sel(driver="lower")[0])


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
        says="Angle of the rocker at 60° of the crank with every axis true",
        unit="rad",
        found=true_rocker,
        expected=rocker_of_fourbar,
        source="the triangle of diagonal, coupler and rocker",
        tolerance=1e-12,
    ),
    "misaligned-hinges": Entry(
        says="Torque that holds the door against the wind with every axis true",
        unit="N m",
        found=hold,
        expected=lambda: 10 * 0.8,
        source="force times distance of the handle",
        tolerance=1e-9,
    ),
}

"""Linkages with play and misaligned axes of the gallery."""

from __future__ import annotations

import numpy as np

import trunnion
from gallery.entry import STEPS, Entry, Outcome
from gallery.plane import corner
from gallery.spatial import rocker_of_rssr

__all__ = ["ENTRIES"]


def by_one_play(one: Outcome) -> float:
    """The most that the play of C does to the angle of the rocker, at 60° of the crank."""
    found = trunnion.play(one.mechanism, ["rotation:D"], steps=6)
    return float(found["worst_case"].sel(joint="C", measure="rotation:D")[1])


def ideal_output(one: Outcome) -> float:
    """The same of the spatial linkage."""
    result = trunnion.analyse(one.mechanism.with_values({"joints.D.seat": "free"}), 6)
    return float(result["joint_rotation"].sel(joint="D")[1])


def smallest(one: Outcome) -> float:
    """The clearance, the same in every pin, that lets it turn all the way, m."""
    return float(trunnion.assemble(one.mechanism, 36)["smallest_clearance"])


def play_along_the_coupler() -> float:
    """ϱ/(c sin μ): the coupler is longer by ϱ, c the 70 mm rocker and μ its angle with the coupler of 90 mm."""
    b = 0.03 * np.exp(1j * np.pi / 3)
    c = corner(b, 0.1, 0.09, 0.07, 1)
    return float(2e-5 / (0.07 * abs(np.sin(np.angle((c - b) / (c - 0.1))))))


def leaned_hinges() -> float:
    """ρ = δ H (2 D + H − f)/(4 (D + H)): pins of 80 mm, 1 m apart, one hole leaned by 0.1°, end float of 1 mm.

    The line of the pins goes through the middle of the leaned hole; with the float it is half of it off, where the
    hole's axis has come nearer to the other by δ f/2.
    """
    lean, pin, apart, play = np.radians(0.1), 0.08, 1.0, 1e-3
    return float(lean * pin * (2 * apart + pin - play) / (4 * (apart + pin)))


ENTRIES = {
    "fourbar-with-play": Entry(
        says="Most that the play of C turns the rocker at 60° of the crank",
        unit="rad",
        found=by_one_play,
        expected=play_along_the_coupler,
        source="the closed form ϱ/(c sin μ), a coupler longer by the play",
        tolerance=1e-12,
        figures=("mechanism", "error"),
    ),
    "rssr-with-play": Entry(
        says="Angle of the rocker at 60° of the crank with its shaft centred",
        unit="rad",
        found=ideal_output,
        expected=lambda: rocker_of_rssr(np.pi / 3),
        source="the one equation that the length of the rod leaves",
        tolerance=1e-12,
        figures=("mechanism", "seat"),
    ),
    "misaligned-fourbar": Entry(
        says="Smallest clearance, the same in all four pins, with which it turns",
        unit="m",
        found=smallest,
        expected=lambda: float(0.01 * np.tan(np.radians(0.2) / 4)),
        source="the closed form ½ H tan(δ/4), four pins that take up a quarter of the error each",
        tolerance=1e-11,
        figures=("assemble",),
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
        lost=STEPS,
        errors=("cannot be assembled",),
    ),
}

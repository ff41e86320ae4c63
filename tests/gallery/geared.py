"""Linkages of the gallery with gears."""

from __future__ import annotations

import numpy as np

from gallery.entry import STEPS, Entry, Outcome
from gallery.plane import corner


def tool_height(one: Outcome) -> float:
    return float(np.ptp(one.track("left.tool")[1]))


def expected_height() -> float:
    """Height of the tool's path over two turns, its place by the circle intersection of the two rods."""
    turn = 4 * np.pi * np.arange(STEPS) / STEPS
    b, d = 0.035 * np.exp(1j * turn), 0.120 + 0.045 * np.exp(1j * (np.radians(40) - turn / 2))
    c = corner(b, d, 0.130, 0.120, 1)
    tool = b + (0.150 + 0.045j) * (c - b) / 0.130
    return float(np.ptp(tool.imag))


def off_the_line(one: Outcome) -> float:
    return float(np.abs(one.track("pinion.rod")[1]).max())


ENTRIES = {
    "geared-five-bar": Entry(
        says="Height of the tool's path, by positions 10° of the crank apart",
        unit="m",
        found=tool_height,
        expected=expected_height,
        source="circle intersection for half the angle at the second crank",
        tolerance=1e-12,
    ),
    "cardan-gears": Entry(
        says="Farthest that the rod's pin strays from the diameter",
        unit="m",
        found=off_the_line,
        expected=lambda: 0.0,
        source="La Hire's theorem: a hypocycloid of two cusps is a diameter",
        tolerance=1e-15,
    ),
}

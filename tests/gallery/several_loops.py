"""Linkages of several loops of the gallery, and linkages with gears."""

from collections.abc import Callable
from typing import Any

import numpy as np
from scipy.optimize import fsolve

from gallery.entry import STEPS, Entry, corner


# indexing-press: lift of the punch; the ram is at rest at both its ends, so that the grid has them
def lift_by_hand() -> float:
    """Knee A between O and the rod's pin D, punch B below it on the y axis; at both ends of the ram."""

    def punch(ram: float) -> float:
        knee = corner(0.4j, ram - 0.2 + 0.2j, 0.2, 0.1, 1)
        return float(knee.imag - np.sqrt(0.04 - knee.real**2))

    return abs(punch(0.08) - punch(0.0))


# six-bars: both loops closed by a root finder, all four angles at once
Loops = Callable[[complex, Any], tuple[complex, complex]]


def closed(loops: Loops, crank: Any, guess: tuple[float, ...]) -> Any:
    """Angles (crank, 4) that close both loops at each angle of the crank, from each to the next."""
    found: list[Any] = [np.array(guess)]
    for angle in crank:

        def gap(x: Any, turn: complex = np.exp(1j * angle)) -> list[float]:
            return [part for loop in loops(turn, np.exp(1j * x)) for part in (loop.real, loop.imag)]

        found.append(fsolve(gap, found[-1], xtol=1e-13))
        assert np.max(np.abs(gap(found[-1]))) < 1e-12
    return np.array(found[1:])


FINE = 720


def swing_of_watt() -> float:
    """Unknown: directions of coupler, C from D, rod, agitator."""

    def loops(crank: complex, u: Any) -> tuple[complex, complex]:
        coupler, bell, rod, agitator = u
        first = 0.045 * crank + 0.110 * coupler - 0.075 * bell - 0.120
        second = 0.120 - 0.075j * bell + 0.070 * rod - 0.040 * agitator - (0.160 - 0.040j)
        return first, second

    found = closed(loops, np.arange(FINE) * 2 * np.pi / FINE, (0.75, 1.5, -1.77, -1.03))
    return float(np.ptp(found[:, 3]))


def rest_of_stephenson() -> float:
    """Unknown: directions of B from C, C from D, rod, output. The cycle begins at 90°."""

    def loops(crank: complex, u: Any) -> tuple[complex, complex]:
        coupler, rocker, rod, output = u
        first = 0.080 + 0.120 * rocker + 0.120 * coupler - 0.050 * crank
        p = 0.080 + 0.120 * rocker + 0.120 * coupler * np.exp(-1j * np.radians(75))
        second = p + 0.1598 * rod - 0.1003 * output - (0.104 + 0.105j)
        return first, second

    crank = np.radians(np.arange(90, 241, 5))
    return float(np.ptp(closed(loops, crank, (4.1, 1.9, 5.3, 3.9))[6:, 3]))


ENTRIES = {
    "indexing-press": Entry(
        says="Lift of the punch", unit="m", tolerance=1e-12, figures=("mechanism", "motion"),
        found=lambda one: float(np.ptp(one.track("punch.P")[1])), expected=lift_by_hand,
        source="intersecting circles at both ends of the ram",
    ),
    "watt-six-bar": Entry(
        says="Swing of the agitator", unit="rad", tolerance=1e-10, figures=("mechanism", "motion"),
        found=lambda one: float(np.ptp(one.over(FINE).angle("agitator"))), expected=swing_of_watt,
        source="closing both loops with scipy's fsolve",
    ),
    "stephenson-six-bar": Entry(
        says="Turn of the output from 120° to 240° of the crank", unit="rad", tolerance=1e-10,
        figures=("mechanism", "motion"), found=lambda one: float(np.ptp(one.angle("output")[6:31])),
        expected=rest_of_stephenson, source="closing both loops with scipy's fsolve",
    ),
}  # fmt: skip


def expected_height() -> float:
    """Height of the tool's path over two turns, its place by the circle intersection of the two rods."""
    turn = 4 * np.pi * np.arange(STEPS) / STEPS
    b, d = 0.035 * np.exp(1j * turn), 0.120 + 0.045 * np.exp(1j * (np.radians(40) - turn / 2))
    tool = b + (0.150 + 0.045j) * (corner(b, d, 0.130, 0.120, 1) - b) / 0.130
    return float(np.ptp(tool.imag))


GEARED = {
    "geared-five-bar": Entry(
        says="Height of the tool's path, by positions 10° of the crank apart", unit="m", tolerance=1e-12,
        found=lambda one: float(np.ptp(one.track("left.tool")[1])), expected=expected_height,
        source="circle intersection for half the angle at the second crank",
    ),
    "cardan-gears": Entry(
        says="Farthest that the rod's pin strays from the diameter", unit="m", tolerance=1e-15,
        found=lambda one: float(np.abs(one.track("pinion.rod")[1]).max()), expected=lambda: 0.0,
        source="La Hire's theorem: a hypocycloid of two cusps is a diameter",
    ),
}  # fmt: skip

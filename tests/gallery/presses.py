"""Linkages of the gallery that press: two knuckle joints and a crusher."""

from typing import Any

import numpy as np
from scipy.optimize import brentq, minimize_scalar

import trunnion
from gallery.entry import STEPS, Entry, Outcome, corner
from trunnion.solve.run import prepare
from trunnion.studies import design


# toggle-press: where it begins to hold by itself
def holds_from(one: Outcome) -> float:
    """Offset of the knee on the way back at which the cylinder's force changes its sign, m."""
    run = prepare(one.mechanism)

    def force(time: float) -> float:
        return float(np.ravel(run.solve(np.array([time])).efforts["Z"])[0])

    time = brentq(force, 2.1, 3.0, xtol=1e-14)
    return -float(np.ravel(run.solve(np.array([time])).walk.point("upper", "A").place[0])[0])


# drawing-press: the friction of the guide at which it locks
def guide_locks_from(one: Outcome) -> float:
    """Coefficient of the guide at which the start of the stroke locks, the pins being free of friction."""
    smooth = one.mechanism.with_values({f"{pin}.friction.coefficient": 0 for pin in "OKPCR"})
    return 0.1 * float(trunnion.analyse(smooth, STEPS)["locking_margin"].min())


def guide_locks_by_hand() -> float:
    """slide / (2 neck tan α): the friction at both ends of the guide takes the whole force along it."""
    knee = corner(-0.5 - 0.2j, 0, 0.38, 0.2, -1)
    return float(0.08 / (2 * 0.12 * abs(knee.real / knee.imag)))


# jaw-crusher: stroke of the jaw's lip
def jaw_angle(turn: Any) -> Any:
    """Rotation of the jaw, rad: pitman and rear toggle over the eccentric, front toggle and jaw over the pitman."""
    eccentric = 0.75 + 0.02 * np.exp(1j * turn)
    arm, seat = 0.06 - 1.15j, 0.255 - 1.035j  # on the pitman from the eccentric, on the jaw from its pivot
    rear = corner(eccentric, 1.27 - 1.035j, abs(arm), 0.45, -1)
    front = eccentric + (rear - eccentric) / arm * (-0.06 - 1.15j)
    return np.angle(corner(front, 0, 0.45, abs(seat), 1) / seat)


def stroke_by_hand() -> float:
    """From the least and the greatest rotation of the jaw, rad."""
    grid = 2 * np.pi * np.arange(72) / 72
    turned = 0.0
    for sign in (1.0, -1.0):
        near = grid[np.argmin(sign * jaw_angle(grid))]
        best = minimize_scalar(lambda q, sign=sign: sign * jaw_angle(q), bounds=(near - 0.1, near + 0.1),
                               method="bounded", options={"xatol": 1e-9})  # fmt: skip
        turned -= best.fun
    return float(2 * np.hypot(0.06, 1.26) * np.sin(turned / 2))


def stroke(one: Outcome) -> float:
    """Chord of the lip between the positions where the jaw turns back."""
    run = prepare(one.mechanism)
    turns = np.array(design.dead_centres(run)["J"])
    x, y = run.solve(turns / (2 * np.pi) * run.cycle.duration).walk.point("jaw", "lip").place
    return float(np.hypot(np.ptp(x), np.ptp(y)))


# flywheel-press: how the motor starts it
def start_by_hand() -> float:
    """i η T over the inertias, at the dead centre: of the crank, of the rotor by i² η, of the rod."""
    standstill = 2 * 60 / (1 / 0.2 + 0.2)
    rod = 14 * (0.04 * (1 - 80 / 220)) ** 2 + 0.09 * (0.04 / 0.22) ** 2
    return float(12 * 0.95 * standstill / (22 + 12**2 * 0.95 * 0.02 + rod))


ENTRIES = {
    "flywheel-press": Entry(
        says="Acceleration of the crank as the motor starts it, without friction", unit="rad/s^2", tolerance=1e-9,
        figures=("mechanism", "torque"), expected=start_by_hand,
        found=lambda one: float(trunnion.simulate(one.mechanism.with_friction("off"), 1e-3, 1)
                                ["joint_rotation_acceleration"].sel(joint="O")[0]),
        source="Kloss's torque at standstill over the inertias at the dead centre",
    ),
    "toggle-press": Entry(
        says="Distance of the knee from its dead centre below which the press holds by itself", unit="m",
        tolerance=1e-10, figures=("mechanism", "torque"), found=holds_from, expected=lambda: 2 * 0.1 * 0.02,
        source="the friction circles of the three pins, 2 f ρ",
    ),
    "drawing-press": Entry(
        says="Friction coefficient of the guide from which the press locks, with frictionless pins", unit="1",
        tolerance=1e-8, figures=("mechanism", "torque"), found=guide_locks_from, expected=guide_locks_by_hand,
        source="the equilibrium of the ram by hand, slide / (2 neck tan α)",
    ),
    "jaw-crusher": Entry(
        says="Stroke of the jaw at its lip", unit="m", tolerance=1e-12, figures=("mechanism", "torque"), found=stroke,
        expected=stroke_by_hand, source="intersecting circles and looking for the extremes (SciPy)",
    ),
}  # fmt: skip

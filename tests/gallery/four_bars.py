"""Four-bars of the gallery."""

import numpy as np

import trunnion
from gallery.entry import Entry, Outcome, bend, corner, slope


# durango-fourbar: the crank's torque without friction at 60°, by virtual work
def torque_at_60(one: Outcome) -> float:
    ideal = trunnion.analyse(one.mechanism.with_friction("off"), 6)
    return float(ideal["drive_effort"].sel(driver="A")[1])


def torque_by_virtual_work() -> float:
    """T = Σ (m r̈·r' + J φ̈ φ') − F·r'_E − M φ'_CD, ' by the crank angle, at a constant 10 rad/s without weight."""

    def pins(q: float) -> tuple[complex, complex]:
        b = 2.0 * np.exp(1j * q)
        return b, corner(b, 5.5, 6.0, 3.0, 1)

    def on_coupler(q: float, distance: float, angle: float) -> complex:
        b, c = pins(q)
        return b + distance * (c - b) / 6.0 * np.exp(1j * angle)

    def coupler(q: float) -> complex:
        return complex(np.angle(pins(q)[1] - pins(q)[0]))

    def rocker(q: float) -> complex:
        return complex(np.angle(pins(q)[1] - 5.5))

    centres = ((30.0, lambda q: on_coupler(q, 2.8, 0.152)), (7.2, lambda q: (5.5 + pins(q)[1]) / 2))
    q, speed = np.pi / 3, 10.0
    torque = sum(m * speed**2 * (bend(r, q) * np.conj(slope(r, q))).real for m, r in centres)
    for inertia, angle in ((48.80, coupler), (5.50, rocker)):
        torque += inertia * speed**2 * (bend(angle, q) * slope(angle, q)).real
    tip = slope(lambda q: on_coupler(q, 2.5, np.pi / 6), q)
    return float(torque - (-1000.0) * tip.imag - (-250.0) * slope(rocker, q).real)


# straight lines: largest less least height of the point, at every half degree
FINE = 720


def height_of_hoecken_by_hand() -> float:
    b = 0.04 * np.exp(1j * np.radians(np.arange(90, 270.25, 0.5)))
    return float(np.ptp((b + 2 * (corner(b, 0.08, 0.1, 0.1, -1) - b)).imag))


def height_of_chebyshev_by_hand() -> float:
    """Left rocker and coupler are one rigid arm A C at every angle between them."""
    unit, turn = 0.03, np.exp(1j * np.radians(np.arange(60, 180.25, 0.5)))
    arm = 5 + 2 * turn
    return float(np.ptp(unit * ((5 + turn) * corner(0j, 4, np.abs(arm), 5, 1) / arm).imag))


ENTRIES = {
    "durango-fourbar": Entry(
        says="Drive torque without friction at 60° of the crank", unit="N m", tolerance=1e-4,
        figures=("mechanism", "torque"), found=torque_at_60, expected=torque_by_virtual_work,
        source="virtual work on pins found by intersecting circles",
    ),
    "spring-balanced-lamp": Entry(
        says="Largest torque at the pivot without friction", unit="N m", tolerance=1e-12, expected=lambda: 0.0,
        found=lambda one: float(abs(trunnion.analyse(one.mechanism.with_friction("off"), 36)["drive_effort"]).max()),
        source="the balance k a b = Σ m g r of a spring of free length zero (M. J. French, M. B. Widden, Proc. IMechE "
               "C 214 (2000) 501–508)",
    ),
    "hoecken": Entry(
        says="Height of the path of P over half a turn of the crank, 90° to 270°", unit="m", tolerance=1e-13,
        found=lambda one: float(np.ptp(one.over(FINE).track("coupler.P")[1][180:541])),
        expected=height_of_hoecken_by_hand,
        source="intersecting circles at every half degree",
    ),
    "chebyshev-line": Entry(
        says="Height of the path of P from 60° to 180° of the coupler", unit="m", tolerance=1e-12,
        found=lambda one: float(np.ptp(one.over(FINE).track("coupler.P")[1][:241])),
        expected=height_of_chebyshev_by_hand,
        source="intersecting circles at every half degree",
    ),
}  # fmt: skip

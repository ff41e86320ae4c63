"""Two drives, one large group, and a benchmark of other codes."""

from collections.abc import Mapping
from functools import lru_cache

import numpy as np
from scipy.optimize import fsolve

from gallery.entry import Entry, Outcome, bend, corner, slope
from gallery.four_bars import torque_at_60
from trunnion.solve.run import prepare

# five-bar-robot: what the process force asks of the left motor
MOMENT = 0.1  # s


def share(one: Outcome, motor: str = "A") -> float:
    """Torque of a motor with the process force less that without it, both without friction, at `MOMENT`."""
    ideal = one.mechanism.with_friction("off")
    idle = ideal.with_values({"loads.process.force.x": 0.0, "loads.process.force.y": 0.0})
    loaded, free = (float(np.ravel(prepare(m).solve(np.array([MOMENT])).efforts[motor])[0])
                    for m in (ideal, idle))  # fmt: skip
    return loaded - free


def tool(left: float, right: float) -> complex:
    """Place of the tool over the angles of both motors."""
    return corner(0.25 * np.exp(1j * left), 0.3 + 0.25 * np.exp(1j * right), 0.35, 0.35, 1)


def share_by_hand(motor: str = "A") -> float:
    """τ = −Jᵀ F."""
    w, swing = 2 * np.pi / 0.8, np.radians(20)
    left = np.radians(125) + swing * np.sin(w * MOMENT)
    right = np.radians(55) + swing * np.sin(w * MOMENT + np.pi / 2)
    column = slope(lambda q: tool(q, right), left) if motor == "A" else slope(lambda q: tool(left, q), right)
    return float(-(-15.0 * column.real - 25.0 * column.imag))


# double-butterfly: virtual work at 60°
# mass kg, inertia kg m², mass centre: pin and offset from it in the link's frame m, of each link but the crank
BODIES: Mapping[str, tuple[float, float, str, complex]] = {
    "left": (1.6, 2.4e-2, "B", 0.049 + 0.165j), "right": (1.5, 2.1e-2, "C", 0.152 + 0.065j),
    "wing": (0.8, 4.5e-3, "G", -0.031 + 0.048j), "rocker": (0.6, 3.5e-3, "D", 0.130),
    "tie": (0.7, 5.7e-3, "E", 0.155), "strut": (0.7, 5.5e-3, "F", 0.152),
}  # fmt: skip


@lru_cache(maxsize=64)
def butterfly(turn: float) -> tuple[dict[str, complex], dict[str, float]]:
    """Pins, m, and rotations of the links, rad: those of both couplers and the wing such that three bars keep."""

    def pins(x: np.ndarray) -> dict[str, complex]:
        left, right, wing = np.exp(1j * x)
        at = {"B": 0.06 * np.exp(1j * turn), "D": 0.457 - 0.134j, "G": 0.301 + 0.555j}
        at |= {"C": at["B"] + (0.183 + 0.156j) * left, "E": at["B"] + (-0.035 + 0.338j) * left}
        at |= {"T": at["C"] + (0.174 - 0.033j) * right, "F": at["C"] + (0.282 + 0.227j) * right}
        return at | {"H": at["G"] + (-0.146 + 0.063j) * wing, "I": at["G"] + (0.054 + 0.080j) * wing}

    def gaps(x: np.ndarray) -> list[float]:
        at = pins(x)
        bars = (("D", "T", 0.260), ("E", "H", 0.309), ("F", "I", 0.304))
        return [abs(at[one] - at[other]) - long for one, other, long in bars]

    x = fsolve(gaps, np.zeros(3), xtol=1e-12)
    at = pins(x)
    bars = {"rocker": at["T"] - at["D"], "tie": at["H"] - at["E"], "strut": at["I"] - at["F"]}
    angles = dict(zip(("left", "right", "wing"), map(float, x), strict=True))
    return at, angles | {name: float(np.angle(bar)) for name, bar in bars.items()}


def butterfly_torque(turn: float = np.pi / 3) -> float:
    """T = Σ (m (r̈ + g)·r' + J φ̈ φ') + M |φ'_wing|, ' by the crank angle, at a constant 2π rad/s."""
    speed, g = 2 * np.pi, 9.81j
    torque = 0.3 * 9.81 * 0.03 * np.cos(turn) + 20.0 * abs(slope(lambda q: complex(butterfly(q)[1]["wing"]), turn))
    for name, (mass, inertia, pin, offset) in BODIES.items():

        def centre(q: float, name: str = name, pin: str = pin, offset: complex = offset) -> complex:
            at, angles = butterfly(q)
            return complex(at[pin] + offset * np.exp(1j * angles[name]))

        def angle(q: float, name: str = name) -> complex:
            return complex(butterfly(q)[1][name])

        torque += mass * ((speed**2 * bend(centre, turn) + g) * np.conj(slope(centre, turn))).real
        torque += inertia * speed**2 * (bend(angle, turn) * slope(angle, turn)).real
    return float(torque)


ENTRIES = {
    "five-bar-robot": Entry(
        says="Torque that the process force asks of the motor A after 0.1 s", unit="N m", tolerance=1e-9,
        figures=("mechanism", "torque"), found=share, expected=share_by_hand,
        source="virtual work, −Jᵀ F, on a tool found by intersecting circles",
    ),
    "double-butterfly": Entry(
        says="Drive torque without friction at 60° of the crank", unit="N m", tolerance=1e-5,
        figures=("mechanism", "torque"), found=torque_at_60, expected=butterfly_torque,
        source="virtual work, on a closure for three angles (SciPy)",
    ),
    "andrews-squeezer": Entry(
        says="Drive torque at the start", unit="N m", tolerance=1e-13, figures=("mechanism", "torque"),
        found=lambda one: float(one.result["drive_effort"].sel(driver="O")[0]), expected=lambda: 0.033,
        source="the torque that gives the published acceleration there (E. Hairer, G. Wanner)",
    ),
}  # fmt: skip

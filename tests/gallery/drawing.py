"""Linkages of the gallery that draw: a straight line, the steps of two walking legs."""

from typing import Any

import numpy as np
from scipy.optimize import fsolve

from gallery.entry import STEPS, Entry, corner


# jansen: the foot by seven triangles
def jansen_foot(turn: Any) -> Any:
    """Place of the foot with the crank's bearing at 0; each pin is the third corner over two known ones."""
    crank, hip = 0.15 * np.exp(1j * turn), -0.38 - 0.078j
    top = corner(crank, hip, 0.500, 0.415, -1)  # rods j and b
    heel = corner(crank, hip, 0.619, 0.393, 1)  # rods k and c
    back = corner(top, hip, 0.558, 0.401, -1)  # sides e and d
    knee = corner(back, heel, 0.394, 0.367, -1)  # rods f and g
    return corner(knee, heel, 0.657, 0.490, -1)  # sides h and i


def turns(start: float) -> Any:
    """Crank angles of the outcome's positions."""
    return start + 2 * np.pi * np.arange(STEPS) / STEPS


# klann: the foot by the lengths between pins
KLANN = {  # coordinates of the patent for the extended position
    "A": (1.366, 1.366), "B": (1.009, 0.574), "O": (1.599, 0.750), "P": (1.331, 0.750), "E": (0.741, 0.750),
    "K": (0.232, 0.866), "H": (0.866, 1.500), "foot": (0.0, 0.0),
}  # fmt: skip
BARS = ("PE", "PK", "EK", "BE", "KH", "AH")


def klann_foot(turn: Any) -> Any:
    """Place of the foot, m: E, K and H such that six lengths keep, found from the position before."""
    at = {name: np.array(place) for name, place in KLANN.items()}
    lengths = [np.hypot(*(at[one] - at[other])) for one, other in BARS]

    def gaps(x: Any, pin: Any) -> Any:
        now = at | {"P": pin, "E": x[0:2], "K": x[2:4], "H": x[4:6]}
        return [np.hypot(*(now[one] - now[other])) - long for (one, other), long in zip(BARS, lengths, strict=True)]

    pin_by = 0.268 * np.exp(1j * np.asarray(turn))
    x, feet = np.concatenate([at["E"], at["K"], at["H"]]), []
    start = (complex(*(at["foot"] - at["K"]))) / complex(*(at["H"] - at["K"]))  # K, H and the foot are one body
    for pin in pin_by:
        x = fsolve(gaps, x, args=(at["O"] + [pin.real, pin.imag],), xtol=1e-12)
        feet.append(complex(x[2], x[3]) + start * complex(x[4] - x[2], x[5] - x[3]))
    return 0.2 * np.array(feet)


ENTRIES = {
    "peaucellier": Entry(
        says="Farthest that the pen strays from a straight line", unit="m", tolerance=2e-13, expected=lambda: 0.0,
        found=lambda one: float(abs(one.track("side-CE.pen")[0] - (0.25**2 - 0.1**2) / (2 * 0.16)).max()),
        source="Peaucellier's x = (L² − m²) / (2 r)",
    ),
    "jansen": Entry(
        says="Length of the foot's step, by positions 5° apart", unit="m", tolerance=1e-12,
        figures=("mechanism", "torque"), found=lambda one: float(np.ptp(one.track("shank.foot")[0])),
        expected=lambda: float(np.ptp(jansen_foot(turns(np.pi)).real)),
        source="intersecting circles, from the crank to the foot",
    ),
    "klann": Entry(
        says="Height to which the foot is lifted, by positions 5° apart", unit="m", tolerance=1e-10,
        figures=("mechanism", "motion"), found=lambda one: float(np.ptp(one.track("leg.foot")[1])),
        expected=lambda: float(np.ptp(klann_foot(turns(np.pi)).imag)),
        source="solving for the places of three pins such that all lengths keep (SciPy)",
    ),
}  # fmt: skip

"""A four-bar without forces: its model file, and the angle of its rocker in closed form."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
FOUR_BAR: dict[str, Any] = {
    "trunnion": 1,
    "space": "planar",
    "dimensions": {"AB": "35 mm", "BC": "100 mm", "CD": "86 mm", "AD": "120 mm"},
    "links": {
        "ground": {"points": {"A": [0, 0], "D": ["AD", 0]}},
        "crank": {"points": {"A": [0, 0], "B": ["AB", 0]}},
        "coupler": {"points": {"B": [0, 0], "C": ["BC", 0]}},
        "rocker": {"points": {"D": [0, 0], "C": ["CD", 0]}},
    },
    "joints": {
        name: {"type": "revolute", "links": links}
        for name, links in {
            "A": ["ground", "crank"], "B": ["crank", "coupler"], "C": ["coupler", "rocker"], "D": ["ground", "rocker"],
        }.items()
    },
    "drivers": {"A": {"speed": "60 rpm"}},
    "assembly": {"C": ["100 mm", "83 mm"]},
}  # fmt: skip


def rocker(crank: Array, cd: float = 0.085) -> Array:
    """Angle of the rocker, rad, of links of 120, 35 and 100 mm, by the law of cosines."""
    x, y = 0.12 - 0.035 * np.cos(crank), -0.035 * np.sin(crank)
    diagonal = np.hypot(x, y)
    return np.pi + np.arctan2(y, x) - np.arccos((diagonal**2 + cd**2 - 0.1**2) / (2 * diagonal * cd))

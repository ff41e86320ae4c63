"""The crank press of the tests of loads that jump, as plain data, and its closed forms."""

from typing import Any

import numpy as np

from mechanisms_parts import Data, joined, slide
from trunnion import Mechanism


def press(dimensions: Data | None = None, **sections: Any) -> Mechanism:
    """Crank r, rod l, a ram whose slide lies e off the crank's pin; it starts in its outer dead centre."""
    data = {
        "gravity": [0, 0],
        "dimensions": {"r": 0.03, "l": 0.2, "e": 0.0, **(dimensions or {})},
        "links": {
            "frame": {"points": {"O": [0, 0], "S": {"at": [0, "e"], "axis": [1, 0]}}},
            "crank": {"points": {"O": [0, 0], "P": ["r", 0]}},
            "rod": {"points": {"P": [0, 0], "Q": ["l", 0]}},
            "ram": {"points": {"Q": [0, 0], "S": slide(0, 0)}},
        },
        "joints": joined("frame -O- crank -P- rod -Q- ram, frame =S= ram", S={"guide": {"length": 0.03}}),
        "drivers": {"O": {"speed": "60 rpm", "start": "180 deg"}},
        "assembly": {"Q": [0.17, 0]},
    }
    return Mechanism(**{**data, **sections})


def arm(angle: Any, r: float = 0.03, rod: float = 0.2) -> Any:
    """Power in = power out: torque over the force that presses on the ram, −x'(θ), m."""
    return -r * np.sin(angle) * (1 + r * np.cos(angle) / np.sqrt(rod**2 - (r * np.sin(angle)) ** 2))

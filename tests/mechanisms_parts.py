"""What the mechanisms of the tests are written with: joints, slides and links as plain data."""

from __future__ import annotations

from typing import Any

import numpy as np

Data = dict[str, Any]


def revolute(*links: str) -> Data:
    return {"type": "revolute", "links": list(links)}


def prismatic(*links: str) -> Data:
    return {"type": "prismatic", "links": list(links)}


def slide(x: float, y: float, angle: float = 0.0) -> Data:
    """Point of a prismatic joint with the direction of its slide."""
    return {"at": [x, y], "axis": [float(np.cos(angle)), float(np.sin(angle))]}


def body(points: Data, number: int = 1, size: float = 1.0) -> Data:
    """A link with mass properties off its axes, different for each number."""
    return {
        "points": points,
        "mass": 1.0 + 0.7 * number,
        "centre": [size * (0.2 + 0.07 * number), size * (0.1 - 0.05 * number)],
        "inertia": size**2 * (0.05 + 0.02 * number),
    }

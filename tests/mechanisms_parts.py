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


def plunger(r: float, rod: float, pins: Data) -> Data:
    """A crank that presses a guided ram towards W on the ground. pins: what is stated of each joint that turns."""
    return {
        "gravity": [0, 0],
        "links": {
            "ground": {"points": {"O": [0, 0], "S": {"at": [0, 0], "axis": [1, 0]}, "W": [0.2, 0]}},
            "crank": {"points": {"O": [0, 0], "A": [r, 0]}},
            "rod": {"points": {"A": [0, 0], "B": [rod, 0]}},
            "ram": {"points": {"B": [0, 0], "S": {"at": [0, 0], "axis": [1, 0]}}},
        },
        "joints": {
            "O": {"type": "revolute", "links": ["ground", "crank"], **pins.get("O", {})},
            "A": {"type": "revolute", "links": ["crank", "rod"], **pins.get("A", {})},
            "B": {"type": "revolute", "links": ["rod", "ram"], **pins.get("B", {})},
            "S": {"type": "prismatic", "links": ["ground", "ram"]},
        },
        "assembly": {"B": [0.09, 0]},
    }

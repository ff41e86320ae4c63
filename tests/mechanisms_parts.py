"""What the mechanisms of the tests are written with: joints, slides and links as plain data."""

import copy
from pathlib import Path
from typing import Any

import numpy as np

import trunnion

Data = dict[str, Any]
EXAMPLES = Path(__file__).parents[1] / "examples"


def example(name: str) -> trunnion.Mechanism:
    return trunnion.read(EXAMPLES / f"{name}.yaml")


def joined(chains: str, **more: Data) -> Data:
    """Joints along chains of links, such as "ground -A- crank -B:spherical- rod, ground =S= ram": = for a slide.

    more: what else is stated of a joint, by its name.
    """
    joints: Data = {}
    for chain in chains.split(", "):
        link, *steps = chain.split()
        for joint, after in zip(steps[::2], steps[1::2], strict=True):
            name, _, kind = joint[1:-1].partition(":")
            kind = kind or ("prismatic" if joint[0] == "=" else "revolute")
            joints[name] = {"type": kind, "links": [link, after], **more.get(name, {})}
            link = after
    return joints


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


def bare(data: Data) -> Data:
    """The same with massless links and without loads."""
    data = copy.deepcopy(data)
    for link in data["links"].values():
        for key in ("mass", "inertia", "centre", "inertia_about"):
            link.pop(key, None)
    return {**data, "loads": {}}


def corner(b: Any, d: Any, bc: Any, cd: Any, side: float) -> Any:
    """Where circles about two points x + i y meet, to the left of the way from b to d for side 1; NaN if nowhere."""
    far = np.abs(d - b)
    with np.errstate(invalid="ignore"):
        share = (bc**2 - cd**2 + far**2) / (2 * far)
        return b + (d - b) / far * (share + 1j * side * np.sqrt(bc**2 - share**2))


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
        "joints": joined("ground -O- crank -A- rod -B- ram, ground =S= ram", **pins),
        "assembly": {"B": [0.09, 0]},
    }

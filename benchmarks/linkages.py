"""The linkages whose cost per group is measured, as models: slider-crank, six-bars, Jansen's leg, a class III linkage.

All have friction in every joint, inertia loads and an applied load, and but for the four-bar gravity. Links without
figures of their own are uniform bars of 2 kg/m.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from math import hypot
from pathlib import Path
from typing import Any, NamedTuple

from trunnion import Mechanism

Data = dict[str, Any]

__all__ = ["LINKAGES", "Linkage"]


class Linkage(NamedTuple):
    """A mechanism with what it is made of: `groups` Assur groups, of class `class_` at most."""

    build: Callable[[], Mechanism]
    groups: int
    class_: int = 2


def revolute(*links: str) -> Data:
    return {"type": "revolute", "links": list(links)}


def prismatic(*links: str) -> Data:
    return {"type": "prismatic", "links": list(links)}


def guide(x: float, y: float, axis: tuple[float, float] = (1.0, 0.0)) -> Data:
    """Point of a prismatic joint with the direction of its slide."""
    return {"at": [x, y], "axis": list(axis)}


def bar(**points: Any) -> Data:
    """A link of 2 kg/m between its first point, its origin, and its farthest; centre half-way along."""
    places = [point["at"] if isinstance(point, dict) else point for point in points.values()]
    far = max(places, key=lambda place: hypot(*place))
    length = max(hypot(*far), 0.02)
    mass = 2.0 * length
    return {
        "points": points,
        "mass": mass,
        "centre": [far[0] / 2, far[1] / 2],
        "inertia": mass * length**2 / 12,
    }


def corner(base: float, near: float, far: float) -> list[float]:
    """Third corner of a triangle on the x axis from (0, 0) to (base, 0), above it; near, far: its distances."""
    x = (base**2 + near**2 - far**2) / (2 * base)
    return [x, (near**2 - x**2) ** 0.5]


def mechanism(pin: float = 0.005, **data: Any) -> Mechanism:
    """With gravity, and friction in every joint; pin: radius, m."""
    defaults: Data = {"pin": {"radius": pin}, "friction": 0.1}
    if any(joint["type"] == "prismatic" for joint in data["joints"].values()):
        defaults["guide"] = {"length": 0.1}
    return Mechanism(gravity=[0, -9.81], joint_defaults=defaults, **data)


def slider_crank() -> Mechanism:
    return mechanism(
        links={
            "ground": {"points": {"A": [0, 0], "C": guide(0, 0.02)}},
            "crank": bar(A=[0, 0], B=[0.1, 0]),
            "rod": bar(B=[0, 0], P=[0.35, 0]),
            "piston": {"points": {"P": [0, 0], "C": guide(0, 0)}, "mass": 1.2},
        },
        joints={
            "A": revolute("ground", "crank"),
            "B": revolute("crank", "rod"),
            "P": revolute("rod", "piston"),
            "C": prismatic("ground", "piston"),
        },
        drivers={"A": {"speed": 30.0}},
        loads={"gas": {"link": "piston", "at": "P", "force": [-400.0, 0.0]}},
        assembly={"P": [0.45, 0.02]},
    )


def watt() -> Mechanism:
    """A four-bar whose rocker moves an output link by a rod: two dyads RRR."""
    return mechanism(
        links={
            "ground": {"points": {"A": [0, 0], "D": [1, 0], "G": [2, 0.1]}},
            "crank": bar(A=[0, 0], B=[0.3, 0]),
            "coupler": bar(B=[0, 0], C=[0.9, 0]),
            "rocker": bar(D=[0, 0], C=[0.7, 0], F=[0.5, 0.3]),
            "rod": bar(F=[0, 0], H=[1, 0]),
            "output": bar(G=[0, 0], H=[0.8, 0]),
        },
        joints={
            "A": revolute("ground", "crank"),
            "B": revolute("crank", "coupler"),
            "C": revolute("coupler", "rocker"),
            "D": revolute("ground", "rocker"),
            "F": revolute("rocker", "rod"),
            "H": revolute("rod", "output"),
            "G": revolute("ground", "output"),
        },
        drivers={"A": {"speed": 4.0}},
        loads={"work": {"link": "output", "moment": -20.0}},
        assembly={"C": [0.9, 0.7], "H": [2, 1]},
    )


def quick_return() -> Mechanism:
    """A shaper: crank, block and swinging arm (RPR), rod and ram (RRP)."""
    return mechanism(
        links={
            "ground": {"points": {"A": [0, 0], "D": [0, -0.4], "R": guide(0, 0.35)}},
            "crank": bar(A=[0, 0], B=[0.15, 0]),
            "block": {"points": {"B": [0, 0], "S": guide(0, 0)}, "mass": 0.3, "inertia": 1e-4},
            "arm": bar(D=[0, 0], S=guide(0, 0), T=[0.7, 0]),
            "rod": bar(T=[0, 0], Q=[0.25, 0]),
            "ram": {"points": {"Q": [0, 0], "R": guide(0, 0)}, "mass": 4.0},
        },
        joints={
            "A": revolute("ground", "crank"),
            "B": revolute("crank", "block"),
            "S": prismatic("arm", "block"),
            "D": revolute("ground", "arm"),
            "T": revolute("arm", "rod"),
            "Q": revolute("rod", "ram"),
            "R": prismatic("ground", "ram"),
        },
        drivers={"A": {"speed": 6.0}},
        loads={"cut": {"link": "ram", "at": "Q", "force": [-300.0, 0.0]}},
        assembly={"S": [0.15, 0.0], "arm.T": [0.2, 0.25], "Q": [0.45, 0.35]},
    )


def jansen() -> Mechanism:
    """One leg of Th. Jansen's walking machines with his "holy numbers", here mm: three dyads RRR.

    Source of the lengths: T. Jansen, strandbeest.com, explanation of the leg system.
    """
    a, b, c, d, e, f, g, h, i, j, k, l, m = (  # noqa: E741
        1e-3 * n for n in (38, 41.5, 39.3, 40.1, 55.8, 39.4, 36.7, 65.7, 49, 50, 61.9, 7.8, 15)
    )
    return mechanism(
        pin=0.002,
        links={
            "ground": {"points": {"O": [0, 0], "B1": [-a, -l], "B2": [-a, -l]}},
            "crank": bar(O=[0, 0], P1=[m, 0], P2=[m, 0]),
            "upper rod": bar(P1=[0, 0], U=[j, 0]),
            "upper triangle": bar(B1=[0, 0], U=[b, 0], W=corner(b, d, e)),
            "lower rod": bar(P2=[0, 0], L1=[k, 0]),
            "lower arm": bar(B2=[0, 0], L1=[c, 0], L2=[c, 0]),
            "side rod": bar(W=[0, 0], K=[f, 0]),
            "foot": bar(L2=[0, 0], K=[g, 0], F=corner(g, i, h)),
        },
        joints={
            "O": revolute("ground", "crank"),
            "P1": revolute("crank", "upper rod"),
            "U": revolute("upper rod", "upper triangle"),
            "B1": revolute("ground", "upper triangle"),
            "P2": revolute("crank", "lower rod"),
            "L1": revolute("lower rod", "lower arm"),
            "B2": revolute("ground", "lower arm"),
            "W": revolute("upper triangle", "side rod"),
            "K": revolute("side rod", "foot"),
            "L2": revolute("lower arm", "foot"),
        },
        drivers={"O": {"speed": 6.0}},
        loads={"ground": {"link": "foot", "at": "F", "force": [-2.0, 20.0]}},
        assembly={"U": [-0.025, 0.031], "L1": [-0.03, -0.045], "K": [-0.066, -0.04]},
    )


def class_three() -> Mechanism:
    """A ternary link on three rods: to the crank and to two pins of the ground, one group of class III."""
    return mechanism(
        links={
            "ground": {"points": {"A": [0, 0], "G": [1.4, -0.15], "H": [0.55, 1.9]}},
            "crank": bar(A=[0, 0], B=[0.1, 0]),
            "rod1": bar(B=[0, 0], P=[0.8485, 0]),
            "rod2": bar(G=[0, 0], Q=[0.7566, 0]),
            "rod3": bar(H=[0, 0], R=[0.8944, 0]),
            "plate": bar(P=[0, 0], Q=[0.6, 0], R=[0.25, 0.5]),
        },
        joints={
            "A": revolute("ground", "crank"),
            "B": revolute("crank", "rod1"),
            "P": revolute("rod1", "plate"),
            "Q": revolute("plate", "rod2"),
            "R": revolute("rod3", "plate"),
            "G": revolute("ground", "rod2"),
            "H": revolute("rod3", "ground"),
        },
        drivers={"A": {"speed": 5.0}},
        loads={"push": {"link": "plate", "at": "R", "force": [7.0, -20.0]}},
        assembly={"P": [0.7, 0.6], "Q": [1.3, 0.6], "R": [0.95, 1.1]},
    )


def four_bar() -> Mechanism:
    return Mechanism.read(Path(__file__).parents[1] / "examples" / "durango-fourbar.yaml")


LINKAGES: Mapping[str, Linkage] = {
    "four-bar, RRR": Linkage(four_bar, 1),
    "slider-crank, RRP": Linkage(slider_crank, 1),
    "Watt six-bar, 2 RRR": Linkage(watt, 2),
    "quick return, RPR + RRP": Linkage(quick_return, 2),
    "Jansen's leg, 3 RRR": Linkage(jansen, 3),
    "class III linkage": Linkage(class_three, 1, 3),
}

"""Mechanisms with joints in play, shared by tests and benchmarks."""

from __future__ import annotations

from typing import Any

from trunnion.model.mechanism import Mechanism

SPEED = 523.5987755983  # rad/s, 5000 rpm
STEEL = {"modulus": "207 GPa", "poisson_ratio": 0.3}
LANKARANI = {"law": "lankarani-nikravesh", "restitution": 0.9, **STEEL}


def rattling(contact: dict[str, Any] | None = None, pin: dict[str, Any] | None = None, **more: Any) -> Mechanism:
    """A slider-crank at constant speed whose gudgeon pin, 19 mm, lies in a hole of 20 mm; without gravity."""
    axis = {"at": [0, 0], "axis": [1, 0]}
    data: dict[str, Any] = {
        "links": {
            "frame": {"points": {"O": [0, 0], "S": axis}},
            "crank": {"points": {"O": [0, 0], "P": [0.05, 0]}},
            "rod": {"points": {"P": [0, 0], "Q": [0.12, 0]}, "mass": 0.21, "inertia": 2.5e-4, "centre": [0.06, 0]},
            "slider": {"points": {"Q": [0, 0], "S": axis}, "mass": 0.14},
        },
        "ground": "frame",
        "joints": {
            "O": {"type": "revolute", "links": ["frame", "crank"]},
            "P": {"type": "revolute", "links": ["crank", "rod"]},
            "Q": {
                "type": "revolute",
                "links": ["rod", "slider"],
                "pin": pin or {"radius": "9.5 mm", "hole_radius": "10 mm"},
                **({} if contact == {} else {"contact": contact or LANKARANI}),
            },
            "S": {"type": "prismatic", "links": ["frame", "slider"]},
        },
        "drivers": {"O": {"speed": SPEED}},
        "assembly": {"Q": [0.17, 0]},
    }
    return Mechanism(**{**data, **more})


def both_pins(mass: float = 0.21) -> Mechanism:
    """The same with the crank pin in play as well: no joint holds the rod any more."""
    one = rattling().data()
    joints = {**one["joints"], "P": {**one["joints"]["Q"], "links": ["crank", "rod"]}}
    rod = {**one["links"]["rod"], "mass": mass, "inertia": 2.5e-4 * mass / 0.21}
    return rattling(joints=joints, links={**one["links"], "rod": rod})


def loose_slider(stiffness: str = "5 MN/m", **contact: Any) -> Mechanism:
    """The same with a slider in play in its guide, under gravity and at 30 rad/s."""
    one = rattling({}).data()
    guide = {"length": 0.1, "height": 0.05, "clearance": 1e-3}
    slider = {**one["joints"]["S"], "guide": guide,
              "contact": {"restitution": 0.4, "stiffness": stiffness, "exponent": 1, **contact}}  # fmt: skip
    links = {**one["links"], "slider": {**one["links"]["slider"], "inertia": 2e-4}}
    joints = {**one["joints"], "S": slider}
    return rattling({}, joints=joints, links=links, gravity=[0, -9.81], drivers={"O": {"speed": 30}})

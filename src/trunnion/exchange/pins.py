"""Planar linkages as programs for them hold them: pins at which bars meet, some of them on a slot."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from trunnion.errors import Finding, MechanismError
from trunnion.exchange.draft import Array, Body, Draft, Pair, free_name

__all__ = ["GROUND", "PlanarPin", "few", "meet", "space"]

GROUND = "ground"
MOST = 2000  # pins and bars of a linkage


def few(count: int, file: str) -> None:
    """MechanismError if a file has more pins and bars than a linkage can have."""
    if count > MOST:
        what = f"has {count:,} joints and links; at most {MOST:,} are read"
        raise MechanismError(Finding(what, file=file, remedy="export the linkage alone"))


@dataclass
class PlanarPin:
    """A place where bodies of a plane meet.

    Parameters
    ----------
    name : later of the joint.
    at : its place, m, (x, y).
    bodies : that turn about it.
    carrier, direction : the body along a line of which it slides, and the direction of the line; it only turns without.
    welded : whether its bodies slide without turning.
    mass : of the block that slides, kg.
    drive : rate of its turn or slide, rad/s or m/s; 0 if it is driven at a rate that is not stated.
    """

    name: str
    at: Sequence[float]
    bodies: list[str] = field(default_factory=list)
    carrier: str = ""
    direction: Sequence[float] = (1.0, 0.0)
    welded: bool = False
    mass: float = 0.0
    drive: float | None = None


def space(place: Sequence[float]) -> Array:
    """A place of the plane in space."""
    return np.array([place[0], place[1], 0.0])


def meet(draft: Draft, pins: Sequence[PlanarPin]) -> None:
    """Add the pairs of pins to a draft that has their bodies.

    A pin of n bodies becomes n − 1 revolute pairs, with the ground first; that of a single body a point of it. On a
    slot slides a block, about which the bodies turn, or to which they are fixed.
    """
    for pin in pins:
        bodies = sorted(dict.fromkeys(pin.bodies), key=lambda name: name != GROUND)
        driven = ""
        if pin.carrier and bodies:
            block = free_name(f"{pin.name} block", draft.bodies)
            comments = [f"the block that slides at {pin.name}"]
            draft.bodies[block] = Body(block, pin.mass, space(pin.at), comments=comments)
            driven = _pair(draft, pin, "prismatic", pin.carrier, block)
            pairs = [(body, block) for body in bodies]
        elif len(bodies) == 1:
            points = draft.bodies[bodies[0]].points
            points[free_name(pin.name, points)] = space(pin.at)
            pairs = []
        else:
            pairs = [(bodies[0], other) for other in bodies[1:]]
        for pair in pairs:
            name = _pair(draft, pin, "fixed" if pin.carrier and pin.welded else "revolute", *pair)
            driven = driven or name
        if pin.drive is not None and driven:
            draft.drives[driven] = pin.drive


def _pair(draft: Draft, pin: PlanarPin, kind: str, first: str, second: str) -> str:
    """Add one pair of a pin; its name."""
    name = free_name(f"{pin.name} slide" if kind == "prismatic" else pin.name, draft.pairs)
    axis = space(pin.direction) if kind == "prismatic" else np.array([0.0, 0.0, 1.0])
    draft.pairs[name] = Pair(name, kind, (first, second), space(pin.at), axis)
    return name

"""What measures of the forces, and those of points that have several numbers, are made of: their courses."""

from __future__ import annotations

import functools
import operator
from typing import Any

import numpy as np

from trunnion.algebra.dual import Dual, primal
from trunnion.algebra.namespace import Number, namespace
from trunnion.solve.backward import Backward
from trunnion.solve.forward import Forward
from trunnion.solve.friction_method import MARGIN
from trunnion.solve.loads import useful_loads

__all__ = ["efficiency", "effort", "joint_rate", "load", "locking_margin", "place", "reaction"]


def place(subject: str, walk: Forward) -> tuple[Number, ...]:
    """Coordinates of a point, m: two in the plane, three in space."""
    link, point = subject.split(".")
    return tuple(walk.point(link, point).place)


def effort(subject: str, back: Backward) -> tuple[Number, ...]:
    """Torque or force of a driver, N m or N."""
    return (back.efforts[subject],)


def joint_rate(joint: str, back: Backward, turns: bool) -> Number:
    """Speed of the second link against the first, rad/s about the joint's axis or m/s along it."""
    return back.walk.rates(joint)[0 if turns else 1]


def load(subject: str, back: Backward) -> tuple[Number, ...]:
    """Torque or force of a load on a joint against the joint's positive sense, N m or N; NaN where the joint rests.

    Times the speed of the joint it is the power that the load takes.
    """
    stated = back.walk.system.mechanism.loads[subject]
    rate = joint_rate(stated.joint or "", back, stated.resisting_torque is not None)
    moving = primal(rate) != 0
    xp = namespace(rate)
    return (-back.load_powers[subject] / xp.where(moving, rate, np.nan),)


def reaction(subject: str, axis: str, back: Backward) -> tuple[Number, ...]:
    """Force in a joint without friction and drive effort, N: one component in global axes, or its magnitude.

    Its magnitude has no derivative where it is 0.
    """
    found: Any = back.reactions[subject]
    force = (found.x, found.y) if hasattr(found, "x") else found.u
    if axis:
        return (force["xyz".index(axis)],)
    square: Number = 0.0
    for part in force:
        square = square + part * part
    return (namespace(square).sqrt(square),)


def efficiency(subject: str, back: Backward) -> tuple[Number, ...]:
    """Useful and drive power, W; of an instant their ratio, NaN where the drivers put no power in."""
    walk = back.walk
    useful: Number = 0.0
    driven: Number = 0.0
    for name in useful_loads(walk.system.mechanism):
        useful = useful - back.load_powers[name]
    for name in walk.system.mechanism.drivers:
        driven = driven + back.efforts[name] * walk.rate(name)
    if subject == "cycle":
        return useful, driven
    xp = namespace(driven)
    return (useful / xp.where(driven > 0, driven, np.nan),)


def locking_margin(back: Backward) -> tuple[Number, ...]:
    """Multiple of the friction at which a module locks, MARGIN where it does not up to there.

    The search for it has no derivatives: they are NaN where dual numbers ask for some below MARGIN.
    """
    margin: Number = functools.reduce(np.minimum, (one.margin for one in back.settled), MARGIN)
    forces: Number = functools.reduce(operator.add, (*back.friction.values(), *back.efforts.values()), 0.0)
    if isinstance(forces, Dual):
        return (Dual(margin, np.where(margin < MARGIN, np.nan, 0.0)),)
    return (margin,)

"""How well a dyad passes force on: its pressure angle and its transmission angle."""

from __future__ import annotations

from typing import Any

import numpy as np

from trunnion.algebra.namespace import Number, namespace
from trunnion.errors import Finding, MechanismError
from trunnion.groups.dyad import DyadPose
from trunnion.solve.forward import Forward

__all__ = ["of_joint", "pressure_angle", "pressure_angles"]


def pressure_angle(pose: Any) -> Number | None:
    """Pressure angle φ of a dyad from its pose, rad in −π/2 … π/2; None of any other group.

    The angle between the force that the first link puts on the second, had the first neither friction nor loads,
    and the velocity of the point of the second that it acts on, against the link that holds the second. But for RPP
    it is the same the other way round. cos φ is 2 over the condition number of the dyad. With its joints B, C, D:

    RRR   force along BC, velocity of C across DC: sin φ = cos(BC, DC), positive where the angle at C is acute
    RRP   force along BC, velocity along the guide u: sin φ = p/|BC|, C being p to the left of the line along u by B
    RPR   force across the slide, through B, velocity across BD: sin φ = e/|BD|, D being e to the left of that line
    PRP, RPP   force across the one guide u, velocity along the other v: sin φ = cos(u, v)

    Source: R. L. Norton, Design of Machinery, "Transmission angle" (π/2 less |φ|) and "Pressure angle".
    """
    if not isinstance(pose, DyadPose):
        return None
    moves = 1 / pose.area
    xp = namespace(pose.lost, moves)
    return xp.arctan2(pose.lost, xp.abs(moves))


def pressure_angles(walk: Forward) -> dict[str, Number]:
    """Pressure angle of every dyad along a walk in the plane, by its joints' names."""
    return {"-".join(joints): angle for joints, angle in _angles(walk).items()}


def of_joint(walk: Forward, joint: str) -> Number:
    """Pressure angle of the dyad that a joint is of; MechanismError if it is of none."""
    angles = {name: angle for joints, angle in _angles(walk).items() for name in joints}
    if joint not in angles:
        what = f"'{joint}' is no joint of a dyad, which alone has a transmission angle"
        those = f"those of a dyad are {', '.join(angles)}" if angles else "this mechanism has no dyad"
        raise MechanismError(Finding(what, f"joints.{joint}", those))
    return angles[joint]


@np.errstate(all="ignore")
def _angles(walk: Forward) -> dict[tuple[str, ...], Number]:
    angles = {
        tuple(module.joints): pressure_angle(pose)
        for module, pose in zip(walk.system.plan.modules, walk.poses, strict=True)
    }
    return {joints: angle for joints, angle in angles.items() if angle is not None}

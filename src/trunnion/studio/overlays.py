"""What the sheet can show over a mechanism in the plane: instant centres, transmission angles, pins in their holes."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from trunnion.algebra import plane
from trunnion.solve.forward import Forward
from trunnion.studies.design import instant_centre, transmission_angles
from trunnion.studio.message import Exact
from trunnion.studio.placed import column
from trunnion.views.cycle.deviations import seated

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["centres", "seats", "transmission"]

Array = NDArray[np.float64]

MOST_LINKS = 12  # whose centres against each other are told; of more only those against the ground
FAR = 1e4  # sizes of the mechanism: what is farther away lies at infinity
AT_REST = 1e-9  # of the speeds typical of the mechanism: slower than this two links move as one


@np.errstate(all="ignore")
def centres(walk: Forward, steps: int) -> list[dict[str, Any]]:
    """Instant centre of each pair of links: place x, y, m, where they have the same velocity.

    Where it lies at infinity, for the two turn alike, x, y are NaN and `far` is the unit vector towards it; where they
    move as one there is neither. `joint`: the revolute that holds the two, in which the centre stays; `ground`: whether
    one of them is it. Of many links only the centres against the ground. Source: R. L. Norton, Design of Machinery,
    "Instant centers of velocity".
    """
    mechanism = walk.system.mechanism
    ground, links = mechanism.fixed_link, list(mechanism.links)
    links.sort(key=lambda link: link != ground)
    pairs = [(a, b) for i, a in enumerate(links) for b in links[i + 1 :] if a == ground or len(links) <= MOST_LINKS]
    held = {frozenset(ends): name for name, (kind, ends) in walk.system.joints.items() if kind == "revolute"}
    return [
        {"pair": [a, b], "ground": a == ground, "joint": held.get(frozenset((a, b))), **_centre(walk, a, b, steps)}
        for a, b in pairs
    ]


def _centre(walk: Forward, first: str, second: str, steps: int) -> dict[str, Any]:
    one, two = walk.motions[first], walk.motions[second]
    x, y = (column(part, steps) for part in instant_centre(walk, first, second))
    # velocity of the second against the first at the second's origin; the centre lies across it
    vx, vy = (column(part, steps) for part in plane.velocity_at(plane.minus(two.twist, one.twist), two.frame[:2]))
    size, pace = column(walk.size, steps), column(walk.pace, steps)
    turn = np.abs(column(two.twist.w - one.twist.w, steps))
    speed = np.hypot(vx, vy)
    still = (turn <= AT_REST * pace) & (speed <= AT_REST * pace * size)
    away = ~(np.hypot(x, y) <= FAR * size) & (speed > AT_REST * pace * size)
    sign = np.where(two.twist.w - one.twist.w < 0, -1.0, 1.0)
    place = {"x": np.where(away | still, np.nan, x), "y": np.where(away | still, np.nan, y)}
    if not np.any(away):
        return {**place, "far": None}
    far = {"x": np.where(away, -sign * vy / speed, np.nan), "y": np.where(away, sign * vx / speed, np.nan)}
    return {**place, "far": far}


def seats(result: xr.Dataset) -> list[dict[str, Any]]:
    """Of each joint with a seat, at each end: offset of the pin from the middle of its hole, m, and force of the pin on
    the hole, N, both in the hole's axes.
    """
    return [
        {
            "joint": one.joint, "kind": one.kind, "clearance": one.clearance, "length": one.length,
            "ends": [{what: {axis: Exact(row) for axis, row in zip("xy", rows, strict=True)}
                      for what, rows in (("offset", offset), ("force", force))}
                     for offset, force in zip(one.offsets, one.forces, strict=True)],
        }
        for one in seated(result)
    ]  # fmt: skip


@np.errstate(all="ignore")
def transmission(walk: Forward, steps: int) -> list[dict[str, Any]]:
    """Transmission angle of each dyad, rad, 0 … π/2, and its middle joint."""
    middle = {"-".join(module.joints): module.joints[1:2] for module in walk.system.plan.modules}
    angles = transmission_angles(walk)
    return [{"name": name, "joint": joint, "angle": column(angle, steps)}
            for name, angle in angles.items() for joint in middle[name]]  # fmt: skip

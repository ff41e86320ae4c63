"""What the sheet can show over a mechanism in the plane: instant centres, transmission angles, pins in their holes."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from trunnion.solve.forward import Forward
from trunnion.studies.design import instant_centres, transmission_angles
from trunnion.studio.message import Exact
from trunnion.studio.placed import column
from trunnion.views.cycle.deviations import seated

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["centres", "seats", "transmission"]

MOST_LINKS = 12  # whose centres against each other are told; of more only those against the ground


def centres(walk: Forward, steps: int) -> list[dict[str, Any]]:
    """Instant centres of the pairs of links; `ground`: whether one of them is it."""
    ground = walk.system.mechanism.fixed_link
    return [
        {**vars(one), "ground": ground in one.pair, "far": one.far and dict(zip("xy", one.far, strict=True))}
        for one in instant_centres(walk, steps, MOST_LINKS)
    ]


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

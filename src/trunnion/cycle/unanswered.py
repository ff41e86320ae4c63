"""NaN where there is no answer: which numbers of a position each status rules out."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from trunnion.errors import Status
from trunnion.results import variables as results

__all__ = ["blank"]

Arrays = dict[str, NDArray[np.float64]]

FORCES = [
    *("reaction_force", "reaction_moment", "friction_torque", "friction_force", "friction_moment", "friction_power"),
    *("drive_effort", "drive_power", "power_residual", "friction_change"),
    *("friction_residual", "friction_contraction"),
    *("spring_force", "spring_power", "damping_power", "gear_torque", "gear_force"),
    *("reaction_force_change", "drive_effort_change", "friction_power_change"),
    # where the load is not known, neither is the seat
    *("seat_offset", "seat_beta", "seat_xi", "seat_xi_pin", "end_force", "contact_position"),
    *("point_error", "link_error", "joint_rotation_error", "joint_slide_error"),
]
POSES = [
    *("point_position", "link_angle", "link_position", "link_rotation", "joint_rotation", "joint_slide"),
    *("spring_elongation", "closure_residual", "condition"),
]
RATES = [name for name in results.VARIABLES if name.endswith(("velocity", "acceleration"))]


def blank(arrays: Arrays, status: NDArray[np.int8], window: slice) -> None:
    """NaN for every number that a status rules out."""
    if not np.any(status >= Status.NOT_CONVERGED):
        return
    for names, where in (
        (FORCES, status >= Status.NOT_CONVERGED),
        (RATES, status >= Status.SINGULAR),
        (["locking_margin"], status >= Status.LOAD_UNDEFINED),
        (["useful_power", "efficiency_instant"], status >= Status.NOT_CONVERGED),
    ):
        for name in names:
            if name in arrays and arrays[name].flags.writeable:
                arrays[name][..., window][..., where] = np.nan
    # a driver's own link is known where the rest is not; a whole position is either assembled or not
    for name in POSES:
        if name in arrays and arrays[name].flags.writeable:
            arrays[name][..., window][..., status == Status.NOT_ASSEMBLED] = np.nan

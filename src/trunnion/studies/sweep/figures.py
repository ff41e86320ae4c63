"""The figures of a cycle: what its positions come to, and the reduction that every point of a sweep goes through."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from trunnion.cycle.means import Means
from trunnion.cycle.summary import sound_positions
from trunnion.errors import Status
from trunnion.joints.pairs import PAIRS
from trunnion.results.dataset import Variable
from trunnion.solve.system import System

__all__ = ["FIGURES", "Reduced", "reduced"]

Arrays = Mapping[str, NDArray[Any]]


# dims before the swept names; part: "errors" of those that only mechanisms with errors have, "margin" of the one that
# is looked for only if asked
FIGURES: dict[str, Variable] = {
    "efficiency": Variable((), "1", "useful work over drive work of the cycle"),
    "efficiency_error": Variable(
        (), "1", "how far the errors of its integrals and pins that do not settle may have moved it"
    ),
    "efficiency_ideal": Variable((), "1", "efficiency of the mechanism without errors", part="errors"),
    "drive_effort_min": Variable(("driver",), "effort", "minimum drive effort"),
    "drive_effort_max": Variable(("driver",), "effort", "maximum drive effort"),
    "drive_effort_rms": Variable(("driver",), "effort", "root mean square of the drive effort"),
    "drive_power_mean": Variable((), "W", "mean power of all drivers"),
    "useful_power_mean": Variable((), "W", "mean power delivered to the useful loads"),
    "friction_power_mean": Variable((), "W", "mean power lost to friction"),
    "reaction_max": Variable(("joint",), "N", "maximum reaction"),
    "transmission_error_max": Variable(
        ("joint",),
        "transmission_error",
        "largest error of the joint's rotation, of a prismatic joint its slide",
        part="errors",
    ),
    "locking_margin": Variable(
        (), "1", "least multiple of the friction at which a position locks, ∞ if beyond 10", part="margin"
    ),
    "without_answer": Variable((), "1", "positions not solved", np.int32),
    "not_valid": Variable(
        (), "1", "positions at which a pin loses contact, left out of the figures", np.int32, part="errors"
    ),
    "status": Variable((), "1", "code of the gravest status of a position; see the attribute flag_meanings", np.int8),
}
Reduced = dict[str, Any]


def reduced(arrays: Arrays, means: Means, ideal: Means | None, system: System, sides: Arrays | None = None) -> Reduced:
    """The figures of FIGURES of one cycle; numbers, or rows over drivers or joints.

    arrays: over positions, by the names of `results.VARIABLES`: status, drive_effort, reaction_force, and
    locking_margin if it was looked for; means: over the cycle; ideal: those of the mechanism without errors, None if it
    has none, else arrays also have joint_rotation_error and joint_slide_error. sides: effort, reaction and status on
    both sides of jumps, which count in their extremes.
    """
    status = arrays["status"]
    missing = int(np.count_nonzero(status >= Status.NOT_CONVERGED))
    told: Reduced = {"status": int(np.max(status)), "without_answer": missing}
    told["not_valid"] = int(np.count_nonzero(status == Status.CONTACT_LOST))
    if "locking_margin" in arrays:
        valid = status != Status.CONTACT_LOST
        told["locking_margin"] = float(np.min(arrays["locking_margin"][valid], initial=np.inf))
    if ideal:
        told["efficiency_ideal"] = ideal.efficiency
    if missing:
        return told
    sound = sound_positions(status)
    kept = sound if len(sound) else np.flatnonzero(status < Status.CONTACT_LOST)
    if not len(kept):  # contact is lost everywhere
        return told
    effort, force = arrays["drive_effort"][:, kept], arrays["reaction_force"][..., kept]
    if sides is not None:
        solved = sides["status"] == Status.SOLVED
        effort = np.concatenate([effort, sides["drive_effort"][:, solved]], axis=-1)
        force = np.concatenate([force, sides["reaction_force"][..., solved]], axis=-1)
    size = np.sqrt(np.sum(force**2, axis=1))
    if ideal:
        turned, slid = (np.abs(arrays[f"joint_{what}_error"][:, kept]) for what in ("rotation", "slide"))
        slides = np.array([PAIRS[kind].guided for kind, _ in system.joints.values()])
        told["transmission_error_max"] = np.where(slides, np.max(slid, axis=1), np.max(turned, axis=1))
    else:  # beside points with errors
        told |= {"efficiency_ideal": means.efficiency, "transmission_error_max": 0.0}
    return told | {
        "efficiency": means.efficiency,
        "efficiency_error": means.efficiency_error,
        "drive_effort_min": np.min(effort, axis=1),
        "drive_effort_max": np.max(effort, axis=1),
        "drive_effort_rms": means.drive_effort_rms,
        "drive_power_mean": means.drive_power_mean,
        "useful_power_mean": means.useful_power_mean,
        "friction_power_mean": means.friction_power.net,
        "reaction_max": np.max(size, axis=1),
    }

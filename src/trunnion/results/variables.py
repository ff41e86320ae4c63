"""What the result of a cycle consists of.

`VARIABLES` is the whole vocabulary. Dims, before `position`: joint, link, point ("link.point"), axis (x, y, in space
z), component (of a quaternion: w, x, y, z), driver, spring, bearing_end (only of a mechanism that has any).
"""

from __future__ import annotations

import functools
from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from trunnion.results.dataset import MemberUnits, Variable, dataset_of, described

if TYPE_CHECKING:
    import xarray as xr


def _coordinate(
    name: str, dim: str, unit: str, long_name: str, column: str, space: str = "", usual: int = 3
) -> dict[str, Variable]:
    """A coordinate with its first and second derivative by time; usual: how many of them every table has."""
    parts = {"": ("", long_name), "_velocity": ("/s", f"rate of the {long_name}"),
             "_acceleration": ("/s^2", f"second derivative of the {long_name}")}  # fmt: skip
    return {
        f"{name}{rate}": Variable(
            (dim,), f"{unit}{per}", text, space=space, column=f"{column}{rate}",
            tables="usual motion" if k < usual else "motion",
        )
        for k, (rate, (per, text)) in enumerate(parts.items())
    }  # fmt: skip


_motion = functools.partial(Variable, tables="usual motion")  # a vector of the motion
_rest = functools.partial(Variable, column="", tables="rest")  # what only the table of everything has
_seat = functools.partial(Variable, part="seats")  # what only mechanisms whose pins have seats have
_error = functools.partial(Variable, part="errors")  # what only mechanisms with errors have

J, D, S, NOTHING = ("joint",), ("driver",), ("spring",), ()
JA, LA, PA, JE = ("joint", "axis"), ("link", "axis"), ("point", "axis"), ("joint", "end", "axis")
# in the order in which the columns of a joint, a link, … stand in a table
VARIABLES: dict[str, Variable] = {
    **_coordinate("joint_rotation", "joint", "rad", "rotation of the joint, second link against first", "rotation",
                  usual=2),
    **_coordinate("joint_slide", "joint", "m", "slide of the joint, second link against first", "slide", usual=2),
    **_coordinate("link_angle", "link", "rad", "angle of the link's x axis", "angle", "planar"),
    "link_position": _motion(LA, "m", "place of the link's origin", space="spatial", column=""),
    "link_rotation": _motion(
        ("link", "component"), "1", "unit quaternion of the link's axes", space="spatial", column="rotation"),
    "link_angular_velocity": _motion(
        LA, "rad/s", "angular velocity of the link", space="spatial", column="angular_velocity"),
    "link_angular_acceleration": _motion(
        LA, "rad/s^2", "angular acceleration of the link", space="spatial", column="angular_acceleration"),
    "point_position": _motion(PA, "m", "place of the point", column=""),
    "point_velocity": Variable(PA, "m/s", "velocity of the point", column="velocity", tables="motion"),
    "point_acceleration": Variable(PA, "m/s^2", "acceleration of the point", column="acceleration", tables="motion"),
    "reaction_force": Variable(JA, "N", "reaction on the second link by the first", column="reaction"),
    "reaction_moment": Variable(
        J, "N m", "reaction moment on the second link, about the joint's point", column="reaction_moment"),
    "end_load": Variable(
        ("joint", "bearing_end", "axis"), "N",
        "load on each end of the bearing or guide, global axes; of a cross 3 and 4 on the pin of the second link",
        part="bearings", column="end_load"),
    "pin_pressure": Variable(
        J, "Pa", "load over projected area of the pin, F/(d b), in space of the end that bears more", part="bearings",
        column="pin_pressure"),
    "friction_torque": Variable(
        J, "N m", "friction torque on the second link by the first", column="friction_torque"),
    "friction_force": Variable(
        J, "N", "friction force along the slide on the second link by the first", column="friction_force"),
    "friction_moment": Variable(
        JA, "N m", "friction moment on the second link, about the middle of the bearing", space="spatial"),
    "friction_power": Variable(J, "W", "power lost to friction", column="friction_power"),
    "drive_effort": Variable(D, "effort", "drive effort on the second link by the first", column="effort"),
    "drive_effort_lower": Variable(
        D, "effort", "least drive effort where a friction is an interval", column="effort_lower"),
    "drive_effort_upper": Variable(
        D, "effort", "largest drive effort where a friction is an interval", column="effort_upper"),
    "drive_power": _rest(D, "W", "power of the driver", column="power"),
    "spring_force": Variable(
        S, "spring_force", "pull of the spring and its damper; a torque in a joint that turns", column="force"),
    "spring_elongation": Variable(
        S, "spring_elongation", "length beyond the free length; an angle in a joint that turns", column="elongation"),
    "spring_power": Variable(
        S, "W", "power of the spring and its damper, positive into the mechanism", column="spring_power"),
    "damping_power": Variable(S, "W", "power lost in the spring's damper", column="damping_power"),
    "gear_torque": Variable(
        ("gear",), "N m",
        "torque of the gear pair in its second joint, on its second link; of a rack or screw in what turns",
        column="torque"),
    "gear_force": Variable(
        ("gear", "axis"), "N", "tooth force on the gear of the second joint by that of the first; on the rack or nut",
        column="force"),
    "useful_power": Variable(NOTHING, "W", "power delivered to the useful loads"),
    "efficiency_instant": _rest(NOTHING, "1", "useful power over drive power"),
    "closure_residual": _rest(NOTHING, "m", "largest opening of a closed loop"),
    "condition": _rest(NOTHING, "1", "largest condition number of a module's Jacobian"),
    "power_residual": _rest(NOTHING, "W", "drive + loads + inertia − friction power; 0 but for rounding"),
    "friction_iterations": _rest(NOTHING, "1", "rounds to settle friction and reactions", np.int32),
    "friction_change": _rest(NOTHING, "N", "largest change of a reaction in the last round"),
    "friction_residual": _rest(
        NOTHING, "N", "largest difference between a friction and its law for the load found"),
    "friction_contraction": _rest(
        NOTHING, "1", "contraction of the friction iteration; from 1 on it may diverge"),
    "locking_margin": _rest(NOTHING, "1", "multiple of the friction at which the position locks, ∞ if beyond 10"),
    "status": Variable(NOTHING, "1", "code of the position's status; see the attribute flag_meanings", np.int8),
    "point_error": _error(PA, "m", "place of the point against the ideal mechanism", column="error"),
    "link_error": _rest(
        ("link",), "rad", "angle of the link against the ideal mechanism", part="errors", column="angle_error"),
    "joint_rotation_error": _error(
        J, "rad", "rotation of the joint against the ideal mechanism", column="rotation_error"),
    "joint_slide_error": _error(J, "m", "slide of the joint against the ideal mechanism", column="slide_error"),
    "reaction_force_change": _error(JA, "N", "reaction less that of the ideal mechanism", column="reaction_change"),
    "drive_effort_change": _error(D, "effort", "drive effort less that of the ideal mechanism", column="effort_change"),
    "friction_power_change": _rest(
        J, "W", "power lost to friction less that of the ideal mechanism", part="errors",
        column="friction_power_change"),
    "seat_offset": _seat(JE, "m", "offset of the pin's axis from the hole's at each end, hole's axes", column="seat"),
    "end_force": _seat(JE, "N", "force of the pin on each end of its hole, hole's axes", column="end_force"),
    "contact_position": _seat(JE, "m", "place where the pin touches its hole at each end", column="contact"),
    "seat_beta": _seat(J, "rad", "angle β between the seats of a pin's ends", column="seat_beta"),
    "seat_xi": _seat(J, "rad", "direction ξ of a pin's seat in its hole", column="seat_xi"),
    "seat_xi_pin": _seat(J, "rad", "direction ξ of a pin's seat in the pin's own frame", column="seat_xi_pin"),
    "contact_lost": _seat(J, "1", "1 where the pin loses contact", np.int8, column="contact_lost"),
    "contact_loss_number": _rest(
        J, "rad/(N s)", "rate of turn of the reaction over its size (Earles and Wu)", part="seats",
        column="contact_loss_number"),
    "seat_travel": _rest(
        NOTHING, "1", "1 where velocities and accelerations include the motion of pins within their play", np.int8,
        "seats"),
    "seat_rounds": _seat(NOTHING, "1", "iterations of seats and reactions", dtype=np.int32),
    "seat_change": _rest(
        NOTHING, "1", "change of a seat in one more iteration, relative to its clearance", part="seats"),
}  # fmt: skip
# what is a vector in space
IN_SPACE: dict[str, Variable] = {
    "reaction_moment": Variable(JA, "N m", "reaction moment on the second link, about the middle of the bearing"),
    "friction_torque": Variable(J, "N m", "friction torque on the second link about its axis, or against its turn"),
    "link_error": _rest(
        LA, "rad", "rotation vector of the link against the ideal mechanism", part="errors", column="error"
    ),
}
# what `locking` adds
LOCKING: dict[str, Variable] = {
    "critical_multiple": _rest(
        J, "1", "critical multiple of the friction of the joint alone, at which the position locks",
        column="critical_multiple"),
    "drive_effort_reverse": _rest(
        D, "effort", "drive effort of the reversed motion; NaN where it locks", column="effort_reverse"),
    "efficiency_reverse_instant": _rest(
        NOTHING, "1", "power delivered to the drivers over power supplied by the useful loads, backward"),
    "power_delivered_reverse": _rest(NOTHING, "W", "power delivered to the drivers when backdriven"),
    "power_acting_reverse": _rest(
        NOTHING, "W", "power supplied by loads, springs, weight and inertia when backdriven"),
    "power_given_reverse": _rest(NOTHING, "W", "power supplied by the useful loads when backdriven"),
    "holding_multiple": _rest(
        NOTHING, "1", "multiple of all friction down to which it holds the loads; NaN where it does not"),
    "locking_state": Variable(NOTHING, "1", "what friction does forward and backward", np.int8),
}  # fmt: skip
OF_SOME_JOINTS = ("seats", "bearings")  # parts whose numbers not every joint has
# the same array until something sets them apart
SAME_AS = {"drive_effort_lower": "drive_effort", "drive_effort_upper": "drive_effort"}

# of the cycle as a whole, beside VARIABLES
CYCLE: dict[str, Variable] = {
    "efficiency": Variable((), "1", "useful work over drive work of the cycle"),
    "efficiency_error": Variable(
        (), "1", "how far the errors of the integrals and pins that do not settle may have moved it"
    ),
    "drive_effort_rms": Variable(("driver",), "effort", "root mean square of the drive effort"),
    "drive_power_mean": Variable((), "W", "mean power of all drivers"),
    "useful_power_mean": Variable((), "W", "mean power delivered to the useful loads"),
    "friction_power_mean": Variable(("joint",), "W", "mean power lost to friction"),
}
IDEAL = {
    f"{name}_ideal": replace(CYCLE[name], long_name=f"{CYCLE[name].long_name}, of the mechanism without errors")
    for name in ("efficiency", "friction_power_mean")
}


Labels = Mapping[str, Sequence[str]]


def variables(space: str) -> dict[str, Variable]:
    """The vocabulary of the results of planar or of spatial mechanisms."""
    both = {name: variable for name, variable in VARIABLES.items() if variable.space in ("", space)}
    return {**both, **IN_SPACE} if space == "spatial" else both


def along_positions(of: Mapping[str, Variable]) -> dict[str, Variable]:
    """The same at every position of a cycle."""
    return {name: variable.over("position") for name, variable in of.items()}


@functools.cache
def _vocabulary(space: str) -> dict[str, Variable]:
    return along_positions(variables(space))


def dataset(
    arrays: dict[str, NDArray[np.float64]],
    labels: Labels,
    along: Mapping[str, xr.Variable],
    means: object,
    attributes: Mapping[str, Any],
    units: Mapping[str, MemberUnits],
    ideal: object = None,
    names_kept: Collection[str] | None = None,
    dtype: str = "float64",
    more: Mapping[str, xr.Variable] | None = None,
) -> xr.Dataset:
    """The result of a cycle.

    along: the coordinates of its positions, see `results.dataset.driven`; means, ideal: what has the names of CYCLE as
    attributes, of the mechanism and of that without errors; units: those of drivers and springs; names_kept: those of
    its variables at every position that it has, all if not given; dtype: of their floats. Where that is another than
    theirs, arrays are taken out of their dict one by one, so that both need not be in memory. more: what it has beside.
    """
    vocabulary = _vocabulary("spatial" if "component" in labels else "planar")
    names = [name for name in arrays if names_kept is None or name in names_kept]
    other = {name for name in names if arrays[name].dtype == np.float64 and dtype != "float64"}
    numbers = {name: arrays.pop(name).astype(dtype) if name in other else arrays[name] for name in names}
    numbers |= {name: numbers[name].copy() for name in SAME_AS.keys() & numbers.keys()}  # each may be written to
    described_arrays = described(numbers, vocabulary, units)
    described_arrays |= described({name: getattr(means, name) for name in CYCLE}, CYCLE, units)
    if ideal is not None:
        described_arrays |= described({name: getattr(ideal, name.removesuffix("_ideal")) for name in IDEAL}, IDEAL)
    return dataset_of("cycle", {**described_arrays, **(more or {})}, labels, attributes, along)

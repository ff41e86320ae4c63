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

__all__ = ["CYCLE", "OF_SOME_JOINTS", "VARIABLES", "allocate", "dataset", "variables"]


def _rates(name: str, dims: tuple[str, ...], unit: str, long_name: str, space: str = "") -> dict[str, Variable]:
    """A quantity with its first and second derivative by time."""
    return {
        name: Variable(dims, unit, long_name, space=space),
        f"{name}_velocity": Variable(dims, f"{unit}/s", f"rate of the {long_name}", space=space),
        f"{name}_acceleration": Variable(dims, f"{unit}/s^2", f"second derivative of the {long_name}", space=space),
    }


VARIABLES: dict[str, Variable] = {
    **_rates("joint_rotation", ("joint",), "rad", "rotation of the joint, second link against first"),
    **_rates("joint_slide", ("joint",), "m", "slide of the joint, second link against first"),
    **_rates("link_angle", ("link",), "rad", "angle of the link's x axis", "planar"),
    "link_position": Variable(("link", "axis"), "m", "place of the link's origin", space="spatial"),
    "link_rotation": Variable(("link", "component"), "1", "unit quaternion of the link's axes", space="spatial"),
    "link_angular_velocity": Variable(("link", "axis"), "rad/s", "angular velocity of the link", space="spatial"),
    "link_angular_acceleration": Variable(
        ("link", "axis"), "rad/s^2", "angular acceleration of the link", space="spatial"
    ),
    "point_position": Variable(("point", "axis"), "m", "place of the point"),
    "point_velocity": Variable(("point", "axis"), "m/s", "velocity of the point"),
    "point_acceleration": Variable(("point", "axis"), "m/s^2", "acceleration of the point"),
    "reaction_force": Variable(("joint", "axis"), "N", "reaction on the second link by the first"),
    "reaction_moment": Variable(("joint",), "N m", "reaction moment on the second link, about the joint's point"),
    "friction_torque": Variable(("joint",), "N m", "friction torque on the second link by the first"),
    "friction_force": Variable(("joint",), "N", "friction force along the slide on the second link by the first"),
    "friction_moment": Variable(
        ("joint", "axis"), "N m", "friction moment on the second link, about the middle of the bearing", space="spatial"
    ),
    "friction_power": Variable(("joint",), "W", "power lost to friction"),
    "end_load": Variable(
        ("joint", "bearing_end", "axis"),
        "N",
        "load on each end of the bearing or guide, global axes; of a cross 3 and 4 on the pin of the second link",
        part="bearings",
    ),
    "pin_pressure": Variable(
        ("joint",),
        "Pa",
        "load over projected area of the pin, F/(d b), in space of the end that bears more",
        part="bearings",
    ),
    "drive_effort": Variable(("driver",), "effort", "drive effort on the second link by the first"),
    "drive_effort_lower": Variable(("driver",), "effort", "least drive effort where a friction is an interval"),
    "drive_effort_upper": Variable(("driver",), "effort", "largest drive effort where a friction is an interval"),
    "drive_power": Variable(("driver",), "W", "power of the driver"),
    "spring_force": Variable(
        ("spring",), "spring_force", "pull of the spring and its damper; a torque in a joint that turns"
    ),
    "spring_elongation": Variable(
        ("spring",), "spring_elongation", "length beyond the free length; an angle in a joint that turns"
    ),
    "spring_power": Variable(("spring",), "W", "power of the spring and its damper, positive into the mechanism"),
    "damping_power": Variable(("spring",), "W", "power lost in the spring's damper"),
    "gear_torque": Variable(
        ("gear",),
        "N m",
        "torque of the gear pair in its second joint, on its second link; of a rack or screw in what turns",
    ),
    "gear_force": Variable(
        ("gear", "axis"), "N", "tooth force on the gear of the second joint by that of the first; on the rack or nut"
    ),
    "useful_power": Variable((), "W", "power delivered to the useful loads"),
    "efficiency_instant": Variable((), "1", "useful power over drive power"),
    "closure_residual": Variable((), "m", "largest opening of a closed loop"),
    "condition": Variable((), "1", "largest condition number of a module's Jacobian"),
    "power_residual": Variable((), "W", "drive + loads + inertia − friction power; 0 but for rounding"),
    "friction_iterations": Variable((), "1", "rounds to settle friction and reactions", np.int32),
    "friction_change": Variable((), "N", "largest change of a reaction in the last round"),
    "friction_residual": Variable((), "N", "largest difference between a friction and its law for the load found"),
    "friction_contraction": Variable((), "1", "contraction of the friction iteration; from 1 on it may diverge"),
    "locking_margin": Variable((), "1", "multiple of the friction at which the position locks, ∞ if beyond 10"),
    "status": Variable((), "1", "code of the position's status; see the attribute flag_meanings", np.int8),
    "seat_offset": Variable(
        ("joint", "end", "axis"), "m", "offset of the pin's axis from the hole's at each end, hole's axes", part="seats"
    ),
    "seat_beta": Variable(("joint",), "rad", "angle β between the seats of a pin's ends", part="seats"),
    "seat_xi": Variable(("joint",), "rad", "direction ξ of a pin's seat in its hole", part="seats"),
    "seat_xi_pin": Variable(("joint",), "rad", "direction ξ of a pin's seat in the pin's own frame", part="seats"),
    "end_force": Variable(
        ("joint", "end", "axis"), "N", "force of the pin on each end of its hole, hole's axes", part="seats"
    ),
    "contact_position": Variable(
        ("joint", "end", "axis"), "m", "place where the pin touches its hole at each end", part="seats"
    ),
    "contact_lost": Variable(("joint",), "1", "1 where the pin loses contact", np.int8, part="seats"),
    "contact_loss_number": Variable(
        ("joint",), "rad/(N s)", "rate of turn of the reaction over its size (Earles and Wu)", part="seats"
    ),
    "seat_travel": Variable(
        (),
        "1",
        "1 where velocities and accelerations include the motion of pins within their play",
        np.int8,
        part="seats",
    ),
    "seat_rounds": Variable((), "1", "iterations of seats and reactions", np.int32, part="seats"),
    "seat_change": Variable((), "1", "change of a seat in one more iteration, relative to its clearance", part="seats"),
    "point_error": Variable(("point", "axis"), "m", "place of the point against the ideal mechanism", part="errors"),
    "link_error": Variable(("link",), "rad", "angle of the link against the ideal mechanism", part="errors"),
    "joint_rotation_error": Variable(
        ("joint",), "rad", "rotation of the joint against the ideal mechanism", part="errors"
    ),
    "joint_slide_error": Variable(("joint",), "m", "slide of the joint against the ideal mechanism", part="errors"),
    "reaction_force_change": Variable(
        ("joint", "axis"), "N", "reaction less that of the ideal mechanism", part="errors"
    ),
    "drive_effort_change": Variable(
        ("driver",), "effort", "drive effort less that of the ideal mechanism", part="errors"
    ),
    "friction_power_change": Variable(
        ("joint",), "W", "power lost to friction less that of the ideal mechanism", part="errors"
    ),
}
# what is a vector in space
IN_SPACE = {
    "reaction_moment": Variable(
        ("joint", "axis"), "N m", "reaction moment on the second link, about the middle of the bearing"
    ),
    "friction_torque": Variable(
        ("joint",), "N m", "friction torque on the second link about its axis, or against its turn"
    ),
    "link_error": Variable(
        ("link", "axis"), "rad", "rotation vector of the link against the ideal mechanism", part="errors"
    ),
}
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


@functools.cache
def _along_positions(space: str) -> dict[str, Variable]:
    return {name: variable.over("position") for name, variable in variables(space).items()}


def _space(labels: Labels) -> str:
    return "spatial" if "component" in labels else "planar"


def allocate(
    labels: Labels,
    positions: int,
    parts: Sequence[str] = (),
    wanted: Collection[str] | None = None,
) -> dict[str, NDArray[np.float64]]:
    """Arrays for every variable, to be filled, position last.

    parts: of those variables that not every result has. wanted: what will be read, all if not given; of the others
    every entry is one cell, so that filling them costs next to nothing.
    """
    arrays: dict[str, NDArray[np.float64]] = {}
    for name, variable in variables(_space(labels)).items():
        if name in SAME_AS or not labels.keys() >= set(variable.dims):  # no springs, no spring_force
            continue
        if variable.part and variable.part not in parts:
            continue
        shape = (*(len(labels[dim]) for dim in variable.dims), positions)
        if wanted is not None and name not in wanted:
            cell = np.zeros(1, variable.dtype)
            arrays[name] = np.lib.stride_tricks.as_strided(cell, shape, (0,) * len(shape))
        else:
            # zeroed pages take no memory until something is written: rows of the ground and slides of pins never are
            arrays[name] = np.zeros(shape, variable.dtype)
            if variable.part in OF_SOME_JOINTS and variable.dtype is np.float64:
                arrays[name][:] = np.nan  # of joints and ends that have none
    for name, other in SAME_AS.items():
        arrays[name] = arrays[other]
    return arrays


def dataset(
    arrays: dict[str, NDArray[np.float64]],
    labels: Labels,
    along: Mapping[str, xr.Variable],
    means: object,
    attributes: Mapping[str, Any],
    units: Mapping[str, MemberUnits],
    ideal: object = None,
    kept: Collection[str] | None = None,
    dtype: str = "float64",
    more: Mapping[str, xr.Variable] | None = None,
) -> xr.Dataset:
    """The result of a cycle.

    along: the coordinates of its positions, see `results.dataset.driven`; means, ideal: what has the names of CYCLE as
    attributes, of the mechanism and of that without errors; units: those of drivers and springs; kept: variables of
    every position that it has, all if not given; dtype: of their floats. Where that is another than theirs, arrays are
    taken out of their dict one by one, so that both need not be in memory. more: what it has beside.
    """
    vocabulary = _along_positions(_space(labels))
    names = [name for name in arrays if kept is None or name in kept]
    other = {name for name in names if arrays[name].dtype == np.float64 and dtype != "float64"}
    numbers = {name: arrays.pop(name).astype(dtype) if name in other else arrays[name] for name in names}
    described_arrays = described(numbers, vocabulary, units)
    described_arrays |= described({name: getattr(means, name) for name in CYCLE}, CYCLE, units)
    if ideal is not None:
        described_arrays |= described({name: getattr(ideal, name.removesuffix("_ideal")) for name in IDEAL}, IDEAL)
    return dataset_of("cycle", {**described_arrays, **(more or {})}, labels, attributes, along)

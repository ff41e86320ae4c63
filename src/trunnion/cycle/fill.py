"""What a walk found, written into the arrays of a result: every variable, in the plane and in space."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from trunnion.algebra.namespace import Number
from trunnion.algebra.space import moment_at, quaternion
from trunnion.algebra.unwrap import unwrap_row
from trunnion.algebra.vector import cross, dot, plus, scaled
from trunnion.joints.pairs import PAIRS
from trunnion.results import variables as results
from trunnion.solve.backward import Backward
from trunnion.solve.contacts import bearing_middle
from trunnion.solve.forward import Forward, SpatialWalk
from trunnion.solve.loads import has_useful_work, useful_powers
from trunnion.solve.system import System, Values

__all__ = [
    "Into", "allocate", "fill_forces", "fill_joint", "fill_motion", "fill_power", "labels", "put", "unwrap",
]  # fmt: skip

Arrays = dict[str, NDArray[np.float64]]
Into = Mapping[str, Any]  # arrays by name, or what stands for them where a walk is written down
SLIDES = ["joint_slide", "joint_slide_velocity", "joint_slide_acceleration", "friction_force", "reaction_moment"]


def labels(system: System) -> dict[str, list[str]]:
    """Names along the dims."""
    mechanism, spatial = system.mechanism, system.mechanism.space == "spatial"
    members = {"spring": list(mechanism.springs), "gear": list(mechanism.gears)}
    return {
        **{dim: names for dim, names in members.items() if names},
        "joint": list(system.joints),
        "link": list(mechanism.effective_links if spatial else mechanism.links),
        "point": [f"{link}.{point}" for link, point in system.points],
        "axis": ["x", "y", "z"][: mechanism.coordinates],
        "driver": list(mechanism.drivers),
        **({"component": ["w", "x", "y", "z"]} if spatial else {}),
    }


def allocate(
    system: System, positions: int, parts: Sequence[str] = (), wanted: Collection[str] | None = None
) -> Arrays:
    """Arrays for the variables of a system, see `results.variables.allocate`.

    Of joints in the plane that all turn, slides are zero without taking memory.
    """
    still = system.mechanism.space == "planar" and all(system.turns(joint) for joint in system.joints)
    names = labels(system) | ({"end": ["1", "2"]} if "seats" in parts else {})
    return results.allocate(names, positions, SLIDES if still else [], parts, wanted)


# ---- motion ---------------------------------------------------------------------------------------------------


def fill_motion(arrays: Into, back: Backward, window: slice) -> None:
    """Angles or frames of links, points and joints of one chunk."""
    walk = back.walk
    fill_points(arrays, walk, window)
    if isinstance(walk, SpatialWalk):
        _frames(arrays, walk, window)
        for i, joint in enumerate(walk.system.joints):
            fill_joint(arrays, walk, i, joint, window)
    else:
        _angles(arrays, walk, window)


def _angles(arrays: Into, walk: Forward, window: slice) -> None:
    """Angles of links and rates of joints in the plane."""
    for i, link in enumerate(walk.system.mechanism.links):
        if link != walk.system.mechanism.fixed_link:
            motion = walk.motions[link]
            arrays["link_angle"][i, window] = np.arctan2(motion.frame.s, motion.frame.c)
            arrays["link_angle_velocity"][i, window] = motion.twist.w
            arrays["link_angle_acceleration"][i, window] = motion.acceleration.w
    for i, joint in enumerate(walk.system.joints):
        both = walk.rates(joint), walk.second_rates(joint)
        for name, rates in zip(("joint_rotation", "joint_slide"), zip(*both, strict=True), strict=True):
            for suffix, rate in zip(("_velocity", "_acceleration"), rates, strict=True):
                if arrays[name + suffix].flags.writeable:
                    arrays[name + suffix][i, window] = rate
        if arrays["joint_slide"].flags.writeable:
            arrays["joint_slide"][i, window] = 0.0 if walk.system.turns(joint) else walk.coordinates(joint)[1]


def _frames(arrays: Into, walk: SpatialWalk, window: slice) -> None:
    """Frames of links in space with their rates."""
    for i, link in enumerate(walk.system.mechanism.effective_links):
        frame, twist, second = walk.motions[link]
        for name, numbers in (
            ("link_rotation", quaternion(frame)),
            ("link_position", frame.place),
            ("link_angular_velocity", twist.u),
            ("link_angular_acceleration", second.u),
        ):
            put(arrays[name], i, numbers, window)


def fill_points(arrays: Into, walk: Forward, window: slice) -> None:
    """Named points of one chunk."""
    for i, (link, name) in enumerate(walk.system.points):
        for key, numbers in zip(("position", "velocity", "acceleration"), walk.point(link, name), strict=True):
            put(arrays[f"point_{key}"], i, numbers, window)


def put(array: Any, i: int, numbers: Sequence[Number], window: slice) -> None:
    """The components of the i-th vector."""
    for axis, number in enumerate(numbers):
        array[i, axis, window] = number


def fill_joint(arrays: Into, walk: SpatialWalk, i: int, joint: str, window: slice) -> None:
    """Rotation and slide of one joint with their derivatives; of balls and crosses the angle between their elements."""
    pair = walk.pair(joint)
    if pair.one_axis or pair.angle:
        both = zip(walk.coordinates(joint), walk.rates(joint), walk.second_rates(joint), strict=True)
        for name, values in zip(("joint_rotation", "joint_slide"), both, strict=True):
            if pair.one_axis or name == "joint_rotation":
                for suffix, value in zip(("", "_velocity", "_acceleration"), values, strict=True):
                    arrays[name + suffix][i, window] = value
        return
    (first, second), (one, two) = walk.system.joints[joint][1], walk.ends(joint)
    turn = scaled(0.5, plus(plus(cross(one.x, two.x), cross(one.y, two.y)), cross(one.z, two.z)))
    cosine = 0.5 * (dot(one.x, two.x) + dot(one.y, two.y) + dot(one.z, two.z) - 1)
    spin = walk.against(joint).u
    change = tuple(
        b - a for a, b in zip(walk.motions[first].acceleration.u, walk.motions[second].acceleration.u, strict=True)
    )
    speed = np.sqrt(dot(spin, spin))
    arrays["joint_rotation"][i, window] = np.arctan2(np.sqrt(dot(turn, turn)), cosine)
    arrays["joint_rotation_velocity"][i, window] = speed
    moves = np.greater(speed, 0)
    rate = (spin[0] * change[0] + spin[1] * change[1] + spin[2] * change[2]) / np.where(moves, speed, 1.0)
    arrays["joint_rotation_acceleration"][i, window] = np.where(moves, rate, 0.0)


# ---- forces ---------------------------------------------------------------------------------------------------


def fill_forces(arrays: Into, back: Backward, window: slice) -> None:
    """Reactions, friction, drive efforts, springs and gear pairs of one chunk."""
    (_spatial_reactions if isinstance(back.walk, SpatialWalk) else _planar_reactions)(arrays, back, window)
    mechanism = back.walk.system.mechanism
    for i, name in enumerate(mechanism.drivers):
        arrays["drive_effort"][i, window] = back.efforts[name]
    for i, name in enumerate(mechanism.springs):
        for key, number in zip(("spring_force", "spring_elongation"), back.springs[name][:2], strict=True):
            arrays[key][i, window] = number
    for i, name in enumerate(mechanism.gears):
        arrays["gear_torque"][i, window] = back.gears[name].torque
        put(arrays["gear_force"], i, back.gears[name].force, window)


def _planar_reactions(arrays: Into, back: Backward, window: slice) -> None:
    """Reactions and friction of one chunk."""
    for i, name in enumerate(back.walk.system.joints):
        *force, moment = back.reactions[name]
        put(arrays["reaction_force"], i, force, window)
        turns, friction = back.walk.system.turns(name), back.friction[name]
        arrays["friction_torque"][i, window] = friction if turns else 0.0
        if arrays["reaction_moment"].flags.writeable:  # and so is the force
            arrays["reaction_moment"][i, window] = moment
            arrays["friction_force"][i, window] = 0.0 if turns else friction


def _spatial_reactions(arrays: Into, back: Backward, window: slice) -> None:
    """Reactions about the middles of the bearings, and friction, of one chunk."""
    walk = back.walk
    assert isinstance(walk, SpatialWalk)
    for i, joint in enumerate(walk.system.joints):
        middle, reaction, friction = bearing_middle(walk, joint), back.reactions[joint], back.friction_wrenches[joint]
        put(arrays["reaction_force"], i, reaction.u, window)
        put(arrays["reaction_moment"], i, moment_at(reaction, middle), window)
        put(arrays["friction_moment"], i, moment_at(friction, middle), window)
        arrays["friction_force"][i, window] = dot(friction.u, walk.ends(joint)[1].z)
        if walk.system.turns(joint):
            arrays["friction_torque"][i, window] = back.friction[joint]


def fill_power(arrays: Into, back: Backward, time: Number, window: slice) -> None:
    """Power of drivers, loads, springs and friction, and what is left over: their sum with inertia and gravity."""
    walk = back.walk
    total: Number = back.body_power + back.gear_power
    for power in back.load_powers.values():
        total = total + power
    for i, name in enumerate(walk.system.joints):
        lost = back.friction_power(name)
        arrays["friction_power"][i, window] = lost
        total = total - lost
    for i, state in enumerate(back.springs.values()):
        arrays["spring_power"][i, window] = state.power
        arrays["damping_power"][i, window] = state.loss
        total = total + state.power
    driven: Number = 0.0
    for i, name in enumerate(walk.system.mechanism.drivers):
        power = back.efforts[name] * walk.system.drive(walk.values, name, time)[1]
        arrays["drive_power"][i, window] = power
        driven = driven + power
    useful: Number = 0.0
    for power in useful_powers(walk.system.mechanism, back.load_powers, back.springs):
        useful = useful - power
    arrays["useful_power"][window] = useful
    defined = np.greater(driven, 0) & has_useful_work(walk.system.mechanism)
    arrays["efficiency_instant"][window] = useful / np.where(defined, driven, np.nan)
    arrays["power_residual"][window] = total + driven
    arrays["closure_residual"][window] = _worst(walk.system, walk.poses, "closure")
    arrays["condition"][window] = _worst(walk.system, walk.poses, "condition")


def _worst(system: System, poses: Sequence[Any], figure: str) -> Number:
    worst: Number = 0.0
    for group, pose in zip(system.groups, poses, strict=True):
        worst = np.maximum(worst, getattr(group, figure)(pose))
    return worst


# ---- angles that run on ---------------------------------------------------------------------------------------


def unwrap(arrays: Arrays, system: System, values: Values, time: NDArray[np.float64]) -> None:
    """Angles without jumps of a whole turn along each run of solved positions, and the joints' rotations.

    A driven rotation is the prescribed coordinate itself, whole turns included.
    """
    spatial = system.mechanism.space == "spatial"
    if not arrays["joint_rotation" if spatial else "link_angle"].strides[-1]:  # nobody reads them
        return
    step = float(time[1] - time[0]) if len(time) > 1 else 0.0
    places = {link: i for i, link in enumerate(labels(system)["link"])}
    for link, i in places.items():
        if not spatial and link != system.mechanism.fixed_link:
            unwrap_row(arrays["link_angle"][i], arrays["link_angle_velocity"][i], step)
    for i, (name, (kind, (first, second))) in enumerate(system.joints.items()):
        rotation = arrays["joint_rotation"][i]
        if not spatial:
            np.subtract(arrays["link_angle"][places[second]], arrays["link_angle"][places[first]], out=rotation)
        if name in system.mechanism.drivers and system.turns(name):
            rotation[:] = np.where(np.isfinite(rotation), system.drive(values, name, time)[0], np.nan)
        elif spatial and PAIRS[kind].angle:
            unwrap_row(rotation, arrays["joint_rotation_velocity"][i], step)
        if PAIRS[kind].threaded:  # its slide follows the whole turns
            pitch = float(np.ravel(values[f"joints.{name}.pitch"])[0])
            arrays["joint_slide"][i] = rotation * pitch / (2 * np.pi)

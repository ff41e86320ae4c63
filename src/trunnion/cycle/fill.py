"""What a walk in the plane found, written into the arrays of a result."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from trunnion.algebra.namespace import Number
from trunnion.algebra.unwrap import unwrap_row
from trunnion.solve.backward import Backward
from trunnion.solve.forward import Forward
from trunnion.solve.loads import has_useful_work, useful_powers
from trunnion.solve.system import System, Values

__all__ = [
    "Into", "absent", "fill_efforts", "fill_forces", "fill_motion", "fill_points", "fill_power", "labels", "put",
    "unwrap",
]  # fmt: skip

Arrays = dict[str, NDArray[np.float64]]
Into = Mapping[str, Any]  # arrays by name, or what stands for them where a walk is written down


def labels(system: System) -> dict[str, list[str]]:
    """Names along the dims."""
    mechanism = system.mechanism
    springs = {"spring": list(mechanism.springs)} if mechanism.springs else {}
    gears = {"gear": list(mechanism.gears)} if mechanism.gears else {}
    return (
        springs
        | gears
        | {
            "joint": list(system.joints),
            "link": list(mechanism.links),
            "point": [f"{link}.{point}" for link, point in system.points],
            "axis": ["x", "y"],
            "driver": list(mechanism.drivers),
        }
    )


def absent(system: System) -> list[str]:
    """Variables that this mechanism cannot have: zero without taking memory."""
    if not all(system.turns(joint) for joint in system.joints):
        return []
    slides = ["joint_slide", "joint_slide_velocity", "joint_slide_acceleration", "friction_force"]
    return [*slides, "reaction_moment"]


def fill_motion(arrays: Into, back: Backward, window: slice) -> None:
    """Angles, points and joints of one chunk."""
    walk = back.walk
    for i, link in enumerate(walk.system.mechanism.links):
        if link != walk.system.mechanism.fixed_link:
            motion = walk.motions[link]
            arrays["link_angle"][i, window] = np.arctan2(motion.frame.s, motion.frame.c)
            arrays["link_angle_velocity"][i, window] = motion.twist.w
            arrays["link_angle_acceleration"][i, window] = motion.acceleration.w
    fill_points(arrays, walk, window)
    for i, joint in enumerate(walk.system.joints):
        both = walk.rates(joint), walk.second_rates(joint)
        for name, rates in zip(("joint_rotation", "joint_slide"), zip(*both, strict=True), strict=True):
            for suffix, rate in zip(("_velocity", "_acceleration"), rates, strict=True):
                if arrays[name + suffix].flags.writeable:
                    arrays[name + suffix][i, window] = rate
        if arrays["joint_slide"].flags.writeable:
            arrays["joint_slide"][i, window] = 0.0 if walk.system.turns(joint) else walk.coordinates(joint)[1]


def fill_points(arrays: Into, walk: Forward, window: slice) -> None:
    """Named points of one chunk."""
    for i, (link, name) in enumerate(walk.system.points):
        for key, numbers in zip(("position", "velocity", "acceleration"), walk.point(link, name), strict=True):
            put(arrays[f"point_{key}"], i, numbers, window)


def put(array: Any, i: int, numbers: Sequence[Number], window: slice) -> None:
    """The components of the i-th vector."""
    for axis, number in enumerate(numbers):
        array[i, axis, window] = number


def fill_forces(arrays: Into, back: Backward, window: slice) -> None:
    """Reactions, friction, and what `fill_efforts` does, of one chunk."""
    for i, name in enumerate(back.walk.system.joints):
        *force, moment = back.reactions[name]
        put(arrays["reaction_force"], i, force, window)
        turns, friction = back.walk.system.turns(name), back.friction[name]
        arrays["friction_torque"][i, window] = friction if turns else 0.0
        if arrays["reaction_moment"].flags.writeable:  # and so is the force
            arrays["reaction_moment"][i, window] = moment
            arrays["friction_force"][i, window] = 0.0 if turns else friction
    fill_efforts(arrays, back, window)


def fill_efforts(arrays: Into, back: Backward, window: slice) -> None:
    """Drive efforts, springs and gear pairs of one chunk."""
    mechanism = back.walk.system.mechanism
    for i, name in enumerate(mechanism.drivers):
        arrays["drive_effort"][i, window] = back.efforts[name]
    for i, name in enumerate(mechanism.springs):
        for key, number in zip(("spring_force", "spring_elongation"), back.springs[name][:2], strict=True):
            arrays[key][i, window] = number
    for i, name in enumerate(mechanism.gears):
        arrays["gear_torque"][i, window] = back.gears[name].torque
        put(arrays["gear_force"], i, back.gears[name].force, window)


def unwrap(arrays: Arrays, system: System, values: Values, time: NDArray[np.float64]) -> None:
    """Angles without jumps of a whole turn along each run of solved positions, and the joints' rotations.

    A driven rotation is the prescribed coordinate itself, whole turns included.
    """
    if not arrays["link_angle"].strides[-1]:  # nobody reads them
        return
    angles = arrays["link_angle"]
    order = list(system.mechanism.links)
    step = float(time[1] - time[0]) if len(time) > 1 else 0.0
    for link, angle, rate in zip(order, angles, arrays["link_angle_velocity"], strict=True):
        if link != system.mechanism.fixed_link:
            unwrap_row(angle, rate, step)
    for i, (name, (_, (first, second))) in enumerate(system.joints.items()):
        rotation = arrays["joint_rotation"][i]
        np.subtract(angles[order.index(second)], angles[order.index(first)], out=rotation)
        if name in system.mechanism.drivers and system.turns(name):
            rotation[:] = np.where(np.isfinite(rotation), system.drive(values, name, time)[0], np.nan)


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

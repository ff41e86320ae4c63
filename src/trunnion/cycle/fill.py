"""What a walk in the plane found, written into the arrays of a result."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from trunnion.algebra.namespace import Number
from trunnion.algebra.plane import accelerated
from trunnion.algebra.unwrap import unwrap_row
from trunnion.solve.backward import Backward
from trunnion.solve.system import System, Values

if TYPE_CHECKING:
    pass
from trunnion.solve.loads import useful_loads

__all__ = ["absent", "fill_forces", "fill_motion", "fill_power", "labels", "unwrap"]

Arrays = dict[str, NDArray[np.float64]]


def labels(system: System) -> dict[str, list[str]]:
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
    if any(kind == "prismatic" for kind, _ in system.joints.values()):
        return []
    slides = ["joint_slide", "joint_slide_velocity", "joint_slide_acceleration", "friction_force"]
    return [*slides, "reaction_moment"]


def fill_motion(arrays: Arrays, back: Backward, window: slice) -> None:
    walk = back.walk
    ground = walk.system.mechanism.fixed_link
    for i, link in enumerate(walk.system.mechanism.links):
        if link == ground:
            continue
        motion = walk.motions[link]
        arrays["link_angle"][i, window] = np.arctan2(motion.frame.s, motion.frame.c)
        arrays["link_angle_velocity"][i, window] = motion.twist.w
        arrays["link_angle_acceleration"][i, window] = motion.acceleration.w
    for i, (link, name) in enumerate(walk.system.points):
        moved = walk.point(link, name)
        for axis in (0, 1):
            arrays["point_position"][i, axis, window] = moved.place[axis]
            if link == ground:
                continue
            arrays["point_velocity"][i, axis, window] = moved.velocity[axis]
            arrays["point_acceleration"][i, axis, window] = moved.acceleration[axis]
    for i, (kind, links) in enumerate(walk.system.joints.values()):
        first, second = (walk.motions[link] for link in links)
        arrays["joint_rotation_velocity"][i, window] = second.twist.w - first.twist.w
        arrays["joint_rotation_acceleration"][i, window] = second.acceleration.w - first.acceleration.w
        if kind == "prismatic":
            _fill_slide(arrays, back, i, window)
        elif arrays["joint_slide"].flags.writeable:
            for name in ("joint_slide", "joint_slide_velocity", "joint_slide_acceleration"):
                arrays[name][i, window] = 0.0


def _fill_slide(arrays: Arrays, back: Backward, i: int, window: slice) -> None:
    """Slide of one joint with its derivatives, along the axis on its first link."""
    walk = back.walk
    name = list(walk.system.joints)[i]
    first, second = walk.system.joints[name][1]
    one, two = walk.element(first, name), walk.element(second, name)
    dx, dy = two.x - one.x, two.y - one.y
    w, base, end = walk.motions[first].twist.w, walk.acceleration(first, name), walk.acceleration(second, name)
    carried = accelerated(base, w, dx, dy)
    arrays["joint_slide"][i, window] = one.c * dx + one.s * dy
    arrays["joint_slide_velocity"][i, window] = back.slips[name].speed
    # the Coriolis part 2 ω × ṡ lies across the slide
    arrays["joint_slide_acceleration"][i, window] = one.c * (end.x - carried.x) + one.s * (end.y - carried.y)


def fill_forces(arrays: Arrays, back: Backward, window: slice) -> None:
    system = back.walk.system
    for i, (name, (kind, _)) in enumerate(system.joints.items()):
        reaction, friction = back.reactions[name], back.friction[name]
        arrays["reaction_force"][i, 0, window] = reaction.x
        arrays["reaction_force"][i, 1, window] = reaction.y
        if arrays["reaction_moment"].flags.writeable:
            arrays["reaction_moment"][i, window] = reaction.m
        rotates = kind == "revolute"
        arrays["friction_torque"][i, window] = friction if rotates else 0.0
        if arrays["friction_force"].flags.writeable:
            arrays["friction_force"][i, window] = 0.0 if rotates else friction
    for i, name in enumerate(system.mechanism.drivers):
        arrays["drive_effort"][i, window] = back.efforts[name]
    for i, name in enumerate(system.mechanism.springs):
        state = back.springs[name]
        for key, number in zip(("spring_force", "spring_elongation"), state[:2], strict=True):
            arrays[key][i, window] = number
    for i, name in enumerate(system.mechanism.gears):
        gear = back.gears[name]
        arrays["gear_torque"][i, window] = gear.torque
        for axis in (0, 1):
            arrays["gear_force"][i, axis, window] = gear.force[axis]


def unwrap(arrays: Arrays, system: System, values: Values, time: NDArray[np.float64]) -> None:
    """Angles without jumps of a whole turn along each run of solved positions, and the joints' rotations.

    A driven rotation is the prescribed coordinate itself, whole turns included.
    """
    angles = arrays["link_angle"]
    order = list(system.mechanism.links)
    step = float(time[1] - time[0]) if len(time) > 1 else 0.0
    for link, angle, rate in zip(order, angles, arrays["link_angle_velocity"], strict=True):
        if link != system.mechanism.fixed_link:
            unwrap_row(angle, rate, step)
    for i, (name, (kind, (first, second))) in enumerate(system.joints.items()):
        rotation = arrays["joint_rotation"][i]
        np.subtract(angles[order.index(second)], angles[order.index(first)], out=rotation)
        if name in system.mechanism.drivers and kind == "revolute":
            rotation[:] = np.where(np.isfinite(rotation), system.drive(values, name, time)[0], np.nan)


def fill_power(
    arrays: dict[str, NDArray[np.float64]], back: Backward, time: NDArray[np.float64], window: slice
) -> None:
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
    for name in useful_loads(walk.system.mechanism):
        useful = useful - back.load_powers[name]
    arrays["useful_power"][window] = useful
    arrays["efficiency_instant"][window] = useful / np.where(np.asarray(driven) > 0, driven, np.nan)
    arrays["power_residual"][window] = total + driven
    arrays["closure_residual"][window] = _worst(walk.system, walk.poses, "closure")
    arrays["condition"][window] = _worst(walk.system, walk.poses, "condition")


def _worst(system: System, poses: Sequence[Any], figure: str) -> Number:
    worst: Number = 0.0
    for group, pose in zip(system.groups, poses, strict=True):
        worst = np.maximum(worst, getattr(group, figure)(pose))
    return worst

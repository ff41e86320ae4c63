"""What a walk in space found, written into the arrays of a result."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from trunnion.algebra.namespace import Number
from trunnion.algebra.space import moment_at, quaternion
from trunnion.algebra.unwrap import unwrap_row
from trunnion.algebra.vector import cross, dot, plus, scaled
from trunnion.cycle import fill
from trunnion.solve.backward import Backward
from trunnion.solve.space.contacts import bearing_middle
from trunnion.solve.space.forces import SpatialBackward
from trunnion.solve.space.motion import SpatialWalk
from trunnion.solve.system import System, Values

__all__ = ["absent", "fill_forces", "fill_motion", "labels", "unwrap"]

Arrays = dict[str, NDArray[np.float64]]
ON_ONE_AXIS = ("revolute", "prismatic", "cylindrical", "helical", "planar")


def labels(system: System) -> dict[str, list[str]]:
    """Names along the dims."""
    return {
        **fill.labels(system),
        "link": list(system.mechanism.effective_links),
        "axis": ["x", "y", "z"],
        "component": ["w", "x", "y", "z"],
    }


def absent(system: System) -> list[str]:
    """Variables that this mechanism cannot have: none."""
    return []


def fill_motion(arrays: Arrays, back: Backward, window: slice) -> None:
    """Frames, points and joints of one chunk."""
    assert isinstance(back, SpatialBackward)
    walk = back.space
    for i, link in enumerate(walk.system.mechanism.effective_links):
        frame, twist, second = walk.motions[link]
        arrays["link_rotation"][i, :, window] = _full(quaternion(frame), arrays["status"][window].shape)
        for name, numbers in (
            ("link_position", frame.place),
            ("link_angular_velocity", twist.u),
            ("link_angular_acceleration", second.u),
        ):
            _put(arrays[name], i, numbers, window)
    for i, (link, name) in enumerate(walk.system.points):
        moved = walk.point(link, name)
        for key, numbers in zip(("position", "velocity", "acceleration"), moved, strict=True):
            _put(arrays[f"point_{key}"], i, numbers, window)
    for i, joint in enumerate(walk.system.joints):
        _fill_joint(arrays, walk, i, joint, window)


def _full(numbers: tuple[Number, ...], shape: tuple[int, ...]) -> NDArray[np.float64]:
    return np.array([np.broadcast_to(number, shape) for number in numbers])


def _put(array: NDArray[np.float64], i: int, numbers: tuple[Number, ...], window: slice) -> None:
    for axis, number in enumerate(numbers):
        array[i, axis, window] = number


def _fill_joint(arrays: Arrays, walk: SpatialWalk, i: int, joint: str, window: slice) -> None:
    """Rotation and slide of one joint with their derivatives; of balls and crosses the angle between their elements."""
    kind, (first, second) = walk.system.joints[joint]
    if kind in ON_ONE_AXIS:
        both = zip(walk.coordinates(joint), walk.rates(joint), walk.second_rates(joint), strict=True)
        for name, values in zip(("joint_rotation", "joint_slide"), both, strict=True):
            if kind != "planar" or name == "joint_rotation":
                for suffix, value in zip(("", "_velocity", "_acceleration"), values, strict=True):
                    arrays[name + suffix][i, window] = value
        return
    one, two = walk.element(first, joint), walk.element(second, joint)
    turn = scaled(0.5, plus(plus(cross(one.x, two.x), cross(one.y, two.y)), cross(one.z, two.z)))
    cosine = 0.5 * (dot(one.x, two.x) + dot(one.y, two.y) + dot(one.z, two.z) - 1)
    spin = walk.against(joint).u
    change = tuple(
        b - a for a, b in zip(walk.motions[first].acceleration.u, walk.motions[second].acceleration.u, strict=True)
    )
    speed = np.sqrt(dot(spin, spin))
    arrays["joint_rotation"][i, window] = np.arctan2(np.sqrt(dot(turn, turn)), cosine)
    arrays["joint_rotation_velocity"][i, window] = speed
    moves = np.asarray(speed > 0)
    rate = (spin[0] * change[0] + spin[1] * change[1] + spin[2] * change[2]) / np.where(moves, speed, 1.0)
    arrays["joint_rotation_acceleration"][i, window] = np.where(moves, rate, 0.0)


def fill_forces(arrays: Arrays, back: Backward, window: slice) -> None:
    """Reactions, friction, drive efforts and springs of one chunk."""
    assert isinstance(back, SpatialBackward)
    walk = back.space
    for i, (joint, (kind, (_, second))) in enumerate(walk.system.joints.items()):
        middle, reaction, friction = bearing_middle(walk, joint), back.reactions[joint], back.friction_wrenches[joint]
        _put(arrays["reaction_force"], i, reaction.u, window)
        _put(arrays["reaction_moment"], i, moment_at(reaction, middle), window)
        _put(arrays["friction_moment"], i, moment_at(friction, middle), window)
        arrays["friction_force"][i, window] = dot(friction.u, walk.element(second, joint).z)
        if kind != "prismatic":
            arrays["friction_torque"][i, window] = back.friction[joint]
    for i, name in enumerate(walk.system.mechanism.drivers):
        arrays["drive_effort"][i, window] = back.efforts[name]
    for i, name in enumerate(walk.system.mechanism.springs):
        state = back.springs[name]
        for key, number in zip(("spring_force", "spring_elongation"), state[:2], strict=True):
            arrays[key][i, window] = number


def unwrap(arrays: Arrays, system: System, values: Values, time: NDArray[np.float64]) -> None:
    """Rotations of joints on one axis without jumps of a whole turn; a driven one is the prescribed coordinate."""
    step = float(time[1] - time[0]) if len(time) > 1 else 0.0
    for i, (name, (kind, _)) in enumerate(system.joints.items()):
        rotation = arrays["joint_rotation"][i]
        if name in system.mechanism.drivers and system.turns(name):
            rotation[:] = np.where(np.isfinite(rotation), system.drive(values, name, time)[0], np.nan)
        elif kind in ON_ONE_AXIS and kind != "prismatic":
            unwrap_row(rotation, arrays["joint_rotation_velocity"][i], step)
    for i, (name, (kind, _)) in enumerate(system.joints.items()):
        if kind == "helical":  # its slide follows the whole turns
            pitch = float(np.ravel(values[f"joints.{name}.pitch"])[0])
            arrays["joint_slide"][i] = arrays["joint_rotation"][i] * pitch / (2 * np.pi)

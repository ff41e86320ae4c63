"""What a walk in space found, written into the arrays of a result."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from trunnion.algebra.space import moment_at, quaternion
from trunnion.algebra.unwrap import unwrap_row
from trunnion.algebra.vector import cross, dot, plus, scaled
from trunnion.cycle import fill
from trunnion.joints.pairs import PAIRS
from trunnion.solve.backward import Backward
from trunnion.solve.space.contacts import bearing_middle
from trunnion.solve.space.motion import SpatialWalk
from trunnion.solve.system import System, Values

__all__ = ["absent", "fill_forces", "fill_joint", "fill_motion", "labels", "unwrap"]

Arrays = dict[str, NDArray[np.float64]]


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


def fill_motion(arrays: fill.Into, back: Backward, window: slice) -> None:
    """Frames, points and joints of one chunk."""
    walk = back.walk
    assert isinstance(walk, SpatialWalk)
    for i, link in enumerate(walk.system.mechanism.effective_links):
        frame, twist, second = walk.motions[link]
        for name, numbers in (
            ("link_rotation", quaternion(frame)),
            ("link_position", frame.place),
            ("link_angular_velocity", twist.u),
            ("link_angular_acceleration", second.u),
        ):
            fill.put(arrays[name], i, numbers, window)
    fill.fill_points(arrays, walk, window)
    for i, joint in enumerate(walk.system.joints):
        fill_joint(arrays, walk, i, joint, window)


def fill_joint(arrays: fill.Into, walk: SpatialWalk, i: int, joint: str, window: slice) -> None:
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


def fill_forces(arrays: fill.Into, back: Backward, window: slice) -> None:
    """Reactions, friction, drive efforts and springs of one chunk."""
    walk = back.walk
    assert isinstance(walk, SpatialWalk)
    for i, joint in enumerate(walk.system.joints):
        middle, reaction, friction = bearing_middle(walk, joint), back.reactions[joint], back.friction_wrenches[joint]
        fill.put(arrays["reaction_force"], i, reaction.u, window)
        fill.put(arrays["reaction_moment"], i, moment_at(reaction, middle), window)
        fill.put(arrays["friction_moment"], i, moment_at(friction, middle), window)
        arrays["friction_force"][i, window] = dot(friction.u, walk.ends(joint)[1].z)
        if walk.system.turns(joint):
            arrays["friction_torque"][i, window] = back.friction[joint]
    fill.fill_efforts(arrays, back, window)


def unwrap(arrays: Arrays, system: System, values: Values, time: NDArray[np.float64]) -> None:
    """Rotations of joints on one axis without jumps of a whole turn; a driven one is the prescribed coordinate."""
    if not arrays["joint_rotation"].strides[-1]:  # nobody reads them
        return
    step = float(time[1] - time[0]) if len(time) > 1 else 0.0
    for i, (name, (kind, _)) in enumerate(system.joints.items()):
        pair, rotation = PAIRS[kind], arrays["joint_rotation"][i]
        if name in system.mechanism.drivers and system.turns(name):
            rotation[:] = np.where(np.isfinite(rotation), system.drive(values, name, time)[0], np.nan)
        elif pair.angle:
            unwrap_row(rotation, arrays["joint_rotation_velocity"][i], step)
    for i, (name, (kind, _)) in enumerate(system.joints.items()):
        if PAIRS[kind].threaded:  # its slide follows the whole turns
            pitch = float(np.ravel(values[f"joints.{name}.pitch"])[0])
            arrays["joint_slide"][i] = arrays["joint_rotation"][i] * pitch / (2 * np.pi)

"""The course of every kind of measure: one number or more, position by position; SI, angles in (−π, π].

`CURVES` has one function an entry of `model.measure_table.MEASURES`, of a `Backward` if that needs forces, else of a
`Forward`. Floats, arrays or dual numbers flow through, as the values of the mechanism are.
"""

from __future__ import annotations

import functools
import operator
from collections.abc import Callable
from typing import Any

import numpy as np

from trunnion.algebra.dual import Dual, primal
from trunnion.algebra.namespace import Number, namespace
from trunnion.measures import motion
from trunnion.measures.motion import MotionRequest, component
from trunnion.measures.transmission import of_joint
from trunnion.solve.backward import Backward
from trunnion.solve.forward import Forward, SpatialWalk
from trunnion.solve.friction_method import MARGIN
from trunnion.solve.loads import SpringState, has_useful_work, springs, useful_powers
from trunnion.solve.margin import locking_margin as multiple_that_locks

__all__ = ["CURVES", "Course"]

Course = Callable[[MotionRequest, Any], tuple[Number, ...]]


# ---- of the places --------------------------------------------------------------------------------------------


def value(measure: MotionRequest, walk: Forward) -> tuple[Number, ...]:
    """The number of the motion itself."""
    return (motion.value(measure, walk),)


def of_joint_motion(measure: MotionRequest, walk: Forward) -> tuple[Number, ...]:
    """The rotation of a joint, or the slide of one that does not turn."""
    return (motion.value(measure, walk, "rotation" if walk.system.turns(measure.subject) else "slide"),)


def attitude(measure: MotionRequest, walk: Forward) -> tuple[Number, ...]:
    """The angle of a link; in space the axes of its frame, nine numbers."""
    if not isinstance(walk, SpatialWalk):
        return value(measure, walk)
    return tuple(number for axis in walk.motions[measure.subject].frame[:3] for number in axis)


def place(measure: MotionRequest, walk: Forward) -> tuple[Number, ...]:
    """Coordinates of a point, m: two in the plane, three in space."""
    link, point = measure.subject.split(".")
    return tuple(walk.point(link, point).place)


def pressure_angle(measure: MotionRequest, walk: Forward) -> tuple[Number, ...]:
    """Of the dyad of a joint, rad in −π/2 … π/2."""
    return (of_joint(walk, measure.subject),)


def transmission_angle(measure: MotionRequest, walk: Forward) -> tuple[Number, ...]:
    """Of the dyad of a joint, rad in 0 … π/2: of an RRR the angle at its inner pin, folded to be acute."""
    angle = of_joint(walk, measure.subject)
    return (np.pi / 2 - namespace(angle).abs(angle),)


# ---- of the motion --------------------------------------------------------------------------------------------


def velocity(measure: MotionRequest, walk: Forward) -> tuple[Number, ...]:
    """Of a point, m/s."""
    link, point = measure.subject.split(".")
    return (component(measure, tuple(walk.point(link, point).velocity)),)


def acceleration(measure: MotionRequest, walk: Forward) -> tuple[Number, ...]:
    """Of a point, m/s²."""
    link, point = measure.subject.split(".")
    return (component(measure, tuple(walk.point(link, point).acceleration)),)


def angular_velocity(measure: MotionRequest, walk: Forward) -> tuple[Number, ...]:
    """Of a link, rad/s; in the plane counterclockwise."""
    twist = walk.motions[measure.subject].twist
    return (component(measure, tuple(twist.u)) if isinstance(walk, SpatialWalk) else twist.w,)


def angular_acceleration(measure: MotionRequest, walk: Forward) -> tuple[Number, ...]:
    """Of a link, rad/s²; in the plane counterclockwise."""
    second = walk.motions[measure.subject].acceleration
    return (component(measure, tuple(second.u)) if isinstance(walk, SpatialWalk) else second.w,)


def rate(measure: MotionRequest, walk: Forward) -> tuple[Number, ...]:
    """Speed of the second link of a joint against the first, rad/s about the joint's axis or m/s along it."""
    return (walk.rates(measure.subject)[0 if walk.system.turns(measure.subject) else 1],)


def joint_acceleration(measure: MotionRequest, walk: Forward) -> tuple[Number, ...]:
    """Second derivative of the rotation of a joint, rad/s², or of the slide of one that does not turn, m/s²."""
    return (walk.second_rates(measure.subject)[0 if walk.system.turns(measure.subject) else 1],)


def spring_elongation(measure: MotionRequest, walk: Forward) -> tuple[Number, ...]:
    """Length or angle of a spring beyond its free one, m or rad."""
    return (_spring(measure, walk).elongation,)


def _spring(measure: MotionRequest, walk: Forward) -> SpringState:
    return next(state for name, _, state in springs(walk) if name == measure.subject)


def spring_force(measure: MotionRequest, walk: Forward) -> tuple[Number, ...]:
    """Pull of a spring and its damper, N, or torque, N m."""
    return (_spring(measure, walk).force,)


# ---- of the forces --------------------------------------------------------------------------------------------


def effort(measure: MotionRequest, back: Backward) -> tuple[Number, ...]:
    """Torque or force of a driver, N m or N."""
    return (back.efforts[measure.subject],)


def load(measure: MotionRequest, back: Backward) -> tuple[Number, ...]:
    """Torque or force of a load on a joint against the joint's positive sense, N m or N; NaN where the joint rests.

    Times the speed of the joint it is the power that the load takes.
    """
    stated = back.walk.system.mechanism.loads[measure.subject]
    joint, turns = stated.joint or "", stated.resisting_torque is not None
    speed = back.walk.rates(joint)[0 if turns else 1]
    moving = primal(speed) != 0
    xp = namespace(speed)
    return (-back.load_powers[measure.subject] / xp.where(moving, speed, np.nan),)


def reaction(measure: MotionRequest, back: Backward) -> tuple[Number, ...]:
    """Force in a joint without friction and drive effort, N."""
    found: Any = back.reactions[measure.subject]
    return (component(measure, (found.x, found.y) if hasattr(found, "x") else tuple(found.u)),)


def power(measure: MotionRequest, back: Backward) -> tuple[Number, ...]:
    """What a driver, or a load, gives the mechanism, W."""
    name = measure.subject
    if name in back.efforts:
        return (back.efforts[name] * back.walk.rate(name),)
    return (back.load_powers[name],)


def friction_power(measure: MotionRequest, back: Backward) -> tuple[Number, ...]:
    """Power lost to friction in a joint, W."""
    return (back.losses[measure.subject],)


def friction_energy(measure: MotionRequest, back: Backward) -> tuple[Number, ...]:
    """Power lost to friction in a joint, W, and how long the first driver takes for its cycle, s."""
    walk = back.walk
    driver = next(iter(walk.system.mechanism.drivers), "")
    duration: Number = walk.system.span(walk.values, driver).duration if driver else 0.0
    return back.losses[measure.subject], duration


def efficiency(measure: MotionRequest, back: Backward) -> tuple[Number, ...]:
    """Useful and drive power, W; of an instant their ratio, NaN where nothing is useful or the drivers put no power
    in."""
    walk = back.walk
    useful: Number = 0.0 if has_useful_work(walk.system.mechanism) else np.nan
    driven: Number = 0.0
    for power_in in useful_powers(walk.system.mechanism, back.load_powers, back.springs):
        useful = useful - power_in
    for name in walk.system.mechanism.drivers:
        driven = driven + back.efforts[name] * walk.rate(name)
    if measure.subject == "cycle":
        return useful, driven
    xp = namespace(driven)
    return (useful / xp.where(driven > 0, driven, np.nan),)


def locking_margin(measure: MotionRequest, back: Backward) -> tuple[Number, ...]:
    """Multiple of the friction at which a module locks, MARGIN where it does not up to there.

    The search for it has no derivatives: they are NaN where dual numbers ask for some below MARGIN.
    """
    margin: Number = np.minimum(multiple_that_locks(back), MARGIN)
    forces: Number = functools.reduce(operator.add, (*back.friction.values(), *back.efforts.values()), 0.0)
    if isinstance(forces, Dual):
        return (Dual(margin, np.where(margin < MARGIN, np.nan, 0.0)),)
    return (margin,)


def of_no_cycle(measure: MotionRequest, walk: Forward) -> tuple[Number, ...]:
    """None: a figure of a motion in time is no course over a cycle, see `dynamics.measured`."""
    return (np.nan,)


CURVES: dict[str, Course] = {
    "point": value,
    "path_error": place,
    "straightness": place,
    "angle": attitude,
    "rotation": value,
    "slide": value,
    **dict.fromkeys(("transmission_error", "stroke", "dead_centre", "time_ratio"), of_joint_motion),
    "rate": rate,
    "joint_acceleration": joint_acceleration,
    "velocity": velocity,
    "acceleration": acceleration,
    "angular_velocity": angular_velocity,
    "angular_acceleration": angular_acceleration,
    "transmission_angle": transmission_angle,
    "pressure_angle": pressure_angle,
    "effort": effort,
    "load": load,
    "spring_force": spring_force,
    "spring_elongation": spring_elongation,
    "reaction": reaction,
    "power": power,
    "friction_power": friction_power,
    "friction_energy": friction_energy,
    "efficiency": efficiency,
    "locking_margin": locking_margin,
    **dict.fromkeys(("starting_time", "steady_speed", "fluctuation", "peak_effort"), of_no_cycle),
}

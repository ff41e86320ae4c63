"""The course of every kind of measure: one number or more, position by position; SI, angles in (−π, π].

`CURVES` has one function an entry of `model.measure_table.MEASURES`, of a `Backward` if that needs forces, else of a
`Forward`. Floats, arrays or dual numbers flow through, as the values of the mechanism are. Some are numbers of the
motion with unit loads (`MOTIONS`): a unit load does the work 1 on a unit of the number. Under these alone, the drivers
at rest, the reactions say what every small displacement in a joint does to the number.
"""

from __future__ import annotations

import functools
import operator
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from trunnion.algebra.dual import Dual, primal
from trunnion.algebra.namespace import Number, namespace
from trunnion.algebra.plane import Wrench
from trunnion.algebra.space import Screw
from trunnion.algebra.vector import Vector3, cross, dot
from trunnion.errors import Finding, MechanismError
from trunnion.groups.dyad import DyadPose
from trunnion.solve.backward import Backward, pose_status
from trunnion.solve.contacts import loads_on_ends
from trunnion.solve.forward import Forward, PointMotion, SpatialWalk
from trunnion.solve.friction_method import MARGIN
from trunnion.solve.loads import SpringState, has_useful_work, springs, useful_powers
from trunnion.solve.margin import locking_margin as multiple_that_locks
from trunnion.solve.run import Run
from trunnion.solve.turns import near, turned

__all__ = [
    "AXES", "CURVES", "MOTIONS", "MotionRequest", "angle_at", "angles", "loads", "near", "pressure_angles", "rate",
    "value", "within",
]  # fmt: skip

Array = NDArray[np.float64]

AXES = ("x", "y", "z")
NULL: Vector3 = (0.0, 0.0, 0.0)
MOTIONS = ("point", "angle", "rotation", "slide")  # kinds of measures that have unit loads


class MotionRequest(Protocol):
    """What of a measure its course depends on; see `measures.Measure`."""

    @property
    def kind(self) -> str: ...
    @property
    def subject(self) -> str: ...
    @property
    def axis(self) -> str: ...
    @property
    def along(self) -> tuple[float, ...]: ...


# ---- numbers with unit loads ----------------------------------------------------------------------------------


def _direction(measure: MotionRequest, size: int) -> Any:
    """Unit vector of the component that is asked for, of two or three numbers; empty for none: the magnitude."""
    if measure.along:
        length = sum(part * part for part in measure.along) ** 0.5
        return tuple(part / length for part in measure.along)
    return tuple(1.0 if axis == measure.axis else 0.0 for axis in AXES[:size]) if measure.axis else ()


def _component(measure: MotionRequest, vector: Any) -> Number:
    """The component of a vector that is asked for, or its magnitude, which has no derivative where it is 0."""
    if measure.axis:
        return vector[AXES.index(measure.axis)]
    total: Number = 0.0
    if along := _direction(measure, len(vector)):
        for share, part in zip(along, vector, strict=True):
            total = total + share * part
        return total
    for part in vector:
        total = total + part * part
    return namespace(total).sqrt(total)


def _point(measure: MotionRequest, walk: Forward) -> PointMotion:
    return walk.point(*measure.subject.split("."))


def value(measure: MotionRequest, walk: Forward) -> Number:
    """The number, m or rad.

    The turn of a link in space is that from the real part of its frame, which has a derivative only: ½ Σ eᵢ⁰ × eᵢ along
    the axis.
    """
    if measure.kind == "point":
        return _component(measure, _point(measure, walk).place)
    if measure.kind != "angle":
        return walk.coordinates(measure.subject)[("rotation", "slide").index(measure.kind)]
    frame = walk.motions[measure.subject].frame
    if not isinstance(walk, SpatialWalk):
        return namespace(frame.c, frame.s).arctan2(frame.s, frame.c)
    total: Number = 0.0
    for axis in frame[:3]:
        before: Any = tuple(primal(number) for number in axis)
        total = total + 0.5 * dot(cross(before, axis), _direction(measure, 3))
    return total


def loads(measure: MotionRequest, walk: Forward) -> dict[str, Any]:
    """The unit loads by link, about the global origin: their power is the rate of the number.

    They are equal and opposite on the two links of a joint.
    """
    in_space = isinstance(walk, SpatialWalk)
    along, none = _direction(measure, 3 if in_space else 2), NULL if in_space else 0.0
    if measure.kind == "point":
        return {measure.subject.split(".")[0]: walk.algebra.about(along, none, _point(measure, walk).place)}
    if measure.kind == "angle":
        return {measure.subject: Screw(NULL, along) if in_space else Wrench(0.0, 0.0, 1.0)}
    links, ends = walk.system.joints[measure.subject][1], walk.ends(measure.subject)
    axis: Any = ends[1].z if in_space else (ends[0].c, ends[0].s)
    if measure.kind == "slide":
        load = walk.algebra.about(axis, none, walk.algebra.place_of(ends[1]))
    else:
        load = Screw(NULL, axis) if in_space else Wrench(0.0, 0.0, 1.0)
    return {links[0]: walk.algebra.times(-1.0, load), links[1]: load}


def rate(measure: MotionRequest, walk: Forward) -> Number:
    """ẏ, by the power of the unit loads."""
    total: Number = 0.0
    for link, load in loads(measure, walk).items():
        total = total + walk.algebra.power(load, walk.motions[link].twist)
    return total


# ---- other numbers of the motion ------------------------------------------------------------------------------


def _turn_or_slide(measure: MotionRequest, walk: Forward, pair: tuple[Number, Number]) -> Number:
    """Of what a joint has of its rotation and of its slide the former, the latter if it does not turn."""
    return pair[0 if walk.system.turns(measure.subject) else 1]


def _spin(measure: MotionRequest, twist: Any) -> Number:
    """Of an angular velocity or its derivative; in the plane counterclockwise."""
    return twist.w if hasattr(twist, "w") else _component(measure, twist.u)


def _spring(measure: MotionRequest, walk: Forward) -> SpringState:
    return next(state for name, _, state in springs(walk) if name == measure.subject)


# ---- how well a dyad passes force on --------------------------------------------------------------------------


def _pressure_angle(pose: DyadPose) -> Number:
    """Pressure angle φ of a dyad from its pose, rad in −π/2 … π/2.

    The angle between the force that the first link puts on the second, had the first neither friction nor loads,
    and the velocity of the point of the second that it acts on, against the link that holds the second. But for RPP
    it is the same the other way round. cos φ is 2 over the condition number of the dyad. With its joints B, C, D:

    RRR   force along BC, velocity of C across DC: sin φ = cos(BC, DC), positive where the angle at C is acute
    RRP   force along BC, velocity along the guide u: sin φ = p/|BC|, C being p to the left of the line along u by B
    RPR   force across the slide, through B, velocity across BD: sin φ = e/|BD|, D being e to the left of that line
    PRP, RPP   force across the one guide u, velocity along the other v: sin φ = cos(u, v)

    Source: R. L. Norton, Design of Machinery, "Transmission angle" (π/2 less |φ|) and "Pressure angle".
    """
    moves = 1 / pose.area
    xp = namespace(pose.lost, moves)
    return xp.arctan2(pose.lost, xp.abs(moves))


def _dyads(walk: Forward) -> Iterator[tuple[Sequence[str], DyadPose]]:
    """The joints and the pose of every dyad."""
    for module, pose in zip(walk.system.plan.modules, walk.poses, strict=True):
        if isinstance(pose, DyadPose):
            yield module.joints, pose


@np.errstate(all="ignore")
def pressure_angles(walk: Forward) -> dict[str, Number]:
    """Pressure angle of every dyad along a walk in the plane, by its joints' names."""
    return {"-".join(joints): _pressure_angle(pose) for joints, pose in _dyads(walk)}


@np.errstate(all="ignore")
def _pressure_at(measure: MotionRequest, walk: Forward) -> Number:
    """Pressure angle of the dyad that a joint is of; MechanismError if it is of none."""
    poses = {joint: pose for joints, pose in _dyads(walk) for joint in joints}
    if measure.subject not in poses:
        what = f"'{measure.subject}' is no joint of a dyad, which alone has a transmission angle"
        those = f"those of a dyad are {', '.join(poses)}" if poses else "this mechanism has no dyad"
        raise MechanismError(Finding(what, f"joints.{measure.subject}", those))
    return _pressure_angle(poses[measure.subject])


def _transmission_angle(measure: MotionRequest, walk: Forward) -> Number:
    """Rad in 0 … π/2: of an RRR the angle at its inner pin, folded to be acute."""
    angle = _pressure_at(measure, walk)
    return np.pi / 2 - namespace(angle).abs(angle)


# ---- of the forces --------------------------------------------------------------------------------------------


def _load(measure: MotionRequest, back: Backward) -> Number:
    """Torque or force of a load on a joint against the joint's positive sense; NaN where the joint rests.

    Times the speed of the joint it is the power that the load takes.
    """
    load = back.walk.system.mechanism.loads[measure.subject]
    speed = back.walk.rates(load.joint or "")[0 if load.resisting_torque is not None else 1]
    xp = namespace(speed)
    return -back.load_powers[measure.subject] / xp.where(primal(speed) != 0, speed, np.nan)


def _reaction(measure: MotionRequest, back: Backward) -> Number:
    """Force in a joint without friction and drive effort."""
    load: Any = back.reactions[measure.subject]
    return _component(measure, (load.x, load.y) if hasattr(load, "x") else load.u)


def _end_load(measure: MotionRequest, back: Backward) -> Number:
    """The largest of |F⊥/2 ∓ g| with g = M⊥ × u/L, N: what presses on the ends of a bearing or guide of the length L.

    It is the load that friction with two contacts counts, see `joints.contact_loads`.
    """
    joint = measure.subject
    loads = loads_on_ends(back.walk, joint, back.reactions[joint], back.friction_wrenches[joint])
    squares = [dot(load, load) for load in loads]
    largest = functools.reduce(namespace(*squares).maximum, squares)
    loaded = primal(largest) > 0
    xp = namespace(largest)
    return xp.where(loaded, xp.sqrt(xp.where(loaded, largest, 1.0)), 0.0)


def _power(measure: MotionRequest, back: Backward) -> Number:
    """What a driver, or a load, gives the mechanism."""
    name = measure.subject
    return back.efforts[name] * back.walk.rate(name) if name in back.efforts else back.load_powers[name]


def _friction_energy(measure: MotionRequest, back: Backward) -> tuple[Number, ...]:
    """Power lost to friction in a joint, W, and how long the first driver takes for its cycle, s."""
    walk = back.walk
    driver = next(iter(walk.system.mechanism.drivers), "")
    duration: Number = walk.system.span(walk.values, driver).duration if driver else 0.0
    return back.losses[measure.subject], duration


def _efficiency(measure: MotionRequest, back: Backward) -> Number | tuple[Number, ...]:
    """Useful and drive power, W; of an instant their ratio, NaN where nothing is useful or the drivers put no power
    in."""
    walk = back.walk
    useful: Number = 0.0 if has_useful_work(walk.system.mechanism) else np.nan
    driven: Number = 0.0
    for power_in in useful_powers(walk, back.load_powers, back.springs):
        useful = useful - power_in
    for name in walk.system.mechanism.drivers:
        driven = driven + back.efforts[name] * walk.rate(name)
    if measure.subject == "cycle":
        return useful, driven
    return useful / namespace(driven).where(driven > 0, driven, np.nan)


def _locking_margin(measure: MotionRequest, back: Backward) -> Number:
    """Multiple of the friction at which a module locks, MARGIN where it does not up to there.

    The search for it has no derivatives: they are NaN where dual numbers ask for some below MARGIN.
    """
    margin: Number = np.minimum(multiple_that_locks(back), MARGIN)
    forces: Number = functools.reduce(operator.add, (*back.friction.values(), *back.efforts.values()), 0.0)
    return Dual(margin, np.where(margin < MARGIN, np.nan, 0.0)) if isinstance(forces, Dual) else margin


def _of_joint(measure: MotionRequest, walk: Forward) -> Number:
    return _turn_or_slide(measure, walk, walk.coordinates(measure.subject))


CURVES: dict[str, Callable[[MotionRequest, Any], Number | tuple[Number, ...]]] = {
    "point": value,
    "path_error": lambda measure, walk: tuple(_point(measure, walk).place),
    "straightness": lambda measure, walk: tuple(_point(measure, walk).place),
    # in space the axes of the link's frame, nine numbers
    "angle": lambda measure, walk: (
        tuple(number for axis in walk.motions[measure.subject].frame[:3] for number in axis)
        if isinstance(walk, SpatialWalk)
        else value(measure, walk)
    ),
    "rotation": value,
    "slide": value,
    **dict.fromkeys(("transmission_error", "stroke", "dead_centre", "time_ratio"), _of_joint),
    "rate": lambda measure, walk: _turn_or_slide(measure, walk, walk.rates(measure.subject)),
    "joint_acceleration": lambda measure, walk: _turn_or_slide(measure, walk, walk.second_rates(measure.subject)),
    "velocity": lambda measure, walk: _component(measure, _point(measure, walk).velocity),
    "acceleration": lambda measure, walk: _component(measure, _point(measure, walk).acceleration),
    "angular_velocity": lambda measure, walk: _spin(measure, walk.motions[measure.subject].twist),
    "angular_acceleration": lambda measure, walk: _spin(measure, walk.motions[measure.subject].acceleration),
    "transmission_angle": _transmission_angle,
    "pressure_angle": _pressure_at,
    "effort": lambda measure, back: back.efforts[measure.subject],
    "load": _load,
    "spring_force": lambda measure, walk: _spring(measure, walk).force,
    "spring_elongation": lambda measure, walk: _spring(measure, walk).elongation,
    "reaction": _reaction,
    "end_load": _end_load,
    "power": _power,
    "friction_power": lambda measure, back: back.losses[measure.subject],
    "friction_energy": _friction_energy,
    "efficiency": _efficiency,
    "locking_margin": _locking_margin,
    # of a motion in time, which is no course over a cycle: see `dynamics.measured`
    **dict.fromkeys(("starting_time", "steady_speed", "fluctuation", "peak_effort"), lambda measure, walk: np.nan),
}


# ---- angles without jumps: by how many whole turns those of a mechanism, in (−π, π], are off --------------------


def within(run: Run, times: Number) -> Number:
    """Times within the cycle, s, of such as may run over its end."""
    if not run.cycle.periodic or run.cycle.duration <= 0:
        return times
    real = primal(times) % run.cycle.duration
    return Dual(real, times.dual) if isinstance(times, Dual) else real


def angles(run: Run, turning: Mapping[str, MotionRequest], span: tuple[float, float]) -> dict[str, tuple[Array, Array]]:
    """Times, s, and angles of the nominal mechanism over a span, by name: integrals of their rates."""
    if not turning:
        return {}

    def look(time: Array) -> tuple[Array, NDArray[np.integer]]:
        walk = run.walk(within(run, time))
        speeds = [np.asarray(primal(rate(angle, walk)), float) for angle in turning.values()]
        return np.array(np.broadcast_arrays(*speeds, time)[:-1]), pose_status(walk, time.shape)

    knots = np.array([bend.time for bend in run.bends if bend.scan < 0])

    def firsts(times: Array) -> list[Number]:
        walk = run.walk(within(run, times))
        return [value(angle, walk) for angle in turning.values()]

    return dict(zip(turning, turned(run.cycle, look, firsts, knots, span), strict=True))


def angle_at(run: Run, angle: MotionRequest, time: Array) -> Array:
    """An angle of the nominal mechanism at times of its cycle, s, that goes on from its start."""
    key = ("angle without jumps", angle.kind, angle.subject)
    table = run.once(key, lambda: angles(run, {"": angle}, (0.0, run.cycle.duration))[""])
    return np.asarray(np.interp(time, *table))

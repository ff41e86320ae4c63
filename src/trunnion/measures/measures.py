"""Measures: numbers that follow from the motion of a mechanism, or from its forces.

`model.measure_table.MEASURES` is the vocabulary, one entry a kind, `courses.COURSES` the course of each: the one or
more numbers, position by position, that its figure is made of (`figures`).
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any, cast

import numpy as np
from pydantic import ValidationError

from trunnion.algebra import plane, space
from trunnion.algebra.dual import primal
<<<<<<< HEAD
from trunnion.algebra.namespace import Number, namespace
from trunnion.algebra.plane import Wrench
from trunnion.algebra.space import Screw
from trunnion.algebra.vector import Vector3, cross, dot
from trunnion.errors import Finding, MechanismError
from trunnion.measures import courses
from trunnion.model.checks.measures import SUBJECTS, check_measure
=======
from trunnion.algebra.namespace import Number
from trunnion.errors import Finding, MechanismError
from trunnion.measures.courses import COURSES
from trunnion.measures.motion import AXES, MOTIONS
from trunnion.model.checks.measures import check_measure
>>>>>>> w-measures
from trunnion.model.contact import motions
from trunnion.model.measure_parts import STATISTICS
from trunnion.model.measure_table import MEASURES, MeasureKind
from trunnion.model.mechanism import Mechanism
from trunnion.model.parts import Measure as Stated
from trunnion.solve.backward import Backward
from trunnion.solve.forward import Forward
from trunnion.solve.space.motion import SpatialWalk
from trunnion.solve.system import System, Values

__all__ = ["Measure", "coordinate_unit", "named", "outputs"]


@dataclass(frozen=True)
class Measure:
    """One number to watch, its figure and its limits; SI.

    kind: an entry of MEASURES; subject: link.point, link, joint, driver or load, or a word such as "cycle"; axis,
    along: which component, by a global axis or a direction; of an angle in space the axis that the link turns about.
    lower, upper: allowed signed deviations of the figure from that of the nominal mechanism; at_least, at_most: bounds
    of the figure itself.
    at, over: coordinate of the first driver, or time if `timed`; statistic: `as` of the model, "" for what the kind
    itself makes of its course (`rule`); within: the band of a dwell.
    """

    name: str
    kind: str
    subject: str
    axis: str = ""
    lower: float | None = None
    upper: float | None = None
    at_least: float | None = None
    at_most: float | None = None
    at: float | None = None
    over: tuple[float, float] | None = None
    timed: bool = False
    statistic: str = ""
    along: tuple[float, ...] = ()
    within: tuple[float, float] | None = None

    @property
    def of(self) -> MeasureKind:
        """What the table says of its kind."""
        return MEASURES[self.kind]

    @property
    def limit(self) -> float | None:
        """The deviation allowed to either side at every position; None where a limit is of one place or one figure."""
        if not self.everywhere or self.lower is None or self.upper is None:
            return None
        return max(0.0, min(-self.lower, self.upper))

    @property
    def everywhere(self) -> bool:
        """Whether it is of every position: of none place or window, and no statistic."""
        return self.at is None and self.over is None and not self.statistic

    @property
    def of_motion(self) -> bool:
        """Whether the motion alone decides it: its course takes a walk forward."""
        return not self.of.of_forces

    @property
    def of_places(self) -> bool:
        """Whether the places of the links decide it, without their speeds."""
        return self.of.needs == "places"

    @property
    def wants_margin(self) -> bool:
        """Whether the forces must be solved with `FrictionMethod(margin_up_to=MARGIN)`."""
        return self.kind == "locking_margin"

    @property
    def rule(self) -> str:
        """What makes the figure of the course: an entry of `figures.RULES`."""
        own = self.of.rule
        if own == "ratio" and self.subject != "cycle":
            own = "deviation"
        if own == "dead centre":
            return "dead centre, least" if self.statistic == "place-of-minimum" else own
        if own in ("line", "ratio", "work"):
            return own
        return self.statistic or ("value" if self.at is not None else own)

    def single(self, system: System) -> bool:
        """Whether it is by itself one number at every position, of one mechanism alone: what a sensor could show."""
        one = self.of.rule == "deviation" or (self.of.rule == "ratio" and self.subject == "instant")
        return one and not self.of.against and not self.of_attitude(system)

    def unit(self, system: System) -> str:
        """SI unit of the course."""
        both = self.of.quantities
        return both[0 if len(both) == 1 or self._turns(system) else 1].unit

    def _turns(self, system: System) -> bool:
        if self.of.of == "load on a joint":
            return system.mechanism.loads[self.subject].resisting_torque is not None
        return system.turns(self.subject)

    def figure_unit(self, system: System, values: Values) -> str:
        """SI unit of the figure: of a place that of the first driver's coordinate, s where this names no position."""
        if self.rule == "dwell":
            return "1"
        return coordinate_unit(system, values) if self.of_place else self.unit(system)

    @property
    def of_place(self) -> bool:
        """Whether the figure is a place in the cycle."""
        return self.rule.startswith(("place", "dead"))

    def turning(self, system: System) -> bool:
        """Whether the course is an angle, which may gain whole turns."""
        motion = self.coordinate(system)
        return motion.kind in MOTIONS and motion.unit(system) == "rad" and not self.of_attitude(system)

    def of_attitude(self, system: System) -> bool:
        """Whether it is the turn of a link in space from where it lies in the nominal mechanism."""
        return self.kind == "angle" and system.mechanism.space == "spatial"

    def curve(self, back: Backward | Forward) -> tuple[Number, ...]:
        """The course: one number or more, each to broadcast to (sample, position); SI, angles in (−π, π].

        back: a `Backward`, or a `Forward` where `of_motion`. Of a point its coordinates, of the efficiency of the cycle
        useful and drive power, of the angle of a link in space the three axes of its frame.
        Floats, arrays or dual numbers, as the values were.
        """
        walk = back if isinstance(back, Forward) else back.walk
        return COURSES[self.kind](self, cast(Any, back if self.of.of_forces else walk))

    def coordinate(self, system: System) -> Measure:
        """The rotation or slide of a joint that a stroke, a dead centre or a transmission error is of."""
        if len(self.of.quantities) == 1 or not self.of_places:
            return self
        return Measure(self.name, "rotation" if system.turns(self.subject) else "slide", self.subject)

    def value(self, walk: Forward) -> Number:
        """The measure of the motion, m or rad; the turn of a link in space is from where it lies without errors: 0."""
        kind = MOTIONS[self.kind]
        return kind.value_in_space(self, walk) if isinstance(walk, SpatialWalk) else kind.value(self, walk)

    def loads(self, walk: Forward) -> dict[str, Any]:
        """The unit loads by link: their power is the rate of the measure. About the link's origin, in space the global.

        They are equal and opposite on the two links of a joint.
        """
        kind = MOTIONS[self.kind]
        return kind.loads_in_space(self, walk) if isinstance(walk, SpatialWalk) else kind.loads(self, walk)

    def rate(self, walk: Forward) -> Number:
        """ẏ, by the power of the unit loads."""
        total: Number = 0.0
        for link, load in self.loads(walk).items():
            twist = walk.motions[link].twist
            if isinstance(walk, SpatialWalk):
                total = total + space.power(load, twist)
            else:
                total = total + (load.x * twist.x + load.y * twist.y + load.m * twist.w)
        return total

    def rate_of_course(self, walk: Forward) -> Number | None:
        """Rate of a course that is an angle, rad/s; None of others."""
        return self.coordinate(walk.system).rate(walk) if self.turning(walk.system) else None


<<<<<<< HEAD
@dataclass(frozen=True)
class MotionKind:
    """A number of the motion with unit loads: for the plane and for space its value and the loads that go with it."""

    value: Callable[[Measure, Forward], Number]
    loads: Callable[[Measure, Forward], dict[str, Any]]
    value_in_space: Callable[[Measure, SpatialWalk], Number]
    loads_in_space: Callable[[Measure, SpatialWalk], dict[str, Any]]


@dataclass(frozen=True)
class MeasureKind:
    """What a measure may be. unit: SI, of the course ("N m": or N, by the driver or load; "of the joint": rad or m).

    curve: the course, of a `Backward` if `of_forces` (it needs more than the places), else of a `Forward`; rule: what
    makes the figure of it where no statistic is stated; against: whether the course is compared to that of the nominal
    mechanism, position by position.
    """

    unit: str
    long_name: str
    curve: Callable[[Measure, Any], tuple[Number, ...]]
    rule: str = "deviation"
    of_forces: bool = False
    against: bool = False


# ---- in the plane ---------------------------------------------------------------------------------------------


def _coordinate(measure: Measure, walk: Any) -> Number:
    link, point = measure.subject.split(".")
    return walk.point(link, point).place[AXES.index(measure.axis)]


def _push(measure: Measure, walk: Forward) -> dict[str, Any]:
    link, point = measure.subject.split(".")
    x, y = walk.point(link, point).place
    along = (1.0, 0.0) if measure.axis == "x" else (0.0, 1.0)
    return {link: _at(walk, link, Wrench(*along, 0.0), x, y)}


def _at(walk: Forward, link: str, wrench: Wrench, x: Number, y: Number) -> Wrench:
    """A load at a place, about the origin of a link."""
    frame = walk.motions[link].frame
    return plane.about(wrench, frame.x - x, frame.y - y)


def _angle(measure: Measure, walk: Forward) -> Number:
    frame = walk.motions[measure.subject].frame
    return namespace(frame.c, frame.s).arctan2(frame.s, frame.c)


def _turn(measure: Measure, walk: Forward) -> dict[str, Any]:
    return {measure.subject: Wrench(0.0, 0.0, 1.0)}


def _rotation(measure: Measure, walk: Forward) -> Number:
    first, second = (walk.motions[link].frame for link in walk.system.joints[measure.subject][1])
    c, s = plane.turned(first.c, -first.s, second.c, second.s)
    return namespace(c, s).arctan2(s, c)


def _twist(measure: Measure, walk: Forward) -> dict[str, Any]:
    first, second = walk.system.joints[measure.subject][1]
    return {first: Wrench(0.0, 0.0, -1.0), second: Wrench(0.0, 0.0, 1.0)}


def _slide(measure: Measure, walk: Forward) -> Number:
    first, second = (walk.element(link, measure.subject) for link in walk.system.joints[measure.subject][1])
    return first.c * (second.x - first.x) + first.s * (second.y - first.y)


def _pull(measure: Measure, walk: Forward) -> dict[str, Any]:
    first, second = walk.system.joints[measure.subject][1]
    axis, at = walk.element(first, measure.subject), walk.element(second, measure.subject)
    return {
        first: _at(walk, first, Wrench(-axis.c, -axis.s, 0.0), at.x, at.y),
        second: _at(walk, second, Wrench(axis.c, axis.s, 0.0), at.x, at.y),
    }


# ---- in space -------------------------------------------------------------------------------------------------


def _unit(axis: str) -> Vector3:
    return cast(Vector3, tuple(1.0 if one == axis else 0.0 for one in AXES))


def _push_in_space(measure: Measure, walk: SpatialWalk) -> dict[str, Any]:
    link, point = measure.subject.split(".")
    return {link: space.about(_unit(measure.axis), NULL, walk.point(link, point).place)}


def _angle_in_space(measure: Measure, walk: SpatialWalk) -> Number:
    """½ Σ eᵢ⁰ × eᵢ along the axis: the rotation vector from the frame's real part, which has a derivative only."""
    frame = walk.motions[measure.subject].frame
    total: Number = 0.0
    for axis in frame[:3]:
        was = cast(Vector3, tuple(primal(n) for n in axis))
        total = total + 0.5 * dot(cross(was, axis), _unit(measure.axis))
    return total


def _turn_in_space(measure: Measure, walk: SpatialWalk) -> dict[str, Any]:
    return {measure.subject: Screw(NULL, _unit(measure.axis))}


def _both(walk: SpatialWalk, joint: str, load: Screw) -> dict[str, Any]:
    """A load on the second link of a joint and its opposite on the first."""
    first, second = walk.system.joints[joint][1]
    return {first: space.times(-1.0, load), second: load}


def _rotation_in_space(measure: Measure, walk: SpatialWalk) -> Number:
    return walk.coordinates(measure.subject)[0]


def _twist_in_space(measure: Measure, walk: SpatialWalk) -> dict[str, Any]:
    joint = measure.subject
    return _both(walk, joint, Screw(NULL, walk.element(walk.system.joints[joint][1][1], joint).z))


def _slide_in_space(measure: Measure, walk: SpatialWalk) -> Number:
    return walk.coordinates(measure.subject)[1]


def _pull_in_space(measure: Measure, walk: SpatialWalk) -> dict[str, Any]:
    joint = measure.subject
    second = walk.element(walk.system.joints[joint][1][1], joint)
    return _both(walk, joint, space.about(second.z, NULL, second.place))


MOTIONS: dict[str, MotionKind] = {
    "point": MotionKind(_coordinate, _push, _coordinate, _push_in_space),
    "angle": MotionKind(_angle, _turn, _angle_in_space, _turn_in_space),
    "rotation": MotionKind(_rotation, _twist, _rotation_in_space, _twist_in_space),
    "slide": MotionKind(_slide, _pull, _slide_in_space, _pull_in_space),
}


# ---- all kinds ------------------------------------------------------------------------------------------------


def _value(measure: Measure, walk: Forward) -> tuple[Number, ...]:
    """The number of the motion itself, or the coordinate of the joint it is about."""
    return (measure.coordinate(walk.system).value(walk),)


def _attitude(measure: Measure, walk: Forward) -> tuple[Number, ...]:
    """The angle of a link; in space the axes of its frame, nine numbers."""
    if not isinstance(walk, SpatialWalk):
        return (measure.value(walk),)
    return tuple(number for axis in walk.motions[measure.subject].frame[:3] for number in axis)


def _place(measure: Measure, walk: Forward) -> tuple[Number, ...]:
    return courses.place(measure.subject, walk)


def _effort(measure: Measure, back: Backward) -> tuple[Number, ...]:
    return courses.effort(measure.subject, back)


def _rate(measure: Measure, back: Backward) -> tuple[Number, ...]:
    return (courses.joint_rate(measure.subject, back, back.walk.system.turns(measure.subject)),)


def _load(measure: Measure, back: Backward) -> tuple[Number, ...]:
    return courses.load(measure.subject, back)


def _reaction(measure: Measure, back: Backward) -> tuple[Number, ...]:
    return courses.reaction(measure.subject, measure.axis, back)


def _efficiency(measure: Measure, back: Backward) -> tuple[Number, ...]:
    return courses.efficiency(measure.subject, back)


def _margin(measure: Measure, back: Backward) -> tuple[Number, ...]:
    return courses.locking_margin(back)


MEASURES: dict[str, MeasureKind] = {
    "point": MeasureKind("m", "coordinate of a point", _value),
    "path_error": MeasureKind("m", "distance of a point from its nominal place", _place, "maximum", against=True),
    "straightness": MeasureKind("m", "straightness of the path of a point", _place, "line"),
    "angle": MeasureKind("rad", "angle of a link", _attitude),
    "rotation": MeasureKind("rad", "rotation of a joint", _value),
    "slide": MeasureKind("m", "slide of a joint", _value),
    "transmission_error": MeasureKind(OF_JOINT, "transmission error of a joint", _value, against=True),
    "stroke": MeasureKind(OF_JOINT, "stroke of a joint", _value, "peak-to-peak"),
    "dead_centre": MeasureKind(OF_JOINT, "dead centre of a joint", _value, "dead centre"),
    "rate": MeasureKind(RATE, "speed of a joint", _rate, of_forces=True),
    "effort": MeasureKind("N m", "effort of a driver", _effort, of_forces=True),
    "load": MeasureKind("N m", "torque or force of a load on a joint", _load, of_forces=True),
    "reaction": MeasureKind("N", "reaction in a joint", _reaction, of_forces=True),
    "efficiency": MeasureKind("1", "efficiency", _efficiency, "ratio", of_forces=True),
    "locking_margin": MeasureKind("1", "locking margin", _margin, "minimum", of_forces=True),
}


=======
>>>>>>> w-measures
def coordinate_unit(system: System, values: Values) -> str:
    """Unit of what names positions: rad or m, the coordinate of the first driver if it runs one way, else s."""
    first = next(iter(system.mechanism.drivers), None)
    if first is None or not system.span(values, first).one_way:
        return "s"
    return "rad" if system.turns(first) else "m"


# ---- by name --------------------------------------------------------------------------------------------------

FORMS = "[STATISTIC:]link.point.x, angle:link, rotation:joint, slide:joint, effort:driver, load:name or KIND:NAME"


def named(mechanism: Mechanism, names: Iterable[str], values: Values) -> list[Measure]:
    """Measures by their names in the model, or written as they are.

    `link.point.x`, or KIND:NAME of the entries of MEASURES, as `rotation:joint` or `effort:driver`; of one with a
    component `reaction:joint` or `reaction:joint.x`, in space `angle:link.x`; before any of them a statistic:
    `maximum:effort:A`, `rms:link.point.x`.
    Raises MechanismError for a name that means nothing.
    """
    found, findings = [], []
    for name in dict.fromkeys(names):
        stated = mechanism.measures.get(name)
        if stated is None:
            stated = _read(name)
            findings += [] if stated is None else list(check_measure(mechanism, stated, f"--measure {name}"))
        if stated is None:
            known = f"; the model's measures are {', '.join(mechanism.measures)}" if mechanism.measures else ""
            kinds = f"; KIND: {', '.join(list(MEASURES)[1:])}; STATISTIC: {', '.join(STATISTICS)}"
            findings.append(Finding(f"'{name}' is no measure", "--measure", f"write {FORMS}{known}{kinds}"))
        else:
            found.append(_measure(name, stated, values, mechanism))
    if findings:
        raise MechanismError(findings)
    return found


def _read(text: str) -> Stated | None:
    """A measure as it is written on the command line; None if it is none."""
    head, colon, rest = text.partition(":")
    statistic: dict[str, Any] = {}
    if colon and head in STATISTICS:
        statistic, text = {"as": head}, rest
    kind, colon, subject = text.partition(":")
    data: dict[str, Any] = {}
    if colon and kind in MEASURES and kind != "point":
        data[kind] = subject
        owner, _, axis = subject.rpartition(".")
        dots = 1 if MEASURES[kind].of == "point" else 0  # a point may be called x
        if MEASURES[kind].vector and owner.count(".") == dots and owner and axis in AXES:
            data = {kind: owner, "axis": axis}
    elif not colon:
        point, _, axis = text.rpartition(".")
        if "." in point and axis in AXES:
            data = {"point": point, "axis": axis}
    try:
        return Stated(**data, **statistic) if data else None
    except ValidationError:  # such as an efficiency of something
        return None


def _measure(name: str, stated: Stated, values: Values, mechanism: Mechanism) -> Measure:
    path = f"measures.{name}"

    def number(key: str) -> float | None:
        found = values.get(f"{path}.{key}")
        return None if found is None else float(np.ravel(primal(found))[0])

    def numbers(*keys: str) -> tuple[float, ...]:
        return tuple(found for key in keys if (found := number(key)) is not None)

    over, within = numbers("over.from", "over.to"), numbers("within.from", "within.to")
    places = [f"{path}.{key}" for key in ("at", "over.from") if f"{path}.{key}" in values]
    kinds = mechanism.parameter_kinds()
    return Measure(
        name, stated.kind, stated.subject, stated.axis or "",
        number("limit.lower"), number("limit.upper"), number("at_least"), number("at_most"),
        at=number("at"),
        over=(over[0], over[1]) if over else None,
        timed=any(kinds[place].unit == "s" for place in places),
        statistic=stated.statistic or "",
        along=numbers(*(f"along.{axis}" for axis in AXES)),
        within=(within[0], within[1]) if within else None,
    )  # fmt: skip


def outputs(system: System) -> list[Measure]:
    """Rotation and slide of every joint to the ground that is not driven."""
    ground, drivers = system.mechanism.fixed_link, system.mechanism.drivers
    return [
        Measure(f"{motion}:{name}", motion, name)
        for name, (kind, links) in system.joints.items()
        if ground in links and name not in drivers
        for motion in motions(kind)
    ]

"""Measures: numbers that follow from the motion of a mechanism, or from the efforts of its drivers.

`MEASURES` is the vocabulary of what a measure of the motion may be: a coordinate of a point, the angle of a link, the
rotation or the slide of a joint. Each knows its value y at a walk and its unit loads: what does the work 1 on a unit of
y. Under them alone, the drivers at rest, the reactions say what every small displacement in a joint does to y.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any, cast

from trunnion.algebra import rigid
from trunnion.algebra.dual import primal
from trunnion.algebra.namespace import Number, namespace
from trunnion.algebra.rigid import Screw
from trunnion.algebra.space import Vector3, cross, dot
from trunnion.analysis.kinematics import Forward
from trunnion.analysis.space.motion import SpatialWalk
from trunnion.analysis.system import System, Values
from trunnion.errors import Finding, MechanismError
from trunnion.groups import planar
from trunnion.groups.planar import Wrench
from trunnion.model.check_measures import SUBJECTS, check_measure
from trunnion.model.contact import motions
from trunnion.model.mechanism import Mechanism
from trunnion.model.parts import Measure as Stated

__all__ = ["MEASURES", "Measure", "MeasureKind", "named", "outputs"]

AXES = ("x", "y", "z")
NULL: Vector3 = (0.0, 0.0, 0.0)


@dataclass(frozen=True)
class Measure:
    """One number to watch. kind: an entry of MEASURES, or "effort"; subject: link.point, link, joint or driver;
    axis: of a coordinate, or the global axis that a link in space turns about; limit: allowed deviation, SI.
    """

    name: str
    kind: str
    subject: str
    axis: str = ""
    limit: float | None = None

    @property
    def of_motion(self) -> bool:
        """Whether the motion alone decides it."""
        return self.kind in MEASURES

    def unit(self, system: System) -> str:
        """SI unit."""
        if self.of_motion:
            return MEASURES[self.kind].unit
        return "N m" if system.turns(self.subject) else "N"

    def value(self, walk: Forward) -> Number:
        """The measure of the motion, m or rad; the turn of a link in space is from where it lies without errors: 0."""
        kind = MEASURES[self.kind]
        return kind.value_in_space(self, walk) if isinstance(walk, SpatialWalk) else kind.value(self, walk)

    def loads(self, walk: Forward) -> dict[str, Any]:
        """The unit loads by link: their power is the rate of the measure. About the link's origin, in space the global.

        They are equal and opposite on the two links of a joint.
        """
        kind = MEASURES[self.kind]
        return kind.loads_in_space(self, walk) if isinstance(walk, SpatialWalk) else kind.loads(self, walk)

    def rate(self, walk: Forward) -> Number:
        """ẏ, by the power of the unit loads."""
        total: Number = 0.0
        for link, load in self.loads(walk).items():
            twist = walk.motions[link].twist
            if isinstance(walk, SpatialWalk):
                total = total + rigid.power(load, twist)
            else:
                total = total + (load.x * twist.x + load.y * twist.y + load.m * twist.w)
        return total


@dataclass(frozen=True)
class MeasureKind:
    """A number of the motion: its unit, and for the plane and for space its value and the unit loads that go with it.

    turns: whether it is an angle that may gain whole turns.
    """

    unit: str
    value: Callable[[Measure, Forward], Number]
    loads: Callable[[Measure, Forward], dict[str, Any]]
    value_in_space: Callable[[Measure, SpatialWalk], Number]
    loads_in_space: Callable[[Measure, SpatialWalk], dict[str, Any]]

    @property
    def turns(self) -> bool:
        return self.unit == "rad"


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
    return planar.about(wrench, frame.x - x, frame.y - y)


def _angle(measure: Measure, walk: Forward) -> Number:
    frame = walk.motions[measure.subject].frame
    return namespace(frame.c, frame.s).arctan2(frame.s, frame.c)


def _turn(measure: Measure, walk: Forward) -> dict[str, Any]:
    return {measure.subject: Wrench(0.0, 0.0, 1.0)}


def _rotation(measure: Measure, walk: Forward) -> Number:
    first, second = (walk.motions[link].frame for link in walk.system.joints[measure.subject][1])
    c, s = planar.turned(first.c, -first.s, second.c, second.s)
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
    return {link: rigid.about(_unit(measure.axis), NULL, walk.point(link, point).place)}


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
    return {first: rigid.times(-1.0, load), second: load}


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
    return _both(walk, joint, rigid.about(second.z, NULL, second.place))


MEASURES: dict[str, MeasureKind] = {
    "point": MeasureKind("m", _coordinate, _push, _coordinate, _push_in_space),
    "angle": MeasureKind("rad", _angle, _turn, _angle_in_space, _turn_in_space),
    "rotation": MeasureKind("rad", _rotation, _twist, _rotation_in_space, _twist_in_space),
    "slide": MeasureKind("m", _slide, _pull, _slide_in_space, _pull_in_space),
}


# ---- by name --------------------------------------------------------------------------------------------------


def named(mechanism: Mechanism, names: Iterable[str], values: Values) -> list[Measure]:
    """Measures by their names in the model, or written as they are.

    `link.point.x`, `angle:link` (in space `angle:link.x`), `rotation:joint`, `slide:joint`, `effort:driver`.
    Raises MechanismError for a name that means nothing.
    """
    found, findings = [], []
    for name in dict.fromkeys(names):
        stated = mechanism.measures.get(name)
        if stated is None:
            stated = _read(name)
            findings += [] if stated is None else list(check_measure(mechanism, stated, f"--measure {name}"))
        if stated is None:
            forms = "link.point.x, angle:link, rotation:joint, slide:joint or effort:driver"
            known = f"the model's measures are {', '.join(mechanism.measures)}" if mechanism.measures else ""
            what = f"'{name}' is no measure"
            findings.append(Finding(what, "--measure", f"write {forms}" + (f"; {known}" if known else "")))
        else:
            found.append(_measure(name, stated, values))
    if findings:
        raise MechanismError(findings)
    return found


def _read(text: str) -> Stated | None:
    """A measure as it is written on the command line; None if it is none."""
    kind, colon, subject = text.partition(":")
    data: dict[str, Any] = {}
    if colon and kind in SUBJECTS and kind != "point":
        data[kind] = subject
        link, _, axis = subject.rpartition(".")
        if kind == "angle" and link and axis in AXES:
            data = {"angle": link, "axis": axis}
    else:
        point, _, axis = text.rpartition(".")
        if "." in point and axis in AXES:
            data = {"point": point, "axis": axis}
    return Stated(**data) if data else None


def _measure(name: str, stated: Stated, values: Values) -> Measure:
    kind = next(key for key in SUBJECTS if getattr(stated, key) is not None)
    limits = [values.get(f"measures.{name}.limit.{end}") for end in ("lower", "upper")]
    stated_limits = [abs(float(one)) for one in limits if one is not None]
    return Measure(name, kind, getattr(stated, kind), stated.axis or "", min(stated_limits, default=None))


def outputs(system: System) -> list[Measure]:
    """Rotation and slide of every joint to the ground that is not driven."""
    ground, drivers = system.mechanism.fixed_link, system.mechanism.drivers
    return [
        Measure(f"{motion}:{name}", motion, name)
        for name, (kind, links) in system.joints.items()
        if ground in links and name not in drivers
        for motion in motions(kind)
    ]

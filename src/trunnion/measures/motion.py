"""Numbers of the motion that have unit loads: a coordinate of a point, an angle of a link, the motion of a joint.

A unit load does the work 1 on a unit of the number. Under these alone, the drivers at rest, the reactions say what
every small displacement in a joint does to the number.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Protocol, cast

from trunnion.algebra import plane, space
from trunnion.algebra.dual import primal
from trunnion.algebra.namespace import Number, namespace
from trunnion.algebra.plane import Wrench
from trunnion.algebra.space import Screw
from trunnion.algebra.vector import Vector3, cross, dot
from trunnion.solve.forward import Forward, SpatialWalk

__all__ = ["MOTIONS", "MotionKind", "MotionRequest", "component", "direction"]

AXES = ("x", "y", "z")
NULL: Vector3 = (0.0, 0.0, 0.0)


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


def direction(measure: MotionRequest, size: int) -> tuple[float, ...]:
    """Unit vector of the component that is asked for, of two or three numbers; empty for none: the magnitude."""
    if measure.along:
        length = sum(part * part for part in measure.along) ** 0.5
        return tuple(part / length for part in measure.along)
    return tuple(1.0 if axis == measure.axis else 0.0 for axis in AXES[:size]) if measure.axis else ()


def component(measure: MotionRequest, vector: tuple[Number, ...]) -> Number:
    """The component of a vector that is asked for, or its magnitude, which has no derivative where it is 0."""
    if measure.axis:
        return vector[AXES.index(measure.axis)]
    along = direction(measure, len(vector))
    total: Number = 0.0
    if along:
        for share, part in zip(along, vector, strict=True):
            total = total + share * part
        return total
    for part in vector:
        total = total + part * part
    return namespace(total).sqrt(total)


@dataclass(frozen=True)
class MotionKind:
    """A number of the motion with unit loads: for the plane and for space its value and the loads that go with it."""

    value: Callable[[MotionRequest, Forward], Number]
    loads: Callable[[MotionRequest, Forward], dict[str, Any]]
    value_in_space: Callable[[MotionRequest, SpatialWalk], Number]
    loads_in_space: Callable[[MotionRequest, SpatialWalk], dict[str, Any]]


# ---- in the plane ---------------------------------------------------------------------------------------------


def _coordinate(measure: MotionRequest, walk: Any) -> Number:
    link, point = measure.subject.split(".")
    return component(measure, tuple(walk.point(link, point).place))


def _push(measure: MotionRequest, walk: Forward) -> dict[str, Any]:
    link, point = measure.subject.split(".")
    x, y = walk.point(link, point).place
    along = direction(measure, 2)
    return {link: _at(walk, link, Wrench(along[0], along[1], 0.0), x, y)}


def _at(walk: Forward, link: str, wrench: Wrench, x: Number, y: Number) -> Wrench:
    """A load at a place, about the origin."""
    return plane.about(wrench[:2], wrench.m, (x, y))


def _angle(measure: MotionRequest, walk: Forward) -> Number:
    frame = walk.motions[measure.subject].frame
    return namespace(frame.c, frame.s).arctan2(frame.s, frame.c)


def _turn(measure: MotionRequest, walk: Forward) -> dict[str, Any]:
    return {measure.subject: Wrench(0.0, 0.0, 1.0)}


def _rotation(measure: MotionRequest, walk: Forward) -> Number:
    first, second = (walk.motions[link].frame for link in walk.system.joints[measure.subject][1])
    c, s = plane.turned_vector(first.c, -first.s, second.c, second.s)
    return namespace(c, s).arctan2(s, c)


def _twist(measure: MotionRequest, walk: Forward) -> dict[str, Any]:
    first, second = walk.system.joints[measure.subject][1]
    return {first: Wrench(0.0, 0.0, -1.0), second: Wrench(0.0, 0.0, 1.0)}


def _slide(measure: MotionRequest, walk: Forward) -> Number:
    first, second = (walk.element(link, measure.subject) for link in walk.system.joints[measure.subject][1])
    return first.c * (second.x - first.x) + first.s * (second.y - first.y)


def _pull(measure: MotionRequest, walk: Forward) -> dict[str, Any]:
    first, second = walk.system.joints[measure.subject][1]
    axis, at = walk.element(first, measure.subject), walk.element(second, measure.subject)
    return {
        first: _at(walk, first, Wrench(-axis.c, -axis.s, 0.0), at.x, at.y),
        second: _at(walk, second, Wrench(axis.c, axis.s, 0.0), at.x, at.y),
    }


# ---- in space -------------------------------------------------------------------------------------------------


def _push_in_space(measure: MotionRequest, walk: SpatialWalk) -> dict[str, Any]:
    link, point = measure.subject.split(".")
    return {link: space.about(cast(Vector3, direction(measure, 3)), NULL, walk.point(link, point).place)}


def _angle_in_space(measure: MotionRequest, walk: SpatialWalk) -> Number:
    """½ Σ eᵢ⁰ × eᵢ along the axis: the rotation vector from the frame's real part, which has a derivative only."""
    frame = walk.motions[measure.subject].frame
    total: Number = 0.0
    for axis in frame[:3]:
        was = cast(Vector3, tuple(primal(n) for n in axis))
        total = total + 0.5 * dot(cross(was, axis), cast(Vector3, direction(measure, 3)))
    return total


def _turn_in_space(measure: MotionRequest, walk: SpatialWalk) -> dict[str, Any]:
    return {measure.subject: Screw(NULL, cast(Vector3, direction(measure, 3)))}


def _both(walk: SpatialWalk, joint: str, load: Screw) -> dict[str, Any]:
    """A load on the second link of a joint and its opposite on the first."""
    first, second = walk.system.joints[joint][1]
    return {first: space.times(-1.0, load), second: load}


def _rotation_in_space(measure: MotionRequest, walk: SpatialWalk) -> Number:
    return walk.coordinates(measure.subject)[0]


def _twist_in_space(measure: MotionRequest, walk: SpatialWalk) -> dict[str, Any]:
    joint = measure.subject
    return _both(walk, joint, Screw(NULL, walk.element(walk.system.joints[joint][1][1], joint).z))


def _slide_in_space(measure: MotionRequest, walk: SpatialWalk) -> Number:
    return walk.coordinates(measure.subject)[1]


def _pull_in_space(measure: MotionRequest, walk: SpatialWalk) -> dict[str, Any]:
    joint = measure.subject
    second = walk.element(walk.system.joints[joint][1][1], joint)
    return _both(walk, joint, space.about(second.z, NULL, second.place))


MOTIONS: dict[str, MotionKind] = {
    "point": MotionKind(_coordinate, _push, _coordinate, _push_in_space),
    "angle": MotionKind(_angle, _turn, _angle_in_space, _turn_in_space),
    "rotation": MotionKind(_rotation, _twist, _rotation_in_space, _twist_in_space),
    "slide": MotionKind(_slide, _pull, _slide_in_space, _pull_in_space),
}

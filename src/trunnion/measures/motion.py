"""Numbers of the motion that have unit loads: a coordinate of a point, an angle of a link, the motion of a joint.

A unit load does the work 1 on a unit of the number. Under these alone, the drivers at rest, the reactions say what
every small displacement in a joint does to the number.
"""

from __future__ import annotations

from typing import Any, Protocol

from trunnion.algebra.dual import primal
from trunnion.algebra.namespace import Number, namespace
from trunnion.algebra.plane import Wrench
from trunnion.algebra.space import Screw
from trunnion.algebra.vector import Vector3, cross, dot
from trunnion.solve.forward import Forward, SpatialWalk

__all__ = ["AXES", "MOTIONS", "MotionRequest", "component", "loads", "rate", "value"]

AXES = ("x", "y", "z")
NULL: Vector3 = (0.0, 0.0, 0.0)
MOTIONS = ("point", "angle", "rotation", "slide")  # kinds of measures that are such numbers


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


def _direction(measure: MotionRequest, size: int) -> Any:
    """Unit vector of the component that is asked for, of two or three numbers; empty for none: the magnitude."""
    if measure.along:
        length = sum(part * part for part in measure.along) ** 0.5
        return tuple(part / length for part in measure.along)
    return tuple(1.0 if axis == measure.axis else 0.0 for axis in AXES[:size]) if measure.axis else ()


def component(measure: MotionRequest, vector: tuple[Number, ...]) -> Number:
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


def value(measure: MotionRequest, walk: Forward, kind: str = "") -> Number:
    """The number, m or rad. kind: of MOTIONS, that of the measure if not given.

    The turn of a link in space is that from the real part of its frame, which has a derivative only: ½ Σ eᵢ⁰ × eᵢ along
    the axis.
    """
    kind = kind or measure.kind
    if kind == "point":
        return component(measure, tuple(walk.point(*measure.subject.split(".")).place))
    if kind != "angle":
        return walk.coordinates(measure.subject)[("rotation", "slide").index(kind)]
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
        link, point = measure.subject.split(".")
        return {link: walk.algebra.about(along, none, walk.point(link, point).place)}
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

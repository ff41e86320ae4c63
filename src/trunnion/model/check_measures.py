"""Checks of measures: what they name exists and has the number that is asked for."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from trunnion.errors import Finding
from trunnion.model.contact import motions
from trunnion.model.names import nearest
from trunnion.model.parts import Measure

if TYPE_CHECKING:
    from trunnion.model.mechanism import Mechanism

__all__ = ["SUBJECTS", "check_measure", "point_exists"]

SUBJECTS = ("point", "angle", "rotation", "slide", "effort")


def check_measure(mechanism: Mechanism, measure: Measure, where: str) -> Iterator[Finding]:
    """Whether a measure has one subject that exists."""
    subjects = [key for key in SUBJECTS if getattr(measure, key) is not None]
    if len(subjects) != 1:
        found = " and ".join(subjects) or "nothing"
        yield Finding(f"measures {found}", where, f"state one of {', '.join(SUBJECTS[:-1])} or {SUBJECTS[-1]}")
    yield from _axis(mechanism, measure, where)
    if measure.point is not None:
        yield from point_exists(mechanism, measure.point, f"{where}.point")
    known = {
        "angle": ("link", list(mechanism.effective_links)),
        "rotation": ("joint", list(mechanism.effective_joints)),
        "slide": ("joint", list(mechanism.effective_joints)),
        "effort": ("driver", list(mechanism.drivers)),
    }
    for key, (noun, names) in known.items():
        name = getattr(measure, key)
        if name is not None and name not in names:
            yield Finding(f"there is no {noun} '{name}'", f"{where}.{key}", nearest(name, names))
        elif name is not None and noun == "joint":
            yield from _moves(mechanism, name, key, where)


def _axis(mechanism: Mechanism, measure: Measure, where: str) -> Iterator[Finding]:
    """Whether an axis is stated where one is needed, and there only."""
    planar = mechanism.space == "planar"
    if measure.point is not None and measure.axis is None:
        yield Finding("a point is measured along an axis", where, "write {point: link.point, axis: x}")
    if measure.angle is not None and measure.axis is None and not planar:
        what = "a link in space is not turned by one angle"
        yield Finding(what, f"{where}.angle", "measure its turn about a global axis: add axis: x, y or z")
    with_axis = measure.point is not None or (measure.angle is not None and not planar)
    if measure.axis is not None and not with_axis:
        yield Finding("the axis of a coordinate is stated, but no point", f"{where}.axis", "remove it, or name a point")
    if measure.axis == "z" and planar:
        yield Finding("there is no z in the plane", f"{where}.axis", "write x or y")


def _moves(mechanism: Mechanism, joint: str, key: str, where: str) -> Iterator[Finding]:
    """Whether a joint has the rotation or slide that is measured."""
    kind = mechanism.effective_joints[joint].type
    if key not in motions(kind):
        others = " or ".join(motions(kind))
        remedy = f"measure its {others}" if others else "measure a point, or the angle of a link"
        yield Finding(f"a {kind} joint has no {key} about one axis", f"{where}.{key}", remedy)


def point_exists(mechanism: Mechanism, name: str, where: str) -> Iterator[Finding]:
    """Whether `link.point` exists."""
    known = [f"{link}.{point}" for link, points in mechanism.points.items() for point in points]
    if name not in known:
        yield Finding(f"there is no point '{name}'", where, nearest(name, known) + " (write link.point)")

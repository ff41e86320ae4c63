"""Checks of measures: what they name exists and has the number that is asked for, where and how it is asked for."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from trunnion.errors import Finding
from trunnion.model.contact import motions
from trunnion.model.measure_parts import SUBJECTS, Measure
from trunnion.model.names import nearest
from trunnion.model.parameters import ParameterSet

if TYPE_CHECKING:
    from trunnion.model.numbers import Numbers

__all__ = ["SUBJECTS", "check_measure", "measure_values", "point_exists"]

OF_POINT = ("point", "path_error", "straightness")
OF_JOINT = ("rotation", "slide", "transmission_error", "stroke", "dead_centre", "rate", "reaction")
ENDS = ("from", "to")
PLACES = ("place-of-maximum", "place-of-minimum")


def check_measure(mechanism: Numbers, measure: Measure, where: str) -> Iterator[Finding]:
    """Whether a measure has one subject that exists, and is taken where and as it can be."""
    subjects = [key for key in SUBJECTS if getattr(measure, key) is not None]
    if len(subjects) != 1:
        found = " and ".join(subjects) or "nothing"
        yield Finding(f"measures {found}", where, f"state one of {', '.join(SUBJECTS[:-1])} or {SUBJECTS[-1]}")
    yield from _axis(mechanism, measure, where)
    for key in OF_POINT:
        name = getattr(measure, key)
        if name is not None:
            yield from point_exists(mechanism, name, f"{where}.{key}")
    joints = list(mechanism.effective_joints)
    known = {
        "angle": ("link", list(mechanism.effective_links)),
        **dict.fromkeys(OF_JOINT, ("joint", joints)),
        "effort": ("driver", list(mechanism.drivers)),
        "load": ("load on a joint", [one for one, load in mechanism.loads.items() if load.joint is not None]),
    }
    for key, (noun, names) in known.items():
        name = getattr(measure, key)
        if name is not None and name not in names:
            yield Finding(f"there is no {noun} '{name}'", f"{where}.{key}", nearest(name, names))
        elif name is not None and noun == "joint":
            yield from _moves(mechanism, name, key, where)
    yield from _taken(mechanism, measure, where)


def _axis(mechanism: Numbers, measure: Measure, where: str) -> Iterator[Finding]:
    """Whether an axis is stated where one is needed, and there only."""
    planar = mechanism.space == "planar"
    if measure.point is not None and measure.axis is None:
        yield Finding("a point is measured along an axis", where, "write {point: link.point, axis: x}")
    if measure.angle is not None and measure.axis is None and not planar:
        what = "a link in space is not turned by one angle"
        yield Finding(what, f"{where}.angle", "measure its turn about a global axis: add axis: x, y or z")
    turns = measure.angle is not None and not planar
    with_axis = measure.point is not None or measure.reaction is not None or turns
    if measure.axis is not None and not with_axis:
        what = "the axis of a coordinate is stated, but no point and no reaction"
        yield Finding(what, f"{where}.axis", "remove it, or name a point")
    if measure.axis == "z" and planar:
        yield Finding("there is no z in the plane", f"{where}.axis", "write x or y")


def _moves(mechanism: Numbers, joint: str, key: str, where: str) -> Iterator[Finding]:
    """Whether a joint has the motion that is measured."""
    kind = mechanism.effective_joints[joint].type
    if key == "reaction" or key in motions(kind) or (key not in ("rotation", "slide") and motions(kind)):
        return
    others = " or ".join(motions(kind))
    remedy = f"measure its {others}" if others else "measure a point, or the angle of a link"
    missing = key if key in ("rotation", "slide") else "rotation or slide"
    yield Finding(f"a {kind} joint has no {missing} about one axis", f"{where}.{key}", remedy)


def _taken(mechanism: Numbers, measure: Measure, where: str) -> Iterator[Finding]:
    """Whether the position, the range and the figure that are asked for go together."""
    figure, subject = measure.statistic, measure.subject
    if measure.at is not None and measure.over is not None:
        yield Finding("is taken at a position and over a range", where, "keep at: … or over: …")
    if (measure.at is not None or measure.over is not None) and not mechanism.drivers:
        key = "at" if measure.at is not None else "over"
        what = "there is no driver whose coordinate it could be: the mechanism has one position"
        yield Finding(what, f"{where}.{key}", "remove it")
    if measure.reduced:
        whole = f"{subject}: {measure.efficiency}" if subject == "efficiency" else subject
        if measure.at is not None:
            yield Finding(f"the {whole} is of a range, not of a position", f"{where}.at", "remove it, or say over: […]")
        if figure is not None and not (subject == "dead_centre" and figure in PLACES):
            remedy = "remove it" if subject != "dead_centre" else f"write {' or '.join(PLACES)}"
            yield Finding(f"the {whole} is one number of a range already", f"{where}.as", remedy)
        if measure.efficiency == "cycle" and measure.over is not None:
            yield Finding("the efficiency of the cycle is over all of it", f"{where}.over", "remove it")
    elif measure.at is not None and figure not in (None, "value"):
        what = f"the {figure} is of a range, not of a position"
        yield Finding(what, f"{where}.as", "remove it, or say over: [0 deg, 90 deg] instead of at")
    elif measure.at is None and figure == "value":
        yield Finding("a value is that at a position", f"{where}.as", "add at: 60 deg, or remove it")


def measure_values(mechanism: Numbers, numbers: ParameterSet) -> Iterator[Finding]:
    """Whether limits and ranges of measures have an extent; nan passes every check."""
    for name in mechanism.measures:
        where = f"measures.{name}"

        def value(path: str, before: str = where) -> float:
            return float(numbers.nominal.get(f"{before}.{path}", np.nan))

        lower, upper = value("limit.lower"), value("limit.upper")
        if lower > upper:
            what = f"the lower limit {lower:g} is above the upper one {upper:g} (SI)"
            yield Finding(what, f"{where}.limit", "write ± before a number that is not negative")
        least, most = value("at_least"), value("at_most")
        if least > most:
            yield Finding(f"at least {least:g} and at most {most:g} (SI)", f"{where}.at_least", "exchange them")
        start, end = value("over.from"), value("over.to")
        kinds = {one.kind.name for key, one in numbers.entries.items() if key.startswith(f"{where}.over.")}
        if len(kinds) > 1:
            what = (
                f"the range runs from {' to '.join(numbers.entries[f'{where}.over.{one}'].kind.name for one in ENDS)}"
            )
            yield Finding(what, f"{where}.over", "give two coordinates of the first driver, or two times")
        elif start == end:
            yield Finding(f"the range begins and ends at {start:g}", f"{where}.over", "give it an extent, or say at: …")


def point_exists(mechanism: Numbers, name: str, where: str) -> Iterator[Finding]:
    """Whether `link.point` exists."""
    known = [f"{link}.{point}" for link, points in mechanism.points.items() for point in points]
    if name not in known:
        yield Finding(f"there is no point '{name}'", where, nearest(name, known) + " (write link.point)")

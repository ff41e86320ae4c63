"""Checks of measures: what they name exists and has the number that is asked for, where and how it is asked for."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from trunnion.errors import Finding
from trunnion.model.joint_parts import motions
from trunnion.model.measure_kinds import expression_findings
from trunnion.model.measure_table import MEASURES, Measure
from trunnion.model.parameters import Numbers, ParameterSet
from trunnion.model.rules import Refers

__all__ = ["check_measure", "measure_values"]

ENDS = ("from", "to")
PLACES = ("place-of-maximum", "place-of-minimum")


def check_measure(mechanism: Numbers, measure: Measure, where: str) -> Iterator[Finding]:
    """Whether a measure has one subject that exists, and is taken where and as it can be."""
    if len(measure.kinds) != 1:
        kinds, names = " and ".join(measure.kinds) or "nothing", list(MEASURES)
        yield Finding(f"measures {kinds}", where, f"state one of {', '.join(names[:-1])} or {names[-1]}")
    for key in measure.kinds:
        yield from _subject(mechanism, measure, key, where)
    yield from _component(mechanism, measure, where)
    yield from _taken(mechanism, measure, where)


def _subject(mechanism: Numbers, measure: Measure, key: str, where: str) -> Iterator[Finding]:
    """Whether what is measured exists, and has it."""
    name = getattr(measure, key)
    kind = MEASURES[key]
    if key == "expression":
        yield from expression_findings(mechanism, measure, f"{where}.{key}")
        return
    if kind.space not in ("", mechanism.space):
        yield Finding(f"there is no {key} in space", f"{where}.{key}", "measure an angle or a rotation")
    if not isinstance(kind.of, tuple):
        subject = "any joint" if kind.of == "joint" else kind.of
        yield from Refers(subject).missing(name, f"{where}.{key}", mechanism)
        if kind.of == "joint" and name in mechanism.effective_joints:
            yield from _moves(mechanism, name, key, where)
        if key == "end_load" and name in mechanism.effective_joints:
            yield from _has_ends(mechanism, name, where)


def _has_ends(mechanism: Numbers, name: str, where: str) -> Iterator[Finding]:
    """Whether a joint has a bearing or a guide of a stated length; a pin in the plane bears its load in its middle."""
    joint = mechanism.effective_joints[name]
    guide = joint.guide.length if joint.guide else None
    bearing = (joint.pin.bearing or joint.pin.length) if joint.pin and mechanism.space == "spatial" else None
    if guide is None and bearing is None:
        what = f"the joint '{name}' has no ends: it states no length of a bearing or guide"
        plane = "in the plane only guides have ends; " if mechanism.space == "planar" else ""
        yield Finding(what, f"{where}.end_load", f"{plane}add guide: {{length: …}} or pin: {{bearing: …}}")


def _component(mechanism: Numbers, measure: Measure, where: str) -> Iterator[Finding]:
    """Whether an axis or a direction is stated where one is needed, once, and there only."""
    words = {MEASURES[key].vector_in(mechanism.space) for key in measure.kinds}
    keys = [key for key in ("axis", "along") if getattr(measure, key) is not None]
    if "must" in words and not keys:
        if measure.kind == "point":
            yield Finding("a point is measured along an axis", where, "write {point: link.point, axis: x}")
        else:
            what = "a link in space is not turned by one angle"
            yield Finding(what, f"{where}.angle", "measure its turn about a global axis: add axis: x, y or z")
    if keys and not words - {""}:
        what = "the axis of a coordinate is stated, but no point and no reaction"
        yield Finding(what, f"{where}.{keys[0]}", "remove it, or name a point")
    if len(keys) > 1 or ("along" in keys and measure.kind == "angle"):
        yield Finding("has an axis and a direction", f"{where}.along", "keep one of them; an angle needs an axis")
    if measure.axis == "z" and mechanism.space == "planar":
        yield Finding("there is no z in the plane", f"{where}.axis", "write x or y")


def _moves(mechanism: Numbers, joint: str, key: str, where: str) -> Iterator[Finding]:
    """Whether a joint has the motion that is measured."""
    kind = mechanism.effective_joints[joint].type
    if key in motions(kind) or (key not in ("rotation", "slide") and motions(kind)):
        return
    others = " or ".join(motions(kind))
    remedy = f"measure its {others}" if others else "measure a point, or the angle of a link"
    missing = key if key in ("rotation", "slide") else "rotation or slide"
    yield Finding(f"a {kind} joint has no {missing} about one axis", f"{where}.{key}", remedy)


def _band(measure: Measure, where: str) -> Iterator[Finding]:
    """Whether a dwell has a band, and nothing else has."""
    if measure.statistic == "dwell" and measure.within is None:
        yield Finding("a dwell is within a band", where, "add within: [10 mm, 12 mm]")
    elif measure.statistic != "dwell" and measure.within is not None:
        yield Finding("a band is stated, but no dwell", f"{where}.within", "add as: dwell, or remove it")


def _taken(mechanism: Numbers, measure: Measure, where: str) -> Iterator[Finding]:
    """Whether the position, the range and the figure that are asked for go together."""
    figure, subject = measure.statistic, measure.kind
    yield from _band(measure, where)
    in_time = bool(measure.kind) and MEASURES[measure.kind].in_time
    if measure.duration is not None and not in_time:
        yield Finding("a duration is of a motion in time", f"{where}.duration", "remove it")
    if in_time and measure.over is not None:
        yield Finding(f"the {subject} is of the whole motion", f"{where}.over", "remove it, or state a duration")
    if measure.at is not None and measure.over is not None:
        yield Finding("states both a position and a range", where, "keep at: … or over: …")
    if (measure.at is not None or measure.over is not None) and not mechanism.drivers:
        key = "at" if measure.at is not None else "over"
        what = "there is no driver whose coordinate it could be: the mechanism has one position"
        yield Finding(what, f"{where}.{key}", "remove it")
    if measure.reduced:
        subject_text = f"{subject}: {measure.subject}" if measure.subject == "cycle" else subject
        all_of_it = measure.subject == "cycle" or subject == "time_ratio"
        if measure.at is not None:
            remedy = "remove it" if all_of_it else "remove it, or state over: […]"
            yield Finding(f"the {subject_text} is of a range, not of a position", f"{where}.at", remedy)
        if figure is not None and not (subject == "dead_centre" and figure in PLACES):
            remedy = "remove it" if subject != "dead_centre" else f"write {' or '.join(PLACES)}"
            yield Finding(f"the {subject_text} is one number of a range already", f"{where}.as", remedy)
        if all_of_it and measure.over is not None:
            yield Finding(
                f"the {subject_text.replace(': ', ' of the ')} is over all of it", f"{where}.over", "remove it"
            )
    elif measure.at is not None and figure not in (None, "value"):
        what = f"the {figure} is of a range, not of a position"
        yield Finding(what, f"{where}.as", "remove it, or state over: [0 deg, 90 deg] instead of at")
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
        low, high = value("within.from"), value("within.to")
        if low >= high:
            yield Finding(f"the band runs from {low:g} to {high:g} (SI)", f"{where}.within", "exchange its ends")
        kind = mechanism.measures[name].kind
        up_to = MEASURES[kind].up_to if kind else np.inf
        for key in ("at_least", "at_most", "within.to"):
            if value(key) >= up_to:
                what = f"is {value(key):g}, but this measure is looked for up to {up_to:g} alone"
                yield Finding(what, f"{where}.{key}", "give a number below that")
        start, end = value("over.from"), value("over.to")
        kinds = {item.kind.name for key, item in numbers.entries.items() if key.startswith(f"{where}.over.")}
        if len(kinds) > 1:
            what = (
                f"the range runs from {' to '.join(numbers.entries[f'{where}.over.{item}'].kind.name for item in ENDS)}"
            )
            yield Finding(what, f"{where}.over", "give two coordinates of the first driver, or two times")
        elif start == end:
            yield Finding(
                f"the range begins and ends at {start:g}", f"{where}.over", "give it an extent, or state at: …"
            )

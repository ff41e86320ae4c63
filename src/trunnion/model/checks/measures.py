"""Checks of measures: what they name exists and has the number that is asked for, where and how it is asked for."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from trunnion.errors import Finding
from trunnion.model.joint_parts import motions
from trunnion.model.measure_table import MEASURES, Measure
from trunnion.model.measure_units import expression_findings
from trunnion.model.parameters import Numbers, ParameterSet
from trunnion.model.rules import Refers, stated_wrongly

__all__ = ["check_measure", "measure_values"]

ENDS = ("from", "to")
PLACES = ("place-of-maximum", "place-of-minimum")


def check_measure(mechanism: Numbers, measure: Measure, where: str) -> Iterator[Finding]:
    """Whether a measure has one subject that exists, and is taken where and as it can be."""
    if len(measure.kinds) != 1:
        kinds, names = " and ".join(measure.kinds) or "nothing", list(MEASURES)
        yield Finding(f"measures {kinds}", where, f"state one of {', '.join(names[:-1])} or {names[-1]}")
        return
    key, kind, name = measure.kind, MEASURES[measure.kind], measure.subject
    at = f"{where}.{key}"
    joint = mechanism.effective_joints.get(name)
    if key == "expression":
        yield from expression_findings(mechanism, measure, at)
    elif kind.space not in ("", mechanism.space):
        yield Finding(f"there is no {key} in space", at, "measure an angle or a rotation")
    elif not isinstance(kind.of, tuple):
        yield from Refers("any joint" if kind.of == "joint" else kind.of).missing(name, at, mechanism)
    if kind.of == "joint" and joint is not None:
        moves = motions(joint.type)
        missing = key if key in ("rotation", "slide") else "" if moves else "rotation or slide"
        if missing and missing not in moves:
            remedy = f"measure its {moves[0]}" if moves else "measure a point, or the angle of a link"
            yield Finding(f"a {joint.type} joint has no {missing} about one axis", at, remedy)
    if key == "end_load" and joint is not None:
        long = joint.pin is not None and (joint.pin.bearing or joint.pin.length) and mechanism.space == "spatial"
        if not long and not (joint.guide and joint.guide.length):  # a pin in the plane bears its load in its middle
            what = f"the joint '{name}' has no ends: it states no length of a guide, or in space of a bearing"
            yield Finding(what, at, "add guide: {length: …} or pin: {bearing: …}")
    yield from _component(mechanism, measure, where)
    yield from _taken(mechanism, measure, where)


def _component(mechanism: Numbers, measure: Measure, where: str) -> Iterator[Finding]:
    """Whether an axis or a direction is stated where one is needed, once, and there only."""
    word = MEASURES[measure.kind].vector_in(mechanism.space)
    axis, along, of_angle = measure.axis is not None, measure.along is not None, measure.kind == "angle"
    what = "a link in space is not turned by one angle" if of_angle else "a point is measured along an axis"
    yield from stated_wrongly(
        (word == "must" and not axis and not along, what, f"{where}.{measure.kind}", "add axis: x, y or z"),
        ((axis or along) and not word, "the axis of a coordinate is stated, but no point and no reaction",
         f"{where}.{'axis' if axis else 'along'}", "remove it, or name a point"),
        (along and (axis or of_angle), "has an axis and a direction", f"{where}.along",
         "keep one of them; an angle needs an axis"),
        (measure.axis == "z" and mechanism.space == "planar", "there is no z in the plane", f"{where}.axis",
         "write x or y"),
    )  # fmt: skip


def _taken(mechanism: Numbers, measure: Measure, where: str) -> Iterator[Finding]:
    """Whether the position, the range and the figure that are asked for go together."""
    figure, subject, in_time = measure.statistic, measure.kind, MEASURES[measure.kind].in_time
    at, over, dwell = measure.at is not None, measure.over is not None, figure == "dwell"
    whole = in_time or measure.subject == "cycle" or subject == "time_ratio"
    placed = subject == "dead_centre" and figure in PLACES
    yield from stated_wrongly(
        (dwell and measure.within is None, "a dwell is within a band", where, "add within: [10 mm, 12 mm]"),
        (not dwell and measure.within is not None, "a band is stated, but no dwell", f"{where}.within",
         "add as: dwell, or remove it"),
        (measure.duration is not None and not in_time, "a duration is of a motion in time", f"{where}.duration",
         "remove it"),
        (at and over, "states both a position and a range", where, "keep at: … or over: …"),
        ((at or over) and not mechanism.drivers,
         "there is no driver whose coordinate it could be: the mechanism has one position",
         f"{where}.{'at' if at else 'over'}", "remove it"),
        (over and whole, f"the {subject} is over all of it", f"{where}.over", "remove it, or state a duration"),
        (at and measure.reduced, f"the {subject} is of a range, not of a position", f"{where}.at",
         "remove it, or state over: […]"),
        (figure is not None and measure.reduced and not placed, f"the {subject} is one number of a range already",
         f"{where}.as", f"remove it; of a dead_centre write {' or '.join(PLACES)}"),
        (at and not measure.reduced and figure not in (None, "value"),
         f"the {figure} is of a range, not of a position", f"{where}.as",
         "remove it, or state over: [0 deg, 90 deg] instead of at"),
        (not at and not measure.reduced and figure == "value", "a value is that at a position", f"{where}.as",
         "add at: 60 deg, or remove it"),
    )  # fmt: skip


def measure_values(mechanism: Numbers, numbers: ParameterSet) -> Iterator[Finding]:
    """Whether limits and ranges of measures have an extent; nan passes every check."""
    for name, measure in mechanism.measures.items():
        where, up_to = f"measures.{name}", MEASURES[measure.kind].up_to

        def value(path: str, before: str = where) -> float:
            return float(numbers.nominal.get(f"{before}.{path}", np.nan))

        ends = [numbers.entries[f"{where}.over.{end}"].kind.name for end in ENDS] if measure.over else ["", ""]
        lower, upper, least, most, low, high, start, end = (
            value(path) for path in ("limit.lower", "limit.upper", "at_least", "at_most", "within.from", "within.to",
                                     "over.from", "over.to")
        )  # fmt: skip
        yield from stated_wrongly(
            (lower > upper, f"the lower limit {lower:g} is above the upper one {upper:g} (SI)", f"{where}.limit",
             "write ± before a number that is not negative"),
            (least > most, f"at least {least:g} and at most {most:g} (SI)", f"{where}.at_least", "exchange them"),
            (low >= high, f"the band runs from {low:g} to {high:g} (SI)", f"{where}.within", "exchange its ends"),
            *((value(key) >= up_to, f"is {value(key):g}, but this measure is looked for up to {up_to:g} alone",
               f"{where}.{key}", "give a number below that") for key in ("at_least", "at_most", "within.to")),
            (ends[0] != ends[1], f"the range runs from {ends[0]} to {ends[1]}", f"{where}.over",
             "give two coordinates of the first driver, or two times"),
            (start == end and ends[0] == ends[1], f"the range begins and ends at {start:g}", f"{where}.over",
             "give it an extent, or state at: …"),
        )  # fmt: skip

"""Checks of measures: what they name exists and has the number that is asked for, where and how it is asked for."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from trunnion.errors import Finding
from trunnion.model.joint_parts import motions
from trunnion.model.measure_table import MEASURES, Measure
from trunnion.model.measure_units import expression_findings
from trunnion.model.parameters import Numbers, ParameterSet
from trunnion.model.rules import Refers, faults

__all__ = ["check_measure", "measure_values"]

PLACES = ("place-of-maximum", "place-of-minimum")


def check_measure(mechanism: Numbers, measure: Measure, where: str) -> Iterator[Finding]:
    """Whether a measure has one subject that exists, and is taken where and as it can be."""
    if len(measure.kinds) != 1:
        return  # a finding of its own
    key, kind, name = measure.kind, MEASURES[measure.kind], measure.subject
    joint = mechanism.effective_joints.get(name)
    if key == "expression":
        yield from expression_findings(mechanism, measure, f"{where}.{key}")
    elif kind.space not in ("", mechanism.space):
        yield Finding(f"there is no {key} in space", f"{where}.{key}")
    elif not isinstance(kind.of, tuple):
        yield from Refers("any joint" if kind.of == "joint" else kind.of).missing(name, f"{where}.{key}", mechanism)
    moves = motions(joint.type) if joint is not None and kind.of == "joint" else ()
    motion = key if key in ("rotation", "slide") else "rotation or slide"
    guide, pin = (joint.guide, joint.pin) if joint else (None, None)  # in the plane a pin bears its load in its middle
    long = (guide and guide.length) or (mechanism.space == "spatial" and pin and (pin.bearing or pin.length))
    word = kind.vector_in(mechanism.space)
    axis, along, of_angle = measure.axis is not None, measure.along is not None, key == "angle"
    figure, at, over = measure.statistic, measure.at is not None, measure.over is not None
    dwell, lasting = figure == "dwell", kind.in_time or name == "cycle" or key == "time_ratio"
    placed, reduced = key == "dead_centre" and figure in PLACES, measure.reduced
    yield from faults(
        where,
        (joint and kind.of == "joint" and (motion not in moves if key in ("rotation", "slide") else not moves), key,
         f"a {joint and joint.type} joint has no {motion} about one axis",
         f"measure its {moves[0]}" if moves else "measure a point, or the angle of a link"),
        (key == "end_load" and joint and not long, key,
         f"the joint '{name}' has no ends: it states no length of a guide, or in space of a bearing"),
        # the component
        (word == "must" and not axis and not along, key,
         "a link in space is not turned by one angle" if of_angle else "a point is measured along an axis",
         "add axis: x, y or z"),
        ((axis or along) and not word, "axis" if axis else "along",
         "the axis of a coordinate is stated, but no point and no reaction"),
        (along and of_angle, "along", "is a direction, and an angle needs an axis"),
        (measure.axis == "z" and mechanism.space == "planar", "axis", "there is no z in the plane"),
        # where and how it is taken
        (dwell == (measure.within is None), "within", "a dwell is within a band, and only that",
         "state as: dwell with within: [10 mm, 12 mm]"),
        (measure.duration is not None and not kind.in_time, "duration", "a duration is of a motion in time"),
        ((at or over) and not mechanism.drivers, "at" if at else "over",
         "there is no driver whose coordinate it could be: the mechanism has one position"),
        (over and lasting, "over", f"the {key} is over all of it"),
        (reduced and (at or (figure is not None and not placed)), "at" if at else "as",
         f"the {key} is one number of a range already", f"remove it; of a dead_centre write {' or '.join(PLACES)}"),
        (not reduced and figure is not None and at != (figure == "value"), "as",
         f"the {figure} is {'of a range, not of' if at else 'that at'} a position", "state over: or at: …"),
    )  # fmt: skip


def measure_values(mechanism: Numbers, numbers: ParameterSet) -> Iterator[Finding]:
    """Whether limits and ranges of measures have an extent; nan passes every check."""
    for name, measure in mechanism.measures.items():
        where, up_to = f"measures.{name}", MEASURES[measure.kind].up_to
        keys = ("limit.lower", "limit.upper", "at_least", "at_most", "within.from", "within.to", "over.from", "over.to")
        value = {key: float(numbers.nominal.get(f"{where}.{key}", np.nan)) for key in keys}
        lower, upper, least, most, low, high, start, end = value.values()
        first, last = (
            (numbers.entries[f"{where}.over.{end}"].kind.name if measure.over else "") for end in ("from", "to")
        )
        yield from faults(
            where,
            (lower > upper, "limit", f"the lower limit {lower:g} is above the upper one {upper:g} (SI)",
             "write ± before a number that is not negative"),
            (least > most, "at_least", f"at least {least:g} and at most {most:g} (SI)"),
            (low >= high, "within", f"the band runs from {low:g} to {high:g} (SI)"),
            *((value[key] >= up_to, key, f"is {value[key]:g}, but this measure is looked for up to {up_to:g} alone")
              for key in ("at_least", "at_most", "within.to")),
            (first != last, "over", f"the range runs from {first} to {last}"),
            (start == end and first == last, "over", f"the range begins and ends at {start:g}", "or state at: …"),
        )  # fmt: skip

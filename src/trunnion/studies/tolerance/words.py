"""What measures, and the courses that their figures are made of, are in words."""

from __future__ import annotations

import math

from trunnion.measures.measures import Measure
from trunnion.solve.system import System

__all__ = ["course_text", "text_of"]


def text_of(measure: Measure, system: System) -> str:
    """What a measure is: "coordinate of point ram.Q, y at 270° of O"."""
    kind = measure.of.long_name.replace(" a ", " ")
    whole = measure.subject in ("mechanism", "cycle", "instant")
    subject = f" ({measure.subject})" if whole else f" {measure.subject}"
    axis = f", {measure.axis}" if measure.axis else ""
    rule = {
        "deviation": ", largest deviation from nominal", "value": "", "line": "", "ratio": "", "work": "",
        "dead centre": "", "dead centre, least": " (least)",
    }.get(measure.rule, f", {measure.rule.replace('-', ' ')}")  # fmt: skip
    own = measure.of.rule == measure.rule and measure.rule != "deviation"
    return f"{kind}{subject}{axis}{'' if own else rule}{_where(measure, system)}"


def course_text(measure: Measure, system: System) -> str:
    """What the course is, position by position: "slide of S", also of the stroke and of the dead centre of S."""
    about, along = (f" {word} {measure.axis}" if measure.axis else "" for word in ("about", "along"))
    kind = measure.coordinate(system).kind
    return {
        "point": f"{measure.axis} of {measure.subject}",
        "path_error": f"distance of {measure.subject} from its nominal place",
        "straightness": f"distance of {measure.subject} from the line through its path",
        "angle": f"angle of {measure.subject}{about}",
        "reaction": f"reaction in {measure.subject}{along}",
        "efficiency": "efficiency of the instant",
        "locking_margin": "locking margin",
    }.get(measure.kind, f"{kind} of {measure.subject}")


def _where(measure: Measure, system: System) -> str:
    """The place at which, or the range over which, a measure is taken; empty if it is the whole cycle."""
    if measure.at is not None:
        return f" at {_place(measure, system, measure.at)}{_driver(measure, system)}"
    if measure.over is not None:
        first, last = (_place(measure, system, end) for end in measure.over)
        return f" over {first} to {last}{_driver(measure, system)}"
    return ""


def _driver(measure: Measure, system: System) -> str:
    first = next(iter(system.mechanism.drivers), "")
    return f" of {first}" if first and not measure.timed else ""


def _place(measure: Measure, system: System, place: float) -> str:
    """A coordinate of the first driver, or a time, in the unit in which places are told."""
    first = next(iter(system.mechanism.drivers), "")
    if measure.timed or not first:
        return f"{place:.6g} s".replace("-", "−")
    turns = system.turns(first)
    text = f"{math.degrees(place) if turns else 1e3 * place:.6g}".replace("-", "−")
    return f"{text}{'°' if turns else ' mm'}"

"""What a measure measures, and in what its position is stated."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import suppress
from typing import TYPE_CHECKING

from trunnion.model.expression import MOTION, PLACED, RESERVED
from trunnion.model.joint_parts import freedoms
from trunnion.model.measure_table import MEASURES, Measure
from trunnion.model.quantity import Quantity
from trunnion.model.units import ANY, KINDS, Dimension, Kind, UnitError

if TYPE_CHECKING:
    from trunnion.model.fields import Fields

__all__ = ["course_kind", "drive_kind", "figure_kind", "is_place", "place_kind", "placed_measures"]


def drive_kind(mechanism: Fields) -> Kind:
    """What the coordinate of the first driver measures."""
    joint = mechanism.effective_joints.get(next(iter(mechanism.drivers), ""))
    return KINDS["length" if joint and "rotation" not in freedoms(joint.type) else "angle"]


def is_place(measure: Measure) -> bool:
    """Whether a measure gives a position: a dead centre, or where something is largest or smallest."""
    return (measure.statistic or "").startswith("place-of-") or measure.kind == "dead_centre"


def figure_kind(mechanism: Fields, measure: Measure) -> Kind:
    """What a measure gives: of a joint with two motions the rotation, of a place the drive coordinate.

    A driver that does not run one way passes a coordinate twice: its places are times, which `place_kind` tells.
    """
    if is_place(measure):
        return drive_kind(mechanism)
    if measure.statistic == "dwell" or measure.kind == "time_ratio":
        return KINDS["number"]
    return course_kind(mechanism, measure)


def course_kind(mechanism: Fields, measure: Measure) -> Kind:
    """What a measure is at every position; of a joint with two motions the rotation."""
    if not measure.kind:  # a finding of its own
        return ANY
    both = MEASURES[measure.kind].quantities
    return both[-1 if slides(mechanism, measure) else 0]


def slides(mechanism: Fields, measure: Measure) -> bool:
    """Whether the joint, driver, load or spring that a measure is of slides and does not turn."""
    load = mechanism.loads.get(measure.subject)
    if MEASURES[measure.kind].of == "load on a joint":
        return load is None or load.resisting_torque is None
    name: str | None = measure.subject
    if MEASURES[measure.kind].of == "spring":
        spring = mechanism.springs.get(measure.subject)
        name = spring.joint if spring else None
        if name is None:  # between two points
            return True
    joint = mechanism.effective_joints.get(name or "")
    return joint is not None and "rotation" not in freedoms(joint.type)


def place_kind(mechanism: Fields, quantity: Quantity, dimensions: Mapping[str, Dimension | None]) -> Kind:
    """A time if it is stated as one, else the coordinate of the first driver. dimensions: of the names in it."""
    with suppress(UnitError, KeyError):  # findings of their own
        if quantity.check(dimensions) in KINDS["time"].dimensions:
            return KINDS["time"]
    return drive_kind(mechanism)


def placed_measures(mechanism: Fields) -> dict[str, str]:
    """Measures that are a place or a speed at every position, by the names that a load has for these."""
    others = {*RESERVED, *MOTION, *mechanism.tables, *mechanism.dimensions}
    found = {name: _placed(mechanism, one) for name, one in mechanism.measures.items() if name not in others}
    return {name: placed for name, placed in found.items() if placed}


def _placed(mechanism: Fields, measure: Measure) -> str:
    if measure.at is not None or measure.over is not None or measure.statistic or measure.along:
        return ""
    joint = mechanism.effective_joints.get(measure.subject)
    if measure.kind in ("rotation", "slide"):
        return f"{measure.subject}{PLACED}{measure.kind}"
    if measure.kind == "rate" and joint is not None:
        freedom = "rotation" if "rotation" in freedoms(joint.type) else "slide"
        return f"{measure.subject}{PLACED}{freedom}_velocity"
    component = {"point": "", "velocity": "velocity_"}.get(measure.kind)
    return f"{measure.subject}{PLACED}{component}{measure.axis}" if component is not None and measure.axis else ""

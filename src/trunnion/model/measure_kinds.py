"""What a measure measures, and in what its position is stated."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import suppress
from typing import TYPE_CHECKING

from trunnion.model.contact import motions
from trunnion.model.joint_parts import freedoms
from trunnion.model.measure_parts import Measure
from trunnion.model.quantity import Quantity
from trunnion.model.units import KINDS, Dimension, Kind, UnitError

if TYPE_CHECKING:
    from trunnion.model.fields import Fields

__all__ = ["drive_kind", "figure_kind", "is_place", "place_kind"]

_OF_SUBJECT = {
    "point": "length",
    "path_error": "length",
    "straightness": "length",
    "angle": "angle",
    "rotation": "angle",
    "slide": "length",
    "reaction": "force",
    "efficiency": "number",
    "locking_margin": "number",
}


def drive_kind(mechanism: Fields) -> Kind:
    """What the coordinate of the first driver measures."""
    joint = mechanism.effective_joints.get(next(iter(mechanism.drivers), ""))
    return KINDS["length" if joint and "rotation" not in freedoms(joint.type) else "angle"]


def is_place(measure: Measure) -> bool:
    """Whether a measure gives a position: a dead centre, or where something is largest or smallest."""
    return (measure.statistic or "").startswith("place-of-") or measure.subject == "dead_centre"


def figure_kind(mechanism: Fields, measure: Measure) -> Kind:
    """What a measure gives: of a joint with two motions the rotation, of a place the drive coordinate.

    A driver that does not run one way passes a coordinate twice: its places are times, which `place_kind` tells.
    """
    if is_place(measure):
        return drive_kind(mechanism)
    known = _OF_SUBJECT.get(measure.subject)
    if known:
        return KINDS[known]
    name = getattr(measure, measure.subject) if measure.subject else ""
    joint = mechanism.effective_joints.get(name)
    if measure.subject == "load":
        load = mechanism.loads.get(name)
        return KINDS["force" if load and load.resisting_torque is None else "moment"]
    if measure.subject == "rate":
        return KINDS["speed" if joint and motions(joint.type)[:1] == ("slide",) else "angular speed"]
    if measure.subject == "effort":
        return KINDS["force" if joint and "rotation" not in freedoms(joint.type) else "moment"]
    return KINDS["length" if joint and motions(joint.type)[:1] == ("slide",) else "angle"]


def place_kind(mechanism: Fields, quantity: Quantity, dimensions: Mapping[str, Dimension | None]) -> Kind:
    """A time if it is stated as one, else the coordinate of the first driver. dimensions: of the names in it."""
    with suppress(UnitError, KeyError):  # findings of their own
        if quantity.check(dimensions) in KINDS["time"].dimensions:
            return KINDS["time"]
    return drive_kind(mechanism)

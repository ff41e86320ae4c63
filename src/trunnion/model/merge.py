"""A joint with the defaults of its model merged in, and its fit as radii with tolerances."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any, Literal

from pydantic import BaseModel

from trunnion.algebra.namespace import Number
from trunnion.errors import MechanismError
from trunnion.joints.fits import fit
from trunnion.joints.friction import FRICTION_LAWS
from trunnion.joints.pairs import PAIRS
from trunnion.model.joint_parts import (
    Fit,
    Friction,
    Guide,
    Joint,
    JointDefaults,
    Misalignment,
    Pin,
    Seat,
    SeatChoice,
    contact_lacks,
    has_guide,
    has_pin,
    has_play,
)
from trunnion.model.quantity import Quantity

__all__ = ["DEFAULT_LAW", "FitChoice", "merge_joint", "stated"]

DEFAULT_LAW = "coulomb"
NO_FRICTION = Quantity(0)
RADII = {"radius", "hole_radius", "clearance"}  # what a fit states
FitChoice = Literal["minimum", "mean", "maximum"]


def merge_joint(
    joint: Joint,
    defaults: JointDefaults,
    spatial: bool = False,
    limits: FitChoice = "mean",
    dimensions: Mapping[str, Number] | None = None,
) -> Joint:
    """A joint with the defaults that apply to its type, its friction complete: law, model and every parameter.

    limits: which limits of a fit are nominal; dimensions: nominal values of the dimensions that its size may speak of.
    """
    pin, guide = joint.pin, joint.guide
    if has_pin(joint.type) and (pin or defaults.pin):
        floats = PAIRS[joint.type].pivot
        default = {key: size for key, size in stated(defaults.pin).items() if key != "end_float" or floats}
        pin = Pin(**_pin(default, stated(pin), limits, dimensions or {}))
    if has_guide(joint.type) and (guide or defaults.guide):
        guide = Guide(**{**stated(defaults.guide), **stated(guide)})
    rubs = PAIRS[joint.type].count > 0  # nothing slips in a fixed joint: it needs no exception from the defaults
    friction = _friction(stated(defaults.friction) if rubs else {}, stated(joint.friction))
    touching = joint.contact and joint.contact.complete()
    merged = joint.model_copy(update={"pin": pin, "guide": guide, "friction": friction, "contact": touching})
    bored = PAIRS[joint.type].bored  # its numbers can be set; what another joint states is for a finding
    misalignment = (joint.misalignment or Misalignment()).complete(spatial) if bored else joint.misalignment
    merged = merged.model_copy(update={"misalignment": misalignment, "seat": _seat(merged, defaults.seat)})
    stated_of_law = friction.parameters if friction else {}
    if stated_of_law.get("coefficient") == NO_FRICTION and stated_of_law.get("backward") in (None, NO_FRICTION):
        touches = has_pin(joint.type) or has_guide(joint.type)
        if not touches or contact_lacks(merged, spatial):
            return merged.model_copy(update={"friction": None})  # friction: 0 asks for no radius or length
    return merged


def stated(part: BaseModel | None) -> Mapping[str, Any]:
    """What was written of a part: its own values by key."""
    return {} if part is None else {key: getattr(part, key) for key in sorted(part.model_fields_set)}


def _pin(
    default: Mapping[str, Any], own_pin: Mapping[str, Any], limits: FitChoice, dimensions: Mapping[str, Number]
) -> dict[str, Any]:
    """A pin's own values over the defaults; one way to state the play replaces the others."""
    instead = {"fit": RADII, "radius": {"fit"}}
    instead |= {"clearance": {"fit", "hole_radius"}, "hole_radius": {"fit", "clearance"}}
    replaced = {other for key in own_pin for other in instead.get(key, ())}
    merged = {**{key: size for key, size in default.items() if key not in replaced}, **own_pin}
    if merged.get("fit"):
        for key, radius in _radii(merged["fit"], limits, dimensions).items():
            merged[key] = merged.get(key) or radius
    return merged


def _radii(stated_fit: Fit, limits: FitChoice, dimensions: Mapping[str, Number]) -> dict[str, Quantity]:
    """Radii of pin and hole of a fit with their tolerances; half the size for the pin alone where it has no limits."""
    size = stated_fit.size
    try:
        fit_limits = fit(float(size.evaluate(dimensions)), stated_fit.hole, stated_fit.shaft)
    except (MechanismError, KeyError):  # a finding of its own
        return {"radius": _half(size, 0.0, None)}
    radii = {}
    # the smallest play is that of the largest pin in the smallest hole
    for key, (low, high), end in (
        ("radius", fit_limits.shaft_limits, {"minimum": 1.0, "mean": 0.5, "maximum": 0.0}),
        ("hole_radius", fit_limits.hole_limits, {"minimum": 0.0, "mean": 0.5, "maximum": 1.0}),
    ):
        share = end[limits]
        nominal, width = (low + share * (high - low)) / 2, (high - low) / 2
        radii[key] = _half(size, round(nominal, 12), (round(-share * width, 12), round((1 - share) * width, 12)))
    return radii


def _half(size: Quantity, deviation: float, tolerance: tuple[float, float] | None) -> Quantity:
    """Half a diameter and a deviation (m) of the radius."""
    if isinstance(size.source, str):
        sign = "-" if deviation < 0 else "+"
        text = f"({size.source}) / 2" + f" {sign} {abs(deviation):.12g} m" * (deviation != 0)
        half = Quantity.read(text, size.kind)
    else:
        half = Quantity.read(size.source / 2 + deviation, size.kind)
    return replace(half, tolerance=tolerance)


def _seat(joint: Joint, default: SeatChoice | None) -> SeatChoice:
    """A joint's own seat; else the default where it has a play that this can mean; else free."""
    seat = joint.seat
    suits = default is not None and has_play(joint)
    if isinstance(default, Seat):
        suits = suits and (default.direction is not None) == PAIRS[joint.type].ball
    if seat is None:
        seat = default if suits else "free"
    elif isinstance(seat, Seat) and isinstance(default, Seat) and suits:
        seat = Seat(**{**stated(default), **stated(seat)})
    return seat.complete() if isinstance(seat, Seat) else seat or "free"


def _friction(default: Mapping[str, Any], own_friction: Mapping[str, Any]) -> Friction | None:
    """Friction complete: the joint's own over the file's defaults (those its law knows) over the law's."""
    if not default and not own_friction:
        return None
    law = own_friction.get("law") or default.get("law") or DEFAULT_LAW
    declared = FRICTION_LAWS[law].parameters
    if (default.get("law") or DEFAULT_LAW) != law:
        default = {key: value for key, value in default.items() if key in (*declared, "model")}
    if "coefficient" in own_friction:  # of both directions, unless it says otherwise
        default = {key: value for key, value in default.items() if key != "backward"}
    filled = {key: parameter.default for key, parameter in declared.items() if parameter.default is not None}
    model = own_friction.get("model") or default.get("model") or "two-contact"
    return Friction.model_validate({**filled, **default, **own_friction, "law": law, "model": model})

"""Checks of what is off nominal: named errors, misaligned axes, plays, seats and fits."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np

from trunnion.algebra.namespace import Number
from trunnion.errors import Finding, MechanismError, Severity
from trunnion.joints.clearance import ellipse_error
from trunnion.joints.fits import FitLimits, fit
from trunnion.joints.pairs import PAIRS
from trunnion.model.joint_parts import (
    PLAY_PAIRS,
    TURNING_PAIRS,
    Friction,
    Joint,
    Pin,
    Seat,
    clearance,
    has_guide,
    has_pin,
    has_play,
    play,
)
from trunnion.model.merge import stated
from trunnion.model.names import ERRORS, ParameterNames
from trunnion.model.parameters import Numbers, ParameterSet
from trunnion.model.quantity import nominal_dimensions

__all__ = ["error_sizes", "errors", "joint_errors", "play_values"]

WILD = 0.1  # of a length: an error above it is more likely a slip of the unit
LEANING = np.radians(2)  # of a tilt, likewise
MEASURABLE = 1e-9  # m: half a millionth of a millimetre of interference is rounding


# ---- errors of named numbers ----------------------------------------------------------------------------------


def errors(mechanism: Numbers) -> Iterator[Finding]:
    """Whether each error is of one number, once, and measures what that does."""
    if not mechanism.errors:
        return
    entries = {entry.path: entry for entry in mechanism.entries}
    names = ParameterNames(entries)
    first: dict[str, str] = {}
    for name in mechanism.errors:
        where = f"{ERRORS}{name}"
        try:
            path = names.resolve(name)
        except MechanismError as error:
            finding = error.findings[0]
            yield Finding(finding.what, where, finding.remedy)
            continue
        if path.startswith("drivers."):
            what = "an error of a driver changes the times of the cycle, so there is no ideal cycle to compare with"
            yield Finding(what, where, "change the driver itself")
        if path in first:
            what = f"'{name}' and '{first[path]}' are the same number"
            yield Finding(what, where, "keep one of them")
        first.setdefault(path, name)
        if entries[path].varies:
            yield Finding(
                f"'{path}' varies with the motion and has no one error", where, "state one of a dimension in it"
            )


# ---- what is stated of joints ---------------------------------------------------------------------------------


def joint_errors(mechanism: Numbers) -> Iterator[Finding]:
    """Plays, seats and misalignments that a joint cannot have, or that lack something."""
    for name, joint in mechanism.effective_joints.items():
        own_part, where = mechanism.stated_joints[name], f"joints.{name}"
        yield from _empty_seat(own_part.seat, where)
        if own_part.misalignment is not None:
            yield from _misalignment(own_part, f"{where}.misalignment", mechanism.space == "spatial")
        if has_pin(joint.type):
            yield from _pin(mechanism, name, own_part.pin, where)
        sized = joint.pin is not None and joint.pin.radius is not None
        yield from _unused(joint.type, own_part.pin, own_part.friction, where, mechanism.space == "spatial", sized)
        if own_part.seat_on is not None:
            yield from _seat_on(joint, f"{where}.seat_on")
        if joint.seat not in (None, "free"):
            yield from _seat(mechanism, joint, where if own_part.seat is not None else "joint_defaults", where)
    yield from _defaults(mechanism)


def _seat_on(joint: Joint, where: str) -> Iterator[Finding]:
    """Whether the link that carries the seat of a pin is one of its two, and the pin is free to lie anywhere."""
    if joint.seat_on not in joint.links:
        yield Finding(f"'{joint.seat_on}' is no link of this joint", where, f"name {' or '.join(joint.links)}")
    elif joint.type not in TURNING_PAIRS:
        what = f"the seat of a {joint.type} joint needs no seat_on: its length moves with '{joint.links[1]}'"
        yield Finding(what, where, f"remove it; {' and '.join(TURNING_PAIRS)} joints have one")
    elif isinstance(joint.seat, Seat):
        what = "the seat is given, and seat_on is for a pin without a stated seat"
        yield Finding(what, where, "keep one of seat and seat_on")


def _misalignment(joint: Joint, where: str, spatial: bool) -> Iterator[Finding]:
    if not PAIRS[joint.type].bored:
        what = f"the misalignment of a {joint.type} joint is not modelled"
        yield Finding(what, where, "state errors: {…} of the numbers of its points, or remove it")
    elif joint.misalignment and joint.misalignment.tilt is not None and not spatial:
        yield Finding("a planar joint cannot tilt", f"{where}.tilt", "keep the offset, or state space: spatial")


def _pin(mechanism: Numbers, name: str, own_pin: Pin | None, where: str) -> Iterator[Finding]:
    """One way to state a play; an end float where there are ends; the classes of a fit."""
    merged = mechanism.effective_joints[name].pin
    defaults = mechanism.joint_defaults.pin
    for pin, place in ((own_pin, f"{where}.pin"), (defaults, "joint_defaults.pin")):
        ways = stated(pin).keys() & {"radius", "hole_radius", "clearance", "fit"}
        if "fit" in ways and len(ways) > 1:
            yield Finding("a fit states radius and clearance already", place, "keep the fit or the numbers")
        elif {"hole_radius", "clearance"} <= ways:
            yield Finding("the hole is stated by its radius and by the clearance", place, "keep one of them")
    if own_pin and own_pin.hole_radius is not None and merged and merged.radius is None:
        yield Finding("the hole has a radius, the pin has none", f"{where}.pin", "add radius: …, or state clearance: …")
    spatial = mechanism.space == "spatial"
    pivot = spatial and PAIRS[mechanism.stated_joints[name].type].pivot
    if own_pin and own_pin.end_float is not None and not pivot:
        what = "an end float is the play along the axis of a revolute joint in space"
        yield Finding(what, f"{where}.pin.end_float", "remove it")
    if merged and merged.fit and isinstance(limits := _fit(mechanism, name), Finding):
        yield Finding(limits.what, _fit_place(mechanism, name), limits.remedy)


def _fit(mechanism: Numbers, name: str) -> FitLimits | Finding | None:
    """The play of a joint's fit, or why it has none; None without a fit, or where its size has no value."""
    pin = mechanism.effective_joints[name].pin
    if pin is None or pin.fit is None:
        return None
    sizes = nominal_dimensions(mechanism.dimensions) if pin.fit.size.names else {}
    if not set(pin.fit.size.names) <= sizes.keys() or np.isnan(size := float(pin.fit.size.evaluate(sizes))):
        return None
    try:
        return fit(size, pin.fit.hole, pin.fit.shaft)
    except MechanismError as error:
        return error.findings[0]


def _seat(mechanism: Numbers, joint: Joint, stated_at: str, where: str) -> Iterator[Finding]:
    """What a seat other than free needs of its joint, and its words."""
    at, seat, spatial = f"{stated_at}.seat", joint.seat, mechanism.space == "spatial"
    if joint.type not in PLAY_PAIRS:
        what = f"the play of a {joint.type} joint is not modelled: its pin has no seat"
        yield Finding(what, at, f"remove it; {', '.join(PLAY_PAIRS[:-1])} and {PLAY_PAIRS[-1]} joints have one")
        return
    guide = has_guide(joint.type)
    if not has_play(joint):
        play_keys = "guide: {clearance: …}" if guide else "pin: {clearance: …}, hole_radius or a fit"
        yield Finding("a seat without play", at, f"state {play_keys}, or seat: free")
        return
    if not PAIRS[joint.type].ball and guide and not (joint.guide and joint.guide.length):
        yield Finding("a seat without the length of the guide", where, "state guide: {length: …}, or seat: free")
    if (
        spatial
        and not guide
        and not PAIRS[joint.type].ball
        and not (joint.pin and (joint.pin.length or joint.pin.bearing))
    ):
        yield Finding("a seat without the length of the pin", where, "state pin: {length: …}, or seat: free")
    if not isinstance(seat, Seat):
        return
    if PAIRS[joint.type].ball:
        if seat.beta is not None or seat.xi is not None:
            yield Finding(
                "the seat of a ball is stated by a direction, not by angles", at, "write seat: {direction: [0, 0, 1]}"
            )
        elif seat.direction is not None and len(seat.direction) != 3:
            what = f"has {len(seat.direction)} components, a ball in space needs 3"
            yield Finding(what, f"{at}.direction", "write [0, 0, 1]")
    elif seat.direction is not None:
        body = "slider" if guide else "pin"
        yield Finding(
            f"the seat of a {body} is stated by angles, not by a direction",
            f"{at}.direction",
            "write seat: {xi: 30 deg}",
        )
    elif not spatial and not guide and seat.beta is not None and seat.beta.source != 0:
        yield Finding("a planar pin does not tilt: its beta is 0", f"{at}.beta", "keep xi")


def _empty_seat(seat: object, where: str) -> Iterator[Finding]:
    if isinstance(seat, Seat) and not stated(seat):
        yield Finding("states no position", f"{where}.seat", "write {xi: 30 deg}, or of a ball {direction: [0, 0, 1]}")


def _unused(
    kind: str, pin: Pin | None, friction: Friction | None, where: str, spatial: bool, sized: bool
) -> Iterator[Finding]:
    """Sizes of a pin, and a model of friction, that change nothing in a joint of a kind; "" of all in the plane.

    sized: whether the radius is stated, with which the length of a pin in the plane tells its pressure.
    """
    if spatial and not PAIRS[kind].ball:
        return
    body = "a ball" if spatial else "a pin in the plane"
    for key in ("length", "bearing"):
        if pin and getattr(pin, key) is not None and not (sized and not spatial):
            what = f"{body} has no {key}" if spatial else f"{body} without a radius has no use for its {key}"
            what += ": it is not used"
            yield Finding(what, f"{where}.pin.{key}", "keep it as a remark, or remove it", Severity.NOTE)
    if pin and pin.offset is not None and not spatial:
        yield Finding("there is no axis in the plane to offset a bearing along", f"{where}.pin.offset", "remove it")
    if friction and friction.model == "pezzuti":
        what = f"the model pezzuti needs a bearing that carries a moment, and {body} carries none"
        yield Finding(what, f"{where}.friction.model", "remove it")


def _defaults(mechanism: Numbers) -> Iterator[Finding]:
    """Defaults that mean no joint."""
    pin, seat = mechanism.joint_defaults.pin, mechanism.joint_defaults.seat
    if mechanism.space == "planar":
        pins = [joint.pin for joint in mechanism.effective_joints.values()]
        sized = any(pin_part is not None and pin_part.radius is not None for pin_part in pins)
        yield from _unused("", pin, mechanism.joint_defaults.friction, "joint_defaults", False, sized)
    joints = mechanism.effective_joints.values()
    yield from _empty_seat(seat, "joint_defaults")
    if pin and pin.end_float is not None and mechanism.space == "planar":
        yield Finding("there is no end float in the plane", "joint_defaults.pin.end_float", "remove it")
    if seat not in (None, "free") and not any(has_play(joint) for joint in joints):
        what = "no joint has play"
        yield Finding(what, "joint_defaults.seat", "state pin: {clearance: …}, hole_radius or a fit", Severity.WARNING)
    if isinstance(seat, Seat) and seat.direction is not None and (seat.beta is not None or seat.xi is not None):
        what = "a direction is the seat of a ball, beta and xi are that of a pin"
        yield Finding(what, "joint_defaults.seat", "state the one here and the other with its joints")


# ---- numbers --------------------------------------------------------------------------------------------------


def error_sizes(numbers: ParameterSet) -> Iterator[Finding]:
    """Errors so large that their unit is in doubt."""
    for path in numbers.entries:
        target = path.removeprefix(ERRORS)
        if target == path or target not in numbers.nominal or path not in numbers.nominal:
            continue
        error = float(numbers.nominal[path])
        meant = float(numbers.nominal[target]) - error
        if np.abs(error) > WILD * np.abs(meant) > 0:
            what = f"is {error:g} (SI), {100 * np.abs(error / meant):.3g} % of the {meant:g} that are meant"
            yield Finding(what, path, "check its unit: a plain number is SI", Severity.WARNING)


def play_values(mechanism: Numbers, name: str, numbers: ParameterSet) -> Iterator[Finding]:
    """Signs and sizes of a joint's misalignment, seat and play, and what they make doubtful."""
    joint, where, values = mechanism.effective_joints[name], f"joints.{name}", numbers.nominal
    tilt = values.get(f"{where}.misalignment.tilt", 0.0)
    if LEANING < np.abs(tilt) <= np.pi / 4:
        what = f"is {np.degrees(tilt):.4g} deg, more than a misalignment usually is"
        yield Finding(what, f"{where}.misalignment.tilt", "a plain number is in radians", Severity.WARNING)
    yield from _unmodelled(mechanism, name, values)
    if not has_play(joint):
        return
    yield from _play_sign(mechanism, name, joint, numbers)
    limits = _fit(mechanism, name)
    if isinstance(limits, FitLimits):
        yield from _press(joint, limits, _fit_place(mechanism, name))
    yield from _play_size(mechanism, name, joint, values)


def _unmodelled(mechanism: Numbers, name: str, values: Mapping[str, Number]) -> Iterator[Finding]:
    """A play of a pair whose play is not modelled, which would count for nothing."""
    kind, pin = mechanism.effective_joints[name].type, f"joints.{name}.pin"
    if kind in PLAY_PAIRS or not has_pin(kind):
        return
    gap, further = clearance(name, values) or 0.0, values.get(f"{pin}.cylindricity", 0.0)
    if not (np.abs(gap) > 0 or np.abs(further) > 0):
        return
    size = f" of {_um(gap)}" * bool(gap > 0)
    what = f"the play{size} of a {kind} joint is not modelled"
    radius = f"radius: {values[f'{pin}.radius'] * 1e3:.6g} mm, " if f"{pin}.radius" in values else ""
    remedy = f"state pin: {{{radius}clearance: 0{', cylindricity: 0' * bool(further)}}} here"
    two = ", or two revolute joints in its place, whose play is modelled"
    yield Finding(what, pin, remedy + two * PAIRS[kind].crossed)


def _play_sign(mechanism: Numbers, name: str, joint: Joint, numbers: ParameterSet) -> Iterator[Finding]:
    """A nominal play below zero, which no seat can lie in and which radii as stated must not have."""
    where, values = f"joints.{name}", numbers.nominal
    pin = joint.pin
    if pin is None or pin.clearance is not None or has_guide(joint.type) or pin.hole_radius is None:
        return  # a negative clearance is found with the other lengths
    if f"{where}.pin.hole_radius" not in values:  # a play along the axis alone
        return
    radius, hole = values[f"{where}.pin.radius"], values[f"{where}.pin.hole_radius"]
    if not hole < radius:
        return
    if pin.fit is None:
        what = f"is {_mm(hole)}, less than the radius {_mm(radius)} of the pin"
        entry = numbers.entries[f"{where}.pin.hole_radius"]
        yield Finding(what, entry.alias or entry.path, "check the two; a press fit is a fixed joint")
    elif joint.seat not in (None, "free"):
        what = (
            f"the nominal play of the fit {pin.fit.source} is {_um(hole - radius)} on the radius: an interference fit"
        )
        yield Finding(what, _fit_place(mechanism, name), "use another fit, fits: maximum, or seat: free")


def _fit_place(mechanism: Numbers, name: str) -> str:
    """Where the fit of a joint is stated: with the joint or with the defaults."""
    own_pin = mechanism.stated_joints[name].pin
    return f"joints.{name}.pin.fit" if own_pin and own_pin.fit else "joint_defaults.pin.fit"


def _press(joint: Joint, limits: FitLimits, where: str) -> Iterator[Finding]:
    """A fit that may or must press."""
    text = joint.pin.fit.source if joint.pin and joint.pin.fit else ""
    reach = f"its play on the diameter is {_um(limits.minimum)} to {_um(limits.maximum)}"
    if limits.maximum <= MEASURABLE:
        what = f"{text} is a press fit, no play: it cannot turn as a bearing; {reach}"
        yield Finding(what, where, "use a shaft of class e to h, such as g6", Severity.WARNING)
    elif limits.minimum < -MEASURABLE:
        what = f"{text} may press: {reach}"
        yield Finding(what, where, "use a shaft of class e to h, such as g6", Severity.WARNING)


def _play_size(mechanism: Numbers, name: str, joint: Joint, values: Mapping[str, Number]) -> Iterator[Finding]:
    """A play so large, or a pin so short, that what is said of small plays no longer holds."""
    where, rho = f"joints.{name}", float(play(joint, name, values))
    if not rho > 0 or has_guide(joint.type):
        return
    place = f"{where}.pin"
    side, distance, link = _shortest_side(mechanism, name, joint, values)
    meeting = distance <= values.get(f"{where}.pin.radius", 0.0) and _cross(values, link, name, side)  # is no lever
    if rho > 0.01 * distance and not meeting:
        what = f"a play of {_mm(rho)} is {100 * rho / distance:.3g} % of the {_mm(distance)} from '{name}' to '{side}'"
        remedy = f"above 1 % of a side of the link '{link}' results for small play are inaccurate: check its unit"
        yield Finding(what, place, remedy, Severity.WARNING)
    if mechanism.space == "planar" or PAIRS[joint.type].ball:
        return
    radius = float(values.get(f"{where}.pin.radius", np.nan))
    length = float(values.get(f"{where}.pin.length", values.get(f"{where}.pin.bearing", np.nan)))
    error = ellipse_error(rho, radius, length) if length > 0 else np.nan  # at β = π
    if error > 0.01:
        what = f"the hole is modelled as a circle; for a tilted pin (an ellipse) the error is up to {100 * error:.2g} %"
        remedy = f"of the play {_mm(rho)}, by 2 r play / length²; a longer pin or a smaller play keeps it below 1 %"
        yield Finding(what, place, remedy, Severity.WARNING)
    leans = joint.seat not in (None, "free") or values.get(f"{where}.misalignment.tilt", 0.0) != 0
    if leans and length < 2 * radius:
        what = f"the pin is {_mm(length)} long, less than its diameter {_mm(2 * radius)}: it is poorly guided"
        yield Finding(what, place, "check that it is the length in the hole; a longer pin tilts less", Severity.WARNING)


def _shortest_side(mechanism: Numbers, name: str, joint: Joint, values: Mapping[str, Number]) -> tuple[str, float, str]:
    """The nearest other turning joint on a link of the joint, how far it is, m, and which link; infinity without one.

    Joints at one point count for nothing, and a loop places none by points.
    """
    best = ("", np.inf, "")
    for link in joint.links:
        points = mechanism.links[link].points if link in mechanism.links else {}
        here = _place(values, link, name)
        for other, other_joint in mechanism.effective_joints.items():
            if other == name or link not in other_joint.links or other not in points or name not in points:
                continue
            if not has_pin(other_joint.type) or len(distance_to := _place(values, link, other)) != len(here):
                continue
            distance = float(np.linalg.norm(here - distance_to))
            if 0 < distance < best[1]:
                best = (other, distance, link)
    return best


def _cross(values: Mapping[str, Number], link: str, *points: str) -> bool:
    """Whether two points of a link have axes that are not parallel; those of an eccentric are."""
    axes = [[float(values.get(f"links.{link}.points.{point}.axis.{k}", 0.0)) for k in "xyz"] for point in points]
    return bool(np.any(np.cross(axes[0], axes[1]) != 0))


def _place(values: Mapping[str, Number], link: str, point: str) -> np.ndarray:
    path = f"links.{link}.points.{point}"
    return np.array([float(values[f"{path}.{axis}"]) for axis in "xyz" if f"{path}.{axis}" in values])


def _mm(length: float) -> str:
    return f"{1e3 * length:.5g} mm"


def _um(length: float) -> str:
    return f"{1e6 * length:.4g} um"

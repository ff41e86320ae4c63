"""Checks of joints: their links, what each part of a joint needs, and where it has an effect.

What a key of a joint takes to have an effect is a row of `USES`; what a part needs beside it is a row of `_lacks`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from typing import Any

import numpy as np

from trunnion.algebra.namespace import Number
from trunnion.errors import Finding, MechanismError, Severity
from trunnion.joints.clearance import ellipse_error
from trunnion.joints.fits import FitLimits, fit
from trunnion.joints.friction import FRICTION_LAWS
from trunnion.joints.pairs import PAIRS, Pair
from trunnion.model.checks.loops import coordinates
from trunnion.model.joint_parts import (
    PLAY_PAIRS,
    TURNING_PAIRS,
    Friction,
    Joint,
    JointDefaults,
    Seat,
    clearance,
    contact_lacks,
    has_guide,
    has_pin,
    has_play,
    play,
)
from trunnion.model.merge import stated
from trunnion.model.names import as_key, nearest
from trunnion.model.parameters import Numbers, ParameterSet
from trunnion.model.quantity import nominal_dimensions

__all__ = ["joint_findings", "joint_values"]

LEANING = np.radians(2)  # a tilt above it is more likely a slip of the unit
PIN_LENGTHS = ("pin.length", "pin.bearing", "pin.end_float")
MEASURABLE = 1e-9  # m: half a millionth of a millimetre of interference is rounding


# ---- where a key has an effect --------------------------------------------------------------------------------

Applies = Callable[[Joint, Pair, bool], bool]  # of a joint with its defaults and its pair, in space or the plane


def _touches(joint: Joint, pair: Pair, spatial: bool) -> bool:
    """Whether the contact of a pair in play is modelled."""
    return pair.bored if spatial else pair.planar and (pair.pivot or pair.guided)


def _upright(joint: Joint, pair: Pair, spatial: bool) -> bool:
    """Whether a pin can lean in its hole, or does not."""
    leans = isinstance(joint.seat, Seat) and joint.seat.beta is not None and joint.seat.beta.source != 0
    return not pair.ball and (spatial or pair.guided or not leans)


# by key: where it has an effect, and what is said of a joint where it has none
USES: Mapping[str, tuple[Applies, str]] = {
    "pin": (lambda joint, pair, spatial: pair.turns, "has no pin"),
    "pin.offset": (lambda joint, pair, spatial: spatial and not pair.ball, "has no axis to offset its bearing along"),
    "pin.end_float": (lambda joint, pair, spatial: spatial and pair.pivot, "has no play along an axis"),
    "guide": (lambda joint, pair, spatial: pair.guided, "has no guide"),
    "guide.width": (lambda joint, pair, spatial: spatial, "carries no torsion about its slide"),
    "pitch": (lambda joint, pair, spatial: pair.threaded, "has no pitch"),
    "losses": (lambda joint, pair, spatial: bool(pair.motions), "has no one axis for a loss to act about or along"),
    "friction": (lambda joint, pair, spatial: pair.turns or pair.guided, "has no contact whose friction is modelled"),
    "friction.model": (
        lambda joint, pair, spatial: _model(joint) != "pezzuti" or (spatial and not pair.ball),
        "carries no bearing moment, which the model pezzuti is of",
    ),
    "friction.backward": (
        lambda joint, pair, spatial: pair.count == 1 and joint.contact is None,
        "has no one freedom, forward and backward, or is in play",
    ),
    "friction.law": (
        lambda joint, pair, spatial: _law(joint) != "rolling" or (pair.pivot and joint.contact is None),
        "does not roll: of a slide on rollers state the coefficient arm over radius",
    ),
    "misalignment": (lambda joint, pair, spatial: pair.bored, "has no plain pin whose misalignment is modelled"),
    "misalignment.tilt": (lambda joint, pair, spatial: spatial, "cannot tilt"),
    "contact": (_touches, "has no contact in play that is modelled"),
    "seat": (lambda joint, pair, spatial: joint.type in PLAY_PAIRS, "has no play that is modelled, and so no seat"),
    "seat.beta": (_upright, "does not tilt, or has its seat stated by a direction"),
    "seat.xi": (lambda joint, pair, spatial: not pair.ball, "has its seat stated by a direction"),
    "seat.direction": (lambda joint, pair, spatial: pair.ball, "has its seat stated by angles, xi and beta"),
    "seat_on": (lambda joint, pair, spatial: joint.type in TURNING_PAIRS, "needs none: its length moves with one link"),
}
# and what is a remark, not a mistake
REMARKS: Mapping[str, tuple[Applies, str]] = {
    "pin.length": (lambda joint, pair, spatial: _long(joint, pair, spatial), "has no use for it: it is not used"),
    "pin.bearing": (lambda joint, pair, spatial: _long(joint, pair, spatial), "has no use for it: it is not used"),
    "guide.height": (lambda joint, pair, spatial: joint.contact is not None, "is not in play: it is not used"),
    "stiffness.axial": (lambda joint, pair, spatial: spatial, "carries nothing with it: it is not used"),
    "stiffness.tilting": (
        lambda joint, pair, spatial: spatial or not pair.turns,
        "carries nothing with it: it is not used",
    ),
}


def _long(joint: Joint, pair: Pair, spatial: bool) -> bool:
    """Whether the length of a pin counts: by its bearing moment, or with the radius by its pressure."""
    return not pair.ball if spatial else joint.pin is not None and joint.pin.radius is not None


def _law(joint: Joint) -> str:
    return str(joint.friction and joint.friction.law)


def _model(joint: Joint) -> str:
    return str(joint.friction and joint.friction.model)


def _vain(mechanism: Numbers) -> Iterator[Finding]:
    """Keys that a joint states without effect; of the defaults those that have none in any joint."""
    findings: dict[str, Finding] = {}
    used: set[str] = set()
    for name, joint in mechanism.effective_joints.items():
        spatial, lost = mechanism.space == "spatial", set[str]()
        for key, (applies, why) in {**USES, **REMARKS}.items():
            part = key.partition(".")[0]
            by_joint, by_default = (
                _value(holder, key) for holder in (mechanism.stated_joints[name], mechanism.joint_defaults)
            )
            unstated = by_joint is None and by_default is None
            if unstated or part in lost or _value(joint, key) in (None, "free") or _is_off(joint.friction, key):
                continue
            where = f"joint_defaults.{key}" if by_joint is None and part != "friction" else f"joints.{name}.{key}"
            if applies(joint, PAIRS[joint.type], spatial):
                used.add(where)
                continue
            lost.add(part if key == part else key)
            what = f"a {joint.type} joint in {'space' if spatial else 'the plane'} {why}"
            severity = Severity.NOTE if key in REMARKS else Severity.ERROR
            zero = " or state 0 for this joint" if part == "friction" else " or use another joint"
            findings.setdefault(where, Finding(what, where, f"remove it,{zero}", severity))
    yield from (finding for where, finding in findings.items() if where not in used)


def _value(joint: Joint | JointDefaults, key: str) -> Any:
    """What a joint, or the defaults, state by a key or by a key of a part; None if nothing."""
    part, _, below = key.partition(".")
    value = getattr(joint, part, None)
    if isinstance(value, Friction) and below:
        value = {**value.parameters, "law": value.law, "model": value.model}
    return value.get(below) if isinstance(value, dict) else getattr(value, below, None) if below else value


def _is_off(friction: Friction | None, key: str = "friction") -> bool:
    """Whether a key is that of friction, and none is meant: see `loads.unknown_name`."""
    coefficient = friction and friction.parameters.get("coefficient")
    return bool(key == "friction" and coefficient and not {"off", "none"}.isdisjoint(coefficient.names))


# ---- what a joint needs ---------------------------------------------------------------------------------------


def joint_findings(mechanism: Numbers) -> Iterator[Finding]:
    """Whether each joint has its links and points, and what its parts need."""
    yield from _vain(mechanism)
    for name, joint in mechanism.effective_joints.items():
        where, stated_joint = f"joints.{name}", mechanism.stated_joints[name]
        if mechanism.space == "planar" and not PAIRS[joint.type].planar:
            flat = ", ".join(pair for pair in PAIRS if PAIRS[pair].planar)
            yield Finding(f"a {joint.type} joint does not exist in the plane", where, f"use one of {flat}")
        if name in mechanism.joints:
            yield from _ends(mechanism, name, joint)
        for lacking, what, lack, remedy in _lacks(joint, mechanism.space == "spatial"):
            if lacking:
                yield Finding(f"{what} without {lack}", where, remedy)
        if joint.friction is not None:
            at = "joint_defaults.friction" if stated_joint.friction is None else f"{where}.friction"
            yield from _parameters_of_law(joint.friction, at)
        if joint.seat_on is not None and joint.seat_on not in joint.links:
            what = f"'{joint.seat_on}' is no link of this joint"
            yield Finding(what, f"{where}.seat_on", f"name {' or '.join(joint.links)}")
        yield from _choices(mechanism, name, stated_joint)
        if joint.contact is not None:
            yield from _in_play(mechanism, name)
        if isinstance(limits := _fit(mechanism, name), Finding):
            yield limits
    yield from _remarks(mechanism)


def _remarks(mechanism: Numbers) -> Iterator[Finding]:
    """What is stated, or not, and may well be meant so."""
    seat, joints = mechanism.joint_defaults.seat, mechanism.effective_joints
    if seat not in (None, "free") and not any(has_play(joint) for joint in joints.values()):
        remedy = "state pin: {clearance: …}, hole_radius or a fit"
        yield Finding("no joint has play", "joint_defaults.seat", remedy, Severity.WARNING)
    for name, joint in joints.items():
        guide = joint.guide if mechanism.space == "spatial" and joint.friction and has_guide(joint.type) else None
        if joint.stiffness is not None and mechanism.over_constraint == "refuse":
            what, remedy = "stiffness is not used where reactions are decided", "state over_constraint: minimum-norm"
            yield Finding(what, f"joints.{name}.stiffness.radial", remedy, Severity.NOTE)
        if guide and guide.length and guide.width is None:
            what = "without a width of the guide its torsion about the slide is carried without friction"
            remedy = "state guide: {width: …} if it does not slide on a round bar"
            yield Finding(what, f"joints.{name}", remedy, Severity.NOTE)


def _ends(mechanism: Numbers, name: str, joint: Joint) -> Iterator[Finding]:
    """The point of a joint on each of its links, with an axis where the pair has one."""
    for link in dict.fromkeys(joint.links):
        points = mechanism.effective_links[link].points
        key, position = as_key(name), coordinates(mechanism)
        if name not in points:
            remedy = f"add {key}: {position} to the points of '{link}' ({nearest(name, points)})"
            yield Finding(f"the link '{link}' has no point '{name}'", f"joints.{name}", remedy)
        elif mechanism.space in PAIRS[joint.type].needs_axis and points[name].axis is None:
            axis = "[1, 0]" if mechanism.space == "planar" else "[0, 0, 1]"
            what = f"the point '{name}' of the link '{link}' has no axis, a {joint.type} joint needs one"
            yield Finding(what, f"links.{link}.points.{name}", f"write {key}: {{at: {position}, axis: {axis}}}")


def _lacks(joint: Joint, spatial: bool) -> Iterator[tuple[bool, str, str, str]]:
    """What a joint may lack: whether it does, what needs it, what it is and how it is stated."""
    pair, pin, guide, contact = PAIRS[joint.type], joint.pin, joint.guide, joint.contact
    turns, body = pair.turns, "ball" if pair.ball else "pin"
    rubs = joint.friction is not None and (turns or pair.guided) and not _is_off(joint.friction)
    lacks = contact_lacks(joint, spatial) if rubs else ()
    yield "radius" in lacks, "friction", f"the radius of the {body}", "state pin: {radius: …}, a fit, or friction: 0"
    remedy = "state pin: {bearing: …} or {length: …}, or friction: 0"
    yield "bearing" in lacks, "friction", "the length of the bearing, which carries a moment in space", remedy
    yield "length" in lacks, "friction", "the length of the guide", "state guide: {length: …}, or friction: 0"
    remedy = "add pitch: 5 mm, the slide of one turn, negative for a left-hand thread"
    yield pair.threaded and joint.pitch is None, "a helical joint", "a pitch", remedy
    no_radius = turns and pin is not None and pin.radius is None
    yield (
        no_radius and pin is not None and pin.hole_radius is not None,
        "a hole radius",
        "that of the pin",
        "add radius",
    )
    loss = joint.losses
    yield loss is not None and not stated(loss), "losses", "a number", "state constant: …, viscous: … or both"
    seated, has = joint.seat != "free" and joint.type in PLAY_PAIRS, has_play(joint)
    short = not pair.ball and not (guide and guide.length if pair.guided else pin and (pin.length or pin.bearing))
    clear = "guide: {clearance: …}" if pair.guided else "pin: {clearance: …}, hole_radius or a fit"
    yield seated and not has, "a seat", "play", f"state {clear}, or seat: free"
    part = "guide" if pair.guided else "pin"
    long = seated and has and (spatial or pair.guided) and short
    yield long, "a seat", f"the length of the {part}", f"state {part}: {{length: …}}, or seat: free"
    if contact is None or not _touches(joint, pair, spatial):
        return
    across = has and (not spatial or (pin is not None and (pin.clearance is not None or pin.hole_radius is not None)))
    yield not across, "a joint in play", "its clearance", f"add {part}: {{clearance: …}}"
    yield spatial and short, "a pin in play in space", "the length between its ends", "add pin: {length: …}"
    floats = pin is not None and pin.end_float is not None
    remedy = "add pin: {end_float: …}, end to end, or use type: cylindrical for a pin without shoulders"
    yield spatial and pair.pivot and not floats, "a pin in play in space", "the play of its shoulders", remedy
    soft = not contact.of.rigid
    remedy = "state stiffness: 60e9 N/m^1.5, or modulus: 210 GPa"
    yield soft and contact.stiffness is None and contact.modulus is None, "a contact", "stiffness or modulus", remedy
    by_modulus = soft and contact.modulus is not None
    yield by_modulus and no_radius, "stiffness by a modulus", "the pin's radius", "add pin: {radius: 10 mm}"


def _parameters_of_law(friction: Friction, where: str) -> Iterator[Finding]:
    """Whether the parameters of a friction law are its own, and all of them."""
    law = str(friction.law)  # stated or filled in
    declared = FRICTION_LAWS[law].parameters
    for key in friction.parameters:
        if key not in declared:
            what = f"the key '{key}' is unknown to the friction law {law}"
            yield Finding(what, f"{where}.{key}", nearest(key, ["law", "model", *declared]))
    for key, parameter in declared.items():
        if parameter.default is None and not parameter.optional and key not in friction.parameters:
            remedy = f"add {key}" + f" ({parameter.meaning})" * bool(parameter.meaning)
            yield Finding(f"the friction law {law} needs '{key}'", where, remedy)


def _choices(mechanism: Numbers, name: str, stated_joint: Joint) -> Iterator[Finding]:
    """Things of which a joint, or the defaults, may state one."""
    for part, at in ((stated_joint, f"joints.{name}"), (mechanism.joint_defaults, "joint_defaults")):
        pin, seat = stated(part.pin).keys(), part.seat
        rest = pin & {"radius", "hole_radius", "clearance"}
        if "fit" in pin and rest:
            yield Finding("a fit states radius and clearance already", f"{at}.pin", "keep the fit or the numbers")
        elif {"hole_radius", "clearance"} <= rest:
            what = "the hole is stated by its radius and by the clearance"
            yield Finding(what, f"{at}.pin", "keep one of them")
        if isinstance(seat, Seat) and not stated(seat):
            remedy = "write {xi: 30 deg}, or of a ball {direction: [0, 0, 1]}"
            yield Finding("states no position", f"{at}.seat", remedy)
        elif isinstance(seat, Seat) and "direction" in stated(seat) and len(stated(seat)) > 1:
            yield Finding("states a direction, of a ball, and angles, of a pin", f"{at}.seat", "keep one of them")
    if stated_joint.seat_on is not None and isinstance(mechanism.effective_joints[name].seat, Seat):
        what = "the seat is given, and seat_on is for a pin without a stated seat"
        yield Finding(what, f"joints.{name}.seat_on", "keep one of seat and seat_on")
    contact = stated_joint.contact
    if contact is not None and contact.stiffness is not None and contact.modulus is not None:
        yield Finding("states both stiffness and modulus", f"joints.{name}.contact", "keep one of them")


def _in_play(mechanism: Numbers, name: str) -> Iterator[Finding]:
    """What else speaks of a joint that is in play, which has no one coordinate, and laws that are of others."""
    joint, where = mechanism.effective_joints[name], f"joints.{name}.contact"
    contact = joint.contact
    if contact is not None and mechanism.space == "spatial" and contact.of.rigid:
        what = "impacts of rigid bodies are of planar joints: the ends of a pin in space would strike one by one"
        yield Finding(what, f"{where}.law", "use another law, with stiffness or modulus")
    if contact is not None and contact.modulus is not None and has_guide(joint.type):
        what = "a slider in a guide touches with an edge, whose stiffness does not follow from a modulus"
        yield Finding(what, f"{where}.modulus", "state stiffness: … and exponent: 1 instead")
    users = [f"drivers.{name}"] if name in mechanism.drivers else []
    users += [f"loads.{key}" for key, load in mechanism.loads.items() if load.joint == name]
    users += [f"springs.{key}" for key, spring in mechanism.springs.items() if spring.joint == name]
    users += [f"gears.{key}" for key, gear in mechanism.gears.items() if name in gear.joints]
    for user in users:
        what = "a joint that is in play has no one coordinate to drive, to load, to couple or to measure"
        yield Finding(what, where, f"remove it, or {user}")


# ---- numbers --------------------------------------------------------------------------------------------------


def joint_values(mechanism: Numbers, name: str, numbers: ParameterSet) -> Iterator[Finding]:
    """What the numbers of a joint make impossible or doubtful: sizes, plays, seats, contacts."""
    joint, where, values = mechanism.effective_joints[name], f"joints.{name}", numbers.nominal
    spatial = mechanism.space == "spatial"

    def value(path: str, absent: float = np.nan) -> float:
        return float(values.get(f"{where}.{path}", absent))

    def at(path: str) -> str:
        """Where a value stands: with the joint or with the defaults."""
        return numbers.entries[f"{where}.{path}"].alias or f"{where}.{path}"

    for path in ("friction.coefficient", "friction.backward"):
        if value(path) > 1:
            remedy = "check it: dry metals have 0.1 to 0.6"
            yield Finding(f"is {value(path):g}, above 1", at(path), remedy, Severity.WARNING)
    rolls = _law(joint) == "rolling"
    for size in (
        "guide.length" if rolls else "pin.radius",
        "guide.length",
        *(("pin.bearing", "guide.width") if spatial else ()),
    ):
        if joint.friction is not None and value(size) == 0:
            yield Finding("is 0, where friction needs it", at(size), "give a value above 0")
    for part, size in (("pin", "radius"), ("guide", "length")):
        gap, body = value(f"{part}.clearance"), value(f"{part}.{size}")
        if gap >= body > 0:
            what = f"is {_mm(gap)}, not less than the {size} {_mm(body)} of the {part}"
            yield Finding(what, at(f"{part}.clearance"), "check its unit")
    yield from _contact_values(joint, values, where)
    gap, more = clearance(name, values) or 0.0, value("pin.cylindricity", 0.0)
    if has_pin(joint.type) and joint.type not in PLAY_PAIRS and (gap != 0 or more != 0):
        what = f"the play of {_um(float(gap) + more)} of a {joint.type} joint is not modelled"
        radius = f"radius: {1e3 * value('pin.radius'):.6g} mm, " * (value("pin.radius") >= 0)
        remedy = f"state pin: {{{radius}clearance: 0, cylindricity: 0}} here, or use revolute joints"
        yield Finding(what, f"{where}.pin", remedy)
    if has_play(joint):
        yield from _fitted(mechanism, name, joint, value("pin.radius"), value("pin.hole_radius"), at)
        yield from _play_size(mechanism, name, joint, values)
    tilt = abs(value("misalignment.tilt", 0.0))
    if tilt > LEANING:
        what = f"is {np.degrees(tilt):.4g} deg, more than a misalignment usually is"
        yield Finding(what, f"{where}.misalignment.tilt", "a plain number is in radians", Severity.WARNING)


def _contact_values(joint: Joint, values: Mapping[str, Number], where: str) -> Iterator[Finding]:
    """Whether the numbers of a contact can be those of one. values: by path; where: path of the joint."""
    contact = joint.contact
    if contact is None:
        return
    gap = clearance(where.removeprefix("joints."), values)
    across = np.nan if gap is None else gap + values.get(f"{where}.pin.cylindricity", 0.0)
    sizes = {"contact": across} | {key: values.get(f"{where}.{key}", np.nan) for key in PIN_LENGTHS}
    for key, size in sizes.items():
        if size <= 0:
            what = f"{'has a clearance of' if key == 'contact' else 'is'} {size:g} m, and the joint is in play"
            yield Finding(what, f"{where}.{key}", "give a length above 0, or remove the contact")
    if values.get(f"{where}.contact.restitution") == 0 and not contact.of.rigid:
        what = "is 0, which is of rigid bodies alone"
        yield Finding(what, f"{where}.contact.restitution", "give the speed after over the speed before, such as 0.8")
    if contact.modulus is not None and values.get(f"{where}.contact.exponent", 1.5) != 1.5:
        what = "the stiffness by a modulus goes with the exponent 1.5"
        yield Finding(what, f"{where}.contact.exponent", "remove it, or state the stiffness itself")


def _fit(mechanism: Numbers, name: str) -> FitLimits | Finding | None:
    """The play of a joint's fit, or why it has none; None without a fit, or where its size has no value."""
    pin = mechanism.effective_joints[name].pin
    if pin is None or pin.fit is None or not has_pin(mechanism.effective_joints[name].type):
        return None
    sizes = nominal_dimensions(mechanism.dimensions) if pin.fit.size.names else {}
    try:
        return fit(float(pin.fit.size.evaluate(sizes)), pin.fit.hole, pin.fit.shaft)
    except KeyError:  # a finding of its own
        return None
    except MechanismError as error:
        return Finding(error.findings[0].what, _fit_place(mechanism, name), error.findings[0].remedy)


def _fit_place(mechanism: Numbers, name: str) -> str:
    """Where the fit of a joint is stated: with the joint or with the defaults."""
    own_pin = mechanism.stated_joints[name].pin
    return f"joints.{name}.pin.fit" if own_pin and own_pin.fit else "joint_defaults.pin.fit"


def _fitted(
    mechanism: Numbers, name: str, joint: Joint, radius: float, hole: float, at: Callable[[str], str]
) -> Iterator[Finding]:
    """A pin that is wider than its hole, by its radii or by its fit. at: where a number stands."""
    pin, limits = joint.pin, _fit(mechanism, name)
    if pin is None:
        return
    if not isinstance(limits, FitLimits):
        if hole < radius and pin.clearance is None:
            what = f"is {_mm(hole)}, less than the radius {_mm(radius)} of the pin"
            yield Finding(what, at("pin.hole_radius"), "check the two; a press fit is a fixed joint")
        return
    where, text = _fit_place(mechanism, name), pin.fit.source if pin.fit else ""
    if hole < radius and joint.seat not in (None, "free"):
        what = f"the nominal play of the fit {text} is {_um(hole - radius)} on the radius: an interference fit"
        yield Finding(what, where, "use another fit, fits: maximum, or seat: free")
    if limits.minimum < -MEASURABLE or limits.maximum <= MEASURABLE:
        presses = (
            "is a press fit, no play: it cannot turn as a bearing" if limits.maximum <= MEASURABLE else "may press"
        )
        what = f"{text} {presses}: its play on the diameter is {_um(limits.minimum)} to {_um(limits.maximum)}"
        yield Finding(what, where, "use a shaft of class e to h, such as g6", Severity.WARNING)


def _play_size(mechanism: Numbers, name: str, joint: Joint, values: Mapping[str, Number]) -> Iterator[Finding]:
    """A play so large, or a pin so short, that what is said of small plays no longer holds."""
    where, rho = f"joints.{name}", float(play(joint, name, values))
    if not rho > 0 or has_guide(joint.type):
        return
    place, radius = f"{where}.pin", float(values.get(f"{where}.pin.radius", np.nan))
    side, distance, link = _shortest_side(mechanism, name, joint, values)
    axes = [[values.get(f"links.{link}.points.{point}.axis.{k}", 0.0) for k in "xyz"] for point in (name, side)]
    meeting = distance <= radius and np.any(np.cross(axes[0], axes[1]) != 0)  # no lever; an eccentric's are parallel
    if rho > 0.01 * distance and not meeting:
        what = f"a play of {_mm(rho)} is {100 * rho / distance:.3g} % of the {_mm(distance)} from '{name}' to '{side}'"
        remedy = f"above 1 % of a side of the link '{link}' results for small play are inaccurate: check its unit"
        yield Finding(what, place, remedy, Severity.WARNING)
    if mechanism.space == "planar" or PAIRS[joint.type].ball:
        return
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

    def place(link: str, point: str) -> list[float]:
        path = f"links.{link}.points.{point}"
        return [float(values[f"{path}.{axis}"]) for axis in "xyz" if f"{path}.{axis}" in values]

    sides = [("", np.inf, "")]
    for link in joint.links:
        for other, other_joint in mechanism.effective_joints.items():
            here, away = place(link, name), place(link, other)
            if other != name and link in other_joint.links and here and away and has_pin(other_joint.type):
                sides.append((other, float(np.linalg.norm(np.subtract(here, away))), link))
    return min((side for side in sides if side[1] > 0), key=lambda side: side[1])


def _mm(length: float) -> str:
    return f"{1e3 * length:.5g} mm"


def _um(length: float) -> str:
    return f"{1e6 * length:.4g} um"

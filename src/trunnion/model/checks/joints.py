"""Checks of joints: their links, what each part of a joint needs, and where it has an effect.

What a key of a joint takes to have an effect is a row of `_effects`; what a part needs beside it, of `_lacks`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from itertools import product
from typing import Any

import numpy as np

from trunnion.algebra.namespace import Number
from trunnion.errors import Finding, MechanismError, Severity
from trunnion.joints.clearance import ellipse_error
from trunnion.joints.fits import FitLimits, fit
from trunnion.joints.friction import FRICTION_LAWS
from trunnion.joints.pairs import PAIRS, Pair
from trunnion.model.joint_parts import (
    PLAY_PAIRS,
    TURNING_PAIRS,
    Friction,
    Joint,
    JointDefaults,
    Seat,
    clearance,
    contact_lacks,
    has_play,
    play,
)
from trunnion.model.names import as_key, nearest
from trunnion.model.parameters import Numbers, ParameterSet
from trunnion.model.quantity import nominal_dimensions
from trunnion.model.rules import faults

MEASURABLE = 1e-9  # m: half a millionth of a millimetre of interference is rounding
LARGE = 0.01  # of a side: a play above it is not small


# ---- where a key has an effect --------------------------------------------------------------------------------


REMARKS = ("pin.length", "pin.bearing", "guide.height", "stiffness.radial", "stiffness.axial", "stiffness.tilting")


def _effects(joint: Joint, spatial: bool, decided: bool) -> list[tuple[str, bool, str]]:
    """Keys of a joint, whether each has an effect, and what is said of the joint where it has none.

    decided: whether statics decides every reaction.
    """
    pair, pin, seat, friction = joint.pair, joint.pin, joint.seat, joint.friction
    law, model = (friction.law, friction.model) if friction else ("", "")
    in_play, on_axis = joint.contact is not None, spatial and not pair.ball
    leans = isinstance(seat, Seat) and seat.beta is not None and seat.beta.source != 0
    # the length of a pin counts by the bearing moment, or in the plane with the radius by the pressure
    by_length, unused = on_axis if spatial else pin is not None and pin.radius is not None, "has no use for it"
    return [
        ("pin", pair.turns, "has no pin"),
        ("pin.offset", on_axis, "has no axis to offset its bearing along"),
        ("pin.end_float", spatial and pair.pivot, "has no play along an axis"),
        ("guide", pair.guided, "has no guide"),
        ("guide.width", spatial, "carries no torsion about its slide"),
        ("pitch", pair.threaded, "has no pitch"),
        ("losses", bool(pair.motions), "has no one axis for a loss to act about or along"),
        ("friction", pair.turns or pair.guided, "has no contact whose friction is modelled"),
        ("friction.model", model != "pezzuti" or on_axis, "carries no bearing moment, which the model pezzuti is of"),
        ("friction.backward", pair.count == 1 and not in_play,
         "has no one freedom, forward and backward, or is in play"),
        ("friction.law", law != "rolling" or (pair.pivot and not in_play),
         "does not roll: of a slide on rollers state the coefficient arm over radius"),
        ("misalignment", pair.bored, "has no plain pin whose misalignment is modelled"),
        ("misalignment.tilt", spatial, "cannot tilt"),
        ("contact", _touches(pair, spatial), "has no contact in play that is modelled"),
        ("seat", joint.type in PLAY_PAIRS, "has no play that is modelled, and so no seat"),
        ("seat.beta", not pair.ball and (spatial or pair.guided or not leans),
         "does not tilt, or has its seat stated by a direction"),
        ("seat.xi", not pair.ball, "has its seat stated by a direction"),
        ("seat.direction", pair.ball, "has its seat stated by angles, xi and beta"),
        ("seat_on", joint.type in TURNING_PAIRS and not isinstance(seat, Seat),
         "needs none: its length moves with one link, or its seat is stated"),
        ("pin.length", by_length, unused), ("pin.bearing", by_length, unused), ("guide.height", in_play, unused),
        ("stiffness.radial", not decided, "has its reaction decided without over_constraint: minimum-norm"),
        ("stiffness.axial", spatial, unused), ("stiffness.tilting", spatial or not pair.turns, unused),
    ]  # fmt: skip


def _touches(pair: Pair, spatial: bool) -> bool:
    """Whether the contact of a pair in play is modelled."""
    return pair.bored if spatial else pair.planar and (pair.pivot or pair.guided)


def _vain(mechanism: Numbers) -> Iterator[Finding]:
    """Keys that a joint states without effect; of the defaults those that have none in any joint."""
    findings: dict[str, Finding] = {}
    used: set[str] = set()
    spatial, decided = mechanism.space == "spatial", mechanism.over_constraint == "refuse"
    for name, joint in mechanism.effective_joints.items():
        lost: set[str] = set()
        for key, applies, why in _effects(joint, spatial, decided):
            part = key.partition(".")[0]
            own, default = _value(mechanism.stated_joints[name], key), _value(mechanism.joint_defaults, key)
            if part in lost or _value(joint, key) in (None, "free") or (own is None and default is None):
                continue
            where = f"joint_defaults.{key}" if own is None and part != "friction" else f"joints.{name}.{key}"
            if applies:
                used.add(where)
                continue
            lost.add(part if key == part else key)
            what = f"a {joint.type} joint in {'space' if spatial else 'the plane'} {why}"
            severity = Severity.NOTE if key in REMARKS else Severity.ERROR
            what += ": it is not used" * (key in REMARKS)
            remedy = "remove it, or state 0 for this joint" if part == "friction" else "remove it"
            findings.setdefault(where, Finding(what, where, remedy, severity))
    yield from (finding for where, finding in findings.items() if where not in used)


def _value(joint: Joint | JointDefaults, key: str) -> Any:
    """What a joint, or the defaults, state by a key or by a key of a part; None if nothing."""
    part, _, below = key.partition(".")
    value = getattr(joint, part, None)
    if isinstance(value, Friction) and below not in ("", "law", "model"):
        return value.parameters.get(below)
    return getattr(value, below, None) if below else value


# ---- what a joint needs ---------------------------------------------------------------------------------------


def joint_findings(mechanism: Numbers) -> Iterator[Finding]:
    """Whether each joint has its links and points, and what its parts need."""
    yield from _vain(mechanism)
    seat, spatial = mechanism.joint_defaults.seat, mechanism.space == "spatial"
    if seat not in (None, "free") and not any(has_play(joint) for joint in mechanism.effective_joints.values()):
        remedy = "state pin: {clearance: …}, hole_radius or a fit"
        yield Finding("no joint has play", "joint_defaults.seat", remedy, Severity.WARNING)
    for name, joint in mechanism.effective_joints.items():
        where = f"joints.{name}"
        pair = joint.pair
        if name in mechanism.joints:
            yield from _ends(mechanism, name, joint)
        yield from _lacks(joint, pair, spatial, where)
        if joint.friction is not None:
            by_default = mechanism.stated_joints[name].friction is None
            yield from _parameters_of_law(joint.friction, f"{'joint_defaults' if by_default else where}.friction")
        if joint.contact is not None:
            yield from _in_play(mechanism, name, pair, spatial)
        if isinstance(limits := _fit(mechanism, name), Finding):
            yield limits
        guide = joint.guide if spatial and joint.friction and pair.guided else None
        yield from faults(
            where,
            (not spatial and not pair.planar, "", f"a {joint.type} joint does not exist in the plane",
             f"use one of {', '.join(kind for kind in PAIRS if PAIRS[kind].planar)}"),
            (joint.seat_on not in (None, *joint.links), "seat_on", f"'{joint.seat_on}' is no link of this joint",
             f"name {' or '.join(joint.links)}"),
            (guide and guide.length and guide.width is None, "",
             "without a width of the guide its torsion about the slide is carried without friction",
             "state guide: {width: …} if it does not slide on a round bar", Severity.NOTE),
        )  # fmt: skip


def _ends(mechanism: Numbers, name: str, joint: Joint) -> Iterator[Finding]:
    """The point of a joint on each of its links, with an axis where the pair has one."""
    key, position = as_key(name), mechanism.position_form
    for link in dict.fromkeys(joint.links):
        points = mechanism.effective_links[link].points
        if name not in points:
            remedy = f"add {key}: {position} to the points of '{link}' ({nearest(name, points)})"
            yield Finding(f"the link '{link}' has no point '{name}'", f"joints.{name}", remedy)
        elif mechanism.space in joint.pair.needs_axis and points[name].axis is None:
            axis = "[1, 0]" if mechanism.space == "planar" else "[0, 0, 1]"
            what = f"the point '{name}' of the link '{link}' has no axis, a {joint.type} joint needs one"
            yield Finding(what, f"links.{link}.points.{name}", f"write {key}: {{at: {position}, axis: {axis}}}")


def _lacks(joint: Joint, pair: Pair, spatial: bool, where: str) -> Iterator[Finding]:
    """What a joint lacks that something else of it needs."""
    pin, guide, contact = joint.pin, joint.guide, joint.contact
    rubs = joint.friction is not None and (pair.turns or pair.guided)
    lacks = contact_lacks(joint, spatial) if rubs else ()
    no_radius, part = pair.turns and pin is not None and pin.radius is None, "guide" if pair.guided else "pin"
    seated, has = joint.seat != "free" and joint.type in PLAY_PAIRS, has_play(joint)
    short = not pair.ball and not (guide and guide.length if pair.guided else pin and (pin.length or pin.bearing))
    clear = f"state {part}: {{clearance: …}}" + ", hole_radius or a fit" * pair.turns
    body = {"radius": "radius of the ball" if pair.ball else "radius of the pin", "length": "length of the guide",
            "bearing": "length of the bearing, which carries a moment in space"}  # fmt: skip
    yield from faults(
        where,
        *((True, "", f"friction without the {body[size]}", f"state {part}: {{{size}: …}}, or friction: 0")
          for size in lacks),
        (pair.threaded and joint.pitch is None, "", "a helical joint without a pitch",
         "add pitch: 5 mm, the slide of one turn, negative for a left-hand thread"),
        (no_radius and pin and pin.hole_radius is not None, "", "a hole radius without that of the pin"),
        (seated and not has, "", "a seat without play", f"{clear}, or seat: free"),
        (seated and has and (spatial or pair.guided) and short, "", f"a seat without the length of the {part}",
         f"state {part}: {{length: …}}, or seat: free"),
    )  # fmt: skip
    if contact is None or not _touches(pair, spatial):
        return
    across = has and (not spatial or (pin is not None and (pin.clearance is not None or pin.hole_radius is not None)))
    shouldered = spatial and pair.pivot and not (pin and pin.end_float is not None)
    by_modulus, needs = contact.modulus is not None, {"clearance": not across, "length": spatial and short}
    yield from faults(
        where,
        *((lacking, "", f"a joint in play without its {size}", f"add {part}: {{{size}: …}}")
          for size, lacking in needs.items()),
        (shouldered, "", "a joint in play without its end_float",
         "add pin: {end_float: …}, end to end, or use type: cylindrical for a pin without shoulders"),
        (not contact.of.rigid and contact.stiffness is None and not by_modulus, "",
         "a contact without stiffness or modulus", "state stiffness: 60e9 N/m^1.5, or modulus: 210 GPa"),
        (not contact.of.rigid and by_modulus and no_radius, "", "stiffness by a modulus without the pin's radius"),
    )  # fmt: skip


def _parameters_of_law(friction: Friction, where: str) -> Iterator[Finding]:
    """Whether the parameters of a friction law are its own, and all of them."""
    law = str(friction.law)  # stated or filled in
    declared = FRICTION_LAWS[law].parameters
    for key in (key for key in friction.parameters if key not in declared):
        what = f"the key '{key}' is unknown to the friction law {law}"
        yield Finding(what, f"{where}.{key}", nearest(key, ["law", "model", *declared]))
    for key, parameter in declared.items():
        if parameter.default is None and not parameter.optional and key not in friction.parameters:
            yield Finding(f"the friction law {law} needs '{key}'", where, parameter.meaning)


def _in_play(mechanism: Numbers, name: str, pair: Pair, spatial: bool) -> Iterator[Finding]:
    """What else speaks of a joint that is in play, which has no one coordinate, and laws that are of others."""
    contact = mechanism.effective_joints[name].contact
    users = [f"drivers.{name}"] * (name in mechanism.drivers)
    users += [f"loads.{key}" for key, load in mechanism.loads.items() if load.joint == name]
    users += [f"springs.{key}" for key, spring in mechanism.springs.items() if spring.joint == name]
    users += [f"gears.{key}" for key, gear in mechanism.gears.items() if name in gear.joints]
    yield from faults(
        f"joints.{name}.contact",
        (contact and spatial and contact.of.rigid, "law",
         "impacts of rigid bodies are of planar joints: the ends of a pin in space would strike one by one"),
        (contact and contact.modulus is not None and pair.guided, "modulus",
         "a slider in a guide touches with an edge, whose stiffness does not follow from a modulus",
         "state stiffness: … and exponent: 1 instead"),
        *((True, "", "a joint that is in play has no one coordinate to drive, to load, to couple or to measure",
           f"remove it, or {user}") for user in users),
    )  # fmt: skip


# ---- numbers --------------------------------------------------------------------------------------------------


def joint_values(mechanism: Numbers, name: str, numbers: ParameterSet) -> Iterator[Finding]:
    """What the numbers of a joint make impossible or doubtful: sizes, plays, seats, contacts."""
    joint, where, values = mechanism.effective_joints[name], f"joints.{name}", numbers.nominal

    def value(path: str, absent: float = np.nan) -> float:
        return float(values.get(f"{where}.{path}", absent))

    def at(path: str) -> str:
        """Where a value stands: with the joint or with the defaults."""
        entry = numbers.entries.get(f"{where}.{path}")
        return entry.alias if entry and entry.alias else f"{where}.{path}"

    rolls, contact = joint.friction is not None and joint.friction.law == "rolling", joint.contact
    sizes = ["guide.length", *["pin.radius"] * (not rolls)]
    sizes += ["pin.bearing", "guide.width"] if mechanism.space == "spatial" else []
    between = float((clearance(name, values) or 0.0) + value("pin.cylindricity", 0.0))
    unmodelled = joint.pair.turns and joint.type not in PLAY_PAIRS and between != 0
    radius = f"radius: {1e3 * value('pin.radius'):.6g} mm, " * (value("pin.radius") >= 0)
    yield from faults(
        "",
        *((joint.friction is not None and value(size) == 0, at(size), "is 0, where friction needs it")
          for size in sizes),
        *((value(gap) >= value(body) > 0, at(gap),
           f"is {_mm(value(gap))}, not less than the {body.replace('.', ' ')} {_mm(value(body))}")
          for gap, body in (("pin.clearance", "pin.radius"), ("guide.clearance", "guide.length"))),
        (unmodelled, f"{where}.pin", f"the play of {_um(between)} of a {joint.type} joint is not modelled",
         f"state pin: {{{radius}clearance: 0, cylindricity: 0}} here"),
    )  # fmt: skip
    if contact is not None:
        across = between if clearance(name, values) is not None else np.nan
        yield from faults(
            where,
            (across <= 0, "contact", f"has a clearance of {across:g} m, and the joint is in play"),
            *((value(key) <= 0, key, f"is {value(key):g} m, and the joint is in play")
              for key in ("pin.length", "pin.bearing", "pin.end_float")),
            (value("contact.restitution") == 0 and not contact.of.rigid, "contact.restitution",
             "is 0, which is of rigid bodies alone"),
            (contact.modulus is not None and value("contact.exponent", 1.5) != 1.5, "contact.exponent",
             "the stiffness by a modulus goes with the exponent 1.5"),
        )  # fmt: skip
    if has_play(joint):
        yield from _fitted(mechanism, name, joint, value("pin.radius"), value("pin.hole_radius"), at)
        yield from _play_size(mechanism, name, joint, values)


def _fit(mechanism: Numbers, name: str) -> FitLimits | Finding | None:
    """The play of a joint's fit, or why it has none; None without a fit, or where its size has no value."""
    pin = mechanism.effective_joints[name].pin
    if pin is None or pin.fit is None or not mechanism.effective_joints[name].pair.turns:
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
    pin = mechanism.stated_joints[name].pin
    return f"joints.{name}.pin.fit" if pin and pin.fit else "joint_defaults.pin.fit"


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
            yield Finding(what, at("pin.hole_radius"), "a press fit is a fixed joint")
        return
    where, text = _fit_place(mechanism, name), pin.fit.source if pin.fit else ""
    if hole < radius and joint.seat not in (None, "free"):
        what = f"the nominal play of the fit {text} is {_um(hole - radius)} on the radius: an interference fit"
        yield Finding(what, where, "use another fit, fits: maximum, or seat: free")
    pressed = limits.maximum <= MEASURABLE
    if limits.minimum < -MEASURABLE or pressed:
        presses = "is a press fit, no play: it cannot turn as a bearing" if pressed else "may press"
        what = f"{text} {presses}: its play on the diameter is {_um(limits.minimum)} to {_um(limits.maximum)}"
        yield Finding(what, where, "use a shaft of class e to h, such as g6", Severity.WARNING)


def _play_size(mechanism: Numbers, name: str, joint: Joint, values: Mapping[str, Number]) -> Iterator[Finding]:
    """A play so large, or a pin so short, that what is said of small plays no longer holds."""
    where, rho = f"joints.{name}", float(play(joint, name, values))
    if not rho > 0 or joint.pair.guided:
        return
    radius, doubts = float(values.get(f"{where}.pin.radius", np.nan)), []

    def place(link: str, point: str) -> list[float]:
        path = f"links.{link}.points.{point}"
        return [float(values[f"{path}.{axis}"]) for axis in "xyz" if f"{path}.{axis}" in values]

    # the nearest other turning joint on a link of this; joints at one point count for nothing, and a loop places none
    sides = [(np.inf, "", "")]
    for link, other in product(joint.links, mechanism.effective_joints):
        mate, ends = mechanism.effective_joints[other], (place(link, name), place(link, other))
        if other != name and link in mate.links and mate.pair.turns and all(ends):
            sides.append((float(np.linalg.norm(np.subtract(*ends))), other, link))
    distance, side, link = min((side for side in sides if side[0] > 0), key=lambda side: side[0])
    axes = [[values.get(f"links.{link}.points.{point}.axis.{k}", 0.0) for k in "xyz"] for point in (name, side)]
    meeting = distance <= radius and np.any(np.cross(axes[0], axes[1]) != 0)  # no lever; an eccentric's are parallel
    if rho > LARGE * distance and not meeting:
        share = f"{100 * rho / distance:.3g} % of the {_mm(distance)} from '{name}' to '{side}'"
        doubts.append(f"a play of {_mm(rho)} is {share}: above 1 % results for small play are inaccurate")
    if mechanism.space == "spatial" and not joint.pair.ball:
        length = float(values.get(f"{where}.pin.length", values.get(f"{where}.pin.bearing", np.nan)))
        error = ellipse_error(rho, radius, length) if length > 0 else np.nan  # at β = π, 2 r play / length²
        if error > LARGE:
            circle = "the hole is modelled as a circle; for a tilted pin (an ellipse)"
            doubts.append(f"{circle} the error is up to {100 * error:.2g} % of the play {_mm(rho)}")
        leans = joint.seat not in (None, "free") or values.get(f"{where}.misalignment.tilt", 0.0) != 0
        if leans and length < 2 * radius:
            guided = f"less than its diameter {_mm(2 * radius)}: it is poorly guided"
            doubts.append(f"the pin is {_mm(length)} long, {guided}")
    for what in doubts:
        yield Finding(what, f"{where}.pin", "check units; a smaller play or a longer pin", Severity.WARNING)


def _mm(length: float) -> str:
    return f"{1e3 * length:.5g} mm"


def _um(length: float) -> str:
    return f"{1e6 * length:.4g} um"

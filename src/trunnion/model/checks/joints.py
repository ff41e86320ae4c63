"""Checks of joints: their links, sizes of pins and guides, friction, losses and contacts."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np

from trunnion.algebra.namespace import Number
from trunnion.errors import Finding, Severity
from trunnion.joints.friction import FRICTION_LAWS
from trunnion.joints.pairs import PAIRS
from trunnion.model.checks.space import coordinates
from trunnion.model.joint_parts import (
    Contact,
    Friction,
    Joint,
    clearance,
    contact_lacks,
    has_guide,
    has_pin,
    has_play,
    motions,
)
from trunnion.model.names import as_key, nearest
from trunnion.model.parameters import Numbers, ParameterSet

__all__ = ["joint_findings", "joint_values"]


def joint_findings(mechanism: Numbers) -> Iterator[Finding]:
    """Whether each joint has its links and points, and pin, guide, friction, losses and contact suit its type."""
    for name, joint in mechanism.effective_joints.items():
        where = f"joints.{name}"
        if mechanism.space == "planar" and not PAIRS[joint.type].planar:
            flat = ", ".join(pair for pair in PAIRS if PAIRS[pair].planar)
            yield Finding(f"a {joint.type} joint does not exist in the plane", where, f"use one of {flat}")
        if name in mechanism.joints:
            yield from _ends(mechanism, name, joint)
        yield from _pitch(joint, where)
        yield from _contact(joint, where, mechanism.space == "spatial")
        yield from _stiffness(mechanism, joint, where)
        if joint.contact is not None:
            yield from _contact_law(mechanism, name, joint, joint.contact)
        yield from _losses(joint, f"{where}.losses")
        if joint.friction is not None:
            own_friction = mechanism.stated_joints[name].friction
            stated_at = "joint_defaults.friction" if own_friction is None else f"{where}.friction"
            yield from _parameters_of_law(joint.friction, stated_at)
            yield from _suits(joint, joint.friction, f"{where}.friction")


def _ends(mechanism: Numbers, name: str, joint: Joint) -> Iterator[Finding]:
    """The links of a joint and its point on each."""
    where = f"joints.{name}"
    for link in dict.fromkeys(joint.links):
        if link not in mechanism.links:
            continue
        points = mechanism.links[link].points
        axis = "[1, 0]" if mechanism.space == "planar" else "[0, 0, 1]"
        if name not in points:
            remedy = f"add {as_key(name)}: {coordinates(mechanism)} to the points of '{link}'"
            yield Finding(f"the link '{link}' has no point '{name}'", where, f"{remedy} ({nearest(name, points)})")
        elif mechanism.space in PAIRS[joint.type].needs_axis and points[name].axis is None:
            yield Finding(
                f"the point '{name}' of the link '{link}' has no axis, a {joint.type} joint needs one",
                f"links.{link}.points.{name}",
                f"write {as_key(name)}: {{at: {coordinates(mechanism)}, axis: {axis}}}",
            )


def _parameters_of_law(friction: Friction, where: str) -> Iterator[Finding]:
    law = str(friction.law)  # stated or filled in
    declared = FRICTION_LAWS[law].parameters
    for parameter in friction.parameters:
        if parameter not in declared:
            what = f"the key '{parameter}' is unknown to the friction law {law}"
            yield Finding(what, f"{where}.{parameter}", nearest(parameter, ["law", "model", *declared]))
    for parameter, parameter_kind in declared.items():
        if parameter_kind.default is None and not parameter_kind.optional and parameter not in friction.parameters:
            remedy = f"add {parameter}" + f" ({parameter_kind.meaning})" * bool(parameter_kind.meaning)
            yield Finding(f"the friction law {law} needs '{parameter}'", where, remedy)


def _suits(joint: Joint, friction: Friction, where: str) -> Iterator[Finding]:
    """Whether friction by direction has a direction, and rolling friction something that rolls."""
    if "backward" in friction.parameters and (PAIRS[joint.type].count != 1 or joint.contact is not None):
        what = "in play" if joint.contact is not None else f"of the type {joint.type}"
        remedy = "state the coefficient alone; joints of one freedom have a forward and a backward"
        yield Finding(f"friction by direction in a joint {what} is not modelled", f"{where}.backward", remedy)
    if friction.law == "rolling" and (not PAIRS[joint.type].pivot or joint.contact is not None):
        what = "in play" if joint.contact is not None else f"of the type {joint.type}"
        remedy = "use it in revolute joints; of a slide on rollers state the coefficient arm over radius"
        yield Finding(f"rolling friction in a joint {what} is not modelled", f"{where}.law", remedy)


def _stiffness(mechanism: Numbers, joint: Joint, where: str) -> Iterator[Finding]:
    """Stiffness that changes nothing: where statics decides, and in the plane what a joint there does not carry."""
    if joint.stiffness is None:
        return
    if mechanism.over_constraint == "refuse":
        what, remedy = "stiffness is not used where reactions are decided", "state over_constraint: minimum-norm"
        yield Finding(what, f"{where}.stiffness.radial", remedy, Severity.NOTE)
    elif mechanism.space == "planar":
        for key in ("axial", "tilting") if has_pin(joint.type) else ("axial",):
            if getattr(joint.stiffness, key) is not None:
                what = f"a {joint.type} joint in the plane has no {key} stiffness: it is not used"
                yield Finding(what, f"{where}.stiffness.{key}", "remove it", Severity.NOTE)


def _contact(joint: Joint, where: str, spatial: bool) -> Iterator[Finding]:
    """Whether pin and guide suit the type of joint, and whether what its friction needs is stated."""
    kind = joint.type
    turns, slides = has_pin(kind), has_guide(kind)
    for part, other, suits, other_suits in (("guide", "pin", slides, turns), ("pin", "guide", turns, slides)):
        if getattr(joint, part) and not suits:
            has = f"a {other}, not a {part}" if other_suits else f"neither {other} nor {part}"
            remedy = f"state {other} instead" if other_suits else "remove it"
            yield Finding(f"a {kind} joint has {has}", f"{where}.{part}", remedy)
    if spatial and PAIRS[kind].ball and joint.pin and joint.pin.offset is not None:
        yield Finding(
            "a ball has no axis to offset its bearing along", f"{where}.pin.offset", "move the joint's points"
        )
    if joint.guide and joint.guide.height is not None and joint.contact is None:
        what = "the height of a guide is not used where it is not in play"
        yield Finding(what, f"{where}.guide.height", "remove it, or state a contact", Severity.NOTE)
    coefficient = joint.friction and joint.friction.parameters.get("coefficient")
    if joint.friction is None or (coefficient and not {"off", "none"}.isdisjoint(coefficient.names)):
        return  # none is stated, or none is meant: see `loads.unknown_name`
    if not turns and not slides:
        what = f"friction of a {kind} joint is not modelled"
        reason = (
            "this joint has no sliding motion: remove it"
            if not PAIRS[kind].count
            else "state friction: 0 for this joint"
        )
        yield Finding(what, f"{where}.friction", reason)
        return
    lacks = contact_lacks(joint, spatial)
    if "radius" in lacks:
        body = "ball" if PAIRS[kind].ball else "pin"
        remedy = "state pin: {radius: …}" + " or a fit" * (body == "pin") + ", or friction: 0"
        yield Finding(f"friction without the radius of the {body}", where, remedy)
    if "bearing" in lacks:
        what = "friction without the length of the bearing, which carries a bearing moment in space"
        yield Finding(what, where, "state pin: {bearing: …} or {length: …}, or friction: 0")
    if "length" in lacks:
        yield Finding("friction without the length of the guide", where, "state guide: {length: …}, or friction: 0")
    elif spatial and slides and joint.guide and joint.guide.width is None:
        what = "without a width of the guide its torsion about the slide is carried without friction"
        yield Finding(what, where, "state guide: {width: …} if it does not slide on a round bar", Severity.NOTE)


def _pitch(joint: Joint, where: str) -> Iterator[Finding]:
    """A pitch where there is a thread, and only there."""
    if PAIRS[joint.type].threaded and joint.pitch is None:
        remedy = "add pitch: 5 mm, the slide of one turn, negative for a left-hand thread"
        yield Finding("a helical joint without a pitch", where, remedy)
    elif not PAIRS[joint.type].threaded and joint.pitch is not None:
        yield Finding(f"a {joint.type} joint has no pitch", f"{where}.pitch", "remove it, or state type: helical")


def _losses(joint: Joint, where: str) -> Iterator[Finding]:
    """Whether the losses of a joint state something and have an axis to act about or along."""
    if joint.losses is None:
        return
    if joint.losses.constant is None and joint.losses.viscous is None:
        yield Finding("states no loss", where, "state constant: …, viscous: … or both")
    elif not motions(joint.type):
        remedy = "give losses to a revolute, prismatic, cylindrical or helical joint"
        yield Finding(f"a {joint.type} joint has no one axis for a loss to act about or along", where, remedy)


def _contact_law(mechanism: Numbers, name: str, joint: Joint, contact: Contact) -> Iterator[Finding]:
    """Whether a joint can be in play, and whether its contact states what its law needs."""
    where, pair = f"joints.{name}.contact", PAIRS[joint.type]
    spatial = mechanism.space == "spatial"
    kinds = [
        kind
        for kind, pair_kind in PAIRS.items()
        if (pair_kind.bored if spatial else pair_kind.planar and (pair_kind.pivot or pair_kind.guided))
    ]
    if joint.type not in kinds:
        what = f"the contact of a {joint.type} joint of a {mechanism.space} mechanism is not modelled"
        yield Finding(what, where, f"remove it; joints of the types {' and '.join(kinds)} can be in play there")
        return
    if not has_play(joint) or (spatial and not _bored_wide(joint)):
        part, key = ("guide", "clearance") if pair.guided else ("pin", "clearance or hole_radius")
        yield Finding("a joint that is in play needs its clearance", where, f"add joints.{name}.{part}.{key}")
    if spatial:
        yield from _in_space(joint, contact, name)
    for section, named in (("drivers", mechanism.drivers), ("loads", mechanism.loads), ("springs", mechanism.springs)):
        for other, pair_kind in named.items():
            if (other if section == "drivers" else getattr(pair_kind, "joint", None)) == name:
                what = "a joint that is in play has no one coordinate to drive, to load or to measure"
                yield Finding(what, where, f"remove it, or {section}.{other}")
    if any(name in gear.joints for gear in mechanism.gears.values()):
        yield Finding("a joint of a gear pair cannot be in play", where, "remove it, or the gear pair")
    yield from _needs(joint, contact, where)


def _bored_wide(joint: Joint) -> bool:
    """Whether a pin states how much wider its hole is, be it not at all."""
    pin = joint.pin
    return pin is not None and (pin.clearance is not None or (pin.radius is not None and pin.hole_radius is not None))


def _in_space(joint: Joint, contact: Contact, name: str) -> Iterator[Finding]:
    """What a pin in play needs in space, where it touches with its ends and its shoulders."""
    where, pin = f"joints.{name}", joint.pin
    if contact.of.rigid:
        what = "impacts of rigid bodies are of planar joints: the ends of a pin in space would strike one by one"
        yield Finding(what, f"{where}.contact.law", "use another law, with stiffness or modulus")
    if pin is None or (pin.length is None and pin.bearing is None):
        what = "a pin in play in space touches with its ends, whose distance is not stated"
        yield Finding(what, f"{where}.contact", f"add {where}.pin.length")
    if PAIRS[joint.type].pivot and (pin is None or pin.end_float is None):
        what = "a pin in play in space has its shoulders to keep it along its axis, whose play is not stated"
        remedy = f"add {where}.pin.end_float, end to end, or use type: cylindrical for a pin without shoulders"
        yield Finding(what, f"{where}.contact", remedy)


def _needs(joint: Joint, contact: Contact, where: str) -> Iterator[Finding]:
    """What tells how stiff a contact is."""
    if contact.of.rigid:
        return
    both = contact.stiffness is not None and contact.modulus is not None
    if both or (contact.stiffness is None and contact.modulus is None):
        remedy = "state stiffness: 60e9 N/m^1.5, or modulus: 210 GPa"
        yield Finding(f"states {'both' if both else 'neither'} of stiffness and modulus", where, remedy)
        return
    if contact.modulus is not None and PAIRS[joint.type].guided:
        what = "a slider in a guide touches with an edge, whose stiffness does not follow from a modulus"
        yield Finding(what, f"{where}.modulus", "state stiffness: … and exponent: 1 instead")
    elif contact.modulus is not None and (joint.pin is None or joint.pin.radius is None):
        yield Finding("the stiffness by a modulus needs the pin's radius", where, "add pin: {radius: 10 mm}")


def joint_values(mechanism: Numbers, name: str, numbers: ParameterSet) -> Iterator[Finding]:
    """What the numbers of a joint make doubtful: friction without a size, a play as large as its pin."""
    joint, where = mechanism.effective_joints[name], f"joints.{name}"

    def value(path: str) -> Number:
        return numbers.nominal.get(f"{where}.{path}", np.nan)

    def stated(path: str) -> str:
        """Where a value stands: with the joint or with the defaults."""
        entry = numbers.entries[f"{where}.{path}"]
        return entry.alias or entry.path

    yield from _contact_values(joint, numbers.nominal, where)
    if joint.friction and joint.friction.law:
        for path in ("friction.coefficient", "friction.backward"):
            if (number := value(path)) > 1:
                what, remedy = f"is {number:g}, above 1", "check it: dry metals have 0.1 to 0.6"
                yield Finding(what, stated(path), remedy, Severity.WARNING)
        across = ("pin.bearing", "guide.width") if mechanism.space == "spatial" else ()
        sizes = ("pin.radius",) * (joint.friction.law != "rolling") + ("guide.length", *across)
        for size in sizes:
            if value(size) == 0:
                yield Finding("is 0, where friction needs it", stated(size), "give a value above 0")
    for part, size in (("pin", "radius"), ("guide", "length")):
        clearance, body = value(f"{part}.clearance"), value(f"{part}.{size}")
        if clearance >= body > 0:
            what = f"is {1e3 * clearance:g} mm, not less than the {size} {1e3 * body:g} mm of the {part}"
            yield Finding(what, stated(f"{part}.clearance"), "check its unit")


def _contact_values(joint: Joint, values: Mapping[str, float], where: str) -> Iterator[Finding]:
    """Whether the numbers of a contact can be those of one. values: by path; where: path of the joint."""
    contact = joint.contact
    if contact is None:
        return
    path = f"{where}.contact"
    gap = clearance(where.removeprefix("joints."), values)
    across = np.nan if gap is None else gap + values.get(f"{where}.pin.cylindricity", 0.0)
    if across <= 0:
        what = f"is in play with a clearance of {across:g} m"
        yield Finding(what, path, "give a clearance above 0, or remove the contact")
    for key in ("length", "bearing", "end_float"):
        number = values.get(f"{where}.pin.{key}", np.nan)
        if number <= 0:
            what = f"is {number:g} m, and the joint is in play"
            yield Finding(what, f"{where}.pin.{key}", "give a length above 0")
    restitution = values.get(f"{path}.restitution", np.nan)
    least = "from 0" if contact.of.rigid else "above 0"
    if restitution < 0 or restitution > 1 or (restitution == 0 and not contact.of.rigid):
        what = f"is {restitution:g}, which is not {least} and at most 1"
        yield Finding(what, f"{path}.restitution", "give the speed after over the speed before an impact, such as 0.8")
    if contact.modulus is not None and values.get(f"{path}.exponent", 1.5) != 1.5:
        what = "the stiffness by a modulus goes with the exponent 1.5"
        yield Finding(what, f"{path}.exponent", "remove it, or state the stiffness itself")

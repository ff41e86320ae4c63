"""Checks of joints: their links, sizes of pins and guides, friction, losses and contacts."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np

from trunnion.errors import Finding
from trunnion.joints.pairs import PAIRS
from trunnion.model.joint_parts import Contact, Joint, clearance, has_play
from trunnion.model.parameters import Numbers

__all__ = [
    "contact_law",
    "contact_values",
]


def contact_law(mechanism: Numbers, name: str, joint: Joint, contact: Contact) -> Iterator[Finding]:
    """Whether a joint can be in play, and whether its contact states what its law needs."""
    where, pair = f"joints.{name}.contact", PAIRS[joint.type]
    spatial = mechanism.space == "spatial"
    kinds = [
        kind for kind, one in PAIRS.items() if (one.bored if spatial else one.planar and (one.pivot or one.guided))
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
        for other, one in named.items():
            if (other if section == "drivers" else getattr(one, "joint", None)) == name:
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


def contact_values(joint: Joint, values: Mapping[str, float], where: str) -> Iterator[Finding]:
    """Whether the numbers of a contact can be those of one. values: by path; where: path of the joint."""
    contact = joint.contact
    if contact is None:
        return
    path = f"{where}.contact"
    stated = clearance(where.removeprefix("joints."), values)
    across = np.nan if stated is None else stated + values.get(f"{where}.pin.cylindricity", 0.0)
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

"""Checks of a joint whose pin or slider is in play as it moves in time: its contact law and what that needs."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING

import numpy as np

from trunnion.errors import Finding
from trunnion.joints.contact import CONTACT_LAWS
from trunnion.joints.pairs import PAIRS
from trunnion.model.contact import has_play, play

if TYPE_CHECKING:
    from trunnion.model.joint_parts import Contact, Joint
    from trunnion.model.numbers import Numbers

__all__ = ["contact_law", "contact_values"]

MATERIAL = ("modulus", "poisson_ratio", "hole_modulus", "hole_poisson_ratio")


def contact_law(mechanism: Numbers, name: str, joint: Joint, contact: Contact) -> Iterator[Finding]:
    """Whether a joint can be in play, and whether its contact states what its law needs."""
    where = f"joints.{name}.contact"
    kinds = [kind for kind, pair in PAIRS.items() if pair.planar and (pair.pivot or pair.guided)]
    if mechanism.space != "planar" or joint.type not in kinds:
        what = f"the contact of a {joint.type} joint of a {mechanism.space} mechanism is not modelled"
        yield Finding(what, where, f"remove it; planar joints of the types {' and '.join(kinds)} can be in play")
        return
    if not has_play(joint):
        part, key = ("guide", "clearance") if PAIRS[joint.type].guided else ("pin", "clearance or hole_radius")
        yield Finding("a joint that is in play needs its clearance", where, f"add joints.{name}.{part}.{key}")
    for section, named in (("drivers", mechanism.drivers), ("loads", mechanism.loads), ("springs", mechanism.springs)):
        for other, one in named.items():
            if (other if section == "drivers" else getattr(one, "joint", None)) == name:
                what = "a joint that is in play has no one coordinate to drive, to load or to measure"
                yield Finding(what, where, f"remove it, or {section}.{other}")
    if any(name in gear.joints for gear in mechanism.gears.values()):
        yield Finding("a joint of a gear pair cannot be in play", where, "remove it, or the gear pair")
    yield from _needs(joint, contact, where)


def _needs(joint: Joint, contact: Contact, where: str) -> Iterator[Finding]:
    """What a contact lacks or states in vain."""
    if contact.of.rigid:
        yield from _rigid(contact, where)
        return
    if contact.of.elastic and contact.restitution is not None:
        yield Finding(f"'restitution' has no effect on {contact.law}", f"{where}.restitution", "remove it")
    if not contact.of.elastic and contact.restitution is None:
        elastic = ", ".join(law for law, one in CONTACT_LAWS.items() if one.elastic)
        yield Finding("'restitution' is missing", where, f"add restitution: 0.8, or law: {elastic}")
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
    if contact.modulus is None:
        for key in MATERIAL[1:]:
            if key in contact.model_fields_set:
                yield Finding(f"'{key}' has no effect without 'modulus'", f"{where}.{key}", "remove it")


def _rigid(contact: Contact, where: str) -> Iterator[Finding]:
    """What a contact of rigid bodies lacks or states in vain."""
    if contact.restitution is None:
        yield Finding("'restitution' is missing", where, "add restitution: 0.8")
    for key in ("stiffness", "exponent", *MATERIAL):
        if key in contact.model_fields_set and getattr(contact, key) is not None:
            yield Finding(f"'{key}' has no effect on {contact.law}", f"{where}.{key}", "remove it")


def contact_values(joint: Joint, values: Mapping[str, float], where: str) -> Iterator[Finding]:
    """Whether the numbers of a contact can be those of one. values: by path; where: path of the joint."""
    contact = joint.contact
    if contact is None:
        return
    path = f"{where}.contact"
    clearance = play(joint, where.removeprefix("joints."), values) if has_play(joint) else np.nan
    if clearance <= 0:
        what = f"is in play with a clearance of {clearance:g} m"
        yield Finding(what, path, "give a clearance above 0, or remove the contact")
    restitution = values.get(f"{path}.restitution", np.nan)
    least = "from 0" if contact.of.rigid else "above 0"
    if restitution < 0 or restitution > 1 or (restitution == 0 and not contact.of.rigid):
        what = f"is {restitution:g}, which is not {least} and at most 1"
        yield Finding(what, f"{path}.restitution", "give the speed after over the speed before an impact, such as 0.8")
    for key, low, high, say in (
        ("stiffness", 0.0, np.inf, "above 0"),
        ("modulus", 0.0, np.inf, "above 0"),
        ("hole_modulus", 0.0, np.inf, "above 0"),
        ("exponent", 1.0 - 1e-12, 10.0, "from 1 to 10"),
        ("poisson_ratio", -1.0, 0.5 + 1e-12, "above −1 and at most 0.5"),
        ("hole_poisson_ratio", -1.0, 0.5 + 1e-12, "above −1 and at most 0.5"),
    ):
        number = values.get(f"{path}.{key}", np.nan)
        if key in contact.model_fields_set and (number <= low or number > high):
            yield Finding(f"is {number:g}", f"{path}.{key}", f"give a number {say}")
    if contact.modulus is not None and values.get(f"{path}.exponent", 1.5) != 1.5:
        what = "the stiffness by a modulus goes with the exponent 1.5"
        yield Finding(what, f"{path}.exponent", "remove it, or state the stiffness itself")

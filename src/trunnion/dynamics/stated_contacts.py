"""The contacts that the joints in play of a mechanism have, from what the file states."""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from trunnion.algebra.dual import single
from trunnion.algebra.nested import each
from trunnion.algebra.space import slid
from trunnion.dynamics.touching import Contact, Contacts, DiscContact, EdgeContact, PinContact, ShoulderContact
from trunnion.joints.contact import hertz_stiffness
from trunnion.joints.friction import FRICTION_LAWS
from trunnion.joints.pairs import PAIRS
from trunnion.solve import shifts
from trunnion.solve.run import Run
from trunnion.solve.system import law_parameters

__all__ = ["contacts_of"]


def contacts_of(run: Run, joints: Sequence[str]) -> Contacts:
    """The contacts of joints in play of a mechanism as it is stated."""
    return Contacts(tuple(contact for joint in joints for contact in _of_joint(run, joint)))


def _of_joint(run: Run, name: str) -> Iterator[Contact]:
    joint_entry, values = run.system.mechanism.effective_joints[name], run.values
    contact, play = joint_entry.contact, shifts.play_of(run.system.mechanism.space, joint_entry.type, values, name)
    assert contact is not None  # the model's checks
    assert play is not None
    numbers = {key: single(values[path]) for key in ("restitution", "exponent", "stiffness")
             if (path := f"joints.{name}.contact.{key}") in values}  # fmt: skip
    clearance, radius = single(play.radii[0]), single(values.get(f"joints.{name}.pin.radius", 0.0))
    restitution = numbers.get("restitution", 1.0)
    law = FRICTION_LAWS[joint_entry.friction.law or "coulomb"] if joint_entry.friction else None
    if contact.of.rigid:
        stiffness = 0.0
    else:
        stiffness = numbers["stiffness"] if "stiffness" in numbers else _hertz(values, name, radius, radius + clearance)
    common: dict[str, Any] = {
        "joint": name, "clearance": clearance, "stiffness": stiffness, "exponent": numbers.get("exponent", 1.0),
        "factor": contact.of.factor(restitution), "restitution": restitution, "law": law,
        "parameters": {key: single(size) for key, size in law_parameters(law, values, name).items()} if law else {},
    }  # fmt: skip
    if run.system.mechanism.space == "spatial":
        yield from _in_space(run, name, play, radius + clearance, common)
    else:
        yield from _in_plane(run, name, radius + clearance, common)


def _in_plane(run: Run, name: str, wall: float, common: dict[str, Any]) -> Iterator[Contact]:
    """A pin, or the four corners of a slider."""
    kind, (first, second) = run.system.joints[name]
    values, holes = run.values, run.system.holes(run.values)
    places: list[Any] = [tuple(single(part) for part in holes[link, name]) for link in (first, second)]
    if not PAIRS[kind].guided:
        pin, hole = places[0][:2], places[1][:2]
        yield PinContact(label=name, body=first, other=second, pin=pin, hole=hole, wall=wall, **common)
        return
    length = single(values[f"joints.{name}.guide.length"])
    height = single(values.get(f"joints.{name}.guide.height", 0.0))
    x, y, c, s = places[1]
    for number, (end, side) in enumerate(((-1, 1.0), (1, 1.0), (-1, -1.0), (1, -1.0)), 1):
        along, across = 0.5 * end * length, 0.5 * side * height
        corner = x + along * c - across * s, y + along * s + across * c
        yield EdgeContact(
            label=f"{name}.{number}", body=second, other=first, corner=corner, line=places[0], side=side,
            distance=0.5 * height + common["clearance"], **common,
        )  # fmt: skip


def _in_space(run: Run, name: str, play: shifts.Play, wall: float, common: dict[str, Any]) -> Iterator[Contact]:
    """The two ends of a hole, each with half the stiffness, and of a pin that does not slide its shoulders."""
    _, (first, second) = run.system.joints[name]
    holes = run.system.holes(run.values)
    axle, middle = (
        each(shifts.hole(holes[link, name], run.values, name), single) for link in (first, second)
    )  # the joint's points lie off both alike
    links: dict[str, Any] = {"joint": name, "body": first, "other": second, "axle": axle}
    half = 0.5 * common["stiffness"]
    for number, side in ((1, -0.5), (2, 0.5)):
        end = slid(middle, side * single(play.length))
        entry = {**common, **links, "stiffness": half, "hole": end}
        yield DiscContact(label=f"{name}.end_{number}", wall=wall, **entry)
    for number, (i, side) in enumerate(itertools.product(play.model.axial, (-1.0, 1.0)), 1):
        entry = {**common, **links, "hole": middle, "clearance": single(play.radii[i]), "law": None, "parameters": {}}
        yield ShoulderContact(label=f"{name}.shoulder_{number}", side=side, **entry)


def _hertz(values: Mapping[str, Any], name: str, pin: float, hole: float) -> float:
    keys = ("modulus", "hole_modulus", "poisson_ratio", "hole_poisson_ratio")
    return hertz_stiffness(pin, hole, *(single(values[f"joints.{name}.contact.{key}"]) for key in keys))

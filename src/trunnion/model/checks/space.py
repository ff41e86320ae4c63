"""Checks of spatial models: elements of joints, pitches, contacts with friction, loops; what only one space has."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np

from trunnion.algebra.namespace import Number
from trunnion.errors import Finding, Severity, counted
from trunnion.joints.pairs import PAIRS
from trunnion.model.joint_parts import contact_lacks, has_guide, has_pin, motions
from trunnion.model.names import nearest
from trunnion.model.parameters import Numbers
from trunnion.model.parts import Joint, LoopJoint, PolarPoint

__all__ = ["contact", "coordinates", "direction_values", "driven", "loop", "pitch", "resisted", "space"]

Values = Mapping[str, Number]
# Sine of the angle below which `x` is taken to lie along `axis`: what is left of it across is rounding of the file.
ALONG = 1e-6
LOOP_PAIRS = tuple(
    kind for kind, pair in PAIRS.items() if pair.one_axis
)  # those whose motion is a dual angle about one axis
DRIVEN_PAIRS = tuple(kind for kind, pair in PAIRS.items() if pair.drivable)


def coordinates(mechanism: Numbers) -> str:
    """How a position is written in this model."""
    return "[x, y]" if mechanism.space == "planar" else "[x, y, z]"


def space(mechanism: Numbers) -> Iterator[Finding]:
    """What is stated that only the other space has."""
    if mechanism.space == "planar":
        if "over_constraint" in mechanism.model_fields_set:
            yield Finding("is for spatial models", "over_constraint", "remove it, or state space: spatial")
        guides = {f"joints.{name}": joint.guide for name, joint in mechanism.stated_joints.items()}
        for where, guide in {**guides, "joint_defaults": mechanism.joint_defaults.guide}.items():
            if guide is not None and guide.width is not None:
                what = "a guide in the plane carries no torsion about its slide"
                yield Finding(what, f"{where}.guide.width", "remove it")
        return
    for name, link in mechanism.links.items():
        if isinstance(link.centre, PolarPoint):
            what = "distance and angle place a point in the plane only"
            yield Finding(what, f"links.{name}.centre", "write [x, y, z]")


# ---- joints ---------------------------------------------------------------------------------------------------


def contact(joint: Joint, where: str, spatial: bool) -> Iterator[Finding]:
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


def pitch(joint: Joint, where: str) -> Iterator[Finding]:
    """A pitch where there is a thread, and only there."""
    if PAIRS[joint.type].threaded and joint.pitch is None:
        remedy = "add pitch: 5 mm, the slide of one turn, negative for a left-hand thread"
        yield Finding("a helical joint without a pitch", where, remedy)
    elif not PAIRS[joint.type].threaded and joint.pitch is not None:
        yield Finding(f"a {joint.type} joint has no pitch", f"{where}.pitch", "remove it, or state type: helical")


def direction_values(mechanism: Numbers, values: Values) -> Iterator[Finding]:
    """A direction x of an element along its axis, from which no rotation can be counted."""
    if mechanism.space == "planar":
        return
    for name, link in mechanism.links.items():
        for point, place in link.points.items():
            path = f"links.{name}.points.{point}"
            if place.x is None or len(place.x) != 3 or (place.axis is not None and len(place.axis) != 3):
                continue
            x, axis = np.array([values[f"{path}.x.{one}"] for one in "xyz"], dtype=float), np.array([0.0, 0.0, 1.0])
            if place.axis is not None:
                axis = np.array([values[f"{path}.axis.{one}"] for one in "xyz"], dtype=float)
            across, size = np.linalg.norm(np.cross(axis, x)), np.linalg.norm(axis) * np.linalg.norm(x)
            if size > 0 and across <= ALONG * size:
                what = "lies along the axis" + ("" if place.axis is not None else " [0, 0, 1]")
                yield Finding(what, f"{path}.x", "give a direction across the axis, or none")


def driven(name: str, joint: Joint, where: str) -> Iterator[Finding]:
    """Whether one number can say how far the joint has moved."""
    if not PAIRS[joint.type].drivable:
        count = PAIRS[joint.type].count
        moves = f"has {counted(count, 'freedom')}" if count else "does not move"
        what = f"the joint '{name}' is {joint.type}: it {moves} and cannot be driven by one number"
        yield Finding(what, where, f"drive one that is {', '.join(DRIVEN_PAIRS[:-1])} or {DRIVEN_PAIRS[-1]}")


def resisted(joint: Joint, key: str, freedom: str, where: str) -> Iterator[Finding]:
    """Whether a joint has the motion that a load resists."""
    if freedom in motions(joint.type):
        return
    what, remedy = f"a {joint.type} joint has no {freedom} to resist", "remove it"
    if not motions(joint.type) and PAIRS[joint.type].count:
        what = f"a {joint.type} joint has no one axis that a {key.replace('_', ' ')} could act about or along"
        remedy = "resist a revolute, prismatic, cylindrical or helical joint, or state a force or moment on a link"
    yield Finding(what, f"{where}.{key}", remedy)


# ---- loops ----------------------------------------------------------------------------------------------------


def loop(mechanism: Numbers) -> Iterator[Finding]:
    """Whether the rows of the loop make one chain, and the frames of its links are there."""
    rows = mechanism.loop
    yield from _frames(mechanism)
    if not rows:
        return
    if mechanism.space == "planar":
        yield Finding("a loop is spatial", "loop", "state space: spatial")
    if mechanism.joints:
        yield Finding("joints and loop are both given", "joints", "keep the loop or the joints")
    if len(rows) < 2:
        yield Finding("one joint makes no loop", "loop", "add the joints and links up to the ground again")
    for kind, names in (("joint", [row.joint for row in rows]), ("link", [row.link for row in rows])):
        for name in sorted({name for name in names if names.count(name) > 1}):
            yield Finding(f"the {kind} '{name}' occurs in several rows", "loop", "give each row its own")
    fixed, links = mechanism.fixed_link, [row.link for row in rows]
    if fixed in mechanism.links and fixed not in links:
        where = "ground" if mechanism.ground else "loop"
        remedy = "let a row end at it: its link is " + ", ".join(f"'{one}'" for one in links) + " now"
        yield Finding(f"the fixed link '{fixed}' is not a link of the loop", where, remedy)
    for row in rows:
        yield from _row(row)
    for name in links:
        for point in mechanism.links[name].points if name in mechanism.links else ():
            if point in mechanism.stated_joints and name in mechanism.stated_joints[point].links:
                what = f"the joint '{point}' is where the loop has it, and cannot be placed again"
                yield Finding(what, f"links.{name}.points.{point}", "rename the point")


def _row(row: LoopJoint) -> Iterator[Finding]:
    where = f"loop.{row.joint}"
    if row.type not in LOOP_PAIRS:
        what = f"a {row.type} joint has no place in the table of a loop, whose joints move about and along one axis"
        remedy = f"use {', '.join(LOOP_PAIRS[:-1])} or {LOOP_PAIRS[-1]}, or state links and joints instead of the loop"
        yield Finding(what, f"{where}.type", remedy)
        return
    for freedom in ("slide", "rotation"):
        if getattr(row, freedom) is not None and freedom in motions(row.type):
            what = f"the {freedom} of a {row.type} joint is free, not constant"
            yield Finding(what, f"{where}.{freedom}", "remove it")


def _frames(mechanism: Numbers) -> Iterator[Finding]:
    for name, link in mechanism.links.items():
        if link.frame is None:
            continue
        ends = [joint for joint, one in mechanism.effective_joints.items() if name in one.links]
        if not mechanism.loop:
            yield Finding("frame is for the links of a loop", f"links.{name}.frame", "remove it")
        elif ends and link.frame not in ends:
            what = f"'{link.frame}' is not a joint of the link '{name}'"
            yield Finding(what, f"links.{name}.frame", nearest(link.frame, ends))

"""Checks of spatial models: elements of joints, pitches, contacts with friction, loops; what only one space has."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np

from trunnion.algebra.namespace import Number
from trunnion.errors import Finding
from trunnion.joints.pairs import PAIRS
from trunnion.model.joint_parts import motions
from trunnion.model.names import nearest
from trunnion.model.parameters import Numbers
from trunnion.model.parts import LoopJoint, PolarPoint

__all__ = ["coordinates", "direction_values", "loop", "space"]

Values = Mapping[str, Number]
# Sine of the angle below which `x` is taken to lie along `axis`: what is left of it across is rounding of the file.
ALONG = 1e-6
LOOP_PAIRS = tuple(
    kind for kind, pair in PAIRS.items() if pair.one_axis
)  # those whose motion is a dual angle about one axis


def coordinates(mechanism: Numbers) -> str:
    """How a position is written in this model."""
    return "[x, y]" if mechanism.space == "planar" else "[x, y, z]"


def space(mechanism: Numbers) -> Iterator[Finding]:
    """What is stated that only the other space has."""
    if mechanism.space == "planar":
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


def direction_values(mechanism: Numbers, values: Values) -> Iterator[Finding]:
    """A direction x of an element along its axis, from which no rotation can be counted."""
    if mechanism.space == "planar":
        return
    for name, link in mechanism.links.items():
        for point, place in link.points.items():
            path = f"links.{name}.points.{point}"
            if place.x is None or len(place.x) != 3 or (place.axis is not None and len(place.axis) != 3):
                continue
            x, axis = (
                np.array([values[f"{path}.x.{axis_name}"] for axis_name in "xyz"], dtype=float),
                np.array([0.0, 0.0, 1.0]),
            )
            if place.axis is not None:
                axis = np.array([values[f"{path}.axis.{axis_name}"] for axis_name in "xyz"], dtype=float)
            across, size = np.linalg.norm(np.cross(axis, x)), np.linalg.norm(axis) * np.linalg.norm(x)
            if size > 0 and across <= ALONG * size:
                what = "lies along the axis" + ("" if place.axis is not None else " [0, 0, 1]")
                yield Finding(what, f"{path}.x", "give a direction across the axis, or none")


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
        remedy = "let a row end at it: its link is " + ", ".join(f"'{link}'" for link in links) + " now"
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
        ends = [joint for joint, joint_entry in mechanism.effective_joints.items() if name in joint_entry.links]
        if not mechanism.loop:
            yield Finding("frame is for the links of a loop", f"links.{name}.frame", "remove it")
        elif ends and link.frame not in ends:
            what = f"'{link.frame}' is not a joint of the link '{name}'"
            yield Finding(what, f"links.{name}.frame", nearest(link.frame, ends))

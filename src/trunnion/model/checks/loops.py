"""Checks of loops and of the axes of points: what only spatial models have."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np

from trunnion.algebra.namespace import Number
from trunnion.errors import Finding
from trunnion.joints.pairs import PAIRS
from trunnion.model.joint_parts import motions
from trunnion.model.names import nearest
from trunnion.model.parameters import Numbers
from trunnion.model.parts import PolarPoint
from trunnion.model.rules import stated_wrongly

__all__ = ["coordinates", "direction_values", "loop"]

# Sine of the angle below which `x` is taken to lie along `axis`: what is left of it across is rounding of the file.
ALONG = 1e-6
LOOP_PAIRS = tuple(kind for kind, pair in PAIRS.items() if pair.one_axis)  # whose motion is a dual angle about one axis


def coordinates(mechanism: Numbers) -> str:
    """How a position is written in this model."""
    return "[x, y]" if mechanism.space == "planar" else "[x, y, z]"


def direction_values(mechanism: Numbers, values: Mapping[str, Number]) -> Iterator[Finding]:
    """A direction x of an element along its axis, from which no rotation can be counted."""
    for name, link in mechanism.links.items() if mechanism.space == "spatial" else ():
        for point, place in link.points.items():
            path = f"links.{name}.points.{point}"
            if place.x is None:
                continue
            x = [float(values[f"{path}.x.{letter}"]) for letter in "xyz"]
            axis = [float(values[f"{path}.axis.{letter}"]) for letter in "xyz"] if place.axis else [0.0, 0.0, 1.0]
            across, size = np.linalg.norm(np.cross(axis, x)), np.linalg.norm(axis) * np.linalg.norm(x)
            if size > 0 and across <= ALONG * size:
                what = "lies along the axis" + ("" if place.axis is not None else " [0, 0, 1]")
                yield Finding(what, f"{path}.x", "give a direction across the axis, or none")


def loop(mechanism: Numbers) -> Iterator[Finding]:
    """Whether the rows of the loop make one chain."""
    rows, fixed = mechanism.loop, mechanism.fixed_link
    yield from _frames(mechanism)
    links, joints = [row.link for row in rows], [row.joint for row in rows]
    now = ", ".join(f"'{link}'" for link in links)
    again = sorted({name for names in (joints, links) for name in names if names.count(name) > 1})
    remedy = f"use {', '.join(LOOP_PAIRS[:-1])} or {LOOP_PAIRS[-1]}, or state links and joints instead"
    yield from stated_wrongly(
        (bool(rows) and mechanism.space == "planar", "a loop is spatial", "loop", "state space: spatial"),
        (bool(rows and mechanism.joints), "joints and loop are both given", "joints", "keep the loop or the joints"),
        (len(rows) == 1, "one joint makes no loop", "loop", "add the joints and links up to the ground again"),
        *((True, f"the joint or link '{name}' occurs in several rows", "loop", "give each row its own")
          for name in again),
        (bool(rows) and fixed in mechanism.links and fixed not in links,
         f"the fixed link '{fixed}' is not a link of the loop", "ground" if mechanism.ground else "loop",
         f"let a row end at it: its link is {now} now"),
        *((row.type not in LOOP_PAIRS,
           f"a {row.type} joint has no place in the table of a loop, whose joints move about one axis",
           f"loop.{row.joint}.type", remedy) for row in rows),
        *((getattr(row, freedom) is not None, f"the {freedom} of a {row.type} joint is free, not constant",
           f"loop.{row.joint}.{freedom}", "remove it") for row in rows for freedom in motions(row.type)),
    )  # fmt: skip


def _frames(mechanism: Numbers) -> Iterator[Finding]:
    """Whether the frames of links, and their points, are such as a loop leaves free to state."""
    for name, link in mechanism.links.items():
        where = f"links.{name}"
        ends = [joint for joint, entry in mechanism.effective_joints.items() if name in entry.links]
        placed = [point for point in link.points if mechanism.loop and point in ends]
        frame = link.frame if mechanism.loop else None
        yield from stated_wrongly(
            (link.frame is not None and frame is None, "frame is for the links of a loop", f"{where}.frame",
             "remove it"),
            (frame is not None and bool(ends) and frame not in ends, f"'{frame}' is not a joint of the link '{name}'",
             f"{where}.frame", nearest(frame or "", ends)),
            (mechanism.space == "spatial" and isinstance(link.centre, PolarPoint),
             "distance and angle place a point in the plane only", f"{where}.centre", "write [x, y, z]"),
            *((True, f"the joint '{point}' is where the loop has it, and cannot be placed again",
               f"{where}.points.{point}", "rename the point") for point in placed),
        )  # fmt: skip

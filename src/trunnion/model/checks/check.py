"""Checks of a model that need nothing but the model: names, dimensions, and data that no linkage can have.

Each check yields findings; `check_model` runs them all. What needs the structure (whether the drivers suffice,
whether it can be assembled) is checked where the structure is known.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator
from dataclasses import replace

import numpy as np

from trunnion.errors import Finding, Severity
from trunnion.joints.pairs import PAIRS
from trunnion.model.checks.drivers import driver_findings, gears
from trunnion.model.checks.errors import errors, joint_errors
from trunnion.model.checks.joints import joint_findings
from trunnion.model.checks.loads import expression_name, load_findings, motion_dimensions, springs, tables, unknown_name
from trunnion.model.checks.magnitudes import Bare, magnitudes, plain_dimensions, radians, thousands, unitless_angles
from trunnion.model.checks.measures import check_measure, measure_values
from trunnion.model.checks.space import coordinates, loop, space
from trunnion.model.checks.tolerances import (
    cost_names,
    cost_values,
    end_of_motion,
    stated_entries,
    tolerance_names,
    tolerance_values,
)
from trunnion.model.checks.values import check_values
from trunnion.model.joint_parts import motions
from trunnion.model.names import ERRORS, nearest
from trunnion.model.parameters import Numbers, ParameterSet, dimension_errors
from trunnion.model.parts import AT
from trunnion.model.quantity import UNREADABLE, evaluation_order
from trunnion.model.rules import InSpace, Refers, key_findings
from trunnion.model.tolerances import ends_motion
from trunnion.model.units import ANY, Dimension, UnitError

__all__ = ["check_model"]


def check_model(mechanism: Numbers, lost: Collection[str] = ()) -> list[Finding]:
    """Everything wrong or doubtful with a model, in the order of its sections.

    lost: names of entries that could not be read; what follows from their absence is not reported.
    """
    unreadable: set[str] = set()
    if "space" not in mechanism.model_fields_set and _looks_spatial(mechanism):
        what = "this is a spatial model: it has a loop, or points with three coordinates"
        return [Finding(what, "space", "state space: spatial")]
    findings = [
        *_quantities(mechanism, unreadable),
        *key_findings(mechanism),
        *space(mechanism),
        *_links(mechanism),
        *joint_findings(mechanism),
    ]
    findings += [] if lost else _absent(mechanism)
    findings += [*loop(mechanism), *gears(mechanism), *driver_findings(mechanism), *load_findings(mechanism)]
    findings += [*errors(mechanism), *joint_errors(mechanism)]
    findings += [*springs(mechanism), *_others(mechanism), *_tolerances(mechanism)]
    numbers = (
        ParameterSet(mechanism.entries, mechanism.dimensions, unreadable) if unreadable else mechanism.parameter_set
    )
    with np.errstate(all="ignore"):  # absurd numbers may overflow in a check; they are still only numbers
        findings += [*check_values(mechanism, numbers), *magnitudes(mechanism, numbers)]
        findings += measure_values(mechanism, numbers)
        findings += [*tolerance_values(mechanism, numbers), *cost_values(mechanism, numbers)]
    findings = list(dict.fromkeys(findings))  # a default that several joints share is found once
    if lost and not mechanism.drivers:  # the one that there is could not be read
        findings = [finding for finding in findings if finding.remedy != "state a driver"]
    return [finding for finding in findings if not any(_speaks_of(finding, name) for name in lost)]


def _looks_spatial(mechanism: Numbers) -> bool:
    """Whether most that is stated has three coordinates, or there is a loop."""
    sizes = [len(place.at) for link in mechanism.links.values() for place in link.points.values()]
    return bool(mechanism.loop) or (sizes.count(3) > len(sizes) / 2)


def _speaks_of(finding: Finding, name: str) -> bool:
    """Whether a finding is about an entry, or asks for it."""
    asks = f"state {name}: {{" in finding.remedy
    return f"'{name}'" in finding.what or name in finding.where.split(".") or asks


def _quantities(mechanism: Numbers, unreadable: set[str]) -> Iterator[Finding]:
    """Names and dimensions in every expression; `unreadable` receives the paths that have no value."""
    dimensions: dict[str, Dimension | None] = {}
    yield from _dimensions(mechanism, dimensions, unreadable)
    yield from tables(mechanism, dimensions)
    moving = {**motion_dimensions(mechanism, dimensions), **dimensions}
    plain, bare = plain_dimensions(mechanism.dimensions), list[Bare]()
    used: set[str] = set()
    entries = mechanism.entries
    for entry in (*entries, *stated_entries(mechanism, entries)):
        names = entry.quantity.names
        used.update(names)
        if entry.quantity is UNREADABLE:
            unreadable.add(entry.path)
        if entry.alias or entry.path in unreadable:
            continue
        sayable = moving if entry.varies else dimensions
        if missing := [name for name in names if name not in sayable]:
            unreadable.add(entry.path)
            for name in missing:
                finding = unknown_name(mechanism, name, entry.where, entry.quantity.source, dimensions)
                respelt = entry.quantity.respelt(entry.kind)
                yield replace(finding, remedy=f"write {respelt}") if respelt else finding
            continue
        if entry.varies and entry.quantity.tolerance:
            what = f"'{entry.quantity.source}' varies with the motion and has a tolerance"
            yield Finding(what, entry.where, "state a dimension with the tolerance and use it in the expression")
        if ends_motion(entry.path) and entry.quantity.tolerance:
            yield end_of_motion(entry.path, entry.where)
        try:
            measures = entry.quantity.check(sayable, entry.kind)
            yield from thousands(entry.where, entry.quantity, measures)
            bare += unitless_angles(mechanism, entry, sayable, plain)
        except UnitError as error:
            yield Finding(error.what, entry.where, error.remedy)
    yield from radians(mechanism, bare)
    rubs = any(joint.friction is not None for joint in mechanism.effective_joints.values())
    remedy = "remove it" if rubs else "remove it, unless it is of friction, which is off"
    for name in mechanism.dimensions:
        if name not in used:
            yield Finding("is not used", f"dimensions.{name}", remedy, Severity.NOTE)


def _dimensions(mechanism: Numbers, by_name: dict[str, Dimension | None], unreadable: set[str]) -> Iterator[Finding]:
    """Names of the dimensions and what each measures: `by_name` receives it, `unreadable` the paths without a value."""
    dimensions = mechanism.dimensions
    by_name.update(dict.fromkeys(dimensions))
    deviations = dimension_errors(mechanism.entries) if mechanism.errors else {}
    order, circles = evaluation_order(dimensions, deviations)
    for circle in circles:
        unreadable.update(f"{before}dimensions.{name}" for name in circle for before in ("", ERRORS))
        ring = " → ".join([*circle, circle[0]])
        yield Finding(f"is defined by itself: {ring}", f"dimensions.{circle[0]}", "give one of them a value")
    for name in order:
        yield from expression_name(name, f"dimensions.{name}")
        quantity, path = dimensions[name], f"dimensions.{name}"
        if set(quantity.names) <= by_name.keys() and path not in unreadable:
            try:
                by_name[name] = quantity.check(by_name, ANY)
            except UnitError as error:
                unreadable.add(path)
                yield Finding(error.what, path, error.remedy)


def _absent(mechanism: Numbers) -> Iterator[Finding]:
    """What every mechanism needs and this one lacks."""
    links, joints = mechanism.links, mechanism.effective_joints
    if not links and not mechanism.loop:
        yield Finding("there are no links", "links", "state at least a ground and a moving link")
        return
    if not joints:
        yield Finding("there are no joints", "joints", "join the links")
        return
    jointed = {name for joint in joints.values() for name in joint.links}
    for name in links:
        if name not in jointed:
            remedy = (
                "pin another link to it" if name == mechanism.fixed_link else "join it to another link or remove it"
            )
            yield Finding(f"no joint connects the link '{name}'", f"links.{name}", remedy)
    if not mechanism.fixed_link:
        yield Finding(
            "no link is fixed", "ground", "name the fixed link 'ground' or 'frame', or state ground: <its name>"
        )


def _links(mechanism: Numbers) -> Iterator[Finding]:
    for name, link in mechanism.links.items():
        where = f"links.{name}"
        if link.inertia_about == "origin" and not link.model_fields_set & {"inertia"}:
            yield Finding("inertia_about is given without an inertia", where, "give the inertia", Severity.WARNING)


def _tolerances(mechanism: Numbers) -> Iterator[Finding]:
    """What tolerances and costs name, and what they lack."""
    if mechanism.variations or mechanism.correlations or "tolerance_defaults" in mechanism.model_fields_set:
        yield from tolerance_names(mechanism, mechanism.entries)
    yield from cost_names(mechanism)


def _others(mechanism: Numbers) -> Iterator[Finding]:
    """Assembly hints and measures."""
    joints, points = mechanism.effective_joints, mechanism.points
    for name, hint in mechanism.assembly.items():
        where = f"assembly.{name}"
        link, _, point = name.partition(".")
        if isinstance(hint, str):
            if name not in points or name == mechanism.fixed_link:
                moving = [point_name for point_name in points if point_name != mechanism.fixed_link]
                what = f"'{hint}' chooses an assembly of a moving link, and '{name}' is none"
                yield Finding(what, where, nearest(name, moving))
            continue
        if name == AT and name not in joints:
            if isinstance(hint, tuple) or not mechanism.drivers:
                what = "it says where the driver is when points are where the hints say"
                yield Finding(what, where, "write its coordinate, as at: 30 deg" if mechanism.drivers else "remove it")
            continue
        if point and point not in points.get(link, ()):
            yield from Refers("point").missing(name, where, mechanism)
        elif not point and name not in joints:
            yield from Refers("any joint").missing(name, where, mechanism)
        if isinstance(hint, tuple):
            yield from InSpace().counted(hint, where, mechanism)
        elif point:
            yield Finding("a point has a position, not an angle", where, f"write {coordinates(mechanism)}")
        elif name in joints and not (motions(joints[name].type) or PAIRS[joints[name].type].crossed):
            what = f"one number does not state how far a {joints[name].type} joint has moved"
            yield Finding(what, where, f"state where it is: {coordinates(mechanism)}")
    for name, measure in mechanism.measures.items():
        yield from check_measure(mechanism, measure, f"measures.{name}")

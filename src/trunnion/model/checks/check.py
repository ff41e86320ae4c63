"""Checks of a model that need nothing but the model: names, dimensions, and data that no linkage can have.

They run in stages, each of which may take for granted what the one before has found sound: first what names refer to,
then how parts and units go together, last the numbers. What needs the structure (whether the drivers suffice, whether
it can be assembled) is checked where the structure is known.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np

from trunnion.errors import Finding, Severity
from trunnion.joints.pairs import PAIRS
from trunnion.model.checks.drivers import driver_findings, gears
from trunnion.model.checks.forgotten_units import forgotten_units, plain_angles, thousands
from trunnion.model.checks.joints import joint_findings
from trunnion.model.checks.loads import expression_name, load_findings, motion_dimensions, springs, tables, unknown_name
from trunnion.model.checks.loops import coordinates, loop
from trunnion.model.checks.measures import check_measure
from trunnion.model.checks.tolerances import cost_values, meant, tolerance_names, tolerance_values
from trunnion.model.checks.values import check_values
from trunnion.model.joint_parts import motions
from trunnion.model.names import ERRORS, nearest
from trunnion.model.parameters import Entry, Numbers, dimension_errors
from trunnion.model.parts import AT
from trunnion.model.quantity import evaluation_order
from trunnion.model.rules import InSpace, Refers, key_findings
from trunnion.model.tolerances import ends_motion, further_entries
from trunnion.model.units import ANY, Dimension, UnitError

__all__ = ["check_model"]


def check_model(mechanism: Numbers) -> list[Finding]:
    """What is wrong or doubtful with a model; of errors those of the first stage that has any."""
    findings: list[Finding] = []
    with np.errstate(all="ignore"):  # absurd numbers may overflow in a check; they are still only numbers
        for stage in (_references, _together, _numbers):
            findings += stage(mechanism)
            if any(finding.severity is Severity.ERROR for finding in findings):
                break
    return list(dict.fromkeys(findings))  # a default that several joints share is found once


def _references(mechanism: Numbers) -> Iterator[Finding]:
    """Whether the space is the one that is stated, and what names refer to is there."""
    sizes = [len(place.at) for link in mechanism.links.values() for place in link.points.values()]
    if "space" not in mechanism.model_fields_set and (mechanism.loop or sizes.count(3) > len(sizes) / 2):
        what = "this is a spatial model: it has a loop, or points with three coordinates"
        yield Finding(what, "space", "state space: spatial")
        return
    yield from loop(mechanism)
    yield from key_findings(mechanism)
    for name in mechanism.drivers:
        if name not in mechanism.effective_joints:
            remedy = nearest(name, mechanism.effective_joints)
            yield Finding(f"there is no joint '{name}' to drive", f"drivers.{name}", remedy)
    for name, hint in mechanism.assembly.items():
        link, _, point = name.partition(".")
        missing = point and point not in mechanism.points.get(link, ())
        if (
            name not in mechanism.effective_joints
            and name != AT
            and not isinstance(hint, str)
            and (missing or not point)
        ):
            yield from Refers("point" if point else "any joint").missing(name, f"assembly.{name}", mechanism)
        if isinstance(hint, tuple):
            yield from InSpace().counted(hint, f"assembly.{name}", mechanism)
    for name, measure in mechanism.measures.items():
        yield from check_measure(mechanism, measure, f"measures.{name}")


def _together(mechanism: Numbers) -> Iterator[Finding]:
    """Whether the parts go together, each by itself and in its place, and the units of every expression."""
    if not mechanism.links and not mechanism.loop:
        yield Finding("there are no links", "links", "state at least a ground and a moving link")
    elif not mechanism.effective_joints:
        yield Finding("there are no joints", "joints", "join the links")
    yield from _quantities(mechanism)
    yield from _links(mechanism)
    yield from joint_findings(mechanism)
    yield from gears(mechanism)
    yield from driver_findings(mechanism)
    yield from load_findings(mechanism)
    yield from springs(mechanism)
    yield from _hints(mechanism)
    paths, findings = meant(mechanism, "errors", mechanism.errors)
    yield from findings
    varying = {entry.path for entry in mechanism.entries if entry.varies}
    for name, path in paths.items():
        if path.startswith("drivers."):
            what = "an error of a driver changes the times of the cycle, so there is no ideal cycle to compare with"
            yield Finding(what, f"{ERRORS}{name}", "change the driver itself")
        if path in varying:
            what = f"'{path}' varies with the motion and has no one error"
            yield Finding(what, f"{ERRORS}{name}", "state one of a dimension in it")
    yield from tolerance_names(mechanism)


def _numbers(mechanism: Numbers) -> Iterator[Finding]:
    """What the numbers make impossible or doubtful."""
    yield from check_values(mechanism, mechanism.parameter_set)
    yield from forgotten_units(mechanism)
    yield from tolerance_values(mechanism)
    yield from cost_values(mechanism)


# ---- names and units of expressions ---------------------------------------------------------------------------


def _quantities(mechanism: Numbers) -> Iterator[Finding]:
    """Names and units in every expression; dimensions that nothing uses."""
    dimensions: dict[str, Dimension | None] = {}
    yield from _dimensions(mechanism, dimensions)
    yield from tables(mechanism, dimensions)
    moving = {**motion_dimensions(mechanism, dimensions), **dimensions}
    sound: list[tuple[Entry, Mapping[str, Dimension | None]]] = []
    entries = (*mechanism.entries, *further_entries(mechanism))
    for entry in entries:
        quantity, sayable = entry.quantity, moving if entry.varies else dimensions
        if entry.alias:
            continue
        missing = [name for name in quantity.names if name not in sayable]
        for name in missing:
            yield unknown_name(mechanism, name, entry.where, quantity.source, dimensions)
        if quantity.tolerance and (entry.varies or ends_motion(entry.path)):
            what = f"'{quantity.source}' has a tolerance, and does not vary: it is where the motion is compared at"
            what = f"'{quantity.source}' varies with the motion and has a tolerance" if entry.varies else what
            yield Finding(what, entry.where, "state a dimension with the tolerance, or put it into a link")
        if not missing and entry.path.partition(".")[0] != "dimensions":
            try:
                yield from thousands(entry.where, quantity, quantity.check(sayable, entry.kind))
                sound.append((entry, sayable))
            except UnitError as error:
                yield Finding(error.what, entry.where, error.remedy)
    yield from plain_angles(mechanism, sound)
    used = {name for entry in entries for name in entry.quantity.names}
    rubs = any(joint.friction is not None for joint in mechanism.effective_joints.values())
    remedy = "remove it" if rubs else "remove it, unless it is of friction, which is off"
    for name in mechanism.dimensions:
        if name not in used:
            yield Finding("is not used", f"dimensions.{name}", remedy, Severity.NOTE)


def _dimensions(mechanism: Numbers, by_name: dict[str, Dimension | None]) -> Iterator[Finding]:
    """Names of the dimensions and what each measures, which `by_name` receives."""
    dimensions = mechanism.dimensions
    by_name.update(dict.fromkeys(dimensions))
    order, circles = evaluation_order(dimensions, dimension_errors(mechanism.entries))
    for circle in circles:
        ring = " → ".join([*circle, circle[0]])
        yield Finding(f"is defined by itself: {ring}", f"dimensions.{circle[0]}", "give one of them a value")
    for name in order:
        yield from expression_name(name, f"dimensions.{name}")
        quantity = dimensions[name]
        if set(quantity.names) <= by_name.keys():
            try:
                by_name[name] = quantity.check(by_name, ANY)
                yield from thousands(f"dimensions.{name}", quantity, by_name[name])
            except UnitError as error:
                yield Finding(error.what, f"dimensions.{name}", error.remedy)


# ---- links and hints ------------------------------------------------------------------------------------------


def _links(mechanism: Numbers) -> Iterator[Finding]:
    """Whether one link is fixed, each is joined to another, and what it states is of the space."""
    jointed = {name for joint in mechanism.effective_joints.values() for name in joint.links}
    if not mechanism.fixed_link:
        remedy = "name the fixed link 'ground' or 'frame', or state ground: <its name>"
        yield Finding("no link is fixed", "ground", remedy)
    for name, link in mechanism.links.items():
        where = f"links.{name}"
        if name not in jointed:
            yield Finding(f"no joint connects the link '{name}'", where, "join it to another link or remove it")
        if link.inertia_about == "origin" and not link.model_fields_set & {"inertia"}:
            yield Finding("inertia_about is given without an inertia", where, "give the inertia", Severity.WARNING)


def _hints(mechanism: Numbers) -> Iterator[Finding]:
    """Whether each hint of the assembly is of something that it can place."""
    joints, points = mechanism.effective_joints, mechanism.points
    for name, hint in mechanism.assembly.items():
        where, joint = f"assembly.{name}", joints.get(name)
        if isinstance(hint, str):
            moving = [link for link in points if link != mechanism.fixed_link]
            if name not in moving:
                what = f"'{hint}' chooses an assembly of a moving link, and '{name}' is none"
                yield Finding(what, where, nearest(name, moving))
        elif name == AT and joint is None:
            if isinstance(hint, tuple) or not mechanism.drivers:
                what = "it says where the driver is when points are where the hints say"
                yield Finding(what, where, "write its coordinate, as at: 30 deg" if mechanism.drivers else "remove it")
        elif "." in name and not isinstance(hint, tuple):
            yield Finding("a point has a position, not an angle", where, f"write {coordinates(mechanism)}")
        elif joint and not isinstance(hint, tuple) and not (motions(joint.type) or PAIRS[joint.type].crossed):
            what = f"one number does not state how far a {joint.type} joint has moved"
            yield Finding(what, where, f"state where it is: {coordinates(mechanism)}")

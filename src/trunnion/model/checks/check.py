"""Checks of a model that need nothing but the model: names, dimensions, and data that no linkage can have.

Each check yields findings; `check_model` runs them all. What needs the structure (whether the drivers suffice,
whether it can be assembled) is checked where the structure is known.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator
from dataclasses import replace

import numpy as np

from trunnion.errors import Finding, Severity
from trunnion.joints.friction import FRICTION_LAWS
from trunnion.joints.pairs import PAIRS
from trunnion.model.checks.drivers import gears
from trunnion.model.checks.errors import errors, joint_errors
from trunnion.model.checks.joints import contact_law
from trunnion.model.checks.loads import losses, motion_dimensions, springs, tables, unknown_name, unread
from trunnion.model.checks.magnitudes import Bare, magnitudes, plain_dimensions, radians, unitless_angles
from trunnion.model.checks.measures import check_measure, measure_values
from trunnion.model.checks.space import contact, coordinates, driven, loop, pitch, resisted, space
from trunnion.model.checks.tolerances import cost_names, cost_values, stated_entries, tolerance_names, tolerance_values
from trunnion.model.checks.values import check_values
from trunnion.model.expression import MOTION, RESERVED
from trunnion.model.joint_parts import motions
from trunnion.model.names import ERRORS, as_key, nearest
from trunnion.model.parameters import Numbers, ParameterSet, dimension_errors
from trunnion.model.parts import Driver, Friction, Joint, Load, freedoms
from trunnion.model.quantity import UNREADABLE, evaluation_order
from trunnion.model.rules import InSpace, Refers, stated_findings
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
        *stated_findings(mechanism),
        *space(mechanism),
        *_links(mechanism),
        *_joints(mechanism),
    ]
    findings += [] if lost else _absent(mechanism)
    findings += [*loop(mechanism), *gears(mechanism), *_drivers(mechanism), *_loads(mechanism)]
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
    known: dict[str, Dimension | None] = {}
    yield from _dimensions(mechanism, known, unreadable)
    yield from tables(mechanism, known)
    moving = {**motion_dimensions(mechanism, known), **known}
    plain, bare = plain_dimensions(mechanism.dimensions), list[Bare]()
    used: set[str] = set()
    found = mechanism.entries
    for entry in (*found, *stated_entries(mechanism, found)):
        names = entry.quantity.names
        used.update(names)
        if entry.quantity is UNREADABLE:
            unreadable.add(entry.path)
        if entry.alias or entry.path in unreadable:
            continue
        sayable = moving if entry.varies else known
        if missing := [name for name in names if name not in sayable]:
            unreadable.add(entry.path)
            for name in missing:
                finding = unknown_name(mechanism, name, entry.where, entry.quantity.source, known)
                respelt = entry.quantity.respelt(entry.kind)
                yield replace(finding, remedy=f"write {respelt}") if respelt else finding
            continue
        if entry.varies and entry.quantity.tolerance:
            what = f"'{entry.quantity.source}' varies with the motion and has a tolerance"
            yield Finding(what, entry.where, "state a dimension with the tolerance and use it in the expression")
        try:
            entry.quantity.check(sayable, entry.kind)
            bare += unitless_angles(mechanism, entry, sayable, plain)
        except UnitError as error:
            yield Finding(error.what, entry.where, error.remedy)
    yield from radians(mechanism, bare)
    rubs = any(joint.friction is not None for joint in mechanism.effective_joints.values())
    remedy = "remove it" if rubs else "remove it, unless it is of friction, which is off"
    for name in mechanism.dimensions:
        if name not in used:
            yield Finding("is not used", f"dimensions.{name}", remedy, Severity.NOTE)


def _dimensions(mechanism: Numbers, known: dict[str, Dimension | None], unreadable: set[str]) -> Iterator[Finding]:
    """Names of the dimensions and what each measures: `known` receives it, `unreadable` the paths without a value."""
    dimensions = mechanism.dimensions
    known.update(dict.fromkeys(dimensions))
    deviations = dimension_errors(mechanism.entries) if mechanism.errors else {}
    order, circles = evaluation_order(dimensions, deviations)
    for circle in circles:
        unreadable.update(f"{before}dimensions.{name}" for name in circle for before in ("", ERRORS))
        ring = " → ".join([*circle, circle[0]])
        yield Finding(f"is defined by itself: {ring}", f"dimensions.{circle[0]}", "give one of them a value")
    for name in order:
        yield from _dimension_name(name)
        quantity, path = dimensions[name], f"dimensions.{name}"
        if set(quantity.names) <= known.keys() and path not in unreadable:
            try:
                known[name] = quantity.check(known, ANY)
            except UnitError as error:
                unreadable.add(path)
                yield Finding(error.what, path, error.remedy)


def _dimension_name(name: str) -> Iterator[Finding]:
    where = f"dimensions.{name}"
    if name in RESERVED or name in MOTION:
        yield Finding(f"'{name}' is a reserved name of expressions", where, "rename the dimension")
    elif not name.isidentifier() or name.startswith("_"):
        yield Finding(
            f"'{name}' cannot be used in an expression", where, "name it with letters, digits and _, a letter first"
        )


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


def _joints(mechanism: Numbers) -> Iterator[Finding]:
    for name, joint in mechanism.effective_joints.items():
        where = f"joints.{name}"
        if mechanism.space == "planar" and not PAIRS[joint.type].planar:
            flat = ", ".join(pair for pair in PAIRS if PAIRS[pair].planar)
            yield Finding(f"a {joint.type} joint does not exist in the plane", where, f"use one of {flat}")
        if name in mechanism.joints:
            yield from _ends(mechanism, name, joint)
        yield from pitch(joint, where)
        yield from contact(joint, where, mechanism.space == "spatial")
        if joint.contact is not None:
            yield from contact_law(mechanism, name, joint, joint.contact)
        yield from losses(joint, f"{where}.losses")
        if joint.friction is not None:
            own = mechanism.stated_joints[name].friction
            yield from _parameters_of_law(
                joint.friction, "joint_defaults.friction" if own is None else f"{where}.friction"
            )


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
    for parameter, one in declared.items():
        if one.default is None and parameter not in friction.parameters:
            remedy = f"add {parameter}" + f" ({one.meaning})" * bool(one.meaning)
            yield Finding(f"the friction law {law} needs '{parameter}'", where, remedy)


def _drivers(mechanism: Numbers) -> Iterator[Finding]:
    joints = mechanism.effective_joints
    for name, driver in mechanism.drivers.items():
        where = f"drivers.{name}"
        if name not in joints:
            yield Finding(f"there is no joint '{name}' to drive", where, nearest(name, joints))
        elif not PAIRS[joints[name].type].drivable:
            yield from driven(name, joints[name], where)
        elif "rotation" not in freedoms(joints[name].type) and driver.law == "constant" and driver.range is None:
            yield Finding(f"a driven {joints[name].type} joint needs a range", where, "add range: [0 mm, 50 mm]")
        yield from _motion(driver, where)


def _motion(driver: Driver, where: str) -> Iterator[Finding]:
    """Whether a table that a driver follows can be read, and what else it states goes with it."""
    if driver.file is not None and driver.law == "table":
        yield unread(driver.file, where)
    if driver.found and driver.law != "constant":
        what = f"the motion law {driver.law} prescribes a coordinate that is free"
        yield Finding(what, f"{where}.law", "state speed: … (what all but `simulate` prescribe), or no motor")
    if driver.points is not None and driver.periodic and len(driver.points) < 3:
        yield Finding("a periodic table needs at least three points", f"{where}.points", "add points")
    if driver.points is not None and driver.ends == "natural":
        for key in ("periodic", "delay"):
            if key in driver.model_fields_set and getattr(driver, key):
                yield Finding(f"a table with natural ends has no '{key}'", f"{where}.{key}", f"remove ends or {key}")


def _loads(mechanism: Numbers) -> Iterator[Finding]:
    for name, load in mechanism.loads.items():
        where = f"loads.{name}"
        if (load.link is None) == (load.joint is None):
            link, _, point = str(load.at or "").rpartition(".")
            remedy = (
                f"state link: {link}, at: {point}" if link in mechanism.effective_links else "state link: … or joint: …"
            )
            yield Finding("acts on neither or both of a link and a joint", where, remedy)
        elif load.link is not None:
            yield from _link_load(mechanism, load, load.link, where)
        else:
            yield from _joint_load(mechanism, load, where)


def _link_load(mechanism: Numbers, load: Load, link: str, where: str) -> Iterator[Finding]:
    if load.resisting_torque is not None or load.resisting_force is not None:
        yield Finding("a resisting load acts on a joint, not a link", where, "state joint: … instead of link: …")
    elif load.only is not None:
        yield Finding("only is for a load that resists a joint", f"{where}.only", "remove it, or state joint: …")
    elif load.force is None and load.moment is None:
        yield Finding("this load is empty", where, "state a force or a moment")
    if load.force is not None and load.at is None:
        yield Finding("the force has no point to act at", where, "add at: <a point of the link>")
    if load.moment is not None and isinstance(load.moment, tuple) != (mechanism.space == "spatial"):
        form = "one number" if mechanism.space == "planar" else "[x, y, z]"
        yield Finding(f"the moment of a {mechanism.space} model is {form}", f"{where}.moment", f"write {form}")
    if link in mechanism.points and load.at is not None and load.at not in mechanism.points[link]:
        points = mechanism.points[link]
        yield Finding(f"the link '{link}' has no point '{load.at}'", f"{where}.at", nearest(load.at, points))
    if link == mechanism.fixed_link:
        yield Finding("acts on the fixed link and has no effect", where, "name a moving link", Severity.WARNING)


def _joint_load(mechanism: Numbers, load: Load, where: str) -> Iterator[Finding]:
    joints = mechanism.effective_joints
    if load.frame != "global":
        yield Finding("frame is for a load on a link", f"{where}.frame", "remove it")
    if load.force is not None or load.moment is not None or load.at is not None:
        yield Finding(
            "at, force and moment are for a load on a link", where, "state resisting_torque or resisting_force"
        )
    elif load.resisting_torque is None and load.resisting_force is None:
        yield Finding("this load is empty", where, "state resisting_torque or resisting_force")
    elif load.resisting_torque is not None and load.resisting_force is not None:
        yield Finding("resists a rotation and a slide at once", where, "state a load for each")
    if load.joint is None or load.joint not in joints:
        return
    for key, freedom in (("resisting_torque", "rotation"), ("resisting_force", "slide")):
        if getattr(load, key) is not None:
            yield from resisted(joints[load.joint], key, freedom, where)


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
                moving = [one for one in points if one != mechanism.fixed_link]
                what = f"'{hint}' chooses an assembly of a moving link, and '{name}' is none"
                yield Finding(what, where, nearest(name, moving))
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

"""Checks of a model that need nothing but the model: names, dimensions, units, and data that no linkage can have.

They run in stages, each of which may take for granted what the one before has found sound: first what names refer to,
then how parts and units go together, last the numbers. What needs the structure (whether the drivers suffice, whether
it can be assembled) is checked where the structure is known.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable, Iterator, Mapping

import numpy as np

from trunnion.algebra.namespace import Number
from trunnion.errors import Finding, Severity
from trunnion.model.checks import joints, parts, tolerances
from trunnion.model.expression import unitless_angles
from trunnion.model.names import ERRORS, nearest
from trunnion.model.parameters import Entry, ParameterSet, dimension_errors
from trunnion.model.parts import AT, USUAL_PRESSURE_ANGLE, InertiaTensor, Link
from trunnion.model.quantity import Quantity, evaluation_order
from trunnion.model.rules import InSpace, Refers, faults, group_findings, key_findings, limit_findings
from trunnion.model.tolerances import Varying, ends_motion
from trunnion.model.units import ANY, KINDS, NUMBER, Dimension, UnitError, unit

Values = Mapping[str, Number]
# of the largest moment, by which a flat body may violate the triangle inequality: of four digits, of three or two
INERTIA_SLACK, INERTIA_ROUNDING = 1e-3, 1e-2
ALONG = 1e-6  # sine of the angle below which `x` lies along `axis`: what is left of it across is rounding of the file


def check_model(mechanism: Varying) -> list[Finding]:
    """What is wrong or doubtful with a model; of errors those of the first stage that has any."""
    findings: list[Finding] = []
    with np.errstate(all="ignore"):  # absurd numbers may overflow in a check; they are still only numbers
        for stage in (_references, _together, _numbers):
            findings += stage(mechanism)
            if any(finding.severity is Severity.ERROR for finding in findings):
                break
    return list(dict.fromkeys(findings))  # a default that several joints share is found once


def _references(mechanism: Varying) -> Iterator[Finding]:
    """Whether the space is the one that is stated, and what names refer to is there."""
    sizes = [len(place.at) for link in mechanism.links.values() for place in link.points.values()]
    if "space" not in mechanism.model_fields_set and (mechanism.loop or sizes.count(3) > len(sizes) / 2):
        what = "this is a spatial model: it has a loop, or points with three coordinates"
        yield Finding(what, "space", "state space: spatial")
        return
    yield from parts.loop(mechanism)
    yield from key_findings(mechanism)
    for name in mechanism.drivers:
        yield from Refers("any joint").missing(name, f"drivers.{name}", mechanism)
    for name, hint in mechanism.assembly.items():
        link, _, point = name.partition(".")
        placed = point in mechanism.points.get(link, ()) or name in mechanism.effective_joints or name == AT
        if not placed and not isinstance(hint, str):
            yield from Refers("point" if point else "any joint").missing(name, f"assembly.{name}", mechanism)
        yield from InSpace().counted(hint, f"assembly.{name}", mechanism)
    for name, measure in mechanism.measures.items():
        yield from tolerances.check_measure(mechanism, measure, f"measures.{name}")


def _together(mechanism: Varying) -> Iterator[Finding]:
    """Whether the parts go together, each by itself and in its place, and the units of every expression."""
    yield from _quantities(mechanism)
    yield from _links(mechanism)
    yield from joints.joint_findings(mechanism)
    yield from parts.gears(mechanism)
    yield from parts.driver_findings(mechanism)
    yield from parts.load_findings(mechanism)
    yield from parts.springs(mechanism)
    yield from _hints(mechanism)
    paths, findings = tolerances.meant(mechanism, "errors", mechanism.errors)
    yield from findings
    varying = {entry.path for entry in mechanism.entries if entry.varies}
    for name, path in paths.items():
        yield from faults(
            f"{ERRORS}{name}",
            (path.startswith("drivers."), "",
             "an error of a driver changes the times of the cycle, so there is no ideal cycle to compare with"),
            (path in varying, "", f"'{path}' varies with the motion and has no one error",
             "state one of a dimension in it"),
        )  # fmt: skip
    yield from tolerances.tolerance_names(mechanism)


def _numbers(mechanism: Varying) -> Iterator[Finding]:
    """What the numbers make impossible or doubtful."""
    yield from check_values(mechanism, mechanism.parameter_set)
    yield from forgotten_units(mechanism)
    yield from tolerances.tolerance_values(mechanism)
    yield from tolerances.cost_values(mechanism)


# ---- names and units of expressions ---------------------------------------------------------------------------


def _quantities(mechanism: Varying) -> Iterator[Finding]:
    """Names and units in every expression; dimensions that nothing uses."""
    dimensions: dict[str, Dimension | None] = {}
    yield from _dimensions(mechanism, dimensions)
    yield from parts.tables(mechanism, dimensions)
    moving = {**parts.motion_dimensions(mechanism, dimensions), **dimensions}
    sound: list[tuple[Entry, Mapping[str, Dimension | None]]] = []
    entries = (*mechanism.entries, *mechanism.further_entries)
    for entry in entries:
        quantity, sayable = entry.quantity, moving if entry.varies else dimensions
        if entry.alias:
            continue
        missing = [name for name in quantity.names if name not in sayable]
        for name in missing:
            yield parts.unknown_name(mechanism, name, entry.where, quantity.source, dimensions)
        if quantity.tolerance and (entry.varies or ends_motion(entry.path)):
            why = "varies with the motion" if entry.varies else "does not vary: the motion is compared there"
            yield Finding(f"'{quantity.source}' has a tolerance, and {why}", entry.where)
        if not missing and entry.path.partition(".")[0] != "dimensions":
            try:
                quantity.check(sayable, entry.kind)
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


def _dimensions(mechanism: Varying, by_name: dict[str, Dimension | None]) -> Iterator[Finding]:
    """Names of the dimensions and what each measures, which `by_name` receives."""
    dimensions = mechanism.dimensions
    by_name.update(dict.fromkeys(dimensions))
    order, circles = evaluation_order(dimensions, dimension_errors(mechanism.entries))
    for circle in circles:
        ring = " → ".join([*circle, circle[0]])
        yield Finding(f"is defined by itself: {ring}", f"dimensions.{circle[0]}", "give one of them a value")
    for name in order:
        where, quantity = f"dimensions.{name}", dimensions[name]
        yield from parts.expression_name(name, where)
        if set(quantity.names) <= by_name.keys():
            try:
                by_name[name] = quantity.check(by_name, ANY)
            except UnitError as error:
                yield Finding(error.what, where, error.remedy)


# ---- links and hints ------------------------------------------------------------------------------------------


def _links(mechanism: Varying) -> Iterator[Finding]:
    """Whether there are links and joints, one link is fixed, and each is joined to another."""
    jointed = {name for joint in mechanism.effective_joints.values() for name in joint.links}
    no_links = not mechanism.effective_links
    remedy = "name the fixed link 'ground' or 'frame', or state ground: <its name>"
    yield from faults(
        "",
        (no_links, "links", "there are no links", "state at least a ground and a moving link"),
        (not no_links and not jointed, "joints", "there are no joints", "join the links"),
        (not mechanism.fixed_link, "ground", "no link is fixed", remedy),
    )
    for name in (name for name in mechanism.links if name not in jointed):
        yield Finding(f"no joint connects the link '{name}'", f"links.{name}", "join it to another link or remove it")


def _hints(mechanism: Varying) -> Iterator[Finding]:
    """Whether each hint of the assembly is of something that it can place."""
    moving = [link for link in mechanism.points if link != mechanism.fixed_link]
    for name, hint in mechanism.assembly.items():
        joint, word = mechanism.effective_joints.get(name), isinstance(hint, str)
        number, of_driver = not isinstance(hint, tuple | str), name == AT and joint is None
        yield from faults(
            f"assembly.{name}",
            (word and name not in moving, "", f"'{hint}' chooses an assembly of a moving link, and '{name}' is none",
             nearest(name, moving)),
            (of_driver and not word and not (number and mechanism.drivers), "",
             "it says where the driver is when points are where the hints say", "write its coordinate, as at: 30 deg"),
            ("." in name and number, "", "a point has a position, not an angle", f"write {mechanism.position_form}"),
            (joint and number and not (joint.pair.motions or joint.pair.crossed), "",
             f"one number does not state how far a {joint and joint.type} joint has moved",
             f"state where it is: {mechanism.position_form}"),
        )  # fmt: skip


# ---- numbers --------------------------------------------------------------------------------------------------


def check_values(
    mechanism: Varying, numbers: ParameterSet, changed: Collection[str] | None = None
) -> Iterator[Finding]:
    """Findings about the nominal values of a model whose names and units are sound.

    changed: paths of those that differ from the numbers of a sound mechanism, all if not given: errors that follow from
    no other number are found, and of warnings some.
    """
    values = numbers.nominal
    paths = numbers.entries if changed is None else changed
    touched = {tuple(path.split(".", 2)[:2]) for path in paths}
    sections = {section for section, *_ in touched}
    for path in paths:
        yield from _alone(numbers, path)
    for section in ("links", "drivers", "tables", "measures", "joints"):
        entries = mechanism.effective_joints if section == "joints" else getattr(mechanism, section)
        for name in (name for name in entries if (section, name) in touched):
            yield from group_findings(f"{section}.{name}", entries[name], values)
            if section == "links":
                yield from _mass(mechanism, mechanism.links[name], values, f"links.{name}")
                yield from _along(mechanism.links[name], values, f"links.{name}")
            elif section == "joints":
                yield from joints.joint_values(mechanism, name, numbers)
            elif section == "drivers":
                yield from parts.driver_values(mechanism, name, values)
    followed = {entry.alias for entry in numbers.entries.values()}
    for path in numbers.entries if changed is None else ():
        if path.startswith("joint_defaults.") and path not in followed:  # as a clearance of pins that all have a fit
            yield Finding("has no effect: no joint follows it", path, "remove it", Severity.NOTE)
    yield from parts.gear_values(mechanism, values)
    if not sections.isdisjoint(("tables", "drivers")):
        yield from parts.table_values(mechanism, values)
    yield from parts.spring_values(mechanism, values)
    if "measures" in sections:
        yield from tolerances.measure_values(mechanism, numbers)


def _alone(numbers: ParameterSet, path: str) -> Iterator[Finding]:
    """What can be said of a number by itself."""
    values = numbers.nominal
    if path not in values:  # an expression of the motion
        return
    entry = numbers.entries[path]
    follows = any(not np.isfinite(values[name]) for name in entry.depends if name in values)
    if entry.quantity.names and not follows and not np.isfinite(values[path]):
        what = f"'{entry.quantity.source}' has no finite value ({values[path]})"
        yield Finding(what, entry.where, "check divisions and roots")
    if not entry.alias:
        yield from limit_findings(entry.rules, values[path], entry.kind, path)


def _along(link: Link, values: Values, where: str) -> Iterator[Finding]:
    """A direction x along the axis of its point counts no rotation."""
    for point, place in link.points.items():
        if place.x is not None and len(place.x) == 3:
            path = f"{where}.points.{point}"
            x = [float(values[f"{path}.x.{letter}"]) for letter in "xyz"]
            axis = [float(values[f"{path}.axis.{letter}"]) for letter in "xyz"] if place.axis else [0.0, 0.0, 1.0]
            across, size = np.linalg.norm(np.cross(axis, x)), np.linalg.norm(axis) * np.linalg.norm(x)
            if size > 0 and across <= ALONG * size:
                what = "lies along the axis" + " [0, 0, 1]" * (place.axis is None)
                yield Finding(what, f"{path}.x", "give a direction across the axis, or none")


def _mass(mechanism: Varying, link: Link, values: Values, where: str) -> Iterator[Finding]:
    """Whether a body can be so: principal moments about its centre, each at most the sum of the others."""
    mass, letters = values[f"{where}.mass"], "xyz"[: mechanism.coordinates]
    gravity = [values.get(f"gravity.{axis}", np.nan) for axis in letters]
    if link.useful and (mass == 0 or not np.any(gravity)):
        yield Finding("has no weight that could be useful", f"{where}.useful", "state mass and gravity, or remove it")
    centre = np.array([float(values.get(f"{where}.centre.{axis}", np.nan)) for axis in letters])
    if np.isnan(centre).all():
        distance, angle = values[f"{where}.centre.distance"], values[f"{where}.centre.angle"]
        centre = distance * np.array([np.cos(angle), np.sin(angle)])
    path, about_origin = f"{where}.inertia", link.inertia_about == "origin"
    tensor_stated = isinstance(link.inertia, InertiaTensor)
    if tensor_stated != (mechanism.space == "spatial") and "inertia" in link.model_fields_set:
        form = "{xx: …, yy: …, zz: …}" if mechanism.space == "spatial" else "one number"
        yield Finding(f"the inertia of a {mechanism.space} link is {form}", path)
    elif not tensor_stated:
        least = mass * float(centre @ centre) if about_origin else 0.0
        if values.get(path, np.inf) < least * (1 - INERTIA_SLACK):  # a spatial link without a tensor is a point mass
            what = f"is {values[path]:g} kg m², less than m r² = {least:g}" if least else "is negative"
            yield Finding(what, path, "check unit and inertia_about")
    else:
        xx, yy, zz, xy, xz, yz = (float(values[f"{path}.{axis}"]) for axis in ("xx", "yy", "zz", "xy", "xz", "yz"))
        tensor = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
        if about_origin:
            tensor = tensor - mass * (centre @ centre * np.eye(3) - np.outer(centre, centre))
        if not np.isfinite(tensor).all():
            return
        principal, size = np.linalg.eigvalsh(tensor), float(np.abs(tensor).max())
        excess, slack = principal[2] - principal[0] - principal[1], INERTIA_SLACK * size
        if principal[0] < -slack or excess > slack:
            rounded = principal[0] >= -slack and excess <= INERTIA_ROUNDING * size
            moments = ", ".join(f"{axis:.4g}" for axis in principal)
            what = (
                f"no body has the principal moments {moments} kg m² about its centre: one exceeds the sum of the others"
            )
            remedy = "check inertia_about and the signs of xy, xz, yz (xy = −∫ x y dm)"
            if rounded:
                what, remedy = f"{what} by {100 * excess / size:.2g} %", "state more digits, if it is of rounding"
            yield Finding(what, path, remedy, Severity.WARNING if rounded else Severity.ERROR)


# ---- numbers whose unit was likely forgotten ------------------------------------------------------------------

FAR = 20.0  # times the largest length with a unit: a plain length above it is none of this mechanism
LENGTH = KINDS["length"]


def forgotten_units(mechanism: Varying) -> Iterator[Finding]:
    """Plain lengths far above those with a unit: one warning, so that a file in mm without units is one finding.

    Where most lengths have a unit, far is more than the largest of them.
    """
    entries = [entry for entry in (*mechanism.entries, *mechanism.further_entries)
               if entry.kind is LENGTH and not (entry.alias or entry.varies or ".values." in entry.path)
               and not entry.path.startswith("assembly.")]  # fmt: skip
    dimensions, names = mechanism.dimensions, mechanism.parameter_set.dimension_values
    with_unit, stated = 0.0, 0  # of lengths with a unit the largest of a point of a link, and how many there are
    plain: dict[str, float] = {}  # those without, by their place
    for entry in entries:
        bare = [f"dimensions.{name}" for name in entry.quantity.names
                if not isinstance(dimensions[name].source, str) and _is_length(name, entry.quantity)]  # fmt: skip
        value = abs(float(entry.quantity.evaluate(names)))
        if not isinstance(entry.quantity.source, str) or bare:
            plain.setdefault(next(iter(bare), entry.where), value)
        elif value > 0:
            stated += 1
            if entry.path.startswith("links.") and ".points." in entry.path:
                with_unit = max(with_unit, value)
    plain = {where: value for where, value in plain.items() if value > 0}
    far = with_unit if stated > len(plain) else FAR * with_unit
    doubtful = {where: value for where, value in plain.items() if value > far > 0}
    if doubtful:
        where, others = max(doubtful, key=doubtful.__getitem__), len(doubtful) - 1
        value, also = doubtful[where], f", as are {others} others without a unit" * (others > 0)
        what = f"is {value:g} m, {value / with_unit:.3g} times the largest length with a unit, {with_unit:g} m{also}"
        yield Finding(f"{what}: a unit forgotten?", where, f"write it, as {value:g} mm", Severity.WARNING)


def _is_length(name: str, quantity: Quantity) -> bool:
    """Whether a dimension is a length where an expression speaks of it: as a plain factor it makes no sense there."""
    try:
        quantity.check({operand: NUMBER if operand == name else None for operand in quantity.names}, LENGTH)
    except UnitError:
        return True
    return False


def bare_number(numbers: ParameterSet, path: str, value: float) -> Iterator[Finding]:
    """A warning of a number without a unit, for one that the model states with a unit, if it is nearer to that number
    as it is written than to its value in SI."""
    entry, before = numbers.entries.get(path), float(numbers.nominal.get(path, math.nan))
    own_unit = entry.quantity.unit if entry else ""
    if not own_unit or not abs(value * before) > 0:
        return
    written = before / float(unit(own_unit)[0])
    if abs(math.log(abs(value / written))) < abs(math.log(abs(value / before))):
        what = f"{value:g} is in SI units, where the model states {written:g} {own_unit}: a unit forgotten?"
        yield Finding(what, path, f"write {value:g}{own_unit}", Severity.WARNING)


Sayable = Mapping[str, Dimension | None]  # what an expression may speak of, and what each measures


def plain_angles(mechanism: Varying, entries: Iterable[tuple[Entry, Sayable]]) -> Iterator[Finding]:
    """What numbers without a unit mean that are taken as radians, of the rows of a table the largest.

    entries: with what their expressions may speak of. In a model without any unit all is in SI, and only many turns are
    told.
    """
    expressions = {name: quantity.expression for name, quantity in mechanism.dimensions.items()}
    plain = [name for name, expression in expressions.items() if expression is None or expression.bare]
    largest: dict[str, tuple[str, float, str]] = {}  # where each stands, its value and a verb for it
    for entry, names in entries:
        expression, angle = entry.quantity.expression, entry.kind is KINDS["angle"]
        unitless = expression and unitless_angles(expression.term, names, plain, angle)
        for number in unitless or [float(entry.quantity.source)] * angle:
            of_dimension = isinstance(number, str)
            value = float(mechanism.dimensions[number].evaluate()) if isinstance(number, str) else number
            where = f"dimensions.{number}" if of_dimension else entry.where
            rows = where if where.startswith("links.") else where.partition(".points.")[0]
            if math.isfinite(value) and abs(value) > abs(largest.get(rows, ("", 0.0))[1]):
                largest[rows] = (where, value, f"takes {value:g} for" if expression and not of_dimension else "is")
    stated = (entry.quantity for entry in mechanism.entries if entry.quantity is not USUAL_PRESSURE_ANGLE)
    with_units = any(quantity.unit for quantity in stated)
    for where, value, verb in largest.values():
        if with_units or abs(value) > 2 * math.pi:
            yield from in_radians(where, value, verb)


def in_radians(where: str, value: float, verb: str = "is") -> Iterator[Finding]:
    """A warning of a plain number that is likely meant in degrees: a whole one, or of many turns, but of a driver."""
    turned = abs(value) > 2 * math.pi
    if (value.is_integer() and value != 0) or (turned and not where.startswith("drivers.")):
        size = f"{value / (2 * math.pi):.3g} turns" if turned else f"{math.degrees(value):.3g}°"
        what = f"{verb} {value:g} rad, which is {size}: a plain number is in radians"
        yield Finding(what, where, f"write {value:g} deg if it is in degrees, else {value:g} rad", Severity.WARNING)

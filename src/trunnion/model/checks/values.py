"""Checks of the numbers of a model: signs, ranges and bodies that cannot exist."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Mapping

import numpy as np

from trunnion.algebra.namespace import Number
from trunnion.errors import Finding, Severity
from trunnion.model.checks.drivers import driver_values, gear_values
from trunnion.model.checks.joints import joint_values
from trunnion.model.checks.loads import spring_values, table_values
from trunnion.model.checks.loops import direction_values
from trunnion.model.checks.measures import measure_values
from trunnion.model.joint_parts import has_pin
from trunnion.model.names import ERRORS
from trunnion.model.parameters import Numbers, ParameterSet
from trunnion.model.parts import InertiaTensor, Link
from trunnion.model.rules import group_findings, limit_findings

__all__ = ["check_values"]

Values = Mapping[str, Number]
WILD = 0.1  # of a length: an error above it is more likely a slip of the unit
# of the largest moment, by which a flat body may violate the triangle inequality: of four digits, of three or two
INERTIA_SLACK, INERTIA_ROUNDING = 1e-3, 1e-2


def check_values(
    mechanism: Numbers, numbers: ParameterSet, changed: Collection[str] | None = None
) -> Iterator[Finding]:
    """Findings about the nominal values of a model whose names and units are sound.

    changed: paths of those that differ from the numbers of a sound mechanism, all if not given: errors that follow from
    no other number are found, and of warnings some.
    """
    values = numbers.nominal
    yield from _each(numbers, numbers.entries if changed is None else changed)
    yield from _unfollowed(numbers) if changed is None else ()
    parts = None if changed is None else {tuple(path.split(".", 2)[:2]) for path in changed}
    sections = {section for section, _ in parts} if parts is not None else {*type(mechanism).model_fields}

    def among(section: str, names: Iterable[str]) -> Iterator[str]:
        return (name for name in names if parts is None or (section, name) in parts)

    for section in ("links", "drivers", "tables", "measures"):
        for name in among(section, getattr(mechanism, section)):
            yield from group_findings(f"{section}.{name}", getattr(mechanism, section)[name], values)
    for name in among("links", mechanism.links):
        yield from _inertia(mechanism, mechanism.links[name], values, f"links.{name}")
        yield from _weight(mechanism, mechanism.links[name], values, f"links.{name}")
    for name in among("joints", mechanism.effective_joints):
        yield from group_findings(f"joints.{name}", mechanism.effective_joints[name], values)
        yield from joint_values(mechanism, name, numbers)
    for name in among("drivers", mechanism.drivers):
        yield from driver_values(mechanism, name, values)
    if "errors" in sections:
        yield from _error_sizes(numbers)
    yield from gear_values(mechanism, values)
    if not sections.isdisjoint(("tables", "drivers")):
        yield from table_values(mechanism, values)
    yield from spring_values(mechanism, values)
    if "links" in sections:
        yield from direction_values(mechanism, values)
        yield from _sides(mechanism, values)
    if "measures" in sections:
        yield from measure_values(mechanism, numbers)


def _error_sizes(numbers: ParameterSet) -> Iterator[Finding]:
    """Errors so large that their unit is in doubt."""
    for path, error in numbers.nominal.items():
        if path.startswith(ERRORS):
            meant = float(numbers.nominal[path.removeprefix(ERRORS)]) - error
            if abs(error) > WILD * abs(meant) > 0:
                what = f"is {error:g} (SI), {100 * abs(error / meant):.3g} % of the {meant:g} that are meant"
                yield Finding(what, path, "check its unit: a plain number is SI", Severity.WARNING)


def _weight(mechanism: Numbers, link: Link, values: Values, where: str) -> Iterator[Finding]:
    """Whether a link whose weight is useful has one."""
    gravity = [values.get(f"gravity.{axis}", np.nan) for axis in "xyz"[: mechanism.coordinates]]
    if link.useful and (values.get(f"{where}.mass", np.nan) == 0 or not np.any(gravity)):
        yield Finding("has no weight that could be useful", f"{where}.useful", "state mass and gravity, or remove it")


def _unfollowed(numbers: ParameterSet) -> Iterator[Finding]:
    """Defaults without effect, as a clearance of pins that all have a fit."""
    followed = {entry.alias for entry in numbers.entries.values()}
    for path in numbers.entries:
        if path.startswith("joint_defaults.") and path not in followed:
            remedy = "remove it, or state it in the joints"
            yield Finding("has no effect: no joint follows it", path, remedy, Severity.NOTE)


def _each(numbers: ParameterSet, paths: Iterable[str]) -> Iterator[Finding]:
    """What can be said of a number by itself."""
    values = numbers.nominal
    for path in paths:
        if path not in values:  # an expression of the motion
            continue
        entry = numbers.entries[path]
        follows = any(not np.isfinite(values[name]) for name in entry.depends if name in values)
        if entry.quantity.names and not follows and not np.isfinite(values[path]):
            what = f"'{entry.quantity.source}' has no finite value ({values[path]})"
            yield Finding(what, entry.where, "check divisions and roots")
        if not entry.alias:
            yield from limit_findings(entry.rules, values[path], entry.kind, path)


def _sides(mechanism: Numbers, values: Values) -> Iterator[Finding]:
    """A link of two turning joints at one point has no length to transmit motion with."""
    if mechanism.space == "spatial":
        return
    geared = {
        joint for gear in mechanism.gears.values() for joint in gear.joints
    }  # a shaft with two passes on a torque
    for name, link in mechanism.links.items():
        joints = [
            key for key, joint in mechanism.effective_joints.items() if name in joint.links and key in link.points
        ]
        turns = all(has_pin(mechanism.effective_joints[key].type) for key in joints)
        if len(joints) != 2 or not turns or not geared.isdisjoint(joints):
            continue
        first, second = ([values[f"links.{name}.points.{key}.{axis}"] for axis in "xy"] for key in joints)
        if first == second:
            severity = Severity.WARNING if name == mechanism.fixed_link else Severity.ERROR
            what = f"the joints '{joints[0]}' and '{joints[1]}' of the link '{name}' are at one point"
            yield Finding(what, f"links.{name}.points", "move one of them", severity)


def _inertia(mechanism: Numbers, link: Link, values: Values, where: str) -> Iterator[Finding]:
    """Whether a body can be so: principal moments about its centre, each at most the sum of the others."""
    mass = values[f"{where}.mass"]
    letters = "xyz"[: mechanism.coordinates]
    centre = np.array([float(values.get(f"{where}.centre.{axis}", np.nan)) for axis in letters])
    if np.isnan(centre).all():
        distance, angle = values[f"{where}.centre.distance"], values[f"{where}.centre.angle"]
        centre = distance * np.array([np.cos(angle), np.sin(angle)])
    path, about_origin = f"{where}.inertia", link.inertia_about == "origin"
    spatial = isinstance(link.inertia, InertiaTensor)
    if spatial != (mechanism.space == "spatial") and "inertia" in link.model_fields_set:
        form = "{xx: …, yy: …, zz: …}" if mechanism.space == "spatial" else "one number"
        yield Finding(f"the inertia of a {mechanism.space} link is {form}", path, f"write {form}")
        return
    if path not in values and not spatial:
        return  # a spatial link without a tensor is a point mass
    if not spatial:
        least = mass * float(centre @ centre) if about_origin else 0.0
        if values[path] < least * (1 - INERTIA_SLACK):
            what = f"is {values[path]:g} kg m², less than m r² = {least:g}" if least else "is negative"
            yield Finding(what, path, "check unit and inertia_about")
        return
    xx, yy, zz, xy, xz, yz = (float(values[f"{path}.{axis}"]) for axis in ("xx", "yy", "zz", "xy", "xz", "yz"))
    tensor = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    if about_origin and len(centre) == 3:
        tensor = tensor - mass * (centre @ centre * np.eye(3) - np.outer(centre, centre))
    if not np.isfinite(tensor).all():
        return
    principal, size = np.linalg.eigvalsh(tensor), float(np.abs(tensor).max())
    excess = principal[2] - principal[0] - principal[1]
    if principal[0] < -INERTIA_SLACK * size or excess > INERTIA_SLACK * size:
        rounded = principal[0] >= -INERTIA_SLACK * size and excess <= INERTIA_ROUNDING * size
        moments = ", ".join(f"{axis:.4g}" for axis in principal)
        what = f"no body has the principal moments {moments} kg m² about its centre: one exceeds the sum of the others"
        remedy = "check inertia_about and the signs of xy, xz, yz (xy = −∫ x y dm)"
        if rounded:
            what, remedy = f"{what} by {100 * excess / size:.2g} %", "state more digits, if it is of rounding"
        yield Finding(what, path, remedy, Severity.WARNING if rounded else Severity.ERROR)

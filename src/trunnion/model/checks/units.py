"""Checks of numbers whose unit was likely forgotten: plain lengths far above the others, plain angles."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping

from trunnion.errors import Finding, Severity
from trunnion.model.parameters import Entry, ParameterSet
from trunnion.model.parts import USUAL_PRESSURE_ANGLE
from trunnion.model.quantity import Quantity
from trunnion.model.tolerances import Varying
from trunnion.model.units import KINDS, NUMBER, Dimension, UnitError, unit

__all__ = ["bare_number", "forgotten_units", "in_radians", "plain_angles"]

FAR = 20.0  # times the largest length with a unit: a plain length above it is none of this mechanism
LENGTH = KINDS["length"]


# ---- plain lengths among others with a unit -------------------------------------------------------------------


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


# ---- plain angles ---------------------------------------------------------------------------------------------

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
        numbers = (
            expression.unitless_angles(names, plain, angle) if expression else [float(entry.quantity.source)] * angle
        )
        for number in numbers:
            of_dimension = isinstance(number, str)
            value = float(mechanism.dimensions[number].evaluate()) if isinstance(number, str) else number
            where = f"dimensions.{number}" if of_dimension else entry.where
            rows = where if where.startswith("links.") else where.partition(".points.")[0]
            if math.isfinite(value) and abs(value) > abs(largest.get(rows, ("", 0.0))[1]):
                largest[rows] = (where, value, f"takes {value:g} for" if expression and not of_dimension else "is")
    stated = (entry.quantity for entry in mechanism.entries if entry.quantity is not USUAL_PRESSURE_ANGLE)
    with_units = any(quantity.unit for quantity in stated)
    for where, value, verb in largest.values():
        finding = in_radians(where, value, verb)
        if with_units or (finding.severity is Severity.WARNING and abs(value) > 2 * math.pi):
            yield finding


def in_radians(where: str, value: float, verb: str = "is") -> Finding:
    """What a plain number of an angle means.

    A whole number, or many turns, is a warning: it is likely meant in degrees; but a driver may well go through turns.
    """
    turned, integral = abs(value) > 2 * math.pi, value.is_integer() and value != 0
    doubtful = integral or (turned and not where.startswith("drivers."))
    size = f"{value / (2 * math.pi):.3g} turns" if turned else f"{math.degrees(value):.3g}°"
    what = f"{verb} {value:g} rad, which is {size}: a plain number is in radians"
    remedy = f"write {value:g} deg if it is in degrees, else {value:g} rad"
    return Finding(what, where, remedy, Severity.WARNING if doubtful else Severity.NOTE)

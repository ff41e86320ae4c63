"""Checks of numbers whose unit was likely forgotten: plain numbers among others with a unit, and plain angles."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Iterator, Mapping

from trunnion.errors import Finding, Severity
from trunnion.model.parameters import Entry, Numbers, ParameterSet, measured
from trunnion.model.parts import USUAL_PRESSURE_ANGLE
from trunnion.model.quantity import Quantity, evaluation_order
from trunnion.model.tolerances import further_entries
from trunnion.model.units import KINDS, NUMBER, Dimension, Kind, UnitError, unit

__all__ = ["bare_number", "forgotten_units", "in_radians", "plain_angles", "thousands"]

FAR = 20.0  # times the largest length with a unit: a plain length above it is none of this mechanism
WIDE = 0.01  # of that length: a plain tolerance, cost or limit above it is likely in another unit
LENGTH = KINDS["length"]
# kinds told of where lengths have units, and the unit that is likely meant
MEANT = {KINDS[name]: meant for name, meant in
         (("length", "mm"), ("stiffness", "N/mm"), ("force", "N"), ("speed", "mm/s"))}  # fmt: skip


# ---- plain numbers among others with a unit -------------------------------------------------------------------


def forgotten_units(mechanism: Numbers) -> Iterator[Finding]:
    """What plain numbers mean where more lengths have a unit, and plain lengths far above these.

    Of one length that is too large all that are told, so that a file in mm without units is one finding.
    """
    further = [entry for entry in further_entries(mechanism) if ".values." not in entry.path]
    entries = [entry for entry in (*mechanism.entries, *further) if not (entry.alias or entry.varies)]
    kinds, nominal = measured(mechanism, entries), mechanism.parameter_set.nominal
    places = [entry for entry in entries if entry.path.startswith("links.") and ".points." in entry.path]
    sizes = [abs(float(nominal[entry.path])) for entry in places
             if entry.kind is LENGTH and not _plain(mechanism, entry)]  # fmt: skip
    largest = max(sizes, default=0.0)
    plain: dict[str, tuple[float, Kind, bool]] = {}  # value, what it measures and whether it is a small size, by place
    for entry in entries if largest > 0 else ():
        kind, lower = kinds[entry.path], entry.is_limit and entry.location[-1] == "lower"  # one number states both
        if kind not in MEANT or lower or entry.path.startswith("assembly."):
            continue
        if kind.name == "speed" and not entry.path.startswith("drivers."):
            continue
        for path, value in _plain(mechanism, entry).items():
            if path == entry.path or _is_one(path, entry, kind):
                plain.setdefault(
                    entry.where if path == entry.path else path, (value, kind, entry in further or entry.is_limit)
                )
    stated = sum(kinds[entry.path] is LENGTH and bool(_literal_unit(entry.quantity)) for entry in entries)
    most = stated > sum(kind is LENGTH for _, kind, _ in plain.values())
    doubtful: dict[str, float] = {}
    for where, (value, kind, small) in plain.items():
        limit = (WIDE if small else 1.0) if most else FAR
        if kind is LENGTH and abs(value) > limit * largest:
            doubtful[where] = abs(value)
        elif most:
            other = f", or {value:g} {MEANT[kind]} if that is meant" if MEANT[kind] != kind.unit else ""
            others = "other lengths" if kind is LENGTH else "lengths"
            what = f"is {value:g} {kind.unit}, a plain number where {others} have a unit"
            yield Finding(what, where, f"write {value:g} {kind.unit}{other}", Severity.NOTE)
    if doubtful:
        where, others_too = max(doubtful, key=doubtful.__getitem__), len(doubtful) - 1
        value, also = doubtful[where], "as is another" if others_too == 1 else f"as are {others_too} others"
        what = f"is {value:g} m, {value / largest:.3g} times the largest length with a unit, {largest:g} m"
        what += f", {also} without a unit: units forgotten?" if others_too else ": a unit forgotten?"
        yield Finding(what, where, f"write it, as {value:g} mm", Severity.WARNING)


def _is_one(path: str, entry: Entry, kind: Kind) -> bool:
    """Whether a dimension measures what the entry does that speaks of it: as a plain factor it makes no sense there."""
    name = path.removeprefix("dimensions.")
    try:
        entry.quantity.check({operand: NUMBER if operand == name else None for operand in entry.quantity.names}, kind)
    except UnitError:
        return name in entry.quantity.names
    return False


def _literal_unit(quantity: Quantity) -> str:
    literal = quantity.expression.literal if quantity.expression else None
    return literal.unit if literal else ""


def _plain(mechanism: Numbers, entry: Entry) -> dict[str, float]:
    """The numbers without a unit that an entry is, or is made of, by path."""
    quantities: dict[str, Quantity] = {entry.path: entry.quantity}
    for quantity in (left := [entry.quantity]):  # it grows
        for name in quantity.names:
            if name in mechanism.dimensions and f"dimensions.{name}" not in quantities:
                quantities[f"dimensions.{name}"] = mechanism.dimensions[name]
                left.append(mechanism.dimensions[name])
    sources = {path: quantity.source for path, quantity in quantities.items()}
    return {path: float(source) for path, source in sources.items() if not isinstance(source, str) and source != 0}


def bare_number(numbers: ParameterSet, path: str, value: float) -> Iterator[Finding]:
    """A warning of a number without a unit, for one that the model states with a unit, if it is nearer to that number
    as it is written than to its value in SI."""
    entry, before = numbers.entries.get(path), float(numbers.nominal.get(path, math.nan))
    own_unit = _literal_unit(entry.quantity) if entry else ""
    if not own_unit or not abs(value * before) > 0:
        return
    factor = unit(own_unit)[0]
    written = before / float(factor)
    if abs(math.log(abs(value / written))) < abs(math.log(abs(value / before))):
        what = f"{value:g} is in SI units, where the model states {written:g} {own_unit}: a unit forgotten?"
        yield Finding(what, path, f"write {value:g}{own_unit}", Severity.WARNING)


# ---- plain angles ---------------------------------------------------------------------------------------------

Sayable = Mapping[str, Dimension | None]  # what an expression may speak of, and what each measures


def plain_angles(mechanism: Numbers, entries: Iterable[tuple[Entry, Sayable]]) -> Iterator[Finding]:
    """What numbers without a unit mean that are taken as radians, of the rows of a table the largest.

    entries: with what their expressions may speak of. In a model without any unit all is in SI, and only many turns are
    told.
    """
    plain: dict[str, tuple[str, ...]] = {}  # dimensions of plain numbers alone, with those that these stand in
    for name in evaluation_order(mechanism.dimensions)[0]:
        quantity = mechanism.dimensions[name]
        if quantity.expression is None or quantity.expression.is_plain(plain):
            plain[name] = tuple(origin for other in quantity.names for origin in plain[other]) or (name,)
    largest: dict[str, tuple[str, float, str]] = {}  # by group: where it stands, its value and a verb for it
    for entry, names in entries:
        for where, value, verb in _radians(mechanism, entry, names, plain):
            group = where if where.startswith("links.") else where.partition(".points.")[0]
            if math.isfinite(value) and abs(value) > abs(largest.get(group, ("", 0.0))[1]):
                largest[group] = (where, value, verb)
    stated = (entry.quantity for entry in mechanism.entries if entry.quantity is not USUAL_PRESSURE_ANGLE)
    with_units = any(_literal_unit(quantity) for quantity in stated)
    for finding, value in ((in_radians(*number), number[1]) for number in largest.values()):
        if with_units or (finding.severity is Severity.WARNING and abs(value) > 2 * math.pi):
            yield finding


def _radians(
    mechanism: Numbers, entry: Entry, names: Sayable, plain: Mapping[str, tuple[str, ...]]
) -> Iterator[tuple[str, float, str]]:
    """The numbers without a unit that an entry takes as radians, in itself or in the dimensions that it speaks of."""
    expression, angle = entry.quantity.expression, entry.kind is KINDS["angle"]
    if expression is None and angle:
        yield entry.where, float(entry.quantity.evaluate()), "is"
    for number in expression.unitless_angles(names, plain, angle) if expression else ():
        if isinstance(number, float):
            yield entry.where, number, f"takes {number:g} for"
        else:
            for name in plain[number]:
                yield f"dimensions.{name}", float(mechanism.dimensions[name].evaluate()), "is"


def thousands(where: str, quantity: Quantity, dimension: Dimension | None) -> Iterator[Finding]:
    """A warning of 30.000 N, which is 30 N, where thirty thousand may be meant; lengths are stated so in drawings."""
    text = str(quantity.source)
    if dimension is None or dimension in (LENGTH.dimensions[0], NUMBER) or not (number := _GROUPED.search(text)):
        return
    what = f"'{number[0]}' in '{text[:60]}' is read as {float(number[0]):g}, not as {number[0].replace('.', '')}"
    yield Finding(what, where, "write one of the two without closing zeros behind a point", Severity.WARNING)


_GROUPED = re.compile(r"(?<![\w.])[1-9][0-9]{0,2}\.[0-9]00(?=\s*[^\W\d])")  # and a unit


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

"""Checks of magnitudes: numbers whose unit was likely forgotten, angles among them; pins larger than links."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Iterator, Mapping

from trunnion.errors import Finding, Severity
from trunnion.model.checks.tolerances import stated_entries
from trunnion.model.parameters import Entry, Numbers, ParameterSet, measured
from trunnion.model.parts import USUAL_PRESSURE_ANGLE
from trunnion.model.quantity import Quantity, evaluation_order
from trunnion.model.units import KINDS, NUMBER, Dimension, Kind, UnitError, unit

__all__ = [
    "Bare",
    "bare_number",
    "in_radians",
    "magnitudes",
    "plain_dimensions",
    "radians",
    "thousands",
    "unitless_angles",
]

FAR = 20.0  # times the largest length stated with a unit: a plain number above it is no length of this mechanism
WIDE = 0.01  # of that length: a plain tolerance, play or limit above it is likely in another unit
# kinds told of where lengths have units, and the unit that is likely meant
MEANT = {
    KINDS[name]: text for name, text in (("length", "mm"), ("stiffness", "N/mm"), ("force", "N"), ("speed", "mm/s"))
}


def magnitudes(mechanism: Numbers, numbers: ParameterSet) -> Iterator[Finding]:
    """What plain numbers mean where most lengths have a unit; plain lengths far above these; pins above every link."""
    entries_stated = [entry for entry in stated_entries(mechanism, mechanism.entries) if ".values." not in entry.path]
    entries = {**numbers.entries, **{entry.path: entry for entry in entries_stated}}
    plain = {
        entry.path: entry.quantity.source for entry in entries_stated if not isinstance(entry.quantity.source, str)
    }
    nominal = {path: float(value) for path, value in {**numbers.nominal, **plain}.items()}
    values = {path: abs(value) for path, value in nominal.items()}
    lengths = [entry for path, entry in numbers.entries.items() if entry.kind is KINDS["length"] and path in values]
    places = [entry for entry in lengths if entry.path.startswith("links.") and ".points." in entry.path]
    pins = [entry for entry in lengths if entry.path.endswith((".pin.radius", ".guide.length")) and not entry.alias]
    others_largest = max((values[entry.path] for entry in places if not _plain(mechanism, entry)), default=0.0)
    bare = _without_unit(mechanism, entries, nominal) if others_largest > 0 else None
    bare = bare or {}
    doubtful: dict[str, float] = {}
    for path, kind in bare.items():
        if path.endswith(".limit.lower"):
            continue  # a plain limit is one number, told as the upper one
        narrow = path in plain or path.endswith(".limit.upper")
        if kind is KINDS["length"] and values[path] > (WIDE if narrow else 1.0) * others_largest:
            doubtful[path] = values[path]
        else:
            yield _meant(path, nominal[path], kind)
    far = [entry for entry in (*places, *pins) if values[entry.path] > FAR * others_largest > 0]
    doubtful |= {
        path: values[path] for entry in far for path in _plain(mechanism, entry) if values[path] > FAR * others_largest
    }
    if doubtful:
        path = max(doubtful, key=doubtful.__getitem__)
        yield _forgotten(path, doubtful[path], others_largest, len(doubtful) - 1)
    largest = 2 * max((values[entry.path] for entry in places), default=0.0)
    for entry in pins:
        if (
            values[entry.path] > largest > 0
            and not {entry.path} & {*doubtful, *bare}
            and entry.path.endswith(".radius")
        ):
            what = f"is {values[entry.path]:g} m, more than every link is long"
            yield Finding(what, entry.path, "check its unit", Severity.WARNING)


def _forgotten(path: str, value: float, largest: float, others: int = 0) -> Finding:
    """A warning of a length (m) above all that have a unit."""
    also = "as is another" if others == 1 else f"as are {others} others"
    more = f", {also} without a unit: units" if others else ": a unit"
    times = f"{value / largest:.3g} times the largest length with a unit, {largest:g} m"
    what = f"is {value:g} m, {times}{more} forgotten?"
    return Finding(what, path, f"write it, as {value:g} mm", Severity.WARNING)


def _meant(path: str, value: float, kind: Kind) -> Finding:
    """A note of a number that is small enough, or no length."""
    other = f", or {value:g} {MEANT[kind]} if that is meant" if MEANT[kind] != kind.unit else ""
    others = "other lengths" if kind is KINDS["length"] else "lengths"
    what = f"is {value:g} {kind.unit}, a plain number where {others} have a unit"
    return Finding(what, path, f"write {value:g} {kind.unit}{other}", Severity.NOTE)


def _without_unit(
    mechanism: Numbers, entries: Mapping[str, Entry], nominal: Mapping[str, float]
) -> dict[str, Kind] | None:
    """Plain numbers by path, with what they measure; None unless more lengths have a unit. A hint is no length."""
    kinds = measured(mechanism, entries.values())
    entries_stated = [entry for entry in entries.values() if not entry.alias and not entry.path.startswith("assembly.")]
    united = [
        entry for entry in entries_stated if kinds[entry.path] is KINDS["length"] and _literal_unit(entry.quantity)
    ]
    suspects: dict[str, Kind] = {}
    for entry in entries_stated:
        kind = kinds[entry.path]
        if kind in MEANT and (kind.name != "speed" or entry.path.startswith("drivers.")) and entry.path in nominal:
            suspects |= {
                path: kind for path in _plain(mechanism, entry) if path == entry.path or _is_one(path, entry, kind)
            }
    lengths = [path for path, kind in suspects.items() if kind is KINDS["length"]]
    return suspects if len(united) > len(lengths) else None


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


def _plain(mechanism: Numbers, entry: Entry) -> list[str]:
    """Paths of the numbers without a unit that an entry is, or is made of."""
    quantities: dict[str, Quantity] = {entry.path: entry.quantity}
    for quantity in (left := [entry.quantity]):  # it grows
        for name in quantity.names:
            if name in mechanism.dimensions and f"dimensions.{name}" not in quantities:
                quantities[f"dimensions.{name}"] = mechanism.dimensions[name]
                left.append(mechanism.dimensions[name])
    return [path for path, bare in quantities.items() if not isinstance(bare.source, str) and bare.source != 0]


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


Bare = tuple[str, float, bool]  # where a number without a unit stands, its value, whether in an expression


def plain_dimensions(dimensions: Mapping[str, Quantity]) -> dict[str, tuple[str, ...]]:
    """Dimensions made of numbers without a unit alone, each with those of them that its numbers stand in."""
    plain: dict[str, tuple[str, ...]] = {}
    for name in evaluation_order(dimensions)[0]:
        quantity = dimensions[name]
        if quantity.expression is None or quantity.expression.is_plain(plain):
            plain[name] = tuple(origin for other in quantity.names for origin in plain[other]) or (name,)
    return plain


def unitless_angles(
    mechanism: Numbers, entry: Entry, names: Mapping[str, Dimension | None], plain: Mapping[str, tuple[str, ...]]
) -> Iterator[Bare]:
    """The numbers without a unit that an entry takes as radians, in itself or in the dimensions that it speaks of."""
    quantity, angle = entry.quantity, entry.kind is KINDS["angle"]
    if quantity.expression is None:
        if angle:
            yield entry.where, float(quantity.evaluate()), False
        return
    for number in quantity.expression.unitless_angles(names, plain, angle):
        if isinstance(number, float):
            yield entry.where, number, True
            continue
        for name in plain[number]:
            yield f"dimensions.{name}", float(mechanism.dimensions[name].evaluate()), False


def thousands(where: str, quantity: Quantity, dimension: Dimension | None) -> Iterator[Finding]:
    """A warning of 30.000 N, which is 30 N, where thirty thousand may be meant; lengths are stated so in drawings."""
    text = str(quantity.source)
    if dimension is None or dimension in (LENGTH, NUMBER) or not (number := _GROUPED.search(text)):
        return
    what = f"'{number[0]}' in '{text[:60]}' is read as {float(number[0]):g}, not as {number[0].replace('.', '')}"
    yield Finding(what, where, "write one of the two without closing zeros behind a point", Severity.WARNING)


LENGTH = KINDS["length"].dimensions[0]
_GROUPED = re.compile(r"(?<![\w.])[1-9][0-9]{0,2}\.[0-9]00(?=\s*[^\W\d])")  # and a unit


def radians(mechanism: Numbers, bare: Iterable[Bare]) -> Iterator[Finding]:
    """What these numbers mean, of the rows of a table the largest.

    In a model without any unit all is in SI, and only many turns are told.
    """
    with_units = any(
        entry.quantity.expression and entry.quantity.expression.literal and entry.quantity.expression.literal.unit
        for entry in mechanism.entries
        if entry.quantity is not USUAL_PRESSURE_ANGLE
    )
    largest: dict[str, Bare] = {}
    for entry in bare:
        group = entry[0] if entry[0].startswith("links.") else entry[0].partition(".points.")[0]
        if entry[1] and math.isfinite(entry[1]) and (group not in largest or abs(entry[1]) > abs(largest[group][1])):
            largest[group] = entry
    for where, value, in_expression in largest.values():
        finding = in_radians(where, value, f"takes {value:g} for" if in_expression else "is")
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

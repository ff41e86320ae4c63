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
    stated = [one for one in stated_entries(mechanism, mechanism.entries) if ".values." not in one.path]
    entries = {**numbers.entries, **{one.path: one for one in stated}}
    plain = {one.path: one.quantity.source for one in stated if not isinstance(one.quantity.source, str)}
    nominal = {path: float(value) for path, value in {**numbers.nominal, **plain}.items()}
    values = {path: abs(value) for path, value in nominal.items()}
    lengths = [one for path, one in numbers.entries.items() if one.kind is KINDS["length"] and path in values]
    places = [one for one in lengths if one.path.startswith("links.") and ".points." in one.path]
    pins = [one for one in lengths if one.path.endswith((".pin.radius", ".guide.length")) and not one.alias]
    known = max((values[one.path] for one in places if not _plain(mechanism, one)), default=0.0)
    bare = _without_unit(mechanism, entries, nominal) if known > 0 else None
    bare = bare or {}
    told: dict[str, float] = {}
    for path, kind in bare.items():
        if path.endswith(".limit.lower"):
            continue  # a plain limit is one number, told as the upper one
        narrow = path in plain or path.endswith(".limit.upper")
        if kind is KINDS["length"] and values[path] > (WIDE if narrow else 1.0) * known:
            told[path] = values[path]
        else:
            yield _meant(path, nominal[path], kind)
    far = [one for one in (*places, *pins) if values[one.path] > FAR * known > 0]
    told |= {path: values[path] for one in far for path in _plain(mechanism, one) if values[path] > FAR * known}
    if told:
        path = max(told, key=told.__getitem__)
        yield _forgotten(path, told[path], known, len(told) - 1)
    largest = 2 * max((values[one.path] for one in places), default=0.0)
    for one in pins:
        if values[one.path] > largest > 0 and not {one.path} & {*told, *bare} and one.path.endswith(".radius"):
            what = f"is {values[one.path]:g} m, more than every link is long"
            yield Finding(what, one.path, "check its unit", Severity.WARNING)


def _forgotten(path: str, value: float, known: float, others: int = 0) -> Finding:
    """A warning of a length (m) above all that have a unit."""
    also = "as is another" if others == 1 else f"as are {others} others"
    more = f", {also} without a unit: units" if others else ": a unit"
    times = f"{value / known:.3g} times the largest length with a unit, {known:g} m"
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
    stated = [one for one in entries.values() if not one.alias and not one.path.startswith("assembly.")]
    united = [one for one in stated if kinds[one.path] is KINDS["length"] and _literal_unit(one.quantity)]
    found: dict[str, Kind] = {}
    for one in stated:
        kind = kinds[one.path]
        if kind in MEANT and (kind.name != "speed" or one.path.startswith("drivers.")) and one.path in nominal:
            found |= {path: kind for path in _plain(mechanism, one) if path == one.path or _is_one(path, one, kind)}
    lengths = [path for path, kind in found.items() if kind is KINDS["length"]]
    return found if len(united) > len(lengths) else None


def _is_one(path: str, entry: Entry, kind: Kind) -> bool:
    """Whether a dimension measures what the entry does that speaks of it: as a plain factor it makes no sense there."""
    name = path.removeprefix("dimensions.")
    try:
        entry.quantity.check({one: NUMBER if one == name else None for one in entry.quantity.names}, kind)
    except UnitError:
        return name in entry.quantity.names
    return False


def _literal_unit(quantity: Quantity) -> str:
    literal = quantity.expression.literal if quantity.expression else None
    return literal.unit if literal else ""


def _plain(mechanism: Numbers, entry: Entry) -> list[str]:
    """Paths of the numbers without a unit that an entry is, or is made of."""
    found: dict[str, Quantity] = {entry.path: entry.quantity}
    for quantity in (left := [entry.quantity]):  # it grows
        for name in quantity.names:
            if name in mechanism.dimensions and f"dimensions.{name}" not in found:
                found[f"dimensions.{name}"] = mechanism.dimensions[name]
                left.append(mechanism.dimensions[name])
    return [path for path, one in found.items() if not isinstance(one.source, str) and one.source != 0]


def bare_number(numbers: ParameterSet, path: str, value: float) -> Iterator[Finding]:
    """A warning of a number without a unit, for one that the model states with a unit, if it is nearer to that number
    as it is written than to its value in SI."""
    entry, before = numbers.entries.get(path), float(numbers.nominal.get(path, math.nan))
    own = _literal_unit(entry.quantity) if entry else ""
    if not own or not abs(value * before) > 0:
        return
    factor = unit(own)[0]
    written = before / float(factor)
    if abs(math.log(abs(value / written))) < abs(math.log(abs(value / before))):
        what = f"{value:g} is in SI units, where the model states {written:g} {own}: a unit forgotten?"
        yield Finding(what, path, f"write {value:g}{own}", Severity.WARNING)


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


def radians(mechanism: Numbers, found: Iterable[Bare]) -> Iterator[Finding]:
    """What these numbers mean, of the rows of a table the largest.

    In a model without any unit all is in SI, and only many turns are told.
    """
    with_units = any(
        one.quantity.expression and one.quantity.expression.literal and one.quantity.expression.literal.unit
        for one in mechanism.entries
        if one.quantity is not USUAL_PRESSURE_ANGLE
    )
    largest: dict[str, Bare] = {}
    for one in found:
        group = one[0] if one[0].startswith("links.") else one[0].partition(".points.")[0]
        if one[1] and math.isfinite(one[1]) and (group not in largest or abs(one[1]) > abs(largest[group][1])):
            largest[group] = one
    for where, value, in_expression in largest.values():
        finding = in_radians(where, value, f"takes {value:g} for" if in_expression else "is")
        if with_units or (finding.severity is Severity.WARNING and abs(value) > 2 * math.pi):
            yield finding


def in_radians(where: str, value: float, verb: str = "is") -> Finding:
    """What a plain number of an angle means.

    A whole number, or many turns, is a warning: it is likely meant in degrees; but a driver may well go through turns.
    """
    turned, whole = abs(value) > 2 * math.pi, value.is_integer() and value != 0
    doubtful = whole or (turned and not where.startswith("drivers."))
    size = f"{value / (2 * math.pi):.3g} turns" if turned else f"{math.degrees(value):.3g}°"
    what = f"{verb} {value:g} rad, which is {size}: a plain number is in radians"
    remedy = f"write {value:g} deg if it is in degrees, else {value:g} rad"
    return Finding(what, where, remedy, Severity.WARNING if doubtful else Severity.NOTE)

"""Checks of magnitudes: lengths far larger than the others, whose unit was likely forgotten; pins larger than links."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import TYPE_CHECKING

from trunnion.errors import Finding, Severity
from trunnion.model.parameters import Entry, ParameterSet
from trunnion.model.quantity import Quantity
from trunnion.model.units import KINDS, unit

if TYPE_CHECKING:
    from trunnion.model.numbers import Numbers

__all__ = ["bare_number", "magnitudes"]

FAR = 20.0  # times the largest length stated with a unit: a plain number above it is no length of this mechanism


def magnitudes(mechanism: Numbers, numbers: ParameterSet) -> Iterator[Finding]:
    """Warnings of plain lengths (m) far above those stated with a unit, and of pins larger than every link."""
    values = {path: abs(float(value)) for path, value in numbers.nominal.items()}
    lengths = [one for path, one in numbers.entries.items() if one.kind is KINDS["length"] and path in values]
    places = [one for one in lengths if one.path.startswith("links.") and ".points." in one.path]
    pins = [one for one in lengths if one.path.endswith((".pin.radius", ".guide.length")) and not one.alias]
    known = max((values[one.path] for one in places if not _plain(mechanism, one)), default=0.0)
    far = [one for one in (*places, *pins) if values[one.path] > FAR * known > 0]
    told = {path: values[path] for one in far for path in _plain(mechanism, one) if values[path] > FAR * known}
    if told:
        path = max(told, key=told.__getitem__)
        more = f", as are {len(told) - 1} others without a unit: units" if len(told) > 1 else ": a unit"
        times = f"{values[path] / known:.3g} times the largest length with a unit, {known:g} m"
        yield Finding(
            f"is {values[path]:g} m, {times}{more} forgotten?",
            path,
            f"write it, as {values[path]:g} mm",
            Severity.WARNING,
        )
    largest = 2 * max((values[one.path] for one in places), default=0.0)
    for one in pins:
        if values[one.path] > largest > 0 and one.path not in told and one.path.endswith(".radius"):
            what = f"is {values[one.path]:g} m, more than every link is long"
            yield Finding(what, one.path, "check its unit", Severity.WARNING)


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
    literal = entry.quantity.expression.literal if entry and entry.quantity.expression else None
    if entry is None or literal is None or not literal.unit or not value * before > 0:
        return
    factor = unit(literal.unit)[0]
    written = before / float(factor)
    if abs(math.log(value / written)) < abs(math.log(value / before)):
        what = f"{value:g} is in SI units, where the model states {written:g} {literal.unit}: a unit forgotten?"
        yield Finding(what, path, f"write {value:g}{literal.unit}", Severity.WARNING)

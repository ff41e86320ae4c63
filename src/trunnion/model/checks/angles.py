"""Checks of angles: numbers without a unit, which are in radians and may be meant in degrees."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping
from typing import TYPE_CHECKING

from trunnion.errors import Finding, Severity
from trunnion.model.dimensions import evaluation_order
from trunnion.model.parameters import Entry
from trunnion.model.parts import USUAL_PRESSURE_ANGLE
from trunnion.model.quantity import Quantity
from trunnion.model.units import KINDS, Dimension

if TYPE_CHECKING:
    from trunnion.model.numbers import Numbers

__all__ = ["Bare", "in_radians", "plain_dimensions", "radians", "unitless_angles"]

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

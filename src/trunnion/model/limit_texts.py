"""Half widths as texts: read as a user gives them, and written into the text of limits or of a number."""

from __future__ import annotations

import math
import re
from fractions import Fraction

import numpy as np

from trunnion.errors import Finding, MechanismError
from trunnion.model.expression import LITERAL, literal
from trunnion.model.quantity import Quantity, deviation_spans
from trunnion.model.units import Kind, UnitError, normalise

__all__ = ["DIGITS", "half_width", "limits_text", "number_with", "written"]

DIGITS = 12  # of a number as it is written, where nothing less is asked for
SHOWN_UNITS = {"length": ("mm", 1e3), "angle": ("deg", 180 / np.pi)}  # in which a tolerance is written
CLOSE = 1e-9  # of a number: what rounding down takes for the number itself
_EITHER = re.compile(r"^\s*(?:±|\+/-|\+-)\s*")


def half_width(stated: object, kind: Kind, name: str) -> float:
    """A half width in SI, of a number in SI or a text with a unit such as ±0.02 mm; MechanismError for others."""
    remedy = f"give a number of at least 0 in {kind.unit}, or a text such as ±{kind.example}"
    try:
        text = _EITHER.sub("", normalise(stated)) if isinstance(stated, str) else stated
        quantity = Quantity.read(text, kind)
        if quantity.tolerance or quantity.names or "%" in str(text):
            raise UnitError("is no number with a unit")
        value = float(quantity.evaluate())
    except UnitError as error:
        raise MechanismError(Finding(f"a half width of {_told(stated)} is none: {error.what}", name, remedy)) from None
    if value < 0:
        raise MechanismError(Finding(f"a half width of {_told(stated)} is none", name, remedy))
    return value


def _told(stated: object) -> str:
    return f"{stated:g}" if isinstance(stated, float) else f"'{str(stated)[:40]}'"


def written(value: float, kind: Kind, digits: int = DIGITS) -> str:
    """A size with its unit, rounded down to so many digits."""
    unit, factor = _unit(kind)
    return f"{_down(value * factor, digits):.{DIGITS}g} {unit}".strip()


def limits_text(middle: float, half: float, kind: Kind, digits: int = DIGITS) -> str:
    """Limits about a middle, as a file has them; the half width rounded down to so many digits."""
    if abs(middle) <= 1e-12 * half or (middle == 0 == half):
        return f"±{written(half, kind, digits)}"
    unit, factor = _unit(kind)
    size = _down(half * factor, digits)
    ends = (f"{middle * factor + side * size:+.{DIGITS}g} {unit}".strip() for side in (1, -1))
    return "/".join(ends)


def number_with(quantity: Quantity, half: float, digits: int = DIGITS) -> str | None:
    """The text of a number with other limits about the same middle, in the same units; None if it cannot be had."""
    if not isinstance(quantity.source, str) or quantity.tolerance is None:
        return None
    text = normalise(quantity.source)
    spans = deviation_spans(text)
    numbers = [found for start, end in spans if (found := LITERAL.search(text, start, end))]
    if not numbers or len(numbers) < len(spans):
        return None
    units = [found["unit"] or "" for found in numbers]
    stated = next((one for one in reversed(units) if one), "")
    if not stated and (value := LITERAL.fullmatch(text[: spans[0][0]].strip(" -+±/"))):
        stated = value["unit"] or ""
    lower, upper = quantity.tolerance
    middle = (lower + upper) / 2
    falling = len(spans) == 1 or text[spans[0][0]] == "+" or text[spans[1][0]] == "-"  # the upper limit comes first
    for k in reversed(range(len(spans))):
        factor = literal("1", units[k] or stated).value
        size = _down(half / factor, digits)
        if len(spans) == 1:
            told = f"{size:.{DIGITS}g}"
        else:
            told = f"{middle / factor + (size if falling == (k == 0) else -size):+.{DIGITS}g}"
        text = text[: spans[k][0]] + told + text[numbers[k].end("number") :]
    try:
        again = Quantity.read(text, quantity.kind).tolerance
    except UnitError:
        return None
    right = again and abs(sum(again) / 2 - middle) <= CLOSE * (abs(middle) + half) and again[1] - again[0] >= 0
    return text if right else None


def _unit(kind: Kind) -> tuple[str, float]:
    """The unit that a size is shown in, and what SI is multiplied by."""
    return SHOWN_UNITS.get(kind.name, (kind.unit if kind.dimensions and kind.unit != "1" else "", 1.0))


def _down(value: float, digits: int) -> float:
    """Rounded down to so many significant digits; as it is from `DIGITS` on."""
    if digits >= DIGITS or not value > 0:
        return value
    places = digits - 1 - math.floor(math.log10(value))
    scaled = Fraction(value) * Fraction(10) ** places
    return float(math.floor(scaled * Fraction(1 + CLOSE)) / Fraction(10) ** places)

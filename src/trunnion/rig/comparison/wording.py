"""Numbers, ranges and conditions of a comparison in words."""

from __future__ import annotations

import math
from collections.abc import Sequence

from trunnion.errors import counted

__all__ = ["extent", "in_which", "percent", "said", "turned"]


def said(value: float, unit: str, signed: bool = False) -> str:
    """A number with its unit; angles in degrees."""
    factor, shown = (180 / math.pi, "deg") if unit == "rad" else (1.0, "" if unit == "1" else unit)
    return f"{value * factor + 0.0:{'+' if signed else ''}.3g} {shown}".strip()


def turned(value: float, unit: str) -> str:
    """By how much the crank angle is off: from 1° on to 0.01°."""
    degrees = math.degrees(value)
    return f"{round(degrees, 2):+.6g} deg" if unit == "rad" and abs(degrees) >= 1 else said(value, unit, True)


def extent(values: Sequence[float], unit: str, signed: bool = True) -> str:
    low, high = said(min(values), unit, signed), said(max(values), unit, signed)
    return low if low == high else f"{low.partition(' ')[0]} to {high}"


def percent(value: float) -> str:
    return f"{100 * value:.0f} %"


def in_which(names: Sequence[str], of: int) -> str:
    """In which conditions."""
    if len(names) == of:
        return "in every condition" if of > 1 else f"in {names[0]}"
    first = "; ".join(names[:3]) + ("; …" if len(names) > 3 else "")
    return f"in {len(names)} of {counted(of, 'condition')} ({first})"

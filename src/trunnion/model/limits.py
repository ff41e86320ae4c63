"""Limits of a number as deviations from nominal: `±0.05 mm`, `+0.02/-0.01 mm`, or `0.05 mm` for either side."""

from __future__ import annotations

import re
from dataclasses import dataclass, replace
from typing import Annotated

import numpy as np
from pydantic import PlainSerializer, PlainValidator, WithJsonSchema

from trunnion.model.entry import problem
from trunnion.model.quantity import Quantity, term
from trunnion.model.units import UnitError, normalise

__all__ = ["LimitText", "Limits"]

_EITHER = re.compile(r"^(?:±|\+/-|\+-)\s*(.*)$", re.DOTALL)
_BOTH = re.compile(r"^([-+][0-9.][^/]*|0)/\s*([-+][0-9.].*|0.*)$", re.DOTALL)
_FORMS = "write ±0.05 mm or +0.02/-0.01 mm"


@dataclass(frozen=True)
class Limits:
    """Lower and upper deviation of a number: signed, as written; `source` is what stands in the file.

    With ± and without a sign a deviation may be an expression of the dimensions. Both quantities have the source of
    the whole, so that what is wrong with one of them is said once, in the words of the file.
    """

    source: float | str
    lower: Quantity
    upper: Quantity

    @classmethod
    def read(cls, source: object) -> Limits:
        """Limits from a text or a number (SI, to either side); a pydantic error if they are none."""
        if isinstance(source, Limits):
            return source
        try:
            if isinstance(source, str):
                return cls(source, *_from_text(source))
            upper = Quantity.read(source)
        except UnitError as error:
            raise problem(error.what, error.remedy or _FORMS) from error
        number = float(upper.source)
        if number < 0:
            raise problem(f"a limit to either side has no sign, {number:g} has", "write 1e-5, or +2e-5/-1e-5")
        return cls(upper.source, Quantity.read(-number), upper)


def _from_text(source: str) -> tuple[Quantity, Quantity]:
    text = normalise(source).strip()
    if found := _EITHER.match(text):
        return _either(found[1], source)
    if found := _BOTH.match(text):
        terms = [term(part) for part in found.groups()]
        unit = next((one for _, one in reversed(terms) if one), "")
        signed = [Quantity.read(f"{number} {own or unit}".strip()) for number, own in terms]
        sizes = [float(one.evaluate()) for one in signed]
        order = np.argsort(sizes, kind="stable")
        lower, upper = (replace(signed[place], source=source) for place in order)
        return lower, upper
    return _either(text, source)


def _either(text: str, source: str) -> tuple[Quantity, Quantity]:
    """The same to either side."""
    if text[:1] in ("+", "-"):
        raise problem(f"the limits '{source[:60]}' have a sign on one side only", f"{_FORMS}, of one side +0.02/0 mm")
    upper = Quantity.read(text)
    if upper.tolerance:
        raise problem(f"the limits '{source[:60]}' have a tolerance of their own", _FORMS)
    return replace(Quantity.read(f"-({text})"), source=source), replace(upper, source=source)


LimitText = Annotated[
    Limits,
    PlainValidator(Limits.read),
    PlainSerializer(lambda limits: limits.source),
    WithJsonSchema(
        {
            "type": ["number", "string"],
            "description": "deviations from nominal: ± to either side, or + and -; a number is SI, to either side",
            "examples": ["±0.05 mm", "+0.02/-0.01 mm"],
        }
    ),
]

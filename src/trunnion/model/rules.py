"""What a field of the model must be, stated with the field; one walker makes findings of what is not so.

A marker stands in the `Annotated` type of a field. Checks, the JSON Schema and the limits of an identification read it.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cache
from typing import Annotated, Any, Union, get_args, get_origin

from pydantic import BaseModel, GetJsonSchemaHandler
from pydantic.json_schema import JsonSchemaValue
from pydantic_core import CoreSchema

from trunnion.algebra.namespace import Number
from trunnion.errors import Finding
from trunnion.model.units import KINDS, Kind

__all__ = [
    "Directed",
    "NotNegative",
    "NotZero",
    "Positive",
    "Rising",
    "Within",
    "group_findings",
    "limit_findings",
    "markers",
]

ROUNDING = 1e-12  # of a limit: 180 deg as 3.14159265358980 rad is no more than it
Values = Mapping[str, Number]


# ---- of one number --------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Within:
    """A number between two limits, SI. A limit with a round bracket in `ends` is itself outside.

    remedy: what to do about a number outside, where the limits alone do not say it.
    """

    low: float = -math.inf
    high: float = math.inf
    ends: str = "[]"
    remedy: str = ""

    def what(self, value: float, kind: Kind) -> str:
        """What is wrong with a number; empty if nothing is, nan among it."""
        slack = [ROUNDING * abs(end) if math.isfinite(end) else 0.0 for end in (self.low, self.high)]
        below = value <= self.low if self.ends[0] == "(" else value < self.low - slack[0]
        above = value >= self.high if self.ends[1] == ")" else value > self.high + slack[1]
        if not (below or above):
            return ""
        negative = self.low == 0 and self.ends[0] == "[" and below
        return f"is {_shown(value, kind)}, which is {'negative' if negative else f'not {self.limits(kind)}'}"

    def limits(self, kind: Kind) -> str:
        """The limits in words: `at least 0`, `above 0 and at most 1`."""
        low = f"{'above' if self.ends[0] == '(' else 'at least'} {_shown(self.low, kind) if self.low else 0}"
        high = f"{'below' if self.ends[1] == ')' else 'at most'} {_shown(self.high, kind)}"
        return " and ".join(text for text, end in ((low, self.low), (high, self.high)) if math.isfinite(end))

    def instead(self, kind: Kind) -> str:
        """What to do about a number outside."""
        of = "" if self.ends[0] == "(" else "of "
        return f"give a value {of}{self.limits(kind)}" + f"; {self.remedy}" * bool(self.remedy)

    def __get_pydantic_json_schema__(self, schema: CoreSchema, handler: GetJsonSchemaHandler) -> JsonSchemaValue:
        """The limits of a plain number, beside its form."""
        found = handler(schema)
        for end, key, bracket in ((self.low, "inimum", self.ends[0]), (self.high, "aximum", self.ends[1])):
            if math.isfinite(end):
                found[f"exclusiveM{key}" if bracket in "()" else f"m{key}"] = end
        return found


@dataclass(frozen=True)
class NotZero:
    """A number other than 0, which would mean something."""

    meaning: str
    remedy: str = "give another value"

    def what(self, value: float, kind: Kind) -> str:
        """What is wrong with a number; empty if nothing is."""
        return f"is 0: {self.meaning}" if value == 0 else ""

    def instead(self, kind: Kind) -> str:
        """What to do about a 0."""
        return self.remedy


NotNegative = Within(0.0)
Positive = Within(0.0, ends="(]")


def _shown(value: float, kind: Kind) -> str:
    """A number with its unit, an angle in degrees."""
    if kind is KINDS["angle"]:
        return f"{math.degrees(value):.4g} deg"
    known = len(kind.dimensions) == 1 and kind.unit != "1"
    return f"{value:g} {kind.unit}" if known else f"{value:g}"


def limit_findings(rules: tuple[Any, ...], value: float, kind: Kind, where: str) -> Iterator[Finding]:
    """Findings about a number that its rules exclude."""
    for rule in rules:
        if isinstance(rule, Within | NotZero) and (what := rule.what(value, kind)):
            yield Finding(what, where, rule.instead(kind))


# ---- of several numbers ---------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Directed:
    """Components of a direction, of which one is other than 0."""

    def check(self, path: str, values: Values) -> Iterator[Finding]:
        """A finding where all are 0. path: of the field."""
        components = [values[f"{path}.{axis}"] for axis in "xyz" if f"{path}.{axis}" in values]
        if components and all(one == 0 for one in components):
            example = ", ".join(("1", "0", "0")[: len(components)])
            yield Finding("has no direction: all its components are 0", path, f"write [{example}] for along x")


@dataclass(frozen=True)
class Rising:
    """Points in the order of their first column, which has this name in paths."""

    column: str

    def check(self, path: str, values: Values) -> Iterator[Finding]:
        """Findings about points that do not come after the one before. path: of the field."""
        k, before = 0, -math.inf
        while (here := values.get(f"{path}.{k}.{self.column}")) is not None:
            if here <= before:
                what = f"its {self.column} {here:g} does not come after {before:g} of the point before (SI)"
                yield Finding(what, f"{path}.{k}", f"sort the points by {self.column}; make a jump steep, not upright")
            k, before = k + 1, here


def group_findings(path: str, part: BaseModel, values: Values) -> Iterator[Finding]:
    """Findings about fields of several numbers, of a part and of what is in it."""
    for where, below in parts(path, part):
        for key, rules in markers(type(below)).items():
            for rule in rules:
                if isinstance(rule, Directed | Rising) and getattr(below, key) is not None:
                    yield from rule.check(f"{where}.{key}", values)


# ---- where rules stand ----------------------------------------------------------------------------------------


@cache
def markers(kind: type[BaseModel]) -> Mapping[str, tuple[Any, ...]]:
    """The rules of the fields of a part, by key."""
    fields = {key: (*field.metadata, *_marked(field.annotation)) for key, field in kind.model_fields.items()}
    return {key: found for key, all_of in fields.items() if (found := tuple(one for one in all_of if _is_rule(one)))}


def _is_rule(marker: object) -> bool:
    return isinstance(marker, Within | NotZero | Directed | Rising)


def _marked(annotation: Any) -> Iterator[Any]:
    """What an annotation is marked with, itself or as one of several forms."""
    if get_origin(annotation) is Annotated:
        yield from annotation.__metadata__
        yield from _marked(get_args(annotation)[0])
    elif get_origin(annotation) in (Union, type(int | str)):
        for one in get_args(annotation):
            yield from _marked(one)


def parts(path: str, value: object) -> Iterator[tuple[str, BaseModel]]:
    """A part of the model and every part in it, with their paths."""
    if isinstance(value, BaseModel):
        yield path, value
        below: Mapping[str, object] = {key: getattr(value, key) for key in type(value).model_fields}
    else:
        below = value if isinstance(value, Mapping) else {}
    for key, one in below.items():
        if isinstance(one, BaseModel | Mapping):
            yield from parts(f"{path}.{key}", one)

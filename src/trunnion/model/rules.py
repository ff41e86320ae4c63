"""What a field of the model must be, stated with the field; one walker makes findings of what is not so.

A marker stands in the `Annotated` type of a field. Checks, the JSON Schema and the limits of an identification read it.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from functools import cache
from typing import Annotated, Any, Union, get_args, get_origin

from pydantic import BaseModel, GetJsonSchemaHandler
from pydantic.json_schema import JsonSchemaValue
from pydantic_core import CoreSchema

from trunnion.algebra.namespace import Number
from trunnion.errors import Finding
from trunnion.model.names import nearest
from trunnion.model.units import KINDS, Kind

ROUNDING = 1e-12  # of a limit: 180 deg as 3.14159265358980 rad is no more than it
Values = Mapping[str, Number]
Model = Any  # a `Fields`, which stands above: it has `coordinates`, how many a point has, and `named`


class Rule:
    """A marker of a field."""


def faults(where: str, *rows: tuple[Any, ...]) -> Iterator[Finding]:
    """Findings of the rows whose first is true.

    A row is: whether something is wrong, with which key of the part at `where` (none if empty), what, and what to do
    about it where that is not plain.
    """
    for wrong, key, what, *remedy in rows:
        if wrong:
            yield Finding(what, f"{where}.{key}".strip("."), *remedy)


# ---- of numbers -----------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Within(Rule):
    """A number between two limits, SI. A limit with a round bracket in `ends` is itself outside."""

    low: float = -math.inf
    high: float = math.inf
    ends: str = "[]"

    def what(self, value: float, kind: Kind) -> str:
        """What is wrong with a number; empty if nothing is, nan among it."""
        below = value <= self.low if self.ends[0] == "(" else value < self.low - ROUNDING * abs(self.low)
        above = value >= self.high if self.ends[1] == ")" else value > self.high + ROUNDING * abs(self.high)
        if not (below or above):
            return ""
        if below and self.low == 0 and self.ends[0] == "[":
            return f"is {_with_unit(value, kind)}, which is negative"
        low = f"{'above' if self.ends[0] == '(' else 'at least'} {_with_unit(self.low, kind) if self.low else 0}"
        high = f"{'below' if self.ends[1] == ')' else 'at most'} {_with_unit(self.high, kind)}"
        limits = [text for text, end in ((low, self.low), (high, self.high)) if math.isfinite(end)]
        return f"is {_with_unit(value, kind)}, which is not {' and '.join(limits)}"

    def __get_pydantic_json_schema__(self, schema: CoreSchema, handler: GetJsonSchemaHandler) -> JsonSchemaValue:
        """The limits of a plain number, beside its form."""
        limits = handler(schema)
        for end, key, bracket in ((self.low, "inimum", self.ends[0]), (self.high, "aximum", self.ends[1])):
            if math.isfinite(end):
                limits[f"exclusiveM{key}" if bracket in "()" else f"m{key}"] = end
        return limits


@dataclass(frozen=True)
class NotZero(Rule):
    """A number other than 0, which would mean something."""

    meaning: str

    def what(self, value: float, kind: Kind) -> str:
        """What is wrong with a number; empty if nothing is."""
        return f"is 0: {self.meaning}" if value == 0 else ""


NotNegative = Within(0.0)
Positive = Within(0.0, ends="(]")


def _with_unit(value: float, kind: Kind) -> str:
    """A number with its unit, an angle in degrees."""
    if kind is KINDS["angle"]:
        return f"{math.degrees(value):.4g} deg"
    single = len(kind.dimensions) == 1 and kind.unit != "1"
    return f"{value:g} {kind.unit}" if single else f"{value:g}"


def limit_findings(rules: tuple[Any, ...], value: float, kind: Kind, where: str) -> Iterator[Finding]:
    """Findings about a number that its rules exclude."""
    for rule in rules:
        if isinstance(rule, Within | NotZero) and (what := rule.what(value, kind)):
            yield Finding(what, where)


@dataclass(frozen=True)
class Directed(Rule):
    """Components of a direction, of which one is other than 0."""

    def check(self, path: str, values: Values) -> Iterator[Finding]:
        """A finding where all are 0. path: of the field."""
        components = [values[f"{path}.{axis}"] for axis in "xyz" if f"{path}.{axis}" in values]
        if components and not any(components):
            yield Finding("has no direction: all its components are 0", path)


@dataclass(frozen=True)
class Rising(Rule):
    """Points in the order of their first column, which has this name in paths."""

    column: str

    def check(self, path: str, values: Values) -> Iterator[Finding]:
        """Findings about points that do not come after the one before. path: of the field."""
        k, before = 0, -math.inf
        while (here := values.get(f"{path}.{k}.{self.column}")) is not None:
            if here <= before:
                what = f"its {self.column} {here:g} does not come after {before:g} of the point before (SI)"
                yield Finding(what, f"{path}.{k}", "make a jump steep, not upright")
            k, before = k + 1, here


def group_findings(path: str, part: BaseModel, values: Values) -> Iterator[Finding]:
    """Findings about fields of several numbers, of a part and of what is in it."""
    for where, inner in _parts(path, part):
        for key, rule in _stated_rules(inner, Directed | Rising):
            yield from rule.check(f"{where}.{key}", values)


# ---- of names and keys ----------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Refers(Rule):
    """The name of another part, or several: of a link, joint, point, process …; distinct: no two alike."""

    noun: str
    distinct: bool = False

    def findings(self, key: str, part: BaseModel, where: str, model: Model) -> Iterator[Finding]:
        """Findings about names that mean nothing. where: the part stands."""
        value, at = getattr(part, key), f"{where}.{key}".lstrip(".")
        names = (value,) if isinstance(value, str) else value
        for name in dict.fromkeys(names):
            yield from self.missing(name, at, model)
            if self.distinct and names.count(name) > 1:
                yield Finding(f"names the {self.noun.removeprefix('any ')} '{name}' twice", at)

    def missing(self, name: str, where: str, model: Model) -> Iterator[Finding]:
        """A finding if there is no part of this name."""
        if name not in (names := model.named(self.noun)):
            form = " (write link.point)" if self.noun == "point" else ""
            yield Finding(f"there is no {self.noun.removeprefix('any ')} '{name}'", where, nearest(name, names) + form)


@dataclass(frozen=True)
class InSpace(Rule):
    """As many coordinates as a point of the model has."""

    def findings(self, key: str, part: BaseModel, where: str, model: Model) -> Iterator[Finding]:
        """A finding about another number of coordinates; the position of a point is the point itself."""
        yield from self.counted(getattr(part, key), where if key == "at" else f"{where}.{key}".lstrip("."), model)

    def counted(self, value: object, where: str, model: Model) -> Iterator[Finding]:
        """A finding about a list that has another number of coordinates."""
        size = model.coordinates
        if isinstance(value, tuple) and len(value) != size:
            what = f"has {len(value)} coordinates, a {'planar' if size == 2 else 'spatial'} model needs {size}"
            yield Finding(what, where, f"give {size}; a decimal comma would make two numbers of one")


@dataclass(frozen=True)
class OnlyWith(Rule):
    """A key that has an effect only beside another. words: what that is, where its name does not tell."""

    key: str
    words: str = ""

    def findings(self, key: str, part: BaseModel, where: str, model: Model) -> Iterator[Finding]:
        """A finding if the other is not stated."""
        if key in part.model_fields_set and not getattr(part, self.key):
            yield Finding(f"has no effect without {self.words or self.key}", f"{where}.{key}")


class NotWith(Rule):
    """A key that is not stated beside any of some others, but for what it is anyway."""

    def __init__(self, *keys: str) -> None:
        self.keys = keys

    def findings(self, key: str, part: BaseModel, where: str, model: Model) -> Iterator[Finding]:
        """A finding if one of the others is stated."""
        others = [other for other in self.keys if getattr(part, other) is not None]
        if others and getattr(part, key) != type(part).model_fields[key].default:
            yield Finding(f"is stated beside {' and '.join(others)}", f"{where}.{key}", "state one of them")


@dataclass(frozen=True, eq=False)
class Selects(Rule):
    """A word that says which other keys of its part are needed, and which have an effect.

    table: by word, with `needs` and `takes`; also: keys beside any word; instead: the key that may stand for one that
    is needed.
    """

    noun: str
    table: Mapping[str, Any]
    also: tuple[str, ...] = ()
    instead: Mapping[str, str] = field(default_factory=dict)

    def findings(self, key: str, part: BaseModel, where: str, model: Model) -> Iterator[Finding]:
        """Findings about keys that are missing and keys without effect."""
        word = getattr(part, key)
        takes = {name: (*entry.needs, *entry.takes) for name, entry in self.table.items()}
        keys = {self.instead.get(name, name) for name in part.model_fields_set - {key, *self.also}}
        yield from stray(keys, takes, key, word, self.noun, where)
        for need in self.table[word].needs:
            if getattr(part, need) is None and need not in keys:
                either = " or ".join([need, *(other for other, needed in self.instead.items() if needed == need)])
                yield Finding(f"'{need}' is missing", where, f"add {either}, or state {key}: {' or '.join(self.table)}")


def stray(
    keys: Iterable[str], takes: Mapping[str, Collection[str]], key: str, word: str, noun: str, where: str
) -> Iterator[Finding]:
    """Findings about keys that have no effect beside a word; takes: keys by word."""
    for vain in sorted({*keys} - {*takes[word]}):
        others = [name for name, effective in takes.items() if vain in effective]
        other = f", or state {key}: {' or '.join(others)}" if others else ""
        remedy = f"remove it{other}; the parameters of {word} are {', '.join(takes[word]) or 'nothing but limits'}"
        yield Finding(f"'{vain}' has no effect on the {noun} {word}", f"{where}.{vain}", remedy)


def key_findings(model: Any) -> Iterator[Finding]:
    """Findings about names and keys, of every part of a model as it is stated."""
    sections = {key: getattr(model, key) for key in type(model).model_fields if key not in ("joints", "loop")}
    for where, part in _parts("", model, {**sections, "joints": model.stated_joints}):
        for key, rule in _stated_rules(part, Refers | InSpace | OnlyWith | NotWith | Selects):
            yield from rule.findings(key, part, where, model)
        for keys, alone in ((part.one_of, True), (part.some_of, False)):
            several = [key for key in keys if getattr(part, key) is not None]
            if keys and (not several or (alone and len(several) > 1)):
                remedy = f"state {'one' if alone else 'at least one'} of {', '.join(keys)}"
                yield Finding(f"states {' and '.join(several) or 'nothing'}", where, remedy)


# ---- where rules stand ----------------------------------------------------------------------------------------


@cache
def markers(kind: type[BaseModel]) -> Mapping[str, tuple[Any, ...]]:
    """The rules of the fields of a part, by key."""
    fields = {key: (*field.metadata, *_marked(field.annotation)) for key, field in kind.model_fields.items()}
    return {key: tuple(marker for marker in every if isinstance(marker, Rule)) for key, every in fields.items()}


def _marked(annotation: Any) -> Iterator[Any]:
    """What an annotation is marked with, itself or as one of several forms."""
    if get_origin(annotation) is Annotated:
        yield from annotation.__metadata__
        yield from _marked(get_args(annotation)[0])
    elif get_origin(annotation) in (Union, type(int | str)):
        for form in get_args(annotation):
            yield from _marked(form)


def _stated_rules(part: BaseModel, kinds: Any) -> Iterator[tuple[str, Any]]:
    """The rules of some kinds of the keys that a part states, with the key."""
    for key, rules in markers(type(part)).items():
        yield from ((key, rule) for rule in rules if isinstance(rule, kinds) and getattr(part, key) is not None)


def _parts(path: str, value: object, below: Mapping[str, object] | None = None) -> Iterator[tuple[str, Any]]:
    """A part and every part in it, with the path of each. below: what is in it, if not what its fields hold."""
    if isinstance(value, BaseModel):
        yield path, value
        below = below or {key: getattr(value, key) for key in type(value).model_fields}
    for key, item in (below or (value if isinstance(value, Mapping) else {})).items():
        if isinstance(item, BaseModel | Mapping):
            yield from _parts(f"{path}.{key}".lstrip("."), item)

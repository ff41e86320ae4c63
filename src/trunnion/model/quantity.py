"""Quantities of a model file: a number in SI, a text with unit and tolerance, or an expression; the named dimensions.

`Quantity` keeps what was written, so that a model is written back as it was read. The annotated types `Length`,
`Mass`, … say what a field of the model measures: pydantic reads a number or a text into a `Quantity` of that kind."""

from __future__ import annotations

import re
import sys
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from functools import lru_cache
from graphlib import CycleError, TopologicalSorter
from typing import Annotated, Any

import numpy as np
from pydantic import GetCoreSchemaHandler, GetJsonSchemaHandler
from pydantic.json_schema import JsonSchemaValue
from pydantic_core import PydanticCustomError, core_schema

from trunnion.algebra.namespace import Number
from trunnion.model.expression import LITERAL, Expression, literal, parse
from trunnion.model.units import ANY, KINDS, NUMBER, Dimension, Kind, UnitError, dimension_text, fits, normalise

_SYMMETRIC = re.compile(r"^(.*?)\s*(?:±|\+/-|\+-)\s*(.*)$", re.DOTALL)
_LIMITS = re.compile(r"^(.*\S)\s+([-+][0-9.][^/]*|0)/\s*([-+][0-9.].*|0)$", re.DOTALL)


@dataclass(frozen=True)
class Quantity:
    """A number of the model, as written.

    source: the number (SI) or text; kind: what it measures; tolerance: (lower, upper) signed deviations in SI.
    Two quantities are equal if they are written alike.
    """

    source: float | str
    kind: Kind = ANY
    tolerance: tuple[float, float] | None = field(default=None, compare=False)
    expression: Expression | None = field(default=None, compare=False, repr=False)

    @classmethod
    def read(cls, source: object, kind: Kind = ANY) -> Quantity:
        """A quantity from a number (SI) or a text; UnitError if it is none or of the wrong kind."""
        if isinstance(source, Quantity):
            if source.kind == kind:
                return source
            source = source.source
        if isinstance(source, (bool, np.bool_)) or not isinstance(source, (int, float, str, np.number)):
            shapes = {bool: "a yes/no value", list: "a list", tuple: "a list", dict: "a group of entries"}
            shape = shapes.get(type(source), f"a {type(source).__name__}")
            what = "is empty" if source is None else f"is {shape}, not a number or text"
            raise UnitError(what, f"give a {kind.name} such as {kind.example}")
        if isinstance(source, str):
            return cls(source, kind, *_read_text(source, kind))
        value = source.item() if isinstance(source, np.number) else source
        if not abs(value) <= sys.float_info.max:  # nan, or an int beyond the floats
            raise UnitError(f"{str(value)[:20]} is not a finite number", "give a finite number")
        return cls(value, kind)

    def __repr__(self) -> str:
        return f"Quantity({self.source!r}, {self.kind.name})"

    @property
    def names(self) -> tuple[str, ...]:
        """The dimensions its expression speaks of."""
        return self.expression.names if self.expression else ()

    @property
    def unit(self) -> str:
        """Its unit, if it is written as one number with a unit, be it with limits."""
        literal = self.expression.literal if self.expression else None
        return literal.unit if literal else ""

    @property
    def alone(self) -> float | str:
        """It as written, without the limits that stand with it."""
        return _split(normalise(self.source), self.kind)[0].strip() if isinstance(self.source, str) else self.source

    def evaluate(self, values: Mapping[str, Number] | None = None) -> Number:
        """The value in SI, from those of `names`: floats, arrays (sample, 1) or duals; nan or inf where undefined."""
        if self.expression is None:
            return float(self.source)
        with np.errstate(all="ignore"):
            return self.expression.evaluate(values or {})

    def check(self, names: Mapping[str, Dimension | None], kind: Kind | None = None) -> Dimension | None:
        """The dimension of the value, given those of `names` (None: unknown); UnitError if `kind` forbids it."""
        if self.expression is None:
            return None
        kind = kind or self.kind
        needed, dimension = kind.with_article, self.expression.dimension(names)
        if self.expression.bare and dimension is not None and kind.dimensions and NUMBER not in kind.dimensions:
            remedy = f"write a unit, such as {kind.example}, or a plain number in {kind.unit}"
            raise UnitError(f"'{self.source}' has no unit where {needed} is needed", remedy)
        if not kind.accepts(dimension):
            assert dimension is not None  # None fits every kind
            what = f"'{self.source}' is {dimension_text(dimension)} where {needed} is needed"
            raise UnitError(what, f"write {needed} such as {kind.example}")
        return dimension


@lru_cache(maxsize=4096)
def _read_text(text: str, kind: Kind) -> tuple[tuple[float, float] | None, Expression]:
    """Tolerance and expression of a text, read once: models made from one another share most of theirs.

    Every quantity is still one of its own: whether a joint's is that of the defaults is told by which object it is.
    """
    try:
        main, tolerance = _split(normalise(text), kind)
        expression = parse(main)
    except UnitError as error:
        raise UnitError(error.what, error.remedy or f"write a {kind.name} such as {kind.example}") from None
    quantity = Quantity(text, kind, tolerance, expression)
    if not expression.names:
        quantity.check({})
        if not np.isfinite(value := quantity.evaluate()):
            raise UnitError(f"'{text}' has no finite value ({value})", "check divisions and roots")
    return tolerance, expression


def _split(text: str, kind: Kind) -> tuple[str, tuple[float, float] | None]:
    """Value text and tolerance in SI; a unit stated once serves the value and the tolerance."""
    if match := _SYMMETRIC.match(text):
        main, parts = match[1], [match[2]]
        if not main.strip():
            remedy = f"write 60 mm {text}, or tolerances: {{NAME: {text}}}"
            raise UnitError(f"'{text}' is a tolerance without a value", remedy)
    elif match := _LIMITS.match(text):
        main, parts = match[1], [match[2], match[3]]
    else:
        return text, None
    terms = signed_terms(parts)
    value = LITERAL.fullmatch(main.strip().lstrip("-+ "))
    unit_of_value = value["unit"] or "" if value else ""
    unit = terms[-1][1] or unit_of_value
    if value and unit == "%" and unit_of_value != unit:
        raise UnitError(f"the tolerance in '{text}' is in percent, the value is not", "write the deviation itself")
    if value and not unit_of_value and unit:
        main = f"{main.strip()} {unit}"
    if not unit and not value and kind.dimensions != KINDS["number"].dimensions:
        raise UnitError(f"the tolerance in '{text}' has no unit", "write the unit of the tolerance, such as ± 0.05 mm")
    dimension = parse(main).dimension({}) if value else None
    deviations = []
    for number, own_unit in terms:
        deviation = literal(number.lstrip("-+"), own_unit or unit)
        alike = dimension is None or (fits(deviation.dimension, dimension) and fits(dimension, deviation.dimension))
        if not alike or ((own_unit or unit) and not kind.accepts(deviation.dimension)):
            beside = f", the value {dimension_text(dimension)}" if dimension else ""
            what = f"the tolerance in '{text}' is {dimension_text(deviation.dimension)}{beside}"
            raise UnitError(what, "give both the same unit")
        deviations.append(-deviation.value if number.startswith("-") else deviation.value)
    if len(deviations) == 1:
        if terms[0][0][0] in "-+":
            raise UnitError(f"the tolerance in '{text}' has a sign after ±", "write ± 0.05 mm")
        deviations.append(-deviations[0])
    return main, (min(deviations), max(deviations))


def signed_terms(parts: Iterable[str]) -> list[tuple[str, str]]:
    """Number, with its sign, and unit of each side of a tolerance; a unit that stands at one serves both."""
    terms: list[tuple[str, str]] = []
    for text in map(str.strip, parts):
        sign = text[:1] if text[:1] in ("-", "+") else ""
        match = LITERAL.fullmatch(text[len(sign) :].strip())
        if not match:
            raise UnitError(f"the tolerance '{text}' is not a number with a unit", "write ± 0.05 mm or +0.02/-0.01 mm")
        terms.append((sign + match["number"], match["unit"] or ""))
    common = next((unit for _, unit in reversed(terms) if unit), "")
    return [(number, unit or common) for number, unit in terms]


@dataclass(frozen=True)
class _Read:
    """Annotation that makes pydantic read a number or text into a Quantity of this kind."""

    kind: Kind

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> core_schema.CoreSchema:
        """Validation by `Quantity.read`; written back as it was written."""

        def read(value: object) -> Quantity:
            try:
                return Quantity.read(value, self.kind)
            except UnitError as error:
                raise PydanticCustomError("quantity", "{what}", {"what": error.what, "remedy": error.remedy}) from error

        return core_schema.no_info_plain_validator_function(
            read, serialization=core_schema.plain_serializer_function_ser_schema(lambda quantity: quantity.source)
        )

    def __get_pydantic_json_schema__(
        self, schema: core_schema.CoreSchema, handler: GetJsonSchemaHandler
    ) -> JsonSchemaValue:
        """A number or a text, with its SI unit and an example."""
        return {
            "type": ["number", "string"],
            "description": f"{self.kind.name}: a number in {self.kind.unit}, or a text with unit, ± or an expression",
            "examples": [self.kind.example],
        }


AnyQuantity = Annotated[Quantity, _Read(ANY)]
Dimensionless = Annotated[Quantity, _Read(KINDS["number"])]
Length = Annotated[Quantity, _Read(KINDS["length"])]
Angle = Annotated[Quantity, _Read(KINDS["angle"])]
Mass = Annotated[Quantity, _Read(KINDS["mass"])]
Inertia = Annotated[Quantity, _Read(KINDS["moment of inertia"])]
Force = Annotated[Quantity, _Read(KINDS["force"])]
Moment = Annotated[Quantity, _Read(KINDS["moment"])]
Acceleration = Annotated[Quantity, _Read(KINDS["acceleration"])]
Time = Annotated[Quantity, _Read(KINDS["time"])]
Rate = Annotated[Quantity, _Read(KINDS["angular speed"] | KINDS["speed"])]
MassOrInertia = Annotated[Quantity, _Read(KINDS["mass"] | KINDS["moment of inertia"])]
ForceOrMoment = Annotated[Quantity, _Read(KINDS["force"] | KINDS["moment"])]
Pressure = Annotated[Quantity, _Read(KINDS["pressure"])]
Stiffness = Annotated[Quantity, _Read(KINDS["stiffness"] | KINDS["torsional stiffness"])]
LineStiffness = Annotated[Quantity, _Read(KINDS["stiffness"])]
TorsionalStiffness = Annotated[Quantity, _Read(KINDS["torsional stiffness"])]
Damping = Annotated[Quantity, _Read(KINDS["damping"] | KINDS["torsional damping"])]
AngleOrLength = Annotated[Quantity, _Read(KINDS["angle"] | KINDS["length"])]


def evaluation_order(
    dimensions: Mapping[str, Quantity], errors: Mapping[str, Quantity] | None = None
) -> tuple[list[str], list[list[str]]]:
    """Dimensions in an order in which each follows those it speaks of, and the circles that have none.

    errors: deviations of some of them, which may speak of dimensions too.
    """
    graph: dict[str, set[str]] = {name: set() for name in dimensions}
    for name, quantity in (*dimensions.items(), *(errors or {}).items()):
        graph[name] |= dimensions.keys() & quantity.names
    circles: list[list[str]] = []
    while True:
        try:
            return list(TopologicalSorter(graph).static_order()), circles
        except CycleError as error:
            circle = list(reversed(error.args[1]))[:-1]
            circles.append(circle)
            graph = {name: set() if name in circle else needs for name, needs in graph.items()}


def nominal_dimensions(dimensions: Mapping[str, Quantity]) -> dict[str, Number]:
    """The dimensions without errors; those without a value, which are findings of their own, left out."""
    names: dict[str, Number] = {}
    for name in evaluation_order(dimensions)[0]:
        if set(dimensions[name].names) <= names.keys():
            names[name] = dimensions[name].evaluate(names)
    return names

"""Numbers with units that a sensor has: volts and ampere too, frequencies, gains such as `100 mV/(N m)`.

The model's own quantities know mechanics only, and its units are used wherever a unit is one of mechanics.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction
from typing import Annotated, Any

from pydantic import GetCoreSchemaHandler, GetJsonSchemaHandler
from pydantic.json_schema import JsonSchemaValue
from pydantic_core import core_schema

from trunnion.model.entry import problem
from trunnion.model.names import nearest
from trunnion.model.units import BASES, UnitError, normalise, pound_feet, root, si_unit, unit
from trunnion.rig.reading.clock import is_time

__all__ = [
    "HERTZ",
    "Amount",
    "Dimensions",
    "Frequency",
    "Number",
    "UnitText",
    "alike",
    "dimensions",
    "read_amount",
    "unit_name",
]

Dimensions = Mapping[str, Fraction]

HERTZ: Dimensions = {"s": Fraction(-1)}
_AMOUNT = re.compile(r"\s*([-+]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][-+]?[0-9]+)?)\s*(.*?)\s*", re.DOTALL)
_RATIO = re.compile(r"([^/()]+?)\s*/\s*\(\s*([0-9]+\.?[0-9]*(?:[eE][-+]?[0-9]+)?)\s*([^/()0-9][^()]*)\)", re.DOTALL)
_USUAL = (
    "s",
    "ms",
    "Hz",
    "kHz",
    "V",
    "mV",
    "A",
    "mA",
    "N",
    "kN",
    "N m",
    "rpm",
    "rad/s",
    "m/s",
    "deg",
    "rad",
    "mm",
    "%",
)
_MECHANICS = BASES[:4]
_COUNTED = {"rad", "m"}  # Hz over a speed, 60 Hz/(rev/s), are pulses over an angle or length
_VOLT: Dimensions = {"kg": Fraction(1), "m": Fraction(2), "s": Fraction(-3), "A": Fraction(-1)}


@dataclass(frozen=True)
class Amount:
    """A number with a unit, as written. value: of the number in SI; unit: empty for a plain number."""

    source: float | str
    value: float
    unit: str
    dimensions: Dimensions

    @property
    def plain(self) -> bool:
        """Whether no unit is stated."""
        return not self.unit


def dimensions(text: str) -> tuple[float, Dimensions]:
    """Factor to SI and exponents by base unit; UnitError for what is no unit, or one that may mean turns or radians."""
    written = pound_feet(normalise(text))
    try:
        factor, exponents, names = root(written)
    except UnitError as error:
        near = nearest(text, _USUAL)
        near = near if near.startswith("did you mean") else "write a unit such as mV, N m, rpm or deg"
        raise UnitError(error.what, error.remedy or near) from None
    if "count" in exponents:
        raise UnitError(f"the unit '{text}' is not one of a sensor", "use units of mechanics, volts, ampere or kelvin")
    pulses = "Hz" in names and exponents and exponents.keys() <= _COUNTED
    if not {"A", "K"} & exponents.keys() and exponents != HERTZ and not pulses:
        unit(written)
    return float(factor), exponents


def read_amount(source: object) -> Amount:
    """A number or a text such as `12 mV`; UnitError if it is neither."""
    if isinstance(source, bool) or not isinstance(source, (int, float, str)):
        what = "is empty" if source is None else "is not a number with a unit"
        raise UnitError(what, "write a number with its unit such as 12 mV")
    found = _AMOUNT.fullmatch(normalise(source)) if isinstance(source, str) else None
    if found and (ratio := _RATIO.fullmatch(found[2])):
        amount = read_amount(f"{found[1]} {ratio[1]}/({ratio[3]})")
        value = amount.value / float(ratio[2]) if float(ratio[2]) else math.inf
        if not math.isfinite(value):
            raise UnitError(f"'{str(source)[:40]}' is not a finite number", "give a finite number")
        return Amount(source, value, amount.unit, amount.dimensions)
    if isinstance(source, str) and (not found or found[2].startswith(",")):
        remedy = "write a decimal point, not a comma" if re.search(r"[0-9],[0-9]", source) else "write it as 12 mV"
        raise UnitError(f"'{source[:40]}' is not a number with a unit", remedy)
    number, text = (found[1], found[2]) if found else (str(source), "")
    factor, exponents = dimensions(text) if text else (1.0, {})
    value = float(number) * factor
    if not math.isfinite(value):
        raise UnitError(f"'{str(source)[:40]}' is not a finite number", "give a finite number")
    return Amount(source, value, text, exponents)


def alike(one: Dimensions, other: Dimensions) -> bool:
    """Whether two units measure the same; beside other dimensions the angle is a pure number (N m/rad is N m)."""
    first, second = ({key: power for key, power in each.items() if power} for each in (one, other))
    if first == second:
        return True
    bare = [{key: power for key, power in each.items() if key != "rad"} for each in (first, second)]
    return bare[0] == bare[1] and bool(bare[0]) and bare[0] != dict(HERTZ)


def unit_name(exponents: Dimensions) -> str:
    """SI unit of dimensions, in short."""
    if dict(exponents) == dict(_VOLT):
        return "V"
    if not set(exponents) - set(_MECHANICS):
        length, mass, time, angle = (Fraction(exponents.get(name, 0)) for name in _MECHANICS)
        return si_unit((length, mass, time, angle))
    parts = [name + ("" if power == 1 else f"^{power}") for name, power in exponents.items() if power]
    return " ".join(parts) or "1"


@dataclass(frozen=True)
class _Read:
    """Annotation that makes pydantic read a text or number by a function that may raise UnitError."""

    kind: str

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> core_schema.CoreSchema:
        """Validation by the function of its kind."""
        return core_schema.no_info_plain_validator_function(lambda value: _stated(value, self.kind))

    def __get_pydantic_json_schema__(
        self, schema: core_schema.CoreSchema, handler: GetJsonSchemaHandler
    ) -> JsonSchemaValue:
        """A number or a text; a unit is a text."""
        types = ["string"] if self.kind == "unit" else ["number", "string"]
        return {"type": types, "examples": [{"unit": "mV", "frequency": "2 kHz"}.get(self.kind, "12 mV")]}


def _stated(value: object, kind: str) -> Any:
    """The value of a kind; a finding's error if it is none."""
    if isinstance(value, Amount):
        return value
    try:
        if kind == "unit":
            if not isinstance(value, str):
                raise UnitError("is not a unit", "write a unit such as mV or N m")
            dimensions(value)
            return value
        if is_time(value):
            raise UnitError(
                f"'{value}' is a time stamp; times are counted in seconds from the first row of the file",
                "write a time in seconds, such as [0 s, 0.5 s]",
            )
        amount = read_amount(value)
        if kind == "frequency" and not (amount.value > 0 and (amount.plain or amount.dimensions == HERTZ)):
            raise UnitError(f"'{value}' is not a frequency above zero", "write it as 2 kHz or 500 Hz")
    except UnitError as error:
        raise problem(error.what, error.remedy or "write a number with its unit such as 12 mV") from None
    return amount


UnitText = Annotated[str, _Read("unit")]
Number = Annotated[Amount, _Read("amount")]
Frequency = Annotated[Amount, _Read("frequency")]

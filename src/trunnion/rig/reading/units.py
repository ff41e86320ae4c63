"""Units of sensors: amounts such as `12 mV`, gains such as `100 mV/(N m)`, and from a reading to what it measures.

The table of units is the model's; here volts, ampere, kelvin and hertz count too.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from fractions import Fraction
from typing import Annotated, Any

from pydantic import AfterValidator, PlainSerializer, PlainValidator, WithJsonSchema

from trunnion.model.entry import problem
from trunnion.model.measure_table import MEASURES
from trunnion.model.names import nearest
from trunnion.model.units import BASES, UnitError, normalise, pound_feet, root, si_unit, unit

Dimensions = Mapping[str, Fraction]
HERTZ: Dimensions = {"s": Fraction(-1)}
VOLT: Dimensions = {"kg": Fraction(1), "m": Fraction(2), "s": Fraction(-3), "A": Fraction(-1)}
_AMOUNT = re.compile(r"\s*([-+]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][-+]?[0-9]+)?)\s*(.*?)\s*", re.DOTALL)
_RATIO = re.compile(r"([^/()]+?)\s*/\s*\(\s*([0-9]+\.?[0-9]*(?:[eE][-+]?[0-9]+)?)\s*([^/()0-9][^()]*)\)", re.DOTALL)
_EXAMPLE = "write a number with its unit and a decimal point, such as 12.5 mV"


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


ZERO, ONE = Amount(0.0, 0.0, "", {}), Amount(1.0, 1.0, "", {})


def dimensions(text: str) -> tuple[float, Dimensions]:
    """Factor to SI and exponents by base unit; UnitError for what is no unit, or one that may mean turns or radians."""
    written = pound_feet(normalise(text))
    try:
        factor, exponents, names = root(written)
    except UnitError as error:
        raise UnitError(error.what, error.remedy or "write a unit such as mV, N m, rpm or deg") from None
    if "count" in exponents:
        raise UnitError(f"the unit '{text}' is not one of a sensor", "use units of mechanics, volts, ampere or kelvin")
    pulses = "Hz" in names and exponents and exponents.keys() <= {"rad", "m"}  # 60 Hz/(rev/s) are pulses of a turn
    if not {"A", "K"} & exponents.keys() and exponents != HERTZ and not pulses:
        unit(written)
    return float(factor), exponents


def read_amount(source: object) -> Amount:
    """A number or a text such as `12 mV`; UnitError if it is neither."""
    if isinstance(source, bool) or not isinstance(source, (int, float, str)):
        raise UnitError("is empty" if source is None else "is not a number with a unit", _EXAMPLE)
    parts = _AMOUNT.fullmatch(normalise(str(source)))
    if isinstance(source, str) and (not parts or parts[2].startswith(",")):
        raise UnitError(f"'{source[:40]}' is not a number with a unit", _EXAMPLE)
    number, text = parts.groups() if parts else (str(source), "")  # inf and nan of YAML
    divisor = 1.0
    if ratio := _RATIO.fullmatch(text):  # 1 V/(1000 rpm)
        text, divisor = f"{ratio[1]}/({ratio[3]})", float(ratio[2])
    factor, exponents = dimensions(text) if text else (1.0, {})
    value = float(number) * factor / divisor if divisor else math.inf
    if not math.isfinite(value):
        raise UnitError(f"'{str(source)[:40]}' is not a finite number", "give a finite number")
    return Amount(source, value, text, exponents)


def alike(first: Dimensions, second: Dimensions) -> bool:
    """Whether two units measure the same; beside other dimensions the angle is a pure number (N m/rad is N m)."""
    first, second = ({key: power for key, power in each.items() if power} for each in (first, second))
    if first == second:
        return True
    bare = [{key: power for key, power in each.items() if key != "rad"} for each in (first, second)]
    return bare[0] == bare[1] and bool(bare[0]) and bare[0] != HERTZ


def multiplied(first: Dimensions, second: Dimensions, sign: int = 1) -> Dimensions:
    """Dimensions of a product, or of a quotient with sign −1."""
    return {key: first.get(key, Fraction(0)) + sign * second.get(key, Fraction(0)) for key in {*first, *second}}


def unit_name(exponents: Dimensions) -> str:
    """SI unit of dimensions, in short."""
    exponents = {key: power for key, power in exponents.items() if power}
    if exponents == VOLT:
        return "V"
    if exponents.keys() <= set(BASES[:4]):
        length, mass, time, angle = (Fraction(exponents.get(name, 0)) for name in BASES[:4])
        return si_unit((length, mass, time, angle))
    return " ".join(name + ("" if power == 1 else f"^{power}") for name, power in exponents.items())


# ---- entries of a file ----------------------------------------------------------------------------------------


def _entry(read: Callable[[Any], Any]) -> PlainValidator:
    """How pydantic reads an entry; its error is a finding's."""

    def check(value: object) -> Any:
        try:
            return value if isinstance(value, Amount) else read(value)
        except UnitError as error:
            raise problem(error.what, error.remedy or _EXAMPLE) from None

    return PlainValidator(check)


def _unit(value: object) -> str:
    if not isinstance(value, str):
        raise UnitError("is not a unit", "write a unit such as mV or N m")
    dimensions(value)
    return value


def _in(si: str, example: str) -> AfterValidator:
    """Units, and amounts with one, that measure the same as that of SI."""

    def check(entry: Amount | str) -> Amount | str:
        text = entry.unit if isinstance(entry, Amount) else entry
        if text and not alike(dimensions(text)[1], dimensions(si)[1] if si else {}):
            raise problem(f"the unit '{text}' is not {example.split(' such')[0]}", f"write {example}")
        return entry

    return AfterValidator(check)


def _above(amount: Amount) -> Amount:
    if not amount.value > 0:
        raise problem(f"{amount.source} is not above zero", "write a number above it, such as 100 N m or 0.1 deg")
    return amount


def _size(amount: Amount) -> Amount:
    if not amount.value >= 0:
        raise problem(f"{amount.source} is below zero", "write it without a sign")
    return amount


def _measures(text: str) -> str:
    """A measure that has a course: KIND:NAME, link.point.x or the name of one of the model."""
    kind, (_, colon, subject) = _kind(text), text.partition(":")
    if (kind and kind not in QUANTITIES) or (colon and not subject.strip()) or not text.strip():
        near, remedy = nearest(kind, QUANTITIES), "write effort:DRIVER, rate:JOINT, load:LOAD or link.point.x"
        what = f"'{text[:80]}' is not a quantity that a sensor measures"
        raise problem(what, near if near.startswith("did") else remedy)
    return text


_AMOUNT_SCHEMA = WithJsonSchema({"type": ["number", "string"], "examples": ["12 mV"]})
_TIME, _ANGLE = _in("s", "a unit of time such as ms"), _in("rad", "a unit of angle such as deg")
UnitText = Annotated[str, _entry(_unit), WithJsonSchema({"type": ["string"], "examples": ["mV"]})]
TimeUnit = Annotated[UnitText, _TIME]
AngleUnit = Annotated[UnitText, _ANGLE]
Number = Annotated[Amount, _entry(read_amount), PlainSerializer(lambda amount: amount.source), _AMOUNT_SCHEMA]
Positive = Annotated[Number, AfterValidator(_above)]
Size = Annotated[Number, AfterValidator(_size)]
Frequency = Annotated[Positive, _in("Hz", "a frequency such as 2 kHz")]
Time = Annotated[Number, _TIME]
Angle = Annotated[Number, _ANGLE]
Step = Annotated[Angle, AfterValidator(_above)]
AngularSpeed = Annotated[Number, _in("rad/s", "a unit of angular speed such as rpm")]
Share = Annotated[Size, _in("", "a share such as 0.1 %")]
MeasureText = Annotated[str, AfterValidator(_measures)]


# ---- from readings to quantities ------------------------------------------------------------------------------

# SI units that a kind of measure may have, the first being what a plain number is taken for
QUANTITIES = {name: tuple(kind.unit for kind in measure.quantities) for name, measure in MEASURES.items()}


def _kind(measures: str) -> str:
    """Entry of QUANTITIES that a measure is of; empty for a name of the model's measures."""
    head, colon, _ = measures.partition(":")
    return head if colon else "point" if re.fullmatch(r"[^.]+\.[^.]+\.[xyz]", measures) else ""


@dataclass(frozen=True)
class SensorScale:
    """Quantity (SI) = factor · reading.

    unit: SI unit of the quantity; raw: of a reading in SI; of_reading, of_quantity: dimensions of both.
    """

    factor: float
    unit: str
    raw: float
    of_reading: Dimensions
    of_quantity: Dimensions

    @property
    def direct(self) -> bool:
        """Whether the readings are what is measured itself, in some unit, not volts and the like."""
        return alike(self.of_reading, self.of_quantity)

    def reading(self, amount: Amount, key: str) -> float:
        """An amount stated as readings or as quantity, in readings; UnitError if it is neither.

        key: which it is; a zero lies on the side that the gain has it, of ranges and accuracies only the size counts.
        """
        if amount.plain:
            return amount.value
        if alike(amount.dimensions, self.of_reading):
            return amount.value / self.raw
        if alike(amount.dimensions, self.of_quantity):
            return amount.value / (self.factor if key == "zero" else abs(self.factor))
        what = f"{key}: '{amount.source}' is neither of the readings ({unit_name(self.of_reading)}) nor of what they "
        remedy = f"write it in {self.unit}, or as a plain number in the unit of the readings"
        raise UnitError(f"{what}measure ({self.unit})", remedy)


def default_unit(measures: str) -> str:
    """SI unit that plain numbers of a measure are taken for; empty where nothing tells."""
    return QUANTITIES.get(_kind(measures), ("",))[0]


def scale(measures: str, unit: str, gain: Amount | None) -> SensorScale:
    """How readings in a unit become what is measured; UnitError if they do not. A plain gain multiplies.

    The gain is reading per quantity or quantity per reading: whichever gives what is measured.
    """
    raw, of_reading = dimensions(unit) if unit else (1.0, {})
    gain = gain or ONE
    if gain.value == 0:
        raise UnitError("the gain is zero", "write reading per quantity, such as 100 mV/(N m)")
    kind = _kind(measures)
    possible = QUANTITIES.get(kind, ())
    for power in (1, -1):
        product = multiplied(of_reading, gain.dimensions, power)
        name = next((name for name in possible if alike(product, dimensions(name)[1])), "")
        if not kind and not {"A", "K"} & {key for key, exponent in product.items() if exponent}:
            name = unit_name(product)
        if name:
            return SensorScale(raw * gain.value**power, name, raw, of_reading, dimensions(name)[1])
    needed = " or ".join(possible or ("a quantity of mechanics",))
    by_gain = "" if gain.plain else f" with the gain '{gain.source}'"
    remedy = f"correct the unit (write rpm for 1/min), or state the gain, such as 100 mV/({needed.split(' or ')[0]})"
    raise UnitError(f"readings in '{unit or '1'}'{by_gain} do not give {measures} in {needed}", remedy)

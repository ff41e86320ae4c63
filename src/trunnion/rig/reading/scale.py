"""From the readings of a sensor to the quantity it measures: unit and gain, told apart by their dimensions."""

from __future__ import annotations

import re
from dataclasses import dataclass
from fractions import Fraction
from typing import Annotated

from pydantic import AfterValidator

from trunnion.model.entry import problem
from trunnion.model.measure_table import MEASURES
from trunnion.model.names import nearest
from trunnion.model.units import UnitError
from trunnion.rig.reading.sensor_quantity import HERTZ, Amount, Dimensions, alike, dimensions, unit_name

__all__ = ["OTHER_COLUMN", "QUANTITIES", "MeasureText", "SensorScale", "default_unit", "scale"]

NONE = Fraction(0)
OTHER_COLUMN = "name another column"
# SI units that a kind of measure may have, the first being what a plain number is taken for
QUANTITIES = {name: tuple(one.unit for one in kind.quantities) for name, kind in MEASURES.items()}


def _kind(measures: str) -> str:
    """Entry of QUANTITIES that a measure is of; empty for a name of the model's measures."""
    head, colon, _ = measures.partition(":")
    if colon:
        return head
    return "point" if re.fullmatch(r"[^.]+\.[^.]+\.[xyz]", measures) else ""


def _measures(text: str) -> str:
    """A measure that has a course: KIND:NAME, link.point.x or the name of one of the model."""
    kind, (_, colon, subject) = _kind(text), text.partition(":")
    if (kind and kind not in QUANTITIES) or (colon and not subject.strip()) or not text.strip():
        known = ", ".join(f"{one}:NAME" for one in QUANTITIES if one != "point")
        near = nearest(kind, QUANTITIES)
        remedy = f"{near} " if near.startswith("did") else ""
        raise problem(
            f"'{text[:80]}' is not a quantity that a sensor measures", f"{remedy}write {known} or link.point.x"
        )
    return text


MeasureText = Annotated[str, AfterValidator(_measures)]


@dataclass(frozen=True)
class SensorScale:
    """Quantity (SI) = factor · reading.

    unit: SI unit of the quantity; of_reading, of_quantity: dimensions of both; raw: of a reading in SI; measures,
    column: what the channel is said to measure, and where.
    """

    factor: float
    unit: str
    raw: float
    of_reading: Dimensions
    of_quantity: Dimensions
    measures: str = ""
    column: str = ""

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
        known = QUANTITIES.get(_kind(self.measures), ())
        if any(alike(amount.dimensions, dimensions(one)[1]) for one in known):  # the other one that it may be
            ways = " or ".join(known)
            raise UnitError(
                f"the column '{self.column}' is in {unit_name(self.of_reading)}, {key} in {amount.unit}; "
                f"{self.measures} is in {ways}, as its joint turns or slides",
                f"{OTHER_COLUMN}, or write {key} in {self.unit}",
            )
        raise UnitError(
            f"{key}: '{amount.source}' is neither of the readings ({unit_name(self.of_reading)}) nor of what they "
            f"measure ({self.unit})",
            f"write it in {self.unit}, or as a plain number in the unit of the readings",
        )


def default_unit(measures: str) -> str:
    """SI unit that plain numbers of a measure are taken for; empty where nothing tells."""
    return QUANTITIES.get(_kind(measures), ("",))[0]


def scale(measures: str, unit: str, gain: Amount | None, column: str = "") -> SensorScale:
    """How readings in a unit become what is measured; UnitError if they do not. A plain gain multiplies.

    The gain is reading per quantity or quantity per reading: whichever gives what is measured. column: for messages.
    """
    raw, of_reading = dimensions(unit) if unit else (1.0, {})
    gain = gain or Amount(1.0, 1.0, "", {})
    if gain.value == 0:
        raise UnitError("the gain is zero", "write reading per quantity, such as 100 mV/(N m)")
    ways = {
        1: {key: of_reading.get(key, NONE) + gain.dimensions.get(key, NONE) for key in {*of_reading, *gain.dimensions}},
        -1: {
            key: of_reading.get(key, NONE) - gain.dimensions.get(key, NONE) for key in {*of_reading, *gain.dimensions}
        },
    }
    kind = _kind(measures)
    for power, found in ways.items():
        known = QUANTITIES.get(kind, ())
        name = next((one for one in known if alike(found, dimensions(one)[1])), "")
        if not kind and not {"A", "K"} & {key for key, value in found.items() if value}:
            name = unit_name({key: value for key, value in found.items() if value})
        if name:
            factor = raw * gain.value**power
            return SensorScale(factor, name, raw, of_reading, dimensions(name)[1], measures, column)
    if gain.plain and alike(of_reading, HERTZ) and kind == "rate":
        what = f"readings in '{unit}' do not give {measures}, for they may count turns or radians"
        raise UnitError(what, "write the unit as rpm or rad/s")
    needed = " or ".join(QUANTITIES.get(kind, ("a quantity of mechanics",)))
    if gain.plain and kind and column and any(of_reading.values()) and not {"A", "K"} & of_reading.keys():
        what = f"the column '{column}' is in {unit}; {measures} is in {needed}"
        raise UnitError(what, f"{OTHER_COLUMN}, or correct its unit")
    told = "" if gain.plain else f" with the gain '{gain.source}'"
    remedy = f"state the gain, such as 100 mV/({needed.split(' or ')[0]})" if gain.plain else "check unit and gain"
    raise UnitError(f"readings in '{unit or '1'}'{told} do not give {measures} in {needed}", remedy)

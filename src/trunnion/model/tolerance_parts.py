"""The parts of a model file about how numbers vary and what that costs: limits, distributions, correlations, costs.

Limits are texts, ±0.05 mm, +0.02/-0.01 mm, or 0.05 mm for either side; half widths are written into them.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass, replace
from fractions import Fraction
from typing import Annotated, Literal, NamedTuple

import numpy as np
from pydantic import BeforeValidator, Field, PlainSerializer, PlainValidator, WithJsonSchema

from trunnion.errors import Finding, MechanismError
from trunnion.joints.fits import GRADES
from trunnion.model.entry import Name, OneOf, Part, ShortForm, problem
from trunnion.model.quantity import AnyQuantity, Dimensionless, Quantity, signed_terms
from trunnion.model.rules import NotNegative, NotWith, Positive, Refers, Selects, Within
from trunnion.model.units import Kind, UnitError, normalise

_EITHER = re.compile(r"^\s*(?:±|\+/-|\+-)\s*(.*)$", re.DOTALL)
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
            if not isinstance(source, str):
                upper = Quantity.read(source)
                if (number := float(upper.source)) < 0:
                    what = f"a limit to either side has no sign, {number:g} has"
                    raise UnitError(what, "write 1e-5, or +2e-5/-1e-5")
                return cls(upper.source, Quantity.read(-number), upper)
            text = normalise(source).strip()
            if match := _BOTH.match(text):
                signed = [Quantity.read(" ".join(limit).strip()) for limit in signed_terms(match.groups())]
                lower, upper = sorted(signed, key=lambda limit: float(limit.evaluate()))
            else:
                text = _EITHER.sub(r"\1", text)
                if text[:1] in ("+", "-"):
                    what = f"the limits '{source[:60]}' have a sign on one side only"
                    raise UnitError(what, f"{_FORMS}, of one side +0.02/0 mm")
                upper = Quantity.read(text)
                if upper.tolerance:
                    raise UnitError(f"the limits '{source[:60]}' have a tolerance of their own", _FORMS)
                lower = Quantity.read(f"-({text})")
        except UnitError as error:
            raise problem(error.what, error.remedy or _FORMS) from error
        return cls(source, replace(lower, source=source), replace(upper, source=source))


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


DIGITS = 12  # of a number as it is written, where nothing less is asked for
SHOWN_UNITS = {"length": ("mm", 1e3), "angle": ("deg", 180 / np.pi)}  # in which a tolerance is written
CLOSE = 1e-9  # of a number: what rounding down takes for the number itself


def half_width(limits: object, kind: Kind, name: str) -> float:
    """A half width in SI, of a number in SI or a text with a unit such as ±0.02 mm; MechanismError for others."""
    remedy = f"give a number of at least 0 in {kind.unit}, or a text such as ±{kind.example}"
    written = f"{limits:g}" if isinstance(limits, float) else f"'{str(limits)[:40]}'"
    try:
        text = _EITHER.sub(r"\1", normalise(limits)) if isinstance(limits, str) else limits
        quantity = Quantity.read(text, kind)
        if quantity.tolerance or quantity.names or "%" in str(text):
            raise UnitError("is no number with a unit")
        if (value := float(quantity.evaluate())) < 0:
            raise UnitError("is negative")
    except UnitError as error:
        raise MechanismError(Finding(f"a half width of {written} is none: {error.what}", name, remedy)) from None
    return value


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


# ---- distributions, correlations, costs -------------------------------------------------------------------------

# What each distribution takes beside the limits.
DISTRIBUTIONS: Mapping[str, tuple[str, ...]] = {
    "normal": ("cp", "cpk", "shift"),
    "uniform": (),
    "triangular": ("mode",),
    "truncated": ("cp", "cpk", "shift"),
    "beta": ("alpha", "beta"),
    "sample": ("values",),
    "direction": (),
}
OPTIONS = ("cp", "cpk", "shift", "mode", "alpha", "beta", "values")  # keys of a Variation that a distribution may take

DistributionName = Annotated[str, OneOf(DISTRIBUTIONS, "distribution")]


class Variation(ShortForm):
    """How a number varies about its nominal value: limits of its deviation, and how it is distributed within.

    Limits alone may be written without the group.
    """

    short_key, short_types = "limits", (int, float, str, Limits)

    limits: LimitText | None = None
    distribution: DistributionName | None = None
    cp: Annotated[Dimensionless | None, Positive] = None
    cpk: Dimensionless | None = None
    shift: AnyQuantity | None = None
    mode: AnyQuantity | None = None
    alpha: Annotated[Dimensionless | None, Positive] = None
    beta: Annotated[Dimensionless | None, Positive] = None
    values: Annotated[tuple[AnyQuantity, ...], Field(min_length=2)] | None = None
    direction: Literal["uniform"] | None = None


class VariationDefaults(Part):
    """How every toleranced number varies that does not say; also those stated with ± or by a fit alone."""

    distribution: DistributionName = "normal"
    cp: Annotated[Dimensionless | None, Positive] = None
    cpk: Dimensionless | None = None
    alpha: Annotated[Dimensionless | None, Positive] = None
    beta: Annotated[Dimensionless | None, Positive] = None


class Correlation(Part):
    """Toleranced numbers that vary together: the coefficient is that of every two of them.

    It is the correlation of their normal scores (Gaussian copula); of two normal numbers, their own.
    """

    of: Annotated[tuple[str, ...], Field(min_length=1)]
    coefficient: Annotated[Dimensionless, Within(-1, 1)]


class FormulaKeys(NamedTuple):
    """What a formula of costs needs and takes."""

    needs: tuple[str, ...] = ("B", "k")
    takes: tuple[str, ...] = ("A", "unit", "least", "most")


COST_MODELS = {"power": FormulaKeys(), "exponential": FormulaKeys()}


def _grade(value: object) -> object:
    """A grade as its number in a text: 7, "7" and "IT7" are "7"."""
    match = re.fullmatch(r"(?:IT\s*)?([0-9]{1,2})", str(value).strip())
    if not match or int(match[1]) not in GRADES:
        raise problem(f"'{str(value)[:20]}' is no IT grade", f"write one of {min(GRADES)} to {max(GRADES)}, as 7: 9.50")
    return str(int(match[1]))


Grade = Annotated[str, BeforeValidator(_grade), WithJsonSchema({"type": "string", "pattern": "^(IT ?)?[0-9]{1,2}$"})]
Process = Annotated[Mapping[Grade, Dimensionless], Field(min_length=1)]  # cost by IT grade


class CostOption(Part):
    """One way to make a dimension: the half width of the tolerance it keeps, and what it costs."""

    tolerance: Annotated[AnyQuantity, Positive]
    cost: Dimensionless


_FORMULA = Selects("cost model", COST_MODELS, ("group", "process", "options"))


class Cost(Part):
    """What a tolerance costs, by its half width t; of the play of a joint, by the clearance.

    One of `model`, a formula of t: power, A + B/(t/unit)^k, or exponential, A + B exp(−k t/unit); `process`, a choice
    among the IT grades of a process; and `options`, a choice among ways to make it.
    """

    one_of = ("model", "process", "options")

    model: Annotated[str, OneOf(COST_MODELS, "cost model"), _FORMULA] | None = None
    A: Annotated[Dimensionless | None, NotWith("process", "options")] = None
    B: Annotated[Dimensionless | None, NotNegative, NotWith("process", "options")] = None
    k: Annotated[Dimensionless | None, Positive, NotWith("process", "options")] = None
    unit: Annotated[str | None, NotWith("process", "options")] = None
    least: Annotated[AnyQuantity | None, NotNegative, NotWith("process", "options")] = None
    most: Annotated[AnyQuantity | None, Positive, NotWith("process", "options")] = None
    group: Name | None = None
    process: Annotated[str | None, Refers("process")] = None
    options: Annotated[Mapping[Name, CostOption], Field(min_length=1)] | None = None

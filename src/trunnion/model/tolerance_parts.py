"""The parts of a model file about how numbers vary and what that costs: limits, distributions, correlations, costs."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Annotated, Literal, NamedTuple

from pydantic import (
    BeforeValidator,
    Field,
    WithJsonSchema,
)

from trunnion.joints.fits import GRADES
from trunnion.model.entry import Name, OneOf, Part, ShortForm, problem
from trunnion.model.limits import Limits, LimitText
from trunnion.model.quantity import AnyQuantity, Dimensionless
from trunnion.model.rules import NotNegative, NotWith, Positive, Refers, Selects, Within

__all__ = [
    "COST_MODELS", "DISTRIBUTIONS", "OPTIONS", "Correlation", "Cost", "CostOption", "Grade", "Process", "Variation",
    "VariationDefaults",
]  # fmt: skip

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

"""The parts of a model file about what tolerances cost: a formula, a process by IT grade, or a list of options."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Annotated

from pydantic import BeforeValidator, Field, WithJsonSchema

from trunnion.joints.fits import GRADES
from trunnion.model.entry import Name, Part, known, problem
from trunnion.model.quantity import AnyQuantity, Dimensionless
from trunnion.model.rules import Refers

__all__ = ["COST_MODELS", "Cost", "CostOption", "Grade", "Process"]

COST_MODELS = ("power", "exponential")

_check_model, _schema_model = known(COST_MODELS, "cost model")


def _grade(value: object) -> object:
    """A grade as its number in a text: 7, "7" and "IT7" are "7"."""
    found = re.fullmatch(r"(?:IT\s*)?([0-9]{1,2})", str(value).strip())
    if not found or int(found[1]) not in GRADES:
        raise problem(f"'{str(value)[:20]}' is no IT grade", f"write one of {min(GRADES)} to {max(GRADES)}, as 7: 9.50")
    return str(int(found[1]))


Grade = Annotated[str, BeforeValidator(_grade), WithJsonSchema({"type": "string", "pattern": "^(IT ?)?[0-9]{1,2}$"})]
Process = Annotated[Mapping[Grade, Dimensionless], Field(min_length=1)]  # cost by IT grade


class CostOption(Part):
    """One way to make a dimension: the half width of the tolerance it keeps, and what it costs."""

    tolerance: AnyQuantity
    cost: Dimensionless


class Cost(Part):
    """What a tolerance costs, by its half width t; of the play of a joint, by the clearance.

    One of `model`, a formula of t: power, A + B/(t/unit)^k, or exponential, A + B exp(−k t/unit); `process`, a choice
    among the IT grades of a process; and `options`, a choice among ways to make it.
    """

    model: Annotated[str, _check_model, _schema_model] | None = None
    A: Dimensionless | None = None
    B: Dimensionless | None = None
    k: Dimensionless | None = None
    unit: str | None = None
    least: AnyQuantity | None = None
    most: AnyQuantity | None = None
    group: Name | None = None
    process: Annotated[str | None, Refers("process")] = None
    options: Annotated[Mapping[Name, CostOption], Field(min_length=1)] | None = None

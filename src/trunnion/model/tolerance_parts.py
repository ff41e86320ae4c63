"""The parts of a model file about how numbers vary: limits, distributions, correlations."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, Literal

from pydantic import (
    Field,
    GetJsonSchemaHandler,
    SerializerFunctionWrapHandler,
    model_serializer,
    model_validator,
)
from pydantic.json_schema import JsonSchemaValue
from pydantic_core import CoreSchema

from trunnion.model.entry import Part, known
from trunnion.model.limits import Limits, LimitText
from trunnion.model.quantity import AnyQuantity, Dimensionless

__all__ = ["DISTRIBUTIONS", "OPTIONS", "Correlation", "Variation", "VariationDefaults"]

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

_check_distribution, _schema_distribution = known(tuple(DISTRIBUTIONS), "distribution")
DistributionName = Annotated[str, _check_distribution, _schema_distribution]


class Variation(Part):
    """How a number varies about its nominal value: limits of its deviation, and how it is distributed within.

    Limits alone may be written without the group.
    """

    limits: LimitText | None = None
    distribution: DistributionName | None = None
    cp: Dimensionless | None = None
    cpk: Dimensionless | None = None
    shift: AnyQuantity | None = None
    mode: AnyQuantity | None = None
    alpha: Dimensionless | None = None
    beta: Dimensionless | None = None
    values: Annotated[tuple[AnyQuantity, ...], Field(min_length=2)] | None = None
    direction: Literal["uniform"] | None = None

    @classmethod
    def __get_pydantic_json_schema__(cls, schema: CoreSchema, handler: GetJsonSchemaHandler) -> JsonSchemaValue:
        """The limits or the group."""
        group = handler.resolve_ref_schema(handler(schema))
        limits = next(one for one in group["properties"]["limits"]["anyOf"] if one.get("type") != "null")
        return {"anyOf": [limits, group], "description": group.pop("description")}

    @model_validator(mode="before")
    @classmethod
    def _read_limits(cls, value: object) -> object:
        return {"limits": value} if isinstance(value, (int, float, str, Limits)) else value

    @model_serializer(mode="wrap")
    def _write_limits(self, write: SerializerFunctionWrapHandler) -> Any:
        long = write(self)
        return long["limits"] if self.model_fields_set == {"limits"} and self.limits is not None else long


class VariationDefaults(Part):
    """How every toleranced number varies that does not say; also those stated with ± or by a fit alone."""

    distribution: DistributionName = "normal"
    cp: Dimensionless | None = None
    cpk: Dimensionless | None = None
    alpha: Dimensionless | None = None
    beta: Dimensionless | None = None


class Correlation(Part):
    """Toleranced numbers that vary together: the coefficient is that of every two of them.

    It is the correlation of their normal scores (Gaussian copula); of two normal numbers, their own.
    """

    of: Annotated[tuple[str, ...], Field(min_length=1)]
    coefficient: Dimensionless

"""Tables in the units that the model is written in, instead of SI."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from trunnion.model.units import unit
from trunnion.results.attributes import attribute
from trunnion.results.tables.column import Column

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["in_model_units"]


def in_model_units(result: xr.Dataset, columns: list[Column]) -> list[Column]:
    """Columns in the units of the model, named with their unit: `rod.C.x [mm]`; what has no unit stays as it is."""
    units: Mapping[str, str] = dict(attribute(result, "model_units", "{}"))

    def converted(column: Column) -> Column:
        name, si, values = column
        own = units.get(si, si)
        shown = name if own in ("", "1") else f"{name} [{own}]"
        if own == si:
            return shown, si, values
        factor = 1 / float(unit(own)[0])

        def scaled(window: slice) -> Any:
            return values(window) * factor

        return shown, own, scaled

    return [converted(column) for column in columns]

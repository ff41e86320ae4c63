"""Results that have several tables: which module knows the columns of each."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from trunnion.results.columns import comparison, identification, tolerances

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["tables_of"]


def tables_of(result: xr.Dataset) -> Any:
    """The module that knows the tables of a result; None of one that has a single table."""
    if tolerances.is_tolerance(result):
        return tolerances
    if comparison.is_comparison(result):
        return comparison
    return identification if identification.is_identification(result) else None

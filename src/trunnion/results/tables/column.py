"""A flat column of a result: its name, its unit, its values by a window of rows."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from trunnion.errors import Status
from trunnion.results.dataset import unit_of

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["Column", "column", "kept", "status_column", "time_column", "whole"]

Column = tuple[str, str, Callable[[slice], NDArray[Any]]]


def whole(flat: Iterable[tuple[str, str, NDArray[Any]]]) -> list[Column]:
    """Columns whose values are all at hand."""
    return [(name, unit, values.__getitem__) for name, unit, values in flat]


def kept(found: Iterable[Column]) -> list[Column]:
    """The columns of variables that the result has."""
    return [one for one in found if one[0]]


def time_column(result: xr.Dataset) -> Column:
    """The time of every position."""
    return "time", "s", lambda window: result["time"].values[window]


def status_column(result: xr.Dataset) -> Column:
    """The status of every position in words."""
    names = np.array([status.name.lower() for status in Status])
    return "status", "", lambda window: names[result["status"].values[window]]


def column(result: xr.Dataset, variable: str, name: str, index: tuple[int, ...]) -> Column:
    """An entry of a variable; without a name of a variable that the result has not kept."""
    if variable not in result:
        return "", "", lambda window: np.zeros(0)
    array = result[variable]
    values = array.values[index]
    return name, unit_of(array, index), lambda window: values[window]

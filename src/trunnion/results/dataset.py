"""What describes a variable of a result, and the one place where arrays become an xarray Dataset.

One floor for every figure, whatever its unit and however small or large the mechanism, says what is rounding: a torque
counts beside the largest force times the largest length, a power beside that times the largest rate (`Scales`).
"""

from __future__ import annotations

import functools
import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from trunnion.model.units import UnitError
from trunnion.model.units import unit as unit_named
from trunnion.results.attributes import Described, Figure, encoded

if TYPE_CHECKING:
    import xarray as xr


@dataclass(frozen=True)
class Variable:
    """Dimensions, unit and long name of a variable of a result, and what its numbers are kept as.

    units: or a word for one that only a result knows, as "parameter" for that of its parameters, see `described`. Of
    what not every result has: part, such as "errors" of a mechanism with any; space, the only one, "planar" or
    "spatial". column: what stands behind the name of its member in tables of a cycle, None in none; tables: in which,
    of "usual", "motion" and "rest".
    """

    dims: tuple[str, ...]
    units: str
    long_name: str
    dtype: type[Any] = np.float64
    part: str = ""
    space: str = ""
    column: str | None = None
    tables: str = "usual"

    def over(self, *dims: str) -> Variable:
        """The same with more dimensions, last."""
        return replace(self, dims=(*self.dims, *dims))

    def blank(self, sizes: Mapping[str, int]) -> NDArray[Any]:
        """An array to be filled: NaN, or 0 of whole numbers."""
        return np.full([sizes[dim] for dim in self.dims], np.nan if self.dtype is np.float64 else 0, self.dtype)


TIME = Variable(("position",), "s", "time from the start of the cycle")
UNITS_OF_EACH = "units_of_each"  # attribute of a variable: the coordinate that has the unit of each member


class MemberUnits(NamedTuple):
    """The units of the members of a dimension, as of the efforts of the drivers."""

    dim: str
    each: Sequence[str]

    @property
    def text(self) -> str:
        """The unit of all, or the units of any: "N m or N"."""
        return " or ".join(dict.fromkeys(self.each))


def described(
    arrays: Mapping[str, ArrayLike],
    variables_of: Mapping[str, Variable],
    units: Mapping[str, str | MemberUnits] | None = None,
) -> dict[str, xr.Variable]:
    """Arrays by name as variables with dimensions, units and long names, by what describes each; coordinates of units.

    units: for each word in place of a unit, the unit. Where the members of a dimension have different ones, a variable
    names them all and, in its attribute `units_of_each`, the coordinate that has that of each: `effort_unit` for the
    word "effort".
    """
    import xarray as xr

    variables: dict[str, xr.Variable] = {}
    for name, array in arrays.items():
        variable = variables_of[name]
        unit = (units or {}).get(variable.units, variable.units)
        attributes = {"units": unit, "long_name": variable.long_name}
        if isinstance(unit, MemberUnits):
            attributes["units"] = unit.text
            if len(set(unit.each)) > 1:
                attributes[UNITS_OF_EACH] = coordinate = f"{variable.units}_unit"
                meaning = {"long_name": f"unit of the {variable.units.replace('_', ' ')}"}
                variables[coordinate] = xr.Variable((unit.dim,), np.asarray(unit.each, dtype=str), meaning)
        # without fastpath xarray loads dask, where it is installed, to see whether the array is one of its own
        variables[name] = xr.Variable(variable.dims, np.asarray(array), attributes, fastpath=True)
    return variables


def unit_of(array: xr.DataArray, index: Sequence[int] = ()) -> str:
    """The unit of the part of a variable at an index along its first dimensions; of several units all."""
    each = array.coords.get(array.attrs.get(UNITS_OF_EACH))
    if each is None:
        return str(array.attrs["units"])
    if each.ndim == 0:
        return str(each.values)
    along = array.dims.index(each.dims[0])
    return str(each.values[index[along]] if along < len(index) else array.attrs["units"])


def units_along(array: xr.DataArray, dim: str) -> list[str]:
    """The unit of each member of a variable along a dimension."""
    before = array.dims.index(dim) * (0,)
    return [unit_of(array, (*before, member)) for member in range(array.sizes[dim])]


class Column(NamedTuple):
    """A flat column of a table: its name, its unit, its values."""

    name: str
    unit: str
    values: NDArray[Any]


def flat(result: xr.Dataset, variable: str, name: str, index: tuple[int, ...] = ()) -> list[Column]:
    """An entry of a variable as a column; none of a variable that the result has not kept."""
    if variable not in result:
        return []
    return [Column(name, unit_of(result[variable], index), result[variable].values[index])]


def driven(time: NDArray[np.float64], values: ArrayLike, unit: str, of: str) -> dict[str, xr.Variable]:
    """The coordinates along the positions: time, and the drive as a dial names it."""
    moves = {"°": "angle", "mm": "slide"}.get(unit.strip(), "coordinate")
    drive = Variable(("position",), unit.strip(), f"{moves} of {of}" if of else "time")
    return described({"time": time, "drive": np.asarray(values, float)}, {"time": TIME, "drive": drive})


@functools.lru_cache(maxsize=64)
def _index(dim: str, members: tuple[str, ...]) -> tuple[xr.indexes.PandasIndex, dict[Any, xr.Variable]]:
    """The names along a dimension, as an index and as a coordinate; xarray copies what it is given.

    An index of pandas: of an array, xarray would load pint and dask to see whether it is one of theirs.
    """
    import pandas as pd
    import xarray as xr

    text = np.asarray(members, dtype=str)
    index = xr.indexes.PandasIndex(pd.Index(text, name=dim), dim, coord_dtype=text.dtype)
    return index, index.create_variables()


def dataset_of(
    kind: str,
    variables: Mapping[str, xr.Variable],
    labels: Mapping[str, Sequence[str]],
    attributes: Mapping[str, Any],
    along: Mapping[str, Any] | None = None,
) -> xr.Dataset:
    """A result of a kind, see `results.tables`.

    labels: names along its dimensions; attributes: lists and dicts become JSON; along: other coordinates, as xarray
    takes them.
    """
    import xarray as xr

    names: dict[str, Any] = {}
    indexes: dict[str, xr.indexes.PandasIndex] = {}
    for dim, members in labels.items():
        indexes[dim], coordinate = _index(dim, tuple(members))
        names |= coordinate
    drive = (along or {}).get("drive")
    if drive is not None and drive.dims == ("position",):
        # xarray draws over the coordinate that bears the dimension's name. It has no index: two results are combined
        # position by position, not by angles that may differ in their last digit
        names["position"] = drive
    # those without an index go in at once: to add them afterwards takes as long as all else
    others = (along or {}).items()
    plain = {name: item for name, item in others if isinstance(item, xr.Variable) and name not in item.dims}
    units = {name: variables[name] for name in _unit_coordinates(variables)}
    coordinates = xr.Coordinates(names | plain | units, indexes)
    rest = {name: variable for name, variable in variables.items() if name not in units}
    result = xr.Dataset(rest, coordinates, {"kind": kind, **encoded(attributes)})
    indexed = {name: variable for name, variable in others if name not in plain}
    return result.assign_coords(indexed) if indexed else result


def with_variables(result: xr.Dataset, variables: Mapping[str, xr.Variable]) -> xr.Dataset:
    """A result with more variables of `described`."""
    return result.assign(variables).set_coords(_unit_coordinates(variables))


def _unit_coordinates(variables: Mapping[str, xr.Variable]) -> list[str]:
    units = (variable.attrs.get(UNITS_OF_EACH) for variable in variables.values())
    return list(dict.fromkeys(name for name in units if name is not None))


# ---- how large lengths, rates and forces are: what is no more than their rounding is 0 --------------------------

Array = NDArray[np.float64]
ROUNDING = 1e-10  # of the largest of its kind: what is less is no more than rounding, and how well a break is located
EVERYWHERE = "everywhere"  # the place of an extreme of what is constant


class Scales(NamedTuple):
    """The largest length, m, rate, 1/s, and force, N, of a mechanism in its cycle."""

    length: float
    rate: float
    force: float

    def floor(self, unit: str) -> float:
        """What is rounding of a quantity in a unit such as `N m`, `mm` or `°`, in that unit.

        0 where no scale is known; NaN, which nothing is below, of what is no unit of mechanics.
        """
        powers, factor = powers_of(unit)
        with np.errstate(all="ignore"):  # of nothing at rest, and of rates of 1e160 1/s
            size = float(np.prod(np.power(self, powers)))
        return ROUNDING * size / factor if math.isfinite(size) else 0.0

    def zeroed(self, values: Array, unit: str) -> Array:
        """The values in a unit, 0 where they are rounding."""
        return np.where(np.abs(values) <= self.floor(unit), 0.0, values)

    def summary(self, figures: Iterable[Figure]) -> dict[str, Any]:
        """The attributes of a result with its figures: the summary, and these scales."""
        rows = [figure.row() for figure in self.of_figures(figures)]
        return {"summary": rows, **{f"scale_of_{name}": size for name, size in self._asdict().items()}}

    def of_figures(self, figures: Iterable[Figure]) -> list[Figure]:
        """Figures, 0 where they are rounding, but for those that tell of the solution."""
        return [
            replace(figure, value=0.0)
            if isinstance(figure.value, float) and not figure.numerical and abs(figure.value) <= self.floor(figure.unit)
            else figure
            for figure in figures
        ]


@functools.cache
def powers_of(unit: str) -> tuple[tuple[float, float, float], float]:
    """The powers of length, rate and force in a unit, and its factor to SI; NaN of what is no unit of mechanics."""
    if unit in ("", "1"):  # without the package that reads units
        return (0.0, 0.0, 0.0), 1.0
    try:
        factor, (length, mass, time, _) = unit_named("deg" if unit == "°" else unit)
    except UnitError:
        return (0.0, 0.0, 0.0), math.nan
    # a mass is a force over an acceleration, length times rate²
    return (float(length - mass), float(-time - 2 * mass), float(mass)), float(factor)


def extreme_place(course: Array, place: str, floor: float = ROUNDING) -> str:
    """Where a course (position,), NaN where it has no value, has an extreme: everywhere if it is constant to rounding.

    place: of the extreme, as "at 24°"; floor: what is rounding of it, see `Scales.floor`, or of numbers without a unit.
    """
    values = course[~np.isnan(course)]
    return EVERYWHERE if len(values) > 1 and np.max(values) - np.min(values) <= floor else place


def scales_in(result: Described) -> Scales:
    """The scales that a result carries; NaN, beside which nothing is rounding, if it carries none."""
    return Scales(*(float(result.attrs.get(f"scale_of_{name}", "nan")) for name in Scales._fields))


# variables that tell how well a result is solved: their rounding is what they are there for
OF_SOLUTION = (
    "closure_residual", "condition", "power_residual", "friction_change", "friction_residual", "friction_contraction",
    "seat_change", "energy_residual", "efficiency_error", "certificate",
)  # fmt: skip


def without_noise(result: xr.Dataset) -> xr.Dataset:
    """A result as views show it: 0 where its numbers are rounding, but for those that tell of the solution."""
    scales, cleared = scales_in(result), {}
    for name, variable in result.data_vars.items():
        if variable.dtype.kind != "f" or name in OF_SOLUTION or "units" not in variable.attrs:
            continue
        floors = scales.floor(unit_of(variable))
        each = result.coords.get(variable.attrs.get(UNITS_OF_EACH))
        if each is not None and each.ndim:
            floors = each.copy(data=[scales.floor(str(unit)) for unit in each.values])
        cleared[name] = variable.where(~(abs(variable) <= floors), 0.0)
    return result.assign(cleared)


@dataclass(frozen=True)
class Result:
    """What a result says, and how its numbers become a Dataset.

    Loading xarray takes as long as a small analysis: what prints a summary and findings alone reads `attrs`.
    attrs: those of the Dataset, see `results.attributes`; build: makes the Dataset, called once.
    """

    attrs: Mapping[str, Any]
    build: Callable[[], xr.Dataset]

    @functools.cached_property
    def dataset(self) -> xr.Dataset:
        """The numbers with dimensions, units, labels and attributes."""
        return self.build()

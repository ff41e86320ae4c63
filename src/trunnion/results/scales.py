"""How large the lengths, rates and forces of a mechanism are: what is no more than their rounding is 0.

One floor for every figure, whatever its unit and however small or large the mechanism: a torque counts beside the
largest force times the largest length, a power beside that times the largest rate.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import replace
from functools import cache
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from trunnion.model.units import UnitError
from trunnion.model.units import unit as unit_named
from trunnion.results.attributes import Described, Figure, figure_rows
from trunnion.results.dataset import UNITS_OF_EACH, unit_of

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["EVERYWHERE", "Scales", "extreme_place", "powers_of", "scales_in", "without_noise"]

Array = NDArray[np.float64]
ROUNDING = 1e-10  # of the largest of its kind: what is less is no more than rounding, and how well a break is located
EVERYWHERE = "everywhere"  # the place of an extreme of what is constant
# variables that tell how well a result is solved: their rounding is what they are there for
OF_SOLUTION = (
    "closure_residual", "condition", "power_residual", "friction_change", "friction_residual", "friction_contraction",
    "seat_change", "energy_residual", "efficiency_error", "certificate",
)  # fmt: skip


class Scales(NamedTuple):
    """The largest length, m, rate, 1/s, and force, N, of a mechanism in its cycle."""

    length: float
    rate: float
    force: float

    def floor(self, unit: str) -> float:
        """Return what is rounding of a quantity in a unit.

        Parameters
        ----------
        unit
            As `N m`, `mm` or `°`.

        Returns
        -------
        float
            In that unit; 0 where no scale is known, NaN, which nothing is below, of what is no unit of mechanics.
        """
        powers, factor = _powers(unit)
        with np.errstate(all="ignore"):  # of nothing at rest, and of rates of 1e160 1/s
            size = float(np.prod(np.power(self, powers)))
        return ROUNDING * size / factor if math.isfinite(size) else 0.0

    def zeroed(self, values: Array, unit: str) -> Array:
        """The values in a unit, 0 where they are rounding."""
        return np.where(np.abs(values) <= self.floor(unit), 0.0, values)

    def summary(self, figures: Iterable[Figure]) -> dict[str, Any]:
        """The attributes of a result with its figures: the summary, and these scales."""
        rows = figure_rows(self.of_figures(figures))
        return {"summary": rows, **{f"scale_of_{name}": size for name, size in self._asdict().items()}}

    def of_figures(self, figures: Iterable[Figure]) -> list[Figure]:
        """Figures, 0 where they are rounding, but for those that tell of the solution."""
        return [
            replace(figure, value=0.0)
            if isinstance(figure.value, float) and not figure.numerical and abs(figure.value) <= self.floor(figure.unit)
            else figure
            for figure in figures
        ]


def powers_of(unit: str) -> tuple[float, float, float]:
    """The powers of length, rate and force in a unit; 0 of what is no unit of mechanics."""
    return _powers(unit)[0]


@cache
def _powers(unit: str) -> tuple[tuple[float, float, float], float]:
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
    """Say where a course has an extreme.

    Parameters
    ----------
    course
        (position,), NaN where it has no value.
    place
        Of the extreme, as "at 24°".
    floor
        What is rounding of the course, see `Scales.floor`; if not given, of numbers without a unit.

    Returns
    -------
    str
        The place, or "everywhere" if the course is constant to rounding.
    """
    values = course[~np.isnan(course)]
    return EVERYWHERE if len(values) > 1 and np.max(values) - np.min(values) <= floor else place


def scales_in(result: Described) -> Scales:
    """The scales that a result carries; NaN, beside which nothing is rounding, if it carries none."""
    return Scales(*(float(result.attrs.get(f"scale_of_{name}", "nan")) for name in Scales._fields))


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

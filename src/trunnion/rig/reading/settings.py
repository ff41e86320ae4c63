"""What was set in a condition: numbers of the mapping, a column that states it, or the mean of a channel."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction

import numpy as np
from numpy.typing import NDArray

from trunnion.errors import Finding, MechanismError, agreeing, counted
from trunnion.model.quantity import Quantity
from trunnion.model.units import BASES, Dimension, UnitError
from trunnion.rig.reading.columns import DataTable
from trunnion.rig.reading.log import Account
from trunnion.rig.reading.mapping import DataMapping, File, FromData
from trunnion.rig.reading.sensor_quantity import Dimensions, dimensions
from trunnion.rig.reading.timebase import Timeline

__all__ = ["Setting", "constant", "dimension_of", "name_of", "settings", "stated"]

MOST = 500  # values that a column may state; more, and it is a measurement
DIGITS = 9  # by which two of its values are the same


@dataclass(frozen=True)
class Setting:
    """values: numbers of the model, SI, by name; means: channels whose mean is the value.

    dimensions: of the values that were stated with a unit.
    window: rows from the first to the last for which it was set; rows: those of the window for which it was.
    """

    name: str
    values: Mapping[str, float]
    means: Mapping[str, str]
    dimensions: Mapping[str, Dimension]
    window: slice
    rows: NDArray[np.bool_]


def stated(mapping: DataMapping, entry: File) -> dict[str, FromData | Quantity]:
    """What the mapping says was set, for all files and for this one."""
    return {**mapping.set, **entry.set}


def constant(mapping: DataMapping, entry: File) -> tuple[dict[str, float], dict[str, str], dict[str, Dimension]]:
    """Numbers that were set, SI, by name; as they are written; dimensions of those that have a unit."""
    numbers = {path: one for path, one in stated(mapping, entry).items() if isinstance(one, Quantity)}
    known_as = {}
    for path, one in numbers.items():
        dimension = one.check({})
        if dimension is not None and not (one.expression and one.expression.bare):
            known_as[path] = dimension
    values = {path: float(one.evaluate()) for path, one in numbers.items()}
    return values, {path: str(one.source) for path, one in numbers.items()}, known_as


def settings(mapping: DataMapping, entry: File, table: DataTable, line: Timeline, account: Account) -> list[Setting]:
    """The conditions of a file: one, or as many as the columns that state them take different values."""
    values, texts, known_as = constant(mapping, entry)
    taken = {path: one for path, one in stated(mapping, entry).items() if isinstance(one, FromData)}
    means = {path: one.mean for path, one in taken.items() if one.mean is not None}
    columns = {path: one for path, one in taken.items() if one.mean is None}
    if not columns:
        everywhere = np.ones(line.seconds.size, dtype=np.bool_)
        return [Setting(name_of(texts), values, means, known_as, slice(0, everywhere.size), everywhere)]
    units = {path: one.unit or table.columns[str(one.column)].unit for path, one in columns.items()}
    factors = {path: _factor(path, unit, known_as, account) for path, unit in units.items()}
    raw = np.column_stack([line.rows(table.columns[str(one.column)].values) for one in columns.values()])
    known = np.isfinite(raw).all(axis=1)
    if not known.any():
        what = "the columns that state the condition have no numbers"
        raise MechanismError(Finding(what, "set", "check set: {…: {column: …}}", file=account.file))
    if not known.all():
        lost = int(np.count_nonzero(~known))
        what = (
            f"{lost:,} of {counted(known.size, 'row')} {agreeing(lost, 'does', 'do')} not state the condition; left out"
        )
        account.warn("data.setting.missing", "set", what, "check the column")
    rounded = _rounded(raw)
    at = np.flatnonzero(known)
    unique, first, which = np.unique(rounded[known], axis=0, return_index=True, return_inverse=True)
    if len(unique) > MOST:
        what = f"the columns that state the condition have {len(unique):,} different values"
        remedy = "a measured value is not a setting: write {mean: channel}"
        raise MechanismError(Finding(what, "set", remedy, file=account.file))
    found = []
    number = np.full(known.size, -1)
    number[known] = which.ravel()
    ends = np.full(len(unique), -1)
    ends[which.ravel()] = at  # the last of each stays
    for k in np.argsort(first, kind="stable"):
        window = slice(int(at[first[k]]), int(ends[k]) + 1)
        own, said = dict(values), dict(texts)
        for path, value in zip(columns, unique[k], strict=True):
            unit = units[path]
            own[path] = float(value) * factors[path]
            said[path] = f"{value:.6g} {unit}".strip()
        found.append(Setting(name_of(said), own, means, known_as, window, number[window] == k))
    return found


def _factor(path: str, unit: str, known_as: dict[str, Dimension], account: Account) -> float:
    """Factor to SI of the unit of a column, whose dimension is noted."""
    if not unit:
        return 1.0
    try:
        factor, exponents = dimensions(unit)
        known_as[path] = dimension_of(exponents, unit)
    except UnitError as error:
        remedy = f"state the unit in the mapping: set: {{{path}: {{column: …, unit: …}}}}; in the file, {error.remedy}"
        raise MechanismError(Finding(error.what, f"set.{path}", remedy, file=account.file)) from None
    return factor


def dimension_of(exponents: Dimensions, unit: str) -> Dimension:
    """Exponents of a unit as a dimension of the model; UnitError for volts, degrees of temperature and the like."""
    order = BASES[:4]
    if any(power for name, power in exponents.items() if name not in order):
        raise UnitError(f"the unit '{unit}' is none that a number of a model has", "write one such as deg, mm or N m")
    length, mass, time, angle = (Fraction(exponents.get(name, 0)) for name in order)
    return length, mass, time, angle


def _rounded(values: NDArray[np.float64]) -> NDArray[np.float64]:
    """Values to so many significant digits."""
    with np.errstate(divide="ignore", invalid="ignore"):
        digits = np.where(values == 0, 0, np.floor(np.log10(np.abs(values))))
        scale = 10.0 ** (DIGITS - 1 - np.where(np.isfinite(digits), digits, 0))
        return np.asarray(np.rint(values * scale) / scale)


def name_of(texts: Mapping[str, str]) -> str:
    return ", ".join(f"{path} {text}" for path, text in texts.items())

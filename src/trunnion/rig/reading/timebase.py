"""Time of every row, and what is wrong with it: gaps, steps backward, repeated and uneven times."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from trunnion.errors import Finding, MechanismError
from trunnion.model.units import UnitError
from trunnion.rig.reading.clock import Clock
from trunnion.rig.reading.columns import Column, DataTable
from trunnion.rig.reading.log import Account, counted, times
from trunnion.rig.reading.mapping import TimeBase
from trunnion.rig.reading.sensor_quantity import dimensions

__all__ = ["Timeline", "timeline"]

Array = NDArray[np.float64]
GAP = 1.5  # times the usual step
UNEVEN = 0.2  # of the usual step, standard deviation


@dataclass(frozen=True)
class Timeline:
    """Rising times of the rows that are kept.

    seconds: (row,); kept: rows of the table, None if all; step: the usual one, s; breaks: rows that follow a gap;
    even: whether the samples are evenly spaced but for gaps; spoilt: times at which the clock ran backward.
    """

    seconds: Array
    kept: NDArray[np.intp] | None
    step: float
    breaks: NDArray[np.intp]
    even: bool = True
    spoilt: Array = field(default_factory=lambda: np.empty(0))

    def part(self, window: slice) -> Timeline:
        """The rows of a window, those of all that are kept."""
        low, high, _ = window.indices(self.seconds.size)
        inside = (self.breaks > low) & (self.breaks < high)
        return replace(self, seconds=self.seconds[window], kept=None, breaks=self.breaks[inside] - low)

    def rows(self, values: Array) -> Array:
        """The values of the rows that are kept."""
        return values if self.kept is None else values[self.kept]


def timeline(table: DataTable, base: TimeBase | None, account: Account) -> Timeline:
    """Time of the rows of a table by the mapping, else by what the file itself tells of its sampling."""
    if base is not None and base.rate is not None:
        step = 1.0 / base.rate.value
        return Timeline(_counted(table.rows) * step, None, step, np.empty(0, dtype=np.intp))
    if base is None or base.column not in table.columns:
        if table.interval is None:
            what = "no column gives the time of its rows"
            remedy = "add time: {column: …, unit: s} or time: {rate: 2 kHz} to the mapping"
            raise MechanismError(Finding(what, "time", remedy, file=table.file))
        start, step = table.interval
        account.say(f"time is that of the waveforms: every {step:.6g} s")
        return Timeline(start + _counted(table.rows) * step, None, step, np.empty(0, dtype=np.intp))
    column = table.columns[str(base.column)]
    if column.clock is not None and not np.isfinite(column.values).any():
        return _stated(_by_clock(column.clock, account), account)
    if column.texts == column.values.size:
        what = f"the column '{base.column}' has texts, such as '{column.example}', where times are needed"
        remedy = "write them in s, as 11:40:00.0002 or as 2026-11-22 11:40:00.0002, or state time: {rate: …}"
        raise MechanismError(Finding(what, "time.column", remedy, file=account.file))
    return _stated(column.values * _factor(base, column, account), account)


def _by_clock(clock: Clock, account: Account) -> Array:
    """Seconds since the first of the time stamps of a column."""
    try:
        seconds = clock.seconds()
    except ValueError as error:
        remedy = "write them as 2026-11-22 11:40:00.0002, or state time: {rate: …}"
        raise MechanismError(Finding(str(error), "time.column", remedy, file=account.file)) from None
    account.say("time is counted in s from the first time stamp, {}", clock.first)
    return seconds


def _counted(rows: int) -> Array:
    return np.arange(rows, dtype=np.float64)


def _factor(base: TimeBase, column: Column, account: Account) -> float:
    """Seconds of a unit of the column: by the mapping, else by the file, else seconds."""
    if base.unit:
        return dimensions(base.unit)[0]
    if not column.unit:
        account.note(
            "data.time.no_unit",
            "time",
            f"the column '{base.column}' has no unit; seconds are assumed",
            "state time.unit",
        )
        return 1.0
    try:
        factor, found = dimensions(column.unit)
    except UnitError as error:
        remedy = f"state time.unit in the mapping, such as s; in the file, {error.remedy}"
        what = f"the column '{base.column}': {error.what}"
        raise MechanismError(Finding(what, "time", remedy, file=account.file)) from None
    if found != dimensions("s")[1]:
        what = f"the column '{base.column}' has the unit '{column.unit}', which is no time"
        raise MechanismError(Finding(what, "time", "name another column", file=account.file))
    return factor


def _stated(seconds: Array, account: Account) -> Timeline:
    """Times that rise, from a column: rows whose time does not rise are left out."""
    finite = np.isfinite(seconds)
    highest = np.maximum.accumulate(np.where(finite, seconds, -np.inf))
    rising = finite & (seconds > np.concatenate([[-np.inf], highest[:-1]]))
    lost, total = int(np.count_nonzero(~finite)), seconds.size
    if lost:
        what = f"{counted(lost, 'row')} of {total:,} {'has' if lost == 1 else 'have'} no time"
        account.warn("data.time.missing", "time", f"{what}; left out", "check the logger, or state time: {rate: …}")
    kept = np.flatnonzero(rising)
    if kept.size < 3:
        what = f"the time rises in {kept.size} of {counted(total, 'row')}"
        raise MechanismError(Finding(what, "time", "check that time.column is the right one", file=account.file))
    spoilt = _backward(seconds, finite, rising, account)
    clean = seconds[kept] if kept.size < total else seconds
    steps = np.diff(clean)
    step = float(np.median(steps))
    _tell_gaps(clean, steps, step, account)
    wide = steps > GAP * step
    usual = steps[~wide] / step
    spread = float(np.std(usual)) if usual.size else 0.0
    return Timeline(clean, kept if kept.size < total else None, step, np.flatnonzero(wide) + 1, spread < UNEVEN, spoilt)


def _backward(seconds: Array, finite: NDArray[np.bool_], rising: NDArray[np.bool_], account: Account) -> Array:
    """Tell of rows whose time repeats or runs backward; the times of the latter."""
    stated = seconds[finite]
    steps = np.diff(stated)
    repeated, back = np.flatnonzero(steps == 0), np.flatnonzero(steps < 0)
    if repeated.size:
        share = repeated.size / stated.size
        remedy = "the column is rounded: state time: {rate: …} instead" if share > 0.05 else "check the logger"
        what = f"the time repeats in {counted(repeated.size, 'row')} of {stated.size:,}, {times(stated[repeated])}"
        account.warn("data.time.repeats", "time", f"{what}; these rows are left out", remedy)
    if back.size:
        out = int(np.count_nonzero(finite & ~rising)) - repeated.size
        what = (
            f"the time runs backward {counted(back.size, 'time')}, {times(stated[back])}, by up to {-steps.min():.4g} s"
        )
        remedy = "split the file where a new recording begins, or check the logger's clock"
        account.warn(
            "data.time.backward", "time", f"{what}; {counted(max(out, 1), 'row')} left out until it has passed", remedy
        )
    return np.asarray(stated[back])


def _tell_gaps(seconds: Array, steps: Array, step: float, account: Account) -> None:
    wide = np.flatnonzero(steps > GAP * step)
    if not wide.size:
        return
    missing = float(np.sum(np.rint(steps[wide] / step) - 1))
    longest = int(wide[np.argmax(steps[wide])])
    what = f"{counted(wide.size, 'gap')} in time, {missing:,.0f} {'sample' if missing == 1 else 'samples'} missing"
    where = f"the longest {steps[longest]:.4g} s at {seconds[longest]:.5g} s"
    account.warn(
        "data.time.gaps",
        "time",
        f"{what}, {where}",
        "the positions in them have fewer turns; check the logger's buffer",
    )

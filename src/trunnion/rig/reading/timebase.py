"""Time of every row, and what is wrong with it: gaps, steps backward, repeated times; findings about data."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from trunnion.errors import Finding, MechanismError, Severity, counted
from trunnion.model.units import UnitError, normalise
from trunnion.rig.reading.mapping import TimeBase
from trunnion.rig.reading.tables import Column, DataTable
from trunnion.rig.reading.units import HERTZ, alike, dimensions

__all__ = [
    "GAP", "Say", "Timeline", "at_times", "counted", "gathered", "lost", "note", "runs", "timeline", "unit_of",
    "warning",
]  # fmt: skip

Array = NDArray[np.float64]
Say = Callable[[Finding | str | None], None]  # takes a finding, or a sentence about what was done
GAP = 1.5  # times the usual step
COUNTED = 2.0**53  # steps from the first row to the last, beyond which a float is no count
UNEVEN = 0.2  # of the usual step, standard deviation
_PER_MINUTE = re.compile(r"1\s*/\s*[Mm]in|[Mm]in\^?-1")  # in a heading; in a model file it may be turns or radians


@dataclass(frozen=True)
class Timeline:
    """Rising times of the rows that are kept.

    seconds: (row,); places: of the rows in the table; step: the usual one, s; even: whether they are evenly spaced
    but for gaps; spoilt: times at which the clock ran backward.
    """

    seconds: Array
    places: NDArray[np.intp] | slice
    step: float
    even: bool = True
    spoilt: Array = field(default_factory=lambda: np.empty(0))

    def rows(self, values: Array) -> Array:
        """The values of the rows that are kept."""
        return values[self.places]


def timeline(table: DataTable, base: TimeBase | None, say: Say) -> Timeline:
    """Time of the rows of a table by the mapping, else by what the file itself states of its sampling."""
    if base is not None and base.column in table.columns:
        column = table.columns[str(base.column)]
        if column.stamps:
            say("time is counted in s from the first time stamp")
            return _rising(column.seconds(base.dayfirst), say)
        if column.texts == column.values.size:
            what = f"the column '{base.column}' has texts, such as '{column.example}', where times are needed"
            remedy = "write them in s, as 11:40:00.0002 or as 2026-11-22 11:40:00.0002, or state time: {rate: …}"
            raise MechanismError(Finding(what, "time.column", remedy))
        return _rising(column.values * unit_of("time", str(base.column), column, base.unit, "s", say)[1], say)
    if base is not None and base.rate is not None:
        start, step = 0.0, 1.0 / base.rate.value
    elif table.interval is not None:
        start, step = table.interval
        say(f"time is that of the waveforms: every {step:.6g} s")
    else:
        remedy = "add time: {column: …, unit: s} or time: {rate: 2 kHz} to the mapping"
        raise MechanismError(Finding("no column gives the time of its rows", "time", remedy))
    return Timeline(start + np.arange(table.rows, dtype=np.float64) * step, slice(None), step)


def _rising(seconds: Array, say: Say) -> Timeline:
    """Times that rise, from a column: rows whose time does not rise are left out."""
    highest, finite = np.fmax.accumulate(seconds), np.isfinite(seconds)
    rises = finite & (seconds > np.concatenate([[-np.inf], np.nan_to_num(highest[:-1], nan=-np.inf)]))
    rising, clock = np.flatnonzero(rises), seconds[finite]
    if rising.size < 3:
        what = f"the time rises in {rising.size} of {counted(seconds.size, 'row')}"
        raise MechanismError(Finding(what, "time", "check that time.column is the right one"))
    clean, back = seconds[rising], np.diff(clock) < 0
    if rising.size < seconds.size:
        what = (
            f"{counted(seconds.size - rising.size, 'row')} of {seconds.size:,} left out: {np.sum(~finite):,} have no "
        )
        what += f"time, of the others it does not rise, {at_times(highest[finite & ~rises])}"
        if back.any():
            what += f"; it runs backward {counted(int(back.sum()), 'time')} by up to {-np.diff(clock).min():.4g} s"
        say(warning("time.backward", "time", what, "check the logger's clock, or split the file"))
    steps = np.diff(clean)
    step = float(np.median(steps))
    if float(clean[-1]) - float(clean[0]) >= COUNTED * step:
        what = f"the time goes from {clean[0]:.4g} s to {clean[-1]:.4g} s in steps of {step:.4g} s, too many to count"
        raise MechanismError(Finding(what, "time", "check that time.column is the right one"))
    wide = steps > GAP * step
    if (gaps := np.flatnonzero(wide)).size:
        samples, longest = int(np.sum(np.rint(steps[gaps] / step) - 1)), int(gaps[np.argmax(steps[gaps])])
        what = f"{counted(gaps.size, 'gap')} in time, {counted(samples, 'sample')} missing, the longest "
        what += f"{steps[longest]:.4g} s at {clean[longest]:.5g} s"
        say(warning("time.gaps", "time", what, "check the logger's buffer"))
    return Timeline(clean, rising, step, float(np.std(steps[~wide] / step)) < UNEVEN, clock[:-1][back])


def unit_of(where: str, name: str, column: Column, in_mapping: str | None, usual: str, say: Say) -> tuple[str, float]:
    """Unit of a column, and its factor to SI: the mapping's, else the file's, else the usual one.

    where: the entry of the mapping that has the key `unit`. A speed of rotation in 1/min is one in rpm.
    """
    in_file = "rpm" if usual == "rad/s" and _PER_MINUTE.fullmatch(normalise(column.unit).strip()) else column.unit
    unit = in_mapping or in_file or usual
    if usual and not (in_mapping or in_file):
        say(
            note("unit.none", where, f"the column '{name}' has no unit; SI is assumed ({usual})", f"state {where}.unit")
        )
    try:
        factor, kind = dimensions(unit) if unit else (1.0, {})
    except UnitError as error:
        remedy = f"state {where}.unit in the mapping; in the file, {error.remedy}"
        raise MechanismError(Finding(f"the column '{name}': {error.what}", where, remedy)) from None
    if where in ("time", "angle") and not alike(kind, dimensions(usual)[1]):
        what = f"the column '{name}' has the unit '{unit}', which is no {where}"
        raise MechanismError(Finding(what, where, "name another column"))
    with suppress(UnitError):
        size, of_file = dimensions(in_file if in_mapping and in_file else unit) if unit else (1.0, {})
        if of_file == HERTZ and "rad" in kind:  # 1/min in the heading, rpm in the mapping
            size, of_file = min((size, 2 * np.pi * size), key=lambda turns: abs(turns - factor)), kind
        if not (alike(of_file, kind) and np.isclose(size, factor, rtol=1e-12, atol=0)):
            times = f": all values are {factor / size:.3g} times those of the file" if alike(of_file, kind) else ""
            what = f"the file has the unit '{in_file}' for '{name}', the mapping '{in_mapping}', which is taken{times}"
            say(warning("unit.differs", where, what, f"correct {where}.unit, or remove it"))
    return unit, factor


# ---- findings about data, and places in time -------------------------------------------------------------------


def warning(code: str, where: str, what: str, remedy: str = "") -> Finding:
    """A fault of the data."""
    return Finding(what, where, remedy, Severity.WARNING, code=f"data.{code}")


def note(code: str, where: str, what: str, remedy: str = "") -> Finding:
    """Something to know."""
    return Finding(what, where, remedy, Severity.NOTE, code=f"data.{code}")


def gathered(findings: Iterable[Finding], same: bool = False) -> list[Finding]:
    """Findings about data files, those of one code and place only once, with the files they are of.

    same: only those that say the same; else the first speaks for all.
    """
    groups: dict[tuple[str, ...], list[Finding]] = {}
    for finding in findings:
        key = (finding.severity, finding.code, finding.where.partition(" ")[0], finding.what if same else "")
        groups.setdefault(key, []).append(finding)
    merged = []
    for first, *others in groups.values():
        if others:
            files = list(dict.fromkeys(Path(finding.file).name for finding in (first, *others) if finding.file))
            what = f"{first.what} — {len(others) + 1} such findings"
            what += f": {', '.join(files[:4])}{', …' * (len(files) > 4)}" if files else ""
            several = any(finding.where != first.where for finding in others)
            where = f"{first.where.partition(' ')[0]}s" if several else first.where
            first = replace(first, what=what, where=where, file="", line=None)
        merged.append(first)
    return merged


def runs(mask: NDArray[np.bool_]) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """First place and length of every stretch of a mask that is true."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], mask, [False]]).astype(np.int8)))
    return edges[::2], edges[1::2] - edges[::2]


def at_times(seconds: Sequence[float] | NDArray[np.float64], most: int = 3) -> str:
    """Some times in words."""
    return f"at {', '.join(f'{t:.5g}' for t in seconds[:most])}{', …' if len(seconds) > most else ''} s"


def lost(kind: str, mask: NDArray[np.bool_], time: NDArray[np.float64], noun: str = "reading") -> str:
    """Rows of a mask in words: what they are, how many, when the stretches of them begin; they are left out."""
    count = f"{kind}: {counted(int(mask.sum()), noun)} of {mask.size:,}"
    return f"{count}, {at_times(time[runs(mask)[0]])}; left out"

"""Faults of the readings of a sensor: missing cells, clipping, stuck values, spikes. Each is named and left out."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import median_filter
from scipy.special import bdtrc

from trunnion.errors import Finding, MechanismError, Severity
from trunnion.rig.reading.columns import Column
from trunnion.rig.reading.log import Account, counted, places, runs

__all__ = ["WIDTH", "FaultSpan", "cells", "clipped", "outliers", "signal"]

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
CLIP = 0.9995  # of the range, from which a reading is at it: the top code of 12 bits is 2047/2048
OVERLOAD = (9.9e37, 1e38)  # what SCPI instruments write for an overload or no number (SCPI 1999.0, 7.2.1)
MOST = 0.5  # of the readings at the end of the range: more is no load that is now and then too large
STUCK = 30  # equal readings in a row at least
WIDTH = 7  # samples of the median that spikes are told from: up to three in a row are found
FAR = 12.0  # robust standard deviations from it
NEAR = 0.01  # of a turn: what recurs that close is in the same place
CHANCE = 0.025
FEW = 4  # turns from which what comes back can be told from faults
SEEN = 0.1  # of the span from the 1st to the 99th percentile, that a spike exceeds


@dataclass(frozen=True)
class FaultSpan:
    """The rows in which the drive runs, and when its turns begin and end there, s.

    beside: rows before and after them that reach into the turns, by interpolation or a filter.
    """

    low: int
    high: int
    begin: Array
    end: Array
    beside: int = 0

    @property
    def turns(self) -> int:
        return int(self.begin.size)

    def phase(self, time: Array) -> Array:
        """Share of its turn that has passed at a time, s."""
        turn = np.clip(np.searchsorted(self.begin, time, side="right") - 1, 0, self.turns - 1)
        return np.asarray(((time - self.begin[turn]) / (self.end - self.begin)[turn]) % 1.0)


def outliers(readings: Array) -> Mask:
    """Single readings, none of them NaN, that are far off the median of those around them, beyond any doubt."""
    off = np.abs(readings - median_filter(readings, size=WIDTH, mode="mirror"))
    return np.asarray(off > FAR * float(np.percentile(off, 99))) if readings.size > WIDTH else off > np.inf


def cells(where: str, column: Column, readings: Array, seconds: Array, account: Account) -> None:
    """Tell of cells without a number, which all become NaN: infinite ones and codes for an overload too."""
    size = np.abs(readings)
    readings[np.isinf(size) | ((size >= OVERLOAD[0]) & (size < OVERLOAD[1]))] = np.nan
    missing = np.isnan(readings)
    if missing.any():
        example = f" ({counted(column.texts, 'text')} such as '{column.example}')" if column.texts else ""
        what = f"dropouts: {counted(int(missing.sum()), 'cell')} of {readings.size:,} without a number{example}"
        what = f"{what}, {places(missing, seconds)}; left out"
        account.warn("data.readings.missing", where, what, "check cable and logger")


def clipped(where: str, readings: Array, limit: float, unit: str, seconds: Array, account: Account) -> None:
    """Tell of readings at the end of the range or beyond, which become NaN; an error where most of the channel is."""
    rows = np.abs(readings) >= CLIP * limit
    count, finite = int(np.count_nonzero(rows)), int(np.count_nonzero(np.isfinite(readings)))
    if not count:
        return
    what = f"clipped: {counted(count, 'reading')} of {finite:,} at or beyond the end of the range of {limit:.6g} "
    what += unit or "in the unit of the readings"
    if count > MOST * finite:  # what is left says nothing of the channel
        remedy = "check column, unit, gain and range of the channel in the mapping; else use a larger range"
        figures = {"count": count, "readings": finite}
        finding = Finding(what, where, remedy, file=account.file, code="data.readings.clipped", figures=figures)
        raise MechanismError(finding)
    what = f"{what}, {places(rows, seconds)}; left out, so that means there are too small"
    account.warn("data.readings.clipped", where, what, "use a larger range or a smaller load")
    readings[rows] = np.nan


def signal(
    where: str, readings: Array, seconds: Array, span: FaultSpan, account: Account, steady: bool = False
) -> None:
    """Look for stuck readings and spikes in the rows of a span, and make them NaN.

    steady: whether one reading throughout is nothing strange, as of a speed.
    """
    part, time = readings[span.low : span.high], seconds[span.low : span.high]
    known = part[np.isfinite(part)]
    if known.size < 10:
        return
    if known.min() == known.max():
        what = f"reads {known[0]:.6g} in every one of {known.size:,} rows"
        remedy = "check that the sensor is connected and the column the right one"
        severity = Severity.NOTE if steady else Severity.WARNING
        account.warn("data.readings.constant", where, what, remedy, severity)
        return
    wide = max(float(np.subtract(*np.percentile(known, (99, 1)))), 1e-300)
    _stuck(where, part, time, span, account)
    near = slice(max(span.low - span.beside, 0), span.high + span.beside)
    _spikes(where, readings[near], seconds[near], wide, span, account)


def _leave_out(part: Array, mask: Mask, span: FaultSpan) -> str:
    """Leave out what may be the signal's own only where there are turns enough to tell; what was done."""
    if span.turns < FEW:
        return f"left in: in {counted(span.turns, 'turn')} it cannot be decided whether this belongs to the signal"
    part[mask] = np.nan
    return "left out"


def _periodic(count: int, span: FaultSpan) -> bool:
    """Whether something happens in so many places that it belongs to the signal."""
    return span.turns >= FEW and count >= 0.5 * span.turns


def _recurring(phase: Array) -> Mask:
    """What comes back in the same place of the turn more often than chance would have it: the signal's own.

    So many others lie within NEAR of it, of turns taken at random, in CHANCE of all cases only (binomial). Once found,
    they do not count any more when the rest is looked at.
    """
    own = np.zeros(phase.size, dtype=np.bool_)
    while np.count_nonzero(~own) > 1:
        rest = phase[~own]
        around = np.sort(np.concatenate([rest - 1, rest, rest + 1]))
        others = np.searchsorted(around, rest + NEAR, side="right") - np.searchsorted(around, rest - NEAR) - 1
        again = np.asarray(bdtrc(others - 1, rest.size - 1, 2 * NEAR) < CHANCE)
        if not again.any():
            break
        own[np.flatnonzero(~own)[again]] = True
    return own


def _stuck(where: str, part: Array, time: Array, span: FaultSpan, account: Account) -> None:
    """The same reading in a row much more often than is usual for the channel."""
    starts, lengths = runs(np.concatenate([np.diff(part) == 0, [False]]))
    if not starts.size:
        return
    single = part.size - int(np.sum(lengths + 1))
    ranks = np.sort(np.concatenate([lengths + 1, np.ones(min(single, 10 * lengths.size), dtype=np.intp)]))
    usual = float(ranks[int(0.99 * (ranks.size - 1))])
    long = lengths + 1 > max(STUCK, 10 * usual if usual < 0.1 * part.size else STUCK)
    held = int(np.sum(lengths[long] + 1))
    if not long.any() or _periodic(int(long.sum()), span) or held > 0.5 * part.size:
        return
    bad = np.zeros(part.size, dtype=np.bool_)
    for begin, length in zip(starts[long], lengths[long], strict=True):
        bad[begin + 1 : begin + length + 1] = True
    what = f"stuck: the reading does not change for {counted(held, 'sample')}, {places(bad, time)}"
    account.warn("data.readings.stuck", where, f"{what}; {_leave_out(part, bad, span)}", "check sensor and logger")


def _spikes(where: str, part: Array, time: Array, wide: float, span: FaultSpan, account: Account) -> None:
    """One to three readings far from the median of those around them."""
    finite = np.isfinite(part)
    if np.count_nonzero(finite) < 2 * WIDTH:
        return
    known = part[finite]
    off = np.abs(known - median_filter(known, size=WIDTH, mode="nearest"))
    ends = np.abs(known - median_filter(known, size=WIDTH, mode="mirror"))  # which a slope moves, too
    off = np.where(ends > wide, np.maximum(off, ends), off)
    spread = 1.4826 * float(np.median(off))
    far = off > max(FAR * spread, 2.5 * float(np.percentile(off, 99)), SEEN * wide)
    if _periodic(int(runs(far)[0].size), span):
        return
    bad = np.zeros(part.size, dtype=np.bool_)
    bad[np.flatnonzero(finite)[far]] = True
    bad[np.flatnonzero(bad)[_recurring(span.phase(time[bad]))]] = False
    far = bad[finite]
    if not far.any():
        return
    what = f"spikes: {counted(int(far.sum()), 'reading')} of {span.high - span.low:,} up to "
    what += f"{off[far].max() / wide:.2g} times the usual span off their neighbours, {places(bad, time)}"
    account.warn("data.readings.spikes", where, f"{what}; {_leave_out(part, bad, span)}", "check shielding and earth")

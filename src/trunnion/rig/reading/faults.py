"""What is wrong with the readings of a sensor: missing cells, zeros, stuck values, clipping, spikes. Each is named and
left out, except where nothing tells for certain; what comes back in the same place of most turns is the signal's own.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import median_filter
from scipy.special import bdtrc

from trunnion.errors import Finding, MechanismError, Severity
from trunnion.rig.reading.arcs import arcs
from trunnion.rig.reading.columns import Column
from trunnion.rig.reading.log import Account, counted, places, runs

__all__ = ["NO_FAULT", "BeyondRange", "FaultSpan", "beyond", "cells", "outliers", "signal"]

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
CLIP = 0.9995  # of the range, from which a reading is at it: the top code of 12 bits is 2047/2048
CODE = 2.0  # times the range, from which a number is no reading but a code for an overload
OVERLOAD = (9.9e37, 1e38)  # what SCPI instruments write for an overload or no number lies between (SCPI 1999.0, 7.2.1)
MOST = 0.5  # of the readings at the end of the range: more is no load that is now and then too large
STUCK = 30  # equal readings in a row at least
WIDTH = 7  # samples of the median that spikes are told from: up to three in a row are found
FAR = 12.0  # robust standard deviations from it
NEAR = 0.01  # of a turn: what recurs that close is in the same place
CHANCE = 0.025
FEW = 4  # turns from which what comes back can be told from faults
JUMP = 0.25  # of the same span: a signal that comes to its extreme by such steps is not clipped there
MOST_ARCS = 3  # ranges of the angle named
SEEN = 0.1  # of the span from the 1st to the 99th percentile, that a spike or a fall to zero exceeds


@dataclass(frozen=True)
class FaultSpan:
    """The rows in which the drive runs, and when its turns begin and end there, s.

    angle: coordinate of the driver by row of the file, rad, None where the cycle is a time; start, cycle: rad; unit: of
    the readings; beside: rows before and after them that reach into the turns, by interpolation or a filter.
    """

    low: int
    high: int
    begin: Array
    end: Array
    angle: Array | None = None
    start: float = 0.0
    cycle: float = 2 * np.pi
    unit: str = ""
    beside: int = 0

    @property
    def turns(self) -> int:
        return int(self.begin.size)

    def phase(self, time: Array) -> Array:
        """Share of its turn that has passed at a time, s."""
        turn = np.clip(np.searchsorted(self.begin, time, side="right") - 1, 0, self.turns - 1)
        return np.asarray(((time - self.begin[turn]) / (self.end - self.begin)[turn]) % 1.0)


@dataclass(frozen=True)
class BeyondRange:
    """Readings at the end of the range or beyond it, by row. codes: those too far beyond to be readings, with one."""

    rows: Mask
    codes: Mask
    example: float


NO_FAULT = BeyondRange(np.zeros(0, np.bool_), np.zeros(0, np.bool_), 0.0)


def beyond(readings: Array, limit: float | None) -> BeyondRange:
    """The readings at the end of the range, in readings, or beyond it, made NaN in all rows where they are not most."""
    if limit is None:
        return NO_FAULT
    size = np.abs(readings)
    rows, codes = size >= CLIP * limit, size > CODE * limit
    example = float(readings[np.nanargmax(size)]) if codes.any() else 0.0
    if np.count_nonzero(rows) <= MOST * np.count_nonzero(np.isfinite(readings)):
        readings[rows] = np.nan
    return BeyondRange(rows, codes, example)


def outliers(readings: Array) -> Mask:
    """Single readings, none of them NaN, that are far off the median of those around them, beyond any doubt."""
    off = np.abs(readings - median_filter(readings, size=WIDTH, mode="mirror"))
    return np.asarray(off > FAR * float(np.percentile(off, 99))) if readings.size > WIDTH else off > np.inf


def cells(where: str, column: Column, readings: Array, seconds: Array, account: Account) -> None:
    """Tell of cells without a finite number, and make the infinite ones NaN."""
    infinite, codes = np.isinf(readings), (np.abs(readings) >= OVERLOAD[0]) & (np.abs(readings) < OVERLOAD[1])
    example = float(readings[np.argmax(codes)])
    readings[infinite | codes] = np.nan
    missing = np.isnan(readings)
    count = int(np.count_nonzero(missing))
    if not count:
        return
    kinds = [text for number, text in (
        (column.texts, f"{counted(column.texts, 'text')} such as '{column.example}'"),
        (int(np.count_nonzero(infinite)), f"{np.count_nonzero(infinite):,} infinite"),
        (int(np.count_nonzero(codes)), f"{counted(int(np.count_nonzero(codes)), 'overload code')} such as {example:g}"),
    ) if number]  # fmt: skip
    empty = count - column.texts - int(np.count_nonzero(infinite | codes))
    kinds += [f"{empty:,} empty or NaN"] * (empty > 0 and bool(kinds))
    told = f" ({', '.join(kinds)})" if kinds else ""
    what = f"dropouts: {counted(count, 'cell')} of {readings.size:,} without a number{told}, {places(missing, seconds)}"
    account.warn("data.readings.missing", where, f"{what}; left out", "check cable and logger")


def signal(
    where: str,
    readings: Array,
    seconds: Array,
    span: FaultSpan,
    limit: float | None,
    account: Account,
    steady: bool = False,
    out: BeyondRange = NO_FAULT,
) -> None:
    """Look for faults in the rows of a span, and make the readings that they spoil NaN.

    limit: the end of the range, in readings; out: what was beyond it; steady: whether one reading throughout is nothing
    strange, as of a speed.
    """
    part, time = readings[span.low : span.high], seconds[span.low : span.high]
    if limit is not None:
        _clipped(where, part, seconds, limit, span, out, account)
    finite = np.isfinite(part)
    if np.count_nonzero(finite) < 10:
        return
    known = part[finite]
    low, high = (float(one) for one in np.percentile(known, (1, 99)))
    if known.min() == known.max():
        what = f"reads {known[0]:.6g} in every one of {known.size:,} rows"
        severity = Severity.NOTE if steady else Severity.WARNING
        account.warn(
            "data.readings.constant",
            where,
            what,
            "check that the sensor is connected and the column the right one",
            severity,
        )
        return
    wide = max(high - low, 1e-300)
    _zeros(where, part, time, wide, span, account)
    _stuck(where, part, time, span, account)
    _plateaus(where, part, time, wide, span, limit, account)
    near = slice(max(span.low - span.beside, 0), span.high + span.beside)
    _spikes(where, readings[near], seconds[near], wide, span, account)


def _leave_out(part: Array, mask: Mask) -> None:
    part[mask] = np.nan


def _doubtful(part: Array, mask: Mask, span: FaultSpan) -> str:
    """Leave out what may be the signal's own only where there are turns enough to tell; what was done."""
    if span.turns < FEW:
        return f"left in: in {counted(span.turns, 'turn')} it cannot be decided whether this belongs to the signal"
    _leave_out(part, mask)
    return "left out"


def _own(count: int, span: FaultSpan) -> bool:
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
        found = np.asarray(bdtrc(others - 1, rest.size - 1, 2 * NEAR) < CHANCE)
        if not found.any():
            break
        own[np.flatnonzero(~own)[found]] = True
    return own


def _clipped(
    where: str, part: Array, seconds: Array, limit: float, span: FaultSpan, out: BeyondRange, account: Account
) -> None:
    """Tell of readings at the end of the range and beyond; an error where they are most of the channel."""
    end = f"the range of {limit:.6g} {span.unit or 'in the unit of the readings'}"
    rows = out.rows[span.low : span.high]
    count, finite = int(np.count_nonzero(rows)), int(np.count_nonzero(rows | np.isfinite(part)))
    if count > MOST * finite:  # what is left says nothing of the channel
        what = f"clipped: {counted(count, 'reading')} of {finite:,} at or beyond the end of {end}"
        figures = {"count": count, "readings": finite}
        remedy = "check column, unit, gain and range of the channel in the mapping; else use a larger range"
        raise MechanismError(
            Finding(what, where, remedy, file=account.file, code="data.readings.clipped", figures=figures)
        )
    near = slice(max(span.low - span.beside, 0), span.high + span.beside)
    codes, time = out.codes[near], seconds[near]
    if codes.any():
        told = f"{counted(int(np.count_nonzero(codes)), 'reading')} of {part.size:,} far beyond {end}, such as "
        what = f"overload: {told}{out.example:.6g}, {places(codes, time)}; left out"
        remedy = "check cable and logger; where the load is beyond the range, means are too small: use a larger range"
        account.warn("data.readings.overload", where, what, remedy)
    mask = out.rows[near] & ~codes
    if mask.any():
        what = f"clipped: {counted(int(np.count_nonzero(mask)), 'reading')} of {part.size:,} at the end of the range"
        what = f"{what}, {places(mask, time)}; left out, so that means there are too small"
        account.warn("data.readings.clipped", where, what, "use a larger range or a smaller load")


def _plateaus(
    where: str, part: Array, time: Array, wide: float, span: FaultSpan, limit: float | None, account: Account
) -> None:
    """Readings that gather at the largest or least one, as at an end of the range that is not the one stated."""
    finite = part[np.isfinite(part)]
    if not finite.size:
        return
    for end in (float(finite.max()), float(finite.min())):
        mask = part == end
        at = int(np.count_nonzero(mask))
        if end == 0 or at < max(5, 2e-4 * finite.size) or not _gathers(part, mask, wide, finite):
            continue
        value = f"{end:.6g} {span.unit}" if span.unit else f"{end:.6g} in the unit of the readings"
        what = f"seems clipped at {value}: {at:,} of {part.size:,}, {places(mask, time)}{_angles(mask, span)}"
        channel, own = where.removeprefix("channels."), f"{abs(end):.6g} {span.unit}".strip()
        remedy = "state range: if it is the end of the sensor's, and use a larger one"
        if limit is not None:
            stated = f"{limit:.6g} {span.unit}".strip()
            entry = f"files: [{{file: {Path(account.file).name}, channels: {{{channel}: {{range: {own}}}}}}}]"
            remedy = f"the range: of {stated} is not reached; if the amplifier ended here, state {entry}"
        account.warn("data.readings.plateau", where, what, remedy)


def _gathers(part: Array, mask: Mask, wide: float, finite: Array) -> bool:
    """Whether far more readings are at an extreme than beside it, in a row, and the signal does not jump to it.

    A load that changes its sign at once jumps from one extreme to the other, and is not clipped.
    """
    end = float(part[mask][0])
    others = finite[finite != end]
    if not others.size:  # the rest was left out as something else
        return False
    beside = others.max() if end == finite.max() else others.min()
    starts, lengths = runs(mask)
    if lengths.max() < 3 or np.mean(lengths) <= 1.5 or np.count_nonzero(mask) <= 5 * np.count_nonzero(others == beside):
        return False
    around = np.concatenate([starts[starts > 0] - 1, (starts + lengths)[starts + lengths < part.size]])
    steps = np.abs(part[around] - end)
    steps = steps[np.isfinite(steps)]
    return not steps.size or float(np.median(steps)) < JUMP * wide


def _angles(mask: Mask, span: FaultSpan) -> str:
    """At which angles of the driver a mask is true, in words; empty where the cycle is a time or it is all around."""
    if span.angle is None:
        return ""
    found = arcs(span.angle[span.low : span.high][mask], span.start, span.cycle)
    if not found or found == [(span.start, span.start + span.cycle)] or len(found) > MOST_ARCS:
        return ""
    told = " and ".join(f"{np.degrees(low):.0f}° to {np.degrees(high):.0f}°" for low, high in found)
    return f", with the driver at {told}"


def _zeros(where: str, part: Array, time: Array, wide: float, span: FaultSpan, account: Account) -> None:
    """Readings of exactly zero between others that are far from it."""
    mask = part == 0
    if not mask.any() or np.count_nonzero(mask) > 0.5 * part.size:
        return
    starts, lengths = runs(mask)
    inner = (starts > 0) & (starts + lengths < part.size)
    starts, lengths = starts[inner], lengths[inner]
    before, after = part[starts - 1], part[starts + lengths]
    steps = np.abs(np.diff(part))
    noise = 1.4826 * float(np.nanmedian(steps)) if np.isfinite(steps).any() else 0.0
    amplitude = float(np.nanpercentile(np.abs(part), 95))
    least = max(8 * noise, SEEN * wide, SEEN * amplitude)
    fallen = (np.abs(before) > least) & (np.abs(after) > least)
    if not fallen.any() or _own(int(fallen.sum()), span):
        return
    bad = np.zeros(part.size, dtype=np.bool_)
    for begin, length in zip(starts[fallen], lengths[fallen], strict=True):
        bad[begin : begin + length] = True
    what = f"dropouts: {counted(int(bad.sum()), 'reading')} of {part.size:,} zero in the middle of the signal"
    done = _doubtful(part, bad, span)
    account.warn("data.readings.zero", where, f"{what}, {places(bad, time)}; {done}", "check cable and connector")


def _stuck(where: str, part: Array, time: Array, span: FaultSpan, account: Account) -> None:
    """The same reading in a row much more often than is usual for the channel."""
    same = np.concatenate([np.diff(part) == 0, [False]])
    starts, lengths = runs(same)
    if not starts.size:
        return
    single = part.size - int(np.sum(lengths + 1))
    ranks = np.sort(np.concatenate([lengths + 1, np.ones(min(single, 10 * lengths.size), dtype=np.intp)]))
    usual = float(ranks[int(0.99 * (ranks.size - 1))])
    long = lengths + 1 > max(STUCK, 10 * usual if usual < 0.1 * part.size else STUCK)
    held = int(np.sum(lengths[long] + 1))
    if not long.any() or _own(int(long.sum()), span) or held > 0.5 * part.size:
        return
    bad = np.zeros(part.size, dtype=np.bool_)
    for begin, length in zip(starts[long], lengths[long], strict=True):
        bad[begin + 1 : begin + length + 1] = True
    what = f"stuck: the reading does not change for {counted(held, 'sample')}, {places(bad, time)}"
    account.warn("data.readings.stuck", where, f"{what}; {_doubtful(part, bad, span)}", "check sensor and logger")


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
    usual = float(np.percentile(off, 99))
    far = off > max(FAR * spread, 2.5 * usual, SEEN * wide)
    if _own(int(runs(far)[0].size), span):
        return
    bad = np.zeros(part.size, dtype=np.bool_)
    bad[np.flatnonzero(finite)[far]] = True
    bad[np.flatnonzero(bad)[_recurring(span.phase(time[bad]))]] = False
    far = bad[finite]
    if not far.any():
        return
    what = f"spikes: {counted(int(far.sum()), 'reading')} of {span.high - span.low:,} up to "
    what += f"{off[far].max() / wide:.2g} times the usual span off their neighbours, {places(bad, time)}"
    account.warn("data.readings.spikes", where, f"{what}; {_doubtful(part, bad, span)}", "check shielding and earth")

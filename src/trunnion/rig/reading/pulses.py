"""Pulses of an encoder: from a running count, which may wrap, or from the edges of a level; pulses lost on the way."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import median_filter

from trunnion.errors import Finding, MechanismError
from trunnion.rig.reading.log import Account, counted, times
from trunnion.rig.reading.mapping import AngleSource
from trunnion.rig.reading.timebase import GAP, Timeline

__all__ = ["Pulses", "by_index", "index_times", "pulses_of", "unwrapped"]

Array = NDArray[np.float64]
TOLD_BY = 5  # samples between pulses from which a lost one shows in the time between its neighbours
STANDS = 3.0  # times the usual time of a count, from which the shaft stands or a pulse is lost
FULL = (1 << 8, 1 << 16, 1 << 24, 1 << 32)  # at which counters usually begin anew
WILD = 20.0  # times the largest usual step, by which a counter is set back


@dataclass(frozen=True)
class Pulses:
    """Times at which counts were reached.

    counts: (pulse,), of a turn `per_turn`; spoilt: from when to when pulses were lost, (stretch, 2); until: from when
    on they were missed; crossings: whether the times are finer than the sampling; slack: counts between two samples.
    """

    times: Array
    counts: Array
    spoilt: Array
    until: float | None = None
    crossings: bool = False

    def slack(self, step: float) -> float:
        """Counts from one sample to the next, in the mean while the shaft turns.

        The median would be 1 of 1.2: most samples then count on by one, some by two.
        """
        counts, times = np.abs(np.diff(self.counts)), np.diff(self.times)
        each = times / np.maximum(counts, 0.5)
        turning = each < STANDS * np.median(each)
        return step * float(np.sum(counts[turning]) / np.sum(times[turning]))


def pulses_of(source: AngleSource, readings: Array, line: Timeline, indexed: bool, account: Account) -> Pulses:
    """The pulses in the readings of an encoder's column; indexed: whether an index sets the count right."""
    finite = np.isfinite(readings)
    bad = readings.size - int(np.count_nonzero(finite))
    if bad:
        what = f"{counted(bad, 'cell')} of '{source.column}' of {readings.size:,} are no number"
        account.warn(
            "data.counter.missing",
            "angle",
            f"{what}; the previous reading is used there",
            "check the counter and its cable",
        )
    if source.kind == "level":
        found = _edges(readings, line)
        if found.times.size > 2:
            found = _of_level(source, found, line, indexed, account)
    else:
        found = _of_count(source, readings[finite], line.seconds[finite], line.step, account.file)
    if indexed or found.times.size < 9:
        return found
    return _missed(found, line.step, 0.5 * (source.per_turn or 0), account)


def _of_count(source: AngleSource, readings: Array, seconds: Array, step: float, file: str) -> Pulses:
    """The rows where the count changes; the edge lies between two samples, its time is taken in the middle.

    From a to b it passes b if it counts on by one; if it jumps, half way the count is (a + b + 1)/2 in the mean.
    """
    if readings.size < 2:
        return Pulses(np.empty(0), np.empty(0), np.empty((0, 2)))
    counts = unwrapped(source, readings, seconds, file)
    at = np.flatnonzero(np.diff(counts) != 0)
    at = at[np.diff(seconds)[at] <= GAP * step]
    before, after = counts[at], counts[at + 1]
    return Pulses(0.5 * (seconds[at] + seconds[at + 1]), 0.5 * (before + after + 1.0), np.empty((0, 2)))


def _edges(readings: Array, line: Timeline) -> Pulses:
    """Rising edges of a level: it passes the middle, having been in the lower quarter since the last one."""
    held = _held(readings)
    if not held.size:
        return Pulses(np.empty(0), np.empty(0), np.empty((0, 2)))
    low, high = (float(one) for one in np.percentile(held, (0.1, 99.9)))
    low, high = (low, high) if high > low else (float(held.min()), float(held.max()))
    if high <= low:
        return Pulses(np.empty(0), np.empty(0), np.empty((0, 2)))
    state = np.zeros(held.size, dtype=np.int8)
    state[held > low + 0.6 * (high - low)] = 1
    state[held < low + 0.4 * (high - low)] = -1
    known = np.flatnonzero(state)
    rises = known[1:][(state[known[1:]] == 1) & (state[known[:-1]] == -1)]
    middle = low + 0.5 * (high - low)
    before, after = np.maximum(rises - 1, 0), rises
    share = np.clip(
        (middle - held[before]) / np.where(held[after] == held[before], 1.0, held[after] - held[before]), 0, 1
    )
    seconds = line.seconds[before] + share * (line.seconds[after] - line.seconds[before])
    between = np.count_nonzero(state == 0) > 0.02 * state.size
    return Pulses(seconds, np.arange(seconds.size, dtype=np.float64), np.empty((0, 2)), crossings=bool(between))


def _held(readings: Array) -> Array:
    """Readings with the one before where there is none."""
    finite = np.isfinite(readings)
    if finite.all() or not finite.any():
        return readings if finite.all() else np.empty(0)
    last = np.maximum.accumulate(np.where(finite, np.arange(readings.size), 0))
    first = int(np.argmax(finite))
    return np.asarray(np.where(np.arange(readings.size) < first, readings[first], readings[last]))


def _of_level(source: AngleSource, found: Pulses, line: Timeline, indexed: bool, account: Account) -> Pulses:
    """The pulses of a level with what the sampling makes of them."""
    usual = float(np.median(np.diff(found.times))) / line.step
    if usual < 2.5:
        what = f"a pulse of the encoder has {usual:.3g} samples: edges are missed"
        account.warn("data.pulses.few_samples", "angle", what, "sample at least 4 times a pulse, or record a count")
    inside = line.breaks[line.seconds[line.breaks] < found.times[-1]] if line.breaks.size else line.breaks
    if inside.size and not indexed:
        until = float(line.seconds[inside[0] - 1])
        what = f"no pulses are counted in gaps of time: the angle is not known after {until:.5g} s"
        account.warn(
            "data.pulses.gap",
            "angle",
            f"{what}; the turns from there on are left out",
            "record a count, or add an index",
        )
        return replace(found, until=until)
    return found


def _missed(found: Pulses, step: float, most: float, account: Account) -> Pulses:
    """Pulses that are missing or too many, told by the time between their neighbours; the count is set right.

    most: pulses in a row that are taken for lost; more, and the shaft stood.
    """
    between = np.diff(found.times)
    jumps = np.abs(np.diff(found.counts))
    each = between / np.maximum(jumps, 1.0)
    usual = median_filter(each, size=7, mode="nearest")
    if float(np.median(usual)) < TOLD_BY * step:
        return found
    calm = np.abs(median_filter(each, size=3, mode="nearest") / usual - 1) < 0.25
    single = jumps == 1
    lost = np.where(calm & single & (each > 1.6 * usual) & (each < most * usual), np.rint(each / usual) - 1, 0.0)
    pairs = np.zeros(each.size)
    short = (each[:-1] + each[1:] < 1.4 * usual[:-1]) & (each[:-1] + each[1:] > 0.6 * usual[:-1])
    pairs[1:][short & single[1:] & single[:-1]] = -1.0
    pairs[2:][(pairs[1:-1] < 0) & (pairs[2:] < 0)] = 0.0
    change = lost + pairs
    if not np.any(change):
        return found
    if np.count_nonzero(change) > 0.02 * each.size:  # the shaft itself runs unevenly
        return found
    at = found.times[:-1][change != 0]
    told = []
    if np.any(lost):
        told.append(f"{counted(int(lost.sum()), 'pulse')} lost")
    if np.any(pairs):
        told.append(f"{counted(int(-pairs.sum()), 'pulse')} too many")
    what = f"the encoder: {' and '.join(told)}, {times(at)}; the count is corrected, these turns are left out"
    account.warn("data.pulses.wrong", "angle", what, "check encoder, cable and counter")
    way = np.sign(found.counts[-1] - found.counts[0]) or 1.0
    mended = found.counts + way * np.concatenate([[0.0], np.cumsum(change)])
    return replace(found, counts=mended, spoilt=np.column_stack([at, found.times[1:][change != 0]]))


def index_times(readings: Array, line: Timeline, name: str, account: Account) -> Array:
    """Times of the pulses of an index."""
    found = _edges(line.rows(readings), line).times
    if found.size == 0:
        account.warn(
            "data.index.none", "angle.index", f"the column '{name}' has no pulse", "check the column, or remove index"
        )
    return found


def by_index(found: Pulses, index: Array, per_turn: int, step: float, account: Account) -> tuple[Array, Array]:
    """Counts from the first index pulse, set right at each; times of the turns in which pulses were lost.

    With few samples a pulse the count at an index is known to about one: then its median over nine turns is taken.
    """
    at = np.interp(index, found.times, found.counts)
    way = np.sign(at[-1] - at[0]) or 1.0
    _check_per_turn(np.diff(at) * way, per_turn, account)
    turns = np.concatenate([[0.0], np.cumsum(np.maximum(np.rint(np.diff(at) * way / per_turn), 1.0))])
    over = (at - at[0]) * way - per_turn * turns
    usual = float(np.angle(np.mean(np.exp(2j * np.pi * over)))) / (2 * np.pi)
    level = over - usual
    if found.slack(step) > 0.25 and level.size >= 9:
        level = median_filter(level, size=9, mode="nearest")
    level = np.rint(level)
    change = np.diff(level)
    wrong = change != 0
    if np.any(wrong):
        lost, more = -int(change[change < 0].sum()), int(change[change > 0].sum())
        told = [f"{counted(lost, 'pulse')} lost"] * (lost > 0) + [f"{counted(more, 'pulse')} too many"] * (more > 0)
        where = f"in {counted(int(np.count_nonzero(wrong)), 'turn')} of {change.size}, {times(index[:-1][wrong])}"
        what = f"the encoder: {' and '.join(told)} {where}; corrected at the index, these turns are left out"
        account.warn("data.pulses.wrong_index", "angle", what, "check encoder, cable and counter")
    place = np.clip(np.searchsorted(index, found.times, side="right") - 1, 0, index.size - 1)
    return found.counts - at[0] - way * usual - way * level[place], np.column_stack(
        [index[:-1][wrong], index[1:][wrong]]
    )


def _check_per_turn(between: Array, per_turn: int, account: Account) -> None:
    """Tell where most turns of the index have another number of pulses than is stated.

    between: counts from one index pulse to the next.
    """
    usual = float(np.median(between))
    alike = np.abs(between - usual) < max(1.5, 0.01 * abs(usual))
    if between.size < 2 or np.mean(alike) <= 0.5 or abs(usual - per_turn) < max(0.75, 0.01 * per_turn):
        return
    found = float(np.mean(between[alike]))
    what = f"from one index pulse to the next the encoder counts {found:.4g}, angle.per_turn is {per_turn:,}"
    account.warn(
        "data.pulses.per_turn", "angle.per_turn", what, f"state per_turn: {found:.0f}, if the index comes once a turn"
    )


def unwrapped(source: AngleSource, readings: Array, seconds: Array, file: str) -> Array:
    """A count that goes on where its counter is full; MechanismError for one that is set back otherwise.

    Full it is at `wrap`; if that is not stated, at a turn or at a power of 2 that all falls tell alike.
    """
    if source.wrap is not None:
        return np.unwrap(readings, period=float(source.wrap))
    steps = np.diff(readings)
    steps *= float(np.sign(np.sum(np.sign(steps)))) or 1.0
    usual = float(np.percentile(steps[steps > 0], 90)) if np.any(steps > 0) else 0.0
    least = min(max(WILD * usual, 1.0), 0.5 * (source.per_turn or np.inf), 0.5 * float(np.ptp(readings)))
    back = np.flatnonzero(steps < -least)
    if not back.size or np.ptp(readings) < 2:
        return readings
    apart = {full: np.abs(full + steps[back] - usual) for full in (source.per_turn or 0, *FULL)}
    full = min(apart, key=lambda full: float(apart[full].max()))
    if full and np.all(apart[full] <= usual + 1):
        return np.unwrap(readings, period=float(full))
    what = (
        f"the count of '{source.column}' is set back {counted(back.size, 'time')}, {times(seconds[back])}, first from "
    )
    what += f"{readings[back[0]]:,.0f} to {readings[back[0] + 1]:,.0f}"
    remedy = "state wrap: the count at which the counter returns to 0; or select a part by files: over:"
    raise MechanismError(Finding(what, "angle", remedy, file=file))

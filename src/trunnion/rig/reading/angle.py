"""Coordinate of the driver at every row: from a column, from time, from a speed, or from the pulses of an encoder.

Times or angles of pulses that are known to a sample are smoothed. At a steady speed sampling and pulses are easily in a
fixed ratio: the error of each pulse, up to half a sample, is then the same in every turn, and averaging over turns
leaves it. What lessens it is the shaft, which cannot follow such errors.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import convolve1d, median_filter, minimum_filter1d, uniform_filter1d

from trunnion.errors import Finding, MechanismError, counted
from trunnion.rig.reading.mapping import AngleSource
from trunnion.rig.reading.tables import DataTable
from trunnion.rig.reading.turns import GAP, TURN, Say, Timeline, at_times, joined, missing, unit_of

Array = NDArray[np.float64]
SPANS = (2.0, 1.0, 0.5, 0.25, 0.125, 0.0625)  # turns over which pulses are smoothed, the longest first
ORDER = 3
FEWEST = 5  # pulses in a span
BOUND = 1.1  # of what a pulse may be off: more shows that the shaft itself runs unevenly
EVEN = 1.1 / np.sqrt(3.0)  # the same of the root mean square, of errors spread evenly
STANDS = 3.0  # times the usual time of a count, from which the shaft stands or a pulse is lost
SET_BACK = 20.0  # times the largest usual step, by which a counter is set back
NOWHERE = np.empty((0, 2))


class Coordinate(NamedTuple):
    """Coordinate of the driver by row, rad, NaN where it is not known.

    spoilt: stretches of time, (stretch, 2), in which it is wrong; lag: standard uncertainty, s, of the time at which it
    passes a value, in the mean over many pulses; cut: standard uncertainty, rad with the sign of the readings, of what
    all are off by if they are cut off.
    """

    values: Array
    spoilt: Array = NOWHERE
    lag: float = 0.0
    cut: float = 0.0


def coordinate(source: AngleSource, table: DataTable, line: Timeline, say: Say) -> Coordinate:
    """The coordinate of the driver by its source."""
    index, column = np.empty(0), table.columns.get(source.column or "")
    if source.index is not None:
        index = _edges(line.rows(table.columns[source.index.column].values), line)
        if not index.size:
            what, remedy = f"the column '{source.index.column}' has no pulse", "check the column, or remove index"
            say(Finding.warning("data.index.none", "angle.index", what, remedy))
    if column is not None:
        readings = np.array(line.rows(column.values))
        say(missing("angle", column, readings, line.seconds))
    if source.from_ == "pulses":
        angle = _of_pulses(source, readings, line, index, say)
    elif column is not None:
        values = joined(readings * unit_of("angle", str(source.column), column, source.unit, "rad", say)[1])
        angle, finite = Coordinate(values), np.flatnonzero(np.isfinite(values))
        if source.resolution is not None and finite.size >= FEWEST:
            # read in steps, between them as the shaft turns, and cut off to them or not
            raw, seconds, step = values[finite], line.seconds[finite], source.resolution.value
            passed, lasted = np.abs(np.diff(raw)), np.diff(seconds)
            turning = passed / lasted > 0.1 * np.mean(passed / lasted)
            rate = float(np.sum(passed[turning]) / max(np.sum(lasted[turning]), 1e-300)) or 1.0
            refined, spans = smoothed(raw, 0.5 * step, TURN / (rate * line.step), seconds)
            values[finite] = refined
            lag = unresolved((raw - refined)[spans > 0], step) / rate
            angle = Coordinate(values, NOWHERE, lag, step / math.sqrt(12.0))
    else:
        assert source.speed is not None
        angle = Coordinate(source.speed.value * line.seconds)
        say(f"the angle is that of a constant speed of {source.speed.value:.6g} rad/s")
    values = source.sign * angle.values + source.zero.value
    return Coordinate(values, angle.spoilt, angle.lag, source.sign * angle.cut)


# ---- pulses ---------------------------------------------------------------------------------------------------


def _of_pulses(source: AngleSource, readings: Array, line: Timeline, index: Array, say: Say) -> Coordinate:
    """The angle between pulses by interpolation in time, counted anew from every index pulse."""
    assert source.per_turn is not None
    finite, spoilt, step, pitch = np.isfinite(readings), NOWHERE, line.step, TURN / source.per_turn
    when, counts = _counted(source, readings[finite], line.seconds[finite], step)
    if when.size < 2:
        what = f"the column '{source.column}' has {counted(when.size, 'pulse')}: there are no turns"
        raise MechanismError(Finding(what, "angle", "check that angle.column is the encoder's count"))
    # counts from one sample to the next while the shaft turns, in the mean: the median would be 1 of 1.2
    passed, lasted = np.abs(np.diff(counts)), np.diff(when)
    each = lasted / np.maximum(passed, 0.5)
    turning = each < STANDS * np.median(each)
    slack, times = step * float(np.sum(passed[turning]) / np.sum(lasted[turning])), when
    if index.size > 1:
        at = np.interp(index[[0, -1]], when, counts)
        index = seen_edges(index, float(np.abs(at[1] - at[0])) / source.per_turn, step)
        counts, spoilt = _by_index(when, counts, slack, index, source.per_turn, say)
    elif index.size == 1:
        counts = counts - np.interp(index[0], when, counts)
    angles = pitch * counts
    if slack < 1:  # a count for each event: its time is not known
        when, spans = smoothed(when, 0.5 * step, source.per_turn, counts)
        lag = unresolved((times - when)[spans > 0], step)
    else:  # an event for each sample: its count is not known
        raw = angles
        angles, spans = smoothed(raw, pitch * min(0.5 * slack, 0.5), source.per_turn / slack, when)
        lag = unresolved((raw - angles)[spans > 0], pitch) / pitch * step / slack
    say(f"the angle is interpolated between pulses {np.degrees(pitch):.4g} deg apart, and smoothed within a sample")
    return Coordinate(np.interp(line.seconds, when, angles, left=np.nan, right=np.nan), spoilt, lag)


def _counted(source: AngleSource, readings: Array, seconds: Array, step: float) -> tuple[Array, Array]:
    """Times at which counts were reached, (pulse,), each to a sample, and the counts: the rows where the count changes.

    The edge lies between two samples, its time is taken in the middle. From a to b it passes b if it counts on by one;
    if it jumps, half way the count is (a + b + 1)/2 in the mean. It goes on where its counter is full, at `wrap`;
    MechanismError for one that is set back otherwise.
    """
    if readings.size < 2:
        return np.empty(0), np.empty(0)
    counts = readings if source.wrap is None else np.unwrap(readings, period=float(source.wrap))
    steps = np.diff(counts)
    rising = steps * (float(np.sign(np.sum(np.sign(steps)))) or 1.0)
    usual = float(np.percentile(rising[rising > 0], 90)) if np.any(rising > 0) else 0.0
    least = min(max(SET_BACK * usual, 1.0), 0.5 * (source.per_turn or np.inf), 0.5 * float(np.ptp(counts)))
    back = np.flatnonzero(rising < -least)
    if source.wrap is None and back.size and np.ptp(counts) >= 2:
        what = f"the count of '{source.column}' is set back {counted(back.size, 'time')}, {at_times(seconds[back])}"
        raise MechanismError(Finding(what, "angle", "state wrap: the count at which the counter returns to 0"))
    at = np.flatnonzero(steps != 0)
    at = at[np.diff(seconds)[at] <= GAP * step]
    return 0.5 * (seconds[at] + seconds[at + 1]), 0.5 * (counts[at] + counts[at + 1] + 1.0)


def _edges(readings: Array, line: Timeline) -> Array:
    """Times, s, of the rising edges of a level: it passes the middle, having been in the lower two fifths before."""
    finite = np.isfinite(readings)
    levels = readings[np.maximum.accumulate(np.where(finite, np.arange(readings.size), int(np.argmax(finite))))]
    if not finite.any() or levels.min() == levels.max():
        return np.empty(0)
    low, high = (float(end) for end in np.percentile(levels, (0.1, 99.9)))
    low, high = (low, high) if high > low else (float(levels.min()), float(levels.max()))
    state = np.where(levels > low + 0.6 * (high - low), 1, np.where(levels < low + 0.4 * (high - low), -1, 0))
    sure = np.flatnonzero(state)
    after = sure[1:][(state[sure[1:]] == 1) & (state[sure[:-1]] == -1)]
    before = np.maximum(after - 1, 0)
    rise = np.where(levels[after] == levels[before], 1.0, levels[after] - levels[before])
    share = np.clip((low + 0.5 * (high - low) - levels[before]) / rise, 0, 1)
    return np.asarray(line.seconds[before] + share * (line.seconds[after] - line.seconds[before]))


def _by_index(times: Array, counts: Array, slack: float, index: Array, per_turn: int, say: Say) -> tuple[Array, Array]:
    """Counts from the first index pulse, set right at each; times of the turns in which pulses were lost.

    With few samples a pulse the count at an index is known to about one: then its median over nine turns is taken.
    """
    at = np.interp(index, times, counts)
    sense = np.sign(at[-1] - at[0]) or 1.0
    between = np.diff(at) * sense
    over = (at - at[0]) * sense - per_turn * np.cumsum([0.0, *np.maximum(np.rint(between / per_turn), 1.0)])
    fraction = float(np.angle(np.mean(np.exp(2j * np.pi * over)))) / (2 * np.pi)
    level = over - fraction
    if slack > 0.25 and level.size >= 9:
        level = median_filter(level, size=9, mode="nearest")
    level = np.rint(level)
    change = np.diff(level)
    wrong = change != 0
    if np.any(wrong):
        lost, more = -int(change[change < 0].sum()), int(change[change > 0].sum())
        what = f"the encoder: {counted(lost, 'pulse')} lost, {more:,} too many in "
        what += f"{counted(int(np.count_nonzero(wrong)), 'turn')} of {change.size}, {at_times(index[:-1][wrong])}; "
        what += f"corrected at the index, these turns are left out; usual are {np.median(between):.4g} a turn"
        say(Finding.warning("data.pulses.lost", "angle", what, "check encoder, cable and counter, and per_turn"))
    turn = np.clip(np.searchsorted(index, times, side="right") - 1, 0, index.size - 1)
    spoilt = np.column_stack([index[:-1][wrong], index[1:][wrong]])
    return counts - at[0] - sense * fraction - sense * level[turn], spoilt


def seen_edges(index: Array, turns: float, step: float) -> Array:
    """Rising edges of an index that is too narrow for the sampling to see it in every turn.

    index: taken in the middle between two samples; turns: from the first to the last of them. One that is seen in a
    share of the turns is as wide as that share of a sample, and rose at most so long before the sample that saw it.
    """
    share = min((index.size - 1) / max(turns, 1.0), 1.0)
    return index + 0.5 * step * (1.0 - share) if share < 0.95 else index


# ---- smoothing ------------------------------------------------------------------------------------------------


def smoothed(values: Array, off: float, per_turn: float, over: Array | None = None) -> tuple[Array, Array]:
    """Values at pulses by local cubics (Savitzky and Golay, doi:10.1021/ac60214a047), and the turns of each span.

    Each takes the longest span in which no value is farther from the cubic than it may be, and their root mean square
    is that of rounding; 0 where not even the shortest is so. values: times, s, of pulses one count apart, or angles,
    rad, of pulses one sample apart; off: by which each may be off; per_turn: pulses of a turn; over: counts of the
    times, or times of the angles, where some are more than one apart: smoothed is what is left of a line over them.
    """
    result, spans = values.copy(), np.zeros(values.size)
    if off <= 0:
        return result, spans
    over = np.arange(values.size, dtype=np.float64) if over is None else over
    trend = values[0] + (values[-1] - values[0]) * (over - over[0]) / (over[-1] - over[0])
    for span in SPANS:
        width = 2 * int(span * per_turn / 2) + 1
        if width < FEWEST or width > values.size:
            continue
        fitted = trend + local_polynomials(values - trend, width, ORDER)
        left = np.abs(values - fitted)
        even = np.sqrt(np.maximum(uniform_filter1d(left**2, width, mode="mirror"), 0.0)) <= EVEN * off
        good = minimum_filter1d(((left <= BOUND * off) & even).astype(np.int8), width, mode="mirror") > 0
        first = good & (spans == 0)
        result[first], spans[first] = fitted[first], span
    return result, spans


def local_polynomials(values: Array, width: int, order: int) -> Array:
    """Each value by the polynomial nearest to the `width` values around it; near the ends by that of the outermost.

    By hand: `scipy.signal` brings `scipy.stats`, and gives 0 for a width of some 10⁴ on. width: odd, above the order.
    """
    half = width // 2
    places = np.arange(-half, half + 1) / half  # of one size, so that no power is lost beside another
    middle = np.zeros(order + 1)
    middle[0] = 1.0  # the polynomial itself, not one of its derivatives
    weights = np.linalg.lstsq(places ** np.arange(order + 1)[:, None], middle, rcond=None)[0]
    smooth: Array = convolve1d(values, weights[::-1], mode="constant")
    for end, inside in ((slice(0, width), slice(0, half)), (slice(-width, None), slice(-half, None))):
        smooth[inside] = np.polyval(np.polyfit(np.arange(width), values[end], order), np.arange(width)[inside])
    return smooth


def unresolved(off: Array, step: float) -> float:
    """Standard uncertainty left in the mean of values rounded to a step, by what each was off the smooth ones.

    Where sampling and pulses are in step, these are off by few amounts only, and rounding shifts all by up to half of
    what lies between two of them: a rectangular distribution (GUM, JCGM 100:2008, 4.3.7).
    """
    if off.size < 2:
        return 0.0
    few = int(0.005 * off.size)
    inner = np.sort(off)[few : off.size - few]
    between = max(float(np.max(np.diff(inner), initial=0.0)), step - float(inner[-1] - inner[0]))
    return min(between, step) / math.sqrt(12.0)

"""Coordinate of the driver at every row: from a column, from time, from a speed, or from the pulses of an encoder.

Times or angles of pulses that are known to a sample are smoothed. At a steady speed sampling and pulses are easily in a
fixed ratio: the error of each pulse, up to half a sample, is then the same in every turn, and averaging over turns
leaves it. What lessens it is the shaft, which cannot follow such errors.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import minimum_filter1d, uniform_filter1d

from trunnion.errors import Finding, MechanismError
from trunnion.model.units import UnitError
from trunnion.rig.reading.channels import compare_units
from trunnion.rig.reading.columns import DataTable
from trunnion.rig.reading.local_polynomials import by_local_polynomials
from trunnion.rig.reading.log import Account, counted, times
from trunnion.rig.reading.mapping import AngleSource
from trunnion.rig.reading.pulses import by_index, index_times, pulses_of
from trunnion.rig.reading.sensor_quantity import alike, dimensions
from trunnion.rig.reading.timebase import Timeline

__all__ = ["Coordinate", "coordinate", "seen_edges", "smoothed", "unresolved"]

Array = NDArray[np.float64]
TURN = 2 * np.pi
JUMP = 8.0  # times the usual step, by which a cell is off its neighbours
SPANS = (2.0, 1.0, 0.5, 0.25, 0.125, 0.0625)  # turns over which it is tried, the longest first
ORDER = 3
FEWEST = 5  # pulses in a span
BOUND = 1.1  # of what a pulse may be off: more tells that the shaft itself runs unevenly
EVEN = 1.1 / np.sqrt(3.0)  # the same of the root mean square, of errors spread evenly


@dataclass(frozen=True)
class Coordinate:
    """Coordinate of the driver by row, rad, NaN where it is not known.

    spoilt: stretches of time, (stretch, 2), in which it is wrong; lag: standard uncertainty, s, of the time at which it
    passes a value, in the mean over many pulses; cut: standard uncertainty, rad with the sign of the readings, of what
    all are off by if they are cut off.
    """

    values: Array
    spoilt: Array
    lag: float = 0.0
    cut: float = 0.0


def coordinate(
    source: AngleSource, table: DataTable, line: Timeline, speed: Array | None, account: Account
) -> Coordinate:
    """The coordinate by its source; speed: that of the channel, rad/s, of a source `speed`."""
    zero = float(source.zero.evaluate())
    index = np.empty(0)
    if source.index is not None:
        index = index_times(table.columns[source.index.column].values, line, source.index.column, account)
    if source.from_ == "pulses":
        return _of_pulses(source, table, line, index, zero, account)
    if source.from_ == "column":
        values = _of_column(source, table, line, account)
    elif source.from_ == "time":
        assert source.speed is not None
        rate = float(source.speed.evaluate())
        values = rate * line.seconds
        account.say(f"the angle is that of a constant speed of {rate:.6g} rad/s")
    else:
        assert speed is not None
        values = _integrated(speed, line, account)
    values, lag, cut = _refined(source, values, line, account)
    values = source.sign * values
    if index.size > 1 and source.from_ in ("time", "speed"):
        values, spoilt = _tied(values, index, line, account)
    else:
        spoilt = np.empty((0, 2))
        _check_index(values, index, line, account)
    return Coordinate(values + zero, spoilt, lag, source.sign * cut)


def _refined(source: AngleSource, values: Array, line: Timeline, account: Account) -> tuple[Array, float, float]:
    """An angle that is read in steps, between them as the shaft turns; standard uncertainty, s, of what is left.

    And that, rad, of what all readings may be off by: rounded or cut off, up to half a step, rectangular.
    """
    known = np.flatnonzero(np.isfinite(values))
    if source.resolution is None or known.size < FEWEST:
        return values, 0.0, 0.0
    step = float(source.resolution.evaluate())
    raw, seconds = values[known], line.seconds[known]
    speeds = np.abs(np.diff(raw)) / np.diff(seconds)
    turning = speeds > 0.1 * np.mean(speeds)
    rate = float(np.sum(np.abs(np.diff(raw))[turning]) / max(np.sum(np.diff(seconds)[turning]), 1e-300)) or 1.0
    smooth, spans = smoothed(raw, 0.5 * step, TURN / (rate * line.step), seconds)
    refined = values.copy()
    refined[known] = smooth
    usual = float(np.median(spans))
    even = f"; it is smoothed over {_turns(usual)}, with which all readings agree" if usual > 0 else ""
    account.say(f"the angle is read in steps of {np.degrees(step):.4g} deg{even}")
    return refined, unresolved((raw - smooth)[spans > 0], step) / rate, step / math.sqrt(12.0)


def _of_column(source: AngleSource, table: DataTable, line: Timeline, account: Account) -> Array:
    column = table.columns[str(source.column)]
    unit = source.unit or column.unit
    if not unit:
        account.note(
            "data.angle.no_unit",
            "angle",
            f"the column '{source.column}' has no unit; rad is assumed",
            "state angle.unit",
        )
    try:
        factor, found = dimensions(unit or "rad")
    except UnitError as error:
        what, remedy = f"the column '{source.column}': {error.what}", "state angle.unit in the mapping, such as deg"
        remedy = f"{remedy}; in the file, {error.remedy}"
        raise MechanismError(Finding(what, "angle", remedy, file=account.file)) from None
    if not alike(found, dimensions("rad")[1]):
        what = f"the column '{source.column}' has the unit '{unit}', which is no angle"
        raise MechanismError(Finding(what, "angle", "name another column", file=account.file))
    if source.unit:
        compare_units("angle", str(source.column), source.unit, column, account)
    values = _without_jumps(source, line.rows(column.values) * factor, line, account)
    finite = np.flatnonzero(np.isfinite(values))
    if finite.size < values.size:
        what = f"{counted(values.size - finite.size, 'cell')} of '{source.column}' of {values.size:,} are no number"
        account.warn(
            "data.angle.missing", "angle", f"{what}; these rows are left out", "check the angle sensor and its cable"
        )
    if finite.size < 3:
        return np.full(values.size, np.nan)
    told = np.unwrap(values[finite])
    steps = np.abs(np.diff(told))
    moving = steps[steps > 0]
    if moving.size and np.median(moving) > TURN / 4:
        what = (
            f"a turn has {TURN / float(np.median(moving)):.3g} samples: the direction of rotation cannot be determined"
        )
        account.warn("data.angle.few_samples", "angle", what, "sample at least 8 times a turn")
    values[finite] = told
    return values


def _without_jumps(source: AngleSource, values: Array, line: Timeline, account: Account) -> Array:
    """The angle without single cells that are far off both neighbours, which are close to each other."""
    if values.size < 9:
        return values
    steps = np.abs(np.angle(np.exp(1j * np.diff(values))))
    over = np.abs(np.angle(np.exp(1j * (values[2:] - values[:-2]))))
    usual = float(np.nanmedian(steps)) if np.isfinite(steps).any() else 0.0
    far = max(JUMP * usual, np.radians(5.0))
    out = 1 + np.flatnonzero((steps[:-1] > far) & (steps[1:] > far) & (over < far / 2))
    if not out.size or out.size > 0.1 * values.size:
        return values
    zeros = " zero" if np.all(values[out] == 0) else ""
    what = (
        f"{counted(out.size, 'cell')} of '{source.column}' of {values.size:,}{zeros} far off the ones before and after"
    )
    account.warn(
        "data.angle.wild",
        "angle",
        f"{what}, {times(line.seconds[out])}; left out",
        "check the angle sensor and its cable",
    )
    mended = values.copy()
    mended[out] = np.nan
    return mended


def _integrated(speed: Array, line: Timeline, account: Account) -> Array:
    """The integral of a speed, from the first row; where it is missing it is interpolated."""
    finite = np.isfinite(speed)
    if np.count_nonzero(finite) < 2:
        return np.full(speed.size, np.nan)
    bridged = speed if finite.all() else np.interp(line.seconds, line.seconds[finite], speed[finite])
    steps = 0.5 * (bridged[1:] + bridged[:-1]) * np.diff(line.seconds)
    account.say("the angle is the integral of the speed from the first row; its zero creeps with the sensor's error")
    return np.concatenate([[0.0], np.cumsum(steps)])


def _tied(values: Array, index: Array, line: Timeline, account: Account) -> tuple[Array, Array]:
    """An angle stretched between the pulses of an index so that these are a turn apart; not known beyond them."""
    at = np.interp(index, line.seconds, values)
    way = np.sign(at[-1] - at[0]) or 1.0
    turns = np.rint(np.diff(at) / TURN * way)
    spoilt = np.column_stack([index[:-1], index[1:]])[turns != 1]
    if spoilt.size:
        told = counted(len(spoilt), "interval")
        what = f"{told} of the index, {times(spoilt[:, 0])}, are not one turn of the angle; left out"
        account.warn("data.index.not_one_turn", "angle.index", what, "check index pulse and speed")
    exact = way * TURN * np.concatenate([[0.0], np.cumsum(np.maximum(turns, 1))])
    account.say("the angle is tied to the index pulse once a turn")
    inside = (line.seconds >= index[0]) & (line.seconds <= index[-1])
    rising = np.interp(values * way, at * way, exact * way) * way
    return np.where(inside, rising, np.nan), spoilt


def _check_index(values: Array, index: Array, line: Timeline, account: Account) -> None:
    """Tell where the index of an angle that needs none is out of place."""
    if index.size < 2:
        return
    at = np.interp(index, line.seconds, np.where(np.isfinite(values), values, np.nan))
    usual = float(np.nanmedian(np.abs(np.diff(at)))) / TURN if np.isfinite(np.diff(at)).any() else 1.0
    if abs(usual - 1) > 0.5:
        what = f"from one index pulse to the next the angle advances {usual:.3g} turns"
        account.warn(
            "data.index.turns",
            "angle.index",
            what,
            "check the unit of the angle, and whether both turn with the driver",
        )
    offsets = np.angle(np.exp(1j * (at - at[0])))
    far = np.flatnonzero(np.abs(offsets) > np.radians(5.0))
    if far.size:
        what = f"{counted(far.size, 'index pulse')} of {index.size} more than 5 deg off the first, {times(index[far])}"
        account.warn("data.index.off", "angle.index", what, "check the angle sensor: it slips, or its readings jump")


def _of_pulses(
    source: AngleSource, table: DataTable, line: Timeline, index: Array, zero: float, account: Account
) -> Coordinate:
    """The angle between pulses by interpolation in time, counted anew from every index pulse."""
    assert source.per_turn is not None
    readings = line.rows(table.columns[str(source.column)].values)
    found = pulses_of(source, readings, line, index.size > 1, account)
    if found.times.size < 2:
        raise MechanismError(
            Finding(
                f"the column '{source.column}' has {counted(found.times.size, 'pulse')}: there are no turns", "angle",
                "check that angle.column is the encoder's, and angle.kind", file=account.file,
            )
        )  # fmt: skip
    counts, spoilt = found.counts, found.spoilt
    if index.size > 1:
        at = np.interp(index[[0, -1]], found.times, counts)
        index = seen_edges(index, float(np.abs(at[1] - at[0])) / source.per_turn, line.step)
        counts, lost = by_index(found, index, source.per_turn, line.step, account)
        spoilt = np.concatenate([spoilt, lost])
    elif index.size == 1:
        counts = counts - np.interp(index[0], found.times, counts)
    turned = source.sign * TURN / source.per_turn * counts
    pulse = 360.0 / source.per_turn
    blur = pulse * min(0.5 * found.slack(line.step), 0.5)
    when, spans, lag = found.times, np.zeros(0), 0.0
    if not found.crossings and found.slack(line.step) < 1:  # a count for each event: its time is not known
        when, spans = smoothed(when, 0.5 * line.step, source.per_turn, counts)
        lag = unresolved((found.times - when)[spans > 0], line.step)
    elif not found.crossings:  # an event for each sample: its count is not known
        raw = turned
        turned, spans = smoothed(raw, float(np.radians(blur)), source.per_turn / found.slack(line.step), found.times)
        per_pulse = line.step / found.slack(line.step)
        lag = unresolved((raw - turned)[spans > 0], float(np.radians(pulse))) / np.radians(pulse) * per_pulse
    values = np.interp(line.seconds, when, turned, left=np.nan, right=np.nan)
    if found.until is not None:
        values[line.seconds > found.until] = np.nan
    known = "" if found.crossings else ", each known to ± {} deg by the sampling"
    usual = float(np.median(spans)) if spans.size else 0.0
    even = f"; it is smoothed over {_turns(usual)}, with which all pulses agree" if usual > 0 else ""
    account.say(
        f"the angle is interpolated between pulses {pulse:.4g} deg apart{known}{even}",
        None if found.crossings else blur,
    )
    return Coordinate(values + zero, spoilt, lag)


def smoothed(values: Array, off: float, per_turn: float, over: Array | None = None) -> tuple[Array, Array]:
    """Values at pulses by local cubics (Savitzky and Golay, doi:10.1021/ac60214a047), and the turns of each span.

    values: times, s, of pulses one count apart, or angles, rad, of pulses one sample apart; off: by which each may be
    off, as uniformly as rounding; per_turn: pulses of a turn; over: counts of the times, or times of the angles, where
    some are more than one apart, as near one count a sample: the values are smoothed less a straight line over them.
    Each takes the longest span in which no value is farther from the cubic than it may be, and their root mean square
    is that of rounding; none, 0, where not even the shortest is so.
    """
    found, spans = values.copy(), np.zeros(values.size)
    if off <= 0:
        return found, spans
    over = np.arange(values.size, dtype=np.float64) if over is None else over
    trend = values[0] + (values[-1] - values[0]) * (over - over[0]) / (over[-1] - over[0])
    for span in SPANS:
        width = 2 * int(span * per_turn / 2) + 1
        if width < FEWEST or width > values.size:
            continue
        fitted = trend + by_local_polynomials(values - trend, width, ORDER)
        left = np.abs(values - fitted)
        even = np.sqrt(np.maximum(uniform_filter1d(left**2, width, mode="mirror"), 0.0)) <= EVEN * off
        good = minimum_filter1d(((left <= BOUND * off) & even).astype(np.int8), width, mode="mirror") > 0
        taken = good & (spans == 0)
        found[taken], spans[taken] = fitted[taken], span
    return found, spans


def _turns(number: float) -> str:
    return f"{number:.3g} turn{'s' * (number != 1)}"


def unresolved(off: Array, step: float) -> float:
    """Standard uncertainty left in the mean of values rounded to a step, by what each was off the smooth ones.

    Where sampling and pulses are in step, these are off by few amounts only, and rounding shifts all by up to half of
    what lies between two of them: a rectangular distribution (GUM, JCGM 100:2008, 4.3.7).
    """
    if off.size < 2:
        return 0.0
    few = int(0.005 * off.size)
    told = np.sort(off)[few : off.size - few]
    between = max(float(np.max(np.diff(told), initial=0.0)), step - float(told[-1] - told[0]))
    return min(between, step) / math.sqrt(12.0)


def seen_edges(index: Array, turns: float, step: float) -> Array:
    """Rising edges of an index that is too narrow for the sampling to see it in every turn.

    index: taken in the middle between two samples; turns: from the first to the last of them. One that is seen in a
    share of the turns is as wide as that share of a sample, and rose at most so long before the sample that saw it.
    """
    share = min((index.size - 1) / max(turns, 1.0), 1.0)
    return index + 0.5 * step * (1.0 - share) if share < 0.95 else index

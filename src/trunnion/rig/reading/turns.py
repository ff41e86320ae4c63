"""Time of every row and what is wrong with it; the turns, and the values of channels at their positions.

With four samples or more a position, a value is the mean of the samples within half a position to either side, moved
to the position along the slope there; with fewer it is interpolated by a cubic through the four samples around it.

Of readings rounded to steps q, with noise σ before, the mean is off by a wave over the steps, whose harmonic k has the
amplitude q/(πk) exp(−2π²k²σ²/q²) (Widrow and Kollár 2008, doi:10.1017/CBO9780511754661). It repeats where turns are
sampled at the same places of a step: averaging over turns leaves it.
"""

from __future__ import annotations

import re
import warnings
from collections.abc import Callable, Iterable, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from trunnion.errors import Finding, MechanismError, counted
from trunnion.model.units import UnitError, normalise
from trunnion.rig.reading.mapping import TimeBase
from trunnion.rig.reading.tables import Column, DataTable
from trunnion.rig.reading.units import alike, dimensions

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
Say = Callable[[Finding | str | None], None]  # takes a finding, or a sentence about what was done
GAP = 1.5  # times the usual step
COUNTED = 2.0**53  # steps from the first row to the last, beyond which a float is no count
UNEVEN = 0.2  # of the usual step, standard deviation
_PER_MINUTE = re.compile(r"1\s*/\s*[Mm]in|[Mm]in\^?-1")  # in a heading; in a model file it may be turns or radians
TURN = 2 * np.pi
DENSE = 4.0  # samples a position from which they are averaged
STANDING = 0.2  # of the usual speed, below which the drive is taken to stand
JUMP = 8.0  # times what nine in ten samples, and those beside, rise by: noise and curves stay below it
APART = 0.5  # of the usual length of a turn, by which one may differ from it
ALIKE = 0.9  # of 1, from which every turn is sampled at the same places
HARMONICS = 10  # of the wave, that are looked at
PLACES = 8  # of the first sample of a turn, between two
_K = np.arange(1.0, 200.0)
_NOISE = np.linspace(0.0, 1.0, 1001)  # σ/q


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
        left_out = f"{counted(seconds.size - rising.size, 'row')} of {seconds.size:,} left out"
        what = f"{left_out}: {np.sum(~finite):,} have no time, of the others it does not rise, "
        what += at_times(highest[finite & ~rises])
        if back.any():
            what += f"; it runs backward {counted(int(back.sum()), 'time')} by up to {-np.diff(clock).min():.4g} s"
        say(Finding.warning("data.time.backward", "time", what, "check the logger's clock, or split the file"))
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
        say(Finding.warning("data.time.gaps", "time", what, "check the logger's buffer"))
    return Timeline(clean, rising, step, float(np.std(steps[~wide] / step)) < UNEVEN, clock[:-1][back])


def unit_of(where: str, name: str, column: Column, in_mapping: str | None, usual: str, say: Say) -> tuple[str, float]:
    """Unit of a column, and its factor to SI: the mapping's, else the file's, else the usual one.

    where: the entry of the mapping that has the key `unit`. A speed of rotation in 1/min is one in rpm.
    """
    in_file = "rpm" if usual == "rad/s" and _PER_MINUTE.fullmatch(normalise(column.unit).strip()) else column.unit
    unit = in_mapping or in_file or usual
    if usual and not (in_mapping or in_file):
        what = f"the column '{name}' has no unit; SI is assumed ({usual})"
        say(Finding.note("data.unit.none", where, what, f"state {where}.unit"))
    try:
        factor, kind = dimensions(unit) if unit else (1.0, {})
    except UnitError as error:
        remedy = f"state {where}.unit in the mapping; in the file, {error.remedy}"
        raise MechanismError(Finding(f"the column '{name}': {error.what}", where, remedy)) from None
    if where in ("time", "angle") and not alike(kind, dimensions(usual)[1]):
        what = f"the column '{name}' has the unit '{unit}', which is no {where}"
        raise MechanismError(Finding(what, where, "name another column"))
    with suppress(UnitError):
        size, of_file = dimensions(in_file) if in_mapping and in_file else (factor, kind)
        if not (alike(of_file, kind) and np.isclose(size, factor, rtol=1e-12, atol=0)):
            what = f"the file has the unit '{in_file}' for '{name}', the mapping '{in_mapping}', which is taken"
            say(Finding.warning("data.unit.differs", where, what, f"correct {where}.unit, or remove it"))
    return unit, factor


# ---- findings about data, and places in time -------------------------------------------------------------------


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


def missing(where: str, column: Column, readings: Array, seconds: Array) -> Finding | None:
    """Cells without a number, which all become NaN: infinite ones too."""
    readings[np.isinf(readings)] = np.nan
    mask = np.isnan(readings)
    example = f" ({counted(column.texts, 'text')} such as '{column.example}')" if column.texts else ""
    what, remedy = lost(f"dropouts{example}", mask, seconds, "cell"), "check sensor, cable and logger"
    return Finding.warning("data.readings.missing", where, what, remedy) if mask.any() else None


# ---- turns ----------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Turns:
    """Whole turns of a file.

    share: (row,), the cycle counted on, rising, whole at the start of each; numbers: of the turns; begin, end: their
    times, s; rows: those that belong to them; positions: how many a turn; line: time of the rows.
    """

    share: Array
    numbers: NDArray[np.intp]
    begin: Array
    end: Array
    rows: Mask
    positions: int
    line: Timeline

    @property
    def density(self) -> float:
        """Samples a position."""
        return float(np.mean(self.end - self.begin)) / (self.line.step * self.positions) if self.numbers.size else 0.0

    @property
    def rising(self) -> NDArray[np.intp]:
        """Rows that are farther in the cycle than all before."""
        highest = np.maximum.accumulate(np.where(np.isfinite(self.share), self.share, -np.inf))
        return np.flatnonzero(self.share > np.concatenate([[-np.inf], highest[:-1]]))


def cut(share: Array, line: Timeline, allowed: Mask, positions: int, spoilt: Array, say: Say) -> Turns:
    """Find the whole turns of a file.

    share: cycles gone through, rising with time, NaN where not known, (row,); line: time of the rows; allowed: rows
    that may be used; positions: of a turn; spoilt: stretches of time to leave out, (stretch, 2); say: takes findings
    about turns that are left out.
    """
    # every turn that is gone through from its start to its end, but for one sample
    none = np.empty(0)
    begin, end, numbers = none, none, np.empty(0, dtype=np.intp)
    highest = np.maximum.accumulate(np.where(np.isfinite(share), share, -np.inf))
    first, last = int(np.argmax(np.isfinite(highest))), int(np.searchsorted(highest, highest[-1]))  # then it stands
    rising, seconds = highest[first : last + 1], line.seconds[first : last + 1]
    steps = np.diff(rising)
    step = float(np.median(steps[steps > 0])) if np.any(steps > 0) else 0.0
    slack = 1.01 * step if np.isfinite(step) else 0.0
    low, high = (int(np.ceil(rising[0] - slack)), int(np.floor(rising[-1] + slack))) if step else (0, 0)
    if rising.size >= 3 and 1 <= high - low <= rising.size:
        edges = np.arange(low, high + 1)
        after = np.clip(np.searchsorted(rising, edges, side="right"), 1, rising.size - 1)
        gain = rising[after] - rising[after - 1]
        part = np.clip((edges - rising[after - 1]) / np.where(gain > 0, gain, 1.0), -1.01, 2.01)
        crossed = seconds[after - 1] + part * (seconds[after] - seconds[after - 1])
        begin, end, numbers = crossed[:-1], crossed[1:], edges[:-1]
    refused = np.concatenate([[0], np.cumsum(~allowed)])
    begins, ends = (np.searchsorted(line.seconds, edge) for edge in (begin + 0.5 * line.step, end - 0.5 * line.step))
    inside = allowed.all() | ((refused[np.maximum(ends, begins)] == refused[begins]) & (ends > begins))
    begin, end, numbers = begin[inside], end[inside], numbers[inside]
    lengths, usual = end - begin, float(np.median(end - begin)) if numbers.size else 1.0
    odd = np.abs(lengths / usual - 1) > APART
    if odd.any():
        left_out = int(np.sum(np.maximum(np.rint(lengths[odd] / usual), 1)))  # over a gap it may be several
        span = f"{lengths[odd].min():.4g} to {lengths[odd].max():.4g} s"
        what = f"{counted(left_out, 'turn')} left out, {at_times(begin[odd])}: {span} long where {usual:.4g} s is usual"
        remedy = "the drive starts, stops or rests there, or rows are missing"
        say(Finding.note("data.turns.unusual", "turns", what, remedy))
    good = ~odd
    for start, stop in spoilt:
        slack = min(line.step, 0.25 * (stop - start))  # an index may lie where a turn begins
        good &= (begin > stop - slack) | (end < start + slack)
    begin, end = begin[good], end[good]
    rows = np.zeros(share.size, dtype=np.bool_)
    if begin.size:  # rows within turns, half a position before and after included, that move
        usual = float(np.median(end - begin))
        margin, wide = 0.5 * usual / positions + line.step, max(int(usual / line.step / 100), 1)
        level = np.zeros(share.size + 1, dtype=np.int64)
        np.add.at(level, np.searchsorted(line.seconds, begin - margin), 1)
        np.add.at(level, np.searchsorted(line.seconds, end + margin, side="right"), -1)
        speed, lasts = np.full(share.size, np.inf), line.seconds[2 * wide :] - line.seconds[: -2 * wide]
        speed[wide:-wide] = (share[2 * wide :] - share[: -2 * wide]) / lasts
        rows = (np.cumsum(level[:-1]) > 0) & np.isfinite(share) & allowed & ~(speed < STANDING / usual)
    return Turns(share, numbers[good], begin, end, rows, positions, line)


def joined(angle: Array) -> Array:
    """An angle by row, rad, without the jumps of readings that begin anew after a turn; NaN stay."""
    finite, without = np.isfinite(angle), angle.copy()
    without[finite] = np.unwrap(angle[finite])
    return without


def resampled(turns: Turns, channel: Array, angle: Array | None = None) -> Array:
    """Values of a channel, which has one a row of the file, as (turn, position); NaN where no sample has one.

    angle: readings of a channel that is an angle, rad, before they were `joined`. Every turn is given as many whole
    turns at a position as these have in the fullest one.
    """
    if not turns.numbers.size:
        return np.empty((0, turns.positions))
    course = _averaged(turns, channel) if turns.density >= DENSE else _interpolated(turns, channel)
    if angle is None or not np.isfinite(course).any():
        return course
    raw, first = resampled(turns, angle), int(np.argmax(np.count_nonzero(np.isfinite(course), axis=1)))
    at = np.flatnonzero(np.isfinite(course[first]))
    near = np.interp(np.arange(course.shape[1]), at, course[first, at])
    off = float(np.nan_to_num(np.nanmedian(raw[first, at] - near[at])))
    near += TURN * np.round(off / TURN)
    return np.asarray(course - TURN * np.nan_to_num(np.round((course - near) / TURN)))


def _averaged(turns: Turns, values: Array) -> Array:
    """Means of the samples about each position, moved to it along the slope between its neighbours."""
    rows = turns.rows & np.isfinite(values)
    scaled = turns.share[rows] * turns.positions
    place = np.floor(scaled + 0.5)
    size = int(turns.numbers[-1] - turns.numbers[0] + 1) * turns.positions
    number = place.astype(np.int64) - int(turns.numbers[0]) * turns.positions
    inside = (number >= 0) & (number < size)
    number, off, sample = number[inside], (scaled - place)[inside], values[rows][inside]
    count = np.bincount(number, minlength=size).astype(np.float64)
    with np.errstate(invalid="ignore", divide="ignore"):
        mean = np.bincount(number, weights=sample, minlength=size) / count
        centre = np.bincount(number, weights=off, minlength=size) / count
    rise = np.diff(mean) / np.maximum(1.0 + np.diff(centre), 0.5)
    sides = np.stack([np.append(rise, np.nan), np.insert(rise, 0, np.nan)])
    finite = np.isfinite(sides)
    slope = np.where(finite, sides, 0.0).sum(axis=0) / np.maximum(finite.sum(axis=0), 1)
    return np.asarray((mean - slope * centre).reshape(-1, turns.positions)[turns.numbers - turns.numbers[0]])


def _interpolated(turns: Turns, values: Array) -> Array:
    """A cubic through the four samples about a position; a straight line between two where one of them is missing, or
    where they jump, beside which a cubic would overshoot."""
    rows, step = turns.rising, turns.line.step
    if rows.size < 2:
        return np.full((turns.numbers.size, turns.positions), np.nan)
    x, y, seconds = turns.share[rows], values[rows], turns.line.seconds[rows]
    at = (turns.numbers[:, None] + np.arange(turns.positions) / turns.positions).ravel()
    after = np.clip(np.searchsorted(x, at, side="right"), 1, x.size - 1)
    part = (at - x[after - 1]) / (x[after] - x[after - 1])
    course = y[after - 1] + part * (y[after] - y[after - 1])
    four = np.clip(after[:, None] + np.arange(-2, 2), 0, x.size - 1)
    apart = np.diff(seconds[four], axis=1)
    smooth = np.isfinite(y[four]).all(axis=1) & ((apart > 0) & (apart < 3 * step)).all(axis=1)
    rises = np.nan_to_num(np.abs(np.diff(y, append=y[-1])))
    if (rises > 0).any():  # a flank of a narrow peak rises as fast beside, too
        largest = np.maximum(np.maximum(np.roll(rises, 1), np.roll(rises, -1)), np.percentile(rises[rises > 0], 90))
        smooth &= ~(rises > JUMP * largest)[four[:, :-1]].any(axis=1)
    near, by_cubic = x[four[smooth]], np.zeros(int(np.count_nonzero(smooth)))
    for i in range(4):  # Lagrange's form
        factors = [(at[smooth] - near[:, j]) / (near[:, i] - near[:, j]) for j in range(4) if j != i]
        by_cubic += np.prod(factors, axis=0) * y[four[smooth]][:, i]
    course[smooth] = by_cubic
    far = np.abs(part - np.clip(part, 0, 1)) > 1.01  # no sample past it: up to one step is extrapolated
    usual = max(1.0, float(np.rint(np.median(np.diff(seconds)) / step)))
    course[far | (seconds[after] - seconds[after - 1] > GAP * step * usual)] = np.nan
    return np.asarray(course.reshape(-1, turns.positions))


def turn_means(course: Array) -> Array:
    """Mean of each turn over the positions that most turns have, (turn,); NaN where one lacks many of them."""
    finite = np.isfinite(course)
    count = finite.sum(axis=0)
    usual = np.where(finite, course, 0.0).sum(axis=0) / np.maximum(count, 1)
    level = float(usual[count > 0].mean()) if np.any(count) else np.nan
    left = np.where(finite, course - usual, 0.0).sum(axis=1) / np.maximum(finite.sum(axis=1), 1)
    return np.where(finite.mean(axis=1) > 0.5, level + left, np.nan)


def time_mean(turns: Turns, course: Array) -> float:
    """Mean of a course over the time of the turns, each position by how long it took; NaN if it has no value.

    The mean over the positions is that over the angle: of a speed that varies within the turn it is too high.
    """
    rows = turns.rising
    edges = turns.numbers[:, None] + (np.arange(turns.positions + 1) - 0.5) / turns.positions
    dwell = np.diff(np.interp(edges, turns.share[rows], turns.line.seconds[rows]), axis=1)
    finite = np.isfinite(course)
    total = float(np.sum(dwell, where=finite))
    return float(np.sum(dwell * course, where=finite)) / total if total > 0 else float("nan")


# ---- the error by steps that all turns repeat, in steps ------------------------------------------------------------


@dataclass(frozen=True)
class LeftOfSteps:
    """What all turns repeat of the error by steps.

    share: its standard deviation, of step/√12; noise: σ, in steps; samples: of a turn; every: whether every turn is
    sampled at the same places.
    """

    share: float
    noise: float
    samples: float
    every: bool


def left_in_turns(turns: Turns, course: Array, readings: Array, noise: float) -> LeftOfSteps:
    """How much of the error by steps is the same in all turns.

    course: (turn, position); readings: one a row of the file; both in steps; noise: scatter of the readings from row to
    row, in steps, with the error by steps in it unless the course stays within one.
    """
    share, samples = in_step(turns, course), float(np.median(turns.end - turns.begin)) / turns.line.step
    every = share > ALIKE
    if every:  # then what a reading differs by from that a turn later is noise
        rows = np.where(turns.rows, readings, np.nan)
        later = max(round(samples), 1)  # the next row, where a turn is shorter than half a row
        apart = rows[later:] - rows[:-later]
        apart = apart[np.isfinite(apart)]
        noise = noise_before(float(np.sqrt(np.mean(apart**2) / 2))) if apart.size else 0.0
    else:
        noise = float(np.sqrt(max(noise**2 - 1 / 12, 0.0)))
    return LeftOfSteps(float(np.sqrt(share * left_of_steps(noise))), noise, samples, every)


def left_of_steps(noise: Array | float) -> Array:
    """Mean square of the wave, of q²/12, for noise in steps: 1 without, 0 of half a step and more."""
    waves = np.exp(-4 * (np.pi * np.asarray(noise)[..., None] * _K) ** 2) / _K**2
    return np.asarray(np.sum(waves, axis=-1) / np.sum(1 / _K**2))


def noise_before(scatter: float) -> float:
    """σ/q of readings that scatter so much, in steps, where they repeat: scatter² = σ² + (1 − left)/12."""
    return float(np.interp(scatter, np.sqrt(_NOISE**2 + (1 - left_of_steps(_NOISE)) / 12), _NOISE))


def in_step(turns: Turns, course: Array) -> float:
    """How far turns are sampled at the same places of a step, 0 to 1; course: (turn, position), in steps.

    At a position the samples next to it are off it by a part of a position, and along the slope of the course by a part
    of a step: |mean of exp(2πi part)|², less what chance makes of n turns.
    """
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)  # of positions without a value
        mean = np.nan_to_num(np.nanmean(course, axis=0))
    slope = 0.5 * (np.roll(mean, -1) - np.roll(mean, 1))
    scaled = turns.share[turns.rows] * turns.positions
    place = np.floor(scaled + 0.5)
    off = scaled - place
    order = np.lexsort((np.abs(off), place))
    nearest = order[np.diff(place[order], prepend=-np.inf) > 0]
    at = place[nearest].astype(np.int64) % turns.positions
    angle = 2 * np.pi * slope[at] * off[nearest]
    count = np.bincount(at, minlength=turns.positions)
    many = count > 1
    if not many.any():
        return 1.0
    parts = (np.bincount(at, component, count.size) for component in (np.cos(angle), np.sin(angle)))
    alike = (sum(part[many] ** 2 for part in parts) / count[many] - 1) / (count[many] - 1)
    return float(np.clip(np.mean(alike), 0.0, 1.0))


def covariance_of_steps(columns: Array, course: Array, left: LeftOfSteps) -> Array:
    """Covariance of sums over positions of columns · error by steps, in units of the step.

    columns: (sum, position); course: true, (position,), in steps. Where the course gains about a whole number of steps
    from sample to sample, as it may beside its steepest places, the errors of many samples are alike. The mean is taken
    over all places in a step, for each harmonic of the wave by itself, and some of the first sample in a turn.
    """
    size, count, grid = course.size, round(left.samples), np.arange(course.size)
    powers = np.exp(-4 * (np.pi * left.noise * _K[:HARMONICS]) ** 2) / (_K[:HARMONICS] * np.pi) ** 2 / 2
    total = np.zeros((len(columns), len(columns)))
    for first in (np.arange(PLACES) + 0.5) / PLACES:
        place = (np.arange(-2, count + 2) + first) / left.samples * size
        at = np.interp(place, np.arange(size), course, period=size)
        for k, power in enumerate(powers, 1):
            wave = np.exp(2j * np.pi * k * at)
            if left.samples < DENSE * size:
                error = np.interp(grid, place, wave)
            else:
                part = np.round(place).astype(np.int64) % grid.size
                error = np.bincount(part, wave.real, grid.size) + 1j * np.bincount(part, wave.imag, grid.size)
                error = error / np.bincount(part, minlength=grid.size)
            moved = columns @ error
            total += power / PLACES * np.real(np.outer(moved, moved.conj()))
    return total

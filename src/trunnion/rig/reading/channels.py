"""From readings to quantities: unit and gain, zero with its uncertainty, the zero-phase filter, steps and noise."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from math import comb

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import median_filter

from trunnion.errors import Finding, MechanismError
from trunnion.model.units import UnitError
from trunnion.rig.reading.mapping import Channel, Filter, Zero
from trunnion.rig.reading.tables import Column
from trunnion.rig.reading.timebase import Timeline, at_times, counted, note, places, runs, warning
from trunnion.rig.reading.turns import Turns, turn_means
from trunnion.rig.reading.units import HERTZ, OTHER_COLUMN, Amount, SensorScale, alike, default_unit, dimensions, scale

__all__ = [
    "LOOKED_AT", "ChannelReading", "Drift", "Zeroed", "check_filter", "clipped", "common_drift", "faults",
    "filtered", "mean_uncertainty", "missing", "noise_of", "outliers", "reading", "resolution", "signs", "speeds",
    "steady", "unit_differs", "zeroed",
]  # fmt: skip

Array = NDArray[np.float64]
Say = Callable[[Finding | str], None]  # takes a finding, or a sentence about what was done
LOOKED_AT = 50_000  # readings of which the step is told
LARGEST = 1e100  # SI units that a reading of 1 may mean
FEWEST_LEVELS = 3  # of readings in all files of a channel, from which they show the step of a converter
LEVELS = 8  # from which they show it though some are left out, or the last decimal
DECIMALS = 10  # looked for
EXACT = 1e9  # below which a float tells whole numbers from others to 1e-6
LONGEST = 10.0  # periods of the cut-off, over which a line bridges a gap for the filter


@dataclass(frozen=True)
class Zeroed:
    """Zero of a channel and its uncertainty, in readings. since: when it was that, s; NaN of one that was stated."""

    value: float
    uncertainty: float = 0.0
    since: float = float("nan")


@dataclass(frozen=True)
class ChannelReading:
    """A channel's scale, and its limits in readings. resolution: step that is stated, in readings, 0 if none is."""

    scale: SensorScale
    unit: str
    limit: float | None
    accuracy_zero: float
    accuracy_gain: float
    resolution: float = 0.0

    def quantity(self, readings: Array, zero: Zeroed, sign: int) -> Array:
        """What the readings measure, SI."""
        return sign * self.scale.factor * (readings - zero.value)

    def datum(self, zero: Zero | Amount, value: float, sign: int) -> float:
        """What is measured where the sensor reads 0, if a zero is stated in the unit of the quantity; else 0.

        A zero in other units, as 4 mA, is what the sensor gives of nothing.
        """
        if not isinstance(zero, Amount) or (
            (zero.plain or alike(zero.dimensions, self.scale.of_reading)) and not self.scale.direct
        ):
            return 0.0
        return -value * sign * self.scale.factor

    @property
    def read_in(self) -> tuple[str, float]:
        """The unit of readings that are what is measured itself, and its factor to SI; empty of volts and the like."""
        return (self.unit, self.scale.raw) if self.unit and self.scale.direct else ("", 1.0)

    @property
    def shown(self) -> tuple[str, float]:
        """Unit in which figures of a channel are shown, and its size in SI."""
        return self.read_in if self.read_in[1] != 1 else (self.scale.unit, 1.0)


def reading(name: str, channel: Channel, column: Column, say: Say) -> ChannelReading:
    """The unit of a channel's readings: the mapping's, else the file's, else that of what it measures in SI."""
    where, unit = f"channels.{name}", channel.unit or column.unit
    if channel.unit and (finding := unit_differs(where, channel.column, channel.unit, column)):
        say(finding)
    if not channel.unit and column.unit:
        say(f"unit of {name} from the file: {unit}")
    if not unit and (channel.gain is None or channel.gain.plain):
        unit = default_unit(channel.measures)
        what = f"has no unit in the mapping or the file; SI is assumed ({unit or '1'})"
        say(note("unit.none", where, what, f"state {where}.unit"))
    try:
        sensor = scale(channel.measures, unit, channel.gain, channel.column)
        if not LARGEST > abs(sensor.factor) > 1 / LARGEST:
            what = f"a reading of 1 is {sensor.factor:.3g} {sensor.unit}, which no sensor has"
            raise MechanismError(Finding(what, f"{where}.gain", "check unit and gain"))
        limit = sensor.reading(channel.range, "range") if channel.range else None
        zero = abs(sensor.factor) * sensor.reading(channel.accuracy.zero, "accuracy.zero")
        step = sensor.reading(channel.resolution, "resolution") if channel.resolution else 0.0
        return ChannelReading(sensor, unit, limit, zero, float(channel.accuracy.gain.evaluate()), step)
    except UnitError as error:
        remedy = error.remedy
        if not channel.unit and column.unit and not remedy.startswith(OTHER_COLUMN):  # no logger's file is written anew
            remedy = f"state {where}.unit in the mapping; in the file, {remedy}"
        raise MechanismError(Finding(error.what, where, remedy)) from None


def unit_differs(where: str, name: str, unit: str, column: Column) -> Finding | None:
    """The file states another unit of a column than the mapping."""
    stated = dimensions(unit)
    try:
        of_file = dimensions(column.unit) if column.unit else stated
    except UnitError:
        return None
    turns = of_file[1] == HERTZ and stated[1] == dimensions("rad/s")[1]  # 1/min where the mapping has to say rpm
    if turns and np.isclose(stated[0] / of_file[0], (1, 2 * np.pi)).any():
        return None
    if alike(of_file[1], stated[1]) and of_file[0] == stated[0]:
        return None
    what = f"the file has the unit '{column.unit}' for '{name}', the mapping '{unit}', which is taken"
    if alike(of_file[1], stated[1]):
        what = f"{what}: all values are {stated[0] / of_file[0]:.3g} times those of the file"
    return warning("unit.differs", where, what, f"correct {where}.unit, or remove it")


# ---- zero -----------------------------------------------------------------------------------------------------


def zeroed(name: str, channel: Channel, sensor: ChannelReading, readings: Array, line: Timeline, say: Say) -> Zeroed:
    """The zero of a channel: a value, or the mean over its unloaded stretches, uncertain by how they differ, too."""
    if isinstance(channel.zero, Amount):
        return Zeroed(sensor.scale.reading(channel.zero, "zero"))
    where, times, parts = f"channels.{name}.zero", [], []
    for begin, end in channel.zero.over:
        low, high = np.searchsorted(line.seconds, (begin.value, end.value))
        finite = np.isfinite(readings[low:high])
        part, when = readings[low:high][finite], line.seconds[low:high][finite]
        if (spikes := outliers(part)).any():
            what = f"spikes: {counted(int(spikes.sum()), 'reading')} of {part.size:,} in the unloaded stretch, "
            what += f"{at_times(when[spikes])}; left out"
            say(warning("readings.spikes", where, what, "check shielding"))
            part, when = part[~spikes], when[~spikes]
        if not part.size:
            span, ends = f"{begin.value:g} to {end.value:g} s", f"{line.seconds[0]:g} to {line.seconds[-1]:g} s"
            what = f"there are no readings from {span}; the file runs from {ends}"
            remedy = "state a stretch in which the sensor is not loaded"
            raise MechanismError(Finding(what, where, remedy, code="data.zero.no_readings"))
        times.append(when)
        parts.append(part)
    means = [float(np.mean(part)) for part in parts]
    within = mean_uncertainty(np.concatenate([part - mean for part, mean in zip(parts, means, strict=True)]))
    say(f"zero of {name}: mean over the unloaded stretch")
    error = float(np.hypot(within, np.ptp(means) / 12**0.5))  # between them rectangular, GUM 4.3.7
    return Zeroed(float(np.mean(np.concatenate(parts))), error, float(np.mean(np.concatenate(times))))


def mean_uncertainty(samples: Array) -> float:
    """Standard uncertainty of the mean of samples that depend on their neighbours: s √((1 + 2 Σ ρ)/n).

    The sum of the autocorrelations ρ ends where two successive ones add up to less than zero (Geyer's initial positive
    sequence, doi:10.1214/ss/1177011137).
    """
    n = samples.size
    off = samples - np.mean(samples)
    variance = float(np.mean(off**2))
    if n < 4 or variance <= 0:
        return 0.0
    size = 1 << (2 * n - 1).bit_length()
    spectrum = np.fft.rfft(off, size)
    correlation = np.fft.irfft(spectrum * np.conj(spectrum), size)[: n // 2] / (n * variance)
    pairs = correlation[: 2 * (correlation.size // 2)].reshape(-1, 2).sum(axis=1)
    ends = np.flatnonzero(pairs <= 0)
    total = 2 * float(pairs[: ends[0] if ends.size else pairs.size].sum()) - 1
    return float(np.sqrt(variance * max(total, 1.0) / (n - 1)))


# ---- filter ---------------------------------------------------------------------------------------------------


def check_filter(low_pass: Filter, line: Timeline, say: Say) -> None:
    """Say what the filter is; MechanismError where the samples are too far apart for it."""
    cut_off, rate = low_pass.cut_off.value, 1.0 / line.step
    if 2 * cut_off >= rate:
        what = f"the sampling is too slow for the filter: {rate:.6g} Hz, a cut-off of {cut_off:g} Hz"
        remedy = f"state a cut-off below {rate / 2:.4g} Hz, or sample faster"
        raise MechanismError(Finding(what, "filter.cut_off", remedy))
    if not line.even:
        what = "the samples are not evenly spaced in time, as a filter needs them"
        say(warning("filter.uneven", "filter", what, "record at a fixed rate, or leave out the filter"))
    passes = f"order {low_pass.order}, forward and backward, together 3 dB down at {cut_off:g} Hz"
    say(f"low-pass filter: Butterworth of {passes}; gaps are bridged by a line for it")


def filtered(values: Array, line: Timeline, low_pass: Filter) -> Array:
    """A Butterworth low-pass forward and backward, 3 dB down at the cut-off after both.

    Gaps are bridged by a straight line, long ones by a short one, and are gaps again afterwards.
    """
    from scipy.signal import butter, sosfiltfilt  # brings scipy.stats: longer to import than all the rest

    finite, rate, cut_off = np.isfinite(values), 1.0 / line.step, low_pass.cut_off.value
    if not finite.any():
        return values
    longest = int(LONGEST * rate / cut_off)
    steps = np.clip(np.rint(np.diff(line.seconds) / line.step), 1, longest).astype(np.int64)
    place = np.concatenate([[0], np.cumsum(steps)])
    bridged = np.interp(np.arange(place[-1] + 1), place[finite], values[finite])
    # both passes together are 3 dB down at the cut-off if each is where |H|² = 1/√2
    edge = np.tan(np.pi * cut_off / rate) / (np.sqrt(2.0) - 1.0) ** (1.0 / (2 * low_pass.order))
    sections = butter(low_pass.order, min(2 / np.pi * np.arctan(edge), 1 - 1e-9), output="sos")
    pad = min(bridged.size - 1, max(3 * (2 * len(sections) + 1), int(rate / cut_off)))
    try:
        return np.where(finite, sosfiltfilt(sections, bridged, padlen=pad)[place], np.nan)
    except np.linalg.LinAlgError:
        what = f"order {low_pass.order} at {cut_off:g} Hz of {rate:.4g} Hz cannot be computed"
        raise MechanismError(Finding(what, "filter", "lower the order")) from None


# ---- steps and noise ------------------------------------------------------------------------------------------


def resolution(readings: Array) -> float:
    """Step of which all readings of a channel are multiples, in readings; 0 where there is none.

    The least distance between two levels, if it is one, else the last decimal. Of few levels, of which not most are one
    step apart, it is none: a signal that is switched has no steps.
    """
    levels = np.unique(readings[np.isfinite(readings)])
    if levels.size < FEWEST_LEVELS:
        return 0.0
    apart = np.diff(levels)
    apart = apart[apart > 1e-9 * float(np.ptp(np.percentile(levels, (1, 99))))]
    step = float(apart.min())
    multiples = np.rint(apart / step)
    few = levels.size < LEVELS
    if np.all(np.abs(apart / step - multiples) < 0.01) and not (few and np.mean(multiples == 1) <= 0.5):
        return step
    for k in range(DECIMALS * (not few)):
        scaled = levels * 10.0**k
        if np.max(np.abs(scaled)) < EXACT and np.all(np.abs(scaled - np.rint(scaled)) < 1e-6):
            return float(10.0**-k)
    return 0.0


def noise_of(readings: Array) -> float:
    """Standard deviation of what is white in readings: the least that differences of first to third order show.

    The mean of |Δᵏ| of normal deviates is σ √(2/π) √C(2k, k). A course makes the lower orders larger, noise none.
    """
    part = readings[np.isfinite(readings)][:LOOKED_AT]
    if part.size <= 3:
        return 0.0
    return float(min(np.mean(np.abs(np.diff(part, k))) / np.sqrt(2 / np.pi * comb(2 * k, k)) for k in (1, 2, 3)))


# ---- checks ----------------------------------------------------------------------------------------------------

Mask = NDArray[np.bool_]
CLIP = 0.9995  # of the range, from which a reading is at it: the top code of 12 bits is 2047/2048
MOST = 0.5  # of the readings at the end of the range: more is no load that is now and then too large
STUCK = 30  # equal readings in a row at least
WIDTH = 7  # samples of the median that spikes are told from: up to three in a row are found
FAR = 12.0  # robust standard deviations from it
SEEN = 0.1  # of the span from the 1st to the 99th percentile, that a spike exceeds
CHANCE = 0.005  # that a fault comes as near as that to the place of another
FEW = 4  # turns from which what comes back in them can be told from faults
STEADY = 0.03  # of the mean speed, between the slowest and the fastest turn
CERTAIN = 6.0  # standard errors from which a slope is one
PLAIN, SHARE = 3.0, 0.002  # times what turns scatter about the line, and share of the channel, that a drift comes to
NEARLY_ALL = 0.95  # of the turns, in which a power has the wrong sign if the channel has it
APART = 0.03  # of a mean speed, between the angle and the channel that reads it


# ---- readings -------------------------------------------------------------------------------------------------


def missing(where: str, column: Column, readings: Array, seconds: Array) -> Finding | None:
    """Cells without a number, which all become NaN: infinite ones too."""
    readings[np.isinf(readings)] = np.nan
    mask = np.isnan(readings)
    if not mask.any():
        return None
    example = f" ({counted(column.texts, 'text')} such as '{column.example}')" if column.texts else ""
    what = f"dropouts: {counted(int(mask.sum()), 'cell')} of {readings.size:,} without a number{example}"
    return warning("readings.missing", where, f"{what}, {places(mask, seconds)}; left out", "check cable and logger")


def clipped(where: str, readings: Array, limit: float, unit: str, seconds: Array) -> Finding | None:
    """Readings at the end of the range or beyond, which become NaN; an error where most of the channel is."""
    rows = np.abs(readings) >= CLIP * limit
    count, finite = int(np.count_nonzero(rows)), int(np.count_nonzero(np.isfinite(readings)))
    if not count:
        return None
    what = f"clipped: {counted(count, 'reading')} of {finite:,} at or beyond the end of the range of {limit:.6g} "
    what += unit or "in the unit of the readings"
    if count > MOST * finite:  # what is left says nothing of the channel
        remedy = "check column, unit, gain and range of the channel in the mapping; else use a larger range"
        figures = {"count": count, "readings": finite}
        raise MechanismError(Finding(what, where, remedy, code="data.readings.clipped", figures=figures))
    what = f"{what}, {places(rows, seconds)}; left out, so that means there are too small"
    readings[rows] = np.nan
    return warning("readings.clipped", where, what, "use a larger range or a smaller load")


def outliers(readings: Array) -> Mask:
    """Single readings, none of them NaN, that are far off the median of those around them, beyond any doubt."""
    off = np.abs(readings - median_filter(readings, size=WIDTH, mode="mirror"))
    return np.asarray(off > FAR * float(np.percentile(off, 99))) if readings.size > WIDTH else off > np.inf


def faults(
    where: str, readings: Array, seconds: Array, turns: tuple[Array, Array], beside: int, moves: bool = True
) -> Iterator[Finding]:
    """Stuck readings and spikes while the drive runs, which become NaN; what comes back in the turns is the signal's.

    Parameters
    ----------
    where, readings, seconds : channel, its readings and their times.
    turns : when they begin and end, s; with fewer than `FEW` nothing tells a fault from the signal.
    beside : rows before and after the turns that reach into them, by interpolation or a filter.
    moves : whether the readings are to change.
    """
    begin, end = turns
    running = slice(int(np.searchsorted(seconds, begin[0])), int(np.searchsorted(seconds, end[-1], "right")))
    finite = readings[running][np.isfinite(readings[running])]
    if finite.size < 10:
        return
    if finite.min() == finite.max():
        what = f"reads {finite[0]:.6g} in every one of {finite.size:,} rows"
        remedy = "check that the sensor is connected and the column the right one"
        yield (warning if moves else note)("readings.constant", where, what, remedy)
        return
    if begin.size < FEW:
        return
    rare, wide = 0.5 * begin.size, max(float(np.subtract(*np.percentile(finite, (99, 1)))), 1e-300)
    stuck = _stuck(readings[running])
    if 0 < (times := runs(stuck)[0].size) < rare:
        what = f"stuck: the reading does not change for {counted(int(stuck.sum()) + times, 'sample')}, "
        what += f"{places(stuck, seconds[running])}; left out"
        readings[running][stuck] = np.nan
        yield warning("readings.stuck", where, what, "check sensor and logger")
    near = slice(max(running.start - beside, 0), running.stop + beside)
    far, off = _spikes(readings[near], wide)
    often = runs(far)[0].size >= rare
    far[np.flatnonzero(far)[_returning(seconds[near][far], begin, end)]] = False
    if far.any() and not often:
        what = (
            f"spikes: {counted(int(far.sum()), 'reading')} of {finite.size:,} up to {off[far].max() / wide:.2g} times "
        )
        what += f"the usual span off their neighbours, {places(far, seconds[near])}; left out"
        readings[near][far] = np.nan
        yield warning("readings.spikes", where, what, "check shielding and earth")


def _returning(time: Array, begin: Array, end: Array) -> Mask:
    """What another turn has in the same place: of places at random 0.5 % lie so near to the next."""
    turn = np.clip(np.searchsorted(begin, time, side="right") - 1, 0, begin.size - 1)
    phase = ((time - begin[turn]) / (end - begin)[turn]) % 1.0
    order, returns = np.argsort(phase), np.zeros(time.size, dtype=np.bool_)
    after = np.roll(order, -1)
    near = ((phase[after] - phase[order]) % 1.0 < CHANCE / max(time.size, 1)) & (turn[after] != turn[order])
    returns[order[near]] = returns[after[near]] = True
    return returns


def _stuck(part: Array) -> Mask:
    """The same reading in a row ten times as long as nearly all others stay; none where that is most of it."""
    starts, lengths = runs(np.concatenate([np.diff(part) == 0, [False]]))
    stuck = np.zeros(part.size, dtype=np.bool_)
    single = part.size - int(np.sum(lengths + 1))
    stays = np.sort(np.concatenate([lengths + 1, np.ones(min(single, 10 * lengths.size), dtype=np.intp)]))
    usual = float(stays[int(0.99 * (stays.size - 1))]) if stays.size else 0.0
    long = lengths + 1 > max(STUCK, 10 * usual if usual < 0.1 * part.size else STUCK)
    for begin, length in zip(starts[long], lengths[long], strict=True):
        stuck[begin + 1 : begin + length + 1] = True
    return stuck if stuck.sum() <= 0.5 * part.size else np.zeros_like(stuck)


def _spikes(part: Array, wide: float) -> tuple[Mask, Array]:
    """One to three readings far from the median of those around them, and how far; wide: what the readings span."""
    finite, far, distance = np.isfinite(part), np.zeros(part.size, dtype=np.bool_), np.zeros(part.size)
    if np.count_nonzero(finite) >= 2 * WIDTH:
        off, ends = (np.abs(part[finite] - median_filter(part[finite], size=WIDTH, mode=mode))
                     for mode in ("nearest", "mirror"))  # fmt: skip
        distance[finite] = off = np.where(ends > wide, np.maximum(off, ends), off)  # else a slope at an end
        far[finite] = off > max(FAR * 1.4826 * np.median(off), 2.5 * np.percentile(off, 99), SEEN * wide)
    return far, distance


# ---- turns ----------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Drift:
    """A zero that creeps: slope and its standard error, SI a second, and what it amounts to over the turns.

    span: from the middle of the first turn to that of the last, over which the change is.
    """

    slope: float
    error: float
    change: float
    scatter: float
    span: float


def common_drift(parts: Sequence[tuple[Turns, Array]]) -> Drift | None:
    """The slope that the means of turns have in common in all conditions of a file, where it is plain; else None."""
    times, means, middles, largest = [], [], [], 0.0
    for turns, course in parts:
        mean, middle = turn_means(course), 0.5 * (turns.begin + turns.end)
        finite = np.isfinite(mean)
        if np.count_nonzero(finite) >= 3:
            times.append(middle[finite] - middle[finite].mean())
            means.append(mean[finite] - mean[finite].mean())
            middles.append(middle[finite])
            largest = max(largest, float(np.nanmax(np.abs(course))))
    if not times:
        return None
    t, y = np.concatenate(times), np.concatenate(means)
    free, square = t.size - len(times) - 1, float(np.sum(t**2))
    if free < 4 or square == 0:
        return None
    slope = float(np.sum(t * y)) / square
    scatter = float(np.sqrt(np.sum((y - slope * t) ** 2) / free))
    error, span = scatter / np.sqrt(square), float(np.ptp(np.concatenate(middles)))
    change = slope * span
    if change == 0 or abs(slope) < CERTAIN * error or abs(change) < max(PLAIN * scatter, SHARE * largest):
        return None
    return Drift(slope, error, change, scatter, span)


def steady(turns: Turns, step: float, where: str) -> Finding | None:
    """Turns that are not equally fast, by more than the sampling can tell."""
    lengths = turns.end - turns.begin
    spread = float(np.ptp(1 / lengths)) / float(np.mean(1 / lengths)) if lengths.size > 1 else 0.0
    if spread <= STEADY + 2 * step / float(np.mean(lengths)):
        return None
    slow, fast = 60 / float(lengths.max()), 60 / float(lengths.min())
    what = f"the speed is not steady: {slow:.4g} to {fast:.4g} cycles a minute, {100 * spread:.3g} % between turns"
    remedy = "state files: over: to use the steady part, or improve the speed control"
    return warning("speed.unsteady", where, what, remedy)


def _subjects(channels: Mapping[str, Channel], kind: str) -> dict[str, str]:
    """Channels that measure something of a kind, by what it is of."""
    split = {key: one.measures.partition(":") for key, one in channels.items()}
    return {subject: key for key, (head, _, subject) in split.items() if head == kind}


def signs(
    channels: Mapping[str, Channel], courses: Mapping[str, Array], zeros: Mapping[str, float], turning: float
) -> Iterator[Finding]:
    """Channels that are likely to have the wrong sign: power in, or power out, below zero in all turns of a file.

    Parameters
    ----------
    channels : of the mapping.
    courses : turns of all conditions.
    zeros : standard uncertainty of the zero of each channel, SI, within which the mean of a power shows no sign.
    turning : mean speed of the driver by its angle, rad/s with its sign.
    """
    rates, drivers, loads = (_subjects(channels, kind) for kind in ("rate", "effort", "load"))
    gives = False
    for driver, effort in drivers.items():
        rate = rates.get(driver)
        if rate is None and len(drivers) > 1:
            continue
        against = courses[rate] if rate else np.full_like(courses[effort], turning)
        power, below = _power(courses[effort], against, zeros[effort])
        gives = gives or bool(below or (power.size and np.mean(power > 0) > NEARLY_ALL))
        opposed = rate is not None and len(drivers) == 1 and float(np.nanmean(courses[rate])) * turning < 0
        if below and not opposed:  # else the speed is at fault, see `speeds`
            what = f"sign: the power into {driver} is negative in {below} ({power.mean():.4g} W): the sign of {effort} "
            what += "is wrong, unless the load drives the motor"
            other = "" if rate else "; or sign: in angle:, if that runs backwards"
            yield warning("power.sign", f"channels.{effort}", what, f"write sign: {-channels[effort].sign}{other}")
    free = [key for joint, key in rates.items() if joint not in drivers]
    for load, key in loads.items():
        rate = rates.get(load) or (free[0] if len(free) == 1 else None)
        if rate is None or not gives:
            continue
        power, below = _power(courses[key], courses[rate], zeros[key])
        if below:
            what = f"sign: the power delivered to {load} is negative in {below} ({power.mean():.4g} W) while the drive "
            remedy = f"write sign: {-channels[key].sign} (or turn that of {rate})"
            yield warning("power.sign", f"channels.{key}", f"{what}delivers power", remedy)


def _power(effort: Array, rate: Array, zero: float) -> tuple[Array, str]:
    """Means of a power by turn, and in how many turns it is below zero, in words, if that is in nearly all of them and
    by more than an error of the zero may make it."""
    power = turn_means(effort * rate)
    power = power[np.isfinite(power)]
    below = int(np.count_nonzero(power < 0))
    if below <= NEARLY_ALL * power.size or abs(np.mean(power)) <= 2 * abs(float(np.nanmean(zero * rate))):
        return power, ""
    turns = counted(power.size, "turn")
    return power, f"all {turns}" if below == power.size else f"{below:,} of {turns}"


def speeds(
    channels: Mapping[str, Channel],
    courses: Mapping[str, Array],
    units: Mapping[str, tuple[str, float]],
    turning: float,
) -> Finding | None:
    """An angle that turns at another mean speed than the channel of its driver reads, or the other way.

    units: in which the figures of each channel are shown, with their size in SI; turning: mean speed by the angle,
    rad/s with its sign.
    """
    drivers = _subjects(channels, "effort")
    rate = _subjects(channels, "rate").get(next(iter(drivers), ""))
    if len(drivers) != 1 or rate is None or not turning:
        return None
    known = courses[rate][np.isfinite(courses[rate])]
    if not known.any():
        return None
    # over equal angles the mean of a speed in time is the harmonic one
    one_way = np.all(known > 0) or np.all(known < 0)
    speed = float(1 / np.mean(1 / known)) if one_way else float(np.mean(known))
    ratio = turning / speed if speed else np.inf
    if abs(ratio - 1) <= APART:
        return None
    (unit, size), where = units[rate], f"channels.{rate}"
    what = f"the angle turns at {turning / size:.4g} {unit}, '{rate}' reads {speed / size:.4g} {unit}"
    if abs(ratio + 1) <= APART:
        return warning("rate.sign", where, f"sign: {what}", f"write sign: {-channels[rate].sign}, or turn angle.sign")
    remedy = "check unit and gain of the channel, and per_turn or unit of angle"
    return warning("rate.ratio", where, f"{what}, {ratio:.4g} times", remedy)

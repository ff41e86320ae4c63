"""From readings to quantities: unit and gain, zero with its uncertainty, filter, steps and noise, faults."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from math import comb

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import median_filter

from trunnion.errors import Finding, MechanismError, Severity
from trunnion.model.units import UnitError
from trunnion.rig.reading.mapping import Channel, Filter, Zero
from trunnion.rig.reading.measurement import Signal
from trunnion.rig.reading.tables import Column
from trunnion.rig.reading.turns import Say, Timeline, Turns, counted, lost, note, runs, turn_means, unit_of, warning
from trunnion.rig.reading.units import SensorScale, alike, default_unit

__all__ = [
    "LOOKED_AT", "WIDTH", "Sensor", "drift", "faults", "filtered", "mean_uncertainty", "missing", "noise_of",
    "resolution", "sensor_of", "signs", "spikes",
]  # fmt: skip

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
LOOKED_AT = 50_000  # readings that noise and steps are told by
LARGEST = 1e100  # SI units that a reading of 1 may mean
LONGEST = 10.0  # periods of the cut-off, over which a line bridges a gap for the filter
CLIP = 0.9995  # of the range, from which a reading is at it: the top code of 12 bits is 2047/2048
MOST = 0.5  # of the readings at the end of the range: more is no load that is now and then too large
STUCK = 30  # equal readings in a row at least
WIDTH = 7  # samples of the median that spikes are told from: up to three in a row are found
FAR = 12.0  # robust standard deviations from it
SEEN = 0.1  # of the span from the 1st to the 99th percentile, that a spike exceeds
CHANCE = 0.005  # that a fault comes as near as that to the place of another
FEW = 4  # turns from which what comes back in them can be told from faults
CERTAIN = 6.0  # standard errors from which a slope is one
PLAIN, SHARE = 3.0, 0.002  # times what turns scatter about the line, and share of the channel, that a drift comes to
NEARLY_ALL = 0.95  # of the turns, in which a power has the wrong sign if the channel has it
APART = 0.03  # of a mean speed, between the angle and the channel that reads it


@dataclass(frozen=True)
class Sensor:
    """The sensor of a channel in one file: what its readings are, and what is uncertain in them.

    unit: of the readings; step, zero, zero_uncertainty: in readings; since: when the zero was read, s, NaN of one that
    is stated; datum: what is measured where the sensor reads 0, if a zero is stated in the unit of the quantity; else
    0: a zero in other units, as 4 mA, is what the sensor gives of nothing.
    """

    channel: Channel
    scale: SensorScale
    unit: str
    step: float
    zero: float
    zero_uncertainty: float
    since: float
    datum: float

    def quantity(self, readings: Array) -> Array:
        """What the readings measure, SI."""
        return self.channel.sign * self.scale.factor * (readings - self.zero)


def sensor_of(name: str, channel: Channel, column: Column, values: Array, line: Timeline, say: Say) -> Sensor:
    """The sensor of a channel: its unit, else the file's, else that of what it measures in SI; its zero.

    values: readings, (row,). What is no number or at the end of the range becomes NaN in them.
    """
    where, zero = f"channels.{name}", channel.zero
    usual = default_unit(channel.measures) if channel.gain is None or channel.gain.plain else ""
    unit, _ = unit_of(where, channel.column, column, channel.unit, usual, say)
    if not channel.unit and column.unit:
        say(f"unit of {name} from the file: {unit}")
    try:
        scale = channel.scale(unit)
    except UnitError as error:
        raise MechanismError(Finding(error.what, where, error.remedy)) from None
    if not LARGEST > abs(scale.factor) > 1 / LARGEST:
        what = f"a reading of 1 is {scale.factor:.3g} {scale.unit}, which no sensor has"
        raise MechanismError(Finding(what, f"{where}.gain", "check unit and gain"))
    say(missing(where, column, values, line.seconds))
    if channel.range is not None:
        limit = scale.reading(channel.range, "range")
        rows, readings = np.abs(values) >= CLIP * limit, int(np.count_nonzero(np.isfinite(values)))
        if count := int(np.count_nonzero(rows)):
            what = lost(f"clipped at the end of the range of {limit:.6g} {unit} or beyond", rows, line.seconds)
            remedy = "use a larger range or a smaller load, or correct column, unit, gain and range in the mapping"
            finding = warning("readings.clipped", where, what, remedy)
            finding = replace(finding, figures={"count": count, "readings": readings})
            if count > MOST * readings:  # the rest says nothing of the channel
                raise MechanismError(replace(finding, severity=Severity.ERROR))
            values[rows] = np.nan
            say(finding)
    step = scale.reading(channel.resolution, "resolution") if channel.resolution else 0.0
    if isinstance(zero, Zero):
        say(f"zero of {name}: mean over the unloaded stretch")
        return Sensor(channel, scale, unit, step, *_unloaded(where, zero, values, line, say), 0.0)
    reading = scale.reading(zero, "zero")
    of_quantity = scale.direct or not (zero.plain or alike(zero.dimensions, scale.of_reading))
    datum = -reading * channel.sign * scale.factor if of_quantity else 0.0
    return Sensor(channel, scale, unit, step, reading, 0.0, np.nan, datum)


def _unloaded(where: str, zero: Zero, values: Array, line: Timeline, say: Say) -> tuple[float, float, float]:
    """The mean over unloaded stretches, its uncertainty, by how they differ too, and the mean of their time."""
    times, parts = [], []
    for begin, end in zero.over:
        rows = slice(*np.searchsorted(line.seconds, (begin.value, end.value)))
        far = spikes(values[rows])
        good = np.isfinite(values[rows]) & ~far
        if not good.any():
            what = f"there are no readings from {begin.value:g} to {end.value:g} s; the file runs from "
            what += f"{line.seconds[0]:g} to {line.seconds[-1]:g} s"
            remedy = "state a stretch in which the sensor is not loaded"
            raise MechanismError(Finding(what, f"{where}.zero", remedy, code="data.zero.no_readings"))
        if far.any():
            say(warning("readings.spikes", f"{where}.zero", lost("spikes", far, line.seconds[rows]), "check shielding"))
        times.append(line.seconds[rows][good])
        parts.append(values[rows][good])
    means = [float(np.mean(part)) for part in parts]
    within = mean_uncertainty(np.concatenate([part - mean for part, mean in zip(parts, means, strict=True)]))
    error = float(np.hypot(within, np.ptp(means) / 12**0.5))  # between them rectangular, GUM 4.3.7
    return float(np.mean(np.concatenate(parts))), error, float(np.mean(np.concatenate(times)))


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


def filtered(values: Array, line: Timeline, low_pass: Filter) -> Array:
    """A Butterworth low-pass forward and backward, 3 dB down at the cut-off after both.

    Gaps are bridged by a straight line, long ones by a short one, and are gaps again afterwards. MechanismError where
    the samples are too far apart for it.
    """
    from scipy.signal import butter, sosfiltfilt  # brings scipy.stats: longer to import than all the rest

    finite, rate, cut_off = np.isfinite(values), 1.0 / line.step, low_pass.cut_off.value
    if 2 * cut_off >= rate:
        what = f"the sampling is too slow for the filter: {rate:.6g} Hz, a cut-off of {cut_off:g} Hz"
        remedy = f"state a cut-off below {rate / 2:.4g} Hz, or sample faster"
        raise MechanismError(Finding(what, "filter.cut_off", remedy))
    if not finite.any():
        return values
    steps = np.clip(np.rint(np.diff(line.seconds) / line.step), 1, int(LONGEST * rate / cut_off)).astype(np.int64)
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

    The least distance between two levels, if it is one, else the last decimal of up to ten. Levels below eight, of
    which not most are one step apart, have none: a signal that is switched has no steps.
    """
    levels = np.unique(readings[np.isfinite(readings)])
    if levels.size < 3:
        return 0.0
    few, apart = levels.size < 8, np.diff(levels)
    apart = apart[apart > 1e-9 * float(np.ptp(np.percentile(levels, (1, 99))))]
    step = float(apart.min())
    multiples = np.rint(apart / step)
    if np.all(np.abs(apart / step - multiples) < 0.01) and not (few and np.mean(multiples == 1) <= 0.5):
        return step
    for k in () if few else range(10):
        scaled = levels * 10.0**k  # below 1e9 a float tells whole numbers from others to 1e-6
        if np.max(np.abs(scaled)) < 1e9 and np.all(np.abs(scaled - np.rint(scaled)) < 1e-6):
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


# ---- faults of readings, which become NaN -----------------------------------------------------------------------


def missing(where: str, column: Column, readings: Array, seconds: Array) -> Finding | None:
    """Cells without a number, which all become NaN: infinite ones too."""
    readings[np.isinf(readings)] = np.nan
    mask = np.isnan(readings)
    example = f" ({counted(column.texts, 'text')} such as '{column.example}')" if column.texts else ""
    what = lost(f"dropouts{example}", mask, seconds, "cell")
    return warning("readings.missing", where, what, "check sensor, cable and logger") if mask.any() else None


def faults(where: str, readings: Array, turns: Turns, near: slice, moves: bool) -> Iterator[Finding]:
    """Stuck readings and spikes while the drive runs, which become NaN; what half of the turns have is the signal's.

    With fewer turns than `FEW` nothing tells a fault from the signal. near: rows that reach into the turns, by
    interpolation or a filter; moves: whether the readings are to change.
    """
    seconds, begin, end = turns.line.seconds, turns.begin, turns.end
    running = slice(int(np.searchsorted(seconds, begin[0])), int(np.searchsorted(seconds, end[-1], "right")))
    finite = readings[running][np.isfinite(readings[running])]
    if finite.size >= 10 and finite.min() == finite.max():
        what = f"reads {finite[0]:.6g} in every one of {finite.size:,} rows"
        yield (warning if moves else note)("readings.constant", where, what, "check that the sensor is connected")
    elif finite.size >= 10:
        for kind, rows, check in (("stuck", running, _stuck), ("spikes", near, spikes)):
            mask = check(readings[rows])
            often = runs(mask)[0].size >= 0.5 * begin.size
            if kind == "spikes" and mask.any():  # what another turn has in the same place is the signal's
                time, place = seconds[rows][mask], np.flatnonzero(mask)
                turn = np.clip(np.searchsorted(begin, time, side="right") - 1, 0, begin.size - 1)
                phase = ((time - begin[turn]) / (end - begin)[turn]) % 1.0
                order = np.argsort(phase)
                after = np.roll(order, -1)
                alike = ((phase[after] - phase[order]) % 1.0 < CHANCE / time.size) & (turn[after] != turn[order])
                mask[place[order[alike]]] = mask[place[after[alike]]] = False
            if begin.size >= FEW and mask.any() and not often:
                readings[rows][mask] = np.nan
                what = lost(kind, mask, seconds[rows])
                yield warning(f"readings.{kind}", where, what, "check sensor, shielding and logger")


def _stuck(part: Array) -> Mask:
    """The same reading in a row ten times as long as nearly all others stay; none where that is most of it."""
    ends = np.flatnonzero(np.append(np.diff(part) != 0, True))
    stays = np.diff(ends, prepend=-1)
    single = np.flatnonzero(stays == 1)  # of which no more count than ten for each that stays
    sizes = np.sort(np.delete(stays, single[10 * (stays.size - single.size) :]))
    usual = sizes[int(0.99 * (sizes.size - 1))] if sizes.size else 0
    long = stays > max(STUCK, 10 * usual if usual < 0.1 * part.size else STUCK)
    stuck = np.repeat(long, stays)
    stuck[ends[long] - stays[long] + 1] = False  # the first of them is one
    return stuck & (np.mean(stuck) <= 0.5)


def spikes(part: Array) -> Mask:
    """One to three readings in a row that are far from the median of those around them, beyond any doubt."""
    finite, far = np.isfinite(part), np.zeros(part.size, dtype=np.bool_)
    if np.count_nonzero(finite) >= 2 * WIDTH:
        readings = part[finite]
        wide = max(float(np.subtract(*np.percentile(readings, (99, 1)))), 1e-300)
        off, ends = (
            np.abs(readings - median_filter(readings, size=WIDTH, mode=mode)) for mode in ("nearest", "mirror")
        )
        off = np.where(ends > wide, np.maximum(off, ends), off)  # else a slope at an end
        far[finite] = off > max(FAR * 1.4826 * np.median(off), 2.5 * np.percentile(off, 99), SEEN * wide)
    return far


# ---- turns ----------------------------------------------------------------------------------------------------


def drift(turns: Turns, course: Array, unit: str) -> tuple[float, float, str]:
    """A zero that creeps: the slope of the means of the turns, where it is plain.

    Returns
    -------
    Slope, SI a second; standard uncertainty of the line at either end; a sentence, empty where the slope is not plain.
    """
    mean, middle = turn_means(course), 0.5 * (turns.begin + turns.end)
    finite = np.isfinite(mean)
    mean, middle, free = mean[finite], middle[finite], np.count_nonzero(finite) - 2
    if free < 4:
        return 0.0, 0.0, ""
    t, y, span = middle - middle.mean(), mean - mean.mean(), float(np.ptp(middle))
    slope = float(np.sum(t * y)) / (square := float(np.sum(t**2)))
    scatter = float(np.sqrt(np.sum((y - slope * t) ** 2) / free))
    error, change, largest = scatter / np.sqrt(square), slope * span, float(np.nanmax(np.abs(course)))
    if not change or abs(slope) < CERTAIN * error or abs(change) < max(PLAIN * scatter, SHARE * largest):
        return 0.0, 0.0, ""
    what = f"drift: the mean of a turn changes by {change:.3g} {unit} in {span:.4g} s, "
    return slope, error * span / 2, f"{what}{abs(change) / max(scatter, 1e-300):.3g} times the scatter of the turns"


def signs(sensors: Mapping[str, Sensor], signals: Mapping[str, Signal], turning: float) -> Iterator[Finding]:
    """Channels that are likely to have the wrong sign or unit: a speed of the driver that is not that of the angle, a
    power into a driver or out at a load below zero in nearly all turns, by more than the zero may be off.

    turning: mean speed of the driver by its angle, rad/s with its sign.
    """
    subjects: dict[str, dict[str, str]] = {"rate": {}, "effort": {}, "load": {}}
    for name, signal in signals.items():
        kind, _, subject = signal.measures.partition(":")
        subjects.get(kind, {})[subject] = name
    rates, drivers, loads = subjects.values()
    free, ratio = [name for joint, name in rates.items() if joint not in drivers], 1.0
    rate = rates.get(next(iter(drivers))) if len(drivers) == 1 and turning else None
    if rate and (speed := signals[rate].turns[np.isfinite(signals[rate].turns)]).size:
        one_way = np.all(speed * speed[0] > 0)  # over equal angles its mean in time is the harmonic one
        ratio = turning / (float(1 / np.mean(1 / speed)) if one_way else float(np.mean(speed)))
        if abs(ratio - 1) > APART:
            unit, size = signals[rate].shown
            what = f"the angle turns at {turning / size:.4g} {unit}, {ratio:.4g} times what '{rate}' reads"
            remedy = f"write sign: {-sensors[rate].channel.sign}, or correct unit and gain, or per_turn of angle"
            yield warning("rate.ratio", f"channels.{rate}", what, remedy)
    other = free[0] if len(free) == 1 else None
    pairs = [(name, rates.get(load, other)) for load, name in loads.items() if other or load in rates]
    if abs(ratio + 1) > APART:  # else that explains it
        pairs += [(name, rates.get(driver)) for driver, name in drivers.items() if len(drivers) < 2 or driver in rates]
    for name, rate in pairs:
        effort = signals[name]
        speed = signals[rate].turns if rate else np.full_like(effort.turns, turning)
        power = turn_means(effort.turns * speed)
        power = power[np.isfinite(power)]
        below = int(np.count_nonzero(power < 0))
        plain = power.size and abs(np.mean(power)) > 2 * abs(effort.accuracy.zero * float(np.nanmean(speed)))
        if plain and below > NEARLY_ALL * power.size:
            what = f"sign: the power of {effort.measures} is negative in {below:,} of {counted(power.size, 'turn')} "
            sign = -sensors[name].channel.sign
            remedy = f"write sign: {sign}, or turn the speed or sign: in angle:, if that is wrong"
            yield warning("power.sign", f"channels.{name}", f"{what}({power.mean():.4g} W)", remedy)

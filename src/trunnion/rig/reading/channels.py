"""From readings to quantities: unit and gain, zero with its uncertainty, the zero-phase filter, steps and noise."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import comb

import numpy as np
from numpy.typing import NDArray

from trunnion.errors import Finding, MechanismError
from trunnion.model.units import UnitError
from trunnion.rig.reading.checks import outliers
from trunnion.rig.reading.log import at_times, counted, note, warning
from trunnion.rig.reading.mapping import Channel, Filter, Zero
from trunnion.rig.reading.tables import Column
from trunnion.rig.reading.timebase import Timeline
from trunnion.rig.reading.units import HERTZ, OTHER_COLUMN, Amount, SensorScale, alike, default_unit, dimensions, scale

__all__ = [
    "LOOKED_AT", "ChannelReading", "Zeroed", "check_filter", "filtered", "mean_uncertainty", "noise_of", "reading",
    "resolution", "unit_differs", "zeroed",
]  # fmt: skip

Array = NDArray[np.float64]
Say = Callable[[Finding | str], None]  # takes a finding, or a sentence about what was done
LOOKED_AT = 50_000  # readings of which the step is told
MOST = 1e100  # SI units that a reading of 1 may mean
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
        if not MOST > abs(sensor.factor) > 1 / MOST:
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

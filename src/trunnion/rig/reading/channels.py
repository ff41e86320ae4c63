"""From readings to quantities: sign, gain, zero with its uncertainty, and the zero-phase filter."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from math import comb

import numpy as np
from numpy.typing import NDArray

from trunnion.errors import Finding, MechanismError, Severity
from trunnion.model.units import UnitError
from trunnion.rig.reading.columns import Column
from trunnion.rig.reading.faults import outliers
from trunnion.rig.reading.log import Account, counted, few_digits, runs, times
from trunnion.rig.reading.mapping import Channel, Filter, Zero
from trunnion.rig.reading.scale import OTHER_COLUMN, SensorScale, default_unit, scale
from trunnion.rig.reading.sensor_quantity import HERTZ, Amount, alike, dimensions
from trunnion.rig.reading.timebase import Timeline

__all__ = [
    "LOOKED_AT",
    "ChannelReading",
    "Zeroed",
    "compare_units",
    "filtered",
    "mean_uncertainty",
    "noise_of",
    "read_in",
    "reading",
    "resolution",
    "shown",
    "zeroed",
]

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
LOOKED_AT = 50_000  # readings of which the step is told
MOST = 1e100  # SI units that a reading of 1 may mean
FEWEST_LEVELS = 5  # of readings, from which they tell the step of a converter
LEVELS = 8  # from which they tell it though some are left out, or the last decimal
DECIMALS = 10  # looked for
EXACT = 1e9  # below which a float tells whole numbers from others to 1e-6
BRIDGED = 0.1  # of the period of the cut-off: gaps up to this are bridged for the filter


@dataclass(frozen=True)
class Zeroed:
    """Zero of a channel, in readings. uncertainty: of it, in readings; drift: readings a second, from `since`.

    since: when the zero was that, s; NaN where it is a value that was stated.
    """

    value: float
    uncertainty: float = 0.0
    drift: float = 0.0
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

    def quantity(self, readings: Array, zero: Zeroed, sign: int, seconds: Array) -> Array:
        """What the readings measure, SI."""
        off = readings - zero.value
        return sign * self.scale.factor * (off - zero.drift * (seconds - zero.since) if zero.drift else off)

    def live(self, zero: Amount) -> bool:
        """Whether a zero is what the sensor gives of nothing, as 4 mA: stated of readings that are not the quantity."""
        stated = zero.plain or alike(zero.dimensions, self.scale.of_reading)
        return stated and not alike(self.scale.of_reading, self.scale.of_quantity)


def reading(name: str, channel: Channel, column: Column, account: Account) -> ChannelReading:
    """The unit of a channel's readings: the mapping's, else the file's, else that of what it measures in SI."""
    where = f"channels.{name}"
    unit = channel.unit or ""
    if channel.unit:
        compare_units(where, channel.column, channel.unit, column, account)
    if not channel.unit and column.unit:
        unit = column.unit
        account.say(f"unit of {name} from the file: {unit}")
    if not unit and (channel.gain is None or channel.gain.plain):
        unit = default_unit(channel.measures)
        account.note(
            "data.unit.none",
            where,
            f"has no unit in the mapping or the file; SI is assumed ({unit or '1'})",
            f"state {where}.unit",
        )
    try:
        found = scale(channel.measures, unit, channel.gain, channel.column)
        if not MOST > abs(found.factor) > 1 / MOST:
            what = f"a reading of 1 is {found.factor:.3g} {found.unit}, which no sensor has"
            raise MechanismError(Finding(what, f"{where}.gain", "check unit and gain", file=account.file))
        limit = found.reading(channel.range, "range") if channel.range else None
        zero = abs(found.factor) * found.reading(channel.accuracy.zero, "accuracy.zero")
        step = found.reading(channel.resolution, "resolution") if channel.resolution else 0.0
        return ChannelReading(found, unit, limit, zero, float(channel.accuracy.gain.evaluate()), step)
    except UnitError as error:
        remedy = error.remedy
        if not channel.unit and column.unit and not remedy.startswith(OTHER_COLUMN):  # no logger's file is written anew
            remedy = f"state {where}.unit in the mapping; in the file, {remedy}"
        raise MechanismError(Finding(error.what, where, remedy, file=account.file)) from None


def compare_units(where: str, name: str, unit: str, column: Column, account: Account) -> None:
    """Tell where the file states another unit of a column than the mapping."""
    stated = dimensions(unit)
    try:
        own = dimensions(column.unit) if column.unit else stated
    except UnitError:
        return
    if own[1] == HERTZ and stated[1] == dimensions("rad/s")[1] and np.isclose(stated[0] / own[0], (1, 2 * np.pi)).any():
        return  # 1/min where the mapping says rpm, as it has to
    if not alike(own[1], stated[1]) or own[0] != stated[0]:
        what = f"the file has the unit '{column.unit}' for '{name}', the mapping '{unit}', which is taken"
        if alike(own[1], stated[1]):
            what = f"{what}: all values are {few_digits(stated[0] / own[0], 3)} times those of the file"
        account.warn("data.unit.differs", where, what, f"correct {where}.unit, or remove it")


def shown(own: ChannelReading) -> tuple[str, float]:
    """Unit in which figures of a channel are told, and its size in SI: that of its readings where it is another one."""
    unit, size = read_in(own)
    return (unit, size) if size != 1 else (own.scale.unit, 1.0)


def read_in(own: ChannelReading) -> tuple[str, float]:
    """The unit of readings that are what is measured itself, and its factor to SI; empty of volts and the like."""
    raw = own.scale
    return (own.unit, raw.raw) if own.unit and alike(raw.of_reading, raw.of_quantity) else ("", 1.0)


def zeroed(
    name: str, channel: Channel, own: ChannelReading, readings: Array, line: Timeline, remove: bool, account: Account
) -> Zeroed:
    """The zero of a channel: a value, or the mean over its unloaded stretches.

    Two stretches or more tell a drift of the zero between them; remove: it is corrected, a straight line through them.
    """
    if isinstance(channel.zero, Amount):
        return Zeroed(own.scale.reading(channel.zero, "zero"))
    where, zero = f"channels.{name}.zero", channel.zero
    middles, means, errors = _stretches(where, zero, readings, line, account)
    unit, raw = own.scale.unit, own.scale
    weights = 1 / np.maximum(errors, 1e-300) ** 2 if np.all(errors > 0) else np.ones(means.size)
    mean = float(np.average(means, weights=weights))
    error = float(1 / np.sqrt(weights.sum())) if np.all(errors > 0) else 0.0
    if means.size < 2 or np.ptp(middles) == 0:
        account.say(f"zero of {name}: mean over the unloaded stretch, ± {{}} {unit}", abs(raw.factor) * error)
        return Zeroed(mean, error, since=float(np.average(middles, weights=weights)))
    slope = float(np.polyfit(middles, means, 1)[0])
    span = float(np.ptp(middles))
    change = slope * span
    drifts = abs(change) > 5 * float(np.hypot(errors[0], errors[-1])) and change != 0
    by = f"{raw.factor * change * channel.sign:.3g} {unit} in {span:.4g} s"
    told = f"the zero drifts by {by}, between the unloaded stretches"
    if drifts and remove:
        account.warn(
            "data.zero.drift_removed",
            where.removesuffix(".zero"),
            f"{told}; a straight line is subtracted",
            "let the sensor warm up",
        )
        return Zeroed(float(np.mean(means)), error, slope, float(np.mean(middles)))
    if drifts:
        account.warn(
            "data.zero.drift", where.removesuffix(".zero"), told, "let the sensor warm up, or state drift: remove"
        )
    account.say(f"zero of {name}: mean over {means.size} unloaded stretches, ± {{}} {unit}", abs(raw.factor) * error)
    return Zeroed(mean, error, since=float(np.average(middles, weights=weights)))


def _stretches(where: str, zero: Zero, readings: Array, line: Timeline, account: Account) -> tuple[Array, Array, Array]:
    """Middle of the readings, their mean and its standard uncertainty, of every unloaded stretch that has values."""
    rows = []
    for begin, end in zero.over:
        low, high = np.searchsorted(line.seconds, (begin.value, end.value))
        known = np.isfinite(readings[low:high])
        part, when = readings[low:high][known], line.seconds[low:high][known]
        if (spikes := outliers(part)).any():
            what = f"spikes: {counted(int(spikes.sum()), 'reading')} of {part.size:,} in the unloaded stretch, "
            account.warn("data.readings.spikes", where, f"{what}{times(when[spikes])}; left out", "check shielding")
            part, when = part[~spikes], when[~spikes]
        if part.size:  # a stretch may be stated longer than the file has it
            rows.append((float(np.mean(when)), float(np.mean(part)), mean_uncertainty(part)))
        else:
            what = (
                f"there are no readings from {begin.value:g} to {end.value:g} s; the file runs from {line.seconds[0]:g}"
            )
            what = f"{what} to {line.seconds[-1]:g} s"
            account.warn(
                "data.zero.no_readings",
                where,
                what,
                "state a stretch in which the sensor is not loaded",
                Severity.ERROR,
            )
    if not rows:
        raise MechanismError(account.findings[-1:])
    middles, means, errors = np.array(rows).T
    return middles, means, errors


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


def filtered(values: Array, line: Timeline, low_pass: Filter, account: Account, where: str) -> Array:
    """A Butterworth low-pass forward and backward, 3 dB down at the cut-off after both.

    Gaps up to a tenth of the period of the cut-off are bridged by a straight line and are gaps again afterwards; over
    longer ones nothing is carried: the stretches between them are filtered each by itself, and those too short for it
    have no values.
    """
    from scipy.signal import butter, sosfiltfilt  # brings scipy.stats: longer to import than all the rest

    rate = 1.0 / line.step
    cut_off = low_pass.cut_off.value
    finite = np.isfinite(values)
    starts, lengths = runs(~finite)
    short = lengths * line.step <= BRIDGED / cut_off
    hole = ~finite
    for begin, length in zip(starts[short], lengths[short], strict=True):
        hole[begin : begin + length] = begin == 0 or begin + length == values.size
    if not np.any(~hole):
        return values
    bridged = values if finite.all() else np.interp(line.seconds, line.seconds[finite], values[finite])
    # both passes together are 3 dB down at the cut-off if each is where |H|² = 1/√2
    edge = np.tan(np.pi * cut_off / rate) / (np.sqrt(2.0) - 1.0) ** (1.0 / (2 * low_pass.order))
    sections = butter(low_pass.order, min(2 / np.pi * np.arctan(edge), 1 - 1e-9), output="sos")
    breaks = np.zeros(values.size, dtype=np.bool_)
    breaks[line.breaks] = True
    least = 3 * (2 * len(sections) + 1) + 1
    result, lost = np.full(values.size, np.nan), 0
    for begin, length in zip(*runs(~hole), strict=True):
        cuts = begin + np.flatnonzero(breaks[begin : begin + length])
        bounds = [begin, *cuts[cuts > begin].tolist(), begin + length]
        for low, high in pairwise(bounds):
            if high - low < least:
                lost += high - low
                continue
            pad = min(high - low - 1, max(least - 1, int(rate / cut_off)))
            try:
                result[low:high] = sosfiltfilt(sections, bridged[low:high], padlen=pad)
            except np.linalg.LinAlgError:
                what = f"order {low_pass.order} at {cut_off:g} Hz of {rate:.4g} Hz cannot be computed"
                raise MechanismError(Finding(what, "filter", "lower the order", file=account.file)) from None
    if lost:
        what = f"{counted(lost, 'sample')} between gaps too close for the filter; left out"
        account.warn("data.filter.gaps", where, what, "raise the cut-off, or remove the cause of the gaps")
    result[~finite] = np.nan
    return result


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
    whole = np.rint(apart / step)
    few = levels.size < LEVELS
    if np.all(np.abs(apart / step - whole) < 0.01) and not (few and np.mean(whole == 1) <= 0.5):
        return step
    if few:
        return 0.0
    for k in range(DECIMALS):
        scaled = levels * 10.0**k
        if np.max(np.abs(scaled)) < EXACT and np.all(np.abs(scaled - np.rint(scaled)) < 1e-6):
            return float(10.0**-k)
    return 0.0


def noise_of(readings: Array) -> float:
    """Standard deviation of what is white in readings: the least that differences of first to third order tell.

    The mean of |Δᵏ| of normal deviates is σ √(2/π) √C(2k, k). A course makes the lower orders larger, noise none.
    """
    part = readings[np.isfinite(readings)][:LOOKED_AT]
    if part.size <= 3:
        return 0.0
    return float(min(np.mean(np.abs(np.diff(part, k))) / np.sqrt(2 / np.pi * comb(2 * k, k)) for k in (1, 2, 3)))

"""Data files of a test rig as a Measurement: read by a mapping, checked, cut into turns, and brought to positions.

From readings to quantities: unit and gain, zero with its uncertainty, filter, steps and noise, faults.
"""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, replace
from itertools import count
from math import comb
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import median_filter

from trunnion.errors import Finding, MechanismError, Severity, counted
from trunnion.model.arguments import strict_arguments
from trunnion.model.units import UnitError
from trunnion.rig.reading.angle import coordinate
from trunnion.rig.reading.mapping import Channel, DataMapping, File, Filter, Mean, Zero, read_mapping
from trunnion.rig.reading.measurement import Accuracy, Condition, Measurement, Signal, between_turns
from trunnion.rig.reading.tables import Column, read_table
from trunnion.rig.reading.turns import (
    DENSE,
    Say,
    Timeline,
    Turns,
    cut,
    gathered,
    joined,
    left_in_turns,
    lost,
    missing,
    resampled,
    runs,
    time_mean,
    timeline,
    turn_means,
    unit_of,
)  # fmt: skip
from trunnion.rig.reading.units import SensorScale, alike, default_unit, unit_name

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
SPARSE = 0.25  # samples a position, below which nearly all values are interpolated
STEADY = 0.03  # of the mean speed, between the slowest and the fastest turn
PASSED = 1.25  # times what a cubic between samples leaves of white noise, at the least
PERIODS = 5.0  # of the cut-off of a filter, over which a reading reaches
StepKey = tuple[str, str, float]  # channel, unit of its readings, factor: one step of the readings


@strict_arguments
def read_measured(
    mapping: str | os.PathLike[str] | Mapping[str, Any], files: Iterable[str | os.PathLike[str]] | None = None
) -> Measurement:
    """Read the measurement that a mapping file describes: courses over the cycle, turn by turn, and faults in them.

    Parameters
    ----------
    mapping : path of the mapping, or its entries.
    files : data files instead of those it names.

    Returns
    -------
    The measurement; faults of the data are its findings.

    Raises
    ------
    MechanismError
        With every finding, where mapping or files cannot be read or there is no turn at all.
    """
    mapped = read_mapping(mapping)
    recordings = [_Recording(mapped.mapping.of_file(entry), path, entry) for path, entry in mapped.files(files)]
    conditions: list[Condition] = []
    levels: dict[StepKey, list[Array]] = {}  # a file whose readings span a few steps does not show them by itself
    with np.errstate(over="ignore", invalid="ignore", divide="ignore"):  # of numbers near the end of the floats
        for recording in recordings:
            with recording.failing():
                recording.find_turns()
                for name, sensor in recording.sensors.items():
                    readings = recording.readings[name][recording.running]
                    part = np.unique(readings[np.isfinite(readings)])[:LOOKED_AT]
                    levels.setdefault((name, sensor.unit, sensor.scale.factor), []).append(part)
        steps = {key: resolution(np.concatenate(rows)) for key, rows in levels.items()}
        for recording in recordings:
            if not recording.failed:
                with recording.failing():
                    conditions.append(recording.condition(steps))
    findings = mapped.placed([finding for recording in recordings for finding in recording.findings])
    if any(recording.failed for recording in recordings):
        raise MechanismError(gathered((item for item in findings if item.severity is not Severity.NOTE), same=True))
    names, distinct = [condition.name for condition in conditions], dict[str, Condition]()
    for condition in conditions:  # the file is added where two names are alike, then a number
        name = plain = condition.name
        if names.count(plain) > 1:
            name = plain = f"{plain} ({', '.join(Path(file).stem for file in condition.files)})"
        numbers = count(2)
        while name in distinct:
            name = f"{plain} {next(numbers)}"
        distinct[name] = replace(condition, name=name)
    turns = [len(next(iter(condition.courses.values())).turns) for condition in conditions]
    each = f"{min(turns):,}" if min(turns) == max(turns) else f"{min(turns):,} to {max(turns):,}"
    each += " whole turns" if len(turns) == 1 else f" whole turns in each of {len(turns):,} conditions"
    done = dict.fromkeys(sentence for recording in recordings for sentence in recording.done)
    sentences = (f"{each}; rows before, between and after them are not used", *done)
    return Measurement(mapped.mapping.name or Path(mapped.file).stem, (*distinct.values(),), (*findings,), sentences)


class _Recording:
    """One data file on its way to a condition.

    Its turns are found first, and what is wrong of its readings left out; the courses follow when the steps of the
    readings are known from all files.
    """

    def __init__(self, mapping: DataMapping, path: Path, entry: File) -> None:
        self.mapping, self.path, self.entry = mapping, path, entry
        self.findings: list[Finding] = []
        self.done: list[str] = []
        self.sensors: dict[str, Sensor] = {}
        self.readings: dict[str, Array] = {}
        self.failed = False

    def say(self, finding: Finding | str | None) -> None:
        """Take a finding, or a sentence about what was done."""
        if isinstance(finding, str):
            self.done.append(finding)
        elif finding is not None:
            self.findings.append(replace(finding, file=finding.file or str(self.path)))

    @contextmanager
    def failing(self) -> Iterator[None]:
        """What one file fails by is reported with what the others do."""
        try:
            yield
        except MechanismError as error:
            self.failed = True
            for finding in error.findings:
                self.say(finding)

    def find_turns(self) -> None:
        """Read the file, find its turns, and leave out what is wrong of the readings in them."""
        mapping, say = self.mapping, self.say
        sources = (mapping.angle, mapping.angle.index if mapping.angle else None, *mapping.channels.values())
        names = [source.column for source in sources if source is not None and source.column is not None]
        time = [mapping.time.column] if mapping.time and mapping.time.column else []
        tdms = self.path.suffix.lower() == ".tdms"  # which may state its sampling by itself
        table = read_table(self.path, names if tdms else [*time, *names], time)
        if not table.encoding.startswith("utf-8"):
            say(f"read in the encoding {table.encoding}")
        line = timeline(table, mapping.time, say)
        if mapping.filter is not None:
            passes = f"order {mapping.filter.order}, forward and backward, together 3 dB down at "
            say(f"low-pass filter: Butterworth of {passes}{mapping.filter.cut_off.value:g} Hz")
            if not line.even:
                what = "the samples are not evenly spaced in time, as a filter needs them"
                remedy = "record at a fixed rate, or leave out the filter"
                say(Finding.warning("data.filter.uneven", "filter", what, remedy))
        for name, channel in mapping.channels.items():
            column = table.columns[channel.column]
            self.readings[name] = np.array(line.rows(column.values))
            self.sensors[name] = sensor_of(name, channel, column, self.readings[name], line, say)
        begin, end = (time.value for time in self.entry.over) if self.entry.over else (-np.inf, np.inf)
        allowed = (line.seconds >= begin) & (line.seconds <= end)
        self.angle, self.sense, share, spoilt = None, 1.0, line.seconds / mapping.cycle.value, np.empty((0, 2))
        if not mapping.timed and mapping.angle is not None:
            self.angle = angle = coordinate(mapping.angle, table, line, say)
            finite = np.flatnonzero(np.isfinite(angle.values) & allowed)
            if finite.size < 3:
                what = "no row in use has a coordinate of the driver"
                raise MechanismError(Finding(what, "angle", "check angle.column"))
            self.sense = 1.0 if angle.values[finite[-1]] >= angle.values[finite[0]] else -1.0
            share = self.sense * (angle.values - mapping.start.value) / mapping.cycle.value
            spoilt = np.concatenate([angle.spoilt, np.repeat(line.spoilt[:, None], 2, axis=1)])
        self.turns = cut(share, line, allowed, mapping.positions, spoilt, say)
        if not self.turns.numbers.size:
            cycles = share[allowed & np.isfinite(share)]
            what = f"there is no whole turn: {np.ptp(cycles) if cycles.size else 0:.3g} cycles in "
            what, remedy = what + counted(cycles.size, "row"), "check angle, or record for longer"
            raise MechanismError(Finding(what, "turns", remedy, code="data.turns.none"))
        for finding in self._doubts():
            say(finding)
        first, last = np.searchsorted(line.seconds, (self.turns.begin[0], self.turns.end[-1]))
        self.running = slice(int(first), int(np.searchsorted(line.seconds, self.turns.end[-1], "right")))
        reach = float(np.median(self.turns.end - self.turns.begin)) / mapping.positions
        reach += PERIODS / mapping.filter.cut_off.value if mapping.filter is not None else 0.0
        width = WIDTH + int(min(reach / line.step, len(line.seconds)))
        near = slice(max(first - width, 0), int(last) + width)
        for name, channel in mapping.channels.items():
            readings, moves = self.readings[name], not channel.measures.startswith("rate:")
            for finding in faults(f"channels.{name}", readings, self.turns, self.running, near, moves):
                say(finding)

    def _doubts(self) -> Iterator[Finding | str]:
        """Whether turns are enough, equally fast and well sampled, and no unloaded stretch reaches into them."""
        turns, positions = self.turns, self.mapping.positions
        if turns.numbers.size < 2:
            what = "has one turn: there is no scatter, so no uncertainty"
            yield Finding.warning("data.turns.one", "turns", what, "record two turns or more")
        speeds = 60 / (turns.end - turns.begin)
        spread = float(np.ptp(speeds) / np.mean(speeds))
        if spread > STEADY + 2 * turns.line.step / float(np.mean(turns.end - turns.begin)):
            what = f"the speed is not steady: {speeds.min():.4g} to {speeds.max():.4g} cycles a minute"
            yield Finding.warning("data.speed.unsteady", "turns", what, "state files: over: to use the steady part")
        if turns.density < DENSE:  # no fault of the readings
            samples = turns.density * positions
            what = f"{samples:.4g} samples a turn for {positions} positions: values are interpolated; means of samples "
            what += f"with up to {int(samples / DENSE)} positions"
            severity = Severity.WARNING if turns.density < SPARSE else Severity.NOTE
            yield Finding.weighed(severity, "data.sampling.slow", "turns", what) if turns.density < 1 else what
        for name, channel in self.mapping.channels.items():
            for low, high in channel.zero.over if isinstance(channel.zero, Zero) else ():
                if inside := int(np.sum((turns.begin < high.value) & (turns.end > low.value))):
                    what = f"the unloaded stretch {low.value:g} to {high.value:g} s reaches into "
                    what, remedy = what + counted(inside, "turn"), "state a stretch without load"
                    yield Finding.warning("data.zero.in_turns", f"channels.{name}.zero", what, remedy)

    def condition(self, steps: Mapping[StepKey, float]) -> Condition:
        """The condition of the file, with courses and what was set. steps: of the readings."""
        mapping, turns, angle = self.mapping, self.turns, self.angle
        courses = {name: self._signal(name, sensor, steps[name, sensor.unit, sensor.scale.factor])
                   for name, sensor in self.sensors.items()}  # fmt: skip
        speed, start, span, duration = np.nan, np.nan, np.nan, mapping.cycle.value
        if not mapping.timed:
            start, span, duration = mapping.start.value, duration, np.nan
            speed = self.sense * span / float(np.mean(turns.end - turns.begin))
            for finding in signs(self.sensors, courses, speed):
                self.say(finding)
        values, units, texts = dict[str, float](), dict[str, str](), list[str]()
        for path, setting in mapping.set.items():
            if not isinstance(setting, Mean):
                values[path], units[path] = setting.value, unit_name(setting.dimensions) if setting.unit else ""
                texts.append(f"{path} {setting.source}")
            elif (signal := courses.get(setting.mean)) is None:  # of the angle
                values[path], units[path] = speed, "rad/s"
            elif not np.isfinite(signal.turns).any():
                what = f"the channel '{setting.mean}', whose mean it is, has no value in any turn"
                raise MechanismError(Finding(what, f"set.{path}", "correct the channel, or state it"))
            else:
                values[path], units[path] = time_mean(turns, signal.turns), signal.unit
        units = {path: unit for path, unit in units.items() if unit}
        return Condition(
            ", ".join(texts) or self.path.stem, values, np.arange(mapping.positions) / mapping.positions, courses,
            (str(self.path),), speed, start, span, angle.lag if angle else 0.0, angle.cut if angle else 0.0, units,
            duration,
        )  # fmt: skip

    def _signal(self, name: str, sensor: Sensor, step: float) -> Signal:
        """The course of a channel, with the accuracy of its sensor."""
        turns, scale, channel, low_pass = self.turns, sensor.scale, sensor.channel, self.mapping.filter
        readings, step, size = self.readings.pop(name), sensor.step or step, abs(scale.factor)
        noise, values = noise_of(readings[self.running]), sensor.quantity(readings)
        angle = values if scale.unit == "rad" else None
        values = values if angle is None else joined(angle)
        if low_pass is not None:
            values = filtered(values, turns.line, low_pass)
        course = resampled(turns, values, angle)
        if low_pass is None:  # the scatter of turns may show less noise than neighbouring readings do
            scatter = float(np.median(between_turns(course))) / size * PASSED * max(turns.density, 1.0) ** 0.5
            noise = min(noise, scatter) if scatter >= 0 else noise
        coarse = bool(step) and noise < step / 2  # more noise carries readings over the steps
        left = left_in_turns(turns, course / (size * step), readings / step, noise / step) if coarse else None
        zero_error = size * sensor.zero_uncertainty
        slope, at_ends, what = drift(turns, course, scale.unit)
        if what and not channel.measures.startswith("rate:"):  # a speed may creep
            if self.mapping.drift == "remove":
                since = float(turns.line.seconds[0]) if np.isnan(sensor.since) else sensor.since
                what += f"; a straight line is subtracted, zero at {since:.4g} s"
                course = resampled(turns, values - slope * (turns.line.seconds - since), angle)
                zero_error = float(np.hypot(zero_error, at_ends))
            remedy = "let sensor and bearings warm up, or state drift: remove"
            self.say(Finding.warning("data.zero.drift_files", f"channels.{name}", what, remedy))
        total = float(np.hypot(size * scale.reading(channel.accuracy.zero, "accuracy.zero"), zero_error))
        accuracy = Accuracy(total, channel.accuracy.gain.value, size * step * coarse, zero_error, datum=sensor.datum)
        read_in = (sensor.unit, scale.raw) if sensor.unit and scale.direct else ("", 1.0)  # not of volts and the like
        signal = Signal(name, channel.measures, scale.unit, course, accuracy, read_in, channel.per_turn or 0)
        # rounded or cut off, which is not known: up to half a step, rectangular
        return replace(signal, accuracy=replace(accuracy, cut=signal.unresolved, left=left))


# ---- sensors -----------------------------------------------------------------------------------------------------


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
            figures = {"count": count, "readings": readings}
            if count > MOST * readings:  # the rest says nothing of the channel
                raise MechanismError(Finding.error("data.readings.clipped", where, what, remedy, **figures))
            values[rows] = np.nan
            say(Finding.warning("data.readings.clipped", where, what, remedy, **figures))
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
            what = lost("spikes", far, line.seconds[rows])
            say(Finding.warning("data.readings.spikes", f"{where}.zero", what, "check shielding"))
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


def faults(where: str, readings: Array, turns: Turns, running: slice, near: slice, moves: bool) -> Iterator[Finding]:
    """Stuck readings and spikes while the drive runs, which become NaN; what half of the turns have is the signal's.

    With fewer turns than `FEW` nothing tells a fault from the signal. near: rows that reach into the turns, by
    interpolation or a filter; moves: whether the readings are to change.
    """
    seconds, begin, end = turns.line.seconds, turns.begin, turns.end
    finite = readings[running][np.isfinite(readings[running])]
    if finite.size < 10:
        return
    if finite.min() == finite.max():
        what = f"reads {finite[0]:.6g} in every one of {finite.size:,} rows"
        severity, remedy = Severity.WARNING if moves else Severity.NOTE, "check that the sensor is connected"
        yield Finding.weighed(severity, "data.readings.constant", where, what, remedy)
        return
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
            what, remedy = lost(kind, mask, seconds[rows]), "check sensor, shielding and logger"
            if kind == "stuck":
                yield Finding.warning("data.readings.stuck", where, what, remedy)
            else:
                yield Finding.warning("data.readings.spikes", where, what, remedy)


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
            yield Finding.warning("data.rate.ratio", f"channels.{rate}", what, remedy)
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
            yield Finding.warning("data.power.sign", f"channels.{name}", f"{what}({power.mean():.4g} W)", remedy)

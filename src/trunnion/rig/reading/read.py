"""Data files of a test rig as a Measurement: read by a mapping, checked, cut into turns, and brought to positions."""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from trunnion.errors import Finding, MechanismError, Severity
from trunnion.model.arguments import strict_arguments
from trunnion.rig.reading import channels
from trunnion.rig.reading.angle import coordinate
from trunnion.rig.reading.mapping import DataMapping, File, Mean, Zero, read_mapping
from trunnion.rig.reading.measurement import Accuracy, Condition, Measurement, Signal, between_turns
from trunnion.rig.reading.tables import read_table
from trunnion.rig.reading.turns import (
    DENSE,
    counted,
    cut,
    gathered,
    joined,
    left_in_turns,
    note,
    resampled,
    time_mean,
    timeline,
    warning,
)
from trunnion.rig.reading.units import unit_name

__all__ = ["read_measured"]

Array = NDArray[np.float64]
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
                for key, readings in recording.levels():
                    levels.setdefault(key, []).append(readings)
        steps = {key: channels.resolution(np.concatenate(rows)) for key, rows in levels.items()}
        for recording in recordings:
            if not recording.failed:
                with recording.failing():
                    conditions.append(recording.condition(steps))
    findings = mapped.placed([finding for recording in recordings for finding in recording.findings])
    if any(recording.failed for recording in recordings):
        raise MechanismError(gathered((item for item in findings if item.severity is not Severity.NOTE), same=True))
    turns = [len(next(iter(condition.courses.values())).turns) for condition in conditions]
    each = f"{min(turns):,}" if min(turns) == max(turns) else f"{min(turns):,} to {max(turns):,}"
    each += " whole turns" if len(turns) == 1 else f" whole turns in each of {len(turns):,} conditions"
    done = dict.fromkeys(sentence for recording in recordings for sentence in recording.done)
    sentences = (f"{each}; rows before, between and after them are not used", *done)
    name = mapped.mapping.name or Path(mapped.file).stem
    return Measurement(name, tuple(_distinct(conditions)), tuple(findings), sentences)


def _distinct(conditions: Sequence[Condition]) -> list[Condition]:
    """Conditions with different names: the file is added where two are alike, then a number."""
    names, renamed = [condition.name for condition in conditions], dict[str, Condition]()
    for condition in conditions:
        name = plain = condition.name
        if names.count(plain) > 1:
            name = plain = f"{plain} ({', '.join(Path(file).stem for file in condition.files)})"
        number = 1
        while name in renamed:
            name, number = f"{plain} {number + 1}", number + 1
        renamed[name] = replace(condition, name=name)
    return list(renamed.values())


class _Recording:
    """One data file on its way to a condition.

    Its turns are found first, and what is wrong of its readings left out; the courses follow when the steps of the
    readings are known from all files.
    """

    def __init__(self, mapping: DataMapping, path: Path, entry: File) -> None:
        self.mapping, self.path, self.entry = mapping, path, entry
        self.findings: list[Finding] = []
        self.done: list[str] = []
        self.sensors: dict[str, channels.Sensor] = {}
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
                say(warning("filter.uneven", "filter", what, "record at a fixed rate, or leave out the filter"))
        for name, channel in mapping.channels.items():
            column = table.columns[channel.column]
            self.readings[name] = np.array(line.rows(column.values))
            self.sensors[name] = channels.sensor_of(name, channel, column, self.readings[name], line, say)
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
        width = channels.WIDTH + int(min(reach / line.step, len(line.seconds)))
        near = slice(max(first - width, 0), int(last) + width)
        for name, channel in mapping.channels.items():
            moves = not channel.measures.startswith("rate:")
            for finding in channels.faults(f"channels.{name}", self.readings[name], self.turns, near, moves):
                say(finding)

    def _doubts(self) -> Iterator[Finding | str]:
        """Whether turns are enough, equally fast and well sampled, and no unloaded stretch reaches into them."""
        turns, positions = self.turns, self.mapping.positions
        if turns.numbers.size < 2:
            what = "has one turn: there is no scatter, so no uncertainty"
            yield warning("turns.one", "turns", what, "record two turns or more")
        speeds = 60 / (turns.end - turns.begin)
        spread = float(np.ptp(speeds) / np.mean(speeds))
        if spread > STEADY + 2 * turns.line.step / float(np.mean(turns.end - turns.begin)):
            what = f"the speed is not steady: {speeds.min():.4g} to {speeds.max():.4g} cycles a minute"
            yield warning("speed.unsteady", "turns", what, "state files: over: to use the steady part")
        if turns.density < DENSE:  # no fault of the readings
            samples = turns.density * positions
            what = f"{samples:.4g} samples a turn for {positions} positions: values are interpolated; means of samples "
            what += f"with up to {int(samples / DENSE)} positions"
            slow = warning if turns.density < SPARSE else note
            yield slow("sampling.slow", "turns", what) if turns.density < 1 else what
        for name, channel in self.mapping.channels.items():
            for low, high in channel.zero.over if isinstance(channel.zero, Zero) else ():
                if inside := int(np.sum((turns.begin < high.value) & (turns.end > low.value))):
                    what = f"the unloaded stretch {low.value:g} to {high.value:g} s reaches into "
                    what, remedy = what + counted(inside, "turn"), "state a stretch without load"
                    yield warning("zero.in_turns", f"channels.{name}.zero", what, remedy)

    def levels(self) -> Iterator[tuple[StepKey, Array]]:
        """Different readings of each channel while the drive runs."""
        for name, sensor in self.sensors.items():
            readings = self.readings[name][self.running]
            yield _key(name, sensor), np.unique(readings[np.isfinite(readings)])[: channels.LOOKED_AT]

    def condition(self, steps: Mapping[StepKey, float]) -> Condition:
        """The condition of the file, with courses and what was set. steps: of the readings."""
        mapping, turns, angle = self.mapping, self.turns, self.angle
        courses = {name: self._signal(name, sensor, steps[_key(name, sensor)]) for name, sensor in self.sensors.items()}
        speed, start, span, duration = np.nan, np.nan, np.nan, mapping.cycle.value
        if not mapping.timed:
            start, span, duration = mapping.start.value, duration, np.nan
            speed = self.sense * span / float(np.mean(turns.end - turns.begin))
            for finding in channels.signs(self.sensors, courses, speed):
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

    def _signal(self, name: str, sensor: channels.Sensor, step: float) -> Signal:
        """The course of a channel, with the accuracy of its sensor."""
        turns, scale, channel, low_pass = self.turns, sensor.scale, sensor.channel, self.mapping.filter
        readings, step, size = self.readings.pop(name), sensor.step or step, abs(scale.factor)
        noise, values = channels.noise_of(readings[self.running]), sensor.quantity(readings)
        angle = values if scale.unit == "rad" else None
        values = values if angle is None else joined(angle)
        if low_pass is not None:
            values = channels.filtered(values, turns.line, low_pass)
        course = resampled(turns, values, angle)
        if low_pass is None:  # the scatter of turns may show less noise than neighbouring readings do
            scatter = float(np.median(between_turns(course))) / size * PASSED * max(turns.density, 1.0) ** 0.5
            noise = min(noise, scatter) if scatter >= 0 else noise
        coarse = bool(step) and noise < step / 2  # more noise carries readings over the steps
        left = left_in_turns(turns, course / (size * step), readings / step, noise / step) if coarse else None
        zero_error = size * sensor.zero_uncertainty
        slope, at_ends, what = channels.drift(turns, course, scale.unit)
        if what and not channel.measures.startswith("rate:"):  # a speed may creep
            if self.mapping.drift == "remove":
                since = float(turns.line.seconds[0]) if np.isnan(sensor.since) else sensor.since
                what += f"; a straight line is subtracted, zero at {since:.4g} s"
                course = resampled(turns, values - slope * (turns.line.seconds - since), angle)
                zero_error = float(np.hypot(zero_error, at_ends))
            remedy = "let sensor and bearings warm up, or state drift: remove"
            self.say(warning("zero.drift_files", f"channels.{name}", what, remedy))
        total = float(np.hypot(size * scale.reading(channel.accuracy.zero, "accuracy.zero"), zero_error))
        accuracy = Accuracy(total, channel.accuracy.gain.value, size * step * coarse, zero_error, datum=sensor.datum)
        read_in = (sensor.unit, scale.raw) if sensor.unit and scale.direct else ("", 1.0)  # not of volts and the like
        signal = Signal(name, channel.measures, scale.unit, course, accuracy, read_in, channel.per_turn or 0)
        # rounded or cut off, which is not known: up to half a step, rectangular
        return replace(signal, accuracy=replace(accuracy, cut=signal.unresolved, left=left))


def _key(name: str, sensor: channels.Sensor) -> StepKey:
    return name, sensor.unit, sensor.scale.factor

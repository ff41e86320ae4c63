"""Data files of a test rig as a Measurement: read by a mapping, checked, cut into turns, and brought to positions."""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from trunnion.errors import Finding, MechanismError, Severity
from trunnion.model.arguments import strict_arguments
from trunnion.rig.reading import channels
from trunnion.rig.reading.angle import coordinate
from trunnion.rig.reading.mapping import DataMapping, File, FromData, Zero, read_mapping
from trunnion.rig.reading.measurement import Accuracy, Condition, Measurement, Signal, between_turns
from trunnion.rig.reading.steps import LeftOfSteps, left_in_turns
from trunnion.rig.reading.tables import DataTable, read_table
from trunnion.rig.reading.timebase import counted, gathered, note, timeline, unit_of, warning
from trunnion.rig.reading.turns import DENSE, Turns, cut, joined, resampled, time_mean
from trunnion.rig.reading.units import dimensions, unit_name

__all__ = ["read_measured"]

Array = NDArray[np.float64]
SPARSE = 0.25  # samples a position, below which nearly all values are interpolated
STEADY = 0.03  # of the mean speed, between the slowest and the fastest turn
PASSED = 1.25  # times what a cubic between samples leaves of white noise, at the least
PERIODS = 5.0  # of the cut-off of a filter, over which a reading reaches
MOST_VALUES = 500  # that a column may state; more, and it is a measurement
DIGITS = 9  # by which two of its values are the same
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
            with recording.failing():
                conditions += recording.conditions(steps)
    findings = mapped.placed([finding for recording in recordings for finding in recording.findings])
    if not conditions or any(recording.failed for recording in recordings):
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


@dataclass
class _Part:
    """One condition of a file.

    texts: numbers of the model that were set, as written, by name; values: the same and what is measured, SI; units:
    of those that were stated with a unit, SI; rows: for which it was set, (row,); courses: of the channels, (turn,
    position); left: what of the error by steps its turns repeat.
    """

    texts: dict[str, str]
    values: dict[str, float]
    units: dict[str, str]
    rows: NDArray[np.bool_]
    turns: Turns = field(init=False)
    courses: dict[str, Array] = field(default_factory=dict)
    left: dict[str, LeftOfSteps] = field(default_factory=dict)

    @property
    def name(self) -> str:
        """By what was set in it; empty where nothing was."""
        return ", ".join(f"{path} {text}" for path, text in self.texts.items())

    @property
    def where(self) -> str:
        """What a finding about the condition is about; its file says which one, where nothing is set."""
        return f"condition {self.name}" if self.texts else "turns"


class _Recording:
    """One data file on its way to conditions.

    Its turns are found first, and what is wrong of its readings left out; the courses follow when the steps of the
    readings are known from all files.
    """

    def __init__(self, mapping: DataMapping, path: Path, entry: File) -> None:
        self.mapping, self.path, self.entry = mapping, path, entry
        self.findings: list[Finding] = []
        self.done: list[str] = []
        self.sensors: dict[str, channels.Sensor] = {}
        self.readings: dict[str, Array] = {}
        self.parts: list[_Part] = []
        self.cycle, self.start = mapping.cycle.value, mapping.start.value
        self.sense, self.lag, self.cut = 1.0, 0.0, 0.0
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
        """Read the file, find the turns of each condition, and leave out what is wrong of the readings in them."""
        mapping, say = self.mapping, self.say
        self.table = _table(self.path, mapping)
        if not self.table.encoding.startswith("utf-8"):
            say(f"read in the encoding {self.table.encoding}")
        self.line = timeline(self.table, mapping.time, say)
        if mapping.filter is not None:
            order, cut_off = mapping.filter.order, mapping.filter.cut_off.value
            passes = f"order {order}, forward and backward, together 3 dB down at {cut_off:g} Hz"
            say(f"low-pass filter: Butterworth of {passes}")
            if not self.line.even:
                what = "the samples are not evenly spaced in time, as a filter needs them"
                say(warning("filter.uneven", "filter", what, "record at a fixed rate, or leave out the filter"))
        for name, channel in mapping.channels.items():
            column = self.table.columns[channel.column]
            self.readings[name] = np.array(self.line.rows(column.values))
            self.sensors[name] = channels.sensor_of(name, channel, column, self.readings[name], self.line, say)
        begin, end = (time.value for time in self.entry.over) if self.entry.over else (-np.inf, np.inf)
        allowed = (self.line.seconds >= begin) & (self.line.seconds <= end)
        share, spoilt = self._cycles(allowed)
        for part in self._settings():
            part.turns = cut(share, self.line, part.rows, allowed, mapping.positions, spoilt, say, part.where)
            if part.turns.numbers.size:
                self.parts.append(part)
                self._check(part)
            else:
                cycles = share[allowed & part.rows & np.isfinite(share)]
                what = f"there is no whole turn: {np.ptp(cycles) if cycles.size else 0:.3g} cycles in "
                what, remedy = what + counted(cycles.size, "row"), "check angle, or record for longer"
                say(Finding(what, part.where, remedy, code="data.turns.none"))
        if self.parts:
            self._find_faults()

    def _cycles(self, allowed: NDArray[np.bool_]) -> tuple[Array, Array]:
        """Cycles gone through by row, and stretches of time in which they are wrong; the sense of the coordinate."""
        mapping, speed = self.mapping, None
        if mapping.timed or mapping.angle is None:
            return self.line.seconds / self.cycle, np.empty((0, 2))
        if (name := mapping.angle.channel) is not None:
            if (unit := self.sensors[name].scale.unit) != "rad/s":
                what = f"the channel '{name}' is a speed in {unit}, not of a turning driver"
                raise MechanismError(Finding(what, "angle.channel", "name one in rpm or rad/s"))
            speed = self.sensors[name].quantity(self.readings[name])
        angle = coordinate(mapping.angle, self.table, self.line, speed, self.say)
        self.lag, self.cut = angle.lag, angle.cut
        finite = np.flatnonzero(np.isfinite(angle.values) & allowed)
        if finite.size < 3:
            raise MechanismError(Finding("no row in use has a coordinate of the driver", "angle", "check angle.column"))
        self.sense = 1.0 if angle.values[finite[-1]] >= angle.values[finite[0]] else -1.0
        backward = np.repeat(self.line.spoilt[:, None], 2, axis=1)  # times
        return self.sense * (angle.values - self.start) / self.cycle, np.concatenate([angle.spoilt, backward])

    def _settings(self) -> list[_Part]:
        """The conditions of the file: one, or as many as the columns that state them take different values."""
        whole = _Part({}, {}, {}, np.ones(self.line.seconds.size, dtype=np.bool_))
        columns: dict[str, tuple[Array, str, float]] = {}  # values, unit and factor to SI
        for path, setting in self.mapping.set.items():
            unit = ""
            if not isinstance(setting, FromData):
                whole.values[path], whole.texts[path], unit = setting.value, str(setting.source), setting.unit
            elif setting.column is not None:
                column = self.table.columns[setting.column]
                unit, factor = unit_of(f"set.{path}", setting.column, column, setting.unit, "", self.say)
                columns[path] = self.line.rows(column.values), unit, factor
            whole.units |= {path: unit_name(dimensions(unit)[1])} if unit else {}
        if not columns:
            return [whole]
        raw = np.column_stack([numbers for numbers, _, _ in columns.values()])
        constant = np.isfinite(raw).all(axis=1)
        if not constant.all():
            what = f"{counted(int(np.count_nonzero(~constant)), 'row')} of {len(raw):,} without a condition; left out"
            self.say(warning("setting.missing", "set", what, "check the column"))
        digits = np.nan_to_num(np.floor(np.log10(np.abs(raw[constant]))), neginf=0.0)
        scale = 10.0 ** (DIGITS - 1 - digits)
        levels, which = np.unique(np.rint(raw[constant] * scale) / scale, axis=0, return_inverse=True)
        if not 0 < len(levels) <= MOST_VALUES:
            what = f"the columns that state the condition have {len(levels):,} different values"
            remedy = "check the column; a measured value is not a setting: write {mean: channel}"
            raise MechanismError(Finding(what, "set", remedy))
        number, parts = np.full(len(raw), -1), []
        number[constant] = which.ravel()
        for k in dict.fromkeys(which.ravel().tolist()):  # in the order of the file
            part = _Part(dict(whole.texts), dict(whole.values), dict(whole.units), number == k)
            for (path, (_, unit, factor)), value in zip(columns.items(), levels[k].tolist(), strict=True):
                part.texts[path], part.values[path] = f"{value:.6g} {unit}".strip(), value * factor
            parts.append(part)
        return parts

    def _check(self, part: _Part) -> None:
        """Whether turns are enough, equally fast and well sampled, and no unloaded stretch reaches into them."""
        turns, say, positions = part.turns, self.say, self.mapping.positions
        if turns.numbers.size < 2:
            what = "has one turn: there is no scatter, so no uncertainty"
            say(warning("turns.one", part.where, what, "record two turns or more"))
        speeds = 60 / (turns.end - turns.begin)
        spread = float(np.ptp(speeds) / np.mean(speeds))
        if spread > STEADY + 2 * self.line.step / float(np.mean(turns.end - turns.begin)):
            what = f"the speed is not steady: {speeds.min():.4g} to {speeds.max():.4g} cycles a minute"
            say(warning("speed.unsteady", part.where, what, "state files: over: to use the steady part"))
        if turns.density < DENSE:  # no fault of the readings
            what = (
                f"{turns.density * positions:.4g} samples a turn for {positions} positions: values are interpolated; "
            )
            what += f"means of samples with up to {int(turns.density * positions / DENSE)} positions"
            slow = warning if turns.density < SPARSE else note
            say(slow("sampling.slow", part.where, what) if turns.density < 1 else what)
        for name, channel in self.mapping.channels.items():
            for low, high in channel.zero.over if isinstance(channel.zero, Zero) else ():
                if inside := int(np.sum((turns.begin < high.value) & (turns.end > low.value))):
                    what = f"the unloaded stretch {low.value:g} to {high.value:g} s reaches into "
                    what, remedy = what + counted(inside, "turn"), "state a stretch without load"
                    say(warning("zero.in_turns", f"channels.{name}.zero", what, remedy))

    def _find_faults(self) -> None:
        """Leave out stuck readings and spikes from before the first turn to after the last."""
        begin, end = (np.sort(np.concatenate([getattr(part.turns, key) for part in self.parts]))
                      for key in ("begin", "end"))  # fmt: skip
        first = int(np.searchsorted(self.line.seconds, begin[0]))
        self.running = slice(first, int(np.searchsorted(self.line.seconds, end[-1], "right")))
        reach = float(np.median(end - begin)) / self.mapping.positions
        reach += PERIODS / self.mapping.filter.cut_off.value if self.mapping.filter is not None else 0.0
        width = channels.WIDTH + int(reach / self.line.step)
        for name, channel in self.mapping.channels.items():
            moves = not channel.measures.startswith("rate:")
            for finding in channels.faults(
                f"channels.{name}", self.readings[name], self.line.seconds, (begin, end), width, moves
            ):
                self.say(finding)

    def levels(self) -> Iterator[tuple[StepKey, Array]]:
        """Different readings of each channel while the drive runs."""
        for name, sensor in self.sensors.items() if self.parts else ():
            readings = self.readings[name][self.running]
            yield _key(name, sensor), np.unique(readings[np.isfinite(readings)])[: channels.LOOKED_AT]

    # ---- courses ----------------------------------------------------------------------------------------------

    def conditions(self, steps: Mapping[StepKey, float]) -> list[Condition]:
        """The conditions of the file, each with its turns. steps: of the readings."""
        if not self.parts:
            return []
        accuracies = {name: self._courses(name, sensor, steps[_key(name, sensor)])
                      for name, sensor in self.sensors.items()}  # fmt: skip
        if not self.mapping.timed:
            together = {name: np.concatenate([part.courses[name] for part in self.parts]) for name in self.sensors}
            zeros = {name: accuracy.zero for name, accuracy in accuracies.items()}
            for finding in channels.signs(self.sensors, together, zeros, self._speed(self.parts)):
                self.say(finding)
        return [self._condition(part, accuracies) for part in self.parts]

    def _courses(self, name: str, sensor: channels.Sensor, step: float) -> Accuracy:
        """Put the courses of a channel into the parts; the accuracy of its sensor."""
        line, size, low_pass = self.line, sensor.size, self.mapping.filter
        readings, step = self.readings.pop(name), sensor.step or step
        noise, values = channels.noise_of(readings[self.running]), sensor.quantity(readings)
        angle = values if sensor.scale.unit == "rad" else None
        values = values if angle is None else joined(angle)
        if low_pass is not None:
            values = channels.filtered(values, line, low_pass)
        for part in self.parts:
            part.courses[name] = resampled(part.turns, values, angle)
        if low_pass is None:  # the scatter of turns may show less noise than neighbouring readings do
            for part in self.parts:
                scatter = float(np.median(between_turns(part.courses[name]))) / size
                scatter *= PASSED * max(part.turns.density, 1.0) ** 0.5
                noise = min(noise, scatter) if scatter >= 0 else noise
        coarse = bool(step) and noise < step / 2  # more noise carries readings over the steps
        for part in self.parts if coarse else ():
            course = part.courses[name] / (size * step)
            part.left[name] = left_in_turns(part.turns, course, readings / step, noise / step)
        zero_error = size * sensor.zero_uncertainty
        parts = [(part.turns, part.courses[name]) for part in self.parts]
        slope, at_ends, what = channels.common_drift(parts, sensor.scale.unit)
        if what and not sensor.channel.measures.startswith("rate:"):  # a speed may creep
            if self.mapping.drift == "remove":
                since = float(line.seconds[0]) if np.isnan(sensor.since) else sensor.since
                what += f"; a straight line is subtracted, zero at {since:.4g} s"
                for part in self.parts:
                    part.courses[name] = resampled(part.turns, values - slope * (line.seconds - since), angle)
                zero_error = float(np.hypot(zero_error, at_ends))
            remedy = "let sensor and bearings warm up, or state drift: remove"
            self.say(warning("zero.drift_files", f"channels.{name}", what, remedy))
        gain, total = sensor.channel.accuracy.gain.value, float(np.hypot(sensor.accuracy, zero_error))
        return Accuracy(total, gain, size * step * coarse, zero_error, datum=sensor.datum)

    def _speed(self, parts: Sequence[_Part]) -> float:
        """Of the driver, with its sign, rad/s."""
        lengths = np.concatenate([part.turns.end - part.turns.begin for part in parts])
        return self.sense * self.cycle / float(np.mean(lengths))

    def _condition(self, part: _Part, accuracies: Mapping[str, Accuracy]) -> Condition:
        """A condition with its courses, and values that are means of channels."""
        mapping, courses = self.mapping, dict[str, Signal]()
        for name, sensor in self.sensors.items():
            course = Signal(name, sensor.channel.measures, sensor.scale.unit, part.courses[name], accuracies[name],
                            sensor.read_in, sensor.channel.per_turn or 0)  # fmt: skip
            cut_off = course.unresolved  # rounded or cut off, which is not known: up to half a step, rectangular
            accuracy = replace(accuracies[name], cut=cut_off, left=part.left.get(name))
            courses[name] = replace(course, accuracy=accuracy)
        speed = np.nan if mapping.timed else self._speed([part])
        for path, setting in mapping.set.items():
            if isinstance(setting, FromData) and setting.mean is not None:
                mean = courses.get(setting.mean)  # else of the angle
                part.values[path], part.units[path] = speed, "rad/s"
                if mean is not None:
                    part.values[path], part.units[path] = time_mean(part.turns, mean.turns), mean.unit
                if mean is not None and not np.isfinite(mean.turns).any():
                    what = f"the channel '{setting.mean}', whose mean it is, has no value in any turn"
                    raise MechanismError(Finding(what, f"set.{path}", "correct the channel, or state it"))
        start, span, duration = (np.nan, np.nan, self.cycle) if mapping.timed else (self.start, self.cycle, np.nan)
        return Condition(
            part.name or self.path.stem, part.values, np.arange(mapping.positions) / mapping.positions, courses,
            (str(self.path),), speed, start, span, lag=self.lag, cut=self.cut, units=part.units, duration=duration,
        )  # fmt: skip


def _key(name: str, sensor: channels.Sensor) -> StepKey:
    return name, sensor.unit, sensor.scale.factor


def _table(path: Path, mapping: DataMapping) -> DataTable:
    """The columns of a file that the mapping names."""
    sources = (mapping.angle, mapping.angle.index if mapping.angle else None, *mapping.channels.values())
    settings = (setting for setting in mapping.set.values() if isinstance(setting, FromData))
    names = [source.column for source in (*sources, *settings) if source is not None and source.column is not None]
    time = [mapping.time.column] if mapping.time and mapping.time.column else []
    if path.suffix.lower() == ".tdms":  # which may state its sampling by itself
        return read_table(path, names, time)
    return read_table(path, [*time, *names])

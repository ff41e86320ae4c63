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
from trunnion.model.quantity import Quantity
from trunnion.model.units import UnitError, si_unit
from trunnion.rig.reading.angle import coordinate
from trunnion.rig.reading.channels import (
    LOOKED_AT,
    WIDTH,
    ChannelReading,
    Zeroed,
    check_filter,
    clipped,
    common_drift,
    faults,
    filtered,
    missing,
    noise_of,
    reading,
    resolution,
    signs,
    speeds,
    steady,
    zeroed,
)
from trunnion.rig.reading.mapping import DataMapping, File, FromData, Zero, read_mapping
from trunnion.rig.reading.measurement import Accuracy, Condition, Measurement, Signal, between_turns
from trunnion.rig.reading.tables import Column, DataTable, read_table
from trunnion.rig.reading.timebase import counted, gathered, note, timeline, warning
from trunnion.rig.reading.turns import DENSE, LeftOfSteps, Turns, cut, joined, left_in_turns, resampled, time_mean
from trunnion.rig.reading.units import dimensions, unit_name

__all__ = ["read_measured"]

Array = NDArray[np.float64]
SPARSE = 0.25  # samples a position, below which nearly all values are interpolated
PASSED = 1.25  # times what a cubic between samples leaves of white noise, at the least
PERIODS = 5.0  # of the cut-off of a filter, over which a reading reaches
UNUSED = 0.5  # of the turns recorded, below which a warning says how few are used
MOST_VALUES = 500  # that a column may state; more, and it is a measurement
DIGITS = 9  # by which two of its values are the same


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
    entries = mapped.files(files)
    recordings: list[_Recording] = []
    conditions: list[Condition] = []
    with np.errstate(over="ignore", invalid="ignore", divide="ignore"):  # of numbers near the end of the floats
        for path, entry in entries:
            recordings.append(_Recording(mapped.mapping.of_file(entry), path, entry))
            with recordings[-1].failing():
                recordings[-1].find_turns()
        steps = _steps(recordings)
        for recording in recordings:
            with recording.failing():
                conditions += recording.conditions(steps)
    findings = mapped.placed([finding for recording in recordings for finding in recording.findings])
    if not conditions or any(recording.failed for recording in recordings):
        raise MechanismError(gathered((one for one in findings if one.severity is not Severity.NOTE), same=True))
    name = mapped.mapping.name or Path(mapped.file).stem
    return Measurement(name, tuple(_distinct(conditions)), tuple(findings), _done(conditions, recordings))


def _steps(recordings: Sequence[_Recording]) -> dict[tuple[object, ...], float]:
    """The step of each channel with one scale, in readings, from the levels of all files that have it.

    A file whose readings span a few steps only does not show them by itself.
    """
    levels: dict[tuple[object, ...], list[Array]] = {}
    for recording in recordings:
        for name, sensor in recording.sensors.items():
            levels.setdefault((name, sensor.unit, sensor.scale.factor), []).append(recording.levels(name))
    return {key: resolution(np.concatenate(rows)) for key, rows in levels.items()}


def _done(conditions: Sequence[Condition], recordings: Sequence[_Recording]) -> tuple[str, ...]:
    """How many turns are used, and what was done to the data, each sentence once."""
    counts = [len(next(iter(one.courses.values())).turns) for one in conditions]
    each = f"{min(counts):,}" if min(counts) == max(counts) else f"{min(counts):,} to {max(counts):,}"
    where = "" if len(counts) == 1 else f" in each of {len(counts):,} conditions"
    sentences = [f"{each} whole turns{where}; rows before, between and after them are not used"]
    for text in dict.fromkeys(text for one in recordings for text in one.done):
        names = [one.path.name for one in recordings if text in one.done]
        some = f"{', '.join(names[:4])}{' …' * (len(names) > 4)}: " if len(names) < len(recordings) else ""
        sentences.append(f"{some}{text}")
    return tuple(sentences)


def _distinct(conditions: Sequence[Condition]) -> list[Condition]:
    """Conditions with different names: the file is added where two are alike, then a number."""
    taken: set[str] = set()
    names = [condition.name for condition in conditions]
    renamed = []
    for condition in conditions:
        name = condition.name
        if names.count(name) > 1 and condition.files:
            name = f"{name} ({', '.join(Path(file).stem for file in condition.files)})"
        plain, number = name, 2
        while name in taken:
            name, number = f"{plain} {number}", number + 1
        taken.add(name)
        renamed.append(replace(condition, name=name))
    return renamed


@dataclass
class _Part:
    """One condition of a file.

    texts: numbers of the model that were set, as written, by name; values: the same and what is measured, SI; units:
    of those that were stated with a unit, SI; means: channels whose mean is the value; window: rows from the first to
    the last for which it was set; rows: those of them for which it was; courses: of the channels, (turn, position);
    left: what of the error by steps its turns repeat.
    """

    texts: dict[str, str]
    values: dict[str, float]
    units: dict[str, str]
    means: dict[str, str]
    window: slice
    rows: NDArray[np.bool_] = field(init=False)
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
    """One data file on its way to conditions."""

    def __init__(self, mapping: DataMapping, path: Path, entry: File) -> None:
        self.mapping, self.path, self.entry = mapping, path, entry
        self.findings: list[Finding] = []
        self.done: list[str] = []
        self.sensors: dict[str, ChannelReading] = {}
        self.parts: list[_Part] = []
        self.cycle, self.start = float(mapping.cycle.evaluate()), float(mapping.start.evaluate())
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

    # ---- readings ---------------------------------------------------------------------------------------------

    def find_turns(self) -> None:
        """Read the file, find the turns of each condition, and leave out what is wrong of the readings in them."""
        mapping, say = self.mapping, self.say
        self.table = _table(self.path, mapping, self.entry)
        if not self.table.encoding.startswith("utf-8"):
            say(f"read in the encoding {self.table.encoding}")
        self.line = timeline(self.table, mapping.time, say)
        if mapping.filter is not None:
            check_filter(mapping.filter, self.line, say)
        self.readings: dict[str, Array] = {}
        self.zeros: dict[str, Zeroed] = {}
        for name, channel in mapping.channels.items():
            column, where = self.table.columns[channel.column], f"channels.{name}"
            sensor = self.sensors[name] = reading(name, channel, column, say)
            values = self.readings[name] = np.array(self.line.rows(column.values))
            say(missing(where, column, values, self.line.seconds))
            if sensor.limit is not None:
                say(clipped(where, values, sensor.limit, sensor.unit, self.line.seconds))
            self.zeros[name] = zeroed(name, channel, sensor, values, self.line, say)
        self.used = np.ones(self.line.seconds.size, dtype=np.bool_)
        if self.entry.over is not None:
            begin, end = (one.value for one in self.entry.over)
            self.used = (self.line.seconds >= begin) & (self.line.seconds <= end)
        share, spoilt = self._cycles()
        for part in self._settings():
            allowed = self.used[part.window] & part.rows
            part.turns = cut(share, self.line, part.window, allowed, mapping.positions, spoilt, say, part.where)
            steps = np.abs(np.diff(share[part.window])[allowed[1:] & allowed[:-1]])
            gone, whole = float(np.nansum(steps[~np.isinf(steps)])), part.turns.numbers.size
            if not whole:
                what = f"there is no whole turn: {gone:.3g} cycles in {counted(int(allowed.sum()), 'row')}"
                say(Finding(what, part.where, "check angle, or record for longer", code="data.turns.none"))
                continue
            if whole < UNUSED * gone - 2:
                what = f"{counted(whole, 'turn')} of {gone:,.0f} recorded can be used"
                say(warning("turns.lost", part.where, what, "correct what the other findings name"))
            self.parts.append(part)
        if self.parts:
            self._check_sampling()
            self._find_faults()

    def _cycles(self) -> tuple[Array, Array]:
        """Cycles gone through by row, and stretches of time in which they are wrong; which way the coordinate runs."""
        mapping, self.way, self.lag, self.cut = self.mapping, 1.0, 0.0, 0.0
        if mapping.timed:
            return self.line.seconds / self.cycle, np.empty((0, 2))
        assert mapping.angle is not None
        speed = None
        if (name := mapping.angle.channel) is not None:
            sensor = self.sensors[name]
            if sensor.scale.unit != "rad/s":
                what = f"the channel '{name}' is a speed in {sensor.scale.unit}, not of a turning driver"
                raise MechanismError(Finding(what, "angle.channel", "name one in rpm or rad/s"))
            sign = mapping.channels[name].sign
            speed = sensor.quantity(self.readings[name], self.zeros[name], sign)
        angle = coordinate(mapping.angle, self.table, self.line, speed, self.say)
        self.lag, self.cut = angle.lag, angle.cut
        known = np.flatnonzero(np.isfinite(angle.values) & self.used)
        if known.size < 3:
            raise MechanismError(Finding("no row in use has a coordinate of the driver", "angle", "check angle.column"))
        self.way = 1.0 if angle.values[known[-1]] >= angle.values[known[0]] else -1.0
        backward = np.repeat(self.line.spoilt[:, None], 2, axis=1)  # times
        return self.way * (angle.values - self.start) / self.cycle, np.concatenate([angle.spoilt, backward])

    def _settings(self) -> list[_Part]:
        """The conditions of the file: one, or as many as the columns that state them take different values."""
        whole, size = _Part({}, {}, {}, {}, slice(0, self.line.seconds.size)), self.line.seconds.size
        columns: dict[str, tuple[Column, float, str]] = {}  # with the factor to SI and the unit
        for path, one in self.mapping.settings(self.entry).items():
            if isinstance(one, Quantity):
                whole.values[path], whole.texts[path] = float(one.evaluate()), str(one.source)
                kind = None if one.expression and one.expression.bare else one.check({})
                whole.units |= {path: si_unit(kind)} if kind is not None else {}
            elif one.mean is not None:
                whole.means[path] = one.mean
            else:
                column = self.table.columns[str(one.column)]
                unit = one.unit or column.unit
                try:
                    factor, exponents = dimensions(unit) if unit else (1.0, {})
                except UnitError as error:
                    remedy = f"state the unit: set: {{{path}: {{column: …, unit: …}}}}; in the file, {error.remedy}"
                    raise MechanismError(Finding(error.what, f"set.{path}", remedy)) from None
                columns[path] = column, factor, unit
                whole.units |= {path: unit_name(exponents)} if unit else {}
        if not columns:
            whole.rows = np.ones(size, dtype=np.bool_)
            return [whole]
        raw = np.column_stack([self.line.rows(column.values) for column, _, _ in columns.values()])
        stated = np.isfinite(raw).all(axis=1)
        if not stated.any():
            what = "the columns that state the condition have no numbers"
            raise MechanismError(Finding(what, "set", "check set: {…: {column: …}}"))
        if not stated.all():
            what = f"{counted(int(np.count_nonzero(~stated)), 'row')} of {size:,} without a condition; left out"
            self.say(warning("setting.missing", "set", what, "check the column"))
        levels, which = np.unique(_rounded(raw[stated]), axis=0, return_inverse=True)
        if len(levels) > MOST_VALUES:
            what = f"the columns that state the condition have {len(levels):,} different values"
            raise MechanismError(Finding(what, "set", "a measured value is not a setting: write {mean: channel}"))
        number, parts = np.full(size, -1), []
        number[stated] = which.ravel()
        for k in dict.fromkeys(which.ravel().tolist()):  # in the order of the file
            rows = np.flatnonzero(number == k)
            window = slice(int(rows[0]), int(rows[-1]) + 1)
            part = _Part(dict(whole.texts), dict(whole.values), dict(whole.units), whole.means, window)
            for (path, (_, factor, unit)), value in zip(columns.items(), levels[k].tolist(), strict=True):
                part.texts[path], part.values[path] = f"{value:.6g} {unit}".strip(), value * factor
            part.rows = number[window] == k
            parts.append(part)
        return parts

    def _check_sampling(self) -> None:
        """How turns are sampled, whether they are enough and equally fast, and stretches without load in them."""
        say, positions = self.say, self.mapping.positions
        for part in self.parts:
            turns = part.turns
            if turns.numbers.size < 2:
                what = "has one turn: there is no scatter, so no uncertainty"
                say(warning("turns.one", part.where, what, "record two turns or more"))
            say(steady(turns, self.line.step, part.where))
            if turns.density < 1:
                samples = f"{turns.density * positions:.4g} samples a turn for {positions} positions"
                what = f"the sampling is slow: {samples}; between them it is interpolated"
                slow = warning if turns.density < SPARSE else note  # no fault of the readings
                say(slow("sampling.slow", part.where, what, "state fewer positions, or sample faster"))
            for name, channel in self.mapping.channels.items():
                for low, high in channel.zero.over if isinstance(channel.zero, Zero) else ():
                    if inside := int(np.sum((turns.begin < high.value) & (turns.end > low.value))):
                        what = f"the unloaded stretch {low.value:g} to {high.value:g} s reaches into "
                        what, remedy = what + counted(inside, "turn"), "state a stretch without load"
                        say(warning("zero.in_turns", f"channels.{name}.zero", what, remedy))
        most = int(min(part.turns.density for part in self.parts) * positions / DENSE)
        averaged = "mean of the samples within half a position to either side"
        by_cubic = f"interpolated by a cubic; with up to {most} positions they are means of samples"
        say(f"values at a position: {averaged if most >= positions else by_cubic}")

    def _find_faults(self) -> None:
        """Leave out stuck readings and spikes from before the first turn to after the last."""
        begin, end = (np.sort(np.concatenate([getattr(one.turns, key) for one in self.parts]))
                      for key in ("begin", "end"))  # fmt: skip
        low = int(np.searchsorted(self.line.seconds, begin[0]))
        high = int(np.searchsorted(self.line.seconds, end[-1], "right"))
        self.running = slice(low, high)
        reach = float(np.median(end - begin)) / self.mapping.positions
        reach += PERIODS / self.mapping.filter.cut_off.value if self.mapping.filter is not None else 0.0
        beside = WIDTH + int(reach / self.line.step)
        for name, channel in self.mapping.channels.items():
            where, readings, moves = f"channels.{name}", self.readings[name], not channel.measures.startswith("rate:")
            for finding in faults(where, readings, self.line.seconds, (begin, end), beside, moves):
                self.say(finding)

    def levels(self, name: str) -> Array:
        """Different readings of a channel while the drive runs."""
        readings = self.readings[name][self.running] if self.parts else np.empty(0)
        return np.unique(readings[np.isfinite(readings)])[:LOOKED_AT]

    # ---- courses ----------------------------------------------------------------------------------------------

    def conditions(self, steps: Mapping[tuple[object, ...], float]) -> list[Condition]:
        """The conditions of the file, each with its turns. steps: of the channels, by name, unit and factor."""
        if not self.parts:
            return []
        channels = self.mapping.channels
        accuracies = {name: self._courses(name, steps) for name in channels}
        together = {name: np.concatenate([part.courses[name] for part in self.parts]) for name in channels}
        if not self.mapping.timed:
            turning = self._speed(self.parts)
            zeros = {name: accuracy.zero for name, accuracy in accuracies.items()}
            units = {name: sensor.shown for name, sensor in self.sensors.items()}
            self.say(speeds(channels, together, units, turning))
            for finding in signs(channels, together, zeros, turning):
                self.say(finding)
        return [self._condition(part, accuracies) for part in self.parts]

    def _courses(self, name: str, steps: Mapping[tuple[object, ...], float]) -> Accuracy:
        """Put the courses of a channel into the parts; the accuracy of its sensor."""
        channel, sensor, zero, line = self.mapping.channels[name], self.sensors[name], self.zeros[name], self.line
        where, size = f"channels.{name}", abs(sensor.scale.factor)
        readings = self.readings.pop(name)
        step = sensor.resolution or steps[name, sensor.unit, sensor.scale.factor]
        noise = noise_of(readings[self.running])
        values = sensor.quantity(readings, zero, channel.sign)
        angle = values if sensor.scale.unit == "rad" else None
        values = values if angle is None else joined(angle)
        if self.mapping.filter is not None:
            values = filtered(values, line, self.mapping.filter)
        for part in self.parts:
            part.courses[name] = resampled(part.turns, values, angle)
        if self.mapping.filter is None:  # the scatter of turns may show less noise than neighbouring readings do
            scatters = (float(np.median(between_turns(part.courses[name]))) / size for part in self.parts)
            rows = [one * max(part.turns.density, 1.0) ** 0.5 for one, part in zip(scatters, self.parts, strict=True)]
            noise = min([noise, *(PASSED * one for one in rows if one >= 0)])
        coarse = bool(step) and noise < step / 2  # more noise carries readings over the steps
        for part in self.parts if coarse else ():
            course = part.courses[name] / (size * step)
            part.left[name] = left_in_turns(part.turns, course, readings / step, noise / step)
        own = size * zero.uncertainty
        parts = [(part.turns, part.courses[name]) for part in self.parts]
        drift = None if channel.measures.startswith("rate:") else common_drift(parts)  # a speed that creeps is real
        if drift is not None:
            remove = self.mapping.drift == "remove"
            since = float(line.seconds[0]) if np.isnan(zero.since) else zero.since
            what = f"drift: the mean of a turn changes by {drift.change:.3g} {sensor.scale.unit} in {drift.span:.4g} s"
            what += f", {abs(drift.change) / max(drift.scatter, 1e-300):.3g} times the scatter of the turns"
            what += f"; a straight line is subtracted, zero at {since:.4g} s" * remove
            remedy = "let sensor and bearings warm up" + ", or state drift: remove" * (not remove)
            self.say(warning("zero.drift_files", where, what, remedy))
            for part in self.parts if remove else ():
                part.courses[name] = resampled(part.turns, values - drift.slope * (line.seconds - since), angle)
            own = float(np.hypot(own, drift.error * drift.span / 2 if remove else 0.0))  # of the line at either end
        datum = sensor.datum(channel.zero, zero.value, channel.sign)
        total = float(np.hypot(sensor.accuracy_zero, own))
        return Accuracy(total, sensor.accuracy_gain, size * step * coarse, own, datum=datum)

    def _speed(self, parts: Sequence[_Part]) -> float:
        """Of the driver, with its sign, rad/s."""
        return (
            self.way * self.cycle / float(np.mean(np.concatenate([one.turns.end - one.turns.begin for one in parts])))
        )

    def _condition(self, part: _Part, accuracies: Mapping[str, Accuracy]) -> Condition:
        """A condition with its courses, and values that are means of channels."""
        mapping, courses = self.mapping, dict[str, Signal]()
        for name, channel in mapping.channels.items():
            sensor, accuracy = self.sensors[name], accuracies[name]
            course = Signal(name, channel.measures, sensor.scale.unit, part.courses[name], accuracy, sensor.read_in,
                            channel.per_turn or 0)  # fmt: skip
            cut_off = course.unresolved  # rounded or cut off, which is not known: up to half a step, rectangular
            courses[name] = replace(course, accuracy=replace(accuracy, cut=cut_off, left=part.left.get(name)))
        speed = np.nan if mapping.timed else self._speed([part])
        for path, name in part.means.items():
            if name not in courses:  # of the angle
                part.values[path], part.units[path] = speed, "rad/s"
                continue
            if not np.isfinite(courses[name].turns).any():
                what = f"the channel '{name}', whose mean it is, has no value in any turn"
                raise MechanismError(Finding(what, f"set.{path}", "correct the channel, or state it"))
            part.values[path], part.units[path] = time_mean(part.turns, courses[name].turns), courses[name].unit
        start, span, duration = self.start, self.cycle, np.nan
        if mapping.timed:
            start, span, duration = np.nan, np.nan, self.cycle
        return Condition(
            part.name or self.path.stem, part.values, np.arange(mapping.positions) / mapping.positions, courses,
            (str(self.path),), speed, start, span, lag=self.lag, cut=self.cut, units=part.units, duration=duration,
        )  # fmt: skip


# ---- helpers --------------------------------------------------------------------------------------------------


def _rounded(values: Array) -> Array:
    """Values to so many significant digits."""
    with np.errstate(divide="ignore", invalid="ignore"):
        digits = np.where(values == 0, 0, np.floor(np.log10(np.abs(values))))
        scale = 10.0 ** (DIGITS - 1 - np.where(np.isfinite(digits), digits, 0))
        return np.asarray(np.rint(values * scale) / scale)


def _table(path: Path, mapping: DataMapping, entry: File) -> DataTable:
    """The columns of a file that the mapping names; a missing one is reported with the entry that names it."""
    named: dict[str, str | None] = {"time.column": mapping.time.column if mapping.time else None}
    if mapping.angle is not None:
        named["angle.column"] = mapping.angle.column
        named["angle.index.column"] = mapping.angle.index.column if mapping.angle.index else None
    named |= {f"channels.{name}.column": channel.column for name, channel in mapping.channels.items()}
    for name, value in mapping.settings(entry).items():
        named[f"set.{name}.column"] = value.column if isinstance(value, FromData) else None
    columns = {where: column for where, column in named.items() if column is not None}
    of_time = "time.column" if path.suffix.lower() == ".tdms" else ""  # which may state its sampling by itself
    needed = [column for where, column in columns.items() if where != of_time]
    try:
        table = read_table(path, needed, [columns[of_time]] if of_time in columns else [])
    except MechanismError as error:
        missing = error.findings[0].figures.get("missing", ())
        where = ", ".join(key for key, column in columns.items() if column in missing)
        raise MechanismError([replace(one, where=where) for one in error.findings]) from None
    texts = (_of_text(where, table, column) for where, column in columns.items() if where != "time.column")
    if findings := [one for one in texts if one is not None]:
        raise MechanismError(findings)
    return table


def _of_text(where: str, table: DataTable, name: str) -> Finding | None:
    """A column most of whose cells are text, and no times; where: the entry that names it."""
    column = table.columns[name]
    numbers = int(np.count_nonzero(~np.isnan(column.values)))
    if column.stamps or column.texts <= numbers:
        return None
    what = f"'{name}' has text in {column.texts:,} cells and a number in {numbers:,}; the first text is "
    remedy, figures = (
        "name a column of numbers; a unit belongs in the heading",
        {"texts": column.texts, "numbers": numbers},
    )
    return Finding(f"{what}'{column.example}'", where, remedy, code="data.readings.text", figures=figures)

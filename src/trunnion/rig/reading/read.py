"""Data files of a test rig as a Measurement: read by a mapping, checked, cut into turns, and brought to positions."""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from trunnion.errors import Finding, MechanismError, Severity
from trunnion.model.arguments import strict_arguments
from trunnion.rig.reading import faults
from trunnion.rig.reading.angle import Coordinate, coordinate
from trunnion.rig.reading.channels import (
    LOOKED_AT,
    ChannelReading,
    Zeroed,
    filtered,
    noise_of,
    read_in,
    reading,
    resolution,
    shown,
    zeroed,
)
from trunnion.rig.reading.columns import DataTable, of_text
from trunnion.rig.reading.files_named import files_of, unused_zero
from trunnion.rig.reading.log import Account, counted, gathered, told
from trunnion.rig.reading.mapping import DataMapping, File, FromData, Zero
from trunnion.rig.reading.mapping_file import read_mapping
from trunnion.rig.reading.measurement import Accuracy, Condition, Measurement, Signal, between_turns
from trunnion.rig.reading.repeated_steps import LeftOfSteps, left_in_turns
from trunnion.rig.reading.sensor_quantity import Amount, dimensions
from trunnion.rig.reading.settings import Setting, dimension_of, settings, stated
from trunnion.rig.reading.signal_checks import Drift, backwards, drift, signs, speeds, steady
from trunnion.rig.reading.tables import read_table
from trunnion.rig.reading.timebase import Timeline, timeline
from trunnion.rig.reading.turns import DENSE, Turns, cut, joined, resampled, time_mean

__all__ = ["read_measured"]

Array = NDArray[np.float64]
FEW_HARMONICS = 5.0
SPARSE = 0.25  # samples a position, below which nearly all values are interpolated
PASSED = 1.25  # times what a cubic between samples leaves of white noise, at the least
PERIODS = 5.0  # of the cut-off of a filter, over which a reading reaches
UNUSED = 0.5  # of the turns recorded, below which it is told how few are used


@strict_arguments
def read_measured(
    mapping: str | os.PathLike[str] | Mapping[str, Any], files: Iterable[str | os.PathLike[str]] | None = None
) -> Measurement:
    """The measurement that a mapping file describes: courses over the cycle, turn by turn, with what is wrong in them.

    mapping: its path, or its entries; files: data files instead of those it names. Faults of the data are findings of
    the result; MechanismError, with every finding, where mapping or files cannot be read or there is no turn at all.
    """
    mapped = read_mapping(mapping)
    conditions: list[Condition] = []
    entries, notes = files_of(mapped, files)
    accounts = [Account(str(path)) for path, _ in entries]
    with np.errstate(over="ignore", invalid="ignore", divide="ignore"):  # of numbers near the end of the floats
        opened: list[_File] = []
        for (path, entry), account in zip(entries, accounts, strict=True):
            with _kept(account):
                opened.append(_File(mapped.mapping.of_file(entry), path, entry, account))
                opened[-1].find_turns()
        steps = _steps(opened)
        for file in opened:
            with _kept(file.account):
                conditions += file.conditions(steps)
    failed = any(account.failed for account in accounts)
    findings = [one for account in accounts for one in account.findings]
    findings = [*findings, *notes, *unused_zero(mapped, [entry for _, entry in entries])]
    findings = mapped.placed(findings)
    if failed or not conditions:
        raise MechanismError(gathered((one for one in findings if one.severity is not Severity.NOTE), same=True))
    name = mapped.mapping.name or Path(mapped.file).stem
    return Measurement(
        name,
        tuple(_distinct(conditions)),
        tuple(findings),
        (_averaged(conditions, accounts), *told(accounts)),
    )


@contextmanager
def _kept(account: Account) -> Iterator[None]:
    """What one file fails by is told with what the others do."""
    try:
        yield
    except MechanismError as error:
        account.findings += [one for one in error.findings if one not in account.findings]
        account.failed = True


def _steps(files: Sequence[_File]) -> dict[tuple[object, ...], float]:
    """The step of each channel with one scale, in readings, from the levels of all files that have it.

    A file whose readings span a few steps only does not tell them by itself.
    """
    levels: dict[tuple[object, ...], list[Array]] = {}
    for file in files:
        for name, own in file.own.items():
            levels.setdefault((name, own.unit, own.scale.factor), []).append(file.levels(name))
    return {key: resolution(np.concatenate(rows)) for key, rows in levels.items()}


def _averaged(conditions: Sequence[Condition], accounts: Sequence[Account]) -> str:
    """How many turns there are, and of how many if some are not used."""
    recorded, lost = sum(one.recorded for one in accounts), sum(one.left_out for one in accounts)
    counts = [next(iter(one.courses.values())).turns.shape[0] for one in conditions]
    each = f"{min(counts):,}" if min(counts) == max(counts) else f"{min(counts):,} to {max(counts):,}"
    where = "" if len(counts) == 1 else f" in each of {len(counts):,} conditions"
    if sum(counts) < recorded - 2 * len(counts):
        where += f", {sum(counts):,}" if len(counts) > 1 else ""
        where += f" of {recorded:,.0f} recorded"
    elif lost:
        where += f", {lost:,} more left out as the findings say"
    return f"{each} whole turns{where}; rows before, between and after them are not used"


def _distinct(conditions: Sequence[Condition]) -> list[Condition]:
    """Conditions with different names: the file is added where two are alike, then a number."""
    found: list[Condition] = []
    names = [one.name for one in conditions]
    for one in conditions:
        name = one.name
        if names.count(name) > 1 and one.files:
            name = f"{name} ({', '.join(Path(file).stem for file in one.files)})"
        plain, number = name, 2
        while any(name == other.name for other in found):
            name, number = f"{plain} {number}", number + 1
        found.append(one if name == one.name else replace(one, name=name))
    return found


@dataclass(frozen=True)
class _Part:
    """One condition of a file: its setting, its turns, the courses of the channels, (turn, position), and by channel
    what of the error by steps its turns repeat."""

    setting: Setting
    turns: Turns
    courses: dict[str, Array]
    left: dict[str, LeftOfSteps]


class _File:
    """One data file on its way to conditions."""

    def __init__(self, mapping: DataMapping, path: Path, entry: File, account: Account) -> None:
        self.mapping, self.entry, self.account, self.path = mapping, entry, account, path
        table = _table(path, mapping, entry)
        for note in table.notes:
            account.say(note)
        for number, text in table.ends.items():
            what = f"the line below the numbers is left out: '{text[:60]}'"
            account.findings.append(
                Finding(what, "", "", Severity.NOTE, file=account.file, line=number, code="data.rows.end")
            )
        self.line: Timeline = timeline(table, mapping.time, account)
        if mapping.filter is not None:
            self._check_filter(table)
        self.own: dict[str, ChannelReading] = {}
        self.lag, self.cut = 0.0, 0.0
        self.readings: dict[str, Array] = {}
        self.steps: dict[str, float] = {}  # SI
        for name, channel in mapping.channels.items():
            column = table.columns[channel.column]
            self.own[name] = reading(name, channel, column, account)
            self.readings[name] = np.array(self.line.rows(column.values))
            where, limit = f"channels.{name}", self.own[name].limit
            faults.cells(where, column, self.readings[name], self.line.seconds, account)
            if limit is not None:
                faults.clipped(where, self.readings[name], limit, self.own[name].unit, self.line.seconds, account)
        self.table = table
        self.parts: list[_Part] = []

    def find_turns(self) -> None:
        """Find the turns of each condition, and leave out what is wrong of the readings in them."""
        mapping, account = self.mapping, self.account
        self.zeros = {
            name: zeroed(
                name, channel, self.own[name], self.readings[name], self.line, mapping.drift == "remove", account
            )
            for name, channel in mapping.channels.items()
        }
        share, self.way, spoilt = self._share(self.zeros)
        cuts, used = [], self._used()
        for setting in settings(mapping, self.entry, self.table, self.line, account):
            allowed = used[setting.window] & setting.rows
            where = _where(setting)
            turns = cut(share, self.line, setting.window, allowed, mapping.positions, spoilt, account, where)
            gone = _gone(share[setting.window], allowed)
            account.recorded += gone
            if turns.numbers.size:
                cuts.append((setting, turns))
                if turns.numbers.size < UNUSED * gone - 2:
                    what = f"{counted(turns.numbers.size, 'turn')} of {gone:,.0f} recorded can be used"
                    account.warn("data.turns.lost", where, what, "correct what the other findings name")
            else:
                what = self._no_turn(share[setting.window], allowed)
                account.error("data.turns.none", where, what, "check angle, or record for longer")
        if not cuts:
            return
        self._check_rows(cuts)
        self._check_zeros(cuts)
        self.parts = [_Part(setting, turns, {}, {}) for setting, turns in cuts]
        begin, end = (np.sort(np.concatenate([getattr(turns, one) for _, turns in cuts])) for one in ("begin", "end"))
        low, high = np.searchsorted(self.line.seconds, begin[0]), np.searchsorted(self.line.seconds, end[-1], "right")
        self.running = slice(int(low), int(high))
        reach = float(np.median(end - begin)) / mapping.positions
        reach += PERIODS / mapping.filter.cut_off.value if mapping.filter is not None else 0.0
        span = faults.FaultSpan(int(low), int(high), begin, end, faults.WIDTH + int(reach / self.line.step))
        for name, channel in mapping.channels.items():
            speed = channel.measures.startswith("rate:")
            faults.signal(f"channels.{name}", self.readings[name], self.line.seconds, span, account, speed)

    def levels(self, name: str) -> Array:
        """Different readings of a channel while the drive runs."""
        readings = self.readings[name][self.running] if self.parts else np.empty(0)
        return np.unique(readings[np.isfinite(readings)])[:LOOKED_AT]

    def conditions(self, steps: Mapping[tuple[object, ...], float]) -> list[Condition]:
        """The conditions of the file, each with its turns. steps: of the channels, by name, unit and factor."""
        if not self.parts:
            return []
        mapping, account, parts, zeros, way = self.mapping, self.account, self.parts, self.zeros, self.way
        drifts = {name: self._channel(name, zeros[name], parts, steps) for name in mapping.channels}
        whole = {name: np.concatenate([part.courses[name] for part in parts]) for name in mapping.channels}
        if not mapping.timed:
            turning = way * self._rate([part.turns for part in parts])
            if not backwards(mapping.channels, [part.setting.values for part in parts], turning, account):
                told = signs(mapping.channels, whole, self._zeros_known(zeros), turning, account)
                units = {name: shown(own) for name, own in self.own.items()}
                speeds(mapping.channels, whole, units, turning, told, account)
        return [self._condition(part, zeros, drifts, way) for part in parts]

    def _zeros_known(self, zeros: Mapping[str, Zeroed]) -> dict[str, float]:
        """Standard uncertainty of the zero of each channel, SI."""
        return {
            name: float(np.hypot(own.accuracy_zero, own.scale.factor * zeros[name].uncertainty))
            for name, own in self.own.items()
        }

    def _named(self, setting: Setting) -> str:
        return setting.name or self.path.stem

    def _used(self) -> NDArray[np.bool_]:
        if self.entry.over is None:
            return np.ones(self.line.seconds.size, dtype=np.bool_)
        begin, end = (one.value for one in self.entry.over)
        return (self.line.seconds >= begin) & (self.line.seconds <= end)

    def _share(self, zeros: Mapping[str, Zeroed]) -> tuple[Array, float, Array]:
        """Cycles gone through by row, which way the coordinate runs, and stretches of time in which it is wrong."""
        mapping = self.mapping
        cycle = float(mapping.cycle.evaluate())
        if mapping.timed:
            return self.line.seconds / cycle, 1.0, np.empty((0, 2))
        assert mapping.angle is not None
        source, speed = mapping.angle, None
        if source.channel is not None:
            name = source.channel
            own = self.own[name]
            if own.scale.unit != "rad/s":
                what = f"the channel '{name}' is a speed in {own.scale.unit}, not of a turning driver"
                raise MechanismError(Finding(what, "angle.channel", "name one in rpm or rad/s", file=self.account.file))
            speed = own.quantity(self.readings[name], zeros[name], mapping.channels[name].sign, self.line.seconds)
        found: Coordinate = coordinate(source, self.table, self.line, speed, self.account)
        self.lag, self.cut = found.lag, found.cut
        known = np.flatnonzero(np.isfinite(found.values) & self._used())
        if known.size < 3:
            what = "no row in use has a coordinate of the driver"
            raise MechanismError(Finding(what, "angle", "check angle.column", file=self.account.file))
        clock = np.repeat(self.line.spoilt[:, None], 2, axis=1)
        way = 1.0 if found.values[known[-1]] >= found.values[known[0]] else -1.0
        start = float(mapping.start.evaluate())
        return way * (found.values - start) / cycle, way, np.concatenate([found.spoilt, clock])

    def _no_turn(self, share: Array, allowed: NDArray[np.bool_]) -> str:
        known = share[np.isfinite(share) & allowed]
        gone = float(np.ptp(known)) if known.size else 0.0
        return f"there is no whole turn: {gone:.3g} cycles in {counted(int(allowed.sum()), 'row')}"

    def _check_filter(self, table: DataTable) -> None:
        assert self.mapping.filter is not None
        rate, cut_off = 1.0 / self.line.step, self.mapping.filter.cut_off.value
        if 2 * cut_off >= rate:
            what = f"the sampling is too slow for the filter: {rate:.6g} Hz, a cut-off of {cut_off:g} Hz"
            remedy = f"state a cut-off below {rate / 2:.4g} Hz, or sample faster"
            raise MechanismError(Finding(what, "filter.cut_off", remedy, file=str(self.path)))
        if cut_off * float(np.ptp(self.line.seconds)) < 2:
            what = f"the cut-off of {cut_off:g} Hz is slower than the recording of {np.ptp(self.line.seconds):.4g} s"
            raise MechanismError(Finding(what, "filter.cut_off", "state a higher one", file=str(self.path)))
        if not self.line.even:
            what = "the samples are not evenly spaced in time, as a filter needs them"
            self.account.warn("data.filter.uneven", "filter", what, "record at a fixed rate, or leave out the filter")
        order = self.mapping.filter.order
        self.account.say(
            f"low-pass filter: Butterworth of order {order}, forward and backward, together 3 dB down at {cut_off:g} Hz"
            f"; gaps up to {100 / cut_off:.3g} ms are bridged for it and stay gaps"
        )

    def _check_rows(self, cuts: Sequence[tuple[Setting, Turns]]) -> None:
        """Tell how turns are sampled, whether they are enough and equally fast, and what the filter leaves of them."""
        account, mapping = self.account, self.mapping
        for setting, turns in cuts:
            where = _where(setting)
            if turns.numbers.size < 2:
                account.warn(
                    "data.turns.one",
                    where,
                    "has one turn: there is no scatter, so no uncertainty",
                    "record two turns or more",
                )
            steady(turns, self.line.step, where, account)
            if turns.density < 1:
                samples = f"{turns.density * mapping.positions:.4g} samples a turn for {mapping.positions} positions"
                what = f"the sampling is slow: {samples}; between them it is interpolated"
                severity = Severity.WARNING if turns.density < SPARSE else Severity.NOTE  # no fault of the readings
                remedy = "state fewer positions, or sample faster"
                account.warn("data.sampling.slow", where, what, remedy, severity)
            length = float(np.mean(turns.end - turns.begin))
            passed = mapping.filter.cut_off.value * length if mapping.filter else np.inf
            if passed < FEW_HARMONICS:
                what = f"the filter leaves the first {passed:.2g} harmonics of a turn"
                account.note("data.filter.harmonics", where, what, "state a higher cut-off")
        most = int(min(turns.density for _, turns in cuts) * mapping.positions / DENSE)
        if most >= mapping.positions:
            account.say("values at a position: mean of the samples within half a position to either side")
            return
        told = most // (size := 10 ** max(len(str(most)) - 2, 0)) * size  # to the two digits that are told
        cubic = "values at a position: interpolated by a cubic between four samples"
        tail = "; of at most {} positions each has four samples, which are averaged"
        account.say(f"{cubic}{tail * (most > 1)}", told if most > 1 else None)

    def _check_zeros(self, cuts: Sequence[tuple[Setting, Turns]]) -> None:
        """Tell of unloaded stretches that reach into turns."""
        for name, channel in self.mapping.channels.items():
            for low, high in channel.zero.over if isinstance(channel.zero, Zero) else ():
                inside = sum(int(np.sum((one.begin < high.value) & (one.end > low.value))) for _, one in cuts)
                if inside:
                    span = f"{low.value:g} to {high.value:g} s"
                    what = f"the unloaded stretch {span} reaches into {counted(inside, 'turn')}"
                    remedy = "state a stretch in which the sensor is not loaded"
                    self.account.warn("data.zero.in_turns", f"channels.{name}.zero", what, remedy)

    def _channel(
        self, name: str, zero: Zeroed, parts: Sequence[_Part], steps: Mapping[tuple[object, ...], float]
    ) -> Drift | None:
        """The courses of a channel, put into the parts; the drift that is left in them."""
        mapping, account, line = self.mapping, self.account, self.line
        channel, own, where = mapping.channels[name], self.own[name], f"channels.{name}"
        readings = self.readings.pop(name)
        step = own.resolution or steps[name, own.unit, own.scale.factor]
        noise = noise_of(readings[self.running])
        values = own.quantity(readings, zero, channel.sign, line.seconds)
        angle = values if own.scale.unit == "rad" else None
        values = values if angle is None else joined(angle)
        if mapping.filter is not None:
            values = filtered(values, line, mapping.filter, account, where)
        for part in parts:
            part.courses[name] = resampled(part.turns, values, angle)
        scatters = [float(np.median(between_turns(part.courses[name]))) / abs(own.scale.factor) for part in parts]
        if mapping.filter is None:
            rows = [one * max(part.turns.density, 1.0) ** 0.5 for one, part in zip(scatters, parts, strict=True)]
            noise = min([noise, *(PASSED * one for one in rows if one >= 0)])
        self.steps[name] = abs(own.scale.factor) * step * (noise < step / 2)  # more noise carries it over them
        if step and noise < step / 2:
            size = abs(own.scale.factor) * step
            for part in parts:
                part.left[name] = left_in_turns(part.turns, part.courses[name] / size, readings / step, noise / step)
        if channel.measures.startswith("rate:"):  # one that creeps is the drive's
            return None
        found = drift([(part.turns, part.courses[name]) for part in parts])
        if found is None:
            return None
        by = f"{found.change:.3g} {own.scale.unit} in {found.span:.4g} s"
        times = f"{abs(found.change) / max(found.scatter, 1e-300):.3g} times the scatter of the turns about the line"
        what, remedy = f"drift: the mean of a turn changes by {by}, {times}", "let sensor and bearings warm up"
        if mapping.drift == "report":
            account.warn("data.zero.drift_files", where, what, f"{remedy}, or state drift: remove")
            return None
        since = float(line.seconds[0]) if np.isnan(zero.since) else zero.since
        account.warn(
            "data.zero.drift_files_removed",
            where,
            f"{what}; a straight line is subtracted, zero at {since:.4g} s",
            remedy,
        )
        for part in parts:
            part.courses[name] = resampled(part.turns, values - found.slope * (line.seconds - since), angle)
        return found

    def _rate(self, turns: Sequence[Turns]) -> float:
        cycle = float(self.mapping.cycle.evaluate())
        return cycle / float(np.mean(np.concatenate([one.end - one.begin for one in turns])))

    def _condition(
        self, part: _Part, zeros: Mapping[str, Zeroed], drifts: Mapping[str, Drift | None], way: float
    ) -> Condition:
        """A condition with its courses, and values that are means of channels."""
        courses = {}
        for name, channel in self.mapping.channels.items():
            own = self.own[name]
            left = drifts[name]
            extra = left.error * left.span / 2 if left else 0.0  # of the line that was taken off, at either end
            of_file = float(np.hypot(abs(own.scale.factor) * zeros[name].uncertainty, extra))
            zero = float(np.hypot(own.accuracy_zero, of_file))
            datum = 0.0
            if isinstance(channel.zero, Amount) and not own.live(channel.zero):
                datum = -zeros[name].value * channel.sign * own.scale.factor
            accuracy = Accuracy(zero, own.accuracy_gain, self.steps[name], of_file, datum=datum)
            course = Signal(name, channel.measures, own.scale.unit, part.courses[name], accuracy, read_in(own))
            cut = course.unresolved  # rounded or cut off, which is not known: up to half a step, rectangular
            courses[name] = replace(course, accuracy=replace(accuracy, cut=cut, left=part.left.get(name)))
        values, known_as = dict(part.setting.values), dict(part.setting.dimensions)
        speed = np.nan if self.mapping.timed else way * self._rate([part.turns])
        for path, channel_name in part.setting.means.items():
            if channel_name not in courses:  # of the angle
                values[path], known_as[path] = speed, dimension_of(dimensions("rad/s")[1], "rad/s")
                continue
            turns = courses[channel_name].turns
            if not np.isfinite(turns).any():
                what = f"the channel '{channel_name}', whose mean it is, has no value in any turn"
                raise MechanismError(
                    Finding(what, f"set.{path}", "correct the channel, or state it", file=str(self.path))
                )
            values[path] = time_mean(part.turns, turns)
            known_as[path] = dimension_of(self.own[channel_name].scale.of_quantity, courses[channel_name].unit)
        positions = self.mapping.positions
        name = self._named(part.setting)
        timed = self.mapping.timed
        start, cycle = (np.nan if timed else float(one.evaluate()) for one in (self.mapping.start, self.mapping.cycle))
        phase = np.arange(positions) / positions
        duration = float(self.mapping.cycle.evaluate()) if timed else np.nan
        return Condition(
            name, values, phase, courses, (str(self.path),), speed, start, cycle,
            lag=self.lag, cut=self.cut, dimensions=known_as, followed=tuple(part.setting.means), duration=duration,
        )  # fmt: skip


def _where(setting: Setting) -> str:
    """What a finding about a condition is about; its file says which one, where nothing is set."""
    return f"condition {setting.name}" if setting.name else "turns"


def _gone(share: Array, allowed: NDArray[np.bool_]) -> float:
    """Cycles gone through in the rows that are allowed."""
    steps = np.diff(share)[allowed[1:] & allowed[:-1]]
    return float(np.sum(np.abs(steps[np.isfinite(steps)])))


def _table(path: Path, mapping: DataMapping, entry: File) -> DataTable:
    """The columns of a file that the mapping names; a missing one is told with the entry that names it."""
    named = _columns(mapping, entry)
    own = "time.column" if path.suffix.lower() == ".tdms" else ""  # which may tell its time by itself
    wanted = [column for where, column in named.items() if where != own]
    try:
        table = read_table(path, wanted, [named[own]] if own in named else [])
    except MechanismError as error:
        told = error.findings[0].what.partition(";")[0] if "there is no column" in error.findings[0].what else ""
        where = ", ".join(key for key, column in named.items() if f"'{column}'" in told)
        raise MechanismError([replace(one, where=where) for one in error.findings]) from None
    texts = (of_text(where, table, column) for where, column in named.items() if where != "time.column")
    if findings := [one for one in texts if one is not None]:
        raise MechanismError(findings)
    return table


def _columns(mapping: DataMapping, entry: File) -> dict[str, str]:
    """Columns that are read, by the entries of the mapping that name them."""
    found: dict[str, str | None] = {"time.column": mapping.time.column if mapping.time else None}
    if mapping.angle is not None:
        found["angle.column"] = mapping.angle.column
        found["angle.index.column"] = mapping.angle.index.column if mapping.angle.index else None
    found |= {f"channels.{name}.column": channel.column for name, channel in mapping.channels.items()}
    for name, one in stated(mapping, entry).items():
        found[f"set.{name}.column"] = one.column if isinstance(one, FromData) else None
    return {where: column for where, column in found.items() if column is not None}

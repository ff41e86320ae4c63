"""A virtual test rig: the model observed through sensors, under a schedule of working conditions.

`observe` solves the model in every condition and draws the errors that the sensors have. The Observation that it
returns makes the readings, condition by condition (`records`), writes them like those of a real rig, with the mapping
that reads them and the truth (`write`), or hands them on as a Measurement.

The machine stands still and unloaded while it is idle, and moves as its drivers say from the first sample after: it is
not brought up to speed, and neither motor nor brake has a dynamics of its own. Sensors do not act back on the machine.
CSV, Parquet and TDMS hold the same numbers to the last bit: they are rounded to what the shortest text of a CSV cell
says before any is written.
"""

from __future__ import annotations

import importlib.util
import math
import os
import tempfile
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any, NamedTuple, Self

import numpy as np
from numpy.typing import NDArray
from ruamel.yaml import YAML

from trunnion.cycle.positions import positions
from trunnion.errors import Finding, MechanismError, Severity, Status, counted
from trunnion.files import guard
from trunnion.measures.evaluation import courses_of
from trunnion.measures.measures import Measure
from trunnion.model.arguments import strict_arguments
from trunnion.model.mechanism import Mechanism
from trunnion.results.quantities import readable
from trunnion.rig.modelled import each, measure_of
from trunnion.rig.reading.measurement import Accuracy, Condition, Measurement, Signal
from trunnion.rig.virtual.rig_file import (
    FORMATS,
    Rig,
    SensorChannel,
    SensorErrors,
    Value,
    draw,
    readings,
    resolved,
    stream,
)  # fmt: skip
from trunnion.solve.friction_method import FrictionMethod
from trunnion.solve.run import Run, prepare
from trunnion.version import __version__

Array = NDArray[np.float64]
MOST_ROWS = 20_000_000
MOST_SEEDS = 1 << 128
EFFICIENCY_STEPS = 720
BEYOND = 0.1  # of a cycle that is recorded before the first and past the last, so that their ends are there
CHUNK = 8_192  # instants at once: memory and cache
DIGITS = 12  # of a share of the cycle, in which instants that are one agree
POSITIONS = (360, 180, 120, 90, 72, 60, 36, 24, 12)  # of a cycle: fewer than samples
FEWER = 0.99
AT_REST = 0.9  # share of the idle stretch that the zero is taken from: a filter carries the run into the rest
DECIMALS = 9  # of the time, s


@dataclass(frozen=True)
class Case:
    """A working condition that the model can be in: what is set, how it is sampled, what is true.

    rate: samples a second; before, running: samples of the idle stretch and of the run; lead: sampling intervals from
    the first sample of the run to the start of its first cycle, a whole number and a half; true: (sensor, sample),
    courses of the run, SI; time, status: of the instants of the cycle at which the model is solved; efficiency: of the
    model, NaN if it has none.
    """

    number: int
    name: str
    settings: Mapping[str, Value]
    run: Run
    rate: float
    before: int
    running: int
    lead: float
    true: Array
    time: Array
    status: NDArray[np.int8]
    efficiency: float = math.nan

    @property
    def worst(self) -> Status:
        """The gravest status of a position."""
        return list(Status)[int(self.status.max())]

    @property
    def rows(self) -> int:
        """Of its file."""
        return self.before + self.running

    @property
    def cycle(self) -> float:
        """Duration of the cycle, s."""
        return self.run.cycle.duration

    @property
    def driver(self) -> str:
        """The first driver."""
        return next(iter(self.run.system.mechanism.drivers))

    @cached_property
    def named(self) -> bool:
        """Whether the first driver turns one way, so that its coordinate names positions."""
        system = self.run.system
        return system.turns(self.driver) and system.span(self.run.values, self.driver).one_way

    @property
    def origin(self) -> float:
        """Sample, counted from the first of the file, at which time is 0: the first, or, where the driver does not name
        positions by its coordinate, the start of the first cycle."""
        return 0.0 if self.named else self.before + self.lead

    def drive(self, sample: int | Array = 0) -> tuple[Array, Array]:
        """Coordinate and rate of the first driver at samples of the run, rad or m."""
        angle, speed, *_ = self.run.system.drive(self.run.values, self.driver, (sample - self.lead) / self.rate)
        return np.asarray(angle, float), np.asarray(speed, float)

    @property
    def speed(self) -> float:
        """Rate of the first driver at the first sample of the run."""
        return float(self.drive()[1].flat[0])

    def __str__(self) -> str:
        """Its number, and what is set."""
        texts = {name: value if isinstance(value, str) else f"{value:.6g}" for name, value in self.settings.items()}
        settings = ", ".join(f"{name} = {text}" for name, text in texts.items()) or "as the model states"
        return f"condition {self.number} ({settings})"


class Record(NamedTuple):
    """The columns of one file, by name; NaN is an empty cell."""

    name: str
    columns: Mapping[str, NDArray[Any]]


@strict_arguments
@dataclass(frozen=True)
class Observation:
    """A rig put to a mechanism: conditions with their true courses, sensors with the errors they have in fact.

    Readings are made when they are asked for, and are the same every time. cases: the conditions that the model can be
    in; skipped: the numbers, from 1, of the others.
    """

    mechanism: Mechanism
    rig: Rig
    seed: int
    channels: Mapping[str, SensorChannel]
    cases: tuple[Case, ...]
    skipped: tuple[int, ...]
    findings: tuple[Finding, ...]

    @cached_property
    def drawn(self) -> Mapping[str, SensorErrors]:
        """The errors of the sensors."""
        return {name: draw(channel, self.seed) for name, channel in self.channels.items()}

    def seeded(self, seed: int) -> Self:
        """The same with the random numbers of another seed: other errors of the sensors, other noise."""
        check_seed(seed)
        return replace(self, seed=int(seed))

    @property
    def rows(self) -> int:
        """Rows of all files."""
        return sum(case.rows for case in self.cases)

    @property
    def units(self) -> dict[str, str]:
        """Unit of every column that has one."""
        return {"t": "s"} | {channel.column: channel.reading for channel in self.channels.values()}

    def records(self) -> Iterator[Record]:
        """The readings of every condition, one after the other."""
        for case in self.cases:
            time = np.round((np.arange(case.rows) - case.origin) / case.rate, DECIMALS)
            columns: dict[str, NDArray[Any]] = {"t": time}
            if encoder := self.rig.encoder:
                angle, _ = case.drive(np.maximum(np.arange(case.rows) - case.before, 0))
                count = np.floor(angle * (encoder.per_turn / (2 * np.pi)) + 1e-9).astype(np.int64)
                columns[encoder.column] = count
                if encoder.index:  # it rises at coordinate 0, whichever way the shaft turns
                    last = encoder.per_turn - 1 if case.speed < 0 else 0
                    columns[encoder.index] = (count % encoder.per_turn == last).astype(np.int64)
            columns |= {self.channels[name].column: values for name, values in self._readings(case).items()}
            yield Record(case.name, columns)

    def _readings(self, case: Case) -> dict[str, Array]:
        """Readings by sensor, in their units, the idle stretch included."""
        values = {}
        for (name, channel), course in zip(self.channels.items(), case.true, strict=True):
            true = np.concatenate([np.full(case.before, 0.0 if channel.at_rest else course[0]), course])
            noise = stream(self.seed, case.number, name, "noise").standard_normal(case.rows)
            running = slice(case.before, case.rows)
            values[name] = readings(channel, true, running, case.rate, self.drawn[name], noise)
        return values

    def accuracy(self, name: str) -> Accuracy:
        """What a laboratory that knows its sensors states of one, in the unit measured.

        The zero after what it reads idle is taken off: while it runs, of the mean of the idle stretch, of the offset if
        there is no such stretch, and of the drift until the end of the longest file, as a rectangular distribution
        (GUM 4.3.7).
        """
        channel, longest = self.channels[name], max(self.cases, key=lambda case: case.rows)
        idle = channel.noise / math.sqrt(longest.before) if channel.zeroed and longest.before else channel.offset
        zero = math.hypot(channel.zero, abs(channel.drift) * longest.rows / longest.rate / math.sqrt(3), idle)
        rests = channel.at_rest and all(case.before for case in self.cases)  # else all files have one offset
        own = math.sqrt(max(zero - channel.zero, 0.0) * (zero + channel.zero)) if rests else 0.0
        return Accuracy(zero, channel.gain, channel.step, own)

    def measurement(self, positions: int = 360) -> Measurement:
        """The readings as a Measurement, without files in between: the angle is the true one."""
        phase, turns, conditions = np.arange(positions) / positions, np.arange(self.rig.schedule.turns)[:, None], []
        for case in self.cases:
            at, courses = case.before + case.lead + (turns + phase) * case.cycle * case.rate, {}
            for name, values in self._readings(case).items():
                channel, values = self.channels[name], values / self.channels[name].per
                zero = float(np.mean(values[: case.before])) if channel.zeroed and case.before else 0.0
                by_turn = np.interp(at.ravel(), np.arange(case.rows), values - zero).reshape(at.shape)
                courses[name] = Signal(name, channel.sensor.measures, channel.unit, by_turn, self.accuracy(name),
                                       per_turn=channel.sensor.per_turn or 0)  # fmt: skip
            settings = {**self.rig.set_, **case.settings}
            changed = self.mechanism.with_values(settings)
            values_set = {name: float(np.ravel(changed.parameters()[changed.path_of(name)])[0]) for name in settings}
            conditions.append(Condition(case.name, values_set, phase, courses, (), case.speed))
        return Measurement(self.rig.name, tuple(conditions), self.findings, ("made by a virtual rig, not read",))

    def mapping(self, form: str = "") -> dict[str, Any]:
        """The mapping that reads the files: what a laboratory knows, and no more than that."""
        first, encoder, files = self.cases[0], self.rig.encoder, []
        for case in self.cases:
            entry: dict[str, Any] = {"file": f"{case.name}.{form or self.rig.format}"}
            if case.settings:
                entry["set"] = dict(case.settings)
            if case.before and not (encoder and first.named):  # the time alone tells the position: when it ran
                ends = (case.before - case.origin, case.rows - 1 - case.origin)
                entry["over"] = [f"{end / case.rate:.9g} s" for end in ends]
            files.append(entry)
        cycle: dict[str, Any] = {"cycle": f"{first.cycle:.15g} s"}
        if first.named:
            ends = first.run.system.drive(first.run.values, first.driver, np.array([0.0, first.cycle]))[0]
            begin, end = np.broadcast_to(np.degrees(np.asarray(ends, float)), 2).tolist()
            angle: dict[str, Any]
            if encoder:
                angle = {"from": "pulses", "column": encoder.column, "per_turn": encoder.per_turn, "kind": encoder.kind}
                angle |= {"index": {"column": encoder.index}} if encoder.index else {}
            else:
                zero, rate = (float(item.flat[0]) for item in first.drive(-first.before))
                angle = {"from": "time", "speed": f"{rate:.15g} rad/s", "zero": f"{math.degrees(zero):.12g} deg"}
            cycle = {"angle": angle}
            if abs(abs(end - begin) - 360) > 1e-9:
                cycle["cycle"] = f"{abs(end - begin):.12g} deg"
            if begin:
                cycle["start"] = f"{begin:.12g} deg"
        least = min(case.cycle * case.rate for case in self.cases)
        positions = next((item for item in POSITIONS if item < least * FEWER), POSITIONS[-1])
        return {
            "trunnion-data": 1, "name": self.rig.name or self.mechanism.name, "files": files,
            **({"set": dict(self.rig.set_)} if self.rig.set_ else {}),
            "time": {"column": "t", "unit": "s"},
            **cycle,
            **({"positions": positions} if positions != POSITIONS[0] else {}),
            "channels": {name: self._entry(name) for name in self.channels},
        }  # fmt: skip

    def _entry(self, name: str) -> dict[str, Any]:
        """A channel of the mapping."""
        channel, case, zero = self.channels[name], self.cases[0], self.accuracy(name).zero
        sensor = channel.sensor
        entry: dict[str, Any] = {"column": channel.column, "measures": sensor.measures, "unit": channel.reading}
        if sensor.sensitivity:
            entry["gain"] = sensor.sensitivity.source
        if channel.zeroed and case.before > 1:
            rest = (-case.origin, AT_REST * case.before - case.origin)
            entry["zero"] = {"over": [f"{item / case.rate + 0.0:.6g} s" for item in rest]}
        if sensor.range:
            entry["range"] = sensor.range.source
        if sensor.per_turn:
            entry["per_turn"] = sensor.per_turn
        accuracy: dict[str, Any] = {"gain": sensor.accuracy.gain.source} if channel.gain else {}
        if channel.noise <= channel.step / 2:  # which does not carry readings over the steps of the converter
            zero = math.hypot(zero, channel.step / math.sqrt(12))  # GUM F.2.2.1
        if zero:
            accuracy["zero"] = f"{zero:.4g} {channel.unit}"
        return entry | ({"accuracy": accuracy} if accuracy else {})

    def truth(self) -> dict[str, Any]:
        """What was drawn and what is true, in SI: to check what is found from the files, not to find it."""
        sensors, conditions = {}, []
        for name, channel in self.channels.items():
            errors = self.drawn[name]
            sensors[name] = {
                "measures": channel.sensor.measures, "unit": channel.unit, "gain_error": errors.gain,
                "zero_error": errors.zero, "offset": errors.offset,
                "drift_per_second": float(f"{channel.drift:.12g}"), "noise": float(f"{channel.noise:.12g}"),
                "step": float(f"{channel.step:.12g}"),
            }  # fmt: skip
        for case in self.cases:
            first = math.ceil(case.lead)  # the first sample that lies in the first cycle
            part = slice(first, first + round(self.rig.schedule.turns * case.cycle * case.rate))
            means = {name: float(np.mean(row[part])) for name, row in zip(self.channels, case.true, strict=True)}
            efficiency = case.efficiency if math.isfinite(case.efficiency) else None
            conditions.append({"name": case.name, "set": dict(case.settings), "efficiency": efficiency,
                               "cycle_seconds": case.cycle, "mean": means})  # fmt: skip
        parameters = self.mechanism.parameters().items()
        return {
            "trunnion-truth": 1, "made_by": f"trunnion {__version__}", "model": self.mechanism.name,
            "model_hash": self.mechanism.digest, "seed": self.seed, "sensors": sensors, "conditions": conditions,
            **({"left_out": list(self.skipped)} if self.skipped else {}),
            "parameters": {path: float(np.ravel(value)[0]) for path, value in parameters if np.size(value) == 1},
        }  # fmt: skip

    def write(
        self, folder: str | os.PathLike[str], form: str = "", progress: Callable[[int], None] | None = None
    ) -> list[str]:
        """Write a file for each condition, `mapping.yaml` and `truth.yaml` into a folder, once all are complete.

        Parameters
        ----------
        folder : made if it is not there.
        form : csv, parquet or tdms, that of the rig file if not given.
        progress : called with the files written.

        Returns
        -------
        The names of the files.
        """
        form, folder, names = form or self.rig.format, Path(folder), []
        check_form(form)
        check_folder(self.rig, folder, form)
        home = next(item for item in (folder, *folder.absolute().parents) if item.exists())
        if not home.is_dir():
            raise MechanismError(Finding("cannot be made a folder: it is a file", str(home), "name a folder"))
        try:
            with tempfile.TemporaryDirectory(prefix=".rig-", dir=home, ignore_cleanup_errors=True) as new:
                for done, record in enumerate(self.records(), 1):
                    names.append(f"{record.name}.{form}")
                    WRITERS[form](record, self.units, Path(new) / names[-1])
                    if progress:
                        progress(done)
                for name, entries in ((MAPPING, self.mapping(form)), (TRUTH, self.truth())):
                    names.append(name)
                    yaml = YAML(typ="safe", pure=True)
                    yaml.allow_unicode, yaml.width = True, 118
                    yaml.sort_base_mapping_type_on_output = False  # type: ignore[assignment]  # keys as stated
                    yaml.default_flow_style = None if name == MAPPING else False  # the innermost groups on one line
                    with (Path(new) / name).open("w", encoding="utf-8", newline="\n") as stream:
                        stream.write(HEADS[name])
                        yaml.dump(entries, stream)
                folder.mkdir(parents=True, exist_ok=True)
                for path in sorted(Path(new).iterdir()):
                    path.replace(folder / path.name)
        except OSError as error:
            what = f"cannot be written: {error.strerror or error}"
            raise MechanismError(Finding(what, str(folder), "make room there, or name another folder")) from None
        return names


def check_seed(seed: int) -> None:
    """MechanismError for what seeds no random numbers."""
    if not 0 <= seed < MOST_SEEDS:
        raise MechanismError(Finding(f"the seed {seed} is no whole number from 0", "seed", "give one such as 1"))


@strict_arguments
@np.errstate(all="ignore")  # of numbers near the end of the floats: what has no value is NaN, and its status says so
def observe(
    mechanism: Mechanism,
    rig: Rig | Mapping[str, Any] | str | os.PathLike[str],
    seed: int = 1,
    progress: Callable[[int], None] | None = None,
) -> Observation:
    """Put a rig to a mechanism: solve the model in all conditions of the schedule, draw the errors of the sensors.

    A condition that the model cannot be in at every position, because it locks or does not go together, is left out,
    and a finding says which and why.

    Parameters
    ----------
    mechanism : the model.
    rig : a Rig, the entries of a rig file, or its path.
    seed : of all random numbers: the same seed, the same readings to the last bit.
    progress : called with the conditions done.

    Raises
    ------
    MechanismError
        For a rig that does not fit the mechanism, or if no condition is left.
    """
    check_seed(seed)
    if not isinstance(rig, Rig):
        rig = Rig(**rig) if isinstance(rig, Mapping) else Rig.read(rig)
    with _placed("set"):
        mechanism = mechanism.with_values(dict(rig.set_)) if rig.set_ else mechanism
    rows = rig.schedule.rows()
    cases: list[Case] = []
    for number, (name, row) in enumerate(zip(rig.names, rows, strict=True), 1):
        with _placed(f"schedule.{f'conditions.{number - 1}' if rig.schedule.conditions else 'over'}", number):
            run = prepare(mechanism.with_values(dict(row)) if row else mechanism)
        measures, channels = _sensors(rig, run)
        cases.append(_case(number, name, row, run, rig, measures, channels))
        if progress:
            progress(number)
    findings = tuple(_findings(cases, channels, rig))
    sound = tuple(case for case in cases if case.worst.solved)
    if not sound:
        what = f"none of the {len(rows)} conditions can" if len(rows) > 1 else "the condition cannot"
        remedy = "choose conditions in which the model has a solution at every position"
        raise MechanismError([*findings, Finding(f"{what} be measured", "schedule", remedy)])
    if any(finding.severity is Severity.ERROR for finding in findings):
        raise MechanismError(findings)
    skipped = tuple(case.number for case in cases if not case.worst.solved)
    return Observation(mechanism, rig, int(seed), channels, sound, skipped, findings)


@contextmanager
def _placed(where: str, number: int = 0) -> Iterator[None]:
    """What the model says of values that are set in a rig file: there, and in which condition."""
    try:
        yield
    except MechanismError as error:
        tail = f" (in condition {number})" if number else ""
        raise MechanismError(
            replace(finding, what=f"{f'{finding.where}: ' if finding.where else ''}{finding.what}{tail}", where=where)
            for finding in error.findings
        ) from None


def _sensors(rig: Rig, run: Run) -> tuple[list[Measure], dict[str, SensorChannel]]:
    """What each sensor measures, and the sensors in the units of that; MechanismError with all that does not fit."""
    mechanism, system, sensors = run.system.mechanism, run.system, rig.sensors.items()
    measures = each(sensors, lambda item: measure_of(mechanism, run, item[0], item[1].measures, section="sensors"))
    if run.determinacy is not None and not all(measure.of_motion for measure in measures):
        run.determinacy.refuse()
    pairs = zip(sensors, measures, strict=True)
    channels = each(pairs, lambda item: resolved(*item[0], item[1].unit(system)))
    driver = next(iter(mechanism.drivers), None)
    if driver is None or run.cycle.duration <= 0:
        raise MechanismError(Finding("the mechanism has no driver that moves", "schedule", "give the model a driver"))
    if not run.cycle.periodic and rig.schedule.turns > 1:
        what = f"the cycle of {driver} ends elsewhere than it starts: it cannot run {rig.schedule.turns} times on end"
        raise MechanismError(Finding(what, "schedule.turns", "state turns: 1"))
    if rig.encoder and not (system.turns(driver) and system.span(run.values, driver).one_way):
        what = f"an encoder needs a driver that turns in one direction, {driver} does not"
        raise MechanismError(Finding(what, "encoder", "remove the encoder: positions then follow from the time"))
    return measures, {channel.name: channel for channel in channels}


def _case(
    number: int, name: str, row: Mapping[str, Value], run: Run, rig: Rig, measures: Sequence[Measure],
    channels: Mapping[str, SensorChannel],
) -> Case:  # fmt: skip
    """One condition with its true courses. The idle time is taken to a whole number of samples."""
    rate, cycle = rig.rate.value, run.cycle
    before = math.ceil(rig.schedule.idle.value * rate - 1e-9)
    # Samples lie half an interval off the start of the cycle, so that edges of pulses that fall on samples otherwise
    # lie between them: a sampling clock knows nothing of the shaft.
    lead = math.ceil(BEYOND * cycle.duration * rate) - 0.5 if cycle.periodic else 0.0
    running = math.floor(cycle.duration * rate + 1e-9) + 1
    if cycle.periodic:
        running = math.ceil(lead) + math.ceil((rig.schedule.turns + BEYOND) * cycle.duration * rate)
    if before + running > MOST_ROWS:
        what = f"condition {number} takes {before + running:,} rows, a file at most {MOST_ROWS:,}"
        raise MechanismError(Finding(what, "rate", "sample more slowly, or fewer turns"))
    if running < 3:
        what = f"a cycle of condition {number} takes {cycle.duration:.4g} s, no three samples"
        raise MechanismError(Finding(what, "rate", "sample faster"))
    time, place = np.minimum(np.arange(running) / rate, cycle.duration), np.arange(running)
    if cycle.periodic:
        time, place = phases(cycle.duration, rate, running, lead)
    values, status = _solved(run, measures, time)
    case = Case(number, name, row, run, rate, before, running, lead, values[:, place], time, status)
    if not case.worst.solved:
        return case
    for course, channel in zip(values, channels.values(), strict=True):
        if channel.sensor.per_turn and np.min(course) < 0 < np.max(course):
            what = f"in {case} the speed changes its sign, which pulses do not show"
            remedy = "remove per_turn, or measure another joint"
            raise MechanismError(Finding(what, f"sensors.{channel.name}.per_turn", remedy))
    return replace(case, efficiency=positions(run, EFFICIENCY_STEPS, margin=False).means.efficiency)


# ---- true courses ----------------------------------------------------------------------------------------------


def phases(duration: float, rate: float, count: int, lead: float = 0.0) -> tuple[Array, NDArray[np.intp]]:
    """Distinct times (s) in the cycle of `count` samples, ascending, and the place of each sample among them.

    lead: how many sampling intervals the first comes before the start of the cycle.
    """
    share = np.round(np.mod((np.arange(count) - lead) / (duration * rate), 1.0), DIGITS) % 1.0
    distinct, place = np.unique(share, return_inverse=True)
    return distinct * duration, place


def _solved(run: Run, measures: Sequence[Measure], time: Array) -> tuple[Array, NDArray[np.int8]]:
    """Courses of measures, (measure, instant), at ascending times (s) of the cycle, with pins in their seats; status.

    Where a load or friction is an interval, at a speed of zero, a course is the mean of its neighbours; a load whose
    joint rests at several positions on end is 0 there: nothing moves against it.
    """
    single, periodic = list({measure.name: measure for measure in measures}.values()), run.cycle.periodic
    values, status = np.empty((len(measures), len(time))), np.empty(len(time), np.int8)
    for low in range(0, len(time), CHUNK):
        part = slice(low, low + CHUNK)
        curves, status[part] = courses_of(run, single, time[part], FrictionMethod())
        for row, measure in zip(values, measures, strict=True):
            row[part] = curves[measure.name][0]
    lost = status >= Status.NOT_CONVERGED
    values[:, lost] = np.nan
    for row, measure in zip(values, measures, strict=True) if not lost.any() else ():
        gaps = ~np.isfinite(row)
        if measure.kind == "load":
            before, after = np.roll(gaps, 1), np.roll(gaps, -1)
            if not periodic:
                before[0] = after[-1] = False
            row[gaps & (before | after)] = 0.0  # of more than one position; at the ends of a period too
        finite = np.isfinite(row)
        if finite.any() and not finite.all():
            period = run.cycle.duration * periodic or None
            row[~finite] = np.interp(time[~finite], time[finite], row[finite], period=period)
    return values, status


# ---- findings -------------------------------------------------------------------------------------------------


def _findings(cases: Sequence[Case], channels: Mapping[str, SensorChannel], rig: Rig) -> Iterator[Finding]:
    """Conditions that cannot be, and what sensors do not show; each kind once."""
    where = "schedule.conditions" if rig.schedule.conditions else "schedule.over"
    for status in sorted({case.worst for case in cases if not case.worst.solved}, reverse=True):
        stopped = [case for case in cases if case.worst == status]
        case, lost = stopped[0], np.flatnonzero(stopped[0].status >= Status.NOT_CONVERGED)
        what = f"{_which(stopped)} left out: {status.text}; in condition {case.number} at {len(lost)} of "
        what += f"{counted(len(case.status), 'position')}, first at "
        what += f"{360 * case.time[lost[0]] / case.cycle:.4g}° of the cycle"
        remedy = "run `trunnion analyse` with these values to see where in the cycle, and why"
        yield Finding.warning("rig.no_answer", where, what, remedy)
    if not (sound := [case for case in cases if case.worst.solved]):
        return
    named = [case for case in sound if case.named]
    if not rig.encoder and len({case.speed > 0 for case in named}) > 1:
        what = "the conditions turn in both directions, which only a count of pulses shows"
        yield Finding.error("rig.both_ways", "encoder", what, "state an encoder, or one rig for each direction")
    if not rig.encoder and named and np.ptp([case.cycle for case in sound]) > 1e-9 * named[0].cycle:
        what = f"the conditions differ in speed, and nothing measures the angle of {named[0].driver}"
        yield Finding.error("rig.no_angle", "encoder", what, "state an encoder")
    for i, (name, channel) in enumerate(channels.items()):
        peaks, limit = [float(np.max(np.abs(case.true[i]))) for case in sound], min(channel.range, channel.span)
        if clipped := [case for case, peak in zip(sound, peaks, strict=True) if peak > limit]:
            highest, most = (readable(size, channel.unit) for size in (max(peaks), limit))
            what = f"{_which(clipped)}: {channel.sensor.measures} reaches {highest}, beyond the range of {most}: "
            where = f"sensors.{name}.{'range' if limit == channel.range else 'span'}"
            yield Finding.warning("rig.clipped", where, f"{what}readings are clipped", "use a sensor of larger range")


def _which(cases: Sequence[Case]) -> str:
    """The first condition with what is set, and how many others."""
    return str(cases[0]) + (f" and {counted(len(cases) - 1, 'other')}" if len(cases) > 1 else "")


# ---- files -----------------------------------------------------------------------------------------------------

MAPPING, TRUTH = "mapping.yaml", "truth.yaml"
HEADS = {
    MAPPING: "# What the columns of the data files measure: for `trunnion data`, `compare` and `identify`.\n",
    TRUTH: "# True values and random errors of the virtual rig, in SI, to check results obtained from the files.\n",
}
PACKAGES = {"parquet": "pyarrow", "tdms": "nptdms"}


def check_form(form: str) -> None:
    """MechanismError for a format that is none, or whose package is not there."""
    if form not in FORMATS:
        raise MechanismError(Finding(f"'{form}' is no format of data files", "format", f"use {', '.join(FORMATS)}"))
    if form in PACKAGES and importlib.util.find_spec(PACKAGES[form]) is None:
        raise MechanismError(Finding(f"{form} needs {PACKAGES[form]}", "format", f"pip install 'trunnion[{form}]'"))


def check_folder(rig: Rig, folder: str | os.PathLike[str], form: str) -> None:
    """MechanismError if a file of a rig would be written over one that is read, or over one that no rig has written.

    What is in a folder with a truth that a rig has written is a rig's: its files are written anew.
    """
    paths = [Path(folder) / name for name in (*(f"{name}.{form or rig.format}" for name in rig.names), MAPPING, TRUTH)]
    for path in paths:
        guard(path)
    truth, strange = paths[-1], [path.name for path in paths if path.exists()]
    if strange and not (truth.is_file() and truth.read_bytes().startswith(HEADS[TRUTH].encode())):
        what = f"{', '.join(strange[:3])}{' …' * (len(strange) > 3)} would be written over, and is of no virtual rig"
        raise MechanismError(Finding(what, str(folder), "name another folder, or move away what is there"))


def _csv(record: Record, units: Mapping[str, str], path: Path) -> None:
    """Text, a column's unit in brackets behind its name, in quotes where it needs them; an empty cell: no reading."""
    head = [f"{name} [{units[name]}]" if name in units else name for name in record.columns]
    with path.open("w", encoding="utf-8", newline="") as stream:
        quoted = ('"{}"'.format(name.replace('"', '""')) if set(name) & set(',;"#') else name for name in head)
        stream.write(",".join(quoted) + "\n")
        texts = [["" if item != item else repr(item) for item in row.tolist()] for row in record.columns.values()]
        stream.write("\n".join(map(",".join, zip(*texts, strict=True))) + "\n")


def _parquet(record: Record, units: Mapping[str, str], path: Path) -> None:
    import pyarrow as pa
    import pyarrow.parquet as pq

    columns = {name: pa.array(values, from_pandas=True) for name, values in record.columns.items()}  # NaN as null
    fields = [pa.field(name, column.type, metadata={"unit": units[name]} if name in units else None)
              for name, column in columns.items()]  # fmt: skip
    pq.write_table(pa.table(list(columns.values()), schema=pa.schema(fields)), path)


def _tdms(record: Record, units: Mapping[str, str], path: Path) -> None:
    from nptdms import ChannelObject, RootObject, TdmsWriter

    objects = [ChannelObject("rig", name, values, properties={"unit_string": units[name]} if name in units else {})
               for name, values in record.columns.items()]  # fmt: skip
    with TdmsWriter(str(path)) as stream:
        stream.write_segment([RootObject(properties={"name": record.name}), *objects])


WRITERS: dict[str, Callable[[Record, Mapping[str, str], Path], None]] = {
    "csv": _csv, "parquet": _parquet, "tdms": _tdms,
}  # fmt: skip

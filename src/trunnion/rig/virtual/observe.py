"""A virtual test rig: the model observed through sensors, under a schedule of working conditions.

`observe` puts a rig to a mechanism: it solves the model in every condition and draws the errors that the sensors have.
The Observation that it returns makes the readings, condition by condition (`records`), and writes them like those of a
real rig, with the mapping that reads them and the truth (`write`); or it hands them on as a Measurement.

The machine stands still and unloaded while it is idle, and moves as its drivers say from the first sample after: it is
not brought up to speed, and neither motor nor brake has a dynamics of its own. Sensors do not act back on the machine.
"""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from trunnion.errors import Finding, MechanismError, Severity, Status, counted
from trunnion.measures.measures import Measure, named
from trunnion.model.arguments import strict_arguments
from trunnion.model.mechanism import Mechanism
from trunnion.results.quantities import readable
from trunnion.rig.modelled import without_course
from trunnion.rig.reading.measurement import Accuracy, Condition, Measurement, Signal
from trunnion.rig.reading.rig_file import Rig, Value
from trunnion.rig.virtual import files
from trunnion.rig.virtual.files import case_names, speed_differs
from trunnion.rig.virtual.sensors import (
    SensorChannel,
    SensorErrors,
    draw,
    index_level,
    level,
    pulses,
    readings,
    resolved,
    stream,
)  # fmt: skip
from trunnion.rig.virtual.true_signals import SampledSignals, cycle_efficiency, sampled
from trunnion.solve.run import Run, prepare

__all__ = ["Case", "Observation", "Record", "observe"]

Array = NDArray[np.float64]
MOST_SEEDS = 1 << 128
PER_SECOND = {"s": 1.0, "ms": 1e3, "us": 1e6}
TIME_DECIMALS = {"s": 9, "ms": 6, "us": 3}
MOST_ROWS = 20_000_000
MOST_NAMED = 20  # conditions in one finding
BEYOND = 0.1  # of a cycle that is recorded before the first and past the last, so that their ends are there


@dataclass(frozen=True)
class Case:
    """A working condition that the model can be in: what is set, how it is sampled, what is true.

    before, running, after: samples of the idle stretches and of the run; lead: sampling intervals from the first sample
    of the run to the start of its first cycle, a whole number and a half; efficiency: of the model, NaN if it has none.
    """

    number: int
    name: str
    settings: Mapping[str, Value]
    run: Run
    before: int
    running: int
    after: int
    lead: float
    true: SampledSignals
    efficiency: float = math.nan

    @property
    def worst(self) -> Status:
        """The gravest status of a position."""
        return max(one for one in Status if np.any(self.true.status == one))

    @property
    def rows(self) -> int:
        return self.before + self.running + self.after

    @property
    def first(self) -> int:
        """The first sample of the run that lies in its first cycle."""
        return math.ceil(self.lead)

    @property
    def part(self) -> slice:
        """Samples at which the machine runs."""
        return slice(self.before, self.before + self.running)

    @property
    def driver(self) -> str:
        """The first driver."""
        return next(iter(self.run.system.mechanism.drivers))

    @property
    def named(self) -> bool:
        """Whether the first driver turns one way, so that its coordinate names positions."""
        system = self.run.system
        return system.turns(self.driver) and system.span(self.run.values, self.driver).one_way

    @property
    def origin(self) -> float:
        """Sample, counted from the first of the file, at which time is 0: the first, or, where the driver does not name
        positions by its coordinate, the start of the first cycle."""
        return 0.0 if self.named else self.before + self.lead

    def drive(self, rate: float, sample: int = 0) -> tuple[float, float]:
        """Coordinate and rate of the first driver at a sample of the run, rad or m."""
        angle, speed, *_ = self.run.system.drive(self.run.values, self.driver, (sample - self.lead) / rate)
        return float(np.ravel(angle)[0]), float(np.ravel(speed)[0])

    def __str__(self) -> str:
        """Its number, and what is set."""
        texts = {name: value if isinstance(value, str) else f"{value:.6g}" for name, value in self.settings.items()}
        stated = ", ".join(f"{name} = {text}" for name, text in texts.items()) or "as the model states"
        return f"condition {self.number} ({stated})"


@dataclass(frozen=True)
class Record:
    """The columns of one file, by name; NaN is an empty cell. settings: what is set in it, as in the rig file."""

    name: str
    settings: Mapping[str, Value]
    columns: Mapping[str, NDArray[Any]]


@dataclass(frozen=True)
@strict_arguments
class Observation:
    """A rig put to a mechanism: conditions with their true courses, sensors with the errors they have in fact.

    Readings are made when they are asked for, and are the same every time. skipped: conditions, by number from 1, that
    the model cannot be in.
    """

    mechanism: Mechanism
    rig: Rig
    seed: int
    channels: Mapping[str, SensorChannel]
    drawn: Mapping[str, SensorErrors]
    cases: tuple[Case, ...]
    skipped: tuple[int, ...]
    findings: tuple[Finding, ...]

    def seeded(self, seed: int) -> Self:
        """The same with the random numbers of another seed: other errors of the sensors, other noise."""
        check_seed(seed)
        drawn = {name: draw(channel, int(seed)) for name, channel in self.channels.items()}
        return replace(self, seed=int(seed), drawn=drawn)

    @property
    def rate(self) -> float:
        """Samples a second."""
        return self.rig.rate.value

    @cached_property
    def rows(self) -> int:
        """Rows of all files."""
        return sum(case.rows for case in self.cases)

    def records(self) -> Iterator[Record]:
        """The readings of every condition, one after the other."""
        return (self.record(case) for case in self.cases)

    def record(self, case: Case) -> Record:
        """The readings of one condition."""
        rig, unit = self.rig, self.rig.time.unit
        time = (np.arange(case.rows) - case.origin) / self.rate * PER_SECOND[unit]
        columns: dict[str, NDArray[Any]] = {rig.time.column: np.round(time, TIME_DECIMALS[unit])}
        if rig.encoder:
            sample = np.clip(np.arange(case.rows) - case.before, 0, case.running - 1)
            drive = case.run.system.drive(case.run.values, case.driver, (sample - case.lead) / self.rate)
            angle, zero = np.asarray(drive[0], float), float(rig.encoder.zero.evaluate())
            signal = pulses if rig.encoder.kind == "count" else level
            columns[rig.encoder.column] = signal(angle, rig.encoder.per_turn, zero)
            if rig.encoder.index:
                columns[rig.encoder.index] = index_level(angle, rig.encoder.per_turn, zero)
        columns |= {self.channels[name].column: values for name, values in self._readings(case).items()}
        return Record(case.name, case.settings, columns)

    def perfect(self, case: Case) -> dict[str, Array]:
        """Readings in their units without random errors: what bandwidth, pulses and range leave."""
        return self._readings(case, perfect=True)

    def _readings(self, case: Case, perfect: bool = False) -> dict[str, Array]:
        values = {}
        for i, (name, channel) in enumerate(self.channels.items()):
            course = case.true.at_samples(i)
            ends = (0.0, 0.0) if channel.at_rest else (course[0], course[-1])
            true = np.concatenate([np.full(case.before, ends[0]), course, np.full(case.after, ends[1])])
            if perfect:
                channel, noise, drawn = replace(channel, drift=0.0, step=0.0), None, SensorErrors(0.0, 0.0, 0.0)
            else:
                noise = stream(self.seed, case.number, name, "noise").standard_normal(case.rows)
                drawn = self.drawn[name]
            values[name] = readings(channel, true, case.part, self.rate, drawn, noise)
        return values

    def zero_uncertainty(self, name: str) -> float:
        """Standard uncertainty of the zero of a sensor after what it reads idle is taken off, in the unit measured.

        While it runs, of the mean of the idle stretch, of the offset if there is no such stretch, and of the drift
        until the end of the longest file, as a rectangular distribution (GUM 4.3.7).
        """
        channel = self.channels[name]
        longest = max(self.cases, key=lambda case: case.rows)
        idle = channel.noise / math.sqrt(longest.before) if channel.zeroed and longest.before else channel.offset
        return math.hypot(channel.zero, abs(channel.drift) * longest.rows / self.rate / math.sqrt(3), idle)

    def accuracy(self, name: str) -> Accuracy:
        """What a laboratory that knows its sensors states of one."""
        channel, zero = self.channels[name], self.zero_uncertainty(name)
        rests = channel.at_rest and all(case.before for case in self.cases)  # else all files have one offset
        own = math.sqrt(max(zero - channel.zero, 0.0) * (zero + channel.zero)) if rests else 0.0
        return Accuracy(zero, channel.gain, channel.step, own)

    def measurement(self, positions: int = 360) -> Measurement:
        """The readings as a Measurement, without files in between: the angle is the true one."""
        phase, turns, conditions = np.arange(positions) / positions, self.rig.schedule.turns, []
        for case in self.cases:
            cycle = case.run.cycle.duration * self.rate
            at = case.before + case.lead + (np.arange(turns)[:, None] + phase) * cycle
            courses = {}
            for name, values in self._readings(case).items():
                channel, values = self.channels[name], values / self.channels[name].per
                zero = float(np.mean(values[: case.before])) if channel.zeroed and case.before else 0.0
                by_turn = np.interp(at.ravel(), np.arange(case.rows), values - zero).reshape(at.shape)
                courses[name] = Signal(name, channel.measures, channel.unit, by_turn, self.accuracy(name))
            stated = {**self.rig.set_, **case.settings}
            settings = {name: _si(self.mechanism, name, value) for name, value in stated.items()}
            speed = case.drive(self.rate)[1]
            conditions.append(Condition(case.name, settings, phase, courses, (), speed))
        return Measurement(self.rig.name, tuple(conditions), self.findings, ("made by a virtual rig, not read",))

    def mapping(self, form: str = "") -> dict[str, Any]:
        """The mapping that reads the files; see `files.mapping_of`."""
        return files.mapping_of(self, form or self.rig.format)

    def truth(self) -> dict[str, Any]:
        """What was drawn and what is true; see `files.truth_of`."""
        return files.truth_of(self)

    def write(
        self, folder: str | os.PathLike[str], form: str = "", progress: Callable[[int], None] | None = None
    ) -> list[str]:
        """Write a file for each condition, `mapping.yaml` and `truth.yaml` into a folder; their names.

        form: csv, parquet or tdms, that of the rig file if not given; progress: called with the files written.
        """
        return files.write(self, folder, form or self.rig.format, progress)


def check_seed(seed: int) -> None:
    """MechanismError for what seeds no random numbers."""
    if not 0 <= seed < MOST_SEEDS:
        raise MechanismError(Finding(f"the seed {seed} is no whole number from 0", "seed", "give one such as 1"))


def _si(mechanism: Mechanism, name: str, value: Value) -> float:
    """What is set, in SI."""
    changed = mechanism.with_values({name: value})
    return float(np.ravel(changed.parameters()[changed.path_of(name)])[0])


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
    channels: dict[str, SensorChannel] = {}
    cases: list[Case] = []
    for number, (name, row) in enumerate(zip(case_names(len(rows)), rows, strict=True), 1):
        key = f"conditions.{number - 1}" if rig.schedule.conditions else "over"
        with _placed(f"schedule.{key}", number):
            run = prepare(mechanism.with_values(dict(row)) if row else mechanism)
        measures = _measures(rig, run)
        channels = channels or _channels(rig, run, measures)
        cases.append(_case(number, name, row, run, rig, measures, channels))
        if progress:
            progress(number)
    findings = tuple(_findings(cases, channels, rig))
    sound = tuple(case for case in cases if case.worst.solved)
    if not sound:
        what = f"none of the {len(rows)} conditions can" if len(rows) > 1 else "the condition cannot"
        remedy = "choose conditions in which the model has a solution at every position"
        raise MechanismError([*findings, Finding(f"{what} be measured", "schedule", remedy)])
    if any(one.severity is Severity.ERROR for one in findings):
        raise MechanismError(findings)
    skipped = tuple(case.number for case in cases if not case.worst.solved)
    drawn = {name: draw(channel, int(seed)) for name, channel in channels.items()}
    return Observation(mechanism, rig, int(seed), channels, drawn, sound, skipped, findings)


@contextmanager
def _placed(where: str, number: int = 0) -> Iterator[None]:
    """What the model says of values that are set in a rig file: there, and in which condition."""
    try:
        yield
    except MechanismError as error:
        tail = f" (in condition {number})" if number else ""
        raise MechanismError(
            replace(one, what=f"{f'{one.where}: ' if one.where else ''}{one.what}{tail}", where=where)
            for one in error.findings
        ) from None


# ---- what the rig makes of the mechanism ----------------------------------------------------------------------


def _measures(rig: Rig, run: Run) -> list[Measure]:
    """What each sensor measures; MechanismError with all that the model has no course of."""
    measures: list[Measure] = []
    findings: list[Finding] = []
    for name, sensor in rig.sensors.items():
        where = f"sensors.{name}.measures"
        try:
            measure = named(run.system.mechanism, [sensor.measures], run.values)[0]
        except MechanismError as error:
            findings += [replace(one, where=where) for one in error.findings]
            continue
        if not measure.everywhere or not measure.single(run.system):
            what = f"'{sensor.measures}' is no number that a sensor shows at every instant{without_course(measure)}"
            remedy = "write effort:DRIVER, rate:JOINT, load:LOAD, rotation:JOINT, slide:JOINT or link.point.x"
            findings.append(Finding(what, where, remedy))
        measures.append(measure)
    if findings:
        raise MechanismError(findings)
    if run.determinacy is not None and not all(one.of_motion for one in measures):
        run.determinacy.refuse()
    return measures


def _channels(rig: Rig, run: Run, measures: Sequence[Measure]) -> dict[str, SensorChannel]:
    """The sensors in the units of what they measure; MechanismError with all that does not fit."""
    channels: dict[str, SensorChannel] = {}
    findings: list[Finding] = []
    for (name, sensor), measure in zip(rig.sensors.items(), measures, strict=True):
        try:
            channels[name] = resolved(name, sensor, rig.column(name), measure.unit(run.system))
        except MechanismError as error:
            findings += error.findings
    driver = next(iter(run.system.mechanism.drivers), None)
    if driver is None or run.cycle.duration <= 0:
        remedy = "give the model a driver"
        findings.append(Finding("the mechanism has no driver that moves", "schedule", remedy))
    elif not run.cycle.periodic and rig.schedule.turns > 1:
        what = f"the cycle of {driver} ends elsewhere than it starts: it cannot run {rig.schedule.turns} times on end"
        findings.append(Finding(what, "schedule.turns", "state turns: 1"))
    if driver and rig.encoder and not (run.system.turns(driver) and run.system.span(run.values, driver).one_way):
        what, remedy = f"an encoder needs a driver that turns in one direction, {driver} does not", "remove the encoder"
        findings.append(Finding(what, "encoder", f"{remedy}: positions then follow from the time"))
    if findings:
        raise MechanismError(findings)
    return channels


def _case(
    number: int,
    name: str,
    row: Mapping[str, Value],
    run: Run,
    rig: Rig,
    measures: Sequence[Measure],
    channels: Mapping[str, SensorChannel],
) -> Case:
    """One condition with its true courses. The idle times are taken to a whole number of samples."""
    rate, cycle, pauses = rig.rate.value, run.cycle, rig.schedule.pauses
    before, after = (math.ceil(float(one.evaluate()) * rate - 1e-9) for one in (pauses.before, pauses.after))
    # Samples lie half an interval off the start of the cycle, so that edges of pulses that fall on samples otherwise
    # lie between them: a sampling clock knows nothing of the shaft.
    lead = math.ceil(BEYOND * cycle.duration * rate) - 0.5 if cycle.periodic else 0.0
    running = math.floor(cycle.duration * rate + 1e-9) + 1
    if cycle.periodic:
        running = math.ceil(lead) + math.ceil((rig.schedule.turns + BEYOND) * cycle.duration * rate)
    if before + running + after > MOST_ROWS:
        what = f"condition {number} takes {before + running + after:,} rows, a file at most {MOST_ROWS:,}"
        raise MechanismError(Finding(what, "rate", "sample more slowly, or fewer turns"))
    if running < 3:
        what = f"a cycle of condition {number} takes {cycle.duration:.4g} s, no three samples"
        raise MechanismError(Finding(what, "rate", "sample faster"))
    tolerances = {i: max(one.step, one.noise) / 10 for i, one in enumerate(channels.values())}
    true = sampled(run, measures, rate, running, lead, tolerances)
    case = Case(number, name, row, run, before, running, after, lead, true)
    if not case.worst.solved:
        return case
    for course, (sensor, channel) in zip(true.values, channels.items(), strict=True):
        if channel.per_turn and np.min(course) < 0 < np.max(course):
            what = f"in {case} the speed changes its sign, which pulses do not show"
            remedy = "remove per_turn, or measure another joint"
            raise MechanismError(Finding(what, f"sensors.{sensor}.per_turn", remedy))
    return replace(case, efficiency=cycle_efficiency(run))


# ---- findings -------------------------------------------------------------------------------------------------


def _findings(cases: Sequence[Case], channels: Mapping[str, SensorChannel], rig: Rig) -> Iterator[Finding]:
    """Conditions that cannot be, and what sensors do not show; each kind once."""
    where = "schedule.conditions" if rig.schedule.conditions else "schedule.over"
    for status in reversed(Status):
        stopped = [case for case in cases if case.worst == status]
        if stopped and not status.solved:
            case = stopped[0]
            places = np.flatnonzero(case.true.status >= Status.NOT_CONVERGED)
            first = 360 * case.true.time[places[0]] / case.run.cycle.duration
            share = f"{len(places)} of {counted(len(case.true.status), 'position')}, first at {first:.4g}° of the cycle"
            yield Finding(
                f"{_which(stopped)} {'is' if len(stopped) == 1 else 'are'} left out: {status.text}; in condition "
                f"{case.number} at {share}", where,
                "run `trunnion analyse` with these values to see where in the cycle, and why", Severity.WARNING,
                code="rig.no_answer",
            )  # fmt: skip
    sound = [case for case in cases if case.worst.solved]
    if not sound:
        return
    if mended := [case for case in sound if case.true.mended]:
        most = counted(max(case.true.mended for case in mended), "position")
        what = f"{_which(mended)}: a load has no unique value at up to {most}, because its joint is at rest; sensors "
        what += "read 0 during a rest, and the mean of the neighbours at a single position"
        yield Finding(what, where, "", Severity.NOTE, code="rig.load_at_rest")
    yield from _of_encoder(sound, channels, rig)
    for i, (name, channel) in enumerate(channels.items()):
        peaks = {case.number: float(np.max(np.abs(case.true.values[i]))) for case in sound}
        if clipped := [case for case in sound if peaks[case.number] > channel.limit]:
            key = "range" if channel.limit == channel.range else "span"
            peak, limit = (readable(size, channel.unit) for size in (max(peaks.values()), channel.limit))
            what = f"{_which(clipped)}: {channel.measures} reaches {peak}, beyond the range of {limit}: readings are "
            remedy = "use a sensor with a larger range"
            yield Finding(f"{what}clipped", f"sensors.{name}.{key}", remedy, Severity.WARNING, code="rig.clipped")


def _of_encoder(cases: Sequence[Case], channels: Mapping[str, SensorChannel], rig: Rig) -> Iterator[Finding]:
    """Whether the angle of the driver can be known from what is recorded."""
    driver, encoder, rate = cases[0].driver, rig.encoder, rig.rate.value
    if encoder is not None and encoder.kind == "level":
        spans = {case.number: float(case.run.system.span(case.run.values, driver).peak) / (2 * np.pi) for case in cases}
        lost = [case for case in cases if 4 * spans[case.number] * encoder.per_turn > rate * (1 + 1e-9)]
        if lost:
            most = max(spans.values()) * encoder.per_turn
            what = f"{_which(lost)}: some encoder pulses are lost: up to {most:.4g} pulses per second, sampled at "
            remedy = "use a sampling rate of four times the pulse rate, or record kind: count"
            yield Finding(f"{what}{rate:.4g} Hz", "encoder.kind", remedy, Severity.WARNING, code="rig.pulses_lost")
    both = "the conditions turn in both directions"
    if len({case.drive(rate)[1] > 0 for case in cases if case.named}) > 1:
        if encoder is None:
            remedy = "state an encoder of kind: count, or one rig for each direction"
            what = f"{both}, and no channel measures the angle of the driver"
            yield Finding(what, "encoder", remedy, code="rig.both_ways")
        elif encoder.kind == "level":
            what = f"{both}, which the level of an encoder does not distinguish"
            yield Finding(what, "encoder.kind", "record kind: count", code="rig.both_ways_level")
    known = encoder or any(one.measures == f"rate:{driver}" for one in channels.values())
    if not known and speed_differs(cases):
        what = f"the conditions differ in speed, and no channel measures the angle of {driver}"
        yield Finding(what, "encoder", f"state an encoder, or a sensor of rate:{driver}", code="rig.no_angle")


def _which(cases: Sequence[Case]) -> str:
    """Conditions by number, the first with what is set."""
    if len(cases) == 1:
        return str(cases[0])
    numbers = ", ".join(str(case.number) for case in cases[1:MOST_NAMED])
    more = f" and {len(cases) - MOST_NAMED} more" if len(cases) > MOST_NAMED else ""
    return f"{cases[0]} and condition{'s' * (len(cases) > 2)} {numbers}{more}"

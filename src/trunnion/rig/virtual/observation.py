"""What a virtual rig has recorded: its working conditions, the errors of its sensors, and the readings they make."""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from trunnion.cycle.positions import positions
from trunnion.errors import Finding, MechanismError, Status
from trunnion.measures.evaluation import courses_of
from trunnion.measures.measures import Measure
from trunnion.model.arguments import strict_arguments
from trunnion.model.mechanism import Mechanism
from trunnion.rig.reading.measurement import Accuracy, Condition, Measurement, Signal
from trunnion.rig.reading.rig_file import Rig, Value
from trunnion.rig.virtual import files
from trunnion.rig.virtual.sensors import SensorChannel, SensorErrors, draw, index_level, level, pulses, readings, stream
from trunnion.solve.friction_method import FrictionMethod
from trunnion.solve.run import Run
from trunnion.version import __version__

__all__ = [
    "Case", "Observation", "SampledSignals", "check_seed", "cycle_efficiency", "phases", "sampled",
    "speed_differs",
]  # fmt: skip

Array = NDArray[np.float64]
MOST_SEEDS = 1 << 128
PER_SECOND = {"s": 1.0, "ms": 1e3, "us": 1e6}
TIME_DECIMALS = {"s": 9, "ms": 6, "us": 3}
POSITIONS = (360, 180, 120, 90, 72, 60, 36, 24, 12)  # of a cycle: fewer than samples
FEWER = 0.99
AT_REST = 0.9  # share of the idle stretch that the zero is taken from: a filter carries the run into the rest


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

    @property
    def rows(self) -> int:
        """Rows of all files."""
        return sum(case.rows for case in self.cases)

    def records(self) -> Iterator[files.Record]:
        """The readings of every condition, one after the other."""
        return (self._record(case) for case in self.cases)

    def _record(self, case: Case) -> files.Record:
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
        return files.Record(case.name, case.settings, columns)

    def _readings(self, case: Case) -> dict[str, Array]:
        """Readings by sensor, in their units, idle stretches included."""
        values = {}
        for i, (name, channel) in enumerate(self.channels.items()):
            course = case.true.at_samples(i)
            ends = (0.0, 0.0) if channel.at_rest else (course[0], course[-1])
            true = np.concatenate([np.full(case.before, ends[0]), course, np.full(case.after, ends[1])])
            noise = stream(self.seed, case.number, name, "noise").standard_normal(case.rows)
            values[name] = readings(channel, true, case.part, self.rate, self.drawn[name], noise)
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
                courses[name] = Signal(name, channel.measures, channel.unit, by_turn, self.accuracy(name),
                                       per_turn=channel.per_turn)  # fmt: skip
            stated = {**self.rig.set_, **case.settings}
            changed = self.mechanism.with_values(stated)
            settings = {name: float(np.ravel(changed.parameters()[changed.path_of(name)])[0]) for name in stated}
            speed = case.drive(self.rate)[1]
            conditions.append(Condition(case.name, settings, phase, courses, (), speed))
        return Measurement(self.rig.name, tuple(conditions), self.findings, ("made by a virtual rig, not read",))

    def mapping(self, form: str = "") -> dict[str, Any]:
        """The mapping that reads the files: what a laboratory knows, and no more than that."""
        return _mapping_of(self, form or self.rig.format)

    def truth(self) -> dict[str, Any]:
        """What was drawn and what is true, in SI: to check what is found from the files, not to find it."""
        return _truth_of(self)

    @property
    def units(self) -> dict[str, str]:
        """Unit of every column that has one."""
        units = {self.rig.time.column: self.rig.time.unit}
        return units | {channel.column: channel.reading for channel in self.channels.values()}

    def write(
        self, folder: str | os.PathLike[str], form: str = "", progress: Callable[[int], None] | None = None
    ) -> list[str]:
        """Write a file for each condition, `mapping.yaml` and `truth.yaml` into a folder; their names.

        form: csv, parquet or tdms, that of the rig file if not given; progress: called with the files written.
        """
        form = form or self.rig.format
        files.check_form(form)
        files.check_folder(self.rig, folder, form)
        texts = {files.MAPPING: self.mapping(form), files.TRUTH: self.truth()}
        return files.write(self.records(), self.units, texts, folder, form, progress)


def check_seed(seed: int) -> None:
    """MechanismError for what seeds no random numbers."""
    if not 0 <= seed < MOST_SEEDS:
        raise MechanismError(Finding(f"the seed {seed} is no whole number from 0", "seed", "give one such as 1"))


def speed_differs(cases: Sequence[Case]) -> bool:
    """Whether the first driver runs one way and not as fast in all conditions."""
    durations = [case.run.cycle.duration for case in cases]
    one_way = cases[0].run.system.span(cases[0].run.values, cases[0].driver).one_way
    return one_way and max(durations) - min(durations) > 1e-9 * max(durations)


# ---- mapping and truth ----------------------------------------------------------------------------------------------


def _mapping_of(observation: Observation, form: str) -> dict[str, Any]:
    rig = observation.rig
    found: dict[str, Any] = {"trunnion-data": 1, "name": rig.name or observation.mechanism.name}
    angle = _angle(observation)
    timed = angle.get("angle", {}).get("from") == "time" or "angle" not in angle
    found["files"] = [_file(observation, case, form, timed) for case in observation.cases]
    if rig.set_:
        found["set"] = dict(rig.set_)
    found["time"] = {"column": rig.time.column, "unit": rig.time.unit}
    found |= angle
    least = min(case.run.cycle.duration for case in observation.cases) * observation.rate
    positions = next((one for one in POSITIONS if one < least * FEWER), POSITIONS[-1])
    if positions != POSITIONS[0]:
        found["positions"] = positions
    found["channels"] = {name: _channel(observation, name) for name in observation.channels}
    return found


def _file(observation: Observation, case: Case, form: str, timed: bool) -> dict[str, Any]:
    """A file with what was set, its zero of an encoder, and where the time alone tells the position, when it ran."""
    found: dict[str, Any] = {"file": f"{case.name}.{form}"}
    if case.settings:
        found["set"] = dict(case.settings)
    if observation.rig.encoder and (zero := _counted_from(observation, case)) != _counted_from(observation):
        found["angle"] = {"zero": f"{math.degrees(zero):.12g} deg"}
    if timed and case.rows > case.running:
        ends = (case.before - case.origin, case.before + case.running - 1 - case.origin)
        found["over"] = [f"{end / observation.rate:.9g} s" for end in ends]
    return found


def _angle(observation: Observation) -> dict[str, Any]:
    """Where the coordinate of the driver comes from, and what a cycle is."""
    case = observation.cases[0]
    run, driver = case.run, case.driver
    duration = run.cycle.duration
    if not case.named:
        return {"cycle": f"{duration:.15g} s"}
    first, last = (float(np.ravel(run.system.drive(run.values, driver, time)[0])[0]) for time in (0.0, duration))
    found: dict[str, Any] = {"angle": _source(observation, case)}
    extent = math.degrees(abs(last - first))
    if abs(extent - 360) > 1e-9:
        found["cycle"] = f"{extent:.12g} deg"
    if first:
        found["start"] = f"{math.degrees(first):.12g} deg"
    return found


def _source(observation: Observation, case: Case) -> dict[str, Any]:
    """The encoder if there is one, else a constant speed, else a measured one."""
    rate, encoder = observation.rate, observation.rig.encoder
    if encoder:
        found: dict[str, Any] = {"from": "pulses", "column": encoder.column, "per_turn": encoder.per_turn}
        found["kind"] = encoder.kind
        if encoder.kind == "level" and case.drive(rate)[1] < 0:
            found["sign"] = -1
        if zero := _counted_from(observation):
            found["zero"] = f"{math.degrees(zero):.12g} deg"
        if encoder.index:
            found["index"] = {"column": encoder.index}
        return found
    if speed_differs(observation.cases):
        channels = observation.channels.items()
        measured = next(name for name, one in channels if one.measures == f"rate:{case.driver}")
        start = math.degrees(case.drive(rate)[0])
        return {"from": "speed", "channel": measured} | ({"zero": f"{start:.12g} deg"} if start else {})
    start, speed = case.drive(rate, -case.before)
    return {"from": "time", "speed": f"{speed:.15g} rad/s", "zero": f"{math.degrees(start):.12g} deg"}


def _counted_from(observation: Observation, case: Case | None = None) -> float:
    """Coordinate, rad, where an encoder reads zero: at its index, else where its count is 0, its level rises."""
    encoder, case = observation.rig.encoder, case or observation.cases[0]
    assert encoder is not None  # asked of encoders only
    zero, pitch = float(encoder.zero.evaluate()), 2 * math.pi / encoder.per_turn
    start, speed = case.drive(observation.rate)
    if encoder.index:
        return zero if speed > 0 else zero + pitch  # backward, the first pulse is entered at its far end
    if encoder.kind == "count":
        return zero
    count = (start - zero) / pitch
    # backward, the level rises in the middle of a pulse
    edge = math.floor(count + 1e-9) + 1 if speed > 0 else math.ceil(count - 0.5 - 1e-9) - 0.5
    return zero + edge * pitch


def _channel(observation: Observation, name: str) -> dict[str, Any]:
    channel = observation.channels[name]
    stated = channel.stated
    found: dict[str, Any] = {"column": channel.column, "measures": channel.measures, "unit": channel.reading}
    if stated.sensitivity:
        found["gain"] = stated.sensitivity.source
    case = observation.cases[0]
    if channel.zeroed and case.before > 1:
        rest = (-case.origin, AT_REST * case.before - case.origin)
        found["zero"] = {"over": [f"{one / observation.rate + 0.0:.6g} s" for one in rest]}
    if stated.range:
        found["range"] = stated.range.source
    if channel.per_turn:
        found["per_turn"] = channel.per_turn
    accuracy: dict[str, Any] = {}
    if channel.gain:
        accuracy["gain"] = stated.accuracy.gain.source
    zero = observation.zero_uncertainty(name)
    if channel.noise <= channel.step / 2:  # which does not carry readings over the steps of the converter
        zero = math.hypot(zero, channel.step / math.sqrt(12))  # GUM F.2.2.1
    if zero:
        accuracy["zero"] = f"{zero:.4g} {channel.unit}"
    return found | ({"accuracy": accuracy} if accuracy else {})


def _truth_of(observation: Observation) -> dict[str, Any]:
    mechanism = observation.mechanism
    found: dict[str, Any] = {
        "trunnion-truth": 1,
        "made_by": f"trunnion {__version__}",
        "model": mechanism.name,
        "model_hash": mechanism.digest,
        "seed": observation.seed,
        "sensors": {},
        "conditions": [],
    }
    for name, channel in observation.channels.items():
        errors = observation.drawn[name]
        found["sensors"][name] = {
            "measures": channel.measures, "unit": channel.unit, "gain_error": errors.gain, "zero_error": errors.zero,
            "offset": errors.offset, "drift_per_second": float(f"{channel.drift:.12g}"),
            "noise": float(f"{channel.noise:.12g}"), "step": float(f"{channel.step:.12g}"),
        }  # fmt: skip
    for case in observation.cases:
        whole = round(observation.rig.schedule.turns * case.run.cycle.duration * observation.rate)
        part = slice(case.first, case.first + whole)
        found["conditions"].append({
            "name": case.name, "set": dict(case.settings),
            "efficiency": case.efficiency if math.isfinite(case.efficiency) else None,
            "cycle_seconds": case.run.cycle.duration,
            "mean": {name: float(np.mean(case.true.at_samples(i)[part]))
                     for i, name in enumerate(observation.channels)},
        })  # fmt: skip
    if observation.skipped:
        found["left_out"] = list(observation.skipped)
    found["parameters"] = {
        path: float(np.ravel(value)[0]) for path, value in mechanism.parameters().items() if np.size(value) == 1
    }
    return found


# ---- true courses ----------------------------------------------------------------------------------------------

EFFICIENCY_STEPS = 720
CHUNK = 8_192  # instants at once: memory and cache
DIGITS = 12  # of a share of the cycle, in which instants that are one agree


@dataclass(frozen=True)
class SampledSignals:
    """The courses of one condition, SI.

    time: ascending instants of the cycle, s; values: (measure, instant); status: of the instants; place: of each sample
    of the run among them.
    """

    time: Array
    values: Array
    status: NDArray[np.int8]
    place: NDArray[np.intp]

    def at_samples(self, i: int) -> Array:
        """The course of one measure at every sample."""
        return np.asarray(self.values[i][self.place])


def sampled(run: Run, measures: Sequence[Measure], rate: float, count: int, lead: float = 0.0) -> SampledSignals:
    """Solve the model at the samples of a rig.

    Parameters
    ----------
    run : a prepared mechanism.
    measures : what its sensors measure.
    rate, count : of the samples, Hz.
    lead : sampling intervals that the first of them lies before the start of the cycle.
    """
    if run.cycle.periodic:
        time, place = phases(run.cycle.duration, rate, count, lead)
    else:
        time, place = np.minimum((np.arange(count) - lead) / rate, run.cycle.duration), np.arange(count)
    return SampledSignals(time, *_solved(run, measures, time), place)


def phases(duration: float, rate: float, count: int, lead: float = 0.0) -> tuple[Array, NDArray[np.intp]]:
    """Distinct times (s) in the cycle of `count` samples, ascending, and the place of each sample among them.

    lead: how many sampling intervals the first comes before the start of the cycle.
    """
    share = np.round(np.mod((np.arange(count) - lead) / (duration * rate), 1.0), DIGITS) % 1.0
    distinct, place = np.unique(share, return_inverse=True)
    return distinct * duration, place


def _solved(run: Run, measures: Sequence[Measure], time: Array) -> tuple[Array, NDArray[np.int8]]:
    """Courses of measures at ascending times (s) of the cycle, with pins in their seats; status.

    Where a load or friction is an interval, at a speed of zero, a course is the mean of its neighbours; a load whose
    joint rests at several positions on end is 0 there: nothing moves against it.
    """
    alike, parts = list({one.name: one for one in measures}.values()), np.array_split(time, -(-len(time) // CHUNK))
    solved = [courses_of(run, alike, part, FrictionMethod()) for part in parts]
    status = np.concatenate([codes for _, codes in solved])
    rows = [
        [np.broadcast_to(np.asarray(curves[one.name][0], float), part.shape)
         for (curves, _), part in zip(solved, parts, strict=True)]
        for one in measures
    ]  # fmt: skip
    values = np.array([np.concatenate(row) for row in rows])
    lost = status >= Status.NOT_CONVERGED
    values[:, lost] = np.nan
    gaps = ~np.isfinite(values)
    if lost.any() or not gaps.any():
        return values, status
    for row in np.flatnonzero(gaps.any(axis=1)).tolist():
        if measures[row].kind == "load":
            before, after = np.roll(gaps[row], 1), np.roll(gaps[row], -1)
            if not run.cycle.periodic:
                before[0] = after[-1] = False
            values[row, gaps[row] & (before | after)] = 0.0  # of more than one position; at the ends of a period too
        known = np.isfinite(values[row])
        if known.any():
            period = run.cycle.duration if run.cycle.periodic else None
            values[row, ~known] = np.interp(time[~known], time[known], values[row, known], period=period)
    return values, status


def cycle_efficiency(run: Run) -> float:
    """Useful work over drive work of the cycle, of the model; NaN where the loads drive it."""
    return positions(run, EFFICIENCY_STEPS, margin=False).means.efficiency

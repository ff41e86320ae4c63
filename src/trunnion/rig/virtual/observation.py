"""What a virtual rig has recorded: its working conditions, the errors of its sensors, and the readings they make."""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from trunnion.errors import Finding, MechanismError, Status
from trunnion.measures.evaluation import courses_of
from trunnion.measures.measures import Measure
from trunnion.model.arguments import strict_arguments
from trunnion.model.mechanism import Mechanism
from trunnion.rig.reading.measurement import Accuracy, Condition, Measurement, Signal
from trunnion.rig.reading.rig_file import Rig, Value
from trunnion.rig.virtual import files
from trunnion.rig.virtual.sensors import SensorChannel, SensorErrors, draw, pulses, readings, stream
from trunnion.solve.friction_method import FrictionMethod
from trunnion.solve.run import Run
from trunnion.version import __version__

__all__ = ["Case", "Observation", "check_seed", "phases", "solved", "speed_differs"]

Array = NDArray[np.float64]
MOST_SEEDS = 1 << 128
UNITS = {"s": (1.0, 9), "ms": (1e3, 6), "us": (1e6, 3)}  # of the time: in a second, and decimals
POSITIONS = (360, 180, 120, 90, 72, 60, 36, 24, 12)  # of a cycle: fewer than samples
FEWER = 0.99
AT_REST = 0.9  # share of the idle stretch that the zero is taken from: a filter carries the run into the rest
CHUNK = 8_192  # instants at once: memory and cache
DIGITS = 12  # of a share of the cycle, in which instants that are one agree


@dataclass(frozen=True)
class Case:
    """A working condition that the model can be in: what is set, how it is sampled, what is true.

    rate: samples a second; before, running, after: samples of the idle stretches and of the run; lead: sampling
    intervals from the first sample of the run to the start of its first cycle, a whole number and a half; true:
    (sensor, sample), courses of the run, SI; time, status: of the instants of the cycle at which the model is solved;
    efficiency: of the model, NaN if it has none.
    """

    number: int
    name: str
    settings: Mapping[str, Value]
    run: Run
    rate: float
    before: int
    running: int
    after: int
    lead: float
    true: Array
    time: Array
    status: NDArray[np.int8]
    efficiency: float = math.nan

    @property
    def worst(self) -> Status:
        """The gravest status of a position."""
        return next(status for status in Status if status == self.status.max())

    @property
    def rows(self) -> int:
        return self.before + self.running + self.after

    @property
    def part(self) -> slice:
        """Samples at which the machine runs."""
        return slice(self.before, self.before + self.running)

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

    @cached_property
    def start(self) -> tuple[float, float]:
        """Coordinate and rate of the first driver at the first sample of the run."""
        angle, speed = self.drive()
        return float(angle.flat[0]), float(speed.flat[0])

    def __str__(self) -> str:
        """Its number, and what is set."""
        texts = {name: value if isinstance(value, str) else f"{value:.6g}" for name, value in self.settings.items()}
        settings_text = ", ".join(f"{name} = {text}" for name, text in texts.items()) or "as the model states"
        return f"condition {self.number} ({settings_text})"


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

    @property
    def units(self) -> dict[str, str]:
        """Unit of every column that has one."""
        units = {self.rig.time.column: self.rig.time.unit}
        return units | {channel.column: channel.reading for channel in self.channels.values()}

    def records(self) -> Iterator[files.Record]:
        """The readings of every condition, one after the other."""
        return (self._record(case) for case in self.cases)

    def _record(self, case: Case) -> files.Record:
        rig, encoder, (factor, places) = self.rig, self.rig.encoder, UNITS[self.rig.time.unit]
        time = (np.arange(case.rows) - case.origin) / self.rate * factor
        columns: dict[str, NDArray[Any]] = {rig.time.column: np.round(time, places)}
        if encoder:
            angle, _ = case.drive(np.clip(np.arange(case.rows) - case.before, 0, case.running - 1))
            count, part = pulses(angle, encoder.per_turn, float(encoder.zero.evaluate()))
            columns[encoder.column] = count if encoder.kind == "count" else (part < 0.5).astype(np.int64)
            if encoder.index:
                columns[encoder.index] = (count % encoder.per_turn == 0).astype(np.int64)
        columns |= {self.channels[name].column: values for name, values in self._readings(case).items()}
        return files.Record(case.name, case.settings, columns)

    def _readings(self, case: Case) -> dict[str, Array]:
        """Readings by sensor, in their units, idle stretches included."""
        values = {}
        for (name, channel), course in zip(self.channels.items(), case.true, strict=True):
            ends = (0.0, 0.0) if channel.at_rest else (course[0], course[-1])
            true = np.concatenate([np.full(case.before, ends[0]), course, np.full(case.after, ends[1])])
            noise = stream(self.seed, case.number, name, "noise").standard_normal(case.rows)
            values[name] = readings(channel, true, case.part, self.rate, self.drawn[name], noise)
        return values

    def accuracy(self, name: str) -> Accuracy:
        """What a laboratory that knows its sensors states of one, in the unit measured.

        The zero after what it reads idle is taken off: while it runs, of the mean of the idle stretch, of the offset if
        there is no such stretch, and of the drift until the end of the longest file, as a rectangular distribution
        (GUM 4.3.7).
        """
        channel, longest = self.channels[name], max(self.cases, key=lambda case: case.rows)
        idle = channel.noise / math.sqrt(longest.before) if channel.zeroed and longest.before else channel.offset
        zero = math.hypot(channel.zero, abs(channel.drift) * longest.rows / self.rate / math.sqrt(3), idle)
        rests = channel.at_rest and all(case.before for case in self.cases)  # else all files have one offset
        zero_part = math.sqrt(max(zero - channel.zero, 0.0) * (zero + channel.zero)) if rests else 0.0
        return Accuracy(zero, channel.gain, channel.step, zero_part)

    def measurement(self, positions: int = 360) -> Measurement:
        """The readings as a Measurement, without files in between: the angle is the true one."""
        phase, turns, conditions = np.arange(positions) / positions, np.arange(self.rig.schedule.turns)[:, None], []
        for case in self.cases:
            at, courses = case.before + case.lead + (turns + phase) * case.cycle * self.rate, {}
            for name, values in self._readings(case).items():
                channel, values = self.channels[name], values / self.channels[name].per
                zero = float(np.mean(values[: case.before])) if channel.zeroed and case.before else 0.0
                by_turn = np.interp(at.ravel(), np.arange(case.rows), values - zero).reshape(at.shape)
                courses[name] = Signal(name, channel.measures, channel.unit, by_turn, self.accuracy(name),
                                       per_turn=channel.per_turn)  # fmt: skip
            stated = {**self.rig.set_, **case.settings}
            changed = self.mechanism.with_values(stated)
            settings = {name: float(np.ravel(changed.parameters()[changed.path_of(name)])[0]) for name in stated}
            conditions.append(Condition(case.name, settings, phase, courses, (), case.start[1]))
        return Measurement(self.rig.name, tuple(conditions), self.findings, ("made by a virtual rig, not read",))

    def mapping(self, form: str = "") -> dict[str, Any]:
        """The mapping that reads the files: what a laboratory knows, and no more than that."""
        angle = _angle(self)
        timed = angle.get("angle", {}).get("from") == "time" or "angle" not in angle
        least = min(case.cycle for case in self.cases) * self.rate
        positions = next((item for item in POSITIONS if item < least * FEWER), POSITIONS[-1])
        return {
            "trunnion-data": 1, "name": self.rig.name or self.mechanism.name,
            "files": [_file(self, case, form or self.rig.format, timed) for case in self.cases],
            **({"set": dict(self.rig.set_)} if self.rig.set_ else {}),
            "time": {"column": self.rig.time.column, "unit": self.rig.time.unit},
            **angle,
            **({"positions": positions} if positions != POSITIONS[0] else {}),
            "channels": {name: _channel(self, name) for name in self.channels},
        }  # fmt: skip

    def truth(self) -> dict[str, Any]:
        """What was drawn and what is true, in SI: to check what is found from the files, not to find it."""
        sensors, conditions = {}, []
        for name, channel in self.channels.items():
            errors = self.drawn[name]
            sensors[name] = {
                "measures": channel.measures, "unit": channel.unit, "gain_error": errors.gain,
                "zero_error": errors.zero, "offset": errors.offset,
                "drift_per_second": float(f"{channel.drift:.12g}"), "noise": float(f"{channel.noise:.12g}"),
                "step": float(f"{channel.step:.12g}"),
            }  # fmt: skip
        for case in self.cases:
            first = math.ceil(case.lead)  # the first sample that lies in the first cycle
            part = slice(first, first + round(self.rig.schedule.turns * case.cycle * self.rate))
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
        """Write a file for each condition, `mapping.yaml` and `truth.yaml` into a folder; their names.

        form: csv, parquet or tdms, that of the rig file if not given; progress: called with the files written.
        """
        form = form or self.rig.format
        files.check_form(form)
        files.check_folder(self.rig, folder, form)
        texts = {files.MAPPING: self.mapping(form), files.TRUTH: self.truth()}
        return files.write(self.records(), self.units, texts, folder, form, progress or (lambda count: None))


def check_seed(seed: int) -> None:
    """MechanismError for what seeds no random numbers."""
    if not 0 <= seed < MOST_SEEDS:
        raise MechanismError(Finding(f"the seed {seed} is no whole number from 0", "seed", "give one such as 1"))


def speed_differs(cases: Sequence[Case]) -> bool:
    """Whether the first driver runs one way and not as fast in all conditions."""
    durations = [case.cycle for case in cases]
    one_way = cases[0].run.system.span(cases[0].run.values, cases[0].driver).one_way
    return one_way and max(durations) - min(durations) > 1e-9 * max(durations)


# ---- the mapping ----------------------------------------------------------------------------------------------------


def _degrees(angle: float) -> str:
    return f"{math.degrees(angle):.12g} deg"


def _file(observation: Observation, case: Case, form: str, timed: bool) -> dict[str, Any]:
    """A file with what was set, its zero of an encoder, and where the time alone tells the position, when it ran."""
    entry: dict[str, Any] = {"file": f"{case.name}.{form}"}
    if case.settings:
        entry["set"] = dict(case.settings)
    if observation.rig.encoder and (zero := _zero(observation, case)) != _zero(observation, observation.cases[0]):
        entry["angle"] = {"zero": _degrees(zero)}
    if timed and case.rows > case.running:
        ends = (case.before - case.origin, case.before + case.running - 1 - case.origin)
        entry["over"] = [f"{end / case.rate:.9g} s" for end in ends]
    return entry


def _angle(observation: Observation) -> dict[str, Any]:
    """Where the coordinate of the driver comes from, the encoder if there is one, and what a cycle is."""
    case, encoder = observation.cases[0], observation.rig.encoder
    if not case.named:
        return {"cycle": f"{case.cycle:.15g} s"}
    drive = case.run.system.drive(case.run.values, case.driver, np.array([0.0, case.cycle]))[0]
    first, last = np.broadcast_to(np.asarray(drive, float), 2).tolist()
    source: dict[str, Any]
    if encoder:
        source = {"from": "pulses", "column": encoder.column, "per_turn": encoder.per_turn, "kind": encoder.kind}
        if encoder.kind == "level" and case.start[1] < 0:
            source["sign"] = -1
        if zero := _zero(observation, case):
            source["zero"] = _degrees(zero)
        if encoder.index:
            source["index"] = {"column": encoder.index}
    elif speed_differs(observation.cases):
        speeds = (name for name, channel in observation.channels.items() if channel.measures == f"rate:{case.driver}")
        source = {"from": "speed", "channel": next(speeds)}
        if case.start[0]:
            source["zero"] = _degrees(case.start[0])
    else:
        angle, speed = (float(item.flat[0]) for item in case.drive(-case.before))
        source = {"from": "time", "speed": f"{speed:.15g} rad/s", "zero": _degrees(angle)}
    entries: dict[str, Any] = {"angle": source}
    if abs(abs(last - first) - 2 * math.pi) > 1e-11:
        entries["cycle"] = _degrees(abs(last - first))
    return entries | ({"start": _degrees(first)} if first else {})


def _zero(observation: Observation, case: Case) -> float:
    """Coordinate, rad, where an encoder reads zero: at its index, else where its count is 0, its level rises."""
    encoder, (start, speed) = observation.rig.encoder, case.start
    assert encoder is not None  # asked of encoders only
    zero, pitch = float(encoder.zero.evaluate()), 2 * math.pi / encoder.per_turn
    if encoder.index:
        return zero if speed > 0 else zero + pitch  # backward, the first pulse is entered at its far end
    if encoder.kind == "count":
        return zero
    count = (start - zero) / pitch
    # backward, the level rises in the middle of a pulse
    edge = math.floor(count + 1e-9) + 1 if speed > 0 else math.ceil(count - 0.5 - 1e-9) - 0.5
    return zero + edge * pitch


def _channel(observation: Observation, name: str) -> dict[str, Any]:
    channel, case = observation.channels[name], observation.cases[0]
    channel_stated, zero = channel.stated, observation.accuracy(name).zero
    entry: dict[str, Any] = {"column": channel.column, "measures": channel.measures, "unit": channel.reading}
    if channel_stated.sensitivity:
        entry["gain"] = channel_stated.sensitivity.source
    if channel.zeroed and case.before > 1:
        rest = (-case.origin, AT_REST * case.before - case.origin)
        entry["zero"] = {"over": [f"{item / case.rate + 0.0:.6g} s" for item in rest]}
    if channel_stated.range:
        entry["range"] = channel_stated.range.source
    if channel.per_turn:
        entry["per_turn"] = channel.per_turn
    accuracy: dict[str, Any] = {"gain": channel_stated.accuracy.gain.source} if channel.gain else {}
    if channel.noise <= channel.step / 2:  # which does not carry readings over the steps of the converter
        zero = math.hypot(zero, channel.step / math.sqrt(12))  # GUM F.2.2.1
    if zero:
        accuracy["zero"] = f"{zero:.4g} {channel.unit}"
    return entry | ({"accuracy": accuracy} if accuracy else {})


# ---- true courses ----------------------------------------------------------------------------------------------


def phases(duration: float, rate: float, count: int, lead: float = 0.0) -> tuple[Array, NDArray[np.intp]]:
    """Distinct times (s) in the cycle of `count` samples, ascending, and the place of each sample among them.

    lead: how many sampling intervals the first comes before the start of the cycle.
    """
    share = np.round(np.mod((np.arange(count) - lead) / (duration * rate), 1.0), DIGITS) % 1.0
    distinct, place = np.unique(share, return_inverse=True)
    return distinct * duration, place


def solved(run: Run, measures: Sequence[Measure], time: Array) -> tuple[Array, NDArray[np.int8]]:
    """Courses of measures, (measure, instant), at ascending times (s) of the cycle, with pins in their seats; status.

    Where a load or friction is an interval, at a speed of zero, a course is the mean of its neighbours; a load whose
    joint rests at several positions on end is 0 there: nothing moves against it.
    """
    alike, periodic = list({measure.name: measure for measure in measures}.values()), run.cycle.periodic
    values, status = np.empty((len(measures), len(time))), np.empty(len(time), np.int8)
    for low in range(0, len(time), CHUNK):
        part = slice(low, low + CHUNK)
        curves, status[part] = courses_of(run, alike, time[part], FrictionMethod())
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
            row[~finite] = np.interp(
                time[~finite], time[finite], row[finite], period=run.cycle.duration * periodic or None
            )
    return values, status

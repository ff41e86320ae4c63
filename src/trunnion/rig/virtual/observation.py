"""What a virtual rig has recorded: its working conditions, the errors of its sensors, and the readings they make."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from trunnion.errors import Finding, MechanismError, Status
from trunnion.model.mechanism import Mechanism
from trunnion.rig.reading.measurement import Accuracy, Condition, Measurement, Signal
from trunnion.rig.reading.rig_file import Rig, Value
from trunnion.rig.virtual.sensors import SensorChannel, SensorErrors, draw, index_level, level, pulses, readings, stream
from trunnion.rig.virtual.true_signals import SampledSignals
from trunnion.solve.run import Run

__all__ = ["Case", "Record", "Recorded", "case_names", "check_seed", "speed_differs"]

Array = NDArray[np.float64]
MOST_SEEDS = 1 << 128
PER_SECOND = {"s": 1.0, "ms": 1e3, "us": 1e6}
TIME_DECIMALS = {"s": 9, "ms": 6, "us": 3}


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
class Recorded:
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


def check_seed(seed: int) -> None:
    """MechanismError for what seeds no random numbers."""
    if not 0 <= seed < MOST_SEEDS:
        raise MechanismError(Finding(f"the seed {seed} is no whole number from 0", "seed", "give one such as 1"))


def _si(mechanism: Mechanism, name: str, value: Value) -> float:
    """What is set, in SI."""
    changed = mechanism.with_values({name: value})
    return float(np.ravel(changed.parameters()[changed.path_of(name)])[0])


def case_names(count: int) -> list[str]:
    """Names of conditions, and of their files."""
    width = max(2, len(str(count)))
    return [f"run-{number:0{width}d}" for number in range(1, count + 1)]


def speed_differs(cases: Sequence[Case]) -> bool:
    """Whether the first driver runs one way and not as fast in all conditions."""
    durations = [case.run.cycle.duration for case in cases]
    one_way = cases[0].run.system.span(cases[0].run.values, cases[0].driver).one_way
    return one_way and max(durations) - min(durations) > 1e-9 * max(durations)

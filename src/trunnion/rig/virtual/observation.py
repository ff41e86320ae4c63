"""What a virtual rig has recorded."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from trunnion.errors import Finding, MechanismError
from trunnion.model.mechanism import Mechanism
from trunnion.rig.reading.measurement import Accuracy, Condition, Measurement, Signal
from trunnion.rig.reading.rig_file import Rig, Value
from trunnion.rig.virtual.cases import Case
from trunnion.rig.virtual.sensors import SensorChannel, SensorErrors, draw, index_level, level, pulses, readings, stream

__all__ = ["MOST_SEEDS", "PER_SECOND", "TIME_DECIMALS", "Record", "Recorded", "check_seed"]


Array = NDArray[np.float64]
TIME_DECIMALS = {"s": 9, "ms": 6, "us": 3}

PER_SECOND = {"s": 1.0, "ms": 1e3, "us": 1e6}


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
        columns = self._readings(case)
        rig = self.rig
        time = (np.arange(case.rows) - case.origin) / self.rate * PER_SECOND[rig.time.unit]
        found: dict[str, NDArray[Any]] = {rig.time.column: np.round(time, TIME_DECIMALS[rig.time.unit])}
        if rig.encoder:
            angle, zero = self._angle(case), float(rig.encoder.zero.evaluate())
            signal = pulses if rig.encoder.kind == "count" else level
            found[rig.encoder.column] = signal(angle, rig.encoder.per_turn, zero)
            if rig.encoder.index:
                found[rig.encoder.index] = index_level(angle, rig.encoder.per_turn, zero)
        found.update({self.channels[name].column: values for name, values in columns.items()})
        return Record(case.name, case.settings, found)

    def perfect(self, case: Case) -> dict[str, Array]:
        """Readings in their units without random errors: what bandwidth, pulses and range leave."""
        return self._readings(case, perfect=True)

    def _readings(self, case: Case, perfect: bool = False) -> dict[str, Array]:
        """Readings in their units; perfect: without random errors either."""
        found = {}
        for i, (name, channel) in enumerate(self.channels.items()):
            true = np.empty(case.rows)
            course = case.true.at_samples(i)
            true[case.part] = course
            true[: case.before] = 0.0 if channel.at_rest else course[0]
            true[case.part.stop :] = 0.0 if channel.at_rest else course[-1]
            if perfect:
                channel, noise, drawn = replace(channel, drift=0.0, step=0.0), None, SensorErrors(0.0, 0.0, 0.0)
            else:
                noise = stream(self.seed, case.number, name, "noise").standard_normal(case.rows)
                drawn = self.drawn[name]
            found[name] = readings(channel, true, case.part, self.rate, drawn, noise)
        return found

    def _angle(self, case: Case) -> Array:
        """Coordinate of the first driver at every sample, rad; it counts on from turn to turn."""
        driver = next(iter(self.mechanism.drivers))
        sample = np.clip(np.arange(case.rows) - case.before, 0, case.running - 1)
        time = (sample - case.lead) / self.rate
        angle: Array = np.asarray(case.run.system.drive(case.run.values, driver, time)[0], float)
        return angle

    def zero_uncertainty(self, name: str) -> float:
        """Standard uncertainty of the zero of a sensor after what it reads idle is taken off, in the unit measured.

        While it runs, of the mean of the idle stretch, of the offset if there is no such stretch, and of the drift
        until the end of the longest file, as a rectangular distribution (GUM 4.3.7).
        """
        channel = self.channels[name]
        longest = max(self.cases, key=lambda case: case.rows)
        parts = [channel.zero, abs(channel.drift) * longest.rows / self.rate / math.sqrt(3)]
        if channel.zeroed and longest.before:
            parts.append(channel.noise / math.sqrt(longest.before))
        else:
            parts.append(channel.offset)
        return math.hypot(*parts)

    def accuracy(self, name: str) -> Accuracy:
        """What a laboratory that knows its sensors states of one."""
        channel = self.channels[name]
        zero = self.zero_uncertainty(name)
        rests = channel.at_rest and all(case.before for case in self.cases)  # else all files have one offset
        own = math.sqrt(max(zero - channel.zero, 0.0) * (zero + channel.zero)) if rests else 0.0
        return Accuracy(zero, channel.gain, channel.step, own)

    def measurement(self, positions: int = 360) -> Measurement:
        """The readings as a Measurement, without files in between: the angle is the true one."""
        phase = np.arange(positions) / positions
        conditions = []
        for case in self.cases:
            found = self._readings(case)
            cycle = case.run.cycle.duration * self.rate
            turns = self.rig.schedule.turns
            at = case.before + case.lead + (np.arange(turns)[:, None] + phase) * cycle
            courses = {}
            for name, channel in self.channels.items():
                values = found[name] / channel.per
                zero = float(np.mean(values[: case.before])) if channel.zeroed and case.before else 0.0
                by_turn = np.interp(at.ravel(), np.arange(case.rows), values - zero).reshape(at.shape)
                courses[name] = Signal(name, channel.measures, channel.unit, by_turn, self.accuracy(name))
            settings = {
                name: _si(self.mechanism, name, value) for name, value in {**self.rig.set_, **case.settings}.items()
            }
            speed = case.drive(self.rate)[1]
            conditions.append(Condition(case.name, settings, phase, courses, (), speed))
        return Measurement(self.rig.name, tuple(conditions), self.findings, ("made by a virtual rig, not read",))


def _si(mechanism: Mechanism, name: str, value: Value) -> float:
    """What is set, in SI."""
    changed = mechanism.with_values({name: value})
    return float(np.ravel(changed.parameters()[changed.path_of(name)])[0])


MOST_SEEDS = 1 << 128


def check_seed(seed: int) -> None:
    """MechanismError for what seeds no random numbers."""
    if not 0 <= seed < MOST_SEEDS:
        raise MechanismError(Finding(f"the seed {seed} is no whole number from 0", "seed", "give one such as 1"))

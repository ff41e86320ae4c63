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
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from trunnion.analysis.analyse import prepare
from trunnion.analysis.rig.virtual_cases import (
    Case,
    case_names,
    case_of,
    channels_of,
    findings_of,
    measures_of,
    placed_at,
)
from trunnion.analysis.rig.virtual_faults import faulty
from trunnion.analysis.rig.virtual_sensors import (
    Channel,
    Drawn,
    draw,
    index_level,
    level,
    pulses,
    readings,
    stream,
)
from trunnion.errors import Finding, MechanismError, Severity
from trunnion.measured.measurement import Accuracy, Condition, Course, Measurement
from trunnion.measured.rig_file import Rig, Value
from trunnion.model.mechanism import Mechanism

__all__ = ["Observation", "Record", "observe"]

Array = NDArray[np.float64]
TIME_DECIMALS = {"s": 9, "ms": 6, "us": 3}
PER_SECOND = {"s": 1.0, "ms": 1e3, "us": 1e6}
MOST_SEEDS = 1 << 128


@dataclass(frozen=True)
class Record:
    """The columns of one file, by name; NaN is an empty cell. settings: what is set in it, as in the rig file."""

    name: str
    settings: Mapping[str, Value]
    columns: Mapping[str, NDArray[Any]]


@dataclass(frozen=True)
class Observation:
    """A rig put to a mechanism: conditions with their true courses, sensors with the errors they have in fact.

    Readings are made when they are asked for, and are the same every time. skipped: conditions, by number from 1, that
    the model cannot be in.
    """

    mechanism: Mechanism
    rig: Rig
    seed: int
    channels: Mapping[str, Channel]
    drawn: Mapping[str, Drawn]
    cases: tuple[Case, ...]
    skipped: tuple[int, ...]
    findings: tuple[Finding, ...]

    def seeded(self, seed: int) -> Observation:
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
        """The readings of one condition, faults included."""
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
        found = faulty(found, self.rig, self.channels, case.number, self.seed, self.rate)
        return Record(case.name, case.settings, found)

    def perfect(self, case: Case) -> dict[str, Array]:
        """Readings in their units without faults and random errors: what bandwidth, pulses and range leave."""
        return self._readings(case, perfect=True)

    def _readings(self, case: Case, perfect: bool = False) -> dict[str, Array]:
        """Readings without faults, in their units; perfect: without random errors either."""
        found = {}
        for i, (name, channel) in enumerate(self.channels.items()):
            true = np.empty(case.rows)
            course = case.true.at_samples(i)
            true[case.part] = course
            true[: case.before] = 0.0 if channel.at_rest else course[0]
            true[case.part.stop :] = 0.0 if channel.at_rest else course[-1]
            if perfect:
                channel, noise, drawn = replace(channel, drift=0.0, step=0.0), None, Drawn(0.0, 0.0, 0.0)
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
        """The readings as a Measurement, faults left out, without files in between: the angle is the true one."""
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
                courses[name] = Course(name, channel.measures, channel.unit, by_turn, self.accuracy(name))
            settings = {
                name: _si(self.mechanism, name, value) for name, value in {**self.rig.set_, **case.settings}.items()
            }
            speed = case.drive(self.rate)[1]
            conditions.append(Condition(case.name, settings, phase, courses, (), speed))
        return Measurement(self.rig.name, tuple(conditions), self.findings, ("made by a virtual rig, not read",))

    def mapping(self, form: str = "") -> dict[str, Any]:
        """The mapping that reads the files; see `virtual_files.mapping_of`."""
        from trunnion.analysis.rig.virtual_files import mapping_of

        return mapping_of(self, form or self.rig.format)

    def truth(self) -> dict[str, Any]:
        """What was drawn and what is true; see `virtual_files.truth_of`."""
        from trunnion.analysis.rig.virtual_files import truth_of

        return truth_of(self)

    def write(
        self, folder: str | os.PathLike[str], form: str = "", progress: Callable[[int], None] | None = None
    ) -> list[str]:
        """Write a file for each condition, `mapping.yaml` and `truth.yaml` into a folder; their names.

        form: csv, parquet or tdms, that of the rig file if not given; progress: called with the files written.
        """
        from trunnion.analysis.rig.virtual_files import write

        return write(self, folder, form or self.rig.format, progress)


def _si(mechanism: Mechanism, name: str, value: Value) -> float:
    """What is set, in SI."""
    changed = mechanism.with_values({name: value})
    return float(np.ravel(changed.parameters()[changed.path_of(name)])[0])


def check_seed(seed: int) -> None:
    """MechanismError for what seeds no random numbers."""
    if isinstance(seed, bool) or not isinstance(seed, (int, np.integer)) or not 0 <= seed < MOST_SEEDS:
        raise MechanismError(Finding(f"the seed {seed} is no whole number from 0", "seed", "give one such as 1"))


def observe(
    mechanism: Mechanism,
    rig: Rig | Mapping[str, Any] | str | os.PathLike[str],
    seed: int = 1,
    progress: Callable[[int], None] | None = None,
) -> Observation:
    """Put a rig to a mechanism: solve the model in all conditions of the schedule, draw the errors of the sensors.

    rig: a Rig, the entries of a rig file, or its path; seed: of all random numbers: the same seed, the same readings to
    the last bit; progress: called with the conditions done. A condition that the model cannot be in at every position,
    because it locks or does not go together, is left out, and a finding says which and why.
    Raises MechanismError for a rig that does not fit the mechanism, or if no condition is left.
    """
    check_seed(seed)
    if not isinstance(rig, Rig):
        rig = Rig(**rig) if isinstance(rig, Mapping) else Rig.read(rig)
    with placed_at("set"):
        mechanism = mechanism.with_values(dict(rig.set_)) if rig.set_ else mechanism
    rows = rig.schedule.rows()
    channels: dict[str, Channel] = {}
    cases: list[Case] = []
    for number, (name, row) in enumerate(zip(case_names(len(rows)), rows, strict=True), 1):
        key = f"conditions.{number - 1}" if rig.schedule.conditions else "over"
        with placed_at(f"schedule.{key}", number):
            run = prepare(mechanism.with_values(dict(row)) if row else mechanism)
        measures = measures_of(rig, run)
        channels = channels or channels_of(rig, run, measures)
        case = case_of(number, name, row, run, rig, measures, channels)
        cases.append(case)
        if progress:
            progress(number)
    findings = tuple(findings_of(cases, channels, rig))
    sound = tuple(case for case in cases if case.worst.solved)
    if not sound:
        what = (
            f"none of the {len(rows)} conditions can be measured"
            if len(rows) > 1
            else "the condition cannot be measured"
        )
        remedy = "take conditions in which the model has an answer at every position"
        raise MechanismError([*findings, Finding(what, "schedule", remedy)])
    if any(one.severity is Severity.ERROR for one in findings):
        raise MechanismError(findings)
    skipped = tuple(case.number for case in cases if not case.worst.solved)
    drawn = {name: draw(channel, int(seed)) for name, channel in channels.items()}
    return Observation(mechanism, rig, int(seed), channels, drawn, sound, skipped, findings)

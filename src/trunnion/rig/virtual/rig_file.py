"""The rig file: what a test rig is to measure, with which sensors, under which working conditions; and its sensors.

A YAML (or JSON, TOML) file with the key `trunnion-rig: 1`, as strict as a model file: an unknown key is an error, every
quantity has a unit, every finding has its line.

A sensor makes readings of a true course, in order: pulses (of a speed told by them), first-order low-pass, gain, zero
and drift, noise, clipping at the range, steps of the converter. All is worked out in the SI unit of what is measured; a
reading is that times one factor.
"""

from __future__ import annotations

import math
import os
from collections.abc import Iterable, Mapping
from contextlib import suppress
from dataclasses import dataclass, replace
from fractions import Fraction
from pathlib import Path
from typing import Annotated, Any, Literal, Self
from zlib import crc32

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, ValidationError

from trunnion.errors import Finding, MechanismError
from trunnion.model.entry import Name, Part
from trunnion.model.file import place, read_entries
from trunnion.model.measure_table import MEASURES
from trunnion.model.places import schema_findings
from trunnion.model.units import UnitError
from trunnion.rig.reading import units
from trunnion.rig.reading.mapping import Accuracies, Pulses

Array = NDArray[np.float64]
READINGS = ("V", "A", "Hz")  # what the reading of a sensor with a sensitivity may be in
FINE = 1e-3  # of a step of the converter, or of the noise: decimals of a reading beyond are not written
FORMATS = ("csv", "parquet", "tdms")
MOST_CONDITIONS = 10_000
MOST_VALUES = 1000
LONGEST = 1e6  # s at rest
Value = float | str
Count = Annotated[int, Field(ge=1, le=1_000_000)]


class Schedule(Part):
    """The working conditions: a grid, or rows; how many cycles of each are recorded; how long the machine stands
    unloaded before it runs, where sensors of forces read their zero."""

    over: Mapping[str, str | Annotated[tuple[Value, ...], Field(min_length=1)]] = {}
    conditions: tuple[Mapping[str, Value], ...] = ()
    turns: Count = 10
    idle: units.Time = units.ZERO

    def rows(self) -> list[dict[str, Value]]:
        """What is set in each condition; of a grid the last name runs fastest. MechanismError for what is no range."""
        rows: list[dict[str, Value]] = [{}]
        for name, entry in self.over.items():
            values = _spread(entry, f"schedule.over.{name}") if isinstance(entry, str) else list(entry)
            if len(rows) * len(values) > MOST_CONDITIONS:
                what = f"the grid has more than {MOST_CONDITIONS:,} conditions"
                raise MechanismError(Finding(what, "schedule.over", "use fewer values"))
            rows = [{**row, name: value} for row in rows for value in values]
        return rows if not self.conditions else [dict(row) for row in self.conditions]


class Encoder(Part):
    """Pulses of the first driver as a running count, with an index pulse once a turn."""

    per_turn: Pulses
    kind: Literal["count"] = "count"
    column: Name = "encoder"
    index: Name | None = None


class Sensor(Part):
    """What a sensor measures, and what it makes of it. Quantities are in units of what is measured or of its reading.

    range: ± full scale; sensitivity: reading per quantity, or the other way round, as its dimensions tell; noise:
    white, standard deviation; bits over ± span, the range if not stated; accuracy: what the actual errors are drawn
    from, normally distributed, of the zero while it runs; offset: standard deviation of what it reads at rest; drift
    of its zero per time; bandwidth: of a first-order low-pass; per_turn: pulses of a speed sensor, told by the time
    from each to the next.
    """

    measures: str
    unit: str | None = None
    column: Name | None = None
    range: units.Positive | None = None
    sensitivity: units.Number | None = None
    noise: units.Size = units.ZERO
    bits: Annotated[int, Field(ge=1, le=48)] | None = None
    span: units.Positive | None = None
    accuracy: Accuracies = Accuracies()
    offset: units.Size = units.ZERO
    drift: units.Number = units.ZERO
    bandwidth: units.Frequency | None = None
    per_turn: Pulses | None = None


class Rig(Part):
    """A test rig: schedule, sampling rate, encoder, sensors. Built from a file (`read`) or from keywords.

    A rig that exists is sound by itself; whether it fits a mechanism is told when it is put to it (`observe`).
    """

    version: Literal[1] = Field(alias="trunnion-rig")
    name: str = ""
    notes: str = ""
    set_: Mapping[str, Value] = Field(default={}, alias="set")
    schedule: Schedule = Schedule()
    rate: units.Frequency
    encoder: Encoder | None = None
    sensors: Annotated[Mapping[Name, Sensor], Field(min_length=1)]
    format: Literal["csv", "parquet", "tdms"] = "csv"

    def __init__(self, **data: Any) -> None:
        """Validate and check; MechanismError with every finding."""
        try:
            super().__init__(**data)
        except ValidationError as error:
            raise MechanismError(schema_findings(error, Rig, data)) from None
        findings = list(_unsound(self))
        if findings:
            raise MechanismError(findings)

    @classmethod
    def read(cls, path: str | os.PathLike[str]) -> Self:
        """The rig of a file; MechanismError with file, line and remedy of every finding."""
        path = Path(path)
        data, lines = read_entries(path, "a rig file", "start from examples/rig/cardan-rig.yaml")
        try:
            return cls(**data)
        except MechanismError as error:
            raise MechanismError(place(error.findings, str(path), lines, data)) from None

    @property
    def names(self) -> list[str]:
        """Names of the conditions, and of their files: run-01, run-02, …"""
        count = len(self.schedule.rows())
        return [f"run-{number:0{max(2, len(str(count)))}d}" for number in range(1, count + 1)]


def placed_in_rig(findings: Iterable[Finding], path: Path) -> list[Finding]:
    """Findings of a later stage with file and line of the entry of the rig file that they speak of, where it has it."""
    try:
        data, lines = read_entries(path, "a rig file")
    except MechanismError:
        return list(findings)
    keys = {field.alias or name for name, field in Rig.model_fields.items()}
    return [
        finding if finding.file or finding.where.split(".")[0] not in keys
        else place([finding], str(path), lines, data)[0] for finding in findings
    ]  # fmt: skip


def _spread(entry: str, where: str) -> list[Value]:
    """The values of FROM:TO:COUNT, in the unit of its ends; of another text itself."""
    parts = [part.strip() for part in entry.split(":")]
    if len(parts) == 1:
        return [entry]
    try:
        low, high = (units.read_amount(part) for part in parts[:2])
        unit, count = low.unit or high.unit, int(parts[2])
        if not 2 <= count <= MOST_VALUES or len(parts) > 3 or (low.unit != high.unit and low.value and high.value):
            raise ValueError
    except (ValueError, IndexError):
        remedy = "write FROM:TO:COUNT with the same unit at both ends, such as 0 deg:30 deg:7, or a list"
        raise MechanismError(Finding(f"'{entry}' is no range", where, remedy)) from None
    factor = units.dimensions(unit)[0] if unit else 1.0
    texts = [f"{value:.12g}" for value in np.linspace(low.value / factor, high.value / factor, count)]
    return [f"{text} {unit}" if unit else float(text) for text in texts]


def _unsound(rig: Rig) -> Iterable[Finding]:
    """What cannot be, whatever the mechanism."""
    if rig.schedule.over and rig.schedule.conditions:
        yield Finding("has a grid and rows", "schedule", "state `over` or `conditions`, not both")
    if not 0 <= rig.schedule.idle.value < LONGEST:
        yield Finding(f"the time {rig.schedule.idle.source} is out of range", "schedule.idle", "write 0.5 s")
    columns = [("time", "t"), *((f"sensors.{name}", sensor.column or name) for name, sensor in rig.sensors.items())]
    if rig.encoder:
        columns += [("encoder", rig.encoder.column), ("encoder.index", rig.encoder.index or "")]
    first: dict[str, str] = {}
    for where, column in columns:
        if column and first.setdefault(column, where) != where:
            yield Finding(f"the column '{column}' is that of {first[column]} too", where, "state another `column`")
    for name, sensor in rig.sensors.items():
        where = f"sensors.{name}"
        if sensor.bits and not (sensor.span or sensor.range):
            yield Finding("has bits and neither span nor range", f"{where}.bits", "state span: 10 V")
        if sensor.span and not sensor.bits:
            yield Finding("is a span without bits", f"{where}.span", "state bits: 16")
        if sensor.per_turn and not sensor.measures.startswith("rate:"):
            yield Finding("pulses measure a speed only", f"{where}.per_turn", "measure rate:JOINT, or remove per_turn")


# ---- sensors -----------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class SensorChannel:
    """A sensor put to a mechanism: its numbers in the SI unit of what it measures.

    sensor: as in the file; unit: SI, of what is measured; reading: unit of the file; per: readings per SI unit, below 0
    where the sensitivity is; range and span: inf without one; zero: standard uncertainty while it runs; offset: of what
    it reads at rest; drift: per second.
    """

    name: str
    sensor: Sensor
    column: str
    unit: str
    reading: str
    per: float
    range: float
    span: float
    noise: float
    offset: float
    zero: float
    drift: float

    @property
    def gain(self) -> float:
        """Its standard uncertainty, relative."""
        return self.sensor.accuracy.gain.value

    @property
    def step(self) -> float:
        """Of its converter; 0 without one."""
        return 2 * self.span / 2**self.sensor.bits if self.sensor.bits else 0.0

    @property
    def at_rest(self) -> bool:
        """Whether it reads zero in an idle machine: what it measures is a force, a torque or a speed."""
        kind = MEASURES.get(self.sensor.measures.partition(":")[0])
        return kind is not None and kind.at_rest

    @property
    def zeroed(self) -> bool:
        """Whether its zero is taken from an idle stretch: pulses have none."""
        return self.at_rest and not self.sensor.per_turn

    @property
    def decimals(self) -> int:
        """Of a reading in its unit, so that what is left out is nothing beside step and noise."""
        least = min((item for item in (self.step, self.noise) if item > 0), default=0.0) * abs(self.per) * FINE
        limit = min(self.range, self.span)
        step = limit * abs(self.per) * 1e-9 if math.isfinite(limit) else 1e-9
        return int(np.clip(-math.floor(math.log10(least or step)), 0, 15))


@dataclass(frozen=True)
class SensorErrors:
    """The errors that a sensor has in fact: gain, relative; zero while it runs and offset, in the unit measured."""

    gain: float
    zero: float
    offset: float


def stream(seed: int, condition: int, name: str, purpose: str) -> np.random.Generator:
    """Random numbers of their own for each condition, sensor and purpose: the same seed, the same bits.

    Whatever else is added to the rig, they stay. condition: 0 of what all have in common.
    """
    key = (condition, crc32(name.encode()), crc32(purpose.encode()))
    return np.random.Generator(np.random.Philox(np.random.SeedSequence(seed, spawn_key=key)))


def draw(channel: SensorChannel, seed: int) -> SensorErrors:
    """The actual errors of a sensor, normal with the stated standard uncertainties; the same in all conditions."""
    normal = stream(seed, 0, channel.name, "accuracy").standard_normal(3)
    return SensorErrors(*(float(row) + 0.0 for row in normal * (channel.gain, channel.zero, channel.offset)))


# ---- what is stated, in one unit ------------------------------------------------------------------------------


def resolved(name: str, sensor: Sensor, unit: str) -> SensorChannel:
    """A sensor of what is measured in an SI unit; MechanismError for quantities that do not fit it."""
    try:
        reading, scale = _scale(sensor, unit)
    except UnitError as error:
        where = f"sensors.{name}.{'sensitivity' if sensor.sensitivity else 'unit'}"
        raise MechanismError(Finding(error.what, where, error.remedy)) from None
    amounts = {"range": sensor.range, "span": sensor.span or sensor.range, "noise": sensor.noise,
               "offset": sensor.offset, "accuracy.zero": sensor.accuracy.zero, "drift": sensor.drift}  # fmt: skip
    sizes, findings = dict.fromkeys(amounts, math.inf), list[Finding]()
    for key, amount in amounts.items():
        if amount is None or (key == "span" and not sensor.bits):
            continue
        over = "/s" * (key == "drift")  # which has a sign; others have none
        per_second = replace(amount, dimensions=units.multiplied(amount.dimensions, {"s": Fraction(bool(over))}))
        factor = scale.factor if over else abs(scale.factor)
        try:  # of what is measured, or of the readings
            sizes[key] = amount.value if amount.plain else factor * scale.reading(per_second, "zero" if over else key)
        except UnitError:
            either = " or as a reading in ".join(dict.fromkeys(f"{item}{over}" for item in (unit, reading)))
            findings.append(Finding(f"'{amount.source}' is not in {either}", f"sensors.{name}.{key}"))
    if findings:
        raise MechanismError(findings)
    return SensorChannel(name, sensor, sensor.column or name, unit, reading, 1 / scale.factor, *sizes.values())


def _scale(sensor: Sensor, unit: str) -> tuple[str, units.SensorScale]:
    """Unit of the reading, and how readings become what is measured."""
    sensitivity = sensor.sensitivity
    if sensor.unit or sensitivity is None:
        readings = [sensor.unit or unit]
        units.dimensions(readings[0])
    else:  # `mV` of `mV/(N m)`, `V` of `N m/V`
        first, last = sensitivity.unit.partition("/")[0].strip(), sensitivity.unit.rpartition("/")[2].strip("() ")
        readings = [first, last, *READINGS]
    for reading in filter(None, readings):
        with suppress(UnitError):
            of_sensor = units.scale(sensor.measures, reading, sensitivity)
            if units.alike(of_sensor.of_quantity, units.dimensions(unit)[1]):
                return reading, of_sensor
    if sensitivity is None:
        remedy = f"state a unit of {unit}, or the sensitivity: 100 mV/({unit})"
        raise UnitError(f"'{readings[0]}' does not measure a quantity in {unit}", remedy)
    what = f"'{sensitivity.source}' does not turn {unit} into {sensor.unit or 'a reading in volt, ampere or hertz'}"
    raise UnitError(what, f"write a reading per {unit}, such as 100 mV/({unit}), and the `unit` of the reading")


# ---- readings -------------------------------------------------------------------------------------------------


def smoothed(true: Array, bandwidth: float, rate: float) -> Array:
    """A first-order low-pass of this bandwidth, Hz, exact for what runs straight between samples; at rest before."""
    from scipy.signal import lfilter  # brings scipy.stats: longer to import than all the rest

    step = 2 * np.pi * bandwidth / rate  # h/τ
    decay = math.exp(-step)
    last = 1 - (1 - decay) / step
    start = np.array([(1 - last) * true[0]])  # as if it had always been at its first value
    return np.asarray(lfilter([last, 1 - decay - last], [1.0, -decay], true, zi=start)[0])


def pulsed(true: Array, running: slice, per_turn: int, rate: float) -> Array:
    """A speed as worked out from recorded pulses: the pitch over the time from one to the next, at the middle between
    them, and straight in between; before the first and after the last pulses as there."""
    part = np.abs(true[running])
    turned = np.concatenate([[0.0], np.cumsum((part[1:] + part[:-1]) / (2 * rate))])
    pitch = 2 * np.pi / per_turn
    count = int(turned[-1] / pitch) + 1
    counts = true.copy()
    if count < 2:
        counts[running] = 0.0
        return counts
    time = np.arange(len(part)) / rate
    passed = np.interp(pitch * np.arange(count), turned, time)
    speeds = np.interp(time, (passed[1:] + passed[:-1]) / 2, pitch / np.diff(passed))
    counts[running] = speeds * np.sign(true[running][len(part) // 2])
    return counts


def readings(
    channel: SensorChannel, true: Array, running: slice, rate: float, drawn: SensorErrors, noise: Array | None
) -> Array:
    """What a sensor makes of a true course, in the unit of its readings.

    true: in SI at the samples, the idle stretch included; running: those in which the machine runs; noise: standard
    normal numbers, None without.
    """
    sensor, value = channel.sensor, true
    if sensor.per_turn:
        value = pulsed(value, running, sensor.per_turn, rate)
    if sensor.bandwidth:
        value = smoothed(value, sensor.bandwidth.value, rate)
    value = value * (1 + drawn.gain) + drawn.offset
    value[running] += drawn.zero
    if channel.drift:
        value += channel.drift / rate * np.arange(len(value))
    if noise is not None and channel.noise:
        value += channel.noise * noise
    # clipped, in steps, in the unit of the reading, with the decimals that a file has
    value, step = np.clip(value, -channel.range, channel.range), channel.step
    if step:  # the upper end of a converter is one step short
        sense = math.copysign(1.0, channel.per)
        value = sense * np.clip(np.rint(sense * value / step) * step, -channel.span, channel.span - step)
    return np.round(value * channel.per, channel.decimals) + 0.0  # + 0.0: no negative zero

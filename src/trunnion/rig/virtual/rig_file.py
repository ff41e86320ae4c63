"""The rig file: what a test rig is to measure, with which sensors, under which working conditions.

A YAML (or JSON, TOML) file with the key `trunnion-rig: 1`, as strict as a model file: an unknown key is an error, every
quantity has a unit, every finding has its line.
"""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Annotated, Any, Literal, Self

import numpy as np
from pydantic import Field, ValidationError

from trunnion.errors import Finding, MechanismError
from trunnion.model.entry import Name, Part
from trunnion.model.file import place, read_entries
from trunnion.model.findings import schema_findings
from trunnion.rig.reading import units
from trunnion.rig.reading.mapping import Accuracies, Pulses

__all__ = ["FORMATS", "Encoder", "Rig", "Schedule", "Sensor", "Value", "placed_in_rig"]

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
    """Pulses of the first driver: a running count, or the level of the signal; with an index pulse once a turn."""

    per_turn: Pulses
    kind: Literal["count", "level"] = "count"
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

    version: Literal[1] = Field(default=1, alias="trunnion-rig")
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
        if "trunnion-rig" not in data:
            what = "is no rig file: the key 'trunnion-rig' is missing"
            raise MechanismError(Finding(what, "", "begin the file with trunnion-rig: 1", line=1, file=str(path)))
        try:
            return cls(**data)
        except MechanismError as error:
            raise MechanismError(place(error.findings, str(path), lines, data)) from None

    @property
    def names(self) -> list[str]:
        """Names of the conditions, and of their files: run-01, run-02, …"""
        count = len(self.schedule.rows())
        return [f"run-{number:0{max(2, len(str(count)))}d}" for number in range(1, count + 1)]

    def column(self, sensor: str) -> str:
        """The column of the readings of a sensor."""
        return self.sensors[sensor].column or sensor


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
    columns = [("time", "t"), *((f"sensors.{name}", rig.column(name)) for name in rig.sensors)]
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
        if sensor.sensitivity and sensor.sensitivity.value == 0:
            yield Finding("is zero", f"{where}.sensitivity", "state reading per quantity: 100 mV/(N m)")
        if sensor.per_turn and not sensor.measures.startswith("rate:"):
            yield Finding("pulses measure a speed only", f"{where}.per_turn", "measure rate:JOINT, or remove per_turn")

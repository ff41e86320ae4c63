"""The rig file: what a test rig is to measure, with which sensors, under which working conditions.

A YAML (or JSON, TOML) file with the key `trunnion-rig: 1`, as strict as a model file: an unknown key is an error, every
quantity has a unit, every finding has its line.
"""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping, Sequence
from fractions import Fraction
from pathlib import Path
from typing import Annotated, Any, Literal, Self

from pydantic import Field, Tag, ValidationError

from trunnion.errors import Finding, MechanismError
from trunnion.model.entry import Name, Part, forms
from trunnion.model.expression import LITERAL
from trunnion.model.file import place, read_entries
from trunnion.model.findings import schema_findings
from trunnion.model.units import normalise
from trunnion.rig.reading.mapping import Accuracies, FixedAngle, FixedTime
from trunnion.rig.reading.units import Frequency, Number, Positive, Size

__all__ = ["FORMATS", "Encoder", "Idle", "Rig", "Schedule", "Sensor", "placed_in_rig"]

FORMATS = ("csv", "parquet", "tdms")
MOST_CONDITIONS = 10_000
MOST_VALUES = 1000
Value = float | str
Count = Annotated[int, Field(ge=1, le=1_000_000)]


class Idle(Part):
    """How long the machine stands unloaded before it runs, and after: there sensors of forces read their zero."""

    before: FixedTime = Field(default="0 s", validate_default=True)
    after: FixedTime = Field(default="0 s", validate_default=True)


class Schedule(Part):
    """The working conditions: a grid, or rows; how many cycles of each are recorded."""

    over: Mapping[str, str | Annotated[tuple[Value, ...], Field(min_length=1)]] = {}
    conditions: tuple[Mapping[str, Value], ...] = ()
    turns: Count = 10
    idle: Annotated[
        Annotated[FixedTime, Tag(":value")] | Annotated[Idle, Tag(":group")],
        forms("a time, or a group {before: 0.5 s, after: 0.5 s}"),
    ] = Field(default="0 s", validate_default=True)

    @property
    def pauses(self) -> Idle:
        """The idle times before and after."""
        return self.idle if isinstance(self.idle, Idle) else Idle(before=self.idle)

    def rows(self) -> list[dict[str, Value]]:
        """What is set in each condition; of a grid the last name runs fastest. MechanismError for what is no range."""
        rows: list[dict[str, Value]] = [{}]
        for name, given in self.over.items():
            values = _spread(given, f"schedule.over.{name}")
            if len(rows) * len(values) > MOST_CONDITIONS:
                what = f"the grid has more than {MOST_CONDITIONS:,} conditions"
                raise MechanismError(Finding(what, "schedule.over", "use fewer values"))
            rows = [{**row, name: value} for row in rows for value in values]
        return rows if not self.conditions else [dict(row) for row in self.conditions]


class Encoder(Part):
    """Pulses of the first driver: a running count, or the level of the signal; with an index pulse once a turn."""

    per_turn: Annotated[int, Field(ge=1, le=10_000_000)]
    kind: Literal["count", "level"] = "count"
    column: Name = "encoder"
    zero: FixedAngle = Field(default="0 deg", validate_default=True)
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
    range: Positive | None = None
    sensitivity: Number | None = None
    noise: Size = Field(default=0, validate_default=True)
    bits: Annotated[int, Field(ge=1, le=48)] | None = None
    span: Positive | None = None
    accuracy: Accuracies = Accuracies()
    offset: Size = Field(default=0, validate_default=True)
    drift: Number = Field(default=0, validate_default=True)
    bandwidth: Frequency | None = None
    per_turn: Annotated[int, Field(ge=1, le=10_000_000)] | None = None


class TimeColumn(Part):
    """The column of the time, and its unit."""

    column: Name = "t"
    unit: Literal["s", "ms", "us"] = "s"


class Rig(Part):
    """A test rig: schedule, sampling rate, encoder, sensors. Built from a file (`read`) or from keywords.

    A rig that exists is sound by itself; whether it fits a mechanism is told when it is put to it (`observe`).
    """

    version: Literal[1] = Field(default=1, alias="trunnion-rig")
    name: str = ""
    notes: str = ""
    set_: Mapping[str, Value] = Field(default={}, alias="set")
    schedule: Schedule = Schedule()
    rate: Frequency
    time: TimeColumn = TimeColumn()
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
            key = next((f"; it has '{one}', as {noun} do" for one, noun in _KEYS.items() if one in data), "")
            what = f"is no rig file: the key 'trunnion-rig' is missing{key}"
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


_KEYS = {"trunnion": "models", "trunnion-data": "mappings"}


def placed_in_rig(findings: Iterable[Finding], path: Path) -> list[Finding]:
    """Findings of a later stage with file and line of the entry of the rig file that they speak of, where it has it."""
    try:
        data, lines = read_entries(path, "a rig file")
    except MechanismError:
        return list(findings)
    own = {one.alias or name for name, one in Rig.model_fields.items()}
    return [
        one if one.file or one.where.split(".")[0] not in own else place([one], str(path), lines, data)[0]
        for one in findings
    ]


def _spread(given: str | Sequence[Value], where: str) -> list[Value]:
    """The values of a list, or of a text FROM:TO:COUNT, whose values are in the unit of its ends."""
    if not isinstance(given, str):
        return list(given)
    parts = [part.strip() for part in given.split(":")]
    if len(parts) == 1:
        return [given]
    remedy = "write FROM:TO:COUNT with a unit at both ends, such as 0 deg:30 deg:7, or a list"
    if len(parts) != 3 or not parts[2].isdigit() or not 2 <= int(parts[2]) <= MOST_VALUES:
        raise MechanismError(Finding(f"'{given}' is no range", where, remedy))
    ends = [_number(part) for part in parts[:2]]
    if None in ends:
        raise MechanismError(Finding(f"'{given}' is no range", where, remedy))
    (low, unit), (high, other) = (end for end in ends if end is not None)
    if unit != other and low and high:
        what = f"the ends of '{given}' are in different units, '{unit}' and '{other}'"
        raise MechanismError(Finding(what, where, "write both in the same unit"))
    unit, count = unit or other, int(parts[2]) - 1
    values = [float((low * (count - k) + high * k) / count) for k in range(count + 1)]
    return [f"{value:.12g} {unit}" if unit else value for value in values]


def _number(text: str) -> tuple[Fraction, str] | None:
    """A number and its unit as it is written."""
    plain = normalise(text).strip()
    found = LITERAL.fullmatch(plain.removeprefix("-").strip())
    if not found:
        return None
    return Fraction(found["number"]) * (-1 if plain.startswith("-") else 1), found["unit"] or found["per"] or ""


# ---- what cannot be, whatever the mechanism -------------------------------------------------------------------


def _unsound(rig: Rig) -> Iterable[Finding]:
    if rig.schedule.over and rig.schedule.conditions:
        yield Finding("has a grid and rows", "schedule", "state `over` or `conditions`, not both")
    pauses = rig.schedule.pauses
    for key, quantity in (("before", pauses.before), ("after", pauses.after)):
        if not 0 <= float(quantity.evaluate()) < 1e6:
            yield Finding(f"the time {quantity.source} is out of range", f"schedule.idle.{key}", "write 0.5 s")
    yield from _shared_columns(rig)
    for name, sensor in rig.sensors.items():
        yield from _unsound_sensor(f"sensors.{name}", sensor)


def _shared_columns(rig: Rig) -> Iterable[Finding]:
    taken = {rig.time.column: "time"}
    others = [(f"sensors.{name}", rig.column(name)) for name in rig.sensors]
    if rig.encoder:
        others.append(("encoder", rig.encoder.column))
    if rig.encoder and rig.encoder.index:
        others.append(("encoder.index", rig.encoder.index))
    for where, column in others:
        if column in taken:
            yield Finding(f"the column '{column}' is that of {taken[column]} too", where, "state another `column`")
        taken.setdefault(column, where)


def _unsound_sensor(where: str, sensor: Sensor) -> Iterable[Finding]:
    for wrong, key, what, remedy in (
        (sensor.bits and not (sensor.span or sensor.range), "bits", "has bits and neither span nor range",
         "state what they are spread over: span: 10 V"),
        (sensor.span and not sensor.bits, "span", "is a span without bits", "state bits: 16"),
        (sensor.sensitivity and sensor.sensitivity.value == 0, "sensitivity", "is zero",
         "state reading per quantity: 100 mV/(N m)"),
        (sensor.per_turn and not sensor.measures.startswith("rate:"), "per_turn", "pulses measure a speed only",
         "measure rate:JOINT, or remove per_turn"),
    ):  # fmt: skip
        if wrong:
            yield Finding(what, f"{where}.{key}", remedy)

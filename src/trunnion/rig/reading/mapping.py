"""The mapping file: which columns of a data file measure what of the model, in which units, and what to do with them.

Strict, like a model file: an unknown key, a wrong unit or a name that is not there is a finding with file and line.
"""

from __future__ import annotations

import json
import os
from collections.abc import Iterable, Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import AfterValidator, BeforeValidator, Field, Tag, ValidationError, WithJsonSchema, model_validator

from trunnion.errors import Finding, MechanismError
from trunnion.model.entry import Name, Part, forms, problem
from trunnion.model.file import Lines, place, read_entries
from trunnion.model.names import nearest
from trunnion.model.places import schema_findings
from trunnion.model.schema import SchemaGenerator
from trunnion.model.units import UnitError
from trunnion.rig.reading import units

Sign = Literal[1, -1]
Pulses = Annotated[int, Field(ge=1, le=10_000_000)]  # of a turn


def _ordered(span: tuple[units.Amount, units.Amount]) -> tuple[units.Amount, units.Amount]:
    """A stretch of time that begins before it ends."""
    if not span[0].value < span[1].value:
        raise problem(f"[{span[0].source}, {span[1].source}] ends before it begins", "write [0 s, 0.5 s]")
    return span


def _spans(value: object) -> object:
    """One stretch [from, to] as a list of stretches."""
    single = isinstance(value, (list, tuple)) and value and not isinstance(value[0], (list, tuple))
    return [value] if single else value


Span = Annotated[tuple[units.Time, units.Time], AfterValidator(_ordered)]
_PAIR = {"type": "array", "items": {"type": ["number", "string"]}, "minItems": 2, "maxItems": 2}


class Mean(Part):
    """A value that the data tell: the mean of a channel over the turns; of the speed by the angle with `mean: angle`
    where no channel has that name."""

    mean: str


Setting = Annotated[
    Annotated[Mean, Tag(":group")] | Annotated[units.Number, Tag(":value")],
    forms("a number with its unit, or {mean: channel}"),
]


class TimeBase(Part):
    """Where time comes from: a column with its unit, or a sampling rate. dayfirst: 3/4/2026 is the third of April."""

    column: str | None = None
    unit: units.TimeUnit | None = None
    rate: units.Frequency | None = None
    dayfirst: bool = True

    @model_validator(mode="after")
    def _single(self) -> TimeBase:
        if (self.column is None) == (self.rate is None):
            raise problem("time is either a column or a rate", "write {column: t, unit: s} or {rate: 2 kHz}")
        return self


class Index(Part):
    """A pulse once a turn."""

    column: str


# keys that each source of the angle needs, and those it may have
_KEYS = {
    "pulses": (("column", "per_turn"), ("kind", "wrap", "index")),
    "column": (("column",), ("unit", "resolution")),
    "time": (("speed",), ()),
}


class AngleSource(Part):
    """Where the coordinate of the driver comes from."""

    from_: Literal["pulses", "column", "time"] = Field(alias="from")
    column: str | None = None
    unit: units.AngleUnit | None = None
    per_turn: Pulses | None = None
    kind: Literal["count"] | None = None
    wrap: Annotated[int, Field(ge=2)] | None = None
    speed: units.AngularSpeed | None = None
    zero: units.Angle = units.ZERO
    index: Index | None = None
    sign: Sign = 1
    resolution: units.Step | None = None

    @model_validator(mode="after")
    def _of_its_kind(self) -> AngleSource:
        needed, allowed = _KEYS[self.from_]
        keys = {key for parts in _KEYS.values() for part in parts for key in part}
        present = {key for key in keys if getattr(self, key) is not None}
        if missing := [key for key in needed if key not in present]:
            raise problem(f"from: {self.from_} needs {' and '.join(missing)}", "add it")
        if extra := sorted(present - {*needed, *allowed}):
            remedy = f"remove it; the keys of from: {self.from_} are {', '.join((*needed, *allowed))}"
            raise problem(f"from: {self.from_} does not use {', '.join(extra)}", remedy)
        if self.speed is not None and self.speed.value == 0:
            raise problem("the speed is zero: there are no turns", "write the speed of the driver, such as 1500 rpm")
        return self


class Zero(Part):
    """The zero of a channel as the mean over stretches of time in which nothing loads the sensor."""

    over: Annotated[
        tuple[Span, ...],
        BeforeValidator(_spans),
        Field(min_length=1, max_length=20),
        WithJsonSchema({"anyOf": [_PAIR, {"type": "array", "items": _PAIR, "minItems": 1, "maxItems": 20}]}),
    ]


ChannelZero = Annotated[
    Annotated[Zero, Tag(":group")] | Annotated[units.Number, Tag(":value")],
    forms("a number with its unit, or {over: [0 s, 0.5 s]}"),
]


class Accuracies(Part):
    """Standard uncertainties of a sensor: of its gain, relative, and of its zero."""

    gain: units.Share = units.ZERO
    zero: units.Size = units.ZERO


class Channel(Part):
    """A column that measures something of the model, and how its readings become that.

    Quantity = sign · (reading − zero) · gain, or / gain, as its unit tells. per_turn: pulses of a speed that is worked
    out from the time from each to the next.
    """

    column: str
    measures: units.MeasureText
    unit: units.UnitText | None = None
    gain: units.Number | None = None
    sign: Sign = 1
    zero: ChannelZero = units.ZERO
    range: units.Positive | None = None
    resolution: units.Positive | None = None
    accuracy: Accuracies = Accuracies()
    per_turn: Pulses | None = None

    @model_validator(mode="after")
    def _fitting(self) -> Channel:
        if self.per_turn is not None and not self.measures.startswith("rate:"):
            raise problem("pulses measure a speed only", "measure rate:JOINT, or remove per_turn")
        if self.unit is not None:
            try:
                self.scale(self.unit)
            except UnitError as error:
                raise problem(error.what, error.remedy) from None
        return self

    def scale(self, unit: str) -> units.SensorScale:
        """How readings in a unit become the quantity; UnitError if they, or an amount of the channel, cannot."""
        scale = units.scale(self.measures, unit, self.gain)
        amounts = {"zero": self.zero, "range": self.range, "resolution": self.resolution}
        for key, amount in {**amounts, "accuracy.zero": self.accuracy.zero}.items():
            if isinstance(amount, units.Amount):
                scale.reading(amount, key)
        return scale


class FileAngle(Part):
    """The angle in one data file: its zero, in place of that of `angle`."""

    zero: units.Angle


class File(Part):
    """A data file, what was set while it was recorded, the time of it that is used, its zero of the angle."""

    file: str = Field(min_length=1)
    set: Mapping[str, Setting] = {}
    over: Span | None = None
    angle: FileAngle | None = None


class Filter(Part):
    """Butterworth low-pass, forward and backward: without delay."""

    cut_off: units.Frequency
    order: Annotated[int, Field(ge=1, le=12)] = 4


def _cycle(amount: units.Amount) -> units.Amount:
    """An angle or a time above zero."""
    of_kind = amount.plain or ([*amount.dimensions.values()] == [1] and {"rad", "s"} & amount.dimensions.keys())
    if not of_kind or not amount.value > 0:
        raise problem(f"'{amount.source}' is no angle and no time above zero", "write it as 360 deg or 0.5 s")
    return amount


class DataMapping(Part):
    """A mapping file."""

    version: Literal[1] = Field(alias="trunnion-data")
    name: str = ""
    notes: str = ""
    files: tuple[File, ...] = ()
    time: TimeBase | None = None
    angle: AngleSource | None = None
    channels: Annotated[Mapping[Name, Channel], Field(min_length=1)]
    set: Mapping[str, Setting] = {}
    filter: Filter | None = None
    cycle: Annotated[units.Number, AfterValidator(_cycle)] = units.read_amount("1 turn")
    start: units.Angle = units.ZERO
    positions: Annotated[int, Field(ge=2, le=100_000)] = 360
    drift: Literal["report", "remove"] = "report"

    def of_file(self, entry: File) -> DataMapping:
        """The same with what a file states of its own angle, and what was set."""
        changes: dict[str, Any] = {"set": {**self.set, **entry.set}}
        if entry.angle is not None and self.angle is not None:
            changes["angle"] = self.angle.model_copy(update={"zero": entry.angle.zero})
        return self.model_copy(update=changes)

    @property
    def timed(self) -> bool:
        """Whether the cycle is a time."""
        return "s" in self.cycle.dimensions


# ---- the file -------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Mapped:
    """A mapping with the folder that its files lie below, and the lines of its entries for findings."""

    mapping: DataMapping
    folder: Path
    file: str
    lines: Lines
    data: Mapping[str, Any]

    def placed(self, findings: list[Finding]) -> list[Finding]:
        """Findings about the mapping with its file and line; those of other files as they are."""
        return place(findings, self.file, self.lines, self.data) if self.file else findings

    def files(self, named: Iterable[str | os.PathLike[str]] | None) -> list[tuple[Path, File]]:
        """Data files with their entries; one of the command line has the entry of the same file, else of its name."""
        entries, paths = self.mapping.files, [Path(path) for path in named or ()]
        if not paths and not entries:
            remedy = "write files: [{file: run-01.csv}], or name them after the mapping"
            raise MechanismError(self.placed([Finding("no data file is named", "files", remedy)]))
        if not paths:
            return [(self.folder / entry.file, entry) for entry in entries]
        by_path = {(self.folder / entry.file).resolve(): entry for entry in entries}
        names = [Path(entry.file).name for entry in entries]
        by_name = {name: entry for entry, name in zip(entries, names, strict=True) if names.count(name) == 1}
        return [(path, by_path.get(path.resolve()) or by_name.get(path.name) or File(file=path.name or "."))
                for path in paths]  # fmt: skip


def read_mapping(source: str | os.PathLike[str] | Mapping[str, Any]) -> Mapped:
    """A mapping from its file, or from plain data, whose files lie below the working folder.

    MechanismError with every finding, each with file and line.
    """
    if isinstance(source, Mapping):
        data, lines, file, folder = dict(source), Lines(), "", Path()
    else:
        path = Path(source)
        data, lines = read_entries(path, "a mapping file", "write trunnion-data: 1, then files, time, angle, channels")
        file, folder = str(path), path.parent
    try:
        mapping = DataMapping.model_validate(data)
        findings = list(_unsound(mapping, folder))
    except ValidationError as error:
        findings = schema_findings(error, DataMapping, data)
    if findings:
        raise MechanismError(place(findings, file, lines, data) if file else findings)
    return Mapped(mapping, folder, file, lines, data)


def _unsound(mapping: DataMapping, folder: Path) -> Iterator[Finding]:
    """What an entry alone cannot tell: names of channels, the cycle, entries of files that do not fit the mapping."""
    angle = mapping.angle
    sources = [*mapping.channels, *(["angle"] if angle else [])]  # the mean speed by the angle
    settings = {"set": mapping.set} | {f"files.{k}.set": file.set for k, file in enumerate(mapping.files)}
    named = {f"{key}.{name}.mean": value.mean for key, values in settings.items() for name, value in values.items()
             if isinstance(value, Mean)}  # fmt: skip
    for where, name in named.items():
        if name not in sources:
            yield Finding(f"there is no channel '{name}'", where, nearest(name, sources))
    if angle is None and not mapping.timed:
        remedy = "add angle: {from: …}, or write cycle: as a time"
        yield Finding("'angle' is missing: no column gives the coordinate of the driver", "", remedy)
    for k, file in enumerate(mapping.files):
        inside = False  # the mapping is data from a stranger, and so are links beside it
        with suppress(OSError, ValueError, RuntimeError):
            inside = (folder / file.file).resolve().is_relative_to(folder.resolve())
        if not inside or Path(file.file).is_absolute():
            what = f"'{file.file[:80]}' is not below the folder of the mapping"
            yield Finding(what, f"files.{k}.file", "put it there, or name it on the command line")
        if file.angle is not None and angle is None:
            what = "states a zero of the angle, but no column gives an angle"
            yield Finding(what, f"files.{k}.angle", "add angle: {from: …}, or remove it")


def schema_text() -> str:
    """The JSON Schema (2020-12) of a mapping file, for editors that complete and check as you type."""
    schema = {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        **DataMapping.model_json_schema(schema_generator=SchemaGenerator),
        "title": "Trunnion mapping file",
    }
    return json.dumps(schema, indent=1, ensure_ascii=False) + "\n"

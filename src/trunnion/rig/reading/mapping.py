"""The mapping file: which columns of a data file measure what of the model, in which units, and what to do with them.

Strict, like a model file: an unknown key, a wrong unit or a name that is not there is a finding with file and line.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, Literal

from pydantic import AfterValidator, BeforeValidator, Field, Tag, WithJsonSchema, model_validator

from trunnion.model.entry import Name, Part, forms, problem
from trunnion.model.quantity import Angle, AnyQuantity, Dimensionless, Quantity, Rate, Time
from trunnion.model.units import KINDS, UnitError
from trunnion.rig.reading.scale import MeasureText, SensorScale, scale
from trunnion.rig.reading.sensor_quantity import Amount, Frequency, Number, UnitText, alike, dimensions

__all__ = [
    "AngleSource",
    "Channel",
    "DataMapping",
    "File",
    "FixedAngle",
    "FixedNumber",
    "FixedTime",
    "FromData",
    "TimeBase",
    "Zero",
]

Sign = Literal[1, -1]


class FromData(Part):
    """A value that the data tell: the mean of a channel over the turns, of the speed by the angle with `mean: angle`
    where no channel has that name, or a column that states it."""

    mean: str | None = None
    column: str | None = None
    unit: UnitText | None = None

    @model_validator(mode="after")
    def _one(self) -> FromData:
        if (self.mean is None) == (self.column is None):
            raise problem("a value is taken from one of mean and column", "write {mean: channel} or {column: name}")
        if self.mean is not None and self.unit is not None:
            raise problem("a mean has the unit of its channel", "remove unit")
        return self


def fixed(quantity: Quantity) -> Quantity:
    """A number with its unit; there are no dimensions here that an expression could speak of."""
    if quantity.names:
        what = f"'{quantity.source}' refers to {', '.join(quantity.names)}"
        raise problem(what, "write a number with its unit")
    if quantity.tolerance is not None:
        raise problem(f"'{quantity.source}' has a tolerance, which has no effect here", "write the value alone")
    return quantity


FixedAngle = Annotated[Angle, AfterValidator(fixed)]
FixedNumber = Annotated[Dimensionless, AfterValidator(fixed)]
FixedRate = Annotated[Rate, AfterValidator(fixed)]
FixedTime = Annotated[Time, AfterValidator(fixed)]
FixedQuantity = Annotated[AnyQuantity, AfterValidator(fixed)]
Setting = Annotated[
    Annotated[FromData, Tag(":group")] | Annotated[FixedQuantity, Tag(":value")],
    forms("a number with its unit, {mean: channel} or {column: name, unit: deg}"),
]


def _span(value: object) -> object:
    """One stretch [from, to] as a list of stretches."""
    if isinstance(value, (list, tuple)) and value and not isinstance(value[0], (list, tuple)):
        return [value]
    return value


_PAIR = {"type": "array", "items": {"type": ["number", "string"]}, "minItems": 2, "maxItems": 2}


class FileAngle(Part):
    """The angle in one data file: its zero, in place of that of `angle`."""

    zero: FixedAngle


class TimeBase(Part):
    """Where time comes from: a column with its unit, or a sampling rate."""

    column: str | None = None
    unit: UnitText | None = None
    rate: Frequency | None = None

    @model_validator(mode="after")
    def _one(self) -> TimeBase:
        if (self.column is None) == (self.rate is None):
            raise problem("time is either a column or a rate", "write {column: t, unit: s} or {rate: 2 kHz}")
        if self.unit is not None:
            _unit_of(self.unit, "s", "a unit of time such as ms")
        return self


class Index(Part):
    """A pulse once a turn."""

    column: str


class AngleSource(Part):
    """Where the coordinate of the driver comes from."""

    from_: Literal["pulses", "column", "time", "speed"] = Field(alias="from")
    column: str | None = None
    unit: UnitText | None = None
    per_turn: Annotated[int, Field(ge=1, le=10_000_000)] | None = None
    kind: Literal["count", "level"] | None = None
    wrap: Annotated[int, Field(ge=2)] | None = None
    speed: FixedRate | None = None
    channel: str | None = None
    zero: FixedAngle = Quantity(0.0, KINDS["angle"])
    index: Index | None = None
    sign: Sign = 1
    resolution: FixedAngle | None = None

    @model_validator(mode="after")
    def _of_its_kind(self) -> AngleSource:
        needed, allowed = _KEYS[self.from_]
        keys = {key for own in _KEYS.values() for part in own for key in part}
        stated = {key for key in keys if getattr(self, key) is not None}
        if missing := [key for key in needed if key not in stated]:
            raise problem(f"from: {self.from_} needs {' and '.join(missing)}", "add it")
        if extra := sorted(stated - {*needed, *allowed}):
            remedy = f"remove it; the keys of from: {self.from_} are {', '.join((*needed, *allowed))}"
            raise problem(f"from: {self.from_} does not use {', '.join(extra)}", remedy)
        if self.wrap is not None and self.kind == "level":
            raise problem("only a running count wraps", "remove wrap, or write kind: count")
        if self.unit is not None:
            _unit_of(self.unit, "rad", "a unit of angle such as deg")
        if self.resolution is not None and not self.resolution.evaluate() > 0:
            raise problem("the resolution is not above zero", "write the step of the readings, such as 0.1 deg")
        if self.speed is not None and self.speed.evaluate() == 0:
            raise problem("the speed is zero: there are no turns", "write the speed of the driver, such as 1500 rpm")
        return self


# keys each source needs, and those it may have
_KEYS = {
    "pulses": (("column", "per_turn"), ("kind", "wrap", "index")),
    "column": (("column",), ("unit", "index", "resolution")),
    "time": (("speed",), ("index",)),
    "speed": (("channel",), ("index",)),
}


class Zero(Part):
    """The zero of a channel as the mean over stretches of time in which nothing loads the sensor."""

    over: Annotated[
        tuple[tuple[Number, Number], ...],
        BeforeValidator(_span),
        Field(min_length=1, max_length=20),
        WithJsonSchema({"anyOf": [_PAIR, {"type": "array", "items": _PAIR, "minItems": 1, "maxItems": 20}]}),
    ]

    @model_validator(mode="after")
    def _ordered(self) -> Zero:
        _check_spans(self.over)
        return self


ChannelZero = Annotated[
    Annotated[Zero, Tag(":group")] | Annotated[Number, Tag(":value")],
    forms("a number with its unit, or {over: [0 s, 0.5 s]}"),
]


class Accuracies(Part):
    """Standard uncertainties of a sensor: of its gain, relative, and of its zero."""

    gain: FixedNumber = Quantity(0.0, KINDS["number"])
    zero: Number = Amount(0.0, 0.0, "", {})

    @model_validator(mode="after")
    def _positive(self) -> Accuracies:
        if self.gain.evaluate() < 0 or self.zero.value < 0:
            raise problem("a standard uncertainty is below zero", "write it without a sign")
        return self


class Channel(Part):
    """A column that measures something of the model, and how its readings become that.

    Quantity = sign · (reading − zero) · gain, or / gain, as its unit tells.
    """

    column: str
    measures: MeasureText
    unit: UnitText | None = None
    gain: Number | None = None
    sign: Sign = 1
    zero: ChannelZero = Amount(0.0, 0.0, "", {})
    range: Number | None = None
    resolution: Number | None = None
    accuracy: Accuracies = Accuracies()

    @model_validator(mode="after")
    def _fitting(self) -> Channel:
        if self.range is not None and self.range.value <= 0:
            raise problem("the range is not above zero", "write the full scale, such as 100 N m")
        if self.resolution is not None and self.resolution.value <= 0:
            raise problem("the resolution is not above zero", "write the step of the readings, such as 0.1 deg")
        if self.unit is not None:
            self.scale(self.unit)
        return self

    def scale(self, unit: str) -> SensorScale:
        """How readings in a unit become the quantity; an error of pydantic if they cannot."""
        try:
            found = scale(self.measures, unit, self.gain, self.column)
            stated = {"zero": self.zero, "range": self.range, "resolution": self.resolution}
            for key, amount in {**stated, "accuracy.zero": self.accuracy.zero}.items():
                if isinstance(amount, Amount):
                    found.reading(amount, key)
        except UnitError as error:
            raise problem(error.what, error.remedy) from None
        return found


class FileChannel(Part):
    """A channel in one data file, as of another setting of its amplifier: what it states in place of the channel's."""

    unit: UnitText | None = None
    gain: Number | None = None
    zero: ChannelZero | None = None
    range: Number | None = None
    resolution: Number | None = None
    accuracy: Accuracies | None = None

    def of(self, channel: Channel) -> Channel:
        """The channel as it is in the file; an error of pydantic if the two do not go together."""
        stated = {key: getattr(self, key) for key in type(self).model_fields if getattr(self, key) is not None}
        found = channel.model_copy(update=stated)
        if found.unit is not None:
            found.scale(found.unit)
        return found


class File(Part):
    """A data file, what was set while it was recorded, the time of it that is used, its zero of the angle, channels."""

    file: str = Field(min_length=1)
    set: Mapping[str, Setting] = {}
    over: tuple[Number, Number] | None = None
    angle: FileAngle | None = None
    channels: Mapping[Name, FileChannel] = {}

    @model_validator(mode="after")
    def _ordered(self) -> File:
        _check_spans([self.over] if self.over else [])
        return self


class Filter(Part):
    """Butterworth low-pass, forward and backward: without delay."""

    cut_off: Frequency
    order: Annotated[int, Field(ge=1, le=12)] = 4


class DataMapping(Part):
    """A mapping file."""

    version: Literal[1] = Field(alias="trunnion-data")
    name: str = ""
    notes: str = ""
    files: tuple[File, ...] = ()
    time: TimeBase | None = None
    angle: AngleSource | None = None
    channels: Annotated[Mapping[Name, Channel], Field(min_length=1)] = {}
    set: Mapping[str, Setting] = {}
    filter: Filter | None = None
    cycle: FixedQuantity = Quantity.read("1 turn")
    start: FixedAngle = Quantity(0.0, KINDS["angle"])
    positions: Annotated[int, Field(ge=2, le=100_000)] = 360
    drift: Literal["report", "remove"] = "report"

    def of_file(self, entry: File) -> DataMapping:
        """The same with what a file states of its own angle and its own channels."""
        changes: dict[str, Any] = {}
        if entry.angle is not None and self.angle is not None:
            changes["angle"] = self.angle.model_copy(update={"zero": entry.angle.zero})
        if entry.channels:
            changes["channels"] = {
                name: entry.channels[name].of(one) if name in entry.channels else one
                for name, one in self.channels.items()
            }
        return self.model_copy(update=changes) if changes else self

    @property
    def timed(self) -> bool:
        """Whether the cycle is a time."""
        return self.cycle.check({}) == KINDS["time"].dimensions[0]


def _check_spans(spans: Any) -> None:
    """Stretches of time that begin before they end."""
    for begin, end in spans:
        for one in (begin, end):
            if not one.plain and not alike(one.dimensions, {"s": 1}):  # type: ignore[dict-item]
                raise problem(f"'{one.source}' is no time", "write [0 s, 0.5 s]")
        if not begin.value < end.value:
            raise problem(f"[{begin.source}, {end.source}] ends before it begins", "write [0 s, 0.5 s]")


def _unit_of(text: str, si: str, needed: str) -> None:
    """An error of pydantic if a unit does not measure the same as that of SI."""
    if not alike(dimensions(text)[1], dimensions(si)[1]):
        raise problem(f"the unit '{text}' is not {needed}", f"write {needed}")

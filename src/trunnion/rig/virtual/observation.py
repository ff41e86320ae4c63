"""What a virtual rig has recorded: its working conditions, the errors of its sensors, and the readings they make.

It leaves data files like those of a real rig, the mapping that reads them, and the truth. CSV, Parquet and TDMS hold
the same numbers to the last bit: they are rounded to what the shortest text of a CSV cell says before any is written.
"""

from __future__ import annotations

import importlib.util
import math
import os
import tempfile
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any, NamedTuple, Self

import numpy as np
from numpy.typing import NDArray
from ruamel.yaml import YAML

from trunnion.errors import Finding, MechanismError, Status
from trunnion.files import guard
from trunnion.model.arguments import strict_arguments
from trunnion.model.mechanism import Mechanism
from trunnion.rig.reading.measurement import Accuracy, Condition, Measurement, Signal
from trunnion.rig.virtual.rig_file import (
    FORMATS,
    Rig,
    SensorChannel,
    SensorErrors,
    Value,
    draw,
    pulses,
    readings,
    stream,
)  # fmt: skip
from trunnion.solve.run import Run
from trunnion.version import __version__

__all__ = [
    "MAPPING", "TRUTH", "Case", "Observation", "Record", "check_folder", "check_form", "check_seed",
]  # fmt: skip

Array = NDArray[np.float64]
MOST_SEEDS = 1 << 128
POSITIONS = (360, 180, 120, 90, 72, 60, 36, 24, 12)  # of a cycle: fewer than samples
FEWER = 0.99
AT_REST = 0.9  # share of the idle stretch that the zero is taken from: a filter carries the run into the rest
DECIMALS = 9  # of the time, s


@dataclass(frozen=True)
class Case:
    """A working condition that the model can be in: what is set, how it is sampled, what is true.

    rate: samples a second; before, running: samples of the idle stretch and of the run; lead: sampling intervals from
    the first sample of the run to the start of its first cycle, a whole number and a half; true: (sensor, sample),
    courses of the run, SI; time, status: of the instants of the cycle at which the model is solved; efficiency: of the
    model, NaN if it has none.
    """

    number: int
    name: str
    settings: Mapping[str, Value]
    run: Run
    rate: float
    before: int
    running: int
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
        return self.before + self.running

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
        settings = ", ".join(f"{name} = {text}" for name, text in texts.items()) or "as the model states"
        return f"condition {self.number} ({settings})"


class Record(NamedTuple):
    """The columns of one file, by name; NaN is an empty cell. settings: what is set in it, as in the rig file."""

    name: str
    settings: Mapping[str, Value]
    columns: Mapping[str, NDArray[Any]]


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
    cases: tuple[Case, ...]
    skipped: tuple[int, ...]
    findings: tuple[Finding, ...]

    @cached_property
    def drawn(self) -> Mapping[str, SensorErrors]:
        """The errors of the sensors."""
        return {name: draw(channel, self.seed) for name, channel in self.channels.items()}

    def seeded(self, seed: int) -> Self:
        """The same with the random numbers of another seed: other errors of the sensors, other noise."""
        check_seed(seed)
        return replace(self, seed=int(seed))

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
        return {"t": "s"} | {channel.column: channel.reading for channel in self.channels.values()}

    def records(self) -> Iterator[Record]:
        """The readings of every condition, one after the other."""
        for case in self.cases:
            columns: dict[str, NDArray[Any]] = {
                "t": np.round((np.arange(case.rows) - case.origin) / self.rate, DECIMALS)
            }
            if encoder := self.rig.encoder:
                angle, _ = case.drive(np.maximum(np.arange(case.rows) - case.before, 0))
                columns[encoder.column] = count = pulses(angle, encoder.per_turn)
                if encoder.index:
                    columns[encoder.index] = (count % encoder.per_turn == 0).astype(np.int64)
            columns |= {self.channels[name].column: values for name, values in self._readings(case).items()}
            yield Record(case.name, case.settings, columns)

    def _readings(self, case: Case) -> dict[str, Array]:
        """Readings by sensor, in their units, the idle stretch included."""
        values = {}
        for (name, channel), course in zip(self.channels.items(), case.true, strict=True):
            true = np.concatenate([np.full(case.before, 0.0 if channel.at_rest else course[0]), course])
            noise = stream(self.seed, case.number, name, "noise").standard_normal(case.rows)
            running = slice(case.before, case.rows)
            values[name] = readings(channel, true, running, self.rate, self.drawn[name], noise)
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
        own = math.sqrt(max(zero - channel.zero, 0.0) * (zero + channel.zero)) if rests else 0.0
        return Accuracy(zero, channel.gain, channel.step, own)

    def measurement(self, positions: int = 360) -> Measurement:
        """The readings as a Measurement, without files in between: the angle is the true one."""
        phase, turns, conditions = np.arange(positions) / positions, np.arange(self.rig.schedule.turns)[:, None], []
        for case in self.cases:
            at, courses = case.before + case.lead + (turns + phase) * case.cycle * self.rate, {}
            for name, values in self._readings(case).items():
                channel, values = self.channels[name], values / self.channels[name].per
                zero = float(np.mean(values[: case.before])) if channel.zeroed and case.before else 0.0
                by_turn = np.interp(at.ravel(), np.arange(case.rows), values - zero).reshape(at.shape)
                courses[name] = Signal(name, channel.sensor.measures, channel.unit, by_turn, self.accuracy(name),
                                       per_turn=channel.sensor.per_turn or 0)  # fmt: skip
            settings = {**self.rig.set_, **case.settings}
            changed = self.mechanism.with_values(settings)
            values_set = {name: float(np.ravel(changed.parameters()[changed.path_of(name)])[0]) for name in settings}
            conditions.append(Condition(case.name, values_set, phase, courses, (), case.start[1]))
        return Measurement(self.rig.name, tuple(conditions), self.findings, ("made by a virtual rig, not read",))

    def mapping(self, form: str = "") -> dict[str, Any]:
        """The mapping that reads the files: what a laboratory knows, and no more than that."""
        case, encoder = self.cases[0], self.rig.encoder
        timed = encoder is None or not case.named
        entries = []
        for item in self.cases:
            entry: dict[str, Any] = {"file": f"{item.name}.{form or self.rig.format}"}
            if item.settings:
                entry["set"] = dict(item.settings)
            if encoder and (zero := _zero(self, item)) != _zero(self, case):
                entry["angle"] = {"zero": _degrees(zero)}
            if timed and item.before:  # where the time alone tells the position: when it ran
                ends = (item.before - item.origin, item.rows - 1 - item.origin)
                entry["over"] = [f"{end / item.rate:.9g} s" for end in ends]
            entries.append(entry)
        least = min(item.cycle for item in self.cases) * self.rate
        positions = next((item for item in POSITIONS if item < least * FEWER), POSITIONS[-1])
        return {
            "trunnion-data": 1, "name": self.rig.name or self.mechanism.name, "files": entries,
            **({"set": dict(self.rig.set_)} if self.rig.set_ else {}),
            "time": {"column": "t", "unit": "s"},
            **_angle(self),
            **({"positions": positions} if positions != POSITIONS[0] else {}),
            "channels": {name: _channel(self, name) for name in self.channels},
        }  # fmt: skip

    def truth(self) -> dict[str, Any]:
        """What was drawn and what is true, in SI: to check what is found from the files, not to find it."""
        sensors, conditions = {}, []
        for name, channel in self.channels.items():
            errors = self.drawn[name]
            sensors[name] = {
                "measures": channel.sensor.measures, "unit": channel.unit, "gain_error": errors.gain,
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
        """Write a file for each condition, `mapping.yaml` and `truth.yaml` into a folder, once all are complete.

        Parameters
        ----------
        folder : made if it is not there.
        form : csv, parquet or tdms, that of the rig file if not given.
        progress : called with the files written.

        Returns
        -------
        The names of the files.
        """
        form, folder, names = form or self.rig.format, Path(folder), []
        check_form(form)
        check_folder(self.rig, folder, form)
        home = next(item for item in (folder, *folder.absolute().parents) if item.exists())
        if not home.is_dir():
            raise MechanismError(Finding("cannot be made a folder: it is a file", str(home), "name a folder"))
        try:
            with tempfile.TemporaryDirectory(prefix=".rig-", dir=home, ignore_cleanup_errors=True) as new:
                for done, record in enumerate(self.records(), 1):
                    names.append(f"{record.name}.{form}")
                    WRITERS[form](record, self.units, Path(new) / names[-1])
                    if progress:
                        progress(done)
                for name, entries in ((MAPPING, self.mapping(form)), (TRUTH, self.truth())):
                    names.append(name)
                    _write_yaml(Path(new) / name, entries)
                folder.mkdir(parents=True, exist_ok=True)
                for path in sorted(Path(new).iterdir()):
                    path.replace(folder / path.name)
        except OSError as error:
            what = f"cannot be written: {error.strerror or error}"
            raise MechanismError(Finding(what, str(folder), "make room there, or name another folder")) from None
        return names


def check_seed(seed: int) -> None:
    """MechanismError for what seeds no random numbers."""
    if not 0 <= seed < MOST_SEEDS:
        raise MechanismError(Finding(f"the seed {seed} is no whole number from 0", "seed", "give one such as 1"))


# ---- the mapping ----------------------------------------------------------------------------------------------------


def _degrees(angle: float) -> str:
    return f"{math.degrees(angle):.12g} deg"


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
        if zero := _zero(observation, case):
            source["zero"] = _degrees(zero)
        if encoder.index:
            source["index"] = {"column": encoder.index}
    else:
        angle, rate = (float(item.flat[0]) for item in case.drive(-case.before))
        source = {"from": "time", "speed": f"{rate:.15g} rad/s", "zero": _degrees(angle)}
    entries: dict[str, Any] = {"angle": source}
    if abs(abs(last - first) - 2 * math.pi) > 1e-11:
        entries["cycle"] = _degrees(abs(last - first))
    return entries | ({"start": _degrees(first)} if first else {})


def _zero(observation: Observation, case: Case) -> float:
    """Coordinate, rad, where an encoder reads zero: at its index, else where its count is 0.

    Backward, the first pulse of a turn is entered at its far end.
    """
    encoder = observation.rig.encoder
    backward = encoder is not None and encoder.index and case.start[1] < 0
    return 2 * math.pi / encoder.per_turn if encoder is not None and backward else 0.0


def _channel(observation: Observation, name: str) -> dict[str, Any]:
    channel, case, zero = observation.channels[name], observation.cases[0], observation.accuracy(name).zero
    sensor = channel.sensor
    entry: dict[str, Any] = {"column": channel.column, "measures": sensor.measures, "unit": channel.reading}
    if sensor.sensitivity:
        entry["gain"] = sensor.sensitivity.source
    if channel.zeroed and case.before > 1:
        rest = (-case.origin, AT_REST * case.before - case.origin)
        entry["zero"] = {"over": [f"{item / case.rate + 0.0:.6g} s" for item in rest]}
    if sensor.range:
        entry["range"] = sensor.range.source
    if sensor.per_turn:
        entry["per_turn"] = sensor.per_turn
    accuracy: dict[str, Any] = {"gain": sensor.accuracy.gain.source} if channel.gain else {}
    if channel.noise <= channel.step / 2:  # which does not carry readings over the steps of the converter
        zero = math.hypot(zero, channel.step / math.sqrt(12))  # GUM F.2.2.1
    if zero:
        accuracy["zero"] = f"{zero:.4g} {channel.unit}"
    return entry | ({"accuracy": accuracy} if accuracy else {})


# ---- files ----------------------------------------------------------------------------------------------------------

MAPPING, TRUTH = "mapping.yaml", "truth.yaml"
HEADS = {
    MAPPING: "# What the columns of the data files measure: for `trunnion data`, `compare` and `identify`.\n",
    TRUTH: "# True values and random errors of the virtual rig, in SI, to check results obtained from the files.\n",
}
PACKAGES = {"parquet": "pyarrow", "tdms": "nptdms"}


def check_form(form: str) -> None:
    """MechanismError for a format that is none, or whose package is not there."""
    if form not in FORMATS:
        raise MechanismError(Finding(f"'{form}' is no format of data files", "format", f"use {', '.join(FORMATS)}"))
    if form in PACKAGES and importlib.util.find_spec(PACKAGES[form]) is None:
        raise MechanismError(Finding(f"{form} needs {PACKAGES[form]}", "format", f"pip install 'trunnion[{form}]'"))


def check_folder(rig: Rig, folder: str | os.PathLike[str], form: str) -> None:
    """MechanismError if a file of a rig would be written over one that is read, or over one that no rig has written.

    What is in a folder with a truth that a rig has written is a rig's: its files are written anew.
    """
    paths = [Path(folder) / name for name in (*(f"{name}.{form or rig.format}" for name in rig.names), MAPPING, TRUTH)]
    for path in paths:
        guard(path)
    truth, strange = paths[-1], [path.name for path in paths if path.exists()]
    if strange and not (truth.is_file() and truth.read_bytes().startswith(HEADS[TRUTH].encode())):
        what = f"{', '.join(strange[:3])}{' …' * (len(strange) > 3)} would be written over, and is of no virtual rig"
        raise MechanismError(Finding(what, str(folder), "name another folder, or move away what is there"))


def _write_yaml(path: Path, data: dict[str, Any]) -> None:
    yaml = YAML(typ="safe", pure=True)
    yaml.default_flow_style = None if path.name == MAPPING else False  # the innermost groups on one line
    yaml.allow_unicode = True
    yaml.width = 118
    yaml.sort_base_mapping_type_on_output = False  # type: ignore[assignment]  # keys as stated
    with path.open("w", encoding="utf-8", newline="\n") as stream:
        stream.write(HEADS[path.name])
        yaml.dump(data, stream)


def _csv(record: Record, units: Mapping[str, str], path: Path) -> None:
    """Text, a column's unit in brackets behind its name, in quotes where it needs them; an empty cell: no reading."""
    head = [f"{name} [{units[name]}]" if name in units else name for name in record.columns]
    with path.open("w", encoding="utf-8", newline="") as stream:
        quoted = ('"{}"'.format(name.replace('"', '""')) if set(name) & set(',;"#') else name for name in head)
        stream.write(",".join(quoted) + "\n")
        texts = [["" if item != item else repr(item) for item in row.tolist()] for row in record.columns.values()]
        stream.write("\n".join(map(",".join, zip(*texts, strict=True))) + "\n")


def _parquet(record: Record, units: Mapping[str, str], path: Path) -> None:
    import pyarrow as pa
    import pyarrow.parquet as pq

    columns = {name: pa.array(values, from_pandas=True) for name, values in record.columns.items()}  # NaN as null
    fields = [pa.field(name, column.type, metadata={"unit": units[name]} if name in units else None)
              for name, column in columns.items()]  # fmt: skip
    pq.write_table(pa.table(list(columns.values()), schema=pa.schema(fields)), path)


def _tdms(record: Record, units: Mapping[str, str], path: Path) -> None:
    from nptdms import ChannelObject, RootObject, TdmsWriter

    objects = [ChannelObject("rig", name, values, properties={"unit_string": units[name]} if name in units else {})
               for name, values in record.columns.items()]  # fmt: skip
    with TdmsWriter(str(path)) as stream:
        stream.write_segment([RootObject(properties={"name": record.name}), *objects])


WRITERS: dict[str, Callable[[Record, Mapping[str, str], Path], None]] = {
    "csv": _csv, "parquet": _parquet, "tdms": _tdms,
}  # fmt: skip

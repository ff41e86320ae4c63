"""What a virtual rig leaves behind: data files like those of a real one, the mapping that reads them, and the truth.

CSV, Parquet and TDMS hold the same numbers to the last bit: they are rounded to what the shortest text of a CSV cell
says before any is written.
"""

from __future__ import annotations

import importlib.util
import math
import os
import tempfile
from collections.abc import Callable, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
from ruamel.yaml import YAML

from trunnion.errors import Finding, MechanismError
from trunnion.files import guard
from trunnion.rig.reading.rig_file import FORMATS, Rig
from trunnion.rig.virtual.observation import Case, Record, Recorded, case_names, speed_differs
from trunnion.version import __version__

__all__ = [
    "MAPPING", "TRUTH", "check_folder", "check_form", "mapping_of", "truth_of", "write",
]  # fmt: skip

MAPPING, TRUTH = "mapping.yaml", "truth.yaml"
PACKAGES = {"parquet": "pyarrow", "tdms": "nptdms"}
POSITIONS = (360, 180, 120, 90, 72, 60, 36, 24, 12)  # of a cycle: fewer than samples
FEWER = 0.99
AT_REST = 0.9  # share of the idle stretch that the zero is taken from: a filter carries the run into the rest


def check_form(form: str) -> None:
    """MechanismError for a format that is none, or whose package is not there."""
    if form not in FORMATS:
        raise MechanismError(Finding(f"'{form}' is no format of data files", "format", f"use {', '.join(FORMATS)}"))
    package = PACKAGES.get(form)
    if package and importlib.util.find_spec(package) is None:
        raise MechanismError(Finding(f"{form} needs {package}", "format", f"pip install 'trunnion[{form}]'"))


def check_folder(rig: Rig, folder: str | os.PathLike[str], form: str) -> None:
    """MechanismError if a file of a rig would be written over one that is read, or over one that no rig has written.

    What is in a folder with a truth that a rig has written is a rig's: its files are written anew.
    """
    folder = Path(folder)
    names = [*(f"{name}.{form or rig.format}" for name in case_names(len(rig.schedule.rows()))), MAPPING, TRUTH]
    for name in names:
        guard(folder / name)
    strange = [name for name in names if (folder / name).exists()]
    with suppress(OSError):
        if (folder / TRUTH).read_bytes().startswith(HEADS[TRUTH].encode()):
            return
    if strange:
        what = f"{', '.join(strange[:3])}{' …' * (len(strange) > 3)} would be written over, and is of no virtual rig"
        raise MechanismError(Finding(what, str(folder), "name another folder, or move away what is there"))


def write(
    observation: Recorded, folder: str | os.PathLike[str], form: str, progress: Callable[[int], None] | None = None
) -> list[str]:
    """Write all files into a folder, which is made if it is not there, once all of them are complete; their names."""
    check_form(form)
    check_folder(observation.rig, folder, form)
    folder, units = Path(folder), units_of(observation)
    home = next(one for one in (folder, *folder.absolute().parents) if one.exists())
    if not home.is_dir():
        raise MechanismError(Finding("cannot be made a folder: it is a file", str(home), "name a folder"))
    try:
        with tempfile.TemporaryDirectory(prefix=".rig-", dir=home, ignore_cleanup_errors=True) as new:
            for done, record in enumerate(observation.records(), 1):
                WRITERS[form](record, units, Path(new) / f"{record.name}.{form}", observation)
                if progress:
                    progress(done)
            _write_yaml(Path(new) / MAPPING, mapping_of(observation, form))
            _write_yaml(Path(new) / TRUTH, truth_of(observation))
            folder.mkdir(parents=True, exist_ok=True)
            for path in sorted(Path(new).iterdir()):
                path.replace(folder / path.name)
    except OSError as error:
        what = f"cannot be written: {error.strerror or error}"
        raise MechanismError(Finding(what, str(folder), "make room there, or name another folder")) from None
    return [*(f"{case.name}.{form}" for case in observation.cases), MAPPING, TRUTH]


def _write_yaml(path: Path, data: dict[str, Any]) -> None:
    yaml = YAML(typ="safe", pure=True)
    yaml.default_flow_style = None if path.name == MAPPING else False  # the innermost groups on one line
    yaml.allow_unicode = True
    yaml.width = 118
    yaml.sort_base_mapping_type_on_output = False  # type: ignore[assignment]  # keys as stated
    with path.open("w", encoding="utf-8", newline="\n") as stream:
        stream.write(HEADS[path.name])
        yaml.dump(data, stream)


def units_of(observation: Recorded) -> dict[str, str]:
    """Unit of every column that has one."""
    found = {observation.rig.time.column: observation.rig.time.unit}
    return found | {channel.column: channel.reading for channel in observation.channels.values()}


# ---- tables ---------------------------------------------------------------------------------------------------


def _csv(record: Record, units: Mapping[str, str], path: Path, observation: Recorded) -> None:
    """Text, a column's unit in brackets behind its name, in quotes where it needs them; an empty cell: no reading."""
    head = [f"{name} [{units[name]}]" if name in units else name for name in record.columns]
    with path.open("w", encoding="utf-8", newline="") as stream:
        quoted = ('"{}"'.format(name.replace('"', '""')) if set(name) & set(',;"#') else name for name in head)
        stream.write(",".join(quoted) + "\n")
        texts = [["" if one != one else repr(one) for one in row.tolist()] for row in record.columns.values()]
        stream.write("\n".join(map(",".join, zip(*texts, strict=True))) + "\n")


def _parquet(record: Record, units: Mapping[str, str], path: Path, observation: Recorded) -> None:
    import pyarrow as pa
    import pyarrow.parquet as pq

    fields, columns = [], []
    for name, values in record.columns.items():
        column = pa.array(values, from_pandas=True)  # NaN as null
        columns.append(column)
        fields.append(pa.field(name, column.type, metadata={"unit": units[name]} if name in units else None))
    pq.write_table(pa.table(columns, schema=pa.schema(fields)), path)


def _tdms(record: Record, units: Mapping[str, str], path: Path, observation: Recorded) -> None:
    from nptdms import ChannelObject, RootObject, TdmsWriter

    about = {"name": record.name, "description": observation.rig.name}
    objects = []
    for name, values in record.columns.items():
        properties: dict[str, Any] = {"unit_string": units[name]} if name in units else {}
        objects.append(ChannelObject("rig", name, values, properties=properties))
    with TdmsWriter(str(path)) as stream:
        stream.write_segment([RootObject(properties=about), *objects])


WRITERS: Mapping[str, Callable[[Record, Mapping[str, str], Path, Recorded], None]] = {
    "csv": _csv,
    "parquet": _parquet,
    "tdms": _tdms,
}


# ---- the mapping ----------------------------------------------------------------------------------------------


def mapping_of(observation: Recorded, form: str) -> dict[str, Any]:
    """The mapping that reads the files of an observation; what a laboratory knows, and no more than that."""
    rig = observation.rig
    found: dict[str, Any] = {"trunnion-data": 1, "name": rig.name or observation.mechanism.name}
    angle = _angle(observation)
    timed = angle.get("angle", {}).get("from") == "time" or "angle" not in angle
    found["files"] = [_file(observation, case, form, timed) for case in observation.cases]
    if rig.set_:
        found["set"] = dict(rig.set_)
    found["time"] = {"column": rig.time.column, "unit": rig.time.unit}
    found |= angle
    least = min(case.run.cycle.duration for case in observation.cases) * observation.rate
    positions = next((one for one in POSITIONS if one < least * FEWER), POSITIONS[-1])
    if positions != POSITIONS[0]:
        found["positions"] = positions
    found["channels"] = {name: _channel(observation, name) for name in observation.channels}
    return found


def _file(observation: Recorded, case: Case, form: str, timed: bool) -> dict[str, Any]:
    """A file with what was set, its zero of an encoder, and where the time alone tells the position, when it ran."""
    found: dict[str, Any] = {"file": f"{case.name}.{form}"}
    if case.settings:
        found["set"] = dict(case.settings)
    if observation.rig.encoder and (zero := _counted_from(observation, case)) != _counted_from(observation):
        found["angle"] = {"zero": f"{math.degrees(zero):.12g} deg"}
    if timed and case.rows > case.running:
        ends = (case.before - case.origin, case.before + case.running - 1 - case.origin)
        found["over"] = [f"{end / observation.rate:.9g} s" for end in ends]
    return found


def _angle(observation: Recorded) -> dict[str, Any]:
    """Where the coordinate of the driver comes from, and what a cycle is."""
    case = observation.cases[0]
    run, driver = case.run, case.driver
    duration = run.cycle.duration
    if not case.named:
        return {"cycle": f"{duration:.15g} s"}
    first, last = (float(np.ravel(run.system.drive(run.values, driver, time)[0])[0]) for time in (0.0, duration))
    found: dict[str, Any] = {"angle": _source(observation, case)}
    extent = math.degrees(abs(last - first))
    if abs(extent - 360) > 1e-9:
        found["cycle"] = f"{extent:.12g} deg"
    if first:
        found["start"] = f"{math.degrees(first):.12g} deg"
    return found


def _source(observation: Recorded, case: Case) -> dict[str, Any]:
    """The encoder if there is one, else a constant speed, else a measured one."""
    rate, encoder = observation.rate, observation.rig.encoder
    if encoder:
        found: dict[str, Any] = {"from": "pulses", "column": encoder.column, "per_turn": encoder.per_turn}
        found["kind"] = encoder.kind
        if encoder.kind == "level" and case.drive(rate)[1] < 0:
            found["sign"] = -1
        if zero := _counted_from(observation):
            found["zero"] = f"{math.degrees(zero):.12g} deg"
        if encoder.index:
            found["index"] = {"column": encoder.index}
        return found
    if speed_differs(observation.cases):
        channels = observation.channels.items()
        measured = next(name for name, one in channels if one.measures == f"rate:{case.driver}")
        start = math.degrees(case.drive(rate)[0])
        return {"from": "speed", "channel": measured} | ({"zero": f"{start:.12g} deg"} if start else {})
    start, speed = case.drive(rate, -case.before)
    return {"from": "time", "speed": f"{speed:.15g} rad/s", "zero": f"{math.degrees(start):.12g} deg"}


def _counted_from(observation: Recorded, case: Case | None = None) -> float:
    """Coordinate, rad, where an encoder reads zero: at its index, else where its count is 0, its level rises."""
    encoder, case = observation.rig.encoder, case or observation.cases[0]
    assert encoder is not None  # asked of encoders only
    zero, pitch = float(encoder.zero.evaluate()), 2 * math.pi / encoder.per_turn
    start, speed = case.drive(observation.rate)
    if encoder.index:
        return zero if speed > 0 else zero + pitch  # backward, the first pulse is entered at its far end
    if encoder.kind == "count":
        return zero
    count = (start - zero) / pitch
    # backward, the level rises in the middle of a pulse
    edge = math.floor(count + 1e-9) + 1 if speed > 0 else math.ceil(count - 0.5 - 1e-9) - 0.5
    return zero + edge * pitch


def _channel(observation: Recorded, name: str) -> dict[str, Any]:
    channel = observation.channels[name]
    stated = channel.stated
    found: dict[str, Any] = {"column": channel.column, "measures": channel.measures, "unit": channel.reading}
    if stated.sensitivity:
        found["gain"] = stated.sensitivity.source
    case = observation.cases[0]
    if channel.zeroed and case.before > 1:
        rest = (-case.origin, AT_REST * case.before - case.origin)
        found["zero"] = {"over": [f"{one / observation.rate + 0.0:.6g} s" for one in rest]}
    if stated.range:
        found["range"] = stated.range.source
    accuracy: dict[str, Any] = {}
    if channel.gain:
        accuracy["gain"] = stated.accuracy.gain.source
    zero = observation.zero_uncertainty(name)
    if channel.noise <= channel.step / 2:  # which does not carry readings over the steps of the converter
        zero = math.hypot(zero, channel.step / math.sqrt(12))  # GUM F.2.2.1
    if zero:
        accuracy["zero"] = f"{zero:.4g} {channel.unit}"
    return found | ({"accuracy": accuracy} if accuracy else {})


# ---- the truth ------------------------------------------------------------------------------------------------


def truth_of(observation: Recorded) -> dict[str, Any]:
    """What was drawn and what is true, in SI: for a check of what is found from the files, not for finding it."""
    mechanism = observation.mechanism
    found: dict[str, Any] = {
        "trunnion-truth": 1,
        "made_by": f"trunnion {__version__}",
        "model": mechanism.name,
        "model_hash": mechanism.digest,
        "seed": observation.seed,
        "sensors": {},
        "conditions": [],
    }
    for name, channel in observation.channels.items():
        errors = observation.drawn[name]
        found["sensors"][name] = {
            "measures": channel.measures, "unit": channel.unit, "gain_error": errors.gain, "zero_error": errors.zero,
            "offset": errors.offset, "drift_per_second": float(f"{channel.drift:.12g}"),
            "noise": float(f"{channel.noise:.12g}"), "step": float(f"{channel.step:.12g}"),
        }  # fmt: skip
    for case in observation.cases:
        whole = round(observation.rig.schedule.turns * case.run.cycle.duration * observation.rate)
        part = slice(case.first, case.first + whole)
        found["conditions"].append({
            "name": case.name, "set": dict(case.settings),
            "efficiency": case.efficiency if math.isfinite(case.efficiency) else None,
            "cycle_seconds": case.run.cycle.duration,
            "mean": {name: float(np.mean(case.true.at_samples(i)[part]))
                     for i, name in enumerate(observation.channels)},
        })  # fmt: skip
    if observation.skipped:
        found["left_out"] = list(observation.skipped)
    found["parameters"] = {
        path: float(np.ravel(value)[0]) for path, value in mechanism.parameters().items() if np.size(value) == 1
    }
    return found


HEADS = {
    MAPPING: "# What the columns of the data files measure: for `trunnion data`, `compare` and `identify`.\n",
    TRUTH: "# True values and random errors of the virtual rig, in SI, to check results obtained from the files.\n",
}

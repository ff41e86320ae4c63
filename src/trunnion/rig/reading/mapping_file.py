"""A mapping from its file, checked as a whole: what one part of it alone cannot tell, with file and line."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from pydantic import ValidationError
from pydantic_core import PydanticCustomError

from trunnion.errors import Finding, MechanismError
from trunnion.model.file import Lines, place, read_entries
from trunnion.model.findings import schema_findings
from trunnion.model.names import nearest
from trunnion.model.units import ANGLE, KINDS
from trunnion.rig.reading.mapping import Channel, DataMapping, File, FromData

__all__ = ["Mapped", "read_mapping"]

NOUN = "a mapping file"
START = "write trunnion-data: 1, then files, time, angle and channels"


class Mapped:
    """A mapping with the folder that its files lie below, and the lines of its entries for findings."""

    def __init__(self, mapping: DataMapping, folder: Path, file: str, lines: Lines, data: Mapping[str, Any]) -> None:
        self.mapping, self.folder, self.file = mapping, folder, file
        self._lines, self._data = lines, data

    def placed(self, findings: list[Finding]) -> list[Finding]:
        """Findings about the mapping with its file and line; those of other files as they are."""
        return place(findings, self.file, self._lines, self._data) if self.file else findings


def read_mapping(source: str | os.PathLike[str] | Mapping[str, Any]) -> Mapped:
    """A mapping from its file, or from plain data, whose files lie below the working folder.

    MechanismError with every finding, each with file and line.
    """
    if isinstance(source, Mapping):
        data, lines, file, folder = dict(source), Lines(), "", Path()
    else:
        path = Path(source)
        data, lines = read_entries(path, NOUN, START)
        file, folder = str(path), path.parent
    try:
        mapping = DataMapping.model_validate(data)
        findings = [*_check(mapping), *_outside(mapping, folder)]
    except ValidationError as error:
        findings = [_explained(one, data) for one in schema_findings(error, DataMapping, data)]
    if findings:
        raise MechanismError(place(findings, file, lines, data) if file else findings)
    return Mapped(mapping, folder, file, lines, data)


def _explained(finding: Finding, data: Mapping[str, Any]) -> Finding:
    """A file of another kind is told as such."""
    if finding.what == "'trunnion-data' is missing" and "trunnion" in data:
        return Finding("is a model file, not a mapping file", "trunnion", "name the mapping, then the data files")
    if finding.what == "'trunnion-data' is missing":
        return Finding(finding.what, finding.where, "begin the file with trunnion-data: 1")
    if finding.remedy == "see the examples of model files":
        return Finding(finding.what, finding.where, "see the examples of mappings in docs/how-to/measured-data.md")
    return finding


def _check(mapping: DataMapping) -> Iterator[Finding]:
    """What one part alone cannot tell."""
    channels = mapping.channels
    if not channels:
        yield Finding("'channels' is missing", "", "write channels: {torque: {column: …, measures: …}}")
    settings = {f"set.{key}": value for key, value in mapping.set.items()}
    for key, file in _entries(mapping):
        settings |= {f"{key}.set.{name}": value for name, value in file.set.items()}
    for where, value in settings.items():
        known = [*channels, *(["angle"] if mapping.angle else [])]  # the mean speed by the angle
        if isinstance(value, FromData) and value.mean is not None and value.mean not in known:
            yield Finding(f"there is no channel '{value.mean}'", f"{where}.mean", nearest(value.mean, known))
    yield from _check_cycle(mapping)
    for key, file in _entries(mapping):
        if file.angle is not None and mapping.angle is None:
            what = "states a zero of the angle, but no column gives an angle"
            yield Finding(what, f"{key}.angle", "add angle: {from: …}, or remove it")
        yield from _check_channels(file, f"{key}.channels", channels)
    source = mapping.angle.channel if mapping.angle else None
    if source is not None and source not in channels:
        yield Finding(f"there is no channel '{source}'", "angle.channel", nearest(source, channels))
    elif source is not None and not channels[source].measures.startswith("rate:"):
        what = f"the channel '{source}' measures {channels[source].measures}, not a speed"
        yield Finding(what, "angle.channel", "name a channel that measures rate:DRIVER")
    base = mapping.time
    if mapping.filter and base and base.rate and 2 * mapping.filter.cut_off.value >= base.rate.value:
        what = f"a cut-off of {mapping.filter.cut_off.value:g} Hz, samples come at {base.rate.value:g} Hz"
        yield Finding(what, "filter.cut_off", f"write less than half of that, {base.rate.value / 2:g} Hz")


def _check_cycle(mapping: DataMapping) -> Iterator[Finding]:
    """Whether the cycle is one, and something tells where in it a row is."""
    if mapping.cycle.check({}) not in (ANGLE, KINDS["time"].dimensions[0], None):
        yield Finding(f"'{mapping.cycle.source}' is no angle and no time", "cycle", "write it as 360 deg or 0.5 s")
    elif not float(mapping.cycle.evaluate()) > 0:
        yield Finding("the cycle is not above zero", "cycle", "write it as 360 deg or 0.5 s")
    elif mapping.angle is None and not mapping.timed:
        remedy = "add angle: {from: …}, or write cycle: as a time"
        yield Finding("'angle' is missing: no column gives the coordinate of the driver", "", remedy)


def _entries(mapping: DataMapping) -> Iterator[tuple[str, File]]:
    """Every file by its place in the mapping."""
    for number, file in enumerate(mapping.files):
        yield f"files.{number}", file


def _check_channels(file: File, where: str, channels: Mapping[str, Channel]) -> Iterator[Finding]:
    """Channels of one file that are none of the mapping, or do not go together with it."""
    for name, own in file.channels.items():
        if name not in channels:
            yield Finding(f"there is no channel '{name}'", f"{where}.{name}", nearest(name, channels))
            continue
        try:
            own.of(channels[name])
        except PydanticCustomError as error:
            told = error.context or {}
            yield Finding(error.message(), f"{where}.{name}", str(told.get("remedy", "")))


def _outside(mapping: DataMapping, folder: Path) -> Iterator[Finding]:
    """Files that are not below the folder of the mapping: a mapping is data from a stranger."""
    home = folder.resolve()
    for key, entry in _entries(mapping):
        try:
            inside = not Path(entry.file).is_absolute() and (folder / entry.file).resolve().is_relative_to(home)
        except (OSError, ValueError, RuntimeError):
            inside = False
        if not inside:
            remedy = "put it there, or name it on the command line"
            what = f"'{entry.file[:80]}' is not below the folder of the mapping"
            yield Finding(what, f"{key}.file", remedy)

"""What a virtual rig leaves behind: data files like those of a real one, the mapping that reads them, and the truth.

CSV, Parquet and TDMS hold the same numbers to the last bit: they are rounded to what the shortest text of a CSV cell
says before any is written.
"""

from __future__ import annotations

import importlib.util
import os
import tempfile
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from numpy.typing import NDArray
from ruamel.yaml import YAML

from trunnion.errors import Finding, MechanismError
from trunnion.files import guard
from trunnion.rig.reading.rig_file import FORMATS, Rig, Value

__all__ = ["MAPPING", "TRUTH", "Record", "check_folder", "check_form", "write"]

MAPPING, TRUTH = "mapping.yaml", "truth.yaml"
HEADS = {
    MAPPING: "# What the columns of the data files measure: for `trunnion data`, `compare` and `identify`.\n",
    TRUTH: "# True values and random errors of the virtual rig, in SI, to check results obtained from the files.\n",
}
PACKAGES = {"parquet": "pyarrow", "tdms": "nptdms"}


@dataclass(frozen=True)
class Record:
    """The columns of one file, by name; NaN is an empty cell. settings: what is set in it, as in the rig file."""

    name: str
    settings: Mapping[str, Value]
    columns: Mapping[str, NDArray[Any]]


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
    ours = truth.is_file() and truth.read_bytes().startswith(HEADS[TRUTH].encode())
    if strange and not ours:
        what = f"{', '.join(strange[:3])}{' …' * (len(strange) > 3)} would be written over, and is of no virtual rig"
        raise MechanismError(Finding(what, str(folder), "name another folder, or move away what is there"))


def write(
    records: Iterable[Record], units: Mapping[str, str], texts: Mapping[str, dict[str, Any]],
    folder: str | os.PathLike[str], form: str, progress: Callable[[int], None] = lambda count: None,
) -> list[str]:  # fmt: skip
    """Write all files into a folder, which is made if it is not there, once all of them are complete; their names.

    units: of the columns; texts: entries of the YAML files, by name; progress: called with the records written.
    """
    folder, names = Path(folder), []
    home = next(item for item in (folder, *folder.absolute().parents) if item.exists())
    if not home.is_dir():
        raise MechanismError(Finding("cannot be made a folder: it is a file", str(home), "name a folder"))
    try:
        with tempfile.TemporaryDirectory(prefix=".rig-", dir=home, ignore_cleanup_errors=True) as new:
            for done, record in enumerate(records, 1):
                names.append(f"{record.name}.{form}")
                WRITERS[form](record, units, Path(new) / names[-1])
                progress(done)
            for name, entries in texts.items():
                _write_yaml(Path(new) / name, entries)
            folder.mkdir(parents=True, exist_ok=True)
            for path in sorted(Path(new).iterdir()):
                path.replace(folder / path.name)
    except OSError as error:
        what = f"cannot be written: {error.strerror or error}"
        raise MechanismError(Finding(what, str(folder), "make room there, or name another folder")) from None
    return [*names, *texts]


def _write_yaml(path: Path, data: dict[str, Any]) -> None:
    yaml = YAML(typ="safe", pure=True)
    yaml.default_flow_style = None if path.name == MAPPING else False  # the innermost groups on one line
    yaml.allow_unicode = True
    yaml.width = 118
    yaml.sort_base_mapping_type_on_output = False  # type: ignore[assignment]  # keys as stated
    with path.open("w", encoding="utf-8", newline="\n") as stream:
        stream.write(HEADS[path.name])
        yaml.dump(data, stream)


# ---- tables ---------------------------------------------------------------------------------------------------


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

    fields, columns = [], []
    for name, values in record.columns.items():
        column = pa.array(values, from_pandas=True)  # NaN as null
        columns.append(column)
        fields.append(pa.field(name, column.type, metadata={"unit": units[name]} if name in units else None))
    pq.write_table(pa.table(columns, schema=pa.schema(fields)), path)


def _tdms(record: Record, units: Mapping[str, str], path: Path) -> None:
    from nptdms import ChannelObject, RootObject, TdmsWriter

    objects = []
    for name, values in record.columns.items():
        properties: dict[str, Any] = {"unit_string": units[name]} if name in units else {}
        objects.append(ChannelObject("rig", name, values, properties=properties))
    with TdmsWriter(str(path)) as stream:
        stream.write_segment([RootObject(properties={"name": record.name}), *objects])


WRITERS: dict[str, Callable[[Record, Mapping[str, str], Path], None]] = {
    "csv": _csv, "parquet": _parquet, "tdms": _tdms,
}  # fmt: skip

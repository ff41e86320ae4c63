"""The one other file that a model may name: a CSV file with the points of a table, in the model's own folder.

A model comes from a stranger. What it names is below the folder of its file, whatever links say, and a plain file.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path, PureWindowsPath
from typing import Any

from trunnion.errors import Finding, MechanismError

__all__ = ["MOST_FILES", "in_folder", "stated_files"]

MOST_FILES = 50
MOST_SIGNS = 200  # of a name
_DEVICES = {"CON", "PRN", "AUX", "NUL", *(f"{port}{n}" for port in ("COM", "LPT") for n in range(10))}  # of Windows


def stated_files(data: Mapping[str, Any]) -> Iterator[tuple[str, str, str]]:
    """Section, name and file of every table, and driver of law `table`, that names a file."""
    for section in ("drivers", "tables"):
        entries = data.get(section)
        for name, entry in entries.items() if isinstance(entries, Mapping) else ():
            if not isinstance(entry, Mapping) or not isinstance(entry.get("file"), str):
                continue  # what is no text is a finding of the sections' classes
            if section == "tables" or entry.get("law") == "table":
                yield section, str(name), entry["file"]


def in_folder(folder: Path, name: str, where: str) -> Path:
    """The plain file of a name that a model states; MechanismError for any that is not below the model's folder.

    where: the entry that states it.
    """

    def refused(what: str, remedy: str) -> MechanismError:
        return MechanismError(Finding(f"'{name[:60]}' {what}", where, remedy))

    parts = PureWindowsPath(name)  # knows both kinds of slash, and drives
    here = "put the file into the folder of the model and give its name, such as gas.csv"
    if len(name) > MOST_SIGNS or not name.strip() or not name.isprintable():
        raise refused("is no name of a file", here)
    if parts.drive or parts.root or ".." in parts.parts:
        raise refused("leads out of the folder of the model", here)
    if "\\" in name:
        raise refused("has a backslash", f"write {name.replace(chr(92), '/')}, which every system reads")
    if parts.suffix.lower() != ".csv":
        raise refused("is no CSV file by its name", f"call it {parts.stem}.csv, or name it by --table")
    if any(part.split(".")[0].strip().upper() in _DEVICES for part in parts.parts):
        raise refused("is a device on some systems", "call the file otherwise")
    try:
        home = folder.resolve()
        path = (home / name).resolve()
        if not path.is_relative_to(home):
            raise refused("leads out of the folder of the model by a link", here)
        if not path.exists():
            raise refused("is not in the folder of the model", f"put it into {home}, or correct the name")
        if not path.is_file():
            raise refused("is not a file", "name a CSV file")
    except MechanismError:
        raise
    except (OSError, RuntimeError, ValueError) as error:  # a link to itself, a folder that may not be entered
        raise refused("cannot be reached", f"check it: {getattr(error, 'strerror', None) or error}") from None
    return path

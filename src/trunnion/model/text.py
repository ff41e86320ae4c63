"""Files of strangers: text of bounded size, and the one other file that a model may name.

What a model names is a CSV file with the points of a table, below the folder of its file, whatever links say."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path, PureWindowsPath
from typing import Any

from trunnion.errors import Finding, MechanismError
from trunnion.files import reading

__all__ = [
    "MOST_FILES",
    "in_folder",
    "read_text",
    "stated_files",
]


def read_text(path: Path, kind: str, limit: int, start_from: str) -> str:
    """The content of a file, at most `limit` bytes; MechanismError says what it is not.

    kind: what it should be, with its article; start_from: remedy for an empty one.
    """
    reading(path)
    try:
        if path.exists() and not path.is_file():
            raise MechanismError(Finding("is not a file", remedy=f"name {kind}"))
        with path.open("rb") as stream:
            raw = stream.read(limit + 1)
        if len(raw) > limit:
            what = f"has {max(path.stat().st_size, len(raw)) / 1e6:.1f} MB, {kind} at most {limit / 1e6:.1f} MB"
            raise MechanismError(Finding(what, remedy=f"check that it is {kind}, or make it smaller"))
    except MechanismError:
        raise
    except (OSError, ValueError) as error:
        reason = str(getattr(error, "strerror", None) or error)
        raise MechanismError(Finding(f"cannot be read: {reason}", remedy="check the path")) from error
    try:
        text = raw.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = raw.count(b"\n", 0, error.start) + 1
        what = f"is not UTF-8 text (byte {error.start})"
        raise MechanismError(Finding(what, remedy="save it as UTF-8", line=line)) from error
    if not text.strip():
        raise MechanismError(Finding("is empty", remedy=start_from, line=1))
    return text


MOST_FILES = 50
MOST_SIGNS = 200  # of a name
OF_A_FILE = ("file", "columns")  # the keys of a table or driver whose points are in a file
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
    device = any(part.split(".")[0].strip().upper() in _DEVICES for part in parts.parts)
    odd = len(name) > MOST_SIGNS or not name.strip() or not name.isprintable() or "\\" in name or device
    if parts.drive or parts.root or ".." in parts.parts:
        raise refused("leads out of the folder of the model", here)
    if odd or parts.suffix.lower() != ".csv":
        raise refused("is no name of a CSV file that every system reads, with / between folders", here)
    try:
        home = folder.resolve()
        path = (home / name).resolve()
        if not path.is_relative_to(home):
            raise refused("leads out of the folder of the model by a link", here)
        if not path.is_file():
            raise refused("is no file in the folder of the model", f"put it into {home}, or correct the name")
    except MechanismError:
        raise
    except (OSError, RuntimeError, ValueError) as error:  # a link to itself, a folder that may not be entered
        raise refused("cannot be reached", f"check it: {getattr(error, 'strerror', None) or error}") from None
    return path

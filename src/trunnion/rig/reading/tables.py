"""Columns of data files as numbers: CSV, Parquet and TDMS by their extension, the same numbers whichever it is.

Only the columns that are asked for are read. What is no number in them is NaN and counted, never replaced.
"""

from __future__ import annotations

import importlib.util
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from trunnion.errors import Finding, MechanismError
from trunnion.files import reading
from trunnion.rig.reading.binary_tables import read_parquet, read_tdms
from trunnion.rig.reading.columns import DataTable, failed
from trunnion.rig.reading.text_tables import read_csv

__all__ = ["FORMATS", "read_table"]

Array = NDArray[np.float64]


def read_table(path: Path, wanted: Iterable[str], optional: Iterable[str] = ()) -> DataTable:
    """The columns of a file by their names; MechanismError lists those that exist if one does not.

    optional: columns that may be missing.
    """
    suffix = path.suffix.lower()
    if suffix not in FORMATS:
        what = f"the extension '{suffix}' is not one of a data file"
        raise MechanismError(Finding(what, file=str(path), remedy=f"use {', '.join(FORMATS)}"))
    reader, package, extra = FORMATS[suffix]
    if package and importlib.util.find_spec(package) is None:
        what, remedy = f"{suffix} needs {package}", f"pip install 'trunnion[{extra}]'"
        raise MechanismError(Finding(what, file=str(path), remedy=remedy))
    if not path.is_file():
        what = "is not a file" if path.exists() else "cannot be read: there is no such file"
        raise MechanismError(Finding(what, file=str(path), remedy="check the path"))
    if path.stat().st_size == 0:
        raise failed(path, "is empty", "check that the recording was saved")
    reading(path)
    try:
        table = reader(path, list(dict.fromkeys(wanted)), list(dict.fromkeys(optional)))
    except OSError as error:
        raise failed(path, f"cannot be read: {error.strerror or error}", "check the file") from None
    if table.rows == 0:
        raise failed(path, "has a header but no rows of numbers", "check that the recording was saved")
    return table


Reader = Callable[[Path, Sequence[str], Sequence[str]], DataTable]

# extension: reader, the package it needs and the extra that brings it
FORMATS: dict[str, tuple[Reader, str, str]] = {
    ".csv": (read_csv, "", ""),
    ".txt": (read_csv, "", ""),
    ".tsv": (read_csv, "", ""),
    ".parquet": (read_parquet, "pyarrow", "parquet"),
    ".tdms": (read_tdms, "nptdms", "tdms"),
}

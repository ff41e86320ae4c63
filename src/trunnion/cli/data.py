"""`trunnion data`: what a mapping makes of measured files, and what is wrong with them."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from trunnion.cli.options import Data, UnitsRow
from trunnion.cli.result import check_files, show_tables
from trunnion.cli.terminal import console, say, wrote
from trunnion.errors import Severity

__all__ = ["data"]


def data(
    mapping: Annotated[Path, typer.Argument(help="Mapping file: YAML, JSON or TOML.")],
    files: Annotated[
        list[Path] | None, typer.Argument(help="Data files instead of those it names: .csv .parquet .tdms.")
    ] = None,
    out: Data = None,
    units_row: UnitsRow = False,
) -> None:
    """Read measured files: conditions, channels, scatter, faults."""
    from trunnion.results.export import save
    from trunnion.rig.reading.measurement import dataset
    from trunnion.rig.reading.read import read_measured
    from trunnion.views.measured import tables

    check_files(out or [], drawn=False)
    measurement = read_measured(mapping, files)
    show_tables("", tables(measurement))
    if measurement.done:
        console().print()
    for sentence in measurement.done:
        console().print(sentence, markup=False, highlight=False, soft_wrap=True)
    for path in out or []:
        save(dataset(measurement), path, units_row)
        wrote(path)
    say(measurement.findings)
    faulty = any(finding.severity is not Severity.NOTE for finding in measurement.findings)
    raise typer.Exit(1 if faulty else 0)

"""`trunnion data`: what a mapping makes of measured files, and what is wrong with them."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from trunnion.cli.files import verb
from trunnion.cli.options import DATA, Files
from trunnion.cli.result import check_files, show_tables
from trunnion.cli.terminal import line, say, wrote
from trunnion.errors import Severity

__all__ = ["data"]


@verb(lacks="report units columns", out=DATA)
def data(
    mapping: Annotated[Path, typer.Argument(help="Mapping file: YAML, JSON or TOML.")],
    shared: Files,
    files: Annotated[
        list[Path] | None, typer.Argument(help="Data files instead of those it names: .csv .parquet .tdms.")
    ] = None,
) -> None:
    """Read measured files: conditions, channels, scatter, faults."""
    from trunnion.results.export import save
    from trunnion.rig.reading.measurement import dataset
    from trunnion.rig.reading.read import read_measured
    from trunnion.views.measured import tables

    check_files(shared, drawn=False)
    measurement = read_measured(mapping, files)
    show_tables("", tables(measurement))
    for text in ["", *measurement.done] if measurement.done else []:
        line(text)
    for path in shared.out or ():
        save(dataset(measurement), path, shared.units_row)
        wrote(path)
    say(measurement.findings)
    raise typer.Exit(int(any(finding.severity is not Severity.NOTE for finding in measurement.findings)))

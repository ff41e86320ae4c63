"""`trunnion compare`: a model beside measured data, per working condition and channel."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Annotated

import typer

from trunnion.cli.model import exit_status, lines_of, stated
from trunnion.cli.options import (
    DataFiles,
    File,
    FrictionLaw,
    MappingFile,
    Out,
    Report,
    Seats,
    Set,
    TableFile,
    UnitsRow,
)
from trunnion.cli.result import Shown, check_files, show_tables
from trunnion.cli.terminal import bar
from trunnion.results.attributes import findings_of

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["compare"]

MOST_ROWS = 40


def compare(
    file: File,
    mapping: MappingFile,
    data: DataFiles = None,
    channel: Annotated[
        list[str] | None, typer.Option("--channel", help="A channel by its name in the mapping. Repeatable.")
    ] = None,
    condition: Annotated[str | None, typer.Option("--condition", help="The condition to draw.")] = None,
    kind: Annotated[str | None, typer.Option("--kind", help="Figure of --out: efficiency or overlay.")] = None,
    set_: Set = None,
    table: TableFile = None,
    friction: FrictionLaw = None,
    seat: Seats = None,
    out: Out = None,
    report: Report = None,
    units_row: UnitsRow = False,
) -> None:
    """Compare a model with measured data: residual, bias, verdict.

    Every channel, and the efficiency as a test rig determines it. Exit status 0 if all agree within the expanded
    uncertainty, 1 if not or if that is undecided.
    """
    from trunnion.rig.comparison import compare as run
    from trunnion.rig.reading.read import read_measured
    from trunnion.rig.reading.timebase import gathered

    check_files(out or [], report, of="comparison", kind=kind)
    mechanism = stated(file, set_, table, friction, seat)
    measurement = read_measured(mapping, [str(path) for path in data] if data else None)
    with lines_of(file), bar("conditions", len(measurement.conditions)) as progress:
        result = run(mechanism, measurement, channel, progress=progress)
    drawn = {"kind": kind, "condition": condition, "channel": channel[0] if channel and len(channel) == 1 else None}
    found = gathered(measurement.findings)
    errors = exit_status([*measurement.findings, *findings_of(result)])
    Shown(
        result, file, ["assembly", "measures"], out or [], report, units_row, drawn, show=partial(_show, result),
        others=found,
    ).finish(0 if bool(result.attrs["all_within"]) and not errors else 1)  # fmt: skip


def _show(result: xr.Dataset) -> None:
    """Results and efficiencies; the first rows of many."""
    from trunnion.views.compare import tables

    show_tables(str(result.attrs["name"]), tables(result), most=MOST_ROWS, rest="FILE.figures.csv")

"""`trunnion compare`: a model beside measured data, per working condition and channel."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from trunnion.cli.inputs import spare_data
from trunnion.cli.model import lines_of, placed, stated
from trunnion.cli.options import IMAGES, DataFiles, File, FrictionLaw, MappingFile, Out, Seats, Set, TableFile, UnitsRow
from trunnion.cli.terminal import bar, console, say, show_rows, wrote
from trunnion.cli.tolerance import PAGES
from trunnion.errors import Finding, MechanismError, Severity, counted
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
        list[str] | None,
        typer.Option("--channel", help="A channel by its name in the mapping. Repeatable.", show_default=False),
    ] = None,
    condition: Annotated[
        str | None, typer.Option("--condition", help="The condition whose courses are drawn.", show_default=False)
    ] = None,
    kind: Annotated[
        str | None, typer.Option("--kind", help="Figure of --out: efficiency or overlay.", show_default=False)
    ] = None,
    set_: Set = None,
    table: TableFile = None,
    friction: FrictionLaw = None,
    seat: Seats = None,
    out: Out = None,
    report: Annotated[
        Path | None,
        typer.Option("--report", help="Also write the report to be filed, one HTML file.", show_default=False),
    ] = None,
    units_row: UnitsRow = False,
) -> None:
    """A model beside a measurement: residual, bias, whether it is within the uncertainty; efficiency as a rig finds it.

    Exit status 0 if every course and efficiency is within, 1 if not or if it cannot be told.
    """
    from trunnion.rig.compare.said import gathered
    from trunnion.rig.compare.study import compare as run
    from trunnion.rig.reading.read import read_measured

    _check(out or [], report, kind)
    spare_data(mapping, data, out, report, file, table)
    mechanism = stated(file, set_, table, friction, seat)
    measurement = read_measured(mapping, [str(path) for path in data] if data else None)
    with lines_of(file), bar("conditions", len(measurement.conditions)) as progress:
        result = run(mechanism, measurement, channel, progress=progress)
    _write(result, out or [], report, kind, channel, condition, units_row)
    _tables(result)
    say(gathered(measurement.findings))
    findings = findings_of(result)
    say(placed(findings, file, ["assembly", "measures"]))
    for path in [*(out or []), *([report] if report else [])]:
        wrote(path)
    errors = [one for one in (*measurement.findings, *findings) if one.severity is Severity.ERROR]
    raise typer.Exit(0 if bool(result.attrs["all_within"]) and not errors else 1)


def _check(out: list[Path], report: Path | None, kind: str | None) -> None:
    """MechanismError for a file that cannot be written, or no such figure, before anything is read."""
    from trunnion.results.export import check_format
    from trunnion.views.compare.figure import check_kind

    for path in out:
        if path.suffix.lower() not in IMAGES:
            check_format(path, IMAGES)
    if report is not None and report.suffix.lower() not in PAGES:
        what = f"a report is HTML, '{report.name}' is not"
        raise MechanismError(Finding(what, "--report", "write a .html file and print it"))
    if kind is not None:
        check_kind(kind)


def _write(
    result: xr.Dataset,
    out: list[Path],
    report: Path | None,
    kind: str | None,
    channel: list[str] | None,
    condition: str | None,
    units_row: bool,
) -> None:
    from trunnion.files import whole
    from trunnion.results.export import save
    from trunnion.views.compare.figure import figure
    from trunnion.views.cycle import plots

    for path in out:
        if path.suffix.lower() in IMAGES:
            named = channel[0] if channel and len(channel) == 1 else None
            plots.save(figure(result, kind, named, condition), path)
        else:
            save(result, path, units_row)
    if report is not None:
        from trunnion.views.compare.report import report as page

        text = page(result)
        with whole(report) as temporary:
            temporary.write_text(text, encoding="utf-8")


def _tables(result: xr.Dataset) -> None:
    """Results and efficiencies; the first rows of many."""
    from trunnion.views.compare.tables import efficiencies, results

    shown = [one for one in (results(result), efficiencies(result)) if one is not None]
    titles = [f"{result.attrs['name']}\n{result.attrs['comparing']}: measured less model", ""]
    for title, table in zip(titles, shown, strict=False):
        if not title:
            console().print()
        show_rows(title or table.title, table.head, table.rows[:MOST_ROWS])
        if len(table.rows) > MOST_ROWS:
            told = f"{counted(len(table.rows) - MOST_ROWS, 'row')} more; --out FILE.figures.csv has all"
            console().print(told, markup=False, highlight=False)

"""The verb `tolerance`: tables on the output, files, figures and report as they are asked for."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from trunnion.cli.options import IMAGES
from trunnion.cli.terminal import console, say_missed, show_figures, show_rows, wrote
from trunnion.errors import Finding, MechanismError
from trunnion.results.attributes import summary_of

if TYPE_CHECKING:
    import xarray as xr

    from trunnion.model.mechanism import Mechanism

__all__ = ["PAGES", "check_files", "show"]

PAGES = (".html", ".htm")


def check_files(out: Sequence[Path], report: Path | None = None, kind: str | None = None) -> None:
    """MechanismError for a file that cannot be written, or no such kind of figure, before anything is computed."""
    from trunnion.results.export import check_format

    for path in out:
        if path.suffix.lower() not in IMAGES:
            check_format(path, IMAGES)
    if report is not None and report.suffix.lower() not in PAGES:
        what = f"a report is HTML, '{report.name}' is not"
        raise MechanismError(Finding(what, "--report", "write a .html file and print it"))
    if kind is not None:
        from trunnion.views.tolerance.figure import check_kind

        check_kind(kind)


def show(
    mechanism: Mechanism,
    result: xr.Dataset,
    out: Sequence[Path],
    units_row: bool = False,
    kind: str | None = None,
    report: Path | None = None,
) -> None:
    """Write the files, print the summary and the tables of each measure. kind: of figure; all on one sheet if None."""
    from trunnion.results.export import save
    from trunnion.views.cycle import plots
    from trunnion.views.tolerance.figure import figure, sheet
    from trunnion.views.tolerance.tables import tables

    for path in out:
        if path.suffix.lower() in IMAGES:
            plots.save(sheet(result) if kind is None else figure(result, kind), path)
        else:
            save(result, path, units_row)
    if report is not None:
        _write_report(result, report)
    say_missed(result)
    shown = tables(result)
    if not shown:
        show_figures(mechanism.name, summary_of(result))
    for i, table in enumerate(shown):
        if i:
            console().print()
        show_rows(f"{mechanism.name}\n{table.title}" if i == 0 and mechanism.name else table.title, *table[1:])
    for path in [*out, *([report] if report else [])]:
        wrote(path)


def _write_report(result: xr.Dataset, path: Path) -> None:
    from trunnion.files import whole
    from trunnion.views.tolerance.report import report as page

    text = page(result)
    with whole(path) as temporary:
        temporary.write_text(text, encoding="utf-8")

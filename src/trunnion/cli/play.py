"""The verb `play`: tables on the output, files as they are asked for."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from trunnion.cli.options import IMAGES
from trunnion.cli.terminal import say_missed, show_rows, wrote
from trunnion.errors import Finding, MechanismError

if TYPE_CHECKING:
    import xarray as xr

    from trunnion.model.mechanism import Mechanism

__all__ = ["check_files", "show"]


def check_files(out: Sequence[Path]) -> None:
    """MechanismError for a file that cannot be written, before anything is computed."""
    from trunnion.results.export import check_format

    for path in out:
        if path.suffix.lower() not in IMAGES:
            check_format(path, IMAGES)


def show(mechanism: Mechanism, result: xr.Dataset, out: Sequence[Path], units_row: bool, uncut: bool = False) -> None:
    """Write the files, print a table for each measure."""
    from trunnion.results.export import save
    from trunnion.views.common.peaks import whole_peaks
    from trunnion.views.cycle import plots
    from trunnion.views.play.figure import MOST_PANELS, figure, tables

    for path in out:
        if path.suffix.lower() not in IMAGES:
            save(result, path, units_row)
        elif result.sizes["measure"] > MOST_PANELS:
            what = f"{result.sizes['measure']} measures do not fit one figure"
            raise MechanismError(Finding(what, str(path), f"name at most {MOST_PANELS} by --measure"))
        else:
            plots.save(figure(whole_peaks(result, uncut)), path)
    say_missed(result)
    for i, table in enumerate(tables(result)):
        show_rows(f"{mechanism.name}\n{table.title}" if i == 0 and mechanism.name else table.title, *table[1:])
    for path in out:
        wrote(path)

"""`trunnion play`: what the play of every joint does to measures."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from trunnion.cli.model import lines_of, stated
from trunnion.cli.options import (
    File,
    FrictionLaw,
    Measures,
    OnePosition,
    Out,
    Report,
    Set,
    Steps,
    TableFile,
    TableUnits,
    Uncut,
    Units,
    UnitsRow,
)
from trunnion.cli.result import Shown, check_files, show_tables
from trunnion.errors import Finding, MechanismError

__all__ = ["play"]


def play(
    file: File,
    measure: Measures = None,
    steps: Steps = 360,
    at: OnePosition = None,
    set_: Set = None,
    table: TableFile = None,
    friction: FrictionLaw = None,
    out: Out = None,
    report: Report = None,
    units_row: UnitsRow = False,
    units: Units = TableUnits.si,
    uncut: Uncut = False,
) -> None:
    """Effect of the play of each joint on measures.

    Worst case, share of each joint, standard deviation.
    """
    from trunnion.studies.play import play as run

    check_files(out or [], report)
    mechanism = stated(file, set_, table, friction)
    with lines_of(file):
        result = run(mechanism, measure, steps, at)

    def draw(path: Path) -> Any:
        from trunnion.views.common.peaks import whole_peaks
        from trunnion.views.play import MOST_PANELS, figure

        if result.sizes["measure"] > MOST_PANELS:
            what = f"{result.sizes['measure']} measures do not fit one figure"
            raise MechanismError(Finding(what, str(path), f"name at most {MOST_PANELS} by --measure"))
        return figure(whole_peaks(result, uncut))

    def show() -> None:
        from trunnion.views.play import tables

        show_tables(mechanism.name, tables(result), apart=False)

    def page() -> str:
        from trunnion.views.common.peaks import whole_peaks
        from trunnion.views.play import report as html

        return html(whole_peaks(result, uncut))

    Shown(
        result, file, ["measures", "joints"], out or [], report, units_row,
        draw=draw, page=page, show=show, units=units,
    ).finish()  # fmt: skip

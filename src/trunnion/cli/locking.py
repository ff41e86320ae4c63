"""`trunnion locking`: how near to locking, at which positions, by which joint, and whether it can be backdriven."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from trunnion.cli.model import lines_of, stated
from trunnion.cli.options import (
    Columns,
    File,
    FrictionLaw,
    Out,
    Seats,
    Set,
    Steps,
    TableFile,
    TableUnits,
    Units,
    UnitsRow,
)
from trunnion.cli.result import Shown, check_files
from trunnion.cli.terminal import bar, console, show_figures, show_rows

__all__ = ["locking"]

MOST_RANGES = 24  # rows of the table of ranges


def locking(
    file: File,
    steps: Steps = 360,
    set_: Set = None,
    table: TableFile = None,
    friction: FrictionLaw = None,
    seat: Seats = None,
    near: Annotated[
        float, typer.Option("--near", help="Locking margin below which a position counts as near locking.")
    ] = 1.5,
    out: Out = None,
    units_row: UnitsRow = False,
    units: Units = TableUnits.si,
    columns: Columns = None,
) -> None:
    """Margin against locking by friction; backdriving.

    The margin for the friction of all joints and of each joint alone, and the ranges of the drive in which the
    mechanism locks, is near locking, is self-locking or can be backdriven.
    """
    from trunnion.cycle.locking import look, report_figures
    from trunnion.results.attributes import attribute
    from trunnion.solve.run import prepare

    check_files(out or [])
    mechanism = stated(file, set_, table, friction, seat)
    with lines_of(file):
        run = prepare(mechanism)
        with bar("positions", steps, least=200_000) as progress:
            found = look(run, steps, progress, near)
    figures = report_figures(run)
    every = attribute(found, "locking_ranges", "{}")

    def show() -> None:
        show_figures(mechanism.name or str(file), figures)
        if mechanism.drivers:
            console().print()
            title = f"ranges of {every['of']}".removesuffix(" of ") + ", pins centred" * bool(run.seats)
            _show_ranges(title, [row["cells"] for row in every["rows"]])

    def draw(path: Path) -> Any:
        from trunnion.views.cycle.plots import figure

        return figure(found, "locking")

    Shown(
        found, file, ["assembly"], out or [], None, units_row,
        draw=draw, show=show, columns=columns or ["locking"], units=units,
    ).finish()  # fmt: skip


def _show_ranges(title: str, rows: list[list[str]]) -> None:
    """The ranges as a table, in the order of the cycle; those near locking last."""
    from trunnion.cycle.locking_course import HEAD

    show_rows(title, list(HEAD), rows[:MOST_RANGES])
    if len(rows) > MOST_RANGES:
        console().print(f"{len(rows) - MOST_RANGES} more ranges; --out has every position", markup=False)

"""`trunnion simulate`: what a mechanism does when its motors, loads and friction act on it."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from trunnion.cli.model import exit_status, lines_of, placed, stated
from trunnion.cli.options import (
    File,
    FrictionLaw,
    Out,
    Report,
    Set,
    TableFile,
    TableUnits,
    Units,
    UnitsRow,
    seconds,
)
from trunnion.cli.result import Shown, check_files
from trunnion.cli.terminal import bar, say

__all__ = ["simulate"]

PERCENT = 100
EVALUATIONS = 2_000_000  # as `simulate` has it

Kind = Annotated[
    str | None,
    typer.Option(
        "--kind",
        help="Figure to write: sheet, speed, effort, reactions, energy, phase; in play contacts, gaps, orbit, "
        "spectrum; of a steady cycle those of `trunnion plot`.",
    ),
]


def simulate(
    file: File,
    time: Annotated[
        str | None, typer.Option("--time", help="Duration, as 2s or 300ms; default: ten cycles of the stated motion.")
    ] = None,
    steps: Annotated[int, typer.Option("--steps", help="Equal intervals of time in the result.")] = 1000,
    tolerance: Annotated[float, typer.Option("--tolerance", help="Relative tolerance of the integration.")] = 1e-9,
    steady: Annotated[
        bool, typer.Option("--steady", help="The cycle that the motion comes to repeat, as `analyse` gives a cycle.")
    ] = False,
    evaluations: Annotated[
        int, typer.Option("--evaluations", help="Evaluations of the forces, after which the motion ends.")
    ] = EVALUATIONS,
    set_: Set = None,
    table: TableFile = None,
    friction: FrictionLaw = None,
    kind: Kind = None,
    out: Out = None,
    report: Report = None,
    units_row: UnitsRow = False,
    units: Units = TableUnits.si,
) -> None:
    """Motion in time: start-up, run-down, rest, locking, pins in play.

    The motion of drivers that are free or have a motor, with friction, stick and slip, forces, energy and events.
    """
    from trunnion.dynamics.opened import in_play
    from trunnion.dynamics.simulate import simulated
    from trunnion.dynamics.steady_cycle import UnsteadyError

    of = "cycle" if steady else "motion"
    check_files(out or [], report, of=of, kind=kind if out else None)
    duration = seconds(time, "--time", "2s")
    mechanism = stated(file, set_, table, friction)
    if not in_play(mechanism):
        _check_without_play(out or [], of, kind)
    with lines_of(file), bar("%", PERCENT) as progress:
        reached = None if progress is None else lambda share: progress(int(PERCENT * share))
        try:
            result = simulated(mechanism, duration, steps, tolerance, reached, steady, evaluations)
        except UnsteadyError as none:
            say(placed(none.findings, file, ["drivers"]))
            raise typer.Exit(exit_status(none.findings)) from None
    Shown(result, file, ["drivers"], out or [], report, units_row, drawn={"kind": kind}, units=units).finish()


def _check_without_play(out: list[Path], of: str, kind: str | None) -> None:
    """MechanismError for a table or figure of contacts, of which there are none without joints in play."""
    from trunnion.results.tables import check_table

    for path in out:
        check_table(path, of, in_play=False)
    if kind and out:
        from trunnion.views.motion.figure import check_contacts

        check_contacts(kind, in_play=False)

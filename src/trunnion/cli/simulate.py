"""`trunnion simulate`: what a mechanism does when its motors, loads and friction act on it."""

from __future__ import annotations

from typing import Annotated

from typer import Option

from trunnion.cli.files import verb
from trunnion.cli.options import Files, Model, seconds
from trunnion.cli.result import Shown, check_files, end
from trunnion.cli.terminal import bar

__all__ = ["simulate"]

PERCENT = 100
EVALUATIONS = 2_000_000  # as `simulate` has it


@verb(lacks="seat columns")
def simulate(
    model: Model, files: Files,
    time: Annotated[
        str | None, Option("--time", help="Duration, as 2s or 300ms; default: ten cycles of the stated motion.")
    ] = None,
    steps: Annotated[int, Option("--steps", help="Equal intervals of time in the result.")] = 1000,
    tolerance: Annotated[float, Option("--tolerance", help="Relative tolerance of the integration.")] = 1e-9,
    steady: Annotated[
        bool, Option("--steady", help="The cycle that the motion comes to repeat, as `analyse` gives a cycle.")
    ] = False,
    evaluations: Annotated[
        int, Option("--evaluations", help="Evaluations of the forces, after which the motion ends.")
    ] = EVALUATIONS,
    kind: Annotated[
        str | None,
        Option("--kind",
               help="Figure to write: sheet, speed, effort, reactions, energy, phase; in play contacts, gaps, orbit, "
               "spectrum; of a steady cycle those of `trunnion plot`."),
    ] = None,
) -> None:  # fmt: skip
    """Motion in time: start-up, run-down, rest, locking, pins in play.

    The motion of drivers that are free or have a motor, with friction, stick and slip, forces, energy and events.
    """
    from trunnion.dynamics.opened import in_play
    from trunnion.dynamics.simulate import simulated
    from trunnion.dynamics.steady_cycle import UnsteadyError

    of = "cycle" if steady else "motion"
    check_files(files, of, kind if files.out else None)
    duration = seconds(time, "--time", "2s")
    mechanism = model.read()
    if files.out and not in_play(mechanism):
        _check_without_play(files, of, kind)
    with model.lines(), bar("%", PERCENT) as progress:
        reached = None if progress is None else lambda share: progress(int(PERCENT * share))
        try:
            result = simulated(mechanism, duration, steps, tolerance, reached, steady, evaluations)
        except UnsteadyError as unsteady:
            end(unsteady.findings, model.file, "drivers")
    Shown(result, model, files, "drivers", drawn={"kind": kind}).finish()


def _check_without_play(files: Files, of: str, kind: str | None) -> None:
    """MechanismError for a table or figure of contacts, of which there are none without joints in play."""
    from trunnion.results.tables import check_table

    for path in files.out or ():
        check_table(path, of, in_play=False)
    if kind:
        from trunnion.views.motion.figure import check_contacts

        check_contacts(kind, in_play=False)

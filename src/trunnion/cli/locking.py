"""`trunnion locking`: how near to locking, at which positions, by which joint, and whether it can be backdriven."""

from __future__ import annotations

from typing import Annotated

from typer import Option

from trunnion.cli.files import verb
from trunnion.cli.options import Files, Model, Steps
from trunnion.cli.result import Shown, check_files
from trunnion.cli.terminal import bar, line, show_figures, show_rows

__all__ = ["locking"]

MOST_RANGES = 24  # rows of the table of ranges


@verb(lacks="report")
def locking(
    model: Model, files: Files, steps: Steps = 360,
    near: Annotated[
        float, Option("--near", help="Locking margin below which a position counts as near locking.")
    ] = 1.5,
) -> None:  # fmt: skip
    """Margin against locking by friction; backdriving.

    The margin for the friction of all joints and of each joint alone, and the ranges of the drive in which the
    mechanism locks, is near locking, is self-locking or can be backdriven.
    """
    from trunnion.cycle.locking import look, report_figures
    from trunnion.cycle.locking_course import HEAD
    from trunnion.results.attributes import attribute
    from trunnion.solve.run import prepare

    check_files(files)
    files.columns = files.columns or ["locking"]
    mechanism = model.read()
    with model.lines():
        run = prepare(mechanism)
        with bar("positions", steps, least=200_000) as progress:
            result = look(run, steps, progress, near)
    figures = report_figures(run)

    def show() -> None:
        show_figures(mechanism.name or str(model.file), figures)
        if not mechanism.drivers:
            return
        line()
        ranges = attribute(result, "locking_ranges", "{}")
        title = f"ranges of {ranges['of']}".removesuffix(" of ") + ", pins centred" * bool(run.seats)
        rows = [row["cells"] for row in ranges["rows"]]  # in the order of the cycle; those near locking last
        show_rows(title, list(HEAD), rows[:MOST_RANGES])
        if len(rows) > MOST_RANGES:
            line(f"{len(rows) - MOST_RANGES} more ranges; --out has every position")

    Shown(result, model, files, "assembly", drawn={"kind": "locking"}, show=show).finish()

"""`trunnion rig`: the data files that a test rig would leave which is not there yet."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from typer import Argument, Option

from trunnion.cli.files import verb
from trunnion.cli.options import Model, Seed
from trunnion.cli.result import exit_status
from trunnion.cli.terminal import bar, line, say, wrote
from trunnion.errors import Finding, MechanismError, counted

if TYPE_CHECKING:
    from trunnion.rig.virtual.observe import Observation

__all__ = ["rig"]

FEWEST = 20  # conditions from which a progress bar is worth it


@verb()
def rig(
    model: Model,
    rig_file: Annotated[Path, Argument(help="Rig file: YAML, JSON or TOML.")],
    out: Annotated[
        Path | None, Option("--out", "-o", help="Folder for data files, mapping.yaml and truth.yaml.")
    ] = None,
    format_: Annotated[str, Option("--format", help="csv, parquet or tdms; default: as stated in the rig file.")] = "",
    seed: Seed = 1,
) -> None:
    """Virtual test rig: write simulated data files.

    Without --out the rig file is only checked.
    """
    from trunnion.model.file import read_entries
    from trunnion.rig.reading.rig_file import Rig, placed_in_rig
    from trunnion.rig.virtual.files import check_folder, check_form
    from trunnion.rig.virtual.observe import observe

    if format_:
        check_form(format_)
    if "trunnion-rig" in read_entries(model.file)[0]:
        raise MechanismError(
            Finding("is a rig file", remedy="name the model first, then the rig", file=str(model.file))
        )
    mechanism = model.read()
    stated = Rig.read(rig_file)
    if out and not format_:
        check_form(stated.format)
    count = len(stated.schedule.rows())
    with model.lines():
        try:
            if out:
                check_folder(stated, out, format_)
            with bar("conditions", count, least=FEWEST) as progress:
                observation = observe(mechanism, stated, seed, progress)
        except MechanismError as error:  # findings about the rig bear the line of its file
            raise MechanismError(placed_in_rig(error.findings, rig_file)) from None
    _about(observation)
    if out:
        with bar("files", len(observation.cases), least=FEWEST) as progress:
            names = observation.write(out, format_, progress)
        wrote(out)
        first, last, *_ = (*names[:1], *names[-3:-2])
        span = first if first == last else f"{first} … {last}"
        line(f"  {span}, {', '.join(names[-2:])}")
    say(placed_in_rig(observation.findings, rig_file))
    raise typer.Exit(exit_status(observation.findings) or int(bool(observation.skipped)))


def _about(observation: Observation) -> None:
    """What is recorded: conditions, turns, samples."""
    conditions = len(observation.cases)
    rows = max(case.rows for case in observation.cases)
    line(observation.rig.name or "Test rig", "bold")
    texts = (
        observation.mechanism.name or "no name",
        f"{counted(conditions, 'condition')} of {counted(observation.rig.schedule.turns, 'cycle')}",
        f"{observation.rate:g} samples a second",
        counted(observation.rows, "row") + (f", at most {rows:,} a file" if conditions > 1 else ""),
    )
    line("; ".join(texts))

"""`trunnion rig`: the data files that a test rig would leave which is not there yet."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from trunnion.cli.model import exit_status, lines_of, stated
from trunnion.cli.options import File, FrictionLaw, Seats, Seed, Set, TableFile
from trunnion.cli.terminal import bar, console, say, wrote
from trunnion.errors import Finding, MechanismError, counted

if TYPE_CHECKING:
    from trunnion.rig.virtual.observe import Observation

__all__ = ["rig"]

FEWEST = 20  # conditions from which a progress bar is worth it


def rig(
    file: File,
    rig_file: Annotated[Path, typer.Argument(help="Rig file: YAML, JSON or TOML.")],
    out: Annotated[
        Path | None, typer.Option("--out", "-o", help="Folder for data files, mapping.yaml and truth.yaml.")
    ] = None,
    format_: Annotated[
        str | None, typer.Option("--format", help="csv, parquet or tdms; default: as stated in the rig file.")
    ] = None,
    seed: Seed = 1,
    set_: Set = None,
    table: TableFile = None,
    friction: FrictionLaw = None,
    seat: Seats = None,
) -> None:
    """Virtual test rig: write simulated data files.

    Without --out the rig file is only checked.
    """
    from trunnion.rig.reading.rig_file import Rig, placed_in_rig
    from trunnion.rig.virtual.files import check_folder, check_form
    from trunnion.rig.virtual.observe import observe

    if format_:
        check_form(format_)
    _in_order(file)
    mechanism = stated(file, set_, table, friction, seat)
    stated_rig = Rig.read(rig_file)
    if out and not format_:
        check_form(stated_rig.format)
    with lines_of(file), _lines_of_rig(rig_file):
        count = len(stated_rig.schedule.rows())
        if out:
            check_folder(stated_rig, out, format_ or "")
        with bar("conditions", count, least=FEWEST) as progress:
            observation = observe(mechanism, stated_rig, seed, progress)
    _about(observation)
    if out:
        with bar("files", len(observation.cases), least=FEWEST) as progress:
            names = observation.write(out, format_ or "", progress)
        wrote(out)
        first, last, *_ = (*names[:1], *names[-3:-2])
        span = first if first == last else f"{first} … {last}"
        console().print(f"  {span}, {', '.join(names[-2:])}", markup=False, highlight=False, soft_wrap=True)
    say(placed_in_rig(observation.findings, rig_file))
    raise typer.Exit(exit_status(observation.findings) or int(bool(observation.skipped)))


def _in_order(file: Path) -> None:
    """MechanismError where the rig is named before the model."""
    from trunnion.model.file import read_entries

    if "trunnion-rig" in read_entries(file)[0]:
        raise MechanismError(Finding("is a rig file", remedy="name the model first, then the rig", file=str(file)))


@contextmanager
def _lines_of_rig(path: Path) -> Iterator[None]:
    """Findings about the rig bear the line of its file also where `observe` finds them."""
    from trunnion.rig.reading.rig_file import placed_in_rig

    try:
        yield
    except MechanismError as error:
        raise MechanismError(placed_in_rig(error.findings, path)) from None


def _about(observation: Observation) -> None:
    """What is recorded: conditions, turns, samples."""
    turns, conditions = observation.rig.schedule.turns, len(observation.cases)
    rows = max(case.rows for case in observation.cases)
    out = console()
    out.print(observation.rig.name or "Test rig", style="bold", markup=False)
    texts = (
        observation.mechanism.name or "no name",
        f"{conditions} condition{'s' * (conditions != 1)} of {turns} cycle{'s' * (turns != 1)}",
        f"{observation.rate:g} samples a second",
        counted(observation.rows, "row") + (f", at most {rows:,} a file" if conditions > 1 else ""),
    )
    out.print("; ".join(texts), markup=False, highlight=False, soft_wrap=True)

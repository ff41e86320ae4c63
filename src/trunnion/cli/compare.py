"""`trunnion compare`: a model beside measured data, per working condition and channel."""

from __future__ import annotations

from typing import Annotated

from typer import Option

from trunnion.cli.files import verb
from trunnion.cli.options import DataFiles, Files, MappingFile, Model
from trunnion.cli.result import Shown, check_files, exit_status
from trunnion.cli.terminal import bar
from trunnion.results.attributes import findings_of

__all__ = ["compare"]

MOST_ROWS = 40


@verb(lacks="units columns")
def compare(
    model: Model, mapping: MappingFile, files: Files, data: DataFiles = None,
    channel: Annotated[
        list[str] | None, Option("--channel", help="A channel by its name in the mapping. Repeatable.")
    ] = None,
    condition: Annotated[str | None, Option("--condition", help="The condition to draw.")] = None,
    kind: Annotated[str | None, Option("--kind", help="Figure of --out: efficiency or overlay.")] = None,
) -> None:  # fmt: skip
    """Compare a model with measured data: residual, bias, verdict.

    Every channel, and the efficiency as a test rig determines it. Exit status 0 if all agree within the expanded
    uncertainty, 1 if not or if that is undecided.
    """
    from trunnion.rig.comparison import compare as run
    from trunnion.rig.reading.read import read_measured
    from trunnion.rig.reading.timebase import gathered
    from trunnion.views.compare import tables

    check_files(files, "comparison", kind)
    mechanism = model.read()
    measurement = read_measured(mapping, [str(path) for path in data] if data else None)
    with model.lines(), bar("conditions", len(measurement.conditions)) as progress:
        result = run(mechanism, measurement, channel, progress=progress)
    errors = exit_status([*measurement.findings, *findings_of(result)])
    Shown(
        result, model, files, "assembly measures", tables=tables(result), most=MOST_ROWS, rest="FILE.figures.csv",
        drawn={"kind": kind, "condition": condition, "channel": channel[0] if channel and len(channel) == 1 else None},
        others=gathered(measurement.findings),
    ).finish(int(not result.attrs["all_within"] or errors))  # fmt: skip

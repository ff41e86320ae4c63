"""`trunnion tolerance`: what tolerances and plays do to measures, and which of them does it."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from trunnion.cli.model import lines_of, stated
from trunnion.cli.options import (
    At,
    Engine,
    File,
    FrictionLaw,
    Jobs,
    Measures,
    OutTolerance,
    Report,
    Seats,
    Seed,
    Set,
    Steps,
    TableFile,
    UnitsRow,
    named_file,
    share,
)
from trunnion.cli.result import Shown, check_files, show_tables
from trunnion.cli.terminal import bar, show_figures
from trunnion.results.attributes import summary_of

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["shown_of", "tolerance"]

SECTIONS = ("measures", "joints", "tolerances")

Methods = Annotated[
    list[str] | None,
    typer.Option(
        "--method",
        help="linear, worst-case, monte-carlo, quasi-monte-carlo, sobol. Repeatable; the first three if not given.",
    ),
]
Samples = Annotated[
    list[str] | None,
    typer.Option("--sample", help="NAME=FILE.csv: measured deviations of a number, one column. Repeatable."),
]
Cluster = Annotated[str | None, typer.Option("--cluster", help="Address of a Dask scheduler, or local.")]
Kind = Annotated[
    str | None,
    typer.Option("--kind", help="A single figure: histogram, contributions, envelope, convergence or sobol."),
]


def tolerance(
    file: File,
    measure: Measures = None,
    at: At = None,
    method: Methods = None,
    target: Annotated[
        float | None,
        typer.Option(
            "--yield",
            parser=share,
            metavar="SHARE",
            help="Required share within limits, 0.99 or 99%; then it alone decides the exit status.",
        ),
    ] = None,
    samples: Annotated[int, typer.Option("--samples", help="Number of random mechanisms.")] = 10_000,
    seed: Seed = 1,
    steps: Steps = 360,
    jobs: Jobs = None,
    engine: Engine = "auto",
    cluster: Cluster = None,
    checkpoint: Annotated[
        Path | None, typer.Option("--checkpoint", help="File that keeps the samples done; the same command continues.")
    ] = None,
    set_: Set = None,
    table: TableFile = None,
    friction: FrictionLaw = None,
    seat: Seats = None,
    sample: Samples = None,
    kind: Kind = None,
    out: OutTolerance = None,
    report: Report = None,
    units_row: UnitsRow = False,
) -> None:
    """Effect of tolerances and play: worst case, RSS, yield, shares."""
    from trunnion.studies.tolerance.sampling import METHODS as SAMPLINGS
    from trunnion.studies.tolerance.study import DEFAULT_METHODS
    from trunnion.studies.tolerance.study import tolerance as run

    check_files(out or [], report, of="tolerance", kind=kind)
    mechanism = stated(file, set_, table, friction, seat)
    for text in sample or []:
        mechanism = mechanism.with_samples(*named_file(text, "--sample"))
    methods = tuple(method or (one for one in DEFAULT_METHODS if samples or one not in SAMPLINGS))
    counted = samples if any(one in SAMPLINGS for one in methods) else 0
    with lines_of(file), bar("samples", counted, least=1000) as progress:
        result = run(
            mechanism, measure, methods, samples, seed, steps, at, jobs=jobs, engine=engine,  # type: ignore[arg-type]
            cluster=cluster, checkpoint=checkpoint, progress=progress, target=target,
        )  # fmt: skip
    shown = shown_of(result, mechanism.name, file, out or [], units_row, kind, report)
    shown.finish()


def shown_of(
    result: xr.Dataset, name: str, file: Path, out: Sequence[Path], units_row: bool, kind: str | None,
    report: Path | None,
) -> Shown:  # fmt: skip
    """What is done with the result. kind: of figure; all on one sheet if None."""

    def show() -> None:
        from trunnion.views.tolerance import tables

        shown = tables(result)
        show_tables(name, shown)
        if not shown:
            show_figures(name, summary_of(result))

    return Shown(result, file, SECTIONS, out, report, units_row, {"kind": kind}, show=show)

"""`trunnion tolerance`: what tolerances and plays do to measures, and which of them does it."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from typer import Option

from trunnion.cli.files import verb
from trunnion.cli.options import (
    CURVES,
    WRITTEN,
    At,
    Engine,
    Files,
    Jobs,
    Measures,
    Model,
    Samples,
    Seed,
    Steps,
    named_file,
    share,
)
from trunnion.cli.result import Shown, check_files
from trunnion.cli.terminal import bar

__all__ = ["tolerance"]

NAMES = f"The name says which table: x.csv has the measures, x.parameters.csv the contributions, {CURVES}."
SECTIONS = "measures joints tolerances"


@verb(lacks="units columns", out=f"{WRITTEN} {NAMES}")
def tolerance(
    model: Model, files: Files, measure: Measures = None, at: At = None,
    method: Annotated[
        list[str] | None,
        Option(
            "--method",
            help="linear, worst-case, monte-carlo, quasi-monte-carlo, sobol. Repeatable; the first three if not given.",
        ),
    ] = None,
    target: Annotated[
        float | None,
        Option("--yield", parser=share, metavar="SHARE",
               help="Required share within limits, 0.99 or 99%; then it alone decides the exit status."),
    ] = None,
    samples: Samples = 10_000, seed: Seed = 1, steps: Steps = 360, jobs: Jobs = None, engine: Engine = "auto",
    cluster: Annotated[str | None, Option("--cluster", help="Address of a Dask scheduler, or local.")] = None,
    checkpoint: Annotated[
        Path | None, Option("--checkpoint", help="File that keeps the samples done; the same command continues.")
    ] = None,
    sample: Annotated[
        list[str] | None,
        Option("--sample", help="NAME=FILE.csv: measured deviations of a number, one column. Repeatable."),
    ] = None,
    kind: Annotated[
        str | None,
        Option("--kind", help="A single figure: histogram, contributions, envelope, convergence or sobol."),
    ] = None,
) -> None:  # fmt: skip
    """Effect of tolerances and play: worst case, RSS, yield, shares."""
    from trunnion.studies.tolerance.sampling import METHODS as SAMPLINGS
    from trunnion.studies.tolerance.study import DEFAULT_METHODS
    from trunnion.studies.tolerance.study import tolerance as run
    from trunnion.views.tolerance import tables

    check_files(files, "tolerance", kind)
    mechanism = model.read()
    for text in sample or ():
        mechanism = mechanism.with_samples(*named_file(text, "--sample"))
    methods = tuple(method or (name for name in DEFAULT_METHODS if samples or name not in SAMPLINGS))
    drawn = samples if set(methods) & set(SAMPLINGS) else 0
    with model.lines(), bar("samples", drawn, least=1000) as progress:
        result = run(
            mechanism, measure, methods, samples, seed, steps, at, jobs=jobs, engine=engine,  # type: ignore[arg-type]
            cluster=cluster, checkpoint=checkpoint, progress=progress, target=target,
        )  # fmt: skip
    Shown(result, model, files, SECTIONS, drawn={"kind": kind}, tables=tables(result)).finish()

"""`trunnion assemble`, `play`, `tolerance` and `allocate`: mechanisms as they are built."""

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Literal

from typer import Option

from trunnion.cli.options import CURVES, IMAGES, ONE_POSITION, WRITTEN, Files, Model, named_file, share, verb
from trunnion.cli.result import Shown, bar, check_files, check_model, exit_status, line
from trunnion.errors import Finding, MechanismError
from trunnion.results.attributes import findings_of

if TYPE_CHECKING:
    import xarray as xr

    from trunnion.model.mechanism import Mechanism


@verb(
    lacks="table friction seat columns",
    uniform="Joints with one common clearance: pins, or all kinds of play.",
)
def assemble(model: Model, files: Files, steps: int = 360, uniform: Literal["pins", "all"] = "pins") -> None:
    """Clearance needed to assemble a linkage with axis errors."""
    from trunnion.studies.assembly import assemble as run

    check_files(files)
    mechanism = model.read()
    with model.lines(), bar("positions", steps, least=1000) as progress:
        result = run(mechanism, steps, uniform, progress)
    Shown(result, model, files, "assembly").finish()


@verb(lacks="seat columns", at=ONE_POSITION)
def play(
    model: Model, files: Files, measure: list[str] | None = None, steps: int = 360, at: str | None = None,
    uncut: bool = False,
) -> None:  # fmt: skip
    """Effect of the play of each joint on measures.

    Worst case, share of each joint, standard deviation.
    """
    from trunnion.studies.play import play as run
    from trunnion.views.play import tables

    check_files(files)
    mechanism = model.read()
    with model.lines():
        result = run(mechanism, measure, steps, at)
    Shown(result, model, files, "measures joints", uncut, tables=tables(result), apart=False).finish()


OF_TOLERANCE = f"The name says which table: x.csv has the measures, x.parameters.csv the contributions, {CURVES}."
SECTIONS = "measures joints tolerances"


@verb(
    lacks="units columns",
    out=f"{WRITTEN} {OF_TOLERANCE}",
    method="linear, worst-case, monte-carlo, quasi-monte-carlo, sobol. Repeatable; the first three if not given.",
    target=Option(
        "--yield", parser=share, metavar="SHARE",
        help="Required share within limits, 0.99 or 99%; then it alone decides the exit status.",
    ),
    cluster="Address of a Dask scheduler.",
    checkpoint="Folder that keeps the samples done; the same command continues.",
    sample="NAME=FILE.csv: measured deviations of a number, one column. Repeatable.",
    kind="A single figure: histogram, contributions or envelope.",
)  # fmt: skip
def tolerance(
    model: Model, files: Files, measure: list[str] | None = None, at: str | None = None,
    method: list[str] | None = None, target: float | None = None, samples: int = 10_000, seed: int = 1,
    steps: int = 360, jobs: int | None = None, engine: str = "auto", cluster: str | None = None,
    checkpoint: Path | None = None, sample: list[str] | None = None, kind: str | None = None,
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


DIGITS = 5  # significant ones of a tolerance in the model that is written
OF_ALLOCATION = (
    "The name says which table: x.csv has the tolerances, x.measures.csv the measures, x.offers.csv the cost over "
    f"accuracy, {CURVES}."
)
Criterion = Literal["worst-case", "rss", "yield"]


@verb(
    lacks="units columns",
    out=f"{WRITTEN} {OF_ALLOCATION}",
    criterion="What must meet the limits: worst-case, rss or yield. [default: worst-case]",
    target=Option(
        "--yield", parser=share, metavar="SHARE",
        help="Required share within all limits, 0.99 or 99%; implies --criterion yield.",
    ),
    exact="Exact worst case of the mechanism instead of the first-order one.",
    sure="The lower end of the 95 % interval of fresh samples has to meet the yield.",
    curve="Number of points of the cost-accuracy curve; 0: no curve.",
    samples="Number of random mechanisms for the verification; 0: none.",
    kind="Which figure: trade-off, or one of `tolerance`.",
)  # fmt: skip
def allocate(
    model: Model, files: Files, measure: list[str] | None = None, criterion: Criterion | None = None,
    target: float | None = None, exact: bool = False, sure: bool = False,
    curve: int = 0, at: str | None = None, steps: int = 360, samples: int = 10_000, seed: int = 1,
    jobs: int | None = None, write: Path | None = None, force: bool = False, kind: str | None = None,
) -> None:  # fmt: skip
    """Find the tolerances of minimum cost that meet the limits.

    The result is verified by samples; --curve gives cost over accuracy.
    """
    from trunnion.studies.allocation.allocate import allocate as run
    from trunnion.views.allocation import tables

    check_files(files, "allocation", kind)
    check_model(write, model.file, force)
    if target is not None and criterion not in (None, "yield"):
        what = f"the criterion {criterion} does not use a yield of {target:g}"
        raise MechanismError(Finding(what, "--yield", f"remove --yield, or remove --criterion {criterion}"))
    by: Criterion = "yield" if target is not None else criterion or "worst-case"
    mechanism = model.read()
    with model.lines(), bar("samples", samples, least=1000) as progress:
        result = run(
            mechanism, measure, by, target, steps, at, samples, seed,
            curve, exact=exact, sure=sure, jobs=jobs, progress=progress,
        )  # fmt: skip
    # findings about costs by the names that the file has for them
    names = {f"costs.{path}": f"costs.{name}" for name in mechanism.costs for path in mechanism.cost_paths(name)}
    findings = [replace(finding, where=names.get(finding.where, finding.where)) for finding in findings_of(result)]
    allocated = bool(result.attrs["found"])
    if not allocated:  # there is nothing to draw then
        files.out = [path for path in files.out or () if path.suffix.lower() not in IMAGES]

    parts = tables(result)
    show = None if parts else lambda: line(f"{result.attrs.get('name', '')}\nno allocation meets the limits".lstrip())
    output = Shown(result, model, files, f"{SECTIONS} costs", drawn={"kind": kind}, tables=parts, show=show)
    output.write()
    if write is not None and allocated and not exit_status(findings):
        output.write_model(_bought(mechanism, result), write, force)
    elif write is not None:
        why = "the tolerances found do not meet the limits" if allocated else "there is no allocation"
        findings.append(Finding(f"'{write}' is not written: {why}", "--write"))
    output.end(findings)


def _bought(mechanism: "Mechanism", result: "xr.Dataset") -> "Mechanism":
    """The mechanism with what was found: options as they are, all others rounded down, so that the limits hold."""
    from trunnion.studies.allocation.allocate import half_widths

    widths = half_widths(result)
    made = dict(zip(result["parameter"].values.tolist(), result["choice"].values.tolist(), strict=True))
    options = {path: width for path, width in widths.items() if made[path]}
    others = {path: width for path, width in widths.items() if not made[path]}
    return mechanism.with_tolerances(options).with_tolerances(others, DIGITS)

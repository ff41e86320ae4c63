"""`trunnion allocate`: the tolerances and plays of least cost that keep the limits of measures."""

from __future__ import annotations

from enum import StrEnum
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from trunnion.cli.model import exit_status, lines_of, stated
from trunnion.cli.options import (
    At,
    File,
    Force,
    FrictionLaw,
    Jobs,
    Measures,
    OutAllocation,
    Report,
    Seats,
    Seed,
    Set,
    Steps,
    TableFile,
    UnitsRow,
    Write,
    share,
)
from trunnion.cli.result import Shown, check_files, check_model, show_tables
from trunnion.cli.terminal import bar, console
from trunnion.cli.tolerance import SECTIONS as OF_TOLERANCES
from trunnion.errors import Finding, MechanismError, Severity
from trunnion.results.attributes import findings_of

if TYPE_CHECKING:
    import xarray as xr

    from trunnion.model.mechanism import Mechanism

__all__ = ["allocate"]

SECTIONS = (*OF_TOLERANCES, "costs")
WRITTEN = 5  # significant digits of a tolerance in the model that is written


class Criterion(StrEnum):
    """What is to keep the limits."""

    WORST_CASE = "worst-case"
    RSS = "rss"
    YIELD = "yield"


class Choice(StrEnum):
    """What may be chosen."""

    AUTO = "auto"
    CONTINUOUS = "continuous"
    DISCRETE = "discrete"


Way = Annotated[Choice, typer.Option("--choice", help="continuous, discrete, or auto: according to the stated costs.")]
Exact = Annotated[
    bool, typer.Option("--exact", help="Exact worst case of the mechanism instead of the first-order one.")
]
Sure = Annotated[
    bool, typer.Option("--sure", help="The lower end of the 95 % interval of fresh samples has to meet the yield.")
]
Curve = Annotated[int, typer.Option("--curve", help="Number of points of the cost-accuracy curve; 0: no curve.")]
Samples = Annotated[int, typer.Option("--samples", help="Number of random mechanisms for the verification; 0: none.")]
Figures = Annotated[str | None, typer.Option("--kind", help="Which figure: cost, trade-off, or one of `tolerance`.")]


def allocate(
    file: File,
    measure: Measures = None,
    criterion: Annotated[
        Criterion | None,
        typer.Option("--criterion", help="What must meet the limits: worst-case, rss or yield. [default: worst-case]"),
    ] = None,
    target: Annotated[
        float | None,
        typer.Option(
            "--yield",
            parser=share,
            metavar="SHARE",
            help="Required share within all limits, 0.99 or 99%; implies --criterion yield.",
        ),
    ] = None,
    choice: Way = Choice.AUTO,
    exact: Exact = False,
    sure: Sure = False,
    curve: Curve = 0,
    at: At = None,
    steps: Steps = 360,
    samples: Samples = 10_000,
    seed: Seed = 1,
    jobs: Jobs = None,
    set_: Set = None,
    table: TableFile = None,
    friction: FrictionLaw = None,
    seat: Seats = None,
    write: Write = None,
    force: Force = False,
    kind: Figures = None,
    out: OutAllocation = None,
    report: Report = None,
    units_row: UnitsRow = False,
) -> None:
    """Find the tolerances of minimum cost that meet the limits.

    The result is verified by samples; --curve gives cost over accuracy.
    """
    from trunnion.studies.allocation.allocate import allocate as run

    check_files(out or [], report, of="allocation", kind=kind)
    check_model(write, file, force)
    by = _criterion(criterion, target)
    mechanism = stated(file, set_, table, friction, seat)
    with lines_of(file), bar("samples", samples, least=1000) as progress:
        result = run(
            mechanism, measure, by.value, target, choice.value, steps, at, samples,
            seed, curve, exact=exact, sure=sure, jobs=jobs, progress=progress,
        )  # fmt: skip
    draw = partial(_draw, result, kind)
    shown = Shown(result, file, SECTIONS, out or [], report, units_row, draw=draw, show=partial(_show, result))
    shown.write()
    findings = findings_of(result)
    if write is not None:
        lost = _write_model(mechanism, result, file, write, force, bool(exit_status(findings)))
        findings += lost
        shown.written += [] if lost else [write]
    shown.end(_named(findings, mechanism))


def _criterion(stated: Criterion | None, target: float | None) -> Criterion:
    """What is to keep the limits; MechanismError for a yield beside another criterion."""
    if target is not None and stated not in (None, Criterion.YIELD):
        what = f"the criterion {stated} does not use a yield of {target:g}"
        raise MechanismError(Finding(what, "--yield", f"remove --yield, or remove --criterion {stated}"))
    return Criterion.YIELD if target is not None else stated or Criterion.WORST_CASE


def _write_model(
    mechanism: Mechanism, result: xr.Dataset, file: Path, write: Path, force: bool, failed: bool
) -> list[Finding]:
    """Write the model with what was found, or say why it is not written."""
    from trunnion.model.rewrite import rewrite_mechanism

    if result.attrs["found"] and not failed:
        rewrite_mechanism(_bought(mechanism, result), file, write, force)
        return []
    why = "the tolerances found do not meet the limits" if result.attrs["found"] else "there is no allocation"
    return [Finding(f"'{write}' is not written: {why}", "--write", "", Severity.ERROR)]


def _bought(mechanism: Mechanism, result: xr.Dataset) -> Mechanism:
    """The mechanism with what was found: options as they are, all others rounded down, so that the limits hold."""
    from trunnion.studies.allocation.allocate import half_widths

    found = half_widths(result)
    made = dict(zip(result["parameter"].values.tolist(), result["choice"].values.tolist(), strict=True))
    options = {path: t for path, t in found.items() if made[path]}
    others = {path: t for path, t in found.items() if not made[path]}
    return mechanism.with_tolerances(options).with_tolerances(others, WRITTEN)


def _draw(result: xr.Dataset, kind: str | None, _: Path) -> Any:
    """The figure; none where there is no allocation."""
    from trunnion.views.shown import figure_of

    return figure_of(result, kind) if result.attrs["found"] else None


def _show(result: xr.Dataset) -> None:
    from trunnion.views.allocation import tables

    name, shown = str(result.attrs.get("name", "")), tables(result)
    show_tables(name, shown)
    if not shown:
        console().print(f"{name}\nno allocation meets the limits".lstrip(), markup=False, highlight=False)


def _named(findings: list[Finding], mechanism: Mechanism) -> list[Finding]:
    """Findings about costs by the names that the file has for them."""
    from dataclasses import replace

    from trunnion.model.tolerances import cost_paths

    known = {f"costs.{path}": f"costs.{name}" for name in mechanism.costs for path in cost_paths(mechanism, name)}
    return [replace(one, where=known.get(one.where, one.where)) for one in findings]

"""`trunnion assemble`: whether the stated clearances take up the errors, and the smallest clearance that would."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from trunnion.cli.model import exit_status, lines_of, placed, stated
from trunnion.cli.terminal import bar, say, show_figures, wrote
from trunnion.results.attributes import findings_of, summary_of

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["assemble"]

IMAGES = (".png", ".svg", ".pdf")


class Uniform(StrEnum):
    """What has one and the same clearance where the smallest is looked for."""

    PINS = "pins"
    ALL = "all"


def assemble(
    file: Annotated[Path, typer.Argument(help="Model file: YAML, JSON or TOML.", show_default=False)],
    steps: Annotated[int, typer.Option("--steps", help="Equally spaced positions over the turn or range.")] = 72,
    set_: Annotated[
        list[str] | None, typer.Option("--set", help="Replace a value: B.misalignment.tilt=0.2deg. Repeatable.")
    ] = None,
    uniform: Annotated[
        Uniform, typer.Option("--uniform", help="What shares the smallest clearance: pins, or all kinds of play.")
    ] = Uniform.PINS,
    out: Annotated[
        list[Path] | None,
        typer.Option("--out", help="Write it: .csv .json .nc .zarr .parquet, or a figure: .png .svg .pdf. Repeatable."),
    ] = None,
    units_row: Annotated[bool, typer.Option("--units-row", help="Second CSV header row with the units.")] = False,
) -> None:
    """Whether it goes together with axes out of line: needed share of the clearances, smallest clearance."""
    from trunnion.results.export import check_format, save
    from trunnion.studies.assembly.study import assemble as run

    drawn = [path for path in out or [] if path.suffix.lower() in IMAGES]
    for path in out or []:
        if path not in drawn:
            check_format(path, IMAGES)
    mechanism = stated(file, set_)
    with lines_of(file), bar("positions", steps, least=1000) as progress:
        result = run(mechanism, steps, uniform.value, progress)
    for path in out or []:
        if path in drawn:
            _draw(result, path)
        else:
            save(result, path, units_row)
    show_figures(f"{result.attrs['name'] or file}\n{result.attrs['formula']}", summary_of(result))
    findings = findings_of(result)
    say(placed(findings, file, ["assembly"]))
    for path in out or []:
        wrote(path)
    raise typer.Exit(exit_status(findings))


def _draw(result: xr.Dataset, path: Path) -> None:
    from trunnion.views.assembly.figure import figure
    from trunnion.views.cycle.plots import save

    save(figure(result), path)

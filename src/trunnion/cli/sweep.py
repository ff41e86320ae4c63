"""`trunnion sweep`: figures of the cycle over a grid of numbers of the model, as tables, files, curves and maps."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from trunnion.cli.model import lines_of, stated
from trunnion.cli.options import (
    IMAGES,
    Engine,
    File,
    FrictionLaw,
    Out,
    Report,
    Seats,
    Set,
    Steps,
    TableFile,
    TableUnits,
    Uncut,
    Units,
    UnitsRow,
    over,
    points,
)
from trunnion.cli.result import Shown, check_page, show_tables
from trunnion.cli.terminal import bar, console
from trunnion.errors import Finding, MechanismError, counted
from trunnion.files import folder

if TYPE_CHECKING:
    import xarray as xr

    from trunnion.model.mechanism import Mechanism

__all__ = ["sweep"]

Over = Annotated[
    list[str],
    typer.Option("--over", help="NAME=FROM:TO:COUNT or NAME=VALUE,VALUE,…: misalignment=0deg:30deg:16. Repeatable."),
]
Drawn = Annotated[
    list[str] | None,
    typer.Option(
        "--measure",
        help="Result to show, by its name in the CSV file: A.effort_max, or a measure of the model. Repeatable.",
    ),
]
Along = Annotated[
    str | None,
    typer.Option("--x", help="The swept value on the x axis and in the rows of the table; default: the first."),
]
Family = Annotated[
    str | None,
    typer.Option(
        "--family", help="The swept value with one curve each, or on the y axis of a map; default: the second."
    ),
]
Kind = Annotated[str, typer.Option("--kind", help="curves, or map: contours over two swept values.")]
Margin = Annotated[bool, typer.Option("--margin", help="Compute the locking margin too; takes many times as long.")]
Picture = Annotated[str, typer.Option("--format", help="png, svg, pdf or jpg, for a folder of figures.")]


def sweep(
    file: File,
    over_: Over,
    measure: Drawn = None,
    x: Along = None,
    family: Family = None,
    kind: Kind = "curves",
    margin: Margin = False,
    steps: Steps = 360,
    set_: Set = None,
    table: TableFile = None,
    friction: FrictionLaw = None,
    seat: Seats = None,
    out: Out = None,
    report: Report = None,
    image: Picture = "png",
    units_row: UnitsRow = False,
    units: Units = TableUnits.si,
    uncut: Uncut = False,
    engine: Engine = "auto",
) -> None:
    """Results over a range of model values: tables, curves, maps.

    Efficiency, drive effort, reactions, friction, locking margin and measures of the model.
    """
    from trunnion.studies.sweep.study import sweep as run
    from trunnion.views.scales import check_measure

    grid = over(over_)
    measures = list(dict.fromkeys(measure or ["efficiency"]))
    _check_figures(grid, x or "", family or "", kind)
    files = _files(out or [], measures, image)
    check_page(report, "--report")
    mechanism = stated(file, set_, table, friction, seat, {name: values[0] for name, values in grid.items()})
    own = check_measure(measures, mechanism)
    with lines_of(file), bar("points", points(grid)) as progress:
        margin = margin or "locking_margin" in measures
        result = run(
            mechanism, grid, steps, progress=progress, margin=margin, measures=own,
            engine=engine,  # type: ignore[arg-type]  # it checks it
        )  # fmt: skip
    folders = {path.parent for path in files if path not in (out or [])}
    for one in sorted(folders):
        folder(one)

    def draw(path: Path) -> Any:
        from trunnion.views.common.peaks import whole_peaks
        from trunnion.views.sweep import figure

        return figure(whole_peaks(result, uncut), files[path], x or "", family or "", kind)

    def page() -> str:
        from trunnion.views.common.peaks import whole_peaks
        from trunnion.views.sweep import report as html

        return html(whole_peaks(result, uncut), measures, x or "", family or "", kind)

    show = partial(_show, result, mechanism, file, measures, x or "", family or "")
    Shown(
        result, file, ["assembly"], list(files), report, units_row,
        draw=draw, page=page, show=show, units=units,
    ).finish()  # fmt: skip


def _check_figures(grid: Mapping[str, Any], x: str, family: str, kind: str) -> None:
    """MechanismError for figures that cannot be drawn of a grid, before anything is computed."""
    from trunnion.views.charts import check_kind
    from trunnion.views.scales import KINDS, check_axes

    check_kind(kind, KINDS)
    counts = {name: points({name: values}) for name, values in grid.items()}
    check_axes(counts, x, family)
    if kind == "map" and sum(count > 1 for count in counts.values()) < 2:
        what = "a map needs two names that vary"
        raise MechanismError(Finding(what, "--kind", "give --over twice, with several values each, or draw curves"))


def _files(out: Sequence[Path], measures: Sequence[str], image: str) -> dict[Path, str]:
    """Every file to write, with the measure that it draws, "" for the numbers; a path without extension is a folder.

    MechanismError for what cannot be written.
    """
    from trunnion.results.export import FORMATS, check_format

    found: dict[Path, str] = {}
    for path in out:
        kind = path.suffix.lower()
        if kind in IMAGES and len(measures) > 1:
            what = f"{len(measures)} figures do not fit one file"
            remedy = f"--out {path.with_suffix('')} makes a folder with one of each; or give one --measure"
            raise MechanismError(Finding(what, str(path), remedy))
        if kind in IMAGES:
            found[path] = measures[0]
        elif kind in FORMATS or (kind and not path.is_dir()):
            check_format(path, IMAGES)
            found[path] = ""
        else:
            from trunnion.views.cycle.plots import check_figure  # with matplotlib

            names = [f"{_plain(name)}.{image.lower().lstrip('.')}" for name in measures]
            check_figure(path / names[0])
            found |= {path / name: one for name, one in zip(names, measures, strict=True)}
    return found


def _plain(name: str) -> str:
    """A measure as the name of a file: signs that some file systems refuse are replaced."""
    return "".join("_" if sign in '/\\:*?"<>| ' else sign for sign in name)


def _show(result: xr.Dataset, mechanism: Mechanism, file: Path, measures: Sequence[str], x: str, family: str) -> None:
    """The tables, and how many points they leave out."""
    from trunnion.views.sweep import tables

    shown = tables(result, measures, x, family, console().width)
    show_tables(mechanism.name or str(file), shown, apart=False)
    left_out = sum(one.left_out for one in shown) // (len(measures) if len(shown) > 1 else 1)
    if left_out:
        console().print(f"{counted(left_out, 'point')} more; --out FILE.csv has all", markup=False, highlight=False)

"""Figures of what tolerances do to measures: one kind for several measures, or all kinds there are on one sheet."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, NamedTuple

from trunnion.errors import Finding, MechanismError
from trunnion.views.common.figures import INK, MUTED, WIDTH, new
from trunnion.views.common.lettering import plain
from trunnion.views.tolerance.bars import contributions, rows_of, rows_of_sobol, sobol
from trunnion.views.tolerance.plots import convergence, envelope, histogram
from trunnion.views.tolerance.readings import MeasureReading, readings

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure, FigureBase

__all__ = ["KINDS", "MOST_PANELS", "FigureKind", "check_kind", "drawable", "figure", "sheet"]

MOST_PANELS = 6
PANEL = 3.5  # height, inches
WIDE = 6.6  # of a panel of the sheet
FEW = ("histogram", "contributions", "envelope")  # on a sheet of several measures


class FigureKind(NamedTuple):
    """A kind of figure: its title, what draws it, whether a measure has it, its height, and what to do if not."""

    title: str
    draw: Callable[[FigureBase, MeasureReading], None]
    ready: Callable[[MeasureReading], bool]
    height: Callable[[MeasureReading], float]
    remedy: str


def _bars(rows: int) -> float:
    return max(1.4 + 0.34 * rows, 2.6)


SAMPLES = "add samples: --method monte-carlo"
KINDS: dict[str, FigureKind] = {
    "histogram": FigureKind(
        "Distribution", histogram, lambda read: read.has("histogram"), lambda _: PANEL, SAMPLES
    ),
    "contributions": FigureKind(
        "Contributions", contributions, lambda read: read.has("contribution_rss"),
        lambda read: _bars(rows_of(read)), "add --method linear"
    ),
    "envelope": FigureKind(
        "Envelope over the drive", envelope, lambda read: read.places is not None, lambda _: PANEL + 0.3,
        "use a measure at every position instead of one position",
    ),
    "convergence": FigureKind(
        "Convergence", convergence, lambda read: len(read.row("convergence_samples")) > 1, lambda _: PANEL + 1.0,
        SAMPLES,
    ),
    "sobol": FigureKind(
        "Sobol indices", sobol, lambda read: read.has("total_order"),
        lambda read: _bars(rows_of_sobol(read)), "add --method sobol"
    ),
}  # fmt: skip


def drawable(read: MeasureReading) -> list[str]:
    """The kinds of figures that a measure has something for."""
    return [name for name, kind in KINDS.items() if kind.ready(read)]


def figure(result: xr.Dataset, kind: str, measures: Sequence[str] | None = None) -> Figure:
    """One kind of figure, a panel for each measure, at most MOST_PANELS; all that have it if none is named.

    MechanismError if there is no such kind, none of the measures has it, or they are too many.
    """
    check_kind(kind)
    about = KINDS[kind]
    found = [read for read in _named(result, measures) if about.ready(read)]
    if not found:
        raise MechanismError(Finding(f"no measure has a figure '{kind}'", "--kind", about.remedy))
    check_count(len(found))
    heights = [about.height(read) for read in found]
    drawn = new(about.title if len(found) > 1 else _title(found[0], about), result, 0.55 + sum(heights))
    parts = drawn.subfigures(len(found), 1, squeeze=False, height_ratios=heights)[:, 0]
    for part, read in zip(parts, found, strict=True):
        if len(found) > 1:
            part.suptitle(plain(_named_so(read)), x=0.012, ha="left", fontsize=9.5, color=INK)
        about.draw(part, read)
    return drawn


def _title(read: MeasureReading, about: FigureKind) -> str:
    return f"{about.title}: {read.name}"


def _named_so(read: MeasureReading) -> str:
    return f"{read.name}: {read.text}" if read.text else read.name


def sheet(result: xr.Dataset, measures: Sequence[str] | None = None) -> Figure:
    """All kinds of figures of one measure; of several, at most MOST_PANELS, the main kinds, a row for each measure."""
    found = [(read, drawable(read)) for read in _named(result, measures)]
    found = [(read, kinds) for read, kinds in found if kinds]
    if not found:
        raise MechanismError(Finding("no measure has a figure", remedy="add --method linear"))
    check_count(len(found))
    if len(found) == 1:
        return _alone(result, *found[0])
    columns = [kind for kind in FEW if any(kind in kinds for _, kinds in found)]
    heights = [max(KINDS[kind].height(read) for kind in columns if kind in kinds) + 0.3 for read, kinds in found]
    drawn = new("Effect of the tolerances", result, 0.6 + sum(heights), WIDE * len(columns))
    rows = drawn.subfigures(len(found), 1, squeeze=False, height_ratios=heights)[:, 0]
    for row, (read, kinds) in zip(rows, found, strict=True):
        row.suptitle(plain(_named_so(read)), x=0.006, ha="left", fontsize=10.5, fontweight="bold", color=INK)
        for part, kind in zip(row.subfigures(1, len(columns), squeeze=False)[0], columns, strict=True):
            _part(part, read, kind, kind in kinds)
    return drawn


def _alone(result: xr.Dataset, read: MeasureReading, kinds: list[str]) -> Figure:
    """All kinds of one measure, two in a row."""
    columns = min(len(kinds), 2)
    rows = [kinds[k : k + columns] for k in range(0, len(kinds), columns)]
    heights = [max(KINDS[kind].height(read) for kind in row) + 0.25 for row in rows]
    width = WIDTH if columns == 1 else 2 * WIDE
    drawn = new(_named_so(read), result, 0.6 + sum(heights), width)
    parts = drawn.subfigures(len(rows), columns, squeeze=False, height_ratios=heights)
    for line, row in zip(parts, rows, strict=True):
        for part, kind in zip(line, row, strict=False):
            _part(part, read, kind, there=True)
    return drawn


def _part(part: FigureBase, read: MeasureReading, kind: str, there: bool) -> None:
    """One figure of a sheet under its title; nothing where the measure lacks it."""
    if there:
        part.suptitle(KINDS[kind].title, x=0.012, ha="left", fontsize=9.5, color=MUTED)
        KINDS[kind].draw(part, read)


def check_kind(kind: str) -> None:
    """MechanismError if there is no such kind of figure."""
    if kind not in KINDS:
        raise MechanismError(Finding(f"there is no figure '{kind}'", "--kind", f"use one of {', '.join(KINDS)}"))


def check_count(count: int) -> None:
    """MechanismError if so many measures do not fit one figure."""
    if count > MOST_PANELS:
        what = f"{count} measures do not fit one figure"
        raise MechanismError(Finding(what, "--out", f"name at most {MOST_PANELS} by --measure"))


def _named(result: xr.Dataset, measures: Sequence[str] | None) -> list[MeasureReading]:
    return [read for read in readings(result) if measures is None or read.name in measures]

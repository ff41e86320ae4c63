"""Charts as data: what is drawn, in the units in which it is shown, whatever draws it (`draw` by matplotlib).

A chart has two axes and marks, drawn in order. Colours are numbers of the palette or names: ink, muted, shade, limit.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from trunnion.errors import Finding, MechanismError, Status
from trunnion.model.names import nearest
from trunnion.results.quantities import prefixed, quantity
from trunnion.views.axis import Abscissa, Array, abscissa, ease, intervals, peak, usual_peak

if TYPE_CHECKING:
    import xarray as xr

RIPPLE = 0.1  # of the largest value: curves that vary by less are shown without 0
COLOURS, DASHES = 6, ("solid", "long", "short", "dash-dot")  # colours of the palette, then the next dash


@dataclass(frozen=True)
class Look:
    """How a mark looks.

    colour: a number of the palette, a name, "#rrggbb", or a share of the scale of colours; mark: a sign at each point,
    hollow or filled; hatch: of an area; order: what has a larger one lies above; unclipped: also over the frame.
    """

    colour: int | float | str = 0
    width: float = 1.6
    dash: Literal["solid", "long", "dashed", "short", "dotted", "dash-dot", "none"] = "solid"
    mark: str = ""
    size: float = 4.5
    hollow: bool = False
    alpha: float | None = None
    hatch: str = ""
    order: float = 2.0
    unclipped: bool = False

    def but(self, **changes: object) -> Look:
        """The same with something changed."""
        return replace(self, **changes)  # type: ignore[arg-type]  # names of fields


FREE = Look("ink", 0.9, "dashed")  # without friction, among many curves


def nth(index: int) -> Look:
    """Colour and dash of the n-th of several curves; colours repeat with another dash."""
    return Look(index, dash=DASHES[index // COLOURS % len(DASHES)])  # type: ignore[arg-type]  # one of the dashes


# ---- marks ----------------------------------------------------------------------------------------------------------


class Line(NamedTuple):
    """A curve or, without a dash, points; low, high: lengths of the bars of their uncertainty; steps: constant up to
    the next point; close: over a whole turn led on to its first value, of what may gain whole turns to that and as
    many of `turn` as it has gained; shares: places of its points on the scale of colours, from 0 to 1."""

    x: Array
    y: Array
    name: str | None = None
    look: Look = Look()
    low: Array | None = None
    high: Array | None = None
    steps: bool = False
    close: bool = False
    turn: float = 0.0
    shares: Array | None = None

    def times(self, factor: float) -> Line:
        """The line in another unit."""
        low, high = (None if half is None else half * factor for half in (self.low, self.high))
        return self._replace(y=self.y * factor, low=low, high=high, turn=self.turn * factor)


class Band(NamedTuple):
    """An area between two curves; steps: they are constant up to the next point."""

    x: Array
    low: Array
    high: Array
    name: str | None = None
    look: Look = Look()
    close: bool = False
    steps: bool = False


class Bars(NamedTuple):
    """Level bars from 0 at heights `at`."""

    at: Array
    sizes: Array
    thickness: float
    name: str | None = None
    look: Look = Look()


class Rule(NamedTuple):
    """A straight line all across the chart at a value of x (upright) or y; left out where it is out of view."""

    at: float
    name: str | None = None
    look: Look = Look()
    upright: bool = True


class Stripe(NamedTuple):
    """A range of x over the whole height, with a text written upright in it."""

    low: float
    high: float
    text: str = ""
    look: Look = Look("shade", order=0.5)
    name: str | None = None


class Arrow(NamedTuple):
    """An arrow between two places in the units of the axes."""

    start: tuple[float, float]
    end: tuple[float, float]
    look: Look = Look("ink", 1.5)


class Ring(NamedTuple):
    """A circle, or a square about its middle, in a frame of equal scales; filled as pale as `alpha` says."""

    middle: tuple[float, float]
    radius: float
    look: Look = Look("ink", 1.2)
    square: bool = False
    filled: float = 0.0


class Note(NamedTuple):
    """A text at a place in shares of the frame or, data, in the units of the axes; shift: from there, in points.

    beside: it is put where it hides nothing, as near to its place as there is room.
    """

    text: str
    x: float
    y: float
    across: Literal["left", "center", "right"] = "center"
    up: Literal["bottom", "center", "top"] = "center"
    data: bool = False
    colour: str = "muted"
    size: float = 8.0
    shift: tuple[float, float] = (0.0, 0.0)
    boxed: bool = False
    beside: bool = False


class ColourScale(NamedTuple):
    """What the colours of a chart mean: a number from low to high, in bands between `levels` if there are any."""

    title: str
    low: float
    high: float
    log: bool = False
    levels: Sequence[float] = ()

    def share(self, value: float) -> float:
        """The place of a value on the scale, from 0 to 1."""
        if self.low == self.high:
            return 0.5
        low, high, at = (math.log(v) if self.log else v for v in (self.low, self.high, value))
        return (at - low) / (high - low)


class Contours(NamedTuple):
    """Bands of a number over a grid, (x, y), not drawn across points without it; the surroundings of those, which end
    at the edges, are hatched: gaps are (name, hatch, (x, y)) of each cause."""

    x: Array
    y: Array
    values: Array
    x_edges: Array
    y_edges: Array
    colours: ColourScale
    gaps: Sequence[tuple[str, str, NDArray[np.bool_]]] = ()


Mark = Line | Band | Bars | Rule | Stripe | Arrow | Ring | Note | Contours


# ---- charts ---------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Axis:
    """An axis of a chart.

    limits: its ends, None where the marks decide; margin: around the marks, as a share; places: where it is marked,
    with names, which may be turned by so many degrees; angles: marked at parts of a turn; count: of its marks.
    """

    title: str = ""
    limits: tuple[float | None, float | None] = (None, None)
    places: Sequence[tuple[float, str]] | None = None
    log: bool = False
    angles: bool = False
    count: int = 0
    turned: float = 0.0
    margin: float | None = None


class Legend(NamedTuple):
    """A legend above the chart: fewest entries, and the characters that a row has room for."""

    least: int = 2
    room: int = 90


@dataclass(frozen=True)
class Chart:
    """Marks between two axes. over: the drive along x, instead of an axis; zero: with a line at y = 0; equal: both of
    one scale, in a square; legend: None for none; title: above at the left, aside: above at the right; bare: without a
    line and marks at the left."""

    x: Axis | Abscissa
    y: Axis
    marks: Sequence[Mark]
    zero: bool = False
    legend: Legend | None = Legend()  # noqa: RUF009  # immutable
    title: str = ""
    aside: str = ""
    bare: bool = False
    equal: bool = False


@dataclass(frozen=True)
class Panel:
    """Charts below one another along one x, under a title; height in inches, parts: shares of the charts in it."""

    title: str
    charts: Sequence[Chart]
    height: float = 3.5
    parts: Sequence[float] = ()


@dataclass(frozen=True)
class Plot:
    """A figure: panels in rows of so many columns under a title.

    width: in inches, 0 as the columns ask for; note: of what is not drawn, beneath; shared: the panels, of one chart
    each, have common axes and one legend at the right; colours: what the colours of all charts mean.
    """

    title: str
    panels: Sequence[Panel]
    columns: int = 1
    width: float = 0.0
    note: str = ""
    shared: bool = False
    colours: ColourScale | None = None


def check_kind(kind: str, kinds: Iterable[str]) -> None:
    """MechanismError if there is no such kind of figure."""
    if kind not in kinds:
        hint = nearest(kind, kinds)
        remedy = hint if hint.startswith("did") else f"use one of {', '.join(kinds)}"
        raise MechanismError(Finding(f"there is no figure '{kind}'", "--kind", remedy))


# ---- curves over the drive ------------------------------------------------------------------------------------------


def outside(most: float, unit: str) -> Note:
    """What stands in a chart whose peak is cut off."""
    text = f"peak {quantity(most, unit)} is outside the frame,\nnear a dead centre; --uncut shows it"
    return Note(text, 0.99, 0.97, "right", "top", boxed=True)


def over_drive(
    result: xr.Dataset, title: str, unit: str, curves: Sequence[Line] | Mapping[str, Array], *,
    bands: Sequence[Band] = (), marks: Sequence[Mark] = (), rate: str = "", scale: tuple[float, str] | None = None,
    **chart: Any,
) -> Chart:  # fmt: skip
    """Curves of one unit over the drive, in the unit in which they read best.

    Where positions next to a dead centre tower over all others, the axis ends at what is usual; where all curves stay
    near one value far from 0, it shows how they vary.

    Parameters
    ----------
    result : whose positions without an answer are shaded
    title : of the axis, without the unit
    curves : in SI; values by their names get the colours of their order
    bands : in SI
    marks : beside, in the unit of the chart
    rate : what follows the unit, as "/s"
    scale : factor and unit, instead of those that fit
    chart : more of the chart
    """
    over = abscissa(result)
    lines = [Line(over.values, values, name, nth(k), close=True) for k, (name, values) in enumerate(curves.items())] \
        if isinstance(curves, Mapping) else curves  # fmt: skip
    rows = [*(line.y for line in lines), *(edge for band in bands for edge in (band.low, band.high))]
    usual, most = usual_peak(ease(result), *rows), peak(*rows)
    factor, label = scale or prefixed(usual, unit)
    values = np.concatenate([row.ravel() for row in rows]) * factor if rows else np.empty(0)
    values = values[np.isfinite(values)]
    low, high = float(values.min(initial=0.0)), float(values.max(initial=0.0))
    varies = float(np.ptp(values)) if values.size else 0.0
    y, zero, cut = Axis(f"{title} [{label}{rate}]" if label else title), True, list[Mark]()
    if usual < most:
        y = replace(y, limits=(1.05 * max(low, -usual * factor), 1.05 * min(high, usual * factor)))
        cut.append(outside(most, unit + rate))
    elif 1e-9 * most * factor < varies < RIPPLE * most * factor:
        y, zero = replace(y, margin=0.1, count=5), False
    areas = [band._replace(low=band.low * factor, high=band.high * factor) for band in bands]
    drawn = [line.times(factor) for line in lines]
    return Chart(over, y, [*silent(result, over), *areas, *drawn, *marks, *cut], zero, **chart)


def silent(result: xr.Dataset, over: Abscissa, written: bool = True) -> list[Mark]:
    """Stripes where positions have no answer, each cause written once; hatched where a pin loses contact."""
    x, half, marks, causes = over.values, over.half_step, list[Mark](), set[str]()
    lost = [run for run in intervals(result, Status.CONTACT_LOST) if run.status == Status.CONTACT_LOST]
    for run in [*lost, *intervals(result)]:
        low, high = sorted((float(x[run.start]), float(x[run.stop - 1])))
        hatched = run in lost
        text = "not valid" if hatched else run.text.split(":")[0]
        look = Look("shade", hatch="////" if hatched else "", order=0.5)
        marks.append(Stripe(low - half, high + half, text if written and text not in causes else "", look))
        causes.add(text)
        if not hatched:
            marks += [Rule(end, None, Look("muted", 0.6, "short", order=0.6)) for end in (low - half, high + half)]
    return marks

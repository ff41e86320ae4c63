"""Charts as data: what is drawn, in the units in which it is shown, whatever draws it (`draw` by matplotlib).

A chart has two axes and marks, drawn in order. Colours are numbers of the palette or names: ink, muted, shade, limit.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from trunnion.errors import Status
from trunnion.results.quantities import quantity
from trunnion.views.common.cycle import Abscissa, intervals

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["Axis", "Band", "Bars", "Cells", "Chart", "ColourScale", "Legend", "Line", "Look", "Mark", "Note", "Panel",
           "Rule", "Stairs", "Stripe", "outside", "silent"]  # fmt: skip

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Look:
    """How a mark looks.

    colour: a number of the palette, a name, "#rrggbb", or a share of the scale of colours; mark: a sign at each point,
    hollow or filled; hatch: of an area; order: what has a larger one lies above; unclipped: also over the frame.
    """

    colour: int | float | str = 0
    width: float = 1.6
    dash: Literal["solid", "long", "dashed", "short", "dotted", "none"] = "solid"
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


class Line(NamedTuple):
    """A curve or, without a dash, points; low, high: lengths of the bars of their uncertainty; steps: constant up to
    the next point; close: over a whole turn led on to its first value."""

    x: Array
    y: Array
    name: str | None = None
    look: Look = Look()
    low: Array | None = None
    high: Array | None = None
    steps: bool = False
    close: bool = False


class Band(NamedTuple):
    """An area between two curves."""

    x: Array
    low: Array
    high: Array
    name: str | None = None
    look: Look = Look()
    close: bool = False


class Stairs(NamedTuple):
    """Counts between edges; window: the range of x in which they are seen."""

    counts: Array
    edges: Array
    name: str | None = None
    look: Look = Look()
    window: tuple[float, float] | None = None


class Bars(NamedTuple):
    """Level bars from 0 at heights `at`; low, high: lengths of the bars of their uncertainty."""

    at: Array
    sizes: Array
    thickness: float
    name: str | None = None
    look: Look = Look()
    low: Array | None = None
    high: Array | None = None


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


class Note(NamedTuple):
    """A text at a place in shares of the frame or, data, in the units of the axes; shift: from there, in points."""

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


class Cells(NamedTuple):
    """A matrix of coloured cells from −1 to 1 with their numbers, the names along both sides."""

    values: Array
    names: list[str]
    written: bool


def outside(peak: float, unit: str) -> Note:
    """What stands in a chart whose peak is cut off."""
    text = f"peak {quantity(peak, unit)} is outside the frame,\nnear a dead centre; --uncut shows it"
    return Note(text, 0.99, 0.97, "right", "top", boxed=True)


Mark = Line | Band | Stairs | Bars | Rule | Stripe | Note | Cells


@dataclass(frozen=True)
class Axis:
    """An axis of a chart.

    limits: its ends, None where the marks decide; margin: around the marks, as a share; places: where it is marked,
    with names, which may be turned by so many degrees; integer: marked at whole numbers only; count: of its marks;
    form: how a number is written; powers: very large and small numbers by a common power of ten.
    """

    title: str = ""
    limits: tuple[float | None, float | None] = (None, None)
    places: Sequence[tuple[float, str]] | None = None
    log: bool = False
    integer: bool = False
    count: int = 0
    form: Callable[[float], str] | None = None
    turned: float = 0.0
    margin: float | None = None
    powers: bool = False


class Legend(NamedTuple):
    """A legend above the chart: entries in a row, characters that a row has room for, fewest entries."""

    most: int = 6
    room: int = 90
    least: int = 2


LEGEND = Legend()


class ColourScale(NamedTuple):
    """What the colours of a chart mean: a number from low to high."""

    title: str
    low: float
    high: float
    log: bool = False

    def share(self, value: float) -> float:
        """The place of a value on the scale, from 0 to 1."""
        if self.low == self.high:
            return 0.5
        low, high, at = (math.log(v) if self.log else v for v in (self.low, self.high, value))
        return (at - low) / (high - low)


@dataclass(frozen=True)
class Chart:
    """Marks between two axes. over: the drive along x, instead of an axis; zero: with a line at y = 0; legend: None for
    none; title: above at the left, aside: above at the right."""

    x: Axis | Abscissa
    y: Axis
    marks: Sequence[Mark]
    zero: bool = False
    legend: Legend | None = LEGEND
    title: str = ""
    aside: str = ""
    colours: ColourScale | None = None
    bare: bool = False  # without a line and marks at the left


@dataclass(frozen=True)
class Panel:
    """Charts below one another along one x, under a title; height in inches, parts: shares of the charts in it."""

    title: str
    charts: Sequence[Chart]
    height: float = 3.5
    parts: Sequence[float] = field(default=())


def silent(result: xr.Dataset, over: Abscissa, written: bool = True) -> list[Mark]:
    """Stripes where positions have no answer, with each cause once; hatched where a pin loses contact.

    Parameters
    ----------
    result : of one cycle
    over : what it is drawn over
    written : whether the causes are written
    """
    x, marks, causes = over.values, list[Mark](), set[str]()
    half = abs(float(x[1] - x[0])) / 2 if x.size > 1 else 0.5
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

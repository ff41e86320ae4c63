"""Charts as data: what is drawn, in the units in which it is shown, whatever draws it (`draw` by matplotlib).

A chart has two axes and marks, drawn in order. Colours are numbers of the palette or names: ink, muted, shade, limit.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from trunnion.views.axis import Abscissa, Array


class Look(NamedTuple):
    """How a mark looks.

    colour: a number of the palette, a name, "#rrggbb", or a share of the scale of colours; mark: a sign at each point,
    hollow or filled; hatch: of an area; order: what has a larger one lies above.
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


# ---- marks ----------------------------------------------------------------------------------------------------------


class Line(NamedTuple):
    """A curve or, without a dash, points.

    low, high: lengths of the bars of their uncertainty; steps: constant up to the next point; close: over a whole turn
    led on to its first value, of what may gain whole turns to that and as many of `turn` as it has gained; arrow: with
    a head at its end.
    """

    x: Array
    y: Array
    name: str | None = None
    look: Look = Look()
    low: Array | None = None
    high: Array | None = None
    steps: bool = False
    close: bool = False
    turn: float = 0.0
    arrow: bool = False

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


class Ring(NamedTuple):
    """A circle, or a square about its middle, in a frame of equal scales; filled as pale as `alpha` says."""

    middle: tuple[float, float]
    radius: float
    look: Look = Look("ink", 1.2)
    square: bool = False
    filled: float = 0.0


class Note(NamedTuple):
    """A text at a place in shares of the frame or, data, in the units of the axes; shift: from there, in points.

    outwards: beside its place, on the side away from the origin.
    """

    text: str
    x: float
    y: float
    across: Literal["left", "center", "right"] = "center"
    up: Literal["bottom", "center", "top"] = "center"
    data: bool = False
    colour: str | int = "muted"
    size: float = 8.0
    shift: tuple[float, float] = (0.0, 0.0)
    boxed: bool = False
    outwards: bool = False


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


Mark = Line | Band | Bars | Rule | Stripe | Ring | Note | Contours


# ---- charts ---------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Axis:
    """An axis of a chart.

    limits: its ends, None where the marks decide; margin: around the marks, as a share; places: where it is marked,
    with names; count: of its marks.
    """

    title: str = ""
    limits: tuple[float | None, float | None] = (None, None)
    places: Sequence[tuple[float, str]] | None = None
    log: bool = False
    count: int = 0
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

    width: in inches, 0 as the columns ask for; shared: the panels, of one chart each, have common axes and one legend
    at the right; colours: what the colours of all charts mean.
    """

    title: str
    panels: Sequence[Panel]
    columns: int = 1
    width: float = 0.0
    shared: bool = False
    colours: ColourScale | None = None

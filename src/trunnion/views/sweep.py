"""Views of a sweep: figures of the cycle over swept names, as tables, families of curves, maps, and a page.

Tables are of figures over one name, or of one figure over two, a table for each value of further names; long ones are
thinned evenly, their ends included. Names beyond two are the panels of a figure, names with one value are in its title.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise, product
from math import prod
from textwrap import fill
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from trunnion.errors import Finding, MechanismError, Status
from trunnion.results.attributes import attribute
from trunnion.results.quantities import prefixed
from trunnion.results.scales import without_noise
from trunnion.results.tables.studies import swept as figures_of
from trunnion.solve.friction_method import MARGIN
from trunnion.views.charts import Axis, Chart, ColourScale, Contours, Line, Look, Mark, Stripe, check_kind, outside
from trunnion.views.common.cycle import Array
from trunnion.views.common.peaks import ease_of_status, usual_peak
from trunnion.views.page import Section, Table, counts, page
from trunnion.views.readings import ending
from trunnion.views.scales import (
    KINDS,
    Arrangement,
    Scale,
    arrange,
    axis_of,
    cause,
    edges,
    grid,
    meaning,
    on_scale,
    statuses,
    thinned,
)  # fmt: skip

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

__all__ = ["KINDS", "figure", "report", "tables"]


# ---- tables -------------------------------------------------------------------------------------------------------

MOST_ROWS, MOST_COLUMNS = 40, 8  # of a table
LEAST_ROWS, LEAST_COLUMNS, MOST_TABLES = 6, 3, 6
BESIDE = "friction_power_mean", "locking_margin"  # in the table beside the measure, if the sweep has them
MILDER = {int(Status.NEAR_SINGULAR): "near singular", int(Status.CONTACT_LOST): "contact lost"}


def tables(
    result: xr.Dataset, measures: Sequence[str] = ("efficiency",), x: str = "", family: str = "", room: int = 1000
) -> list[Table]:
    """One table of several figures over a single name; of more names one for each measure and value of the facets.

    room: characters in a line, which limit how many columns of a long table are shown.
    """
    result = without_noise(result)
    plan = arrange(result, x, family)
    if plan.other is None:
        return [_list(result, measures, plan)]
    return [table for measure in measures for table in _matrices(result, measure, plan, plan.other, room)]


def _list(result: xr.Dataset, measures: Sequence[str], plan: Arrangement) -> Table:
    """Several figures over one name."""
    every = figures_of(result)
    columns, heads = [], []
    for name in dict.fromkeys([*measures, "efficiency", "efficiency_ideal", *_efforts(every), *BESIDE]):
        if name in every or name in measures:
            head, values = _column(result, plan, name)
            columns.append(values[:, 0])
            heads.append(head)
    status = [int(code) for code in statuses(result, plan)[:, 0]]
    words = [cause(code) if code >= Status.NOT_CONVERGED else MILDER.get(code, "") for code in status]
    picked = thinned(len(plan.x.values), MOST_ROWS)
    figures = list(zip(columns, heads, strict=True))
    rows = [
        [_number(plan.x.values[i]), *(_number(column[i], head) for column, head in figures), words[i]] for i in picked
    ]
    title = f"{', '.join(name.replace('_', ' ') for name in measures)} over {plan.x.name}"
    table = Table(_titled(title, plan.at()), [plan.x.title, *heads, "status"], rows, len(words) - len(picked))
    return table if any(words) else replace(table, head=table.head[:-1], rows=[row[:-1] for row in rows])


def _column(result: xr.Dataset, plan: Arrangement, name: str) -> tuple[str, Array]:
    """Head and numbers of a figure: lengths in mm, angles in degrees."""
    unit, values = grid(result, plan, name)
    factor, display_unit = {"m": (1e3, "mm"), "rad": (180 / np.pi, "deg")}.get(unit, (1.0, unit))
    return name.replace("_", " ") + (f" [{display_unit}]" if display_unit not in ("", "1") else ""), factor * values


def _efforts(every: dict[str, tuple[str, Any]]) -> list[str]:
    """The ends of every driver's effort that lie beyond 0 at any point: both where its sign changes."""
    picked = []
    for driver in (name.removesuffix(".effort_max") for name in every if name.endswith(".effort_max")):
        ends_of = {f"{driver}.effort_min": -1.0, f"{driver}.effort_max": 1.0}
        reached = [name for name, sign in ends_of.items() if np.nanmax(sign * every[name][1], initial=0.0) > 0]
        picked += reached or [f"{driver}.effort_max"]
    return picked


def _matrices(result: xr.Dataset, measure: str, plan: Arrangement, other: Scale, room: int) -> list[Table]:
    """A table for each combination of the facets' values; of many of them some."""
    (name, values), status = _column(result, plan, measure), statuses(result, plan)
    places = list(product(*(range(len(scale.values)) for scale in plan.facets)))
    picked = [places[i] for i in thinned(len(places), MOST_TABLES)]
    most = max(LEAST_ROWS, MOST_ROWS // len(picked))
    matrices = []
    for place in picked:
        at = [scale.equation(i) for scale, i in zip(plan.facets, place, strict=True)] + [plan.at()] * bool(plan.fixed)
        title = _titled(f"{name} over {plan.x.name} and, in columns, {other.name}", ", ".join(at))
        index: Any = (slice(None), slice(None), *place)
        matrices.append(_matrix(title, plan.x, other, values[index], status[index], most, room))
    hidden = (len(places) - len(picked)) * plan.x.values.size * other.values.size
    matrices[-1] = replace(matrices[-1], left_out=matrices[-1].left_out + hidden)
    return matrices


def _matrix(title: str, x: Scale, other: Scale, values: Array, status: NDArray[np.int8], most: int, room: int) -> Table:
    """One figure over two names: at most so many rows, and columns that fit the room."""
    down = thinned(values.shape[0], most)
    columns = [[x.title, *(_number(x.values[i]) for i in down)]]
    for k in range(values.shape[1]):
        causes = [cause(code) if code >= Status.NOT_CONVERGED else "" for code in status[down, k].tolist()]
        cells = [_number(value, title) or why for value, why in zip(values[down, k].tolist(), causes, strict=True)]
        columns.append([other.say(k), *cells])
    # the words of a cause may stand below each other
    widths = [3 + max(len(column[0]), *(len(w) for cell in column for w in cell.split())) for column in columns]
    across = thinned(values.shape[1], MOST_COLUMNS)
    while len(across) > LEAST_COLUMNS and widths[0] + sum(widths[k + 1] for k in across) > room:
        across = thinned(values.shape[1], len(across) - 1)
    head, *rows = ([columns[0][i], *(columns[k + 1][i] for k in across)] for i in range(len(down) + 1))
    return Table(title, head, rows, values.size - len(down) * len(across))


def _titled(title: str, at: str) -> str:
    return f"{title}, at {at}" if at else title


def _number(value: float, head: str = "") -> str:
    """Empty for what is not known; of a locking margin, which alone has no end and no unit, as far as it is looked for.

    head: of its column, with the unit; the effort of a mechanism that locks is ∞.
    """
    if np.isnan(value):
        return ""
    if value == np.inf and "[" not in head:
        return f"> {MARGIN:g}"
    return f"{value + 0.0:.6g}".replace("inf", "∞")  # + 0.0: no negative zero


# ---- figures ------------------------------------------------------------------------------------------------------

WIDE = 74  # characters of a title in a line
MOST_PANELS = 12
MOST_NAMED = 8  # curves that are told apart by a legend; more by a scale of colours
MARKS, MOST_MARKED = "os^DvPX*", 40  # points of a curve, so that curves are told apart in grey, too
BANDS = 10  # of a map
ALIKE = 1e-9  # of the largest: numbers that differ by less are taken as one
NOTHING = -1  # beside the statuses: sound, and yet without a number
HATCHES = {
    NOTHING: "oo", int(Status.NOT_CONVERGED): "...", int(Status.LOCKED): "////", int(Status.LOAD_UNDEFINED): "||||",
    int(Status.SINGULAR): "----", int(Status.NOT_ASSEMBLED): "xxx",
}  # fmt: skip


def figure(
    result: xr.Dataset, measure: str = "efficiency", x: str = "", family: str = "", kind: str = "curves"
) -> Figure:
    """A number of the cycle over swept names, a panel for each value of further names.

    Parameters
    ----------
    result : of a sweep
    measure : the number, by its column in the CSV file
    x, family : the name along the axis and that of the curves, or upwards in a map; the first two that vary if not
        given
    kind : of KINDS. Where there is no answer it is grey or hatched, with the cause; the curves of a mechanism with
        errors stand beside those of the ideal one, if the sweep has them

    Raises
    ------
    MechanismError : for names that are not swept, and for a map of fewer than two names that vary
    """
    from trunnion.views.draw import grid as draw

    check_kind(kind, KINDS)
    result = without_noise(result)
    plan = arrange(result, x, family)
    if kind == "map" and any(scale is None or np.unique(scale.values).size < 2 for scale in (plan.x, plan.other)):
        remedy = "sweep over two names with several values each, or draw curves"
        raise MechanismError(Finding("a map needs two names that vary", "--kind map", remedy))
    unit, values = grid(result, plan, measure)
    ideal = grid(result, plan, f"{measure}_ideal")[1] if f"{measure}_ideal" in result else None
    status, nothing = statuses(result, plan), "∞" if np.isinf(values).any() else "no value"
    values = np.where(np.isfinite(values), values, np.nan)
    scope = usual_peak(ease_of_status(result, status), values, ideal)
    factor, shown = prefixed(scope, unit)
    over = f"{plan.x.name} and {plan.other.name}" if kind == "map" and plan.other else plan.x.name
    noun = meaning(measure, unit)
    label = f"{noun} [{shown}]" if shown else noun
    places = list(product(*(range(len(scale.values)) for scale in plan.facets)))
    picked = [places[k] for k in thinned(len(places), MOST_PANELS)]
    hidden = f" ({len(picked)} of {len(places)} panels)" if len(picked) < len(places) else ""
    title = f"{noun} over {over}{f' at {plan.at()}' if plan.fixed else ''}{hidden}"
    columns = len(picked) if len(picked) <= 3 else 2 if len(picked) == 4 else 3 if len(picked) <= 9 else 4
    field = Field(plan, label, nothing, 78 // columns, scope * factor, (factor, unit))
    make = _map if kind == "map" else _curves
    every, charts = factor * (values if ideal is None else np.append(values, ideal)), []
    for place in picked:
        index: Any = (slice(None), slice(None), *place)
        at = (ending(scale.equation(i), field.room) for scale, i in zip(plan.facets, place, strict=True))
        head = fill(", ".join(text.replace(" ", "\u00a0") for text in at), field.room, break_long_words=False)
        like = None if ideal is None else ideal[index] * factor
        charts.append(make(field, every, values[index] * factor, like, status[index], head))
    colours = _levels(label, every, field.scope) if kind == "map" else _colours(plan.other)
    title = fill(f"{title[:1].upper()}{title[1:]}", WIDE, break_long_words=False)
    return draw(title, result, charts, columns, colours)


class Field(NamedTuple):
    """What all panels share: what runs along what, the number with its unit, what a sound point without one has,
    characters along a panel, the magnitude that is shown, and factor and unit of the number."""

    plan: Arrangement
    label: str
    nothing: str
    room: int
    scope: float
    scale: tuple[float, str]

    def beyond(self, values: Array) -> list[Mark]:
        """What a panel says of its peak, where that is outside the frame."""
        peak = float(np.nanmax(np.abs(values), initial=0.0))
        return [outside(peak / self.scale[0], self.scale[1])] if peak > self.scope * (1 + ALIKE) else []

    def word(self, code: int) -> str:
        """Why a point has no number."""
        return self.nothing if code == NOTHING else cause(code)


def _codes(values: Array, status: NDArray[np.int8]) -> NDArray[np.int8]:
    """Status of the points without an answer, NOTHING of sound ones without a number, 0 of all others."""
    return np.where(status >= Status.NOT_CONVERGED, status, np.where(np.isfinite(values), 0, NOTHING))


def _lost(x: Array, y: Array, size: float) -> list[Mark]:
    """Rings around points at which contact is lost at some position."""
    look = Look("limit", dash="none", mark="o", size=size, hollow=True, order=4, unclipped=True)
    return [Line(x, y, "contact lost at some position", look)] if x.size else []


def _curves(
    field: Field, every: Array, values: Array, ideal: Array | None, status: NDArray[np.int8], head: str
) -> Chart:
    """One curve for each value of the second name; grey where none has an answer, crosses at the ends of gaps.

    every: the numbers of all panels, which have one scale.
    """
    plan, other = field.plan, field.plan.other
    order = np.argsort(plan.x.values, kind="stable")
    x, values, status = plan.x.values[order], values[order], status[order]
    codes, colours, marks = _codes(values, status), _colours(other), list[Mark]()
    gone = np.where((codes == 0).any(axis=1), 0, np.where(codes, codes, NOTHING).max(axis=1))
    bounds, sides = edges(plan.x, x), np.append(np.flatnonzero(np.diff(gone, prepend=99)), len(gone))
    for start, stop in pairwise(sides.tolist()):
        if gone[start]:
            marks.append(Stripe(bounds[start], bounds[stop], field.word(int(gone[start]))))
    for k in range(values.shape[1]):
        look, label = Look(k, mark=MARKS[k % 8] if x.size <= MOST_MARKED else "", size=3.5), None
        if ideal is not None:
            label = "as built"
        if colours is not None and other is not None:
            look, label = Look(colours.share(float(other.values[k])), 1.2, mark="o" * (x.size == 1)), None
        elif other is not None:
            label = other.equation(k)
        y = values[:, k]
        ends = np.isfinite(y) & (np.isnan(np.append(y[:1], y[:-1])) | np.isnan(np.append(y[1:], y[-1:])))
        cross = look.but(dash="none", mark="x", size=7.0, order=4.0)
        marks += [Line(x, y, label, look), *([Line(x[ends], y[ends], None, cross)] if ends.any() else [])]
        if ideal is not None:
            name = None if k else "ideal" if other is None else "ideal, dashed"
            marks.append(Line(x, ideal[order, k], name, Look("ink", 1.0, "long")))
    rows, across = np.nonzero((status == Status.CONTACT_LOST) & np.isfinite(values))
    marks += _lost(x[rows], values[rows, across], 6.0)
    finite = every[np.isfinite(every)]
    low, high = np.clip([finite.min(), finite.max()], -field.scope, field.scope) if finite.size else (0.0, 1.0)
    margin = 0.05 * (high - low) if high - low > ALIKE * field.scope else 0.1 * abs(high) or 1.0
    upward = Axis(fill(field.label, 60 if not head else 32, break_long_words=False), (low - margin, high + margin))
    return Chart(axis_of(plan.x, field.room), upward, [*marks, *field.beyond(values)], title=head)


def _colours(other: Scale | None) -> ColourScale | None:
    """The scale of colours that tells many curves apart."""
    if other is None or len(other.values) <= MOST_NAMED:
        return None
    return ColourScale(other.label, float(other.values.min()), float(other.values.max()), on_scale(other) == "log")


def _map(field: Field, every: Array, values: Array, ideal: Array | None, status: NDArray[np.int8], head: str) -> Chart:
    """Bands of the number over two names, hatched where there is none."""
    assert field.plan.other is not None  # as `figure` sees to
    scales = field.plan.x, field.plan.other
    (x, across), (y, upward) = (np.unique(scale.values, return_index=True) for scale in scales)
    values, status = values[np.ix_(across, upward)], status[np.ix_(across, upward)]
    codes = _codes(values, status)
    gaps = [(field.word(code), hatch, codes == code) for code, hatch in HATCHES.items() if np.any(codes == code)]
    sides = [edges(scale, places, 0.0) for scale, places in zip(scales, (x, y), strict=True)]
    drawn = Contours(x, y, values, sides[0], sides[1], _levels(field.label, every, field.scope), gaps)
    rows, columns = np.nonzero((status == Status.CONTACT_LOST) & np.isfinite(values))
    lost = _lost(x[rows], y[columns], float(np.clip(160 / max(status.shape), 1.5, 8)))
    along = axis_of(scales[0], field.room, 0.0), axis_of(scales[1], 32 if head else 60, 0.0)
    return Chart(*along, [drawn, *lost, *field.beyond(values)], title=head)


def _levels(title: str, values: Array, scope: float) -> ColourScale:
    """Round edges of a few bands over what is shown."""
    from matplotlib.ticker import MaxNLocator

    finite = values[np.isfinite(values)]
    ends = (float(finite.min()), float(finite.max())) if finite.size else (0.0, 1.0)
    low, high = np.clip(ends, -scope, scope).tolist() if finite.size else ends
    if high - low <= ALIKE * max(abs(low), abs(high)):
        half = 0.05 * max(abs(low), abs(high)) or 1.0
        return ColourScale(title, low - half, high + half, levels=(low - half, high + half))
    levels = [float(level) for level in MaxNLocator(BANDS, steps=[1, 2, 2.5, 5, 10]).tick_values(low, high)]
    return ColourScale(title, *ends, levels=levels)


# ---- report -------------------------------------------------------------------------------------------------------


def report(
    result: xr.Dataset,
    measures: Sequence[str] = ("efficiency",),
    x: str = "",
    family: str = "",
    kind: str = "curves",
) -> str:
    """The whole report as HTML, a figure and tables of every measure; options: those of `figure`."""
    over = " and ".join(attribute(result, "swept"))
    facts = [*counts((prod(result.sizes[name] for name in attribute(result, "swept")), "point")), ("over", over)]
    parts = []
    for name in measures:
        after = []
        for table in tables(result, [name], x, family):
            left_out = f"; {table.left_out:,} points more in a table file" if table.left_out else ""
            after.append(table.titled(table.title + left_out))
        parts.append(Section(name, "", [(f"{name} over {over}", figure(result, name, x, family, kind))], after=after))
    return page(result, "Results over a range of model values", facts, parts)

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
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from trunnion.errors import Finding, MechanismError, Status
from trunnion.results.attributes import attribute
from trunnion.results.scales import without_noise
from trunnion.results.tables.studies import swept as figures_of
from trunnion.solve.friction_method import MARGIN
from trunnion.views.charts import Axis, Chart, ColourScale, Line, Look, Mark, Note, Stripe, check_kind
from trunnion.views.common.cycle import Array
from trunnion.views.page import Section, Table, counts, page
from trunnion.views.scales import (
    ALIKE,
    KINDS,
    NOTHING,
    Arrangement,
    Field,
    Scale,
    arrange,
    axis_of,
    cause,
    ends,
    field_of,
    grid,
    middles,
    on_scale,
    rings,
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


# ---- what is drawn ------------------------------------------------------------------------------------------------

WIDE = 74  # characters of a title in a line


def figure(
    result: xr.Dataset, measure: str = "efficiency", x: str = "", family: str = "", kind: str = "curves"
) -> Figure:
    """A number of the cycle over swept names.

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
    from trunnion.views.draw import Board

    check_kind(kind, KINDS)
    field = field_of(without_noise(result), measure, x, family)
    plan, other, count = field.plan, field.plan.other, len(field.panels)
    over = plan.x.name
    if kind == "map":
        short = [scale.name for scale in (plan.x, other) if scale and np.unique(scale.values).size < 2]
        if other is None or short:
            what = f"'{short[0]}' has one value" if short else f"'{plan.x.name}' alone is swept"
            remedy = "sweep over two names with several values each, or draw curves"
            raise MechanismError(Finding(f"{what}: a map needs two that vary", "--kind map", remedy))
        over += f" and {other.name}"
    title = f"{field.title} over {over}{f' at {plan.at()}' if plan.fixed else ''}"
    if field.hidden:
        title += f" ({count} of {count + field.hidden} panels)"
    title = fill(f"{title[:1].upper()}{title[1:]}", WIDE, break_long_words=False)
    board = Board.new(title, result, count, field.columns)
    if kind == "map":
        from trunnion.views.sweep_map import draw

        draw(board, field)
        return board.sheet
    for k in range(count):
        board.draw(k, _curves(field, k))
    board.finish(_colours(other) if other is not None and len(other.values) > MOST_NAMED else None)
    return board.sheet


# ---- curves -------------------------------------------------------------------------------------------------------

MOST_NAMED = 8  # curves that are told apart by a legend; more by a scale of colours
MOST_MARKED = 40  # points of a curve that are marked
MARKS = "os^DvPX*"  # so that curves are told apart in grey, too
DASHES: Any = ("solid", "long", "short", "dotted")


def _curves(field: Field, panel: int) -> Chart:
    """One curve for each value of the second name, with what hinders it where there is none."""
    other, x, alone = field.plan.other, field.x, len(field.panels) == 1
    y, status = field.values[:, :, panel], field.status[:, :, panel]
    answered = np.isfinite(y)
    empty = ~answered & (status < Status.NOT_CONVERGED) & bool(answered.any())
    marks = _hindered(field, np.where(empty, NOTHING, status))
    count = y.shape[1]
    for k in range(count):
        look, label = _look(field, k), "as built" if field.ideal is not None else None
        if other is not None:  # many are told apart by the scale of colours
            label = other.equation(k) if count <= MOST_NAMED else None
        marks += _curve(x, y[:, k], label, look)
        if field.ideal is not None:
            name = ("ideal" if other is None else "ideal, dashed") if k == count - 1 else None
            faint = look.but(colour="ink", dash="long", width=1.0, size=2.2)
            marks += _curve(x, field.ideal[:, k, panel], name, faint)
    rows, columns = np.nonzero((status == Status.CONTACT_LOST) & answered)
    if rows.size:
        marks += rings(x[rows], y[rows, columns], float(np.clip(8 * np.sqrt(60 / rows.size), 2, 8)))
    if not answered.any() and not (status >= Status.NOT_CONVERGED).any():
        marks.append(Note(f"{field.nothing} at all points", 0.5, 0.5))
    side = replace(_frame(field), title=fill(field.label, 60 if alone else 32, break_long_words=False))
    return Chart(axis_of(field.plan.x, field.room), side, [*marks, *field.beyond(panel)], legend=None,
                 title="" if alone else field.panels[panel])  # fmt: skip


def _look(field: Field, k: int) -> Look:
    """Colour of a curve, and its marks or, of curves without, its dashes; beside ideal ones none."""
    count, points, other = field.values.shape[1], field.x.size, field.plan.other
    if other is not None and count > MOST_NAMED:
        mark = "o" if points == 1 else ""
        return Look(_colours(other).share(float(other.values[k])), 1.2, mark=mark, size=5)
    if points <= MOST_MARKED:
        return Look(k, mark=MARKS[k], size=5 if points == 1 else 3.5)
    plain = field.ideal is not None or count == 1
    return Look(k, dash="solid" if plain else DASHES[k % 4])


def _colours(other: Scale) -> ColourScale:
    log = on_scale(other) == "log"
    low, high = float(other.values.min()), float(other.values.max())
    return ColourScale(other.label, *(ends(other) if low == high else (low, high)), log)


def _curve(x: Array, y: Array, label: str | None, look: Look) -> list[Mark]:
    """One curve; points beside a gap have a cross."""
    answered = np.isfinite(y)
    edges = answered & (np.append(False, ~answered[:-1]) | np.append(~answered[1:], False))
    cross = look.but(dash="none", mark="x", size=7.0 if look.mark or look.width > 1.2 else 3.5, order=4.0)
    return [Line(x, y, label, look), *([Line(x[edges], y[edges], None, cross)] if edges.any() else [])]


def _frame(field: Field) -> Axis:
    """One scale upwards for all panels, cut where some rise far above the rest; flat curves in the middle of it."""
    both = field.values if field.ideal is None else np.append(field.values, field.ideal)
    finite = both[np.isfinite(both)]
    if not finite.size:
        return Axis(places=[])
    low, high, scope = float(finite.min()), float(finite.max()), field.scope
    most = max(abs(low), abs(high))
    if scope < most * (1 - 1e-12):
        return Axis(limits=(max(min(low, 0.0), -scope) * 1.05, min(max(high, 0.0), scope) * 1.05))
    half = 0.1 * most or 1.0
    return Axis(limits=(low - half, high + half)) if high - low <= ALIKE * most else Axis()


def _hindered(field: Field, status: NDArray[np.int8]) -> list[Mark]:
    """Grey where no curve has an answer, hatched where some have none; the cause in it or, in panels, above.

    status: or NOTHING, where a point with an answer has no number.
    """
    missing, alone = (status >= Status.NOT_CONVERGED) | (status == NOTHING), len(field.panels) == 1
    low, high = ends(field.plan.x)
    edges = np.concatenate([[low], middles(field.plan.x, field.x), [high]])
    kind = np.where(missing.all(axis=1), 2, np.where(missing.any(axis=1), 1, 0))
    codes = np.where(missing, status, NOTHING).max(axis=1)
    bounds = np.append(np.flatnonzero(np.diff(np.append(-1, kind))), len(kind)).tolist()
    marks, causes = list[Mark](), set[str]()
    for start, stop in pairwise(bounds):
        if not kind[start]:
            continue
        code, partial = int(codes[start:stop].max()), bool(kind[start] == 1)
        text = (field.nothing if code == NOTHING else cause(code)) + " for some" * partial
        look = Look("rule" if partial else "shade", hatch="///" * partial, order=0.5)
        new = text not in causes
        wide = new or (stop - start) / len(kind) > 0.03  # a second time only where there is room
        name = text if new and not alone else None
        marks.append(Stripe(edges[start], edges[stop], text if alone and wide else "", look, name))
        causes.add(text)
    return marks


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

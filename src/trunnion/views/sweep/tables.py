"""A sweep as short tables: figures over one name, or one figure over two, with a table for each value of further names.

Long tables are thinned evenly, their ends kept; how many points are left out is told.
"""

from __future__ import annotations

from itertools import product
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from trunnion.errors import Status
from trunnion.results.scales import without_noise
from trunnion.results.tables.studies import swept as figures
from trunnion.solve.friction_method import MARGIN
from trunnion.views.scales import Arrangement, arrange, cause, grid, statuses, thinned

if TYPE_CHECKING:
    from collections.abc import Sequence

    import xarray as xr
    from numpy.typing import NDArray

    from trunnion.views.common.cycle import Array

__all__ = ["SweepTable", "tables"]

MOST_ROWS, MOST_COLUMNS = 40, 8  # of a table
LEAST_COLUMNS = 3
LEAST_ROWS, MOST_TABLES = 6, 6  # where there are several
BESIDE = "friction_power_mean", "locking_margin"  # told beside the measure, if the sweep has them


class SweepTable(NamedTuple):
    """Title, head and rows of texts; left_out: points that are not shown."""

    title: str
    head: list[str]
    rows: list[list[str]]
    left_out: int


def tables(
    result: xr.Dataset, measures: Sequence[str] = ("efficiency",), x: str = "", family: str = "", room: int = 1000
) -> list[SweepTable]:
    """One table of several figures over a single name; of more names one for each measure and value of the facets.

    room: characters in a line, which limit how many columns of a long table are shown.
    """
    result = without_noise(result)
    plan = arrange(result, x, family)
    if plan.other is None:
        return [_list(result, measures, plan)]
    return [table for measure in measures for table in _matrices(result, measure, plan, room)]


def _list(result: xr.Dataset, measures: Sequence[str], plan: Arrangement) -> SweepTable:
    found = figures(result)
    shown = [*measures, "efficiency", "efficiency_ideal", *_efforts(found), *BESIDE]
    shown = [name for name in dict.fromkeys(shown) if name in found or name in measures]
    drawn = [_drawn(found[name][0]) for name in shown]
    columns = [factor * grid(result, plan, name)[1][:, 0] for name, (factor, _) in zip(shown, drawn, strict=True)]
    picked, status = thinned(len(plan.x.values), MOST_ROWS), statuses(result, plan)[:, 0]
    titles = [f"{name.replace('_', ' ')} [{unit}]".removesuffix(" [1]")
              for name, (_, unit) in zip(shown, drawn, strict=True)]  # fmt: skip
    words = [_word(int(code)) for code in status]
    head = [plan.x.title, *titles, *(["status"] if any(words) else [])]
    rows = []
    for i in picked:
        cells = ["" if np.isnan(column[i]) else _number(column[i]) for column in columns]
        rows.append([_number(plan.x.values[i]), *cells, *([words[i]] if any(words) else [])])
    said = ", ".join(name.replace("_", " ") for name in measures)
    return SweepTable(_titled(f"{said} over {plan.x.name}", plan.at()), head, rows, len(plan.x.values) - len(picked))


def _efforts(found: dict[str, tuple[str, Any]]) -> list[str]:
    """The ends of every driver's effort that lie beyond 0 at any point: both where its sign changes."""
    shown = []
    for driver in (name.removesuffix(".effort_max") for name in found if name.endswith(".effort_max")):
        ends = {f"{driver}.effort_min": -1.0, f"{driver}.effort_max": 1.0}
        beyond = {name: float(np.nanmax(sign * found[name][1], initial=0.0)) for name, sign in ends.items()}
        shown += [name for name, most in beyond.items() if most > 0] or [f"{driver}.effort_max"]
    return shown


def _matrices(result: xr.Dataset, measure: str, plan: Arrangement, room: int) -> list[SweepTable]:
    """A table for each combination of the facets' values; of many of them some."""
    assert plan.other is not None  # a matrix has columns
    own, values = grid(result, plan, measure)
    factor, unit = _drawn(own)
    values = factor * values
    status = statuses(result, plan)
    places = list(product(*(range(len(one.values)) for one in plan.facets)))
    shown = [places[i] for i in thinned(len(places), MOST_TABLES)]
    most = max(LEAST_ROWS, MOST_ROWS // len(shown))
    name = measure.replace("_", " ") + (f" [{unit}]" if unit not in ("", "1") else "")
    title = f"{name} over {plan.x.name} and, in columns, {plan.other.name}"
    made = []
    for place in shown:
        at = ", ".join([*(one.told(i) for one, i in zip(plan.facets, place, strict=True)), *_listed(plan.at())])
        index: Any = (slice(None), slice(None), *place)
        made.append(_matrix(_titled(title, at), plan, values[index], status[index], (most, room)))
    hidden = (len(places) - len(shown)) * plan.x.values.size * plan.other.values.size
    made[-1] = made[-1]._replace(left_out=made[-1].left_out + hidden)
    return made


def _matrix(
    title: str, plan: Arrangement, values: Array, status: NDArray[np.int8], most: tuple[int, int]
) -> SweepTable:
    """most: rows, and characters in a line."""
    assert plan.other is not None
    down = thinned(values.shape[0], most[0])
    columns = [[plan.x.title, *(_number(plan.x.values[i]) for i in down)]]
    for k, (numbers, codes) in enumerate(zip(values[down].T, status[down].T, strict=True)):
        columns += [[plan.other.say(k), *map(_cell, numbers.tolist(), codes.tolist())]]
    across = thinned(values.shape[1], MOST_COLUMNS)
    while len(across) > LEAST_COLUMNS and _width(columns, across) > most[1]:
        across = thinned(values.shape[1], len(across) - 1)
    head, *rows = ([columns[0][i], *(columns[k + 1][i] for k in across)] for i in range(len(down) + 1))
    return SweepTable(title, head, rows, values.size - len(down) * len(across))


def _drawn(unit: str) -> tuple[float, str]:
    """Factor and unit of a column: lengths in mm, angles in degrees."""
    return {"m": (1e3, "mm"), "rad": (180 / np.pi, "deg")}.get(unit, (1.0, unit))


def _cell(value: float, status: int) -> str:
    if not np.isnan(value):
        return _number(value)
    return cause(status) if status >= Status.NOT_CONVERGED else ""


def _width(columns: list[list[str]], across: list[int]) -> int:
    """Characters that the first and these columns take; the words of a cause may stand below each other."""
    picked = [columns[0], *(columns[k + 1] for k in across)]
    return sum(3 + max(len(column[0]), *(len(word) for cell in column for word in cell.split())) for column in picked)


def _titled(title: str, at: str) -> str:
    return f"{title}, at {at}" if at else title


def _listed(text: str) -> list[str]:
    return [text] if text else []


def _word(code: int) -> str:
    """What a table says of a point that has no figures, or not quite sound ones."""
    if code >= Status.NOT_CONVERGED:
        return cause(code)
    milder = {int(Status.NEAR_SINGULAR): "near singular", int(Status.CONTACT_LOST): "contact lost"}
    return milder.get(code, "")


def _number(value: float) -> str:
    if value == np.inf:  # of a locking margin: as far as it is looked for
        return f"> {MARGIN:g}"
    return f"{value + 0.0:.6g}"  # + 0.0: no negative zero

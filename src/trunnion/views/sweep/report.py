"""A sweep as one HTML page: a figure and tables of every number that is asked for, over the swept names."""

from __future__ import annotations

from collections.abc import Sequence
from math import prod
from typing import TYPE_CHECKING

from trunnion.errors import agreeing
from trunnion.results.attributes import attribute
from trunnion.views.page import Section, page
from trunnion.views.sweep.figure import figure
from trunnion.views.sweep.tables import SweepTable, tables
from trunnion.views.table import Table

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["report"]


def report(
    result: xr.Dataset,
    measures: Sequence[str] = ("efficiency",),
    x: str = "",
    family: str = "",
    kind: str = "curves",
) -> str:
    """The whole report as HTML; options: those of the figures, see `sweep.figure`."""
    swept = attribute(result, "swept")
    points = prod(result.sizes[name] for name in swept)
    facts = [(f"{points:,}", agreeing(points, "point", "points")), ("over", " and ".join(swept))]
    parts = []
    for name in measures:
        drawn = [(f"{name} over {' and '.join(swept)}", figure(result, name, x, family, kind))]
        parts.append(Section(name, "", drawn, after=[_told(one) for one in tables(result, [name], x, family)]))
    return page(result, "Results over a range of model values", facts, parts)


def _told(table: SweepTable) -> Table:
    """A table whose title says how many points it leaves out."""
    left_out = f"; {table.left_out:,} points more in a table file" if table.left_out else ""
    return Table(table.title + left_out, table.head, table.rows)

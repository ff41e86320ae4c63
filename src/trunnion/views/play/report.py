"""What the play of every joint does, as one HTML page: a figure and a table for each measure."""

from __future__ import annotations

from typing import TYPE_CHECKING

from trunnion.errors import agreeing
from trunnion.views.page import Section, page
from trunnion.views.play.figure import figure
from trunnion.views.play.tables import tables

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["report"]

ABOUT = "worst case: every pin where it moves the measure most, to first order; RSS: independent joints"


def report(result: xr.Dataset) -> str:
    """The whole report as HTML."""
    counts = [(of, result.sizes[of]) for of in ("measure", "joint", "position")]
    facts = [(f"{count:,}", agreeing(count, of, of + "s")) for of, count in counts]
    parts = []
    for i, table in enumerate(tables(result)):
        name = str(result["measure"].values[i])
        untitled = table.titled(table.title.removeprefix(name).lstrip(",: "))
        parts.append(Section(name, ABOUT, [(f"worst case of {name}", figure(result, [i]))], after=[untitled]))
    return page(result, "Effect of the play of the joints", facts, parts)

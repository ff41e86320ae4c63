"""The clearance that a linkage with axis errors needs, as one HTML page."""

from __future__ import annotations

from typing import TYPE_CHECKING

from trunnion.errors import agreeing
from trunnion.results.attributes import summary_of
from trunnion.results.quantities import parts
from trunnion.views.assembly.figure import figure
from trunnion.views.page import Section, page
from trunnion.views.table import Table

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["report"]

TITLE = "Clearance needed for assembly"


def report(result: xr.Dataset) -> str:
    """The whole report as HTML."""
    count = result.sizes["position"]
    part = Section("Over the cycle", pictures=[(TITLE, figure(result))], after=[_results(result)])
    return page(result, TITLE, [(f"{count:,}", agreeing(count, "position", "positions"))], [part])


def _results(result: xr.Dataset) -> Table:
    """The figures of the summary, as the terminal shows them."""
    rows = []
    for one in summary_of(result):
        value = "undefined" if one.value is None else one.value
        text, unit = (value, "") if isinstance(value, str) else parts(value, one.unit)
        rows.append([one.label, text, "" if unit == "1" else unit])
    return Table("results", ["", "value", "unit"], rows)

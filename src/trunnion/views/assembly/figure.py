"""The figure of whether a mechanism goes together: the clearance that it needs over the drive, and in which joints."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from trunnion.errors import agreeing
from trunnion.results.attributes import summary_of
from trunnion.results.quantities import parts, prefixed, quantity
from trunnion.views.axis import Abscissa, Array, abscissa, column, names
from trunnion.views.charts import Axis, Chart, Legend, Line, Look, Mark, Note, Panel, Plot, Rule, Stripe, nth
from trunnion.views.page import Section, Table, page

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["figure", "report"]


TITLE = "Clearance needed for assembly"
FITS = 0  # code of the status of a position that goes together
TOLD = 0.01  # of the need: a joint whose part is nowhere larger has no curve


def figure(result: xr.Dataset) -> Plot:
    """Needed clearance of all pins over the drive; needed share of the stated clearances, if any; parts of the joints.

    Grey: where the stated clearances do not suffice.
    """
    over, share = abscissa(result), column(result, "needed_share")
    charts = [_need(result, over)]
    if share is not None and np.any(np.isfinite(share) & (share > 0)):
        charts.append(_share(result, share, over))
    if np.nanmax(result["uniform_part"].values, initial=0.0) > 0:
        charts.append(_parts(result, over))
    return Plot(TITLE, [Panel("", charts, 1.4 + 1.6 * len(charts))])


def _need(result: xr.Dataset, over: Abscissa) -> Chart:
    """The clearance, the same in all pins, that each position needs, and the largest."""
    need = np.asarray(result["needed_clearance"].values, float)
    need, most = np.where(np.isfinite(need), need, np.nan), float(result["smallest_clearance"])
    factor, unit = prefixed(float(np.nanmax(need, initial=0.0)), "m")
    marks: list[Mark] = [*_short(result, over), Line(over.values, need * factor, None, Look(0, 2.0), close=True)]
    if np.isfinite(most) and most > 0:
        text = f"smallest clearance, the same in {result.attrs['assembling']}: {quantity(most, 'm')}"
        marks += _limit(most * factor, text, over, "ink", Look("muted", 0.9, "dashed"))
        return Chart(over, Axis(f"needed clearance [{unit}]", (0, 1.22 * most * factor)), marks, zero=True)
    if np.isfinite(need).any() and most == 0:
        marks.append(Note("no clearance is needed", 0.5, 0.5, colour="ink", size=9.0))
    return Chart(over, Axis(f"needed clearance [{unit}]", (-0.1, 1), places=[]), marks, zero=True)


def _share(result: xr.Dataset, share: Array, over: Abscissa) -> Chart:
    """The share of the stated clearances that each position needs; above 1 they do not suffice."""
    share = np.where(np.isfinite(share), share, np.nan)
    marks: list[Mark] = [*_short(result, over), Line(over.values, share, None, Look(1, 2.0), close=True)]
    marks += _limit(1.0, "all of the stated clearances", over, "limit", Look("limit", 0.9, "dashed"))
    top = 1.2 * max(1.0, float(np.nanmax(share, initial=0.0)))
    return Chart(over, Axis("share of the stated", (0, top)), marks, zero=True)


def _limit(at: float, text: str, over: Abscissa, paint: str, look: Look) -> list[Mark]:
    """A level line with what it is, written above it."""
    left = float(over.values.min()) + 0.01 * over.span
    return [Rule(at, None, look, upright=False),
            Note(text, left, at, "left", "bottom", data=True, colour=paint, shift=(0, 3))]  # fmt: skip


def _parts(result: xr.Dataset, over: Abscissa) -> Chart:
    """What each joint's clearance contributes to the need."""
    parts = 100 * np.asarray(result["uniform_part"].values, float).sum(axis=1)
    lines = [Line(over.values, parts[i], joint, nth(i), close=True) for i, joint in enumerate(names(result, "joint"))
             if np.nanmax(parts[i], initial=0.0) > 100 * TOLD]  # fmt: skip
    most = float(np.nanmax(parts, initial=0.0))
    top = min(105.0, 1.1 * most) if most > 0 else 105.0
    return Chart(over, Axis("share of the joint [%]", (0, top)), lines, zero=True, legend=Legend(1))


def _short(result: xr.Dataset, over: Abscissa) -> list[Mark]:
    """Grey where the mechanism does not go together with the stated clearances, if they are enough somewhere."""
    # where they are nowhere enough the whole would be grey, which tells nothing
    short = np.asarray(result["status"].values) != FITS
    if short.all() or not short.any():
        return []
    x = over.values
    half = abs(float(x[1] - x[0])) / 2 if x.size > 1 else 0.5
    return [Stripe(float(x[at]) - half, float(x[at]) + half) for at in np.flatnonzero(short)]


# ---- report ---------------------------------------------------------------------------------------------------------


def report(result: xr.Dataset) -> str:
    """The whole report as HTML."""
    count = result.sizes["position"]
    rows = []  # the figures of the summary, as the terminal shows them
    for row in summary_of(result):
        value = "undefined" if row.value is None else row.value
        text, unit = (value, "") if isinstance(value, str) else parts(value, row.unit)
        rows.append([row.label, text, "" if unit == "1" else unit])
    after = [Table("results", ["", "value", "unit"], rows)]
    part = Section("Over the cycle", pictures=[(TITLE, figure(result))], after=after)
    return page(result, TITLE, [(f"{count:,}", agreeing(count, "position", "positions"))], [part])

"""Play in figure and table: the worst case of a measure over the turn, and what each joint has in it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from trunnion.results.attributes import attribute
from trunnion.results.dataset import units_along
from trunnion.results.quantities import prefixed
from trunnion.results.scales import without_noise
from trunnion.views.common.cycle import Abscissa, Array, thin
from trunnion.views.common.figures import INK, PALETTE, along, frame_peak, legend, new, shade
from trunnion.views.common.lettering import plain
from trunnion.views.common.peaks import ease, usual_peak
from trunnion.views.play.tables import abscissa_of

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

__all__ = ["MOST_PANELS", "figure"]

MOST_PANELS = 6
PANEL = 3.3  # height, inches
HATCHES = ("", "//", "..", "xx")


def figure(result: xr.Dataset, measures: Sequence[int] | None = None) -> Figure:
    """A panel for each measure: the joints' worst cases on top of one another, their RSS dashed.

    measures: their numbers; the first ones if not given.
    """
    result = without_noise(result)
    over, names = abscissa_of(result), result["measure"].values
    chosen = range(len(names))[:MOST_PANELS] if measures is None else measures
    sheet = new("Effect of the play of the joints", result, height=1.0 + PANEL * len(chosen))
    units, limits = units_along(result["value"], "measure"), attribute(result, "limits")
    places = attribute(result, "places")
    panels = sheet.subplots(len(chosen), 1, sharex=True, squeeze=False)[:, 0]
    for i, axes in zip(chosen, panels, strict=True):
        _panel(axes, result.isel(measure=i), over, str(names[i]), units[i], limits[i], " at ".join(places[i]).strip())
        shade(axes, result, over)
        if axes is not panels[-1]:
            axes.set_xlabel("")
    return sheet


def _panel(
    axes: Axes, result: xr.Dataset, over: Abscissa, name: str, unit: str, limit: float | None, place: str
) -> None:
    rows, total, rss = (result[key].values for key in ("worst_case", "worst_case_total", "rss"))
    most, shown = float(np.nanmax(total, initial=0.0)), usual_peak(ease(result), total)
    factor, label = prefixed(shown, unit)
    along(axes, over, plain(f"worst case of {name} [{label}]"))
    picked = thin(total)
    x, lanes = over.values[picked], [row[picked] * factor for row in (*rows, rss)]
    if over.closed:
        x, lanes = np.append(x, x[0] + over.period), [np.append(row, row[0]) for row in lanes]
    floor = np.zeros(len(x))
    for k, (joint, row) in enumerate(zip(result["joint"].values, lanes[:-1], strict=True)):
        if np.nanmax(row, initial=0.0) > 0:
            look: dict[str, Any] = {
                "facecolor": PALETTE[k % len(PALETTE)],
                "hatch": HATCHES[k // len(PALETTE) % len(HATCHES)],
            }
            axes.fill_between(x, floor, floor + row, label=plain(str(joint)), alpha=0.75, linewidth=0, **look)
        floor = floor + row
    axes.plot(x, floor, color=INK, linewidth=1.4, label="sum: worst case, first order", **_marks(x))
    axes.plot(x, lanes[-1], color=INK, linewidth=1.2, linestyle=(0, (5, 2)), label="RSS")
    if limit is not None:
        axes.axhline(limit * factor, color=PALETTE[1], linewidth=1.2, linestyle=(0, (1, 1.5)), label="limit")
    if np.isfinite(there := float(np.sum(result["extreme_worst_case"].values))):
        # of an extreme the curve has the pins where they are, the figure also this place, which they may move
        axes.plot([_place(result, over)], [there * factor], "o", color=INK, label=plain(place), clip_on=there > shown)
    axes.set_ylim(bottom=0.0)
    frame_peak(axes, most, shown, factor, unit)
    legend(axes)


def _place(result: xr.Dataset, over: Abscissa) -> float:
    """Where an extreme is on the abscissa, which goes on beyond the last position of a cycle as it does before it."""
    at, time, values = float(result["extreme_time"]), result["time"].values, over.values
    k = int(np.clip(np.searchsorted(time, at), 1, max(len(time) - 1, 1)))
    if len(time) < 2:
        return float(values[0])
    return float(values[k - 1] + (values[k] - values[k - 1]) * (at - time[k - 1]) / (time[k] - time[k - 1]))


def _marks(x: Array) -> dict[str, Any]:
    """A single position makes no line."""
    return {"marker": "o"} if len(x) == 1 else {}

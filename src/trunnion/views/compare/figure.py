"""Figures of a comparison: efficiency measured and of the model, and the courses of a channel with their residual.

What was measured is drawn with its expanded uncertainty U, the model as a curve. Gaps stay gaps.
"""

from __future__ import annotations

from collections.abc import Sequence
from textwrap import wrap
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib import colormaps
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.layout_engine import ConstrainedLayoutEngine
from numpy.typing import NDArray

from trunnion.errors import Finding, MechanismError, Status
from trunnion.results.quantities import number
from trunnion.views.common.cycle import Abscissa, Array, names
from trunnion.views.common.figures import (
    INK,
    MUTED,
    PALETTE,
    SHADE,
    WIDTH,
    along,
    curve,
    dress,
    legend,
    new,
    shade,
    style_of,
)
from trunnion.views.common.lettering import Sheet, plain
from trunnion.views.compare.comparison import (
    coverage_of,
    drive,
    index_of,
    label,
    levels,
    scale_of,
    setting,
    text,
    varied,
    verdict,
)
from trunnion.views.sweep.scales import Scale, cause

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure, FigureBase

__all__ = ["KINDS", "MOST_PANELS", "check_kind", "efficiency", "figure", "overlay", "panels", "small"]

KINDS = {"efficiency": "measured and modelled efficiency", "overlay": "signals with residuals"}
MOST_PANELS = 6
MOST_NAMED = 8  # series that a legend tells apart; more by a scale of colours
MEASURED, MODEL = PALETTE[0], PALETTE[1]
Indices = NDArray[np.intp]


def check_kind(kind: str) -> None:
    """MechanismError if there is no such kind of figure."""
    if kind not in KINDS:
        raise MechanismError(Finding(f"there is no figure '{kind}'", "--kind", f"use one of {', '.join(KINDS)}"))


def figure(
    result: xr.Dataset, kind: str | None = None, channel: str | None = None, condition: str | None = None
) -> Figure:
    """One figure. kind: of KINDS; the efficiency if it was measured and no channel is named, else the courses.

    channel, condition: which courses; the first MOST_PANELS of them if there are more.
    """
    measured = "efficiency" in result
    kind = kind or ("efficiency" if measured and channel is None and condition is None else "overlay")
    check_kind(kind)
    if kind == "overlay":
        return overlay(result, panels(result, channel, condition))
    if not measured:
        what = "the efficiency was not measured"
        remedy = "measure effort: and rate: of the driver, load: and rate: of a load's joint"
        raise MechanismError(Finding(what, "--kind efficiency", remedy))
    return efficiency(result)


# ---- efficiency -----------------------------------------------------------------------------------------------


def efficiency(result: xr.Dataset, width: float = WIDTH) -> Figure:
    """Measured efficiency with bars of ±U beside the model's, over what was varied; a curve for each further value."""
    over, series, other = _series(result)
    sheet = new(f"Efficiency, measured and model, over {over.name}", result, width=width)
    axes = sheet.subplots()
    dress(axes, plain(over.title), "efficiency")
    many = len(series) > MOST_NAMED
    for k, (name, where) in enumerate(series):
        look: dict[str, Any] = style_of(k) if len(series) > 1 else {"color": MODEL, "linestyle": "-"}
        if many and other is not None:
            tone = np.nanmean(other.values[where], keepdims=True)
            look = {"color": _colours(other).to_rgba(tone)[0], "linestyle": "-"}
        _points(axes, result, over, where, look, single=len(series) == 1)
        if name and not many:
            axes.plot([], [], label=plain(name), **look, linewidth=1.6)
    ink = MEASURED if len(series) == 1 else INK
    lone = MODEL if len(series) == 1 else INK
    axes.plot([], [], "o", markersize=4.5, color=ink, label=f"measured, ±U ({coverage_of(result)})")
    axes.plot([], [], "-", linewidth=1.6, color=lone, label="model")
    _silent(axes, result, over)
    if over.name == "condition":
        _name_ticks(axes, names(result, "condition"))
    legend(axes, least=1)
    if many and other is not None:
        bar = sheet.colorbar(_colours(other), ax=axes, pad=0.02, aspect=30)
        bar.set_label(plain(other.title), fontsize=9, color=INK)
        bar.ax.tick_params(labelsize=8.5, colors=MUTED, labelcolor=INK)
    return sheet


def _series(result: xr.Dataset) -> tuple[Scale, list[tuple[str, Indices]], Scale | None]:
    """What to draw over, the conditions of each curve with its name, and the number that tells the curves apart."""
    several = varied(result)
    count = result.sizes["condition"]
    by_number = Scale("condition", "", np.arange(1.0, count + 1))
    if not several:
        return by_number, [("", np.arange(count))], None
    over, *others = several
    if not others:
        return over, [("", np.flatnonzero(np.isfinite(over.values)))], None
    keys = np.stack([np.nan_to_num(levels(one.values), nan=np.inf) for one in others])
    settings = np.unique(keys, axis=1).T
    if len(others) > 1 and len(settings) > MOST_NAMED:
        return by_number, [("", np.arange(count))], None
    found = []
    for at in settings:
        mine = np.flatnonzero((keys == at[:, None]).all(axis=0) & np.isfinite(over.values))
        told = [f"{one.name} = {setting(value, one.unit)}" for one, value in zip(others, at, strict=True)]
        found.append((", ".join(told), mine))
    return over, found, others[0]


def _colours(other: Scale) -> ScalarMappable:
    return ScalarMappable(Normalize(np.nanmin(other.values), np.nanmax(other.values)), colormaps["viridis"])


def _points(axes: Axes, result: xr.Dataset, over: Scale, where: Indices, look: dict[str, Any], *, single: bool) -> None:
    """One curve of the model with its measured points."""
    order = where[np.argsort(over.values[where], kind="stable")]
    x, model = over.values[order], result["efficiency_model"].values[order]
    joined = over.name != "condition"
    axes.plot(x, model, linewidth=1.6, marker="" if joined else "_", markersize=12, zorder=2.5,
              **{**look, "linestyle": look["linestyle"] if joined else "none"})  # fmt: skip
    known = np.isfinite(model)
    if joined and np.count_nonzero(known) == 1:  # a line of one point is none
        axes.plot(x[known], model[known], "_", markersize=14, markeredgewidth=1.6, color=look["color"], zorder=2.5)
    ends = known & (np.append(False, ~known[:-1]) | np.append(~known[1:], False))
    if joined and ends.any():  # beside a gap, as a sweep draws it
        axes.plot(x[ends], model[ends], "x", markersize=7, color=look["color"], markeredgewidth=1.6, zorder=4)
    measured, wide = (result[name].values[order] for name in ("efficiency", "efficiency_expanded"))
    colour = MEASURED if single else look["color"]
    axes.errorbar(x, measured, np.nan_to_num(wide), fmt="o", markersize=4.5, color=colour, ecolor=colour, capsize=3,
                  elinewidth=1.1, zorder=3)  # fmt: skip


def _silent(axes: Axes, result: xr.Dataset, over: Scale) -> None:
    """Grey where no condition has an answer of the model, with the cause."""
    model, status = result["efficiency_model"].values, result["status"].values
    there = np.isfinite(result["phase"].values)
    at = levels(over.values)
    places = np.unique(at[np.isfinite(at)])
    if not places.size:
        return
    silent = np.array([not np.isfinite(model[at == place]).any() for place in places])
    margin = 0.05 * float(np.ptp(places)) or 0.5 * abs(float(places[0])) or 0.5
    edges = np.concatenate([[places[0] - margin], (places[1:] + places[:-1]) / 2, [places[-1] + margin]])
    axes.set_xlim(float(edges[0]), float(edges[-1]))
    said = ""
    for k in np.flatnonzero(silent):
        axes.axvspan(edges[k], edges[k + 1], color=SHADE, linewidth=0, zorder=0.5)
        mine = at == places[k]
        gravest = int(status[mine][there[mine]].max())
        told = cause(gravest) if gravest >= Status.NOT_CONVERGED else "no efficiency"
        if told != said:
            said = told
            axes.text(
                (edges[k] + edges[k + 1]) / 2, 0.5, f"model: {told}", transform=axes.get_xaxis_transform(), rotation=90,
                ha="center", va="center", fontsize=8, color=MUTED, zorder=3, clip_on=True,
            )  # fmt: skip


def _name_ticks(axes: Axes, told: Sequence[str]) -> None:
    """Names of conditions below the axis; numbers where there are too many, or they are long."""
    if len(told) > 24 or max(map(len, told)) > 24:
        return
    axes.set_xticks(np.arange(1, len(told) + 1), [plain(name) for name in told])
    if sum(map(len, told)) > 70:
        axes.tick_params(axis="x", labelrotation=60)
        for tick in axes.get_xticklabels():
            tick.set_horizontalalignment("right")
            tick.set_rotation_mode("anchor")


# ---- courses --------------------------------------------------------------------------------------------------


def panels(result: xr.Dataset, channel: str | None = None, condition: str | None = None) -> list[tuple[int, int]]:
    """(channel, condition) of the courses that there are, of one channel or condition only if it is named."""
    of_channel = None if channel is None else index_of(result, "channel", channel)
    of_condition = None if condition is None else index_of(result, "condition", condition)
    there = np.isfinite(result["measured"].values).any(axis=2) | np.isfinite(result["model"].values).any(axis=2)
    return [
        (i, k)
        for k in range(result.sizes["condition"])
        for i in range(result.sizes["channel"])
        if there[i, k] and of_channel in (None, i) and of_condition in (None, k)
    ]


def overlay(result: xr.Dataset, shown: Sequence[tuple[int, int]]) -> Figure:
    """Courses of channels in conditions, each with its residual below; at most MOST_PANELS, and the figure says so."""
    if not shown:
        raise MechanismError(
            Finding("there is no signal to draw", "--kind overlay", "see the findings of `trunnion data`")
        )
    count = min(len(shown), MOST_PANELS)
    columns = 1 if count == 1 else 2
    rows = -(-count // columns)
    more = f", {count} of {len(shown)} signals" if len(shown) > count else ""
    sheet = new(f"Measured and model{more}", result, height=1.0 + 3.2 * rows, width=WIDTH if count == 1 else 10.6)
    parts = np.ravel(np.asarray(sheet.subfigures(rows, columns, squeeze=False)))
    for part, (i, k) in zip(parts, shown, strict=False):
        lines = [plain(line) for line in wrap(label(result, k), 80)[:2]]
        part.suptitle("\n".join(lines), x=0.012, ha="left", fontsize=9.5, color=INK)
        _panel(part, result, i, k)
    return sheet


def small(result: xr.Dataset, channel: int, condition: int) -> Figure:
    """One course for a page that has several side by side."""
    layout = ConstrainedLayoutEngine(w_pad=0.05, h_pad=0.04, hspace=0.03, wspace=0.03)
    sheet = Sheet(figsize=(4.4, 3.5), dpi=150, facecolor="white", layout=layout)
    FigureCanvasAgg(sheet)
    lines = [plain(line) for line in wrap(label(result, condition), 62)[:2]]
    sheet.suptitle("\n".join(lines), x=0.012, ha="left", fontsize=9, color=INK)
    _panel(sheet, result, channel, condition)
    return sheet


def _panel(part: FigureBase, result: xr.Dataset, channel: int, condition: int) -> None:
    """Measured with ±U and model; below, the residual in ±U."""
    over, (factor, unit) = drive(result, condition), scale_of(result, channel, condition)
    count = over.values.size

    def row(name: str) -> Array:
        return np.asarray(result[name].values[channel, condition, :count], float)

    above, below = part.subplots(2, 1, sharex=True, gridspec_kw={"height_ratios": [2.6, 1]})
    told = names(result, "channel")[channel]
    along(above, over, plain(f"{told} [{unit}]" if unit else told), zero=False)
    along(below, over, "residual" + (f"\n{plain(f'[{unit}]')}" if unit else ""))
    above.set_xlabel("")
    above.tick_params(labelbottom=False)
    close = unit != "°"
    measured, wide = row("measured") * factor, row("expanded") * factor
    _band(above, over, measured, wide, close, f"±U ({coverage_of(result)})")
    curve(above, over, measured, "measured", close=close, color=MEASURED, linewidth=1.3)
    curve(above, over, row("model") * factor, "model", close=close, color=MODEL, linewidth=1.5, linestyle=(0, (5, 1.6)))
    residual = np.where(row("compared") > 0, row("residual"), np.nan) * factor
    _band(below, over, 0.0 * wide, wide, True, None)
    curve(below, over, residual, None, color=MEASURED, linewidth=1.1)
    peak = np.nanmax(np.abs(np.append(measured, row("model") * factor)), initial=0.0)
    if np.nanmax(np.abs(np.append(residual, wide)), initial=0.0) < 1e-6 * peak:  # nothing to look at closer
        below.set_ylim(-1e-3 * peak, 1e-3 * peak)
    one = result.isel(condition=condition, position=slice(0, count))
    for axes in (above, below):
        shade(axes, one, over)
    for writing in list(below.texts):  # said once, above
        writing.remove()
    legend(above, least=1, room=70)
    below.set_title(_told(result, channel, condition, factor, unit), loc="right", fontsize=7.5, color=MUTED, pad=2)


def _told(result: xr.Dataset, channel: int, condition: int, factor: float, unit: str) -> str:
    """The residual in one line."""
    at = (channel, condition)
    rms, share = (float(result[name].values[at]) for name in ("rms", "within"))
    parts = [f"RMS {text(rms * factor, unit)}"] if np.isfinite(rms) else []
    parts += [f"{number(100 * share, 3)}\u00a0% within ±U"] if np.isfinite(share) else []
    return plain(f"{', '.join(parts)}: {verdict(result, *at).text}" if parts else verdict(result, *at).text)


def _band(axes: Axes, over: Abscissa, middle: Array, half: Array, close: bool, label: str | None) -> None:
    """The band of ±U."""
    x, low, high = over.values, middle - half, middle + half
    if over.closed and close:
        x, low, high = np.append(x, x[0] + over.period), np.append(low, low[0]), np.append(high, high[0])
    axes.fill_between(x, low, high, color=MEASURED, alpha=0.22, linewidth=0, label=label, zorder=1.8)

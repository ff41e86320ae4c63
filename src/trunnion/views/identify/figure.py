"""Figures of an identification: intervals, correlation, residuals before and after."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from trunnion.errors import Finding, MechanismError
from trunnion.results.attributes import attribute
from trunnion.results.quantities import prefixed
from trunnion.views.common.cycle import Array, names
from trunnion.views.common.figures import INK, MUTED, PALETTE, SHADE, dress, legend, new
from trunnion.views.common.lettering import plain
from trunnion.views.identify.identification import Estimate, channels, conditions, curve_of, estimates
from trunnion.views.rig.conditions import shortened

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

__all__ = ["KINDS", "MOST_PANELS", "check_kind", "figure"]

MOST_PANELS = 8
SUBTITLE = 12.0  # points: height of the name of a condition above its axes
FEW = 5  # conditions whose names stand side by side
MOST_TOLD = 12  # parameters whose correlations have room for their numbers
COVERED = 2.0  # standard uncertainties of the band
ALIKE = 1e-6  # of the range of the drive: by which it may differ between conditions that share an axis
BEFORE, AFTER = PALETTE[4], PALETTE[0]


def check_kind(kind: str) -> None:
    """MechanismError if there is no such kind of figure."""
    if kind not in KINDS:
        raise MechanismError(Finding(f"there is no figure '{kind}'", "--kind", f"use one of {', '.join(KINDS)}"))


def figure(result: xr.Dataset, kind: str | None = None) -> Figure:
    """One figure. kind: of KINDS; the intervals if not given."""
    check_kind(kind or "intervals")
    return KINDS[kind or "intervals"](result)


# ---- intervals ------------------------------------------------------------------------------------------------


def intervals(result: xr.Dataset) -> Figure:
    """Each parameter on a scale of its own: where it started, where it is, and its 95 % interval."""
    rows = estimates(result)
    sheet = new("Estimates with their 95 % intervals", result, height=1.1 + 0.78 * len(rows))
    panels = sheet.subplots(len(rows), 1, squeeze=False)[:, 0]
    for k, (axes, one) in enumerate(zip(panels, rows, strict=True)):
        _interval(axes, one, labelled=k == 0)
    legend(panels[0], least=1)
    return sheet


def _interval(axes: Axes, one: Estimate, labelled: bool) -> None:
    dress(axes)
    axes.set_yticks([0], [plain(one.short)], fontsize=9)
    axes.set_ylim(-1, 1)
    axes.spines["left"].set_visible(False)
    axes.tick_params(axis="y", length=0)
    label: dict[str, str] = {"start": "start", "interval": "95 % interval", "value": "estimate"} if labelled else {}
    points = [one.start]
    if one.told:
        low, high = (end if np.isfinite(end) else one.value for end in (one.lower, one.upper))
        points += [low, high]
        axes.plot([low, high], [0, 0], color=AFTER, linewidth=6, alpha=0.35, solid_capstyle="butt",
                  label=label.get("interval"))  # fmt: skip
        axes.plot([one.value], [0], "o", color=AFTER, markersize=6, label=label.get("value"))
    else:
        axes.text(0.5, 0.75, "not identifiable", transform=axes.transAxes, ha="center", va="center",
                  fontsize=8.5, color=MUTED)  # fmt: skip
    axes.plot([one.start], [0], "D", color=BEFORE, markersize=5, markerfacecolor="none", markeredgewidth=1.4,
              label=label.get("start"))  # fmt: skip
    low, high = min(points), max(points)
    margin = 0.08 * (high - low) or 0.1 * abs(high) or 0.1
    axes.set_xlim(low - margin, high + margin)
    axes.locator_params(axis="x", nbins=7)
    if one.unit:
        axes.set_xlabel(one.unit, fontsize=8.5, color=INK, loc="right", labelpad=1)


# ---- correlation ----------------------------------------------------------------------------------------------


def correlation(result: xr.Dataset) -> Figure:
    """The correlation of the estimates as a matrix."""
    rows = estimates(result)
    short = [plain(one.short) for one in rows]
    size = min(1.6 + 0.62 * len(rows), 7.0)
    sheet = new("Correlation of the estimates", result, height=size + 0.9, width=size + 2.8)
    axes = sheet.subplots()
    values = result["correlation"].values
    shown = np.ma.masked_invalid(values)
    picture = axes.imshow(shown, vmin=-1, vmax=1, cmap="RdBu_r")
    axes.set_facecolor(SHADE)
    for k, side in enumerate((axes.xaxis, axes.yaxis)):
        side.set_ticks(range(len(rows)), short, fontsize=8.5, rotation=0 if k or len(rows) < 4 else 35,
                       ha="right" if k or len(rows) >= 4 else "center")  # fmt: skip
    axes.tick_params(length=0)
    for side_name in axes.spines:
        axes.spines[side_name].set_visible(False)
    for p in range(len(rows) if len(rows) <= MOST_TOLD else 0):
        for q in range(len(rows)):
            value = values[p, q]
            text = "—" if np.isnan(value) else f"{value:.2f}".replace("-", "−")
            colour = MUTED if np.isnan(value) else "white" if abs(value) > 0.6 else INK
            axes.text(q, p, text, ha="center", va="center", fontsize=8, color=colour)
    bar = sheet.colorbar(picture, ax=axes, shrink=0.8, aspect=25)
    bar.ax.tick_params(labelsize=8, colors=MUTED, labelcolor=INK)
    return sheet


# ---- residuals ------------------------------------------------------------------------------------------------


def residuals(result: xr.Dataset) -> Figure:
    """Measured less model over the cycle, before and after, with the band that the scatter leaves the mean."""
    every = courses(result)
    if not every:
        return _figures(result)
    pairs = panels(every)
    more = f", {len(pairs)} of {len(every)} curves" if len(pairs) < len(every) else ""
    sheet = new(f"Residuals, before and after{more}", result, height=1.0 + 1.75 * len(pairs))
    drive = str(result.attrs.get("drive", ""))
    angles = {condition: _angles(result, condition) for _, condition in pairs}
    turned = all(one is not None for one in angles.values())
    over: dict[int, Array] = {}
    for condition, angle in angles.items():
        phase = np.asarray(result["phase"].values[condition], float)
        over[condition] = angle if turned and angle is not None else phase
    ends = np.array([(np.nanmin(x), np.nanmax(x)) for x in over.values()])
    alike = bool(np.all(np.ptp(ends, axis=0) <= ALIKE * np.ptp(ends)))  # not of cycles driven forward and backward
    rows = sheet.subplots(len(pairs), 2, sharex=True if alike else "row", squeeze=False)
    for (left, right), (channel, condition) in zip(rows, pairs, strict=True):
        x = over[condition]
        _residual(left, result, (channel, condition), x, before=True)
        _residual(right, result, (channel, condition), x, before=False)
    for axes in rows[-1]:
        dress(axes, plain(f"drive angle {drive} [°]") if turned else "share of the cycle", axes.get_ylabel())
    for axes in rows[0]:
        legend(axes, least=1, lift=SUBTITLE)
    return sheet


def _angles(result: xr.Dataset, condition: int) -> Array | None:
    """Angle of the driver at each position, °; None where it names no position."""
    ends = attribute(result, "drive_range")
    if condition >= len(ends) or ends[condition] is None:
        return None
    first, last = ends[condition]
    phase = np.asarray(result["phase"].values[condition], float)
    return np.asarray(np.degrees(first + (last - first) * phase))


def courses(result: xr.Dataset) -> list[tuple[int, int]]:
    """(channel, condition) with courses over the cycle that were fitted."""
    return [
        (i, k)
        for i, _, _ in channels(result)
        for k in conditions(result, i)
        if np.count_nonzero(np.isfinite(curve_of(result, "residual_after", i, k))) > 1
    ]


def panels(every: list[tuple[int, int]]) -> list[tuple[int, int]]:
    """Those of the courses that are drawn: all, evenly chosen if there are many."""
    if len(every) <= MOST_PANELS:
        return every
    return [every[int(j)] for j in np.rint(np.linspace(0, len(every) - 1, MOST_PANELS))]


def _residual(axes: Axes, result: xr.Dataset, pair: tuple[int, int], x: Array, before: bool) -> None:
    """One course: before, with that after behind it, or after with the band, on its own scale."""
    channel, condition = pair
    _, name, unit = channels(result)[channel]
    start, end, spread = (
        curve_of(result, key, channel, condition)
        for key in ("residual_before", "residual_after", "residual_uncertainty")
    )
    shown_of = np.concatenate([start, end] if before else [end, COVERED * spread])
    factor, shown = prefixed(float(np.nanmax(np.abs(shown_of), initial=0.0)), unit)
    dress(axes, "", plain(f"{name} [{shown}]" if shown else name))
    axes.axhline(0, color=MUTED, linewidth=0.8, zorder=1.5)
    look: dict[str, Any] = {"marker": "o", "markersize": 2.0, "linewidth": 1.1}
    if before:
        axes.plot(x, start * factor, color=BEFORE, label="before", **look)
    elif np.any(np.isfinite(spread)):
        axes.fill_between(x, -COVERED * spread * factor, COVERED * spread * factor, color=SHADE, linewidth=0,
                          label=f"±{COVERED:g} u of the mean, by scatter", zorder=1)  # fmt: skip
    axes.plot(x, end * factor, color=AFTER, label="after", **look)
    axes.set_xlim(float(np.nanmin(x)), float(np.nanmax(x)))
    if before:
        axes.set_title(plain(names(result, "condition")[condition]), loc="right", fontsize=8, color=MUTED, pad=3)


def _figures(result: xr.Dataset) -> Figure:
    """Residuals of data with one figure a condition."""
    there = channels(result)
    sheet = new("Residuals, before and after", result, height=1.6 + 2.6 * len(there))
    rows = sheet.subplots(len(there), 1, sharex=True, squeeze=False)[:, 0]
    title, short = shortened(names(result, "condition"))
    every = sorted({k for i, _, _ in there for k in conditions(result, i)})
    for axes, (i, name, unit) in zip(rows, there, strict=True):
        own = conditions(result, i)
        before, after, spread = (
            np.array([curve_of(result, key, i, k)[0] for k in own])
            for key in ("residual_before", "residual_after", "residual_uncertainty")
        )
        factor, shown = prefixed(float(np.nanmax(np.abs([before, after]), initial=0.0)), unit)
        dress(axes, plain(title), plain(f"{name} [{shown}]" if shown else name))
        axes.axhline(0, color=MUTED, linewidth=0.8, zorder=1.5)
        x = np.searchsorted(every, own)
        axes.plot(x, before * factor, "D", color=BEFORE, markerfacecolor="none", markersize=5, label="before")
        axes.errorbar(x, after * factor, COVERED * np.nan_to_num(spread) * factor, fmt="o", color=AFTER, markersize=5,
                      capsize=3, label=f"after, ±{COVERED:g} u by scatter")  # fmt: skip
        many, ticks = len(every) > FEW, [plain(short[k]) for k in every]
        axes.set_xticks(range(len(every)), ticks, fontsize=7.5, rotation=90 if many else 0)
    legend(rows[0], least=1)
    return sheet


KINDS = {"intervals": intervals, "correlation": correlation, "residuals": residuals}

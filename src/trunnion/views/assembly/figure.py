"""The figure of whether a mechanism goes together: the clearance that it needs over the drive, and in which joints."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from trunnion.results.dataset import unit_of
from trunnion.results.quantities import prefixed, quantity
from trunnion.views.common.cycle import Abscissa, Array, column, names
from trunnion.views.common.figures import INK, MUTED, PALETTE, SHADE, along, curve, legend, new, style_of
from trunnion.views.common.lettering import plain

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

__all__ = ["figure"]

FITS = 0  # code of the status of a position that goes together
TOLD = 0.01  # of the need: a joint whose part is nowhere larger has no curve
RED = "#b3261e"


def figure(result: xr.Dataset) -> Figure:
    """Needed clearance of all pins over the drive; needed share of the stated clearances, if any; parts of the joints.

    Grey: where the stated clearances do not suffice.
    """
    over = _over(result)
    share = column(result, "needed_share")
    stated = share is not None and bool(np.any(np.isfinite(share) & (share > 0)))
    parted = bool(np.nanmax(result["uniform_part"].values, initial=0.0) > 0)
    count = 1 + stated + parted
    sheet = new("Clearance needed for assembly", result, 2.0 + 1.6 * count)
    panels = list(sheet.subplots(count, 1, sharex=True, squeeze=False)[:, 0])
    for axes in panels[: 1 + stated]:
        _shade(axes, result, over)
    _need(panels[0], result, over)
    if stated and share is not None:
        _share(panels[1], share, over)
    if parted:
        _parts(panels[-1], result, over)
    for axes in panels[:-1]:
        axes.set_xlabel("")
    return sheet


def _over(result: xr.Dataset) -> Abscissa:
    """The coordinate of the only driver if it runs one way, else time."""
    drivers, time = names(result, "driver"), np.asarray(result["time"].values, float)
    if len(drivers) == 1:
        unit = unit_of(result["drive_coordinate"], (0,))
        values = np.asarray(result["drive_coordinate"].values[0], float)
        steps = np.diff(values)
        if np.all(steps > 0) or np.all(steps < 0):
            factor, shown = prefixed(float(np.abs(values).max(initial=0.0)), unit)
            turn = float(steps[0]) * values.size if steps.size else 0.0
            closed = bool(result.attrs["periodic"]) and unit == "rad" and abs(abs(turn) - 2 * np.pi) < 1e-6
            of = "angle" if unit == "rad" else "slide"
            period = turn * factor if closed else 0.0
            return Abscissa(f"drive {of} {drivers[0]}", shown, values * factor, closed, period)
    factor, unit = prefixed(float(np.abs(time).max(initial=0.0)), "s")
    return Abscissa("time", unit, time * factor)


def _need(axes: Axes, result: xr.Dataset, over: Abscissa) -> None:
    """The clearance, the same in all pins, that each position needs, and the largest."""
    need = np.asarray(result["needed_clearance"].values, float)
    most = float(result["smallest_clearance"])
    known = need[np.isfinite(need)]
    factor, unit = prefixed(float(known.max(initial=0.0)), "m")
    along(axes, over, f"needed clearance [{unit}]")
    curve(axes, over, np.where(np.isfinite(need), need, np.nan) * factor, None, color=PALETTE[0], linewidth=2.0)
    if np.isfinite(most) and most > 0:
        axes.axhline(most * factor, color=MUTED, linewidth=0.9, linestyle=(0, (3, 2)))
        joints = result.attrs["assembling"]
        text = f"smallest clearance, the same in {joints}: {quantity(most, 'm')}"
        axes.annotate(plain(text), (0.01, most * factor), xycoords=("axes fraction", "data"), fontsize=8, color=INK,
                      xytext=(0, 3), textcoords="offset points")  # fmt: skip
        axes.set_ylim(0, 1.22 * most * factor)
        return
    axes.set_yticks([])
    axes.set_ylim(-0.1, 1)
    if known.size and most == 0:
        axes.text(0.5, 0.5, "no clearance is needed", transform=axes.transAxes, ha="center", fontsize=9, color=INK)


def _share(axes: Axes, share: Array, over: Abscissa) -> None:
    """The share of the stated clearances that each position needs; above 1 they do not suffice."""
    along(axes, over, "share of the stated")
    finite = np.where(np.isfinite(share), share, np.nan)
    curve(axes, over, finite, None, color=PALETTE[1], linewidth=2.0)
    axes.axhline(1.0, color=RED, linewidth=0.9, linestyle=(0, (3, 2)))
    axes.annotate("all of the stated clearances", (0.01, 1.0), xycoords=("axes fraction", "data"), fontsize=8,
                  color=RED, xytext=(0, 3), textcoords="offset points")  # fmt: skip
    axes.set_ylim(0, 1.2 * max(1.0, float(np.nanmax(finite, initial=0.0))))


def _parts(axes: Axes, result: xr.Dataset, over: Abscissa) -> None:
    """What each joint's clearance contributes to the need."""
    along(axes, over, "share of the joint [%]")
    parts = 100 * np.asarray(result["uniform_part"].values, float).sum(axis=1)
    for i, joint in enumerate(names(result, "joint")):
        if np.nanmax(parts[i], initial=0.0) > 100 * TOLD:
            look: dict[str, Any] = style_of(i)
            curve(axes, over, parts[i], joint, **look)
    most = float(np.nanmax(parts, initial=0.0))
    axes.set_ylim(0, min(105.0, 1.1 * most) if most > 0 else 105.0)
    legend(axes)


def _shade(axes: Axes, result: xr.Dataset, over: Abscissa) -> None:
    """Grey where the mechanism does not go together with the stated clearances, if they are enough somewhere."""
    # where they are nowhere enough the whole would be grey, which tells nothing
    short = np.asarray(result["status"].values) != FITS
    if short.all() or not short.any():
        return
    x = over.values
    half = abs(float(x[1] - x[0])) / 2 if x.size > 1 else 0.5
    for place in np.flatnonzero(short):
        axes.axvspan(float(x[place]) - half, float(x[place]) + half, color=SHADE, linewidth=0, zorder=0.5)

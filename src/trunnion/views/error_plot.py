"""Error envelopes over the run: how far points are from where they were meant to be, and what the outputs do wrong."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from trunnion.views.as_built import Output, angle_scale, losses, need, outputs, point_errors, worst_points
from trunnion.views.cycle import Abscissa, Array, abscissa, thin, usual_peak
from trunnion.views.figures import SHADE, along, curve, frame_peak, legend, new, shade, style_of
from trunnion.views.quantities import prefixed

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

__all__ = ["LOST", "error", "mark_losses"]

LOST = "#a1260d"  # the colour of what goes wrong, beside those of the curves


def error(result: xr.Dataset, ideal: xr.Dataset | None = None, worst_case: Mapping[str, Array] | None = None) -> Figure:
    """Errors against the mechanism without any: of the worst points, and of the joints of the ground, over the drive.

    worst_case: by joint, (position,) in rad or m: the most that the play of all joints can do to it, drawn as a band.
    """
    need(result, "errors", "error")
    over, found = abscissa(result), outputs(result)
    kinds = [kind for kind in ("rad", "m") if any(one.unit == kind for one in found)]
    figure = new("Errors of the mechanism as built", result, 2.6 + 2.1 * len(kinds))
    panels = figure.subplots(1 + len(kinds), 1, sharex=True, squeeze=False)[:, 0]
    _places(panels[0], result, over)
    for axes, kind in zip(panels[1:], kinds, strict=True):
        _transmission(axes, result, over, [one for one in found if one.unit == kind], worst_case or {})
    for axes in panels:
        mark_losses(axes, result, over)
        told = axes.get_legend_handles_labels()[1]
        if len(told) == 1:
            axes.set_title(told[0], fontsize=8.5, loc="left")
        legend(axes, most=4)
    for axes in panels[:-1]:
        axes.set_xlabel("")
    return figure


def _places(axes: Axes, result: xr.Dataset, over: Abscissa) -> None:
    """Sizes of the errors of place of the worst points, over the greatest of all points."""
    every, worst = point_errors(result), worst_points(result)
    scope = usual_peak(*every.values())
    factor, unit = prefixed(scope, "m")
    along(axes, over, f"error of place [{unit or 'm'}]")
    shade(axes, result, over)
    if every:
        top = np.max(list(every.values()), axis=0)
        x = over.values
        if over.closed:
            top, x = np.append(top, top[0]), np.append(x, x[0] + over.period)
        picked = thin(top)
        axes.fill_between(x[picked], 0, top[picked] * factor, color=SHADE, linewidth=0, zorder=1)
    for index, (key, size) in enumerate(worst.items()):
        curve(axes, over, size * factor, key, **style_of(index))
    most = max((float(np.nanmax(size)) for size in every.values()), default=0.0)
    frame_peak(axes, most, scope, factor, "m")


def _transmission(
    axes: Axes, result: xr.Dataset, over: Abscissa, found: list[Output], worst_case: Mapping[str, Array]
) -> None:
    """Errors of one unit, each with its worst case if that is known."""
    bounds = [worst_case[one.joint] for one in found if one.joint in worst_case]
    scope = usual_peak(*[one.error for one in found], *bounds)
    factor, unit = angle_scale(scope) if found[0].unit == "rad" else prefixed(scope, "m")
    noun = "rotation" if found[0].unit == "rad" else "slide"
    along(axes, over, f"transmission error,\n{noun} [{unit}]")
    shade(axes, result, over)
    for index, one in enumerate(found):
        look = style_of(index)
        if one.joint in worst_case:
            bound = worst_case[one.joint] * factor
            axes.fill_between(over.values, -bound, bound, color=look["color"], alpha=0.15, linewidth=0,
                              label=f"worst case of the play, {one.joint}")  # fmt: skip
        curve(axes, over, one.error * factor, one.joint, **look)
    axes.margins(y=0.08)
    frame_peak(axes, float(np.nanmax([np.nanmax(np.abs(one.error)) for one in found])), scope, factor, found[0].unit)


def mark_losses(axes: Axes, result: xr.Dataset, over: Abscissa) -> None:
    """A dotted line wherever a joint loses contact, in the legend with the joints."""
    found = losses(result)
    places = np.unique(np.concatenate(list(found.values()))) if found else np.empty(0, int)
    for number, place in enumerate(places):
        label = f"contact lost: {', '.join(found)}" if number == 0 else None
        axes.axvline(over.values[place], color=LOST, linewidth=0.9, linestyle=(0, (1, 1.6)), zorder=1.4, label=label)

"""Error envelopes over the run: how far points are from where they were meant to be, and what the outputs do wrong."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from trunnion.errors import MechanismError
from trunnion.results.quantities import prefixed
from trunnion.studies.play import play
from trunnion.views.common.cycle import Abscissa, Array, abscissa, column, names
from trunnion.views.common.figures import along, curve, frame_peak, legend, new, shade, style_of
from trunnion.views.common.lettering import plain
from trunnion.views.common.peaks import ease, usual_peak
from trunnion.views.cycle.deviations import Output, angle_scale, has, losses, need, outputs, point_errors, worst_points

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from trunnion.model.mechanism import Mechanism

__all__ = ["LOST", "error", "mark_losses", "with_worst_case"]

LOST = "#a1260d"  # the colour of what goes wrong, beside those of the curves


def with_worst_case(result: xr.Dataset, mechanism: Mechanism) -> xr.Dataset:
    """The result with the band in which the play of all joints holds the error of each output, if there is any play.

    `transmission_centre` and `transmission_reach` (joint, position), rad or m, NaN of joints that are no outputs: the
    error with every pin in the middle of its hole, and the most that all plays can add to it, to first order.
    """
    found = outputs(result) if has(result, "errors") else []
    if not found:
        return result
    measures = [f"{'slide' if one.unit == 'm' else 'rotation'}:{one.joint}" for one in found]
    try:
        free = play(mechanism, measures, result.sizes["position"])
    except MechanismError:  # no joint has a play
        return result
    joints = names(result, "joint")
    centre, reach = (np.full((len(joints), result.sizes["position"]), np.nan) for _ in range(2))
    for one, measure in zip(found, measures, strict=True):
        told = column(result, f"joint_{measure.split(':')[0]}", joint=one.joint)
        middle, most = (column(free, name, measure=measure) for name in ("value", "worst_case_total"))
        if told is None or middle is None or most is None:
            continue
        apart = middle - told
        turns = 2 * np.pi * np.round(apart / (2 * np.pi)) if one.unit == "rad" else 0.0
        centre[joints.index(one.joint)], reach[joints.index(one.joint)] = one.error + apart - turns, most
    if not np.nanmax(reach, initial=0.0) > 0:
        return result
    dims = ("joint", "position")
    return result.assign(transmission_centre=(dims, centre), transmission_reach=(dims, reach))


def error(result: xr.Dataset, ideal: xr.Dataset | None = None) -> Figure:
    """Errors against the mechanism without any: of the worst points, and of the joints of the ground, over the drive.

    The band of the worst case is drawn if the result has it; see `with_worst_case`.
    """
    need(result, "errors", "error")
    over, found = abscissa(result), outputs(result)
    kinds = [kind for kind in ("rad", "m") if any(one.unit == kind for one in found)]
    figure = new("Errors of the mechanism as built", result, 2.6 + 2.1 * len(kinds))
    panels = figure.subplots(1 + len(kinds), 1, sharex=True, squeeze=False)[:, 0]
    _places(panels[0], result, over)
    for axes, kind in zip(panels[1:], kinds, strict=True):
        _transmission(axes, result, over, [one for one in found if one.unit == kind])
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
    """Sizes of the errors of place of the worst points."""
    every, worst = point_errors(result), worst_points(result)
    scope = usual_peak(ease(result), *every.values())
    factor, unit = prefixed(scope, "m")
    along(axes, over, f"position error [{unit or 'm'}]")
    shade(axes, result, over)
    for index, (key, size) in enumerate(worst.items()):
        curve(axes, over, size * factor, key, **style_of(index))
    most = max((float(np.nanmax(size)) for size in every.values()), default=0.0)
    frame_peak(axes, most, scope, factor, "m")


def _transmission(axes: Axes, result: xr.Dataset, over: Abscissa, found: list[Output]) -> None:
    """Errors of one unit, each with its worst case if that is known."""
    bands = {one.joint: _band(result, one.joint) for one in found}
    edges = [edge for band in bands.values() for edge in band]
    scope = usual_peak(ease(result), *[one.error for one in found], *edges)
    factor, unit = angle_scale(scope) if found[0].unit == "rad" else prefixed(scope, "m")
    noun = "rotation" if found[0].unit == "rad" else "slide"
    along(axes, over, f"transmission error,\n{noun} [{unit}]")
    shade(axes, result, over)
    for index, one in enumerate(found):
        look = style_of(index)
        if bands[one.joint]:
            low, high = (_closed(over, edge * factor) for edge in bands[one.joint])
            label = f"worst case of the play, first order{f', {one.joint}' if len(found) > 1 else ''}"
            x = _closed(over, over.values, over.period)
            axes.fill_between(x, low, high, color=look["color"], alpha=0.15, linewidth=0, label=plain(label))
        curve(axes, over, one.error * factor, one.joint, **look)
    axes.margins(y=0.08)
    most = max(float(np.nanmax(np.abs(values))) for values in [*(one.error for one in found), *edges])
    frame_peak(axes, most, scope, factor, found[0].unit)


def _band(result: xr.Dataset, joint: str) -> list[Array]:
    """Lower and upper edge of what the play can do to an output; nothing if it is not known."""
    centre, reach = (column(result, f"transmission_{name}", joint=joint) for name in ("centre", "reach"))
    if centre is None or reach is None or not np.isfinite(centre + reach).any():
        return []
    return [centre - reach, centre + reach]


def _closed(over: Abscissa, values: Array, more: float = 0.0) -> Array:
    """The values, over a whole turn led on to the first."""
    return np.append(values, values[0] + more) if over.closed else values


def mark_losses(axes: Axes, result: xr.Dataset, over: Abscissa) -> None:
    """A dotted line wherever a joint loses contact, in the legend with the joints."""
    found = losses(result)
    places = np.unique(np.concatenate(list(found.values()))) if found else np.empty(0, int)
    for number, place in enumerate(places):
        label = f"contact lost: {', '.join(found)}" if number == 0 else None
        axes.axvline(over.values[place], color=LOST, linewidth=0.9, linestyle=(0, (1, 1.6)), zorder=1.4, label=label)

"""How the pins lie in their holes over the run: β and ξ of pins, the offsets of guides; no line across a jump."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from matplotlib.ticker import MultipleLocator
from numpy.typing import NDArray

from trunnion.errors import Finding, MechanismError
from trunnion.results.quantities import prefixed
from trunnion.views.common.cycle import Abscissa, Array, abscissa, column, names
from trunnion.views.common.figures import PALETTE, along, curve, legend, new, shade, style_of
from trunnion.views.common.lettering import plain
from trunnion.views.cycle.deviations import JUMP, NOWHERE, Seats, broken, continued, losses, need, seated
from trunnion.views.cycle.deviations_plot import LOST

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

__all__ = ["beta", "described"]

# two curves that often coincide: one broad and pale, one thin and dashed over it
ENDS: tuple[dict[str, Any], ...] = ({"linewidth": 4.0, "alpha": 0.4}, {"linewidth": 1.4, "linestyle": (0, (5, 2))})
NARROW = 20.0  # °; angles that vary by less are shown without the rest of the turn


class Curve(NamedTuple):
    """One curve of a panel: joint, label, values in the panel's unit, and its look."""

    joint: str
    label: str
    values: Array
    look: dict[str, Any]


class SeatPanel(NamedTuple):
    """A title with its unit, what is a jump in that unit, and the curves."""

    title: str
    jump: float
    curves: list[Curve]
    angles: bool = True


def beta(result: xr.Dataset, ideal: xr.Dataset | None = None) -> Figure:
    """β and ξ of every pin in space, ξ of those of the plane, the offsets of both ends of a guide of the plane.

    Jumps are not crossed; crosses mark the positions without contact.
    """
    need(result, "seats", "beta")
    panels = _panels(result)
    if not panels:
        what = "the seats of balls are directions, not angles: there is no figure 'beta'"
        raise MechanismError(Finding(what, "--kind", "see the figure 'seat'"))
    over, lost = abscissa(result), losses(result)
    figure = new("Seats over the run", result, 1.4 + 2.3 * len(panels))
    grid = figure.subplots(len(panels), 1, sharex=True, squeeze=False)[:, 0]
    for axes, panel in zip(grid, panels, strict=True):
        along(axes, over, panel.title)
        shade(axes, result, over)
        for one in panel.curves:
            _draw(axes, over, panel, one, np.concatenate([NOWHERE, *lost.values()]))
        _cross(axes, over, panel, lost)
        if panel.angles:
            _ticks(axes, panel.curves)
        else:
            axes.margins(y=0.12)
        if len(panel.curves) == 1 and not lost:  # else the legend says whose it is
            axes.set_title(plain(panel.curves[0].label), fontsize=8.5, loc="left")
    for axes in grid[:-1]:
        axes.set_xlabel("")
    for axes in grid:
        legend(axes)
    return figure


def described(result: xr.Dataset) -> bool:
    """Whether any seat has angles or offsets to draw over the run."""
    return bool(_panels(result))


def _panels(result: xr.Dataset) -> list[SeatPanel]:
    """The panels that have any curve."""
    order = {joint: index for index, joint in enumerate(names(result, "joint"))}
    found: dict[str, list[Curve]] = {"β": [], "ξ": []}
    guides: list[Seats] = []
    for seat in seated(result):
        both = [column(result, f"seat_{name}", joint=seat.joint) for name in ("beta", "xi")]
        if seat.planar_guide:
            guides.append(seat)
            continue
        if both[0] is None or both[1] is None or not np.isfinite(both[0]).any():
            continue
        for sign, values in zip("βξ", np.degrees(continued(both[0], both[1])), strict=True):
            if sign == "ξ" or len(seat.offsets) == 2:
                found[sign].append(Curve(seat.joint, seat.joint, values, style_of(order[seat.joint])))
    meaning = {"β": "β, between the seats\nof the ends [°]", "ξ": "ξ, direction of\nthe seat [°]"}
    panels = [SeatPanel(meaning[sign], float(np.degrees(JUMP)), curves) for sign, curves in found.items() if curves]
    if guides:
        scale, unit = prefixed(max(seat.clearance for seat in guides), "m")
        curves = [
            Curve(seat.joint, f"{seat.joint}, end {end + 1}", seat.offsets[end, 1] * scale,
                  {"color": PALETTE[order[seat.joint] % len(PALETTE)]} | ENDS[end])
            for seat in guides
            for end in range(2)
        ]  # fmt: skip
        jump = scale * min(seat.clearance for seat in guides)
        panels.append(SeatPanel(f"offset across\nthe guide [{unit}]", jump, curves, angles=False))
    return panels


def _draw(axes: Axes, over: Abscissa, panel: SeatPanel, one: Curve, lost: NDArray[np.intp]) -> None:
    x, y = over.values, one.values
    if over.closed:
        x, y = np.append(x, x[0] + over.period), np.append(y, y[0])
    cut_x, cut_y = broken(x, y, panel.jump, lost)
    if over.closed and np.isnan(cut_y[-2]):  # a jump on closing: the last point is the first once more
        cut_x, cut_y = cut_x[:-2], cut_y[:-2]
    curve(axes, replace(over, values=cut_x, closed=False), cut_y, one.label, **one.look)


def _cross(axes: Axes, over: Abscissa, panel: SeatPanel, lost: Mapping[str, NDArray[np.intp]]) -> None:
    """Crosses on the curves where their joints lose contact."""
    label: str | None = "contact lost"
    for one in panel.curves:
        places = lost.get(one.joint, np.empty(0, int))
        known = places[np.isfinite(one.values[places])]
        if known.size:
            look: dict[str, Any] = {"markersize": 6, "markeredgewidth": 1.5, "linestyle": "none", "zorder": 4}
            axes.plot(over.values[known], one.values[known], "x", color=LOST, label=label, **look)
            label = None


def _ticks(axes: Axes, curves: list[Curve]) -> None:
    """Angles at round values; where all of them stay near one angle far from 0, the axis shows what varies."""
    known = np.concatenate([one.values[np.isfinite(one.values)] for one in curves])
    if known.size and np.ptp(known) < NARROW:
        margin = max(0.12 * float(np.ptp(known)), 0.5)
        axes.set_ylim(float(known.min()) - margin, float(known.max()) + margin)
    low, high = axes.get_ylim()
    span = high - low
    step = next((one for one in (1, 2, 5, 10, 15, 30, 45) if span / one <= 8), 90)
    if span > 4:
        axes.yaxis.set_major_locator(MultipleLocator(step))

"""How near to locking a mechanism is over the drive: margin, critical multiples, efficiency forward and backward."""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from trunnion.cycle.locking import HELD_AND_DRIVEN, LockingState
from trunnion.errors import Finding, MechanismError
from trunnion.results.attributes import attribute
from trunnion.solve.friction_method import MARGIN
from trunnion.views.common.cycle import Abscissa, Array, abscissa, column, names
from trunnion.views.common.figures import INK, PALETTE, along, curve, legend, new, shade, style_of
from trunnion.views.common.joined import joined

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

__all__ = ["has_friction", "locking"]

# what is shaded: values of `locking_state` and the colour; over that of `shade`, which says why there is no answer
STATES = (
    (LockingState.RUNS, "#eef0f3"),
    (LockingState.BACKDRIVABLE, "#cfe9dd"),
    (LockingState.SELF_LOCKING, "#fbe3c4"),
    (LockingState.SELF_LOCKING_FORWARD, "#f4bf7f"),
    (LockingState.DRIVEN_ON, "#c9dff3"),
    (LockingState.LOCKED_BACKWARD, "#e0cdea"),
    (LockingState.LOCKED, "#f3c4bf"),
    (LockingState.JAMMED, "#dea8a3"),
    (LockingState.UNSOLVED, "#c6ccd3"),
)
LEAST_TOP = 2.0  # of the axis of the margin, so that 1 does not lie on its frame


def has_friction(result: xr.Dataset) -> bool:
    """Whether the locking margin is known anywhere, and some joint takes power."""
    margin, lost = column(result, "locking_margin"), column(result, "friction_power")
    if margin is None or lost is None:
        return False
    rubs = bool(np.any(np.nan_to_num(lost) != 0)) or bool(np.any(margin < 1))
    return rubs and not bool(np.all(np.isnan(margin)))


def locking(result: xr.Dataset, ideal: xr.Dataset | None = None) -> Figure:
    """The locking margin over the drive above the efficiency; locked ranges are shaded.

    Of a result of `locking` also the critical multiple of each joint, and the efficiency backward.
    """
    if not has_friction(result):
        raise MechanismError(Finding("no joint has friction, so nothing can lock", "locking", "state friction"))
    over = abscissa(result)
    drawn = any(
        np.isfinite(result[name].values).any() for name in ("locking_margin", "critical_multiple") if name in result
    )
    centred = "; ranges: pins centred" * ("seat_offset" in result and "locking_state" in result)
    figure = new(f"Locking by friction{centred}", result, 6.2 if drawn else 5.2)
    margin, efficiency = figure.subplots(2, 1, sharex=True, height_ratios=(3, 2) if drawn else (1, 2))
    _margin(margin, result, over)
    _efficiency(efficiency, result, over)
    for axes in (margin, efficiency):
        _states(axes, result, over, named=axes is margin)
        shade(axes, result, over)
    margin.set_xlabel("")
    legend(margin, least=1)
    legend(efficiency)
    return figure


def _margin(axes: Axes, result: xr.Dataset, over: Abscissa) -> None:
    margin = column(result, "locking_margin")
    assert margin is not None  # `has_friction`
    joints = {joint: column(result, "critical_multiple", joint=joint) for joint in names(result, "joint")}
    known = {joint: values for joint, values in joints.items() if values is not None and np.isfinite(values).any()}
    every = np.concatenate([margin, *known.values()])
    largest = float(np.max(every[np.isfinite(every)], initial=0.0))
    reached = bool(np.any(np.isinf(every))) or largest >= MARGIN
    top = MARGIN if reached else max(1.1 * largest, LEAST_TOP)
    searched = f", searched to {MARGIN:g}" if reached and largest else ""
    along(axes, over, f"times the friction{searched}", zero=False)
    axes.set_ylim(0.0, top)
    never = f": more than {MARGIN:g}" if not np.isfinite(margin).any() else ""
    curve(axes, over, _shown(margin), f"locking margin, all friction{never}", color=INK, linewidth=2.0)
    for label, first, values in joined({joint: _shown(values) for joint, values in known.items()}):
        curve(axes, over, values, f"{label} alone", linewidth=1.3, **style_of(first))
    if not largest:  # nothing to draw
        told = f"more than {MARGIN:g} at every position"
        axes.text(0.5, 0.5, told, ha="center", va="center", transform=axes.transAxes)
    axes.axhline(1.0, color=INK, linewidth=1.0, linestyle=(0, (3, 2)), zorder=1.6, label="locks at 1")


def _shown(values: Array) -> Array:
    """A multiple that is not finite is drawn nowhere."""
    return np.where(np.isfinite(values), values, np.nan)


def _efficiency(axes: Axes, result: xr.Dataset, over: Abscissa) -> None:
    along(axes, over, "efficiency [%]")
    ahead, back = (_within(column(result, name)) for name in ("efficiency_instant", "efficiency_reverse_instant"))
    if ahead is not None:
        curve(axes, over, 100 * ahead, "forward", color=PALETTE[0])
    if back is not None and np.isfinite(back).any():
        curve(axes, over, 100 * back, "backward, by the useful loads", color=PALETTE[2], linestyle=(0, (6, 2)))
    axes.set_ylim(*_limits([one for one in (ahead, back) if one is not None]))


def _within(values: Array | None) -> Array | None:
    """An efficiency beyond ±1 is that of a driver that hardly works, beside springs and masses: it is not drawn."""
    return None if values is None else np.where(np.abs(values) <= 1 + 1e-9, values, np.nan)


def _limits(curves: list[Array]) -> tuple[float, float]:
    low = min((float(np.nanmin(one)) for one in curves if np.isfinite(one).any()), default=0.0)
    return min(0.0, max(100 * low * 1.05, -105.0)), 103.0


def _states(axes: Axes, result: xr.Dataset, over: Abscissa, named: bool) -> None:
    """The ranges of a result of `locking`, in their colours, and where the drive effort changes sign; named: for the
    legend."""
    if "locking_state" not in result:
        return
    rows = [row for row in attribute(result, "locking_ranges", '{"rows": []}')["rows"] if row["state"]]
    for state, colour in STATES:
        alike = [row for row in rows if row["state"] == state.name.lower()]
        for number, row in enumerate(alike):
            label = state.short if named and number == 0 else None
            axes.axvspan(*_places(result, over, row["times"]), color=colour, linewidth=0, zorder=0.55, label=label)
    both = {state.name.lower() for state in HELD_AND_DRIVEN}
    label = "drive effort changes sign" if named else None
    for before, after in pairwise(rows):
        if {before["state"], after["state"]} == both:
            place = _places(result, over, after["times"])[0]
            axes.axvline(place, color=INK, linewidth=1.0, linestyle=(0, (1, 2)), zorder=1.5, label=label)
            label = None


def _places(result: xr.Dataset, over: Abscissa, times: list[float]) -> Array:
    """Where times, s, are on the axis, up to a step beyond the last position, as in a motion that comes again."""
    time, values = result["time"].values, over.values
    if len(time) > 1:
        time, values = (np.append(row, 2 * row[-1] - row[-2]) for row in (time, values))
    return np.interp(times, time, values)

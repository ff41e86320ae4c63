"""A motion in time in figures: speed, effort, reactions and energy over time, with the events marked; phase plot."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np

from trunnion.errors import Finding, MechanismError
from trunnion.results.quantities import prefixed
from trunnion.views.common.cycle import Abscissa, abscissa, names
from trunnion.views.common.figures import MUTED, PALETTE, along, curve, dress, legend, new, style_of
from trunnion.views.common.lettering import plain
from trunnion.views.motion import contacts
from trunnion.views.motion.shown import OF_IMPACTS, Shown, drivers_of, energies, shown

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

__all__ = ["KINDS", "check_kind", "figure", "sheet"]

PANEL = 2.6  # height, inches
LINE, LETTER = 9.5, 0.009  # of an event's word: points from row to row, share of the axes' width a letter
MOST_MARKED = 12  # events drawn; of more, marks would hide the curves


def figure(result: xr.Dataset, kind: str = "sheet") -> Figure:
    """One figure: of KINDS or OWN, or `sheet` with all over time."""
    check_kind(kind)
    if kind == "sheet":
        return sheet(result)
    contacts.refuse(result, kind)
    if kind in OWN:
        return OWN[kind](result)
    title, draw = KINDS[kind]
    made = new(title, result, height=4.3)
    _panel(made.subplots(), shown(result), draw)
    return made


def check_kind(kind: str) -> None:
    """MechanismError if there is no such kind of figure."""
    known = ("sheet", *KINDS, *OWN)
    if kind not in known:
        raise MechanismError(Finding(f"there is no figure '{kind}'", "--kind", f"use {', '.join(known)}"))


def sheet(result: xr.Dataset) -> Figure:
    """Everything over time, one panel under the other."""
    motion = shown(result)
    idle = () if np.any(motion.rows["drive_effort"].values) else ("effort",)  # nothing drives it
    left_out = ("phase", *idle, *(() if contacts.in_play(result) else contacts.OF_CONTACTS))
    over_time = {kind: one for kind, one in KINDS.items() if kind not in left_out}
    made = new("Motion in time", result, height=1.0 + PANEL * len(over_time))
    panels = made.subplots(len(over_time), 1, squeeze=False)[:, 0]
    for axes, (_, draw) in zip(panels, over_time.values(), strict=True):
        _panel(axes, motion, draw)
        if axes is not panels[-1]:
            axes.set_xlabel("")
    return made


def _panel(axes: Axes, motion: Shown, draw: Callable[[Axes, xr.Dataset, Abscissa], None]) -> None:
    over = abscissa(motion.rows)
    draw(axes, motion.rows, over)
    rows = _events(axes, motion, over) if draw is not _phase else 0
    legend(axes, lift=LINE * rows)


def _speed(axes: Axes, result: xr.Dataset, over: Abscissa) -> None:
    drivers = drivers_of(result)
    unit = "rad/s" if drivers[0][2] == "N m" else "m/s"
    along(axes, over, f"speed [{unit}]")
    for k, (i, name, effort) in enumerate(drivers):
        own = "rad/s" if effort == "N m" else "m/s"
        label = name if own == unit else f"{name} [{own}]"
        curve(axes, over, result["drive_rate"].values[i], label, **style_of(k))


def _effort(axes: Axes, result: xr.Dataset, over: Abscissa) -> None:
    drivers = drivers_of(result)
    factor, label = prefixed(_largest(result["drive_effort"].values), drivers[0][2])
    along(axes, over, f"drive {'torque' if drivers[0][2] == 'N m' else 'force'} [{label}]")
    for k, (i, name, _) in enumerate(drivers):
        curve(axes, over, result["drive_effort"].values[i] * factor, name, **style_of(k))


def _reactions(axes: Axes, result: xr.Dataset, over: Abscissa) -> None:
    sizes = np.sqrt(np.sum(result["reaction_force"].values ** 2, axis=1))
    factor, label = prefixed(_largest(sizes), "N")
    along(axes, over, f"reaction [{label}]")
    for k, joint in enumerate(names(result, "joint")):
        if _largest(sizes[k]) > 0:
            curve(axes, over, sizes[k] * factor, joint, **style_of(k))


def _energy(axes: Axes, result: xr.Dataset, over: Abscissa) -> None:
    known = energies(result)
    factor, label = prefixed(max((_largest(values) for *_, values in known), default=0.0), "J")
    along(axes, over, f"energy [{label}]")
    for k, (_, text, values) in enumerate(known):
        curve(axes, over, values * factor, text, **style_of(k))


def _phase(axes: Axes, result: xr.Dataset, over: Abscissa) -> None:
    drivers = drivers_of(result)
    turns = drivers[0][2] == "N m"
    dress(axes, f"coordinate [{'rad' if turns else 'm'}]", f"speed [{'rad/s' if turns else 'm/s'}]")
    for k, (i, name, _) in enumerate(drivers):
        q, rate = result["drive_coordinate"].values[i], result["drive_rate"].values[i]
        axes.plot(q, rate, label=plain(name), linewidth=1.6, **style_of(k))
        known = np.flatnonzero(np.isfinite(q))
        axes.plot(q[known[:1]], rate[known[:1]], "o", color=PALETTE[k % len(PALETTE)], label="start" if not k else None)


def _largest(values: Any) -> float:
    return float(np.nanmax(np.abs(values), initial=0.0))


def _events(axes: Axes, motion: Shown, over: Abscissa) -> int:
    """Thin lines where something happens, with words above the axes, each in the lowest row where it meets no other;
    how many rows there are.
    """
    events = [one for one in motion.events if one.word not in OF_IMPACTS]  # the curves show these
    last = float(motion.rows["time"].values[-1])
    if len(events) > MOST_MARKED or not last > 0:
        return 0
    ends: list[float] = []  # of what stands in each row, as shares of the axes' width
    low, high = axes.get_xlim()
    for one in events:
        at = over.values[-1] * min(one.time, last) / last
        place, half = (at - low) / (high - low), 0.5 * LETTER * (len(one.word) + 2)
        middle = min(max(place, half), 1.0 - half)
        row = next((k for k, end in enumerate(ends) if end <= middle - half), len(ends))
        ends[row : row + 1] = [middle + half]
        axes.axvline(at, color=MUTED, linewidth=0.8, linestyle=(0, (3, 2)), zorder=1.2)
        axes.annotate(
            one.word, (middle, 1.0), xycoords="axes fraction", xytext=(0, 2 + LINE * row), textcoords="offset points",
            fontsize=7.5, color=MUTED, va="bottom", ha="center",
        )  # fmt: skip
    return len(ends)


# a kind of figure: its title, and what draws it into axes
KINDS: dict[str, tuple[str, Callable[[Axes, Any, Abscissa], None]]] = {
    "speed": ("Speed", _speed),
    "effort": ("Drive effort", _effort),
    "reactions": ("Reactions", _reactions),
    "energy": ("Energy account", _energy),
    "contacts": ("Contact forces", contacts.forces),
    "gaps": ("Gaps", contacts.gaps),
    "phase": ("Speed over coordinate", _phase),
}
# kinds of figures with axes of their own
OWN: dict[str, Callable[[Any], Figure]] = {"orbit": contacts.orbit, "spectrum": contacts.spectrum}

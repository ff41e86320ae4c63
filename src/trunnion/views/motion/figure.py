"""A motion in time in figures: speed, effort, reactions and energy over time, with the events marked; phase plot;
contacts of joints in play."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from trunnion.errors import Finding, MechanismError
from trunnion.results.attributes import attribute
from trunnion.results.quantities import prefixed, quantity
from trunnion.views.axis import Abscissa, Array, abscissa, members, names, peak
from trunnion.views.charts import (
    Axis,
    Chart,
    Legend,
    Line,
    Look,
    Mark,
    Panel,
    Plot,
    Ring,
    Rule,
    check_kind,
    nth,
)
from trunnion.views.motion.shown import OF_IMPACTS, Shown, drivers_of, energies, shown

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["KINDS", "OF_CONTACTS", "check_contacts", "figure", "pictures", "sheet"]

PANEL = 2.6  # height, inches
DASHES: Any = ("dashed", "dotted", "dash-dot", "solid")  # of events
MOST_MARKED = 12  # events drawn; of more, marks would hide the curves
OF_CONTACTS = ("contacts", "gaps", "orbit")  # kinds of figures that need a joint in play
LONGEST = 0.6  # of the clearance: how far the largest force is drawn beyond the wall
MOST_SPOKES = 240  # forces drawn around a hole
SIDE = 4.6  # of the figure of a hole, inches


def figure(result: xr.Dataset, kind: str = "sheet") -> Plot:
    """One figure of KINDS; `sheet` has all over time."""
    check_kind(kind, KINDS)
    if kind == "sheet":
        return sheet(result)
    check_contacts(kind, "contact" in result.dims)
    if kind == "orbit":
        panels = [Panel("", [_hole(result, k)], SIDE) for k in _pins(result)]
        if not panels:
            what = "no pin of this motion is in play"
            raise MechanismError(Finding(what, "--kind orbit", "use --kind gaps for guides"))
        return Plot("Pin in its hole", panels, len(panels), 0.4 + SIDE * len(panels))
    title, build = OVER_TIME[kind]
    motion = shown(result)
    chart = build(motion.rows, abscissa(motion.rows))
    chart = chart if kind == "phase" else _with_events(chart, motion)
    return Plot(title, [Panel("", [chart], 3.75)])


def check_contacts(kind: str, in_play: bool) -> None:
    """MechanismError for a figure of contacts where no joint is in play."""
    if kind in OF_CONTACTS and not in_play:
        remedy = "state a contact of a joint with play, such as contact: {restitution: 0.8, modulus: 210 GPa}"
        raise MechanismError(Finding("no joint of this motion is in play", f"--kind {kind}", remedy))


def sheet(result: xr.Dataset) -> Plot:
    """Everything over time, one panel under the other."""
    motion = shown(result)
    idle = () if np.any(motion.rows["drive_effort"].values) else ("effort",)  # nothing drives it
    left_out = ("phase", *idle, *(() if "contact" in result.dims else OF_CONTACTS))
    over = abscissa(motion.rows)
    charts = [_with_events(build(motion.rows, over), motion)
              for kind, (_, build) in OVER_TIME.items() if kind not in left_out]  # fmt: skip
    return Plot("Motion in time", [Panel("", charts, 0.4 + PANEL * len(charts))])


def pictures(result: xr.Dataset) -> Iterator[tuple[str, Plot]]:
    """What a report has beside the courses, with what it shows: the ways of pins in their holes."""
    if "contact" in result.dims and _pins(result):
        yield "The ways of the pins in their holes, with the forces on the walls", figure(result, "orbit")


# ---- over time ----------------------------------------------------------------------------------------------------


def _curves(over: Abscissa, title: str, unit: str, rows: dict[str, Array]) -> Chart:
    """Curves of one unit over time."""
    factor, label = prefixed(peak(*rows.values()), unit)
    lines = [Line(over.values, values * factor, name, nth(k)) for k, (name, values) in enumerate(rows.items())]
    return Chart(over, Axis(f"{title} [{label}]"), lines, zero=True)


def _of_drivers(result: xr.Dataset, over: Abscissa, title: str, variable: str, units: tuple[str, str]) -> Chart:
    """A variable of every driver; units: of those that turn and those that slide, of which the first has the axis."""
    drivers = [(i, name, units[effort != "N m"]) for i, name, effort in drivers_of(result)]
    first = drivers[0][2]
    rows = {name if unit == first else f"{name} [{unit}]": result[variable].values[i] for i, name, unit in drivers}
    return _curves(over, title, first, rows)


def _reactions(result: xr.Dataset, over: Abscissa) -> Chart:
    sizes = {name: np.linalg.norm(force, axis=0) for name, force in members(result, "reaction_force", "joint").items()}
    return _curves(over, "reaction", "N", {name: size for name, size in sizes.items() if peak(size) > 0})


def _phase(result: xr.Dataset, over: Abscissa) -> Chart:
    drivers, marks = drivers_of(result), list[Mark]()
    units = ("rad", "rad/s") if drivers[0][2] == "N m" else ("m", "m/s")
    for k, (i, name, _) in enumerate(drivers):
        q, rate = result["drive_coordinate"].values[i], result["drive_rate"].values[i]
        first = np.flatnonzero(np.isfinite(q))[:1]
        marks.append(Line(q, rate, name, nth(k)))
        marks.append(Line(q[first], rate[first], None if k else "start", Look(k, dash="none", mark="o", size=6.0)))
    return Chart(Axis(f"coordinate [{units[0]}]"), Axis(f"speed [{units[1]}]"), marks)


def _with_events(chart: Chart, motion: Shown) -> Chart:
    """The chart with thin lines where something happens; what, stands in the legend."""
    events = [event for event in motion.events if event.word not in OF_IMPACTS]  # the curves show these
    words = list(dict.fromkeys(event.word for event in events))
    over, last = abscissa(motion.rows), float(motion.rows["time"].values[-1])
    if len(events) > MOST_MARKED or not last > 0:
        return chart
    looks = [Look("muted", 0.9, DASHES[k % len(DASHES)], order=1.2) for k in range(len(words))]
    marks = list[Mark]()
    for k, event in enumerate(events):
        first = event.word not in [before.word for before in events[:k]]
        at, look = float(over.values[-1] * min(event.time, last) / last), looks[words.index(event.word)]
        marks.append(Rule(at, event.word if first else None, look))
    return replace(chart, marks=[*chart.marks, *marks], legend=Legend(1))


# ---- contacts -----------------------------------------------------------------------------------------------------


def _pins(result: xr.Dataset) -> list[int]:
    """The contacts that are pins in holes: of a guide there are four to a joint."""
    joints = set(attribute(result, "contact_pins"))
    return [k for k, contact in enumerate(names(result, "contact")) if contact in joints]


def _hole(result: xr.Dataset, k: int) -> Chart:
    x, y = result["contact_offset"].values[k][:2]
    gap, force = result["contact_gap"].values[k], result["contact_normal_force"].values[k]
    size = np.hypot(x, y)
    clearance = float(np.nanmedian(gap + size))
    factor, label = prefixed(clearance, "m")
    marks: list[Mark] = [Ring((0.0, 0.0), clearance * factor, Look("muted", 1.0))]
    touching = np.flatnonzero(result["contact_touching"].values[k] == 1)
    largest = float(np.nanmax(force, initial=0.0))
    for i in touching[:: max(1, len(touching) // MOST_SPOKES)] if largest > 0 else ():
        out = np.array([1.0, 1.0 + LONGEST * force[i] / largest]) * clearance * factor / size[i]
        marks.append(Line(x[i] * out, y[i] * out, None, Look(1, 1.0, alpha=0.6, order=1.5)))
    marks.append(Line(x * factor, y * factor, None, Look(0, 1.0)))
    marks.append(Line(x[:1] * factor, y[:1] * factor, None, Look(0, dash="none", mark="o", size=4.0)))
    room = 1.08 * clearance * factor * (1 + LONGEST)
    across, up = (Axis(f"along {axis} of the hole [{label}]", (-room, room)) for axis in "xy")
    title = f"{names(result, 'contact')[k]}: largest force {quantity(largest, 'N')}"
    return Chart(across, up, marks, title=title, equal=True, legend=None)


# a kind of figure over time: its title, and what makes its chart
OVER_TIME: dict[str, tuple[str, Callable[[Any, Abscissa], Chart]]] = {
    "speed": ("Speed", lambda rows, over: _of_drivers(rows, over, "speed", "drive_rate", ("rad/s", "m/s"))),
    "effort": ("Drive effort",
               lambda rows, over: _of_drivers(rows, over, "drive effort", "drive_effort", ("N m", "N"))),
    "reactions": ("Reactions", _reactions),
    "energy": ("Energy account",
               lambda rows, over: _curves(over, "energy", "J", {text: row for _, text, row in energies(rows)})),
    "contacts": ("Contact forces", lambda rows, over: _curves(over, "contact force", "N",
                                                              members(rows, "contact_normal_force", "contact"))),
    # below 0 the surfaces press each other in
    "gaps": ("Gaps", lambda rows, over: _curves(over, "gap", "m", members(rows, "contact_gap", "contact"))),
    "phase": ("Speed over coordinate", _phase),
}  # fmt: skip
KINDS = ("sheet", *OVER_TIME, "orbit")

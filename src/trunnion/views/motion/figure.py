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
from trunnion.views import draw
from trunnion.views.charts import (
    Axis,
    Chart,
    Legend,
    Line,
    Look,
    Mark,
    Note,
    Panel,
    Plot,
    Ring,
    Rule,
    check_kind,
    joined,
    nth,
)
from trunnion.views.common.cycle import Abscissa, Array, abscissa, members, names
from trunnion.views.common.peaks import peak
from trunnion.views.motion.shown import OF_IMPACTS, Shown, drivers_of, energies, shown

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

__all__ = ["KINDS", "OF_CONTACTS", "check_contacts", "figure", "pictures", "sheet"]

PANEL = 2.6  # height, inches
LINE, LETTER = 9.5, 0.009  # of an event's word: points from row to row, share of the axes' width a letter
MOST_MARKED = 12  # events drawn; of more, marks would hide the curves
OF_CONTACTS = ("contacts", "gaps", "orbit", "spectrum")  # kinds of figures that need a joint in play
LONGEST = 0.6  # of the clearance: how far the largest force is drawn beyond the wall
MOST_SPOKES = 240  # forces drawn around a hole
DEEPEST = 1e-4  # of the largest amplitude: the lowest that is drawn
RESOLVED = 4.0  # rows in a contact whose force is resolved
SIDE = 4.6  # of the figure of a hole, inches


def figure(result: xr.Dataset, kind: str = "sheet") -> Figure:
    """One figure of KINDS; `sheet` has all over time."""
    check_kind(kind, KINDS)
    if kind == "sheet":
        return sheet(result)
    check_contacts(kind, _in_play(result))
    if kind in OWN:
        return draw.plot(OWN[kind](result), result)
    title, build = OVER_TIME[kind]
    motion = shown(result)
    chart = build(motion.rows, abscissa(motion.rows))
    chart = chart if kind == "phase" else _with_events(chart, motion)
    return draw.plot(Plot(title, [Panel("", [chart], 3.75)]), result)


def check_contacts(kind: str, in_play: bool) -> None:
    """MechanismError for a figure of contacts where no joint is in play."""
    if kind in OF_CONTACTS and not in_play:
        remedy = "state a contact of a joint with play, such as contact: {restitution: 0.8, modulus: 210 GPa}"
        raise MechanismError(Finding("no joint of this motion is in play", f"--kind {kind}", remedy))


def sheet(result: xr.Dataset) -> Figure:
    """Everything over time, one panel under the other."""
    motion = shown(result)
    idle = () if np.any(motion.rows["drive_effort"].values) else ("effort",)  # nothing drives it
    left_out = ("phase", *idle, *(() if _in_play(result) else OF_CONTACTS))
    over = abscissa(motion.rows)
    charts = [_with_events(build(motion.rows, over), motion)
              for kind, (_, build) in OVER_TIME.items() if kind not in left_out]  # fmt: skip
    return draw.plot(Plot("Motion in time", [Panel("", charts, 0.4 + PANEL * len(charts))]), result)


def pictures(result: xr.Dataset) -> Iterator[tuple[str, Figure]]:
    """What a report has beside the courses, with what it shows: the ways of pins in their holes, and the spectrum."""
    if _in_play(result) and _pins(result):
        yield "The ways of the pins in their holes, with the forces on the walls", figure(result, "orbit")
    if "frequency" in result.dims:
        yield "Amplitude of the contact forces over frequency", figure(result, "spectrum")


# ---- over time ----------------------------------------------------------------------------------------------------


def _curves(over: Abscissa, title: str, unit: str, rows: dict[str, Array]) -> Chart:
    """Curves of one unit over time; those that coincide are one."""
    lines = joined([Line(over.values, values, name, nth(k)) for k, (name, values) in enumerate(rows.items())])
    factor, label = prefixed(peak(*rows.values()), unit)
    return Chart(over, Axis(f"{title} [{label}]"), [line.times(factor) for line in lines], zero=True)


def _speed(result: xr.Dataset, over: Abscissa) -> Chart:
    drivers = [(i, name, "rad/s" if effort == "N m" else "m/s") for i, name, effort in drivers_of(result)]
    unit = drivers[0][2]
    rows = {
        name if unit_own == unit else f"{name} [{unit_own}]": result["drive_rate"].values[i]
        for i, name, unit_own in drivers
    }
    return _curves(over, "speed", unit, rows)


def _effort(result: xr.Dataset, over: Abscissa) -> Chart:
    drivers = drivers_of(result)
    rows = {name: result["drive_effort"].values[i] for i, name, _ in drivers}
    return _curves(over, f"drive {'torque' if drivers[0][2] == 'N m' else 'force'}", drivers[0][2], rows)


def _reactions(result: xr.Dataset, over: Abscissa) -> Chart:
    sizes = {name: np.linalg.norm(force, axis=0) for name, force in members(result, "reaction_force", "joint").items()}
    return _curves(over, "reaction", "N", {name: size for name, size in sizes.items() if peak(size) > 0})


def _energy(result: xr.Dataset, over: Abscissa) -> Chart:
    return _curves(over, "energy", "J", {text: values for _, text, values in energies(result)})


def _forces(result: xr.Dataset, over: Abscissa) -> Chart:
    return _curves(over, "contact force", "N", members(result, "contact_normal_force", "contact"))


def _gaps(result: xr.Dataset, over: Abscissa) -> Chart:
    """Below 0 the surfaces press each other in."""
    return _curves(over, "gap", "m", members(result, "contact_gap", "contact"))


def _phase(result: xr.Dataset, over: Abscissa) -> Chart:
    drivers, marks = drivers_of(result), list[Mark]()
    turns = drivers[0][2] == "N m"
    for k, (i, name, _) in enumerate(drivers):
        q, rate = result["drive_coordinate"].values[i], result["drive_rate"].values[i]
        first = np.flatnonzero(np.isfinite(q))[:1]
        marks.append(Line(q, rate, name, nth(k)))
        marks.append(Line(q[first], rate[first], None if k else "start", Look(k, dash="none", mark="o", size=6.0)))
    return Chart(Axis(f"coordinate [{'rad' if turns else 'm'}]"), Axis(f"speed [{'rad/s' if turns else 'm/s'}]"), marks)


def _with_events(chart: Chart, motion: Shown) -> Chart:
    """The chart with thin lines where something happens, and words above it, each in the lowest row where it meets no
    other."""
    events = [event for event in motion.events if event.word not in OF_IMPACTS]  # the curves show these
    over, last = abscissa(motion.rows), float(motion.rows["time"].values[-1])
    if len(events) > MOST_MARKED or not last > 0:
        return chart
    ends: list[float] = []  # of what stands in each row, as shares of the axes' width
    marks: list[Mark] = []
    low, span = float(over.values.min()), over.span or 1.0
    for event in events:
        at = float(over.values[-1] * min(event.time, last) / last)
        half = 0.5 * LETTER * (len(event.word) + 2)
        middle = min(max((at - low) / span, half), 1.0 - half)
        row = next((k for k, end in enumerate(ends) if end <= middle - half), len(ends))
        ends[row : row + 1] = [middle + half]
        marks.append(Rule(at, None, Look("muted", 0.8, "dashed", order=1.2)))
        marks.append(Note(event.word, middle, 1.0, up="bottom", size=7.5, shift=(0, 2 + LINE * row)))
    return replace(chart, marks=[*chart.marks, *marks], legend=Legend(lift=LINE * len(ends)))


# ---- contacts -----------------------------------------------------------------------------------------------------


def _in_play(result: xr.Dataset) -> bool:
    return "contact" in result.dims


def _pins(result: xr.Dataset) -> list[int]:
    """The contacts that are pins in holes: of a guide there are four to a joint."""
    joints = set(attribute(result, "contact_pins"))
    return [k for k, contact in enumerate(names(result, "contact")) if contact in joints]


def _spectrum(result: xr.Dataset) -> Plot:
    """Amplitude of the contact forces over frequency, both logarithmic."""
    if "frequency" not in result.dims:
        what = "no contact forces over time: bodies are rigid, or there are too few rows"
        raise MechanismError(Finding(what, "--kind spectrum", "state a contact law, or give more --steps"))
    frequency, amplitude = result["frequency"].values[1:], result["contact_force_amplitude"].values[:, 1:]
    largest = float(np.max(amplitude, initial=0.0))
    factor, label = prefixed(largest, "N")
    lines = [Line(frequency, amplitude[k] * factor, name, nth(k).but(width=1.2))
             for k, name in enumerate(names(result, "contact"))]  # fmt: skip
    y = Axis(f"amplitude [{label}]")
    if largest > 0:
        y = replace(y, log=True, limits=(DEEPEST * largest * factor, 2 * largest * factor))
    lasts, step = result["impact_end"].values - result["impact_begin"].values, float(np.diff(result["time"][:2])[0])
    shortest = float(np.nanmin(lasts, initial=np.inf))
    short = f"; contacts last {quantity(shortest, 's')} and rows are {quantity(step, 's')} apart: give more --steps"
    title = f"Hann's window, {quantity(float(frequency[0]), 'Hz')} apart{short if shortest < RESOLVED * step else ''}"
    chart = Chart(Axis("frequency [Hz]", log=True), y, lines, title=title)
    return Plot("Spectrum of the contact forces", [Panel("", [chart], 3.75)])


def _orbit(result: xr.Dataset) -> Plot:
    """The way of each pin's centre in its hole, in the hole's axes, with the force on the wall where it touches."""
    pins = _pins(result)
    if not pins:
        raise MechanismError(Finding("no pin of this motion is in play", "--kind orbit", "use --kind gaps for guides"))
    panels = [Panel("", [_hole(result, k)], SIDE) for k in pins]
    return Plot("Pin in its hole", panels, len(pins), 0.4 + SIDE * len(pins))


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
    "speed": ("Speed", _speed),
    "effort": ("Drive effort", _effort),
    "reactions": ("Reactions", _reactions),
    "energy": ("Energy account", _energy),
    "contacts": ("Contact forces", _forces),
    "gaps": ("Gaps", _gaps),
    "phase": ("Speed over coordinate", _phase),
}
# kinds of figures with axes of their own
OWN: dict[str, Callable[[Any], Plot]] = {"orbit": _orbit, "spectrum": _spectrum}
KINDS = ("sheet", *OVER_TIME, *OWN)

"""A motion in time in figures: speed, effort, reactions and energy over time, with the events marked; phase plot;
contacts of joints in play."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from trunnion.errors import Finding, MechanismError
from trunnion.results.attributes import attribute
from trunnion.results.dataset import units_along, without_noise
from trunnion.results.quantities import prefixed, quantity
from trunnion.views.axis import Abscissa, Array, abscissa, members, names
from trunnion.views.charts import Axis, Chart, Legend, Line, Look, Mark, Panel, Plot, Ring, Rule
from trunnion.views.curves import check_kind, nth, peak

if TYPE_CHECKING:
    import xarray as xr

WORDS = {
    "break-away": "starts", "rest": "rests", "stick": "sticks", "lock": "locks", "motor-off": "motor off",
    "dead-centre": "dead centre", "change-point": "change point", "brake": "brake on",
    "clutch-slips": "clutch slips", "clutch-holds": "clutch holds", "clutch-opens": "clutch opens",
}  # fmt: skip
OF_IMPACTS = ("impact", "lift-off", "closes")  # events without a word in figures: the curves show them
ENERGIES = (
    ("work_drive", "work of the drivers"),
    ("work_loads", "work of the loads"),
    ("work_springs", "work of the springs"),
    ("work_friction", "lost to friction"),
    ("work_contact", "lost in contacts"),
    ("work_clutch", "lost in the clutch"),
    ("contact_energy", "elastic energy of contacts"),
    ("kinetic_energy", "kinetic energy"),
    ("potential_energy", "potential energy"),
)
# findings that tell where a motion ends early
ENDS = {f"simulate.{code}" for code in (
    "range", "no_acceleration", "unsolved", "not_assembled", "dead_centre", "step", "events", "change_point",
    "evaluations", "no_contact_force")}  # fmt: skip
PANEL = 2.6  # height, inches
DASHES: Any = ("dashed", "dotted", "dash-dot", "solid")  # of events
MOST_MARKED = 12  # events drawn; of more, marks would hide the curves
OF_CONTACTS = ("contacts", "gaps", "orbit")  # kinds of figures that need a joint in play
LONGEST = 0.6  # of the clearance: how far the largest force is drawn beyond the wall
MOST_SPOKES = 240  # forces drawn around a hole
SIDE = 4.6  # of the figure of a hole, inches


# ---- what a motion holds --------------------------------------------------------------------------------------------


class Happening(NamedTuple):
    """An event as views tell it: its time, s, a word, the driver or joint, and its figure with the unit."""

    time: float
    word: str
    of: str
    figure: str


class Shown(NamedTuple):
    """A motion as it is shown: its times as positions, as the views of a cycle take them; their end and the time asked
    for, s; its events in order, with its end where it ends early."""

    rows: xr.Dataset
    end: float
    asked: float
    events: tuple[Happening, ...]

    @property
    def early(self) -> bool:
        """Whether it ends before the time that was asked for."""
        return self.end < self.asked * (1 - 1e-12)


def shown(result: xr.Dataset) -> Shown:
    """The motion as its views take it."""
    quiet = without_noise(result)
    moves = quiet["resting"] != 1  # at rest the solution leaves powers within its tolerance
    rows = quiet.assign({name: quiet[name].where(moves, 0.0) for name in ("drive_power", "friction_power")})
    rows = rows.rename_dims(time="position").drop_vars("time").assign_coords(time=("position", result["time"].values))
    events = []
    for (kind, of, figure, unit), time in zip(attribute(result, "events"), result["event_time"].values, strict=True):
        text = "" if figure is None else quantity(figure, unit)
        if kind == "break-away" and figure is not None:
            text = "forward" if figure > 0 else "backward"
        events.append(Happening(float(time), WORDS.get(kind, kind), of, text))
    events += [Happening(float(row["figures"]["time"]), "ends", row["where"].partition(".")[2], "")
               for row in attribute(result, "findings") if row.get("code") in ENDS]  # fmt: skip
    return Shown(rows, float(result["time"][-1]), float(result.attrs["duration"]), tuple(events))


def energies(rows: xr.Dataset) -> list[tuple[str, str, Array]]:
    """Name, title and course of every work and energy since the start, J, of those that are more than rounding."""
    changes = [(name, text, rows[name].values - rows[name].values[0]) for name, text in ENERGIES if name in rows]
    return [change for change in changes if np.nanmax(np.abs(change[-1]), initial=0.0) > 0]


def drivers_of(result: xr.Dataset) -> list[tuple[int, str, str]]:
    """Number, name and unit of effort of every free driver; of all where none is, as pins in play move alone."""
    free, units = attribute(result, "free_drivers"), units_along(result["drive_effort"], "driver")
    return [(i, name, units[i]) for i, name in enumerate(names(result, "driver")) if name in free or not free]


# ---- figures --------------------------------------------------------------------------------------------------------


def figure(result: xr.Dataset, kind: str = "sheet") -> Plot:
    """One figure of KINDS; `sheet` has all over time, one panel under the other."""
    check_kind(kind, KINDS)
    in_play = "contact" in result.dims
    check_contacts(kind, in_play)
    if kind == "orbit":
        panels = [Panel("", [_hole(result, k)], SIDE) for k in pins(result)]
        if not panels:
            what = "no pin of this motion is in play"
            raise MechanismError(Finding(what, "--kind orbit", "use --kind gaps for guides"))
        return Plot("Pin in its hole", panels, len(panels), 0.4 + SIDE * len(panels))
    motion = shown(result)
    over = abscissa(motion.rows)
    if kind == "phase":
        drivers, marks = drivers_of(result), list[Mark]()
        units = ("rad", "rad/s") if drivers[0][2] == "N m" else ("m", "m/s")
        for k, (i, name, _) in enumerate(drivers):
            q, rate = motion.rows["drive_coordinate"].values[i], motion.rows["drive_rate"].values[i]
            first = np.flatnonzero(np.isfinite(q))[:1]
            marks.append(Line(q, rate, name, nth(k)))
            marks.append(Line(q[first], rate[first], None if k else "start", Look(k, dash="none", mark="o", size=6.0)))
        chart = Chart(Axis(f"coordinate [{units[0]}]"), Axis(f"speed [{units[1]}]"), marks)
        return Plot("Speed over coordinate", [Panel("", [chart], 3.75)])
    if kind != "sheet":
        title, build = OVER_TIME[kind]
        return Plot(title, [Panel("", [_with_events(build(motion.rows, over), motion)], 3.75)])
    idle = () if np.any(motion.rows["drive_effort"].values) else ("effort",)  # nothing drives it
    left_out = (*idle, *(() if in_play else OF_CONTACTS))
    charts = [_with_events(build(motion.rows, over), motion)
              for name, (_, build) in OVER_TIME.items() if name not in left_out]  # fmt: skip
    return Plot("Motion in time", [Panel("", charts, 0.4 + PANEL * len(charts))])


def check_contacts(kind: str, in_play: bool) -> None:
    """MechanismError for a figure of contacts where no joint is in play."""
    if kind in OF_CONTACTS and not in_play:
        remedy = "state a contact of a joint with play, such as contact: {restitution: 0.8, modulus: 210 GPa}"
        raise MechanismError(Finding("no joint of this motion is in play", f"--kind {kind}", remedy))


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
}  # fmt: skip
KINDS = ("sheet", *OVER_TIME, "phase", "orbit")


def _with_events(chart: Chart, motion: Shown) -> Chart:
    """The chart with thin lines where something happens; what, stands in the legend."""
    events = [event for event in motion.events if event.word not in OF_IMPACTS]  # the curves show these
    words = list(dict.fromkeys(event.word for event in events))
    over, last = abscissa(motion.rows), float(motion.rows["time"].values[-1])
    if len(events) > MOST_MARKED or not last > 0:
        return chart
    marks = [*chart.marks]
    for k, event in enumerate(events):
        first = event.word not in [before.word for before in events[:k]]
        at, dash = float(over.values[-1] * min(event.time, last) / last), DASHES[words.index(event.word) % len(DASHES)]
        marks.append(Rule(at, event.word if first else None, Look("muted", 0.9, dash, order=1.2)))
    return replace(chart, marks=marks, legend=Legend(1))


def pins(result: xr.Dataset) -> list[int]:
    """The contacts that are pins in holes: of a guide there are four to a joint."""
    joints = set(attribute(result, "contact_pins"))
    return [k for k, contact in enumerate(names(result, "contact")) if contact in joints]


def _hole(result: xr.Dataset, k: int) -> Chart:
    """The path of a pin's centre in its hole, with the forces on the wall."""
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

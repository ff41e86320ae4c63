"""What the views of a motion in time share: its rows as positions, its events, the names of its energies."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from trunnion.results.attributes import attribute
from trunnion.results.dataset import units_along
from trunnion.results.quantities import quantity
from trunnion.results.scales import without_noise

if TYPE_CHECKING:
    import xarray as xr

__all__ = [
    "ENERGIES", "OF_IMPACTS", "Happening", "Shown", "as_positions", "drivers_of", "energies", "happenings", "shown",
]  # fmt: skip

Array = NDArray[np.float64]
WORDS = {
    "break-away": "starts", "rest": "rests", "stick": "sticks", "lock": "locks", "motor-off": "motor off",
    "dead-centre": "dead centre", "change-point": "change point", "brake": "brake on",
    "clutch-slips": "clutch slips", "clutch-holds": "clutch holds",
    "clutch-opens": "clutch opens",
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
EARLY = ("range", "no_acceleration", "unsolved", "not_assembled", "dead_centre", "step", "events", "change_point",
         "evaluations")  # fmt: skip
ENDS = {f"simulate.{code}" for code in (*EARLY, "no_contact_force")}


class Happening(NamedTuple):
    """An event as views tell it: its time, s, a word, the driver or joint, and its figure with the unit."""

    time: float
    word: str
    of: str
    figure: str


class Shown(NamedTuple):
    """A motion as it is shown: its rows as positions; their end and the time asked for, s."""

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
    whole = without_noise(result)
    moves = whole["resting"] != 1  # at rest the solution leaves powers within its tolerance
    rows = as_positions(
        whole.assign({name: whole[name].where(moves, 0.0) for name in ("drive_power", "friction_power")})
    )
    return Shown(rows, float(result["time"][-1]), float(result.attrs["duration"]), happenings(result))


def energies(rows: xr.Dataset) -> list[tuple[str, str, Array]]:
    """Name, title and course of every work and energy since the start, J, of those that are more than rounding."""
    changes = [(name, text, rows[name].values - rows[name].values[0]) for name, text in ENERGIES if name in rows]
    return [change for change in changes if np.nanmax(np.abs(change[-1]), initial=0.0) > 0]


def drivers_of(result: xr.Dataset) -> list[tuple[int, str, str]]:
    """Number, name and unit of effort of every free driver; of all where none is, as pins in play move alone."""
    free, units = attribute(result, "free_drivers"), units_along(result["drive_effort"], "driver")
    drivers = [str(name) for name in result["driver"].values]
    return [(i, name, units[i]) for i, name in enumerate(drivers) if name in free or not free]


def as_positions(result: xr.Dataset) -> xr.Dataset:
    """The result with its times as positions, as the views of a cycle take it."""
    return result.rename_dims(time="position").drop_vars("time").assign_coords(time=("position", result["time"].values))


def happenings(result: xr.Dataset) -> tuple[Happening, ...]:
    """The events of a motion in order, its end with them where it ends early."""
    rows = zip(attribute(result, "events"), result["event_time"].values, strict=True)
    events = [Happening(float(time), WORDS.get(row[0], row[0]), row[1], _figure(*row)) for row, time in rows]
    ends = [row for row in attribute(result, "findings") if row.get("code") in ENDS]
    events += [Happening(float(row["figures"]["time"]), "ends", row["where"].partition(".")[2], "") for row in ends]
    return tuple(events)


def _figure(kind: str, of: str, figure: float | None, unit: str) -> str:
    """What an event comes with: the way it starts, the energy that a stop takes; nothing of others."""
    if figure is None:
        return ""
    if kind == "break-away":
        return "forward" if figure > 0 else "backward"
    return quantity(figure, unit)

"""The flat columns of a motion in time: one row a time, or one an event."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import numpy as np

from trunnion.results.attributes import attribute
from trunnion.results.tables import cycle
from trunnion.results.tables.column import Column, column

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["events", "impacts", "spectrum", "times"]

DRIVERS = {"drive_coordinate": "coordinate", "drive_rate": "rate", "rotor_speed": "rotor_speed"}
CONTACT = ("contact_gap", "contact_normal_force", "contact_friction_force", "contact_slip", "contact_touching")
IMPACT = (
    ("begin", "s"), ("end", "s"), ("approach", "m/s"), ("separation", "m/s"), ("force", "N"), ("depth", "m"),
    ("impulse", "N s"), ("wear", "J"),
)  # fmt: skip
ENERGY = (
    *("work_drive", "work_loads", "work_springs", "work_friction", "kinetic_energy", "potential_energy"),
    *("energy_residual", "resting"),
)


def times(result: xr.Dataset) -> list[Column]:
    """What a cycle has at a position, with coordinates and rates of the drivers, works and energies."""

    def has(i: int, variable: str, _: tuple[int, ...]) -> bool:
        return variable != "rotor_speed" or bool(np.any(np.isfinite(result["rotor_speed"].values[i])))

    found = [*cycle.positions(result), *cycle.of_members(result, "driver", DRIVERS, has)]
    found.append(column(result, "work_clutch", "work_clutch", ()))
    if "contact" in result.dims:
        for k, contact in enumerate(result["contact"].values):
            found += [column(result, name, f"{contact}.{name}", (k,)) for name in CONTACT]
            for axis, name in enumerate(result["axis"].values):
                found.append(column(result, "contact_offset", f"{contact}.contact_offset.{name}", (k, axis)))
        found += [column(result, name, name, ()) for name in ("work_contact", "contact_energy")]
    found += cycle.of_members(result, "joint", {"sticking": "sticking"})
    return [*found, *(column(result, name, name, ()) for name in ENERGY)]


def impacts(result: xr.Dataset) -> Iterator[tuple[str, str, Any]]:
    """Every contact of joints in play from onset to lift-off: times, speeds, force, penetration, wear."""
    labels = attribute(result, "impacts") if "impact" in result.dims else []
    yield "contact", "", np.array(labels, dtype=object)
    for name, unit in IMPACT:
        values = result[f"impact_{name}"].values if labels else np.empty(0)
        yield name, unit, values


def spectrum(result: xr.Dataset) -> Iterator[tuple[str, str, Any]]:
    """Amplitude of every contact force by frequency."""
    known = "frequency" in result.dims
    yield "frequency", "Hz", result["frequency"].values if known else np.empty(0)
    for k, contact in enumerate(result["contact"].values if known else ()):
        yield f"{contact}.contact_force_amplitude", "N", result["contact_force_amplitude"].values[k]


def events(result: xr.Dataset) -> Iterator[tuple[str, str, Any]]:
    """Time, kind, driver and figure of every event."""
    rows = attribute(result, "events")
    yield "time", "s", result["event_time"].values
    yield "event", "", np.array([row[0] for row in rows], dtype=object)
    yield "driver", "", np.array([row[1] for row in rows], dtype=object)
    yield "figure", "", np.array([np.nan if row[2] is None else row[2] for row in rows], float)
    yield "unit", "", np.array([row[3] for row in rows], dtype=object)

"""The flat columns of a result of `analyse`, `locking` or `simulate`: one row a position, a time, or an event.

One rule names all: `A.reaction_x` is of the member A, the stem of the variable here, and the labels along its other
dimensions.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from itertools import product
from typing import TYPE_CHECKING

import numpy as np

from trunnion.errors import Status
from trunnion.joints.pairs import PAIRS
from trunnion.results.attributes import attribute
from trunnion.results.dataset import Column, Variable, flat, unit_of
from trunnion.results.variables import LOCKING, VARIABLES, variables

if TYPE_CHECKING:
    import xarray as xr

Stems = Mapping[str, str]  # by variable: what stands behind the name of the member
Has = Callable[[int, str, tuple[int, ...]], bool]  # whether a member has a variable at an index along the others

MEMBERS = ("joint", "driver", "spring", "gear", "link", "point")  # in the order of the columns


def time_column(result: xr.Dataset) -> list[Column]:
    """The time of every position."""
    return [Column("time", "s", result["time"].values)]


def status_column(result: xr.Dataset) -> Column:
    """The status of every position in words."""
    return Column("status", "", np.array([status.name.lower() for status in Status])[result["status"].values])


def of_members(result: xr.Dataset, dim: str, stems: Stems, has: Has = lambda *_: True) -> Iterator[Column]:
    """The columns of the members of a dimension, one member after another, of variables that the result has."""
    arrays = {variable: result[variable] for variable in stems if variable in result}  # to look each up takes long
    values = {variable: array.values for variable, array in arrays.items()}
    between = {name: array.dims[1:-1] for name, array in arrays.items()}  # the members and the positions or times
    labels = {other: result[other].values.astype(str).tolist() for others in between.values() for other in others}
    for i, member in enumerate(result[dim].values if dim in result.dims else ()):
        for variable, array in arrays.items():
            others = between[variable]
            for index in product(*(range(len(labels[other])) for other in others)):
                if has(i, variable, index):
                    parts = [labels[other][k] for other, k in zip(others, index, strict=True)]
                    name = f"{member}.{'_'.join(filter(None, (stems[variable], *parts)))}"
                    yield Column(name, unit_of(array, (i, *index)), values[variable][(i, *index)])


def positions(result: xr.Dataset) -> list[Column]:
    """Joints, drivers, springs, gears, links and points, power, status and measures."""
    columns = [*time_column(result), *_members(result, "usual")]
    if "drive_power" in result:
        columns.append(Column("power_in", "W", result["drive_power"].values.sum(axis=0)))
    columns += [*flat(result, "useful_power", "power_useful"), *flat(result, "seat_rounds", "seat_rounds")]
    return [*columns, status_column(result), *_measures(result)]


def motion(result: xr.Dataset) -> list[Column]:
    """Coordinates, velocities and accelerations of joints, links and points."""
    return [*time_column(result), *_members(result, "motion")]


def rest(result: xr.Dataset) -> list[Column]:
    """What else there is at each position: powers, efficiency, margins, and how well it is solved."""
    space = attribute(result, "scene", "{}").get("space", "planar")
    columns = [
        column
        for name, variable in (variables(space) | LOCKING).items() if variable.tables == "rest"
        for column in _columns(result, name, variable)
    ]  # fmt: skip
    return [*columns, *_locking_state(result)]


def locking(result: xr.Dataset) -> list[Column]:
    """What `locking` tells of each position; of a result of `analyse` the columns that it has."""
    columns = time_column(result)
    if "drive" in result.coords:
        columns += flat(result, "drive", "drive")
    variables_of = VARIABLES | LOCKING
    names = ["critical_multiple", "locking_margin", "drive_effort", "drive_effort_reverse", "efficiency_instant"]
    for name in dict.fromkeys([*names, *LOCKING]):
        columns += _columns(result, name, variables_of[name])
    return [*columns, *_locking_state(result), status_column(result)]


def _columns(result: xr.Dataset, name: str, variable: Variable) -> Iterable[Column]:
    """The columns of a variable, those of its members if it has any; none of one that no table has."""
    if variable.column is None:
        return []
    members = variable.dims[:1]
    return of_members(result, members[0], {name: variable.column}) if members else flat(result, name, name)


def _members(result: xr.Dataset, table: str) -> Iterator[Column]:
    """The columns of members, of joints those that their kinds have."""
    scene = attribute(result, "scene", "{}")
    spatial = scene.get("space") == "spatial"
    kinds = [scene["joints"][str(joint)]["type"] for joint in result["joint"].values]

    def moves(i: int, variable: str, index: tuple[int, ...]) -> bool:
        part = VARIABLES[variable].part
        if part == "seats":  # of joints and ends that have one
            return bool(np.any(np.isfinite(result["seat_offset"].values[(i, *index[:1])])))
        if part == "bearings":  # of joints with ends, or with a pin whose size is stated
            return bool(np.any(np.isfinite(result[variable].values[(i, *index)])))
        pair = PAIRS[kinds[i]]
        if "slide" in variable or variable == "friction_force":
            return bool(pair.slides)
        turns = {"joint_rotation_error": pair.turns or pair.angle, "reaction_moment": spatial or not pair.turns,
                 "friction_torque": pair.turns}  # fmt: skip
        rotation = not variable.startswith("joint_rotation") or pair.turns or not spatial
        return bool(turns.get(variable, rotation))

    for dim in MEMBERS:
        stems = {name: variable.column for name, variable in VARIABLES.items()
                 if variable.dims[:1] == (dim,) and variable.column is not None
                 and table in variable.tables}  # fmt: skip
        yield from of_members(result, dim, stems, moves) if dim == "joint" else of_members(result, dim, stems)


def _locking_state(result: xr.Dataset) -> list[Column]:
    """What friction does at every position, in words; none of a result that has not been asked."""
    if "locking_state" not in result:
        return []
    words = np.array(str(result["locking_state"].attrs["flag_meanings"]).split())
    return [Column("locking_state", "", words[result["locking_state"].values])]


def _measures(result: xr.Dataset) -> list[Column]:
    """The model's measures, by their names, but for those that are numbers of the whole cycle alone."""
    names = result["measure"].values if "measure" in result.dims else ()
    return [
        column
        for i, name in enumerate(names)
        if np.isnan(result["measure_figure"].values[i]) or not np.all(np.isnan(result["measure_value"].values[i]))
        for column in flat(result, "measure_value", str(name), (i,))
    ]


# ---- a motion in time -----------------------------------------------------------------------------------------

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

    columns = [*positions(result), *of_members(result, "driver", DRIVERS, has)]
    columns += flat(result, "work_clutch", "work_clutch")
    if "contact" in result.dims:
        for k, contact in enumerate(result["contact"].values):
            for name in CONTACT:
                columns += flat(result, name, f"{contact}.{name}", (k,))
            for axis, name in enumerate(result["axis"].values):
                columns += flat(result, "contact_offset", f"{contact}.contact_offset.{name}", (k, axis))
        columns += [*flat(result, "work_contact", "work_contact"), *flat(result, "contact_energy", "contact_energy")]
    columns += of_members(result, "joint", {"sticking": "sticking"})
    return [*columns, *(column for name in ENERGY for column in flat(result, name, name))]


def impacts(result: xr.Dataset) -> list[Column]:
    """Every contact of joints in play from onset to lift-off: times, speeds, force, penetration, wear."""
    labels = attribute(result, "impacts") if "impact" in result.dims else []
    columns = [Column("contact", "", np.array(labels, dtype=object))]
    for name, unit in IMPACT:
        columns.append(Column(name, unit, result[f"impact_{name}"].values if labels else np.empty(0)))
    return columns


def spectrum(result: xr.Dataset) -> list[Column]:
    """Amplitude of every contact force by frequency."""
    if "frequency" not in result.dims:
        return [Column("frequency", "Hz", np.empty(0))]
    columns = [Column("frequency", "Hz", result["frequency"].values)]
    for contact, row in zip(result["contact"].values, result["contact_force_amplitude"].values, strict=True):
        columns.append(Column(f"{contact}.contact_force_amplitude", "N", row))
    return columns


def events(result: xr.Dataset) -> list[Column]:
    """Time, kind, driver and figure of every event."""
    rows = attribute(result, "events")
    kind, driver, unit = (np.array([row[k] for row in rows], dtype=object) for k in (0, 1, 3))
    figure = np.array([np.nan if row[2] is None else row[2] for row in rows], float)
    columns = {"event": kind, "driver": driver, "figure": figure, "unit": unit}
    time = Column("time", "s", result["event_time"].values)
    return [time, *(Column(name, "", values) for name, values in columns.items())]

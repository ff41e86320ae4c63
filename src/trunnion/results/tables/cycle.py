"""The flat columns of a result of `analyse` or `locking`: one row a position.

One rule names all: `A.reaction_x` is of the member A, the stem of the variable here, and the labels along its other
dimensions.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from itertools import product
from typing import TYPE_CHECKING

import numpy as np

from trunnion.joints.pairs import PAIRS
from trunnion.results.attributes import attribute
from trunnion.results.tables.column import Column, column, status_column, time_column

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["locking", "motion", "of_members", "positions", "rest"]

Stems = Mapping[str, str]  # by variable: what stands behind the name of the member
Has = Callable[[int, str, tuple[int, ...]], bool]  # whether a member has a variable at an index along the others

LINKS: Stems = {
    "link_angle": "angle",
    "link_angle_velocity": "angle_velocity",
    "link_angle_acceleration": "angle_acceleration",
    "link_position": "",
    "link_rotation": "rotation",
    "link_angular_velocity": "angular_velocity",
    "link_angular_acceleration": "angular_acceleration",
}
SEATS: Stems = {
    "seat_offset": "seat",
    "end_force": "end_force",
    "contact_position": "contact",
    "seat_beta": "seat_beta",
    "seat_xi": "seat_xi",
    "seat_xi_pin": "seat_xi_pin",
    "contact_lost": "contact_lost",
}
# by dimension
POSITIONS: dict[str, Stems] = {
    "joint": {
        "joint_rotation": "rotation",
        "joint_rotation_velocity": "rotation_velocity",
        "joint_slide": "slide",
        "joint_slide_velocity": "slide_velocity",
        "reaction_force": "reaction",
        "reaction_moment": "reaction_moment",
        "friction_torque": "friction_torque",
        "friction_force": "friction_force",
        "friction_power": "friction_power",
        "joint_rotation_error": "rotation_error",
        "joint_slide_error": "slide_error",
        "reaction_force_change": "reaction_change",
        **SEATS,
    },
    "driver": {f"drive_effort{end}": f"effort{end}" for end in ("", "_lower", "_upper", "_change")},
    "spring": {
        "spring_force": "force",
        "spring_elongation": "elongation",
        "spring_power": "spring_power",
        "damping_power": "damping_power",
    },
    "gear": {"gear_torque": "torque", "gear_force": "force"},
    "link": LINKS,
    "point": {"point_position": "", "point_error": "error"},
}
MOTION: dict[str, Stems] = {
    "joint": {
        f"joint_{name}{rate}": f"{name}{rate}"
        for name in ("rotation", "slide")
        for rate in ("", "_velocity", "_acceleration")
    },
    "link": LINKS,
    "point": {"point_position": "", "point_velocity": "velocity", "point_acceleration": "acceleration"},
}
# what only `rest` has, beside the motion: variable, the dimension of its members, what stands behind their names
REST = (
    ("drive_power", "driver", "power"),
    ("drive_effort_reverse", "driver", "effort_reverse"),
    ("critical_multiple", "joint", "critical_multiple"),
    ("friction_power_change", "joint", "friction_power_change"),
    ("contact_loss_number", "joint", "contact_loss_number"),
    *((name, "", name) for name in (
        "efficiency_instant", "locking_margin", "power_delivered_reverse", "power_acting_reverse",
        "power_given_reverse", "efficiency_reverse_instant", "holding_multiple",
        "closure_residual", "condition", "power_residual", "friction_iterations", "friction_change",
        "friction_residual", "friction_contraction", "seat_change", "seat_travel",
    )),
)  # fmt: skip


def of_members(result: xr.Dataset, dim: str, stems: Stems, has: Has = lambda *_: True) -> Iterator[Column]:
    """The columns of the members of a dimension, one member after another, of variables that the result has."""
    for i, member in enumerate(result[dim].values if dim in result.dims else ()):
        for variable, stem in stems.items():
            if variable not in result:
                continue
            others = result[variable].dims[1:-1]  # between the members and the positions or times
            for index in product(*(range(result.sizes[other]) for other in others)):
                if has(i, variable, index):
                    labels = [str(result[other].values[k]) for other, k in zip(others, index, strict=True)]
                    name = f"{member}.{'_'.join(filter(None, (stem, *labels)))}"
                    yield column(result, variable, name, (i, *index))


def positions(result: xr.Dataset) -> list[Column]:
    """Joints, drivers, springs, gears, links and points, power, status and measures."""
    found: list[Column] = [time_column(result), *_flat(result, POSITIONS)]
    if "drive_power" in result:
        drive = result["drive_power"].values
        found.append(("power_in", "W", lambda window: drive[:, window].sum(axis=0)))
    found += [column(result, "useful_power", "power_useful", ()), column(result, "seat_rounds", "seat_rounds", ())]
    return [*found, status_column(result), *_measures(result)]


def motion(result: xr.Dataset) -> list[Column]:
    """Coordinates, velocities and accelerations of joints, links and points."""
    return [time_column(result), *_flat(result, MOTION)]


def rest(result: xr.Dataset) -> list[Column]:
    """What else there is at each position: powers, efficiency, margins, and how well it is solved."""
    found: list[Column] = []
    for variable, dim, name in REST:
        found += of_members(result, dim, {variable: name}) if dim else [column(result, variable, name, ())]
    found += _locking_state(result)
    if "link_error" in result:
        stem = "error" if "axis" in result["link_error"].dims else "angle_error"
        found += of_members(result, "link", {"link_error": stem})
    return found


def locking(result: xr.Dataset) -> list[Column]:
    """What `locking` tells of each position; of a result of `analyse` the columns that it has."""
    found = [time_column(result)]
    if "drive" in result.coords:
        found.append(("drive", str(result["drive"].attrs["units"]), lambda window: result["drive"].values[window]))
    found += [one for one in rest(result) if one[0] == "locking_margin" or one[0].endswith(".critical_multiple")]
    found += of_members(result, "driver", {"drive_effort": "effort", "drive_effort_reverse": "effort_reverse"})
    wanted = ("efficiency_instant", "efficiency_reverse_instant", "power_delivered_reverse")
    more = ("power_acting_reverse", "power_given_reverse", "holding_multiple")
    found += [column(result, name, name, ()) for name in (*wanted, *more)]
    return [*found, *_locking_state(result), status_column(result)]


def _flat(result: xr.Dataset, stems: Mapping[str, Stems]) -> Iterator[Column]:
    """The columns of members, of joints those that their kinds have."""
    stated = attribute(result, "scene", "{}")
    spatial = stated.get("space") == "spatial"
    kinds = [stated["joints"][str(joint)]["type"] for joint in result["joint"].values]

    def moves(i: int, variable: str, index: tuple[int, ...]) -> bool:
        if variable in SEATS:  # of joints and ends that have one
            return bool(np.any(np.isfinite(result["seat_offset"].values[(i, *index[:1])])))
        return _has(kinds[i], variable, spatial)

    for dim, own in stems.items():
        yield from of_members(result, dim, own, moves) if dim == "joint" else of_members(result, dim, own)


def _has(kind: str, variable: str, spatial: bool) -> bool:
    """Whether a joint of a kind has a variable."""
    pair = PAIRS[kind]
    if variable == "joint_rotation_error":
        return bool(pair.turns or pair.angle)
    if "slide" in variable or variable == "friction_force":
        return bool(pair.slides)
    if variable == "reaction_moment":
        return spatial or not pair.turns
    if variable.startswith("joint_rotation"):
        return bool(pair.turns) or not spatial
    return variable != "friction_torque" or bool(pair.turns)


def _locking_state(result: xr.Dataset) -> list[Column]:
    """What friction does at every position, in words; none of a result that has not been asked."""
    if "locking_state" not in result:
        return []
    words = np.array(str(result["locking_state"].attrs["flag_meanings"]).split())
    return [("locking_state", "", lambda window: words[result["locking_state"].values[window]])]


def _measures(result: xr.Dataset) -> list[Column]:
    """The model's measures, by their names, but for those that are numbers of the whole cycle alone."""
    names = result["measure"].values if "measure" in result.dims else ()
    return [
        column(result, "measure_value", str(name), (i,))
        for i, name in enumerate(names)
        if np.isnan(result["measure_figure"].values[i]) or not np.all(np.isnan(result["measure_value"].values[i]))
    ]  # fmt: skip

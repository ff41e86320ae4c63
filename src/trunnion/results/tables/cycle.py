"""The flat columns of a result of `analyse` or `locking`: one row a position."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from trunnion.joints.pairs import PAIRS
from trunnion.results.attributes import attribute
from trunnion.results.tables.column import Column, column, status_column, time_column, vector

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["locking", "motion", "positions", "rest"]

RATES = ("", "_velocity", "_acceleration")
# what only `rest` has, beside the motion: variable, the dimension whose names stand before the column's name, that name
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


def positions(result: xr.Dataset) -> list[Column]:
    """Joints, drivers, springs, gears, links and points, power and status."""
    stated = attribute(result, "scene", "{}")
    spatial = stated.get("space") == "spatial"
    kinds = {name: joint["type"] for name, joint in stated["joints"].items()}
    found: list[Column] = [time_column(result)]
    for i, joint in enumerate(result["joint"].values):
        of_joint = _spatial_joint if spatial else _planar_joint
        found += of_joint(result, i, str(joint), kinds[str(joint)])
        found.append(column(result, "friction_power", f"{joint}.friction_power", (i,)))
        found += _errors_of_joint(result, i, str(joint), kinds[str(joint)])
    found += _drivers(result) + _springs(result)
    for i, gear in enumerate(result["gear"].values if "gear" in result.dims else ()):
        found.append(column(result, "gear_torque", f"{gear}.torque", (i,)))
        found += vector(result, "gear_force", f"{gear}.force_", i)
    for i, link in enumerate(result["link"].values):
        found += _spatial_link(result, i, str(link)) if spatial else _planar_link(result, i, str(link))
    for i, point in enumerate(result["point"].values):
        found += vector(result, "point_position", f"{point}.", i)
        if "point_error" in result:
            found += vector(result, "point_error", f"{point}.error_", i)
    if "drive_power" in result:
        drive = result["drive_power"].values
        found.append(("power_in", "W", lambda window: drive[:, window].sum(axis=0)))
    found.append(column(result, "useful_power", "power_useful", ()))
    if "seat_rounds" in result:
        found.append(column(result, "seat_rounds", "seat_rounds", ()))
    return [*found, status_column(result), *_measures(result)]


def motion(result: xr.Dataset) -> list[Column]:
    """Coordinates, velocities and accelerations of joints, links and points."""
    stated = attribute(result, "scene", "{}")
    spatial = stated.get("space") == "spatial"
    found: list[Column] = [time_column(result)]
    for i, joint in enumerate(result["joint"].values):
        pair = PAIRS[stated["joints"][str(joint)]["type"]]
        moves = {"rotation": pair.turns or not spatial, "slide": pair.slides}
        found += [
            column(result, f"joint_{name}{rate}", f"{joint}.{name}{rate}", (i,))
            for name, there in moves.items() if there for rate in RATES
        ]  # fmt: skip
    for i, link in enumerate(result["link"].values):
        found += _spatial_link(result, i, str(link)) if spatial else _planar_link(result, i, str(link))
    for i, point in enumerate(result["point"].values):
        found += vector(result, "point_position", f"{point}.", i)
        for rate in ("velocity", "acceleration"):
            found += vector(result, f"point_{rate}", f"{point}.{rate}_", i)
    return found


def rest(result: xr.Dataset) -> list[Column]:
    """What else there is at each position: powers, efficiency, margins, and how well it is solved."""
    found: list[Column] = []
    for variable, dim, name in REST:
        if variable not in result:
            continue
        if not dim:
            found.append(column(result, variable, name, ()))
        else:
            found += [column(result, variable, f"{of}.{name}", (i,)) for i, of in enumerate(result[dim].values)]
    found += _locking_state(result)
    if "link_error" in result:
        for i, link in enumerate(result["link"].values):
            vectorial = "axis" in result["link_error"].dims
            found += (
                vector(result, "link_error", f"{link}.error_", i)
                if vectorial
                else [column(result, "link_error", f"{link}.angle_error", (i,))]
            )
    return found


def locking(result: xr.Dataset) -> list[Column]:
    """What `locking` tells of each position; of a result of `analyse` the columns that it has."""
    found = [time_column(result)]
    if "drive" in result.coords:
        found.append(("drive", str(result["drive"].attrs["units"]), lambda window: result["drive"].values[window]))
    found += [one for one in rest(result) if one[0] == "locking_margin" or one[0].endswith(".critical_multiple")]
    for i, driver in enumerate(result["driver"].values):
        found += [column(result, f"drive_effort{end}", f"{driver}.effort{end}", (i,)) for end in ("", "_reverse")]
    wanted = ("efficiency_instant", "efficiency_reverse_instant", "power_delivered_reverse")
    more = ("power_acting_reverse", "power_given_reverse", "holding_multiple")
    found += [column(result, name, name, ()) for name in (*wanted, *more) if name in result]
    return [*found, *_locking_state(result), status_column(result)]


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


def _planar_joint(result: xr.Dataset, i: int, joint: str, kind: str) -> list[Column]:
    slides = not PAIRS[kind].turns
    flat = [("joint_rotation", "rotation"), ("joint_rotation_velocity", "rotation_velocity")]
    flat += [("joint_slide", "slide"), ("joint_slide_velocity", "slide_velocity")] if slides else []
    found = [column(result, variable, f"{joint}.{name}", (i,)) for variable, name in flat]
    found += vector(result, "reaction_force", f"{joint}.reaction_", i)
    if slides:
        found.append(column(result, "reaction_moment", f"{joint}.reaction_moment", (i,)))
        found.append(column(result, "friction_force", f"{joint}.friction_force", (i,)))
    else:
        found.append(column(result, "friction_torque", f"{joint}.friction_torque", (i,)))
    return found


def _spatial_joint(result: xr.Dataset, i: int, joint: str, kind: str) -> list[Column]:
    """Of a joint in space: its motion, force and moment of the reaction, friction along each freedom."""
    moves = {"rotation": PAIRS[kind].turns, "slide": PAIRS[kind].slides}
    found = [
        column(result, f"joint_{motion}{rate}", f"{joint}.{motion}{rate}", (i,))
        for motion, there in moves.items()
        for rate in ("", "_velocity")
        if there
    ]
    found += vector(result, "reaction_force", f"{joint}.reaction_", i)
    found += vector(result, "reaction_moment", f"{joint}.reaction_moment_", i)
    freedoms = {"torque": moves["rotation"], "force": moves["slide"]}
    found += [
        column(result, f"friction_{what}", f"{joint}.friction_{what}", (i,)) for what, is_ in freedoms.items() if is_
    ]
    return found


def _errors_of_joint(result: xr.Dataset, i: int, joint: str, kind: str) -> list[Column]:
    """Of a joint of a mechanism with errors: what moves it against the ideal one, and where its pin lies."""
    found: list[Column] = []
    if "joint_rotation_error" in result and (PAIRS[kind].turns or PAIRS[kind].angle):
        found.append(column(result, "joint_rotation_error", f"{joint}.rotation_error", (i,)))
    if "joint_slide_error" in result and PAIRS[kind].slides:
        found.append(column(result, "joint_slide_error", f"{joint}.slide_error", (i,)))
    if "reaction_force_change" in result:
        found += vector(result, "reaction_force_change", f"{joint}.reaction_change_", i)
    if "seat_offset" not in result or not np.any(np.isfinite(result["seat_offset"].values[i])):
        return found
    for end, name in enumerate(result["end"].values):
        if np.any(np.isfinite(result["seat_offset"].values[i, end])):
            for variable, said in (
                ("seat_offset", "seat"),
                ("end_force", "end_force"),
                ("contact_position", "contact"),
            ):
                found += [
                    column(result, variable, f"{joint}.{said}_{name}_{axis}", (i, end, k))
                    for k, axis in enumerate(result["axis"].values)
                ]
    found += [column(result, f"seat_{angle}", f"{joint}.seat_{angle}", (i,)) for angle in ("beta", "xi", "xi_pin")]
    return [*found, column(result, "contact_lost", f"{joint}.contact_lost", (i,))]


def _planar_link(result: xr.Dataset, i: int, link: str) -> list[Column]:
    variables = ("link_angle", "link_angle_velocity", "link_angle_acceleration")
    return [column(result, one, f"{link}.{one.removeprefix('link_')}", (i,)) for one in variables]


def _spatial_link(result: xr.Dataset, i: int, link: str) -> list[Column]:
    """Pose of a link, origin and quaternion, and how it turns."""
    found = vector(result, "link_position", f"{link}.", i)
    found += [column(result, "link_rotation", f"{link}.rotation_{one}", (i, k)) for k, one in enumerate("wxyz")]
    for rate in ("velocity", "acceleration"):
        found += vector(result, f"link_angular_{rate}", f"{link}.angular_{rate}_", i)
    return found


def _drivers(result: xr.Dataset) -> list[Column]:
    """Effort of each driver with the ends of its interval, and its change by errors."""
    return [
        column(result, f"drive_effort{end}", f"{driver}.effort{end}", (i,))
        for i, driver in enumerate(result["driver"].values)
        for end in ("", "_lower", "_upper", "_change")
    ]


def _springs(result: xr.Dataset) -> list[Column]:
    found: list[Column] = []
    for i, spring in enumerate(result["spring"].values if "spring" in result.dims else ()):
        found += [column(result, f"spring_{name}", f"{spring}.{name}", (i,)) for name in ("force", "elongation")]
        found.append(column(result, "spring_power", f"{spring}.spring_power", (i,)))
        found.append(column(result, "damping_power", f"{spring}.damping_power", (i,)))
    return found

"""A result as plain data for the browser: what `web/` animates and plots, in JSON.

Every series holds one number a position, or a single number if it never changes. Numbers carry seven digits,
as float32 does; None stands for NaN. Units are SI, except the abscissa, which says its own.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from trunnion.joints.pairs import GUIDED
from trunnion.results.attributes import attribute, units_of
from trunnion.results.dataset import units_along
from trunnion.results.scales import without_noise
from trunnion.views.axis import (
    abscissa,
    column,
    ease,
    intervals,
    is_spatial,
    larger_end,
    layout,
    members,
    names,
    numbers,
    series,
)
from trunnion.views.cycle.courses import varying
from trunnion.views.cycle.deviations import built, losses
from trunnion.views.space.scene import space_scene

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["scene"]

FORMAT = 1
SUMS = ("useful_power", "efficiency_instant", "closure_residual", "condition", "power_residual",
        "friction_iterations", "friction_change", "friction_residual", "friction_contraction")  # fmt: skip
STILL = 1e-9  # of the largest speed: a joint that is slower rests
DRIVEN = ("efficiency_instant",)  # of a steady cycle it says nothing: the flywheel does the work at each position


def scene(
    result: xr.Dataset, ideal: xr.Dataset | None = None, max_positions: int = 720,
    picked: NDArray[np.intp] | None = None,
) -> dict[str, Any]:  # fmt: skip
    """The result as JSON-able data, thinned evenly to `max_positions` (`thinned` then tells the full count).

    ideal: the same run without friction, for comparison; it must have the same positions. picked: the positions that
    are shown instead, rising.
    """
    count = result.sizes["position"]
    if ideal is not None and ideal.sizes["position"] != count:
        raise ValueError(f"`ideal` has {ideal.sizes['position']} positions, the result {count}")
    result, ideal = without_noise(result), None if ideal is None else without_noise(ideal)
    picked = np.arange(0, count, -(-count // max(max_positions, 1)) or 1) if picked is None else picked
    over, steady = abscissa(result), "steady" in result.attrs
    picked_rows = result.isel(position=picked)
    other = None if ideal is None else ideal.isel(position=picked)
    facts, efficiency = layout(result), column(result, "efficiency")
    tracks = {} if is_spatial(result) else members(picked_rows, "point_position", "point")  # there the poses tell them
    points = {name: dict(zip("xy", map(series, track), strict=True)) for name, track in tracks.items()}
    lost = {int(index) for places in losses(result).values() for index in places}
    # the shown positions at or before those at which a joint loses contact
    before = sorted({int(np.searchsorted(picked, index, side="right")) - 1 for index in lost})
    pulls = members(picked_rows, "spring_force", "spring")
    drawn = {
        "format": FORMAT,
        "name": result.attrs.get("name", ""),
        "formula": result.attrs.get("formula", ""),
        "count": int(picked.size),
        "thinned": count if picked.size < count else None,
        "abscissa": {"label": over.label, "unit": over.unit, "closed": over.closed, "period": over.period,
                     "values": numbers(over.values[picked])},
        "time": series(column(picked_rows, "time")),
        "status": [int(code) for code in picked_rows["status"].values],
        "ease": series(ease(result)[picked]),
        "states": {str(run.status): run.text for run in intervals(picked_rows, 0)},
        "gaps": [{"from": over.say(int(run.start)), "to": over.say(int(run.stop) - 1), "text": run.text}
                 for run in intervals(result)],
        "points": points,
        "links": _links(facts, picked_rows, points),
        "joints": _joints(facts, picked_rows, other),
        "loads": _loads(facts, picked_rows, points),
        "springs": [{"name": name, "ends": list(ends), "pull": series(pulls.get(name))}
                    for name, spring in facts["springs"].items()
                    if (ends := spring.get("between")) and set(ends) <= points.keys()],
        "gears": [{"name": name, **circle} for name, pair in facts["gears"].items() for circle in pair],
        "drivers": _drivers(picked_rows, other, facts),
        "units": units_of(result),
        "sums": {name: series(column(picked_rows, name)) for name in SUMS
                 if name in picked_rows and not (steady and name in DRIVEN)},
        "efficiency": numbers(efficiency.reshape(1))[0] if efficiency is not None and not efficiency.ndim else None,
        "built": built(picked_rows, before),
    }  # fmt: skip
    if is_spatial(result):
        drawn |= space_scene(picked_rows)
    for load in drawn["loads"]:
        load["course"] = course(result, picked, load["name"])
    return drawn


def course(result: xr.Dataset, picked: NDArray[np.intp], load: str) -> dict[str, list[list[float | None]]] | None:
    """Force and moment of a load that varies at the picked positions, by component; None if they are not known."""
    loads = attribute(result, "load_courses", "{}").get(load)
    if loads is None or any(len(part) != result.sizes["position"] for parts in loads.values() for part in parts):
        return None
    return {what: [[part[k] for k in picked] for part in parts] for what, parts in loads.items()}


def _links(layout_of: dict[str, Any], result: xr.Dataset, points: dict[str, Any]) -> list[dict[str, Any]]:
    """Links with the keys of their points, their angle, and which of their points are no joints."""
    present = names(result, "link")
    rows = []
    for name, link in layout_of["links"].items():
        keys = [f"{name}.{point}" for point in link["points"] if f"{name}.{point}" in points]
        free = [key for key in keys if key[len(name) + 1 :] not in layout_of["joints"]]
        angle = series(column(result, "link_angle", link=name)) if name in present and not is_spatial(result) else [0.0]
        rows.append({"name": name, "ground": name == layout_of["ground"], "points": keys, "free": free, "angle": angle})
    return rows


def _joints(layout_of: dict[str, Any], result: xr.Dataset, ideal: xr.Dataset | None) -> list[dict[str, Any]]:
    """Joints with their loads and the point they are drawn at: the second link's, where the reaction acts."""
    present = names(result, "joint")
    rows = []
    for name, joint in layout_of["joints"].items():
        if name not in present:
            continue
        first, second = joint["links"]
        slides = joint["type"] == "prismatic"
        rows.append(
            {
                "name": name, "type": joint["type"], "links": [first, second], "axis": joint.get("axis"),
                "at": f"{second}.{name}", "on": f"{first}.{name}",
                "reaction": _vector(result, "reaction_force", name),
                "ideal": None if ideal is None else _vector(ideal, "reaction_force", name),
                "moment": _vector(result, "reaction_moment", name),
                "end_load": series(larger_end(result, name)),
                "friction_power": series(column(result, "friction_power", joint=name)),
                "slide": series(column(result, "joint_slide", joint=name)) if slides else [],
                "friction": series(column(result, "friction_force", joint=name)) if slides else [],
            }
        )  # fmt: skip
    return rows


def _vector(result: xr.Dataset, name: str, joint: str) -> Any:
    """A series for each axis; of a moment in the plane one alone."""
    if "axis" not in result[name].dims:
        return series(column(result, name, joint=joint))
    return {axis: series(column(result, name, joint=joint, axis=axis)) for axis in names(result, "axis")}


def _loads(layout_of: dict[str, Any], result: xr.Dataset, points: dict[str, Any]) -> list[dict[str, Any]]:
    """Loads that can be drawn: a force at a known point, a moment on a link, what resists a joint, with the sign in
    which it `acts`; those in space are told apart."""
    rows: list[dict[str, Any]] = []
    if layout_of.get("space") == "spatial":
        return rows
    for name, load in layout_of["loads"].items():
        at = f"{load.get('link')}.{load.get('at')}"
        force = [float(part) for part in load.get("force") or (0.0, 0.0)]
        rows.append({"name": name, "link": load.get("link"), "at": at if at in points else None,
                     "force": force, "moment": float(load.get("moment") or 0.0),
                     "frame": load.get("frame", "global"), "varies": bool(load.get("varies")),
                     "useful": bool(load.get("useful")), "joint": load.get("joint"), "resists": load.get("resists"),
                     "acts": _acts(layout_of, result, load)})  # fmt: skip
    return rows


def _acts(layout_of: dict[str, Any], result: xr.Dataset, load: dict[str, Any]) -> list[float | None]:
    """The sign in which a load that resists a joint acts on its second link; 0 where it does not."""
    joint = str(load.get("joint"))
    motion = "joint_slide" if layout_of["joints"].get(joint, {}).get("type") in GUIDED else "joint_rotation"
    speed = column(result, f"{motion}_velocity", joint=joint) if joint in names(result, "joint") else None
    if speed is None:
        return []
    still = np.abs(speed) <= STILL * np.nanmax(np.abs(speed), initial=0.0)
    sense = np.where(still, 0.0, np.sign(speed))
    only = {"positive": 1.0, "negative": -1.0}.get(str(load.get("only")), 0.0)
    return series(-np.where(sense * only < 0, 0.0, sense))


def _drivers(result: xr.Dataset, ideal: xr.Dataset | None, layout_of: dict[str, Any]) -> list[dict[str, Any]]:
    """Drivers with effort (an interval where friction leaves it open), power, and effort without friction."""
    units = units_along(result["drive_effort"], "driver")
    speeds = {} if result.attrs.get("kind") == "motion" else varying(result)
    rows = []
    for name, unit in zip(names(result, "driver"), units, strict=True):
        values = {key: series(column(result, f"drive_{key}", driver=name))
                  for key in ("effort", "effort_lower", "effort_upper", "power")}  # fmt: skip
        free = None if ideal is None else series(column(ideal, "drive_effort", driver=name))
        kind = layout_of["joints"].get(name, {}).get("type", "revolute")
        values["speed"] = series(speeds[name][0]) if name in speeds else []
        rows.append({"name": name, "unit": unit, "type": kind, "ideal": free, **values})
    return rows

"""A result as plain data for the browser: what `web/` animates and plots, in JSON.

Every series holds one number a position, or a single number if it never changes. Numbers carry seven digits,
as float32 does; None stands for NaN. Units are SI, except the abscissa, which says its own. In space, places and
directions that never move in a link are told in its frame; the browser moves them with the link's pose.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from trunnion.joints.pairs import GUIDED, PAIRS
from trunnion.results.attributes import attribute, units_of
from trunnion.results.dataset import units_along, without_noise
from trunnion.solve.system import System
from trunnion.views.as_built import built, losses
from trunnion.views.axis import abscissa, column, intervals, larger_end, layout, members, names, numbers, series
from trunnion.views.bodies import Space, best, gathered, looking, scenery
from trunnion.views.curves import ease
from trunnion.views.cycle import varying

if TYPE_CHECKING:
    import xarray as xr

Row = NDArray[np.float64]
STILL = 1e-9  # of the largest speed: a joint that is slower rests
UNTURNED = 1e-6  # a link that turns slower than this share of its fastest has no screw axis worth a line


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
    over, facts = abscissa(result), layout(result)
    spatial = facts.get("space") == "spatial"
    rows, free = result.isel(position=picked), None if ideal is None else ideal.isel(position=picked)
    tracks = {} if spatial else members(rows, "point_position", "point")  # there the poses tell them
    points = {name: dict(zip("xy", map(series, track), strict=True)) for name, track in tracks.items()}
    lost = {int(index) for places in losses(result).values() for index in places}
    # the shown positions at or before those at which a joint loses contact
    before = sorted({int(np.searchsorted(picked, index, side="right")) - 1 for index in lost})
    pulls, efficiency = members(rows, "spring_force", "spring"), column(result, "efficiency")
    drawn = {
        "format": 1,
        "name": result.attrs.get("name", ""),
        "formula": result.attrs.get("formula", ""),
        "count": int(picked.size),
        "thinned": count if picked.size < count else None,
        "abscissa": {"label": over.label, "unit": over.unit, "closed": over.closed, "period": over.period,
                     "values": numbers(over.values[picked])},
        "time": series(column(rows, "time")),
        "status": [int(code) for code in rows["status"].values],
        "ease": series(ease(result)[picked]),
        "states": {str(run.status): run.text for run in intervals(rows, 0)},
        "points": points,
        "links": _links(rows, points, spatial),
        "joints": _joints(rows, free),
        "loads": [] if spatial else _loads(rows, points),
        "springs": [{"name": name, "ends": list(ends), "pull": series(pulls.get(name))}
                    for name, spring in facts["springs"].items()
                    if (ends := spring.get("between")) and set(ends) <= points.keys()],
        "gears": [{"name": name, **circle} for name, pair in facts["gears"].items() for circle in pair],
        "drivers": _drivers(rows, free),
        "units": units_of(result),
        # of a steady cycle the efficiency at a position says nothing: the flywheel does the work
        "sums": {name: series(column(rows, name)) for name in ("useful_power", "efficiency_instant")
                 if name in rows and not ("steady" in result.attrs and name == "efficiency_instant")},
        "efficiency": numbers(efficiency.reshape(1))[0] if efficiency is not None and not efficiency.ndim else None,
        "built": built(rows, before),
    }  # fmt: skip
    if spatial:
        drawn |= _in_space(rows)
    courses = attribute(result, "load_courses", "{}")
    for load in drawn["loads"]:  # force and moment of those that vary, by component; None if they are not known
        parts = courses.get(load["name"])
        known = parts is not None and all(len(part) == count for rows_of in parts.values() for part in rows_of)
        load["course"] = {what: [[part[k] for k in picked] for part in rows_of] for what, rows_of in parts.items()} \
            if known else None  # fmt: skip
    return drawn


def _links(result: xr.Dataset, points: dict[str, Any], spatial: bool) -> list[dict[str, Any]]:
    """Links with the keys of their points, their angle, and which of their points are no joints."""
    facts, angles, rows = layout(result), members(result, "link_angle", "link"), []
    for name, link in facts["links"].items():
        keys = [f"{name}.{point}" for point in link["points"] if f"{name}.{point}" in points]
        free = [key for key in keys if key[len(name) + 1 :] not in facts["joints"]]
        angle = series(angles[name]) if name in angles and not spatial else [0.0]
        rows.append({"name": name, "ground": name == facts["ground"], "points": keys, "free": free, "angle": angle})
    return rows


def _joints(result: xr.Dataset, ideal: xr.Dataset | None) -> list[dict[str, Any]]:
    """Joints with their loads and the point they are drawn at: the second link's, where the reaction acts."""
    present, rows = names(result, "joint"), []

    def vector(of: xr.Dataset, name: str, joint: str) -> Any:
        """A series for each axis; of a moment in the plane one alone."""
        if "axis" not in of[name].dims:
            return series(column(of, name, joint=joint))
        return {axis: series(column(of, name, joint=joint, axis=axis)) for axis in names(of, "axis")}

    for name, joint in layout(result)["joints"].items():
        if name not in present:
            continue
        (first, second), slides = joint["links"], joint["type"] == "prismatic"
        rows.append({
            "name": name, "type": joint["type"], "links": [first, second], "axis": joint.get("axis"),
            "at": f"{second}.{name}", "on": f"{first}.{name}",
            "reaction": vector(result, "reaction_force", name),
            "ideal": None if ideal is None else vector(ideal, "reaction_force", name),
            "moment": vector(result, "reaction_moment", name),
            "end_load": series(larger_end(result, name)),
            "friction_power": series(column(result, "friction_power", joint=name)),
            "slide": series(column(result, "joint_slide", joint=name)) if slides else [],
            "friction": series(column(result, "friction_force", joint=name)) if slides else [],
        })  # fmt: skip
    return rows


def _loads(result: xr.Dataset, points: dict[str, Any]) -> list[dict[str, Any]]:
    """Loads that can be drawn in the plane: a force at a known point, a moment on a link, what resists a joint.

    acts: the sign in which a load that resists a joint acts on its second link; 0 where it does not.
    """
    facts, rows = layout(result), list[dict[str, Any]]()
    for name, load in facts["loads"].items():
        at, joint, acts = f"{load.get('link')}.{load.get('at')}", str(load.get("joint")), list[float | None]()
        noun = "joint_slide" if facts["joints"].get(joint, {}).get("type") in GUIDED else "joint_rotation"
        speed = column(result, f"{noun}_velocity", joint=joint) if joint in names(result, "joint") else None
        if speed is not None:
            sense = np.where(np.abs(speed) <= STILL * np.nanmax(np.abs(speed), initial=0.0), 0.0, np.sign(speed))
            only = {"positive": 1.0, "negative": -1.0}.get(str(load.get("only")), 0.0)
            acts = series(-np.where(sense * only < 0, 0.0, sense))
        force = [float(part) for part in load.get("force") or (0.0, 0.0)]
        rows.append({"name": name, "link": load.get("link"), "at": at if at in points else None,
                     "force": force, "moment": float(load.get("moment") or 0.0),
                     "frame": load.get("frame", "global"), "varies": bool(load.get("varies")),
                     "useful": bool(load.get("useful")), "joint": load.get("joint"), "resists": load.get("resists"),
                     "acts": acts})  # fmt: skip
    return rows


def _drivers(result: xr.Dataset, ideal: xr.Dataset | None) -> list[dict[str, Any]]:
    """Drivers with effort (an interval where friction leaves it open), power, and effort without friction."""
    units, joints = units_along(result["drive_effort"], "driver"), layout(result)["joints"]
    speeds = {} if result.attrs.get("kind") == "motion" else varying(result)
    keys, rows = ("effort", "effort_lower", "effort_upper", "power"), []
    for name, unit in zip(names(result, "driver"), units, strict=True):
        free = None if ideal is None else series(column(ideal, "drive_effort", driver=name))
        rows.append({"name": name, "unit": unit, "type": joints.get(name, {}).get("type", "revolute"), "ideal": free,
                     **{key: series(column(result, f"drive_{key}", driver=name)) for key in keys},
                     "speed": series(speeds[name][0]) if name in speeds else []})  # fmt: skip
    return rows


# ---- in space -------------------------------------------------------------------------------------------------------


def _in_space(result: xr.Dataset) -> dict[str, Any]:
    """What a scene of a mechanism in space has besides curves: poses of the links, their bodies, free points, loads,
    screw axes, the first view; `solids` is empty if no position can be drawn."""
    bodies = gathered(result)
    drawn, links, seats = bool(bodies.drawable.any()), [], {}
    still: dict[str, Any] = {axis: [float(axis == "w")] for axis in "xyzwijk"}
    for link in bodies.stated["links"]:
        pose = still  # place x, y, z (m) and quaternion w, i, j, k
        if link in names(result, "link"):
            pose = {axis: series(column(result, "link_position", link=link, axis=axis)) for axis in "xyz"} | {
                to: series(column(result, "link_rotation", link=link, component=component))
                for to, component in zip("wijk", "wxyz", strict=True)
            }
        screw = _screw(result, bodies, link) if drawn and link != bodies.ground else None
        links.append({"name": link, "ground": link == bodies.ground, "pose": pose if drawn else None, "screw": screw})
    parts: dict[str, Any] = {"space": "spatial", "links": links, "solids": [], "free": [], "seats": {}, "loads": []}
    if not drawn:
        return parts
    around, above = best(bodies)
    picture = scenery(bodies, looking(around, above))
    # where a joint's symbol sits on its second link and along which axes: none of a ball or a weld
    for name, joint in bodies.joints.items():
        pair, sides = PAIRS[joint["type"]], list(enumerate(joint["links"]))
        sides = sides if pair.crossed else sides[1:] if pair.one_axis or pair.angle else []
        axes = [{"link": link, "along": numbers(bodies.element(name, side)[1])} for side, link in sides]
        seats[name] = {"link": joint["links"][1], "at": numbers(bodies.seat(name)), "axes": axes,
                       "ends": _ends(result, bodies, name)}  # fmt: skip
    loads = []  # forces at points and moments on links, with the place they are drawn at in the frame of the link
    for name, load in bodies.stated["loads"].items():
        link = load.get("link")
        if link not in bodies.poses:
            continue
        spots = {joint: bodies.seat(joint, entry["links"].index(link)) for joint, entry in bodies.joints.items()
                 if link in entry["links"]}  # fmt: skip
        middle = np.mean(list(spots.values()), axis=0) if spots and load.get("at") is None else None
        spots |= {key.split(".", 1)[1]: at for key, at in bodies.free.items() if key.split(".", 1)[0] == link}
        at = spots.get(load.get("at") or load.get("joint") or "", middle)
        if at is not None:
            loads.append({"name": name, "link": link, "at": numbers(at), "force": load.get("force") or [0.0, 0.0, 0.0],
                          "moment": load.get("moment") or [0.0, 0.0, 0.0], "frame": load.get("frame", "global"),
                          "varies": bool(load.get("varies")), "useful": bool(load.get("useful"))})  # fmt: skip
    return parts | {
        "size": numbers(np.array([bodies.size]))[0], "scaled": bool(bodies.extent), "middle": numbers(bodies.middle),
        "view": {"around": around, "above": above, "box": numbers(np.array(picture.box))},
        "solids": [solid.data() for solid in picture.solids],
        "free": [{"key": key, "link": key.split(".", 1)[0], "at": numbers(at)} for key, at in bodies.free.items()],
        "seats": seats, "loads": loads, "apart": any(bodies.shifts.values()),
    }  # fmt: skip


def _ends(result: xr.Dataset, bodies: Space, name: str) -> list[dict[str, Any]]:
    """Loads on the ends of a joint's bearing, N, in global axes, and the way from its middle to each in a link's frame.

    Those of a bearing lie along the axis of its first link, at −u first; of a cross two on the pin of each link.
    """
    ends = column(result, "end_load", joint=name) if name in names(result, "joint") else None
    solid = [] if ends is None else [end for end in ends if np.isfinite(end).any()]
    return [
        {"link": bodies.joints[name]["links"][order // 2],
         "along": numbers((1.0 if order % 2 else -1.0) * bodies.element(name, order // 2)[1]),
         "force": {axis: series(part) for axis, part in zip("xyz", end, strict=True)}}
        for order, end in enumerate(solid if len(solid) in (2, 4) else [])
    ]  # fmt: skip


def _screw(result: xr.Dataset, bodies: Space, link: str) -> dict[str, Any] | None:
    """The instantaneous screw axis of a link against the ground: a point, a unit direction, pitch (m/rad)."""
    spin = column(result, "link_angular_velocity", link=link)
    key = next((key for key in names(result, "point") if key.split(".", 1)[0] == link), None)
    if spin is None or key is None or "point_velocity" not in result:
        return None
    place, velocity = (members(result, f"point_{what}", "point")[key] for what in ("position", "velocity"))
    point, along, pitch = screw_axis(spin, place, velocity, bodies.middle)
    parts = zip(("x", "y", "z", "u", "v", "w", "pitch"), (*point, *along, pitch), strict=True)
    return {name: series(part) for name, part in parts}


def screw_axis(spin: Row, place: Row, velocity: Row, near: Row) -> tuple[Row, Row, Row]:
    """Screw axis of a body that turns with ω while its point p moves with v: c = p + ω × v/|ω|², h = ω · v/|ω|².

    All (3, position); near (3,): the point of the axis that is given is the one nearest to this. NaN where it does not
    turn, and the axis is at infinity.
    """
    speed = np.linalg.norm(spin, axis=0)
    fastest = speed[np.isfinite(speed)].max(initial=0.0)
    turning = np.where(speed > UNTURNED * fastest, speed, np.nan)
    along = spin / turning
    point = place + np.cross(along, velocity, axis=0) / turning
    point = point + along * ((near[:, None] - point) * along).sum(axis=0)
    return point, along, (along * velocity).sum(axis=0) / turning


# ---- blocks ---------------------------------------------------------------------------------------------------------


def blocks_of(system: System, result: xr.Dataset) -> dict[str, Any]:
    """Return blocks and wires of a solved mechanism: driver and Assur groups wired by their pins.  [D 17, Fig. 9]

    Returns
    -------
    dict
        blocks: in the order of solution, the ground first: label, kind, links, joints (those inside, and all), and
        their share of the friction power at each position. wires: one for each joint between two blocks, from the
        block that is solved earlier: joint, type, the two links, the motion that goes forward (position, m, velocity,
        m/s, by axis; in the plane angle, rad, and rate, rad/s, of the earlier link) and the load that comes back
        (force by axis, N, and moment, N m, on the earlier link, friction included).
    """
    home = {system.mechanism.fixed_link: 0}
    blocks: list[dict[str, Any]] = [{"label": "ground", "kind": "ground", "links": [system.mechanism.fixed_link]}]
    wires, losses_of = [], members(result, "friction_power", "joint")
    every = np.sum(np.abs(list(losses_of.values())), axis=0)
    for count, module in enumerate(system.plan.modules, start=1):
        home |= dict.fromkeys(module.links, count)
        inner = []
        for joint in module.joints:
            kind, links = system.joints[joint].type, system.joints[joint].links
            earlier = next((link for link in links if home.get(link, count) != count), None)
            if earlier is None:
                inner.append(joint)
                continue
            later = next(link for link in links if link != earlier)
            wires.append({"joint": joint, "type": kind, "from": home[earlier], "to": count, "links": [earlier, later],
                          **_passing(system, result, joint, earlier, later)})  # fmt: skip
        with np.errstate(invalid="ignore", divide="ignore"):  # NaN where friction takes nothing
            share = np.sum(np.abs([losses_of[joint] for joint in module.joints]), axis=0) / every
        blocks.append({
            "label": module.label, "kind": "driver" if module.rank == 1 else module.kind, "links": list(module.links),
            "inner": inner, "driven": list(module.driven), "gears": list(module.gears), "share": share,
        })  # fmt: skip
    return {"blocks": blocks, "wires": wires}


def _passing(system: System, result: xr.Dataset, joint: str, earlier: str, later: str) -> dict[str, Any]:
    """What a wire carries forward and back at every position."""
    axes, key = names(result, "axis"), f"{later}.{joint}"
    if key not in result["point"].values:
        return {"forward": {}, "back": {}}
    forward: dict[str, Any] = {
        name: dict(zip(axes, result[f"point_{name}"].sel(point=key).values, strict=True))
        for name in ("position", "velocity")
    }
    if not system.spatial:
        forward["angle"] = result["link_angle"].sel(link=earlier).values
        forward["rate"] = result["link_angle_velocity"].sel(link=earlier).values
    sign = -1.0 if system.joints[joint].links[1] == later else 1.0  # reactions are on the second link, by the first
    moment = sign * result["reaction_moment"].sel(joint=joint).values
    friction = result["friction_torque" if system.turns(joint) else "friction_force"].sel(joint=joint).values
    back = {
        "force": dict(zip(axes, sign * result["reaction_force"].sel(joint=joint).values, strict=True)),
        "moment": dict(zip(axes, moment, strict=True)) if moment.ndim > 1 else moment,
        "friction": sign * friction,
    }
    return {"forward": forward, "back": back}

"""The spatial part of a scene: poses of the links, their bodies, free points, loads, screw axes, and the first view.

Places and directions that never move in a link are told in its frame; the browser moves them with the link's pose.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from trunnion.joints.pairs import PAIRS
from trunnion.views.axis import Array, column, names, series
from trunnion.views.space.bodies import Space, gathered
from trunnion.views.space.solids import best, looking, scenery

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["screw_axis", "space_scene"]

STILL = 1e-6  # a link that turns slower than this share of its fastest has no screw axis worth a line


def space_scene(result: xr.Dataset) -> dict[str, Any]:
    """What a scene of a mechanism in space has besides curves; `solids` is empty if no position can be drawn."""
    bodies = gathered(result)
    drawn = bool(bodies.drawable.any())
    still: dict[str, Any] = {axis: [float(axis == "w")] for axis in "xyzwijk"}
    links, present = [], names(result, "link")
    for link in bodies.stated["links"]:
        pose = still  # place x, y, z (m) and quaternion w, i, j, k
        if link in present:
            pose = {axis: series(column(result, "link_position", link=link, axis=axis)) for axis in "xyz"} | {
                to: series(column(result, "link_rotation", link=link, component=source))
                for to, source in zip("wijk", "wxyz", strict=True)
            }
        screw = _screw(result, bodies, link) if drawn and link != bodies.ground else None
        links.append({"name": link, "ground": link == bodies.ground, "pose": pose if drawn else None, "screw": screw})
    parts: dict[str, Any] = {"space": "spatial", "links": links, "solids": [], "free": [], "seats": {}, "loads": []}
    if not drawn:
        return parts
    around, above = best(bodies)
    look = scenery(bodies, looking(around, above))
    seats = {}  # where a joint's symbol sits on its second link and along which axes: none of a ball or a weld
    for name, joint in bodies.joints.items():
        pair, sides = PAIRS[joint["type"]], list(enumerate(joint["links"]))
        sides = sides if pair.crossed else sides[1:] if pair.one_axis or pair.angle else []
        axes = [{"link": link, "along": _vector(bodies.element(name, side)[1])} for side, link in sides]
        seats[name] = {"link": joint["links"][1], "at": _vector(bodies.seat(name)), "axes": axes,
                       "ends": _ends(result, bodies, name)}  # fmt: skip
    return parts | {
        "size": _number(bodies.size), "scaled": bool(bodies.extent), "middle": [_number(n) for n in bodies.middle],
        "view": {"around": around, "above": above, "box": [_number(edge) for edge in look.box]},
        "solids": [solid.data() for solid in look.solids],
        "free": [{"key": key, "link": key.split(".", 1)[0], "at": _vector(at)} for key, at in bodies.free.items()],
        "seats": seats,
        "loads": _loads(bodies), "apart": any(bodies.shifts.values()),
    }  # fmt: skip


def _number(value: float) -> float:
    return float(f"{value:.7g}")


def _vector(values: Array) -> list[float]:
    return [_number(float(value)) for value in values]


def _ends(result: xr.Dataset, bodies: Space, name: str) -> list[dict[str, Any]]:
    """Loads on the ends of a joint's bearing, N, in global axes, and the way from its middle to each in a link's frame.

    Those of a bearing lie along the axis of its first link, at −u first; of a cross two on the pin of each link.
    """
    ends = column(result, "end_load", joint=name) if name in names(result, "joint") else None
    solid = [] if ends is None else [end for end in ends if np.isfinite(end).any()]
    if len(solid) not in (2, 4):
        return []
    rows = []
    for order, end in enumerate(solid):
        side, sense = order // 2, 1.0 if order % 2 else -1.0
        along = _vector(sense * bodies.element(name, side)[1])
        rows.append({"link": bodies.joints[name]["links"][side], "along": along,
                     "force": {axis: series(part) for axis, part in zip("xyz", end, strict=True)}})  # fmt: skip
    return rows


def _loads(bodies: Space) -> list[dict[str, Any]]:
    """Forces at their points and moments on their links, with the place they are drawn at in the link's frame."""
    rows = []
    for name, load in bodies.stated["loads"].items():
        link = load.get("link")
        if link not in bodies.poses:
            continue
        seats = {joint: bodies.seat(joint, entry["links"].index(link)) for joint, entry in bodies.joints.items()
                 if link in entry["links"]}  # fmt: skip
        spots = seats | {key.split(".", 1)[1]: at for key, at in bodies.free.items() if key.split(".", 1)[0] == link}
        at = spots.get(load.get("at") or load.get("joint") or "")
        if at is None and load.get("at") is None and seats:
            at = np.mean(list(seats.values()), axis=0)
        if at is not None:
            rows.append({"name": name, "link": link, "at": _vector(at), "force": load.get("force") or [0.0, 0.0, 0.0],
                         "moment": load.get("moment") or [0.0, 0.0, 0.0], "frame": load.get("frame", "global"),
                         "varies": bool(load.get("varies")), "useful": bool(load.get("useful"))})  # fmt: skip
    return rows


def _screw(result: xr.Dataset, bodies: Space, link: str) -> dict[str, Any] | None:
    """The instantaneous screw axis of a link against the ground: a point, a unit direction, pitch (m/rad)."""
    spin = column(result, "link_angular_velocity", link=link)
    key = next((key for key in names(result, "point") if key.split(".", 1)[0] == link), None)
    if spin is None or key is None:
        return None
    place, velocity = (column(result, f"point_{what}", point=key) for what in ("position", "velocity"))
    if place is None or velocity is None:
        return None
    point, along, pitch = screw_axis(spin, place, velocity, bodies.middle)
    return {
        **{axis: series(part) for axis, part in zip("xyz", point, strict=True)},
        **{axis: series(part) for axis, part in zip("uvw", along, strict=True)},
        "pitch": series(pitch),
    }


def screw_axis(spin: Array, place: Array, velocity: Array, near: Array) -> tuple[Array, Array, Array]:
    """Screw axis of a body that turns with ω while its point p moves with v: c = p + ω × v/|ω|², h = ω · v/|ω|².

    All (3, position); near (3,): the point of the axis that is given is the one nearest to this. NaN where it does not
    turn, and the axis is at infinity.
    """
    speed = np.linalg.norm(spin, axis=0)
    fastest = speed[np.isfinite(speed)].max(initial=0.0)
    turning = np.where(speed > STILL * fastest, speed, np.nan)
    along = spin / turning
    point = place + np.cross(along, velocity, axis=0) / turning
    point = point + along * ((near[:, None] - point) * along).sum(axis=0)
    return point, along, (along * velocity).sum(axis=0) / turning

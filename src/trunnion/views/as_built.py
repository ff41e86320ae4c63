"""Errors and seats of a result, for figures, report and browser: worst points, outputs, losses of contact, seats."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from trunnion.errors import Status
from trunnion.joints.pairs import PAIRS
from trunnion.results.attributes import units_of
from trunnion.results.dataset import units_along, without_noise
from trunnion.results.quantities import number, quantity
from trunnion.views.axis import Array, abscissa, column, is_spatial, layout, members, names, numbers, series
from trunnion.views.bodies import Space, gathered
from trunnion.views.curves import peak
from trunnion.views.page import NONE

if TYPE_CHECKING:
    import xarray as xr

JUMP = 60.0  # °: a seat that turns by more from one position to the next is taken to have jumped
LEAST = 0.1  # of the largest error of place: points below it are not among the worst
ALIKE = 1e-3  # of the largest: two curves nearer than this are one
MOST_WORST, MOST_PLACES = 4, 12


# ---- errors and seats -----------------------------------------------------------------------------------------------


def point_errors(result: xr.Dataset) -> dict[str, Array]:
    """Size of the error of place of every point that has any, (position,) m."""
    sizes = {key: np.linalg.norm(error, axis=0) for key, error in members(result, "point_error", "point").items()}
    return {key: size for key, size in sizes.items() if peak(size) > 0}


def worst_points(result: xr.Dataset) -> dict[str, Array]:
    """The points with the largest errors of place, worst first; of those that err alike one."""
    errors = point_errors(result)
    tops = {key: peak(error) for key, error in errors.items()}
    worst, picked = max(tops.values(), default=0.0), dict[str, Array]()
    for key in sorted(errors, key=lambda key: (-tops[key], key)):
        alike = any(np.nanmax(np.abs(errors[key] - other)) < ALIKE * worst for other in picked.values())
        if tops[key] >= LEAST * worst and not alike and len(picked) < MOST_WORST:
            picked[key] = errors[key]
    return picked


def outputs(result: xr.Dataset) -> dict[str, tuple[str, str, Array]]:
    """Transmission errors, as the summary of the result has them: of the joints of the ground that no driver moves.

    By joint: what it is of ("rotation of D"), unit and error, of the rotation, rad, or of the slide, m.
    """
    facts, drivers, errors = layout(result), names(result, "driver"), {}
    for joint in names(result, "joint"):
        about = facts["joints"].get(joint, {})
        if facts["ground"] in about.get("links", ()) and joint not in drivers:
            noun, unit = ("slide", "m") if PAIRS[about["type"]].guided else ("rotation", "rad")
            error = column(result, f"joint_{noun}_error", joint=joint)
            if error is not None and np.isfinite(error).any():
                errors[joint] = f"{noun} of {joint}", unit, error
    return errors


def losses(result: xr.Dataset) -> dict[str, NDArray[np.intp]]:
    """Positions at which each joint loses contact, of those that do."""
    lost = {joint: np.flatnonzero(row > 0) for joint, row in members(result, "contact_lost", "joint").items()}
    return {joint: places for joint, places in lost.items() if places.size}


class Seats(NamedTuple):
    """The seat of one joint over the run.

    kind: "pin", "guide" or "ball"; clearance and play along the axis to either side, m; length H, m, or None.
    offsets, forces: (end, axis, position) m and N in the hole's axes, of as many ends as it has; links: that of the pin
    and that of the hole.
    """

    joint: str
    kind: str
    clearance: float
    along: float
    length: float | None
    offsets: Array
    forces: Array
    links: tuple[str, str]

    @property
    def peak(self) -> float:
        """The largest load at an end, N."""
        return float(np.linalg.norm(np.nan_to_num(self.forces), axis=1).max(initial=0.0))

    @property
    def planar_guide(self) -> bool:
        """Whether it is a guide of the plane, which has offsets across it alone."""
        return self.kind == "guide" and self.offsets.shape[1] == 2


def seated(result: xr.Dataset) -> list[Seats]:
    """Every joint with a seat that is known anywhere."""
    facts, every = layout(result), []
    offsets, forces = (members(result, name, "joint") for name in ("seat_offset", "end_force"))
    for joint, play in facts.get("plays", {}).items():
        if joint in offsets and np.isfinite(offsets[joint]).any():
            offset, force, kind = offsets[joint], forces[joint], play["kind"]
            ends = 1 if kind == "ball" or (kind == "pin" and offset.shape[1] == 2) else 2
            first, second = facts["joints"][joint]["links"]
            every.append(Seats(joint, kind, play["clearance"], play["float"], play["length"], offset[:ends],
                               force[:ends], (first, second)))  # fmt: skip
    return every


def seat_angles(result: xr.Dataset) -> list[tuple[str, str, Array]]:
    """ "β" or "ξ", the joint and the course, °, of every pin in space, ξ of those of the plane."""
    angles = {sign: members(result, f"seat_{name}", "joint") for sign, name in (("β", "beta"), ("ξ", "xi"))}
    return [
        (sign, seats.joint, np.degrees(angles[sign][seats.joint]))
        for seats in seated(result)
        for sign in ("β", "ξ")
        if not seats.planar_guide and (sign == "ξ" or len(seats.offsets) == 2)
        and np.isfinite(angles[sign].get(seats.joint, np.nan)).any()
    ]  # fmt: skip


# ---- tables of the report -------------------------------------------------------------------------------------------


def error_rows(result: xr.Dataset) -> list[list[str]]:
    """Label, as built, ideal, difference and place of what errors change; none of a mechanism without errors.

    Of courses the largest as built and ideal, where contact is not lost; of errors the largest alone.
    """
    if "point_error" not in result:
        return []
    result = without_noise(result)
    over, units, rows = abscissa(result), units_of(result), list[list[str]]()
    lost_there = np.asarray(result["status"].values) == Status.CONTACT_LOST  # those positions are not valid

    def row(label: str, built: float, ideal: float, unit: str, place: str = "") -> list[str]:
        change = f"{'+' if built > ideal else ''}{quantity(built - ideal, unit, units)}"
        return [label, quantity(built, unit, units), quantity(ideal, unit, units), change, place]

    def largest(label: str, unit: str, built: Array, ideal: Array | None = None) -> list[str]:
        sizes, none = np.where(lost_there, np.nan, built), "" if ideal is None else NONE
        if not np.isfinite(sizes).any():
            return [label, none, none, NONE, ""]
        index = int(np.nanargmax(np.abs(sizes)))
        place, value = over.say(index), float(sizes[index])
        if ideal is None:
            return [label, "", "", quantity(value, unit), place]
        other = np.where(lost_there, np.nan, ideal)
        return row(label, value, float(np.nanmax(other)) if np.isfinite(other).any() else np.nan, unit, place)

    rows += [largest(f"Position error of {key}, largest", "m", size) for key, size in worst_points(result).items()]
    rows += [largest(f"Transmission error, {of}, largest", unit, error) for of, unit, error in outputs(result).values()]
    efforts, changes = (members(result, f"drive_effort{end}", "driver") for end in ("", "_change"))
    for (driver, effort), unit in zip(efforts.items(), units_along(result["drive_effort"], "driver"), strict=True):
        noun = "force" if unit == "N" else "torque"
        sizes = np.abs(effort), np.abs(effort - changes[driver])
        rows.append(largest(f"Drive {noun} of {driver}, largest", unit, *sizes))
    forces, changes = (members(result, f"reaction_force{end}", "joint") for end in ("", "_change"))
    for joint, force in forces.items():
        sizes = np.linalg.norm(force, axis=0), np.linalg.norm(force - changes[joint], axis=0)
        rows.append(largest(f"Reaction of {joint}, largest", "N", *sizes))
    lost, ideally = (float(sum(members(result, f"friction_power_mean{of}", "joint").values())) for of in ("", "_ideal"))
    etas = (column(result, f"efficiency{of}") for of in ("", "_ideal"))
    built, free = (np.nan if eta is None else float(eta) for eta in etas)
    return [*rows, row("Friction power, mean", lost, ideally, "W"), row("Efficiency of the cycle", built, free, "1")]


def loss_rows(result: xr.Dataset) -> list[list[str]]:
    """Joints that lose contact, with the positions, and the largest contact loss number."""
    over, rows = abscissa(result), []
    for joint, places in losses(result).items():
        examples = ", ".join(over.say(int(index)) for index in places[:MOST_PLACES])
        more = len(places) - MOST_PLACES
        rates = column(result, "contact_loss_number", joint=joint)
        any_rate = rates is not None and np.isfinite(rates).any()
        most = f"{number(float(np.nanmax(rates)), 3)}\u00a0rad/(N\u00a0s)" if rates is not None and any_rate else NONE
        rows.append([joint, f"{examples} and {more} more" if more > 0 else examples, most])
    return rows


# ---- for the browser ------------------------------------------------------------------------------------------------

FAR, LEANT = 0.06, 0.2  # what is offered: the largest error of place as this share of the size, or of angle, rad
SLIGHT = 1e-3  # a stretch of less than this share of the largest error of place is not told


def built(result: xr.Dataset, lost: list[int]) -> dict[str, Any] | None:
    """Errors and seats for the browser; None of a result without errors. lost: positions without contact."""
    if "point_error" not in result:
        return None
    spatial = is_spatial(result)
    bodies, points = gathered(result) if spatial else None, members(result, "point_error", "point")
    tracks = [track.T for track in members(result, "point_position", "point").values()]
    places = np.concatenate(tracks or [np.empty((0, 2))])
    places = places[np.isfinite(places).all(axis=1)]
    size = bodies.size if bodies else float(np.linalg.norm(np.ptp(places, axis=0))) if len(places) else 0.0
    # the magnification at which errors are well seen and links are still where one looks for them: 1, 2 or 5 times 10ⁿ
    far, turned = peak(*point_errors(result).values()), peak(result["link_error"].values)
    most = min(FAR * size / far if far else np.inf, LEANT / turned if turned else np.inf, 1000.0)
    steps = [step * base for base in (1.0, 10.0, 100.0, 1000.0) for step in (1.0, 2.0, 5.0)]
    return {
        "preset": max([step for step in steps if step <= most * (1 + 1e-9)], default=1.0),
        "points": {} if spatial else {key: _vector(error) for key, error in points.items()},
        "links": _moved(result, bodies) if bodies
        else {link: series(error) for link, error in members(result, "link_error", "link").items()},
        "worst": [{"label": key, "values": series(values)} for key, values in worst_points(result).items()],
        "outputs": [
            {"label": text, "unit": "°" if unit == "rad" else "m",
             "values": series(np.degrees(error) if unit == "rad" else error)}
            for text, unit, error in outputs(result).values()
        ],
        "lost": lost,
        "seats": [
            {"joint": seats.joint, "kind": seats.kind, "clearance": seats.clearance, "length": seats.length,
             "links": seats.links,
             "ends": [{"offset": _vector(offset), "force": _vector(force)}
                      for offset, force in zip(seats.offsets, seats.forces, strict=True)]}
            for seats in seated(result)
        ],
        # β and ξ of the pins, °, with the positions before which they jump
        "angles": [
            {"sign": sign, "joint": joint, "values": series(values),
             "breaks": np.flatnonzero(np.abs(np.diff(values, prepend=values[-1:])) > JUMP).tolist()}
            for sign, joint, values in seat_angles(result)
        ],
    }  # fmt: skip


def _vector(values: Array) -> dict[str, list[float | None]]:
    return {axis: series(part) for axis, part in zip("xyz", values, strict=False)}


def _moved(result: xr.Dataset, bodies: Space) -> dict[str, Any]:
    """Of each link the mean error of its points, its rotation vector, the middle of the points, and its stretch: by how
    much each point lies elsewhere in it than in the ideal one, with where it is drawn.
    """
    moved, turns = {}, members(result, "link_error", "link")
    errors, tracks = (members(result, f"point_{what}", "point") for what in ("error", "position"))
    for link, pose in bodies.poses.items():
        of_link = {key: error for key, error in errors.items() if key.split(".", 1)[0] == link}
        if link not in turns or not np.isfinite(turns[link]).any() or not of_link:
            continue
        # places in the frame of the link, the means over the positions that are known
        places = {key: np.nanmean(np.einsum("jin,jn->in", pose.matrix, tracks[key] - pose.origin), axis=1)
                  for key in of_link}  # fmt: skip
        about, shift = np.mean(list(places.values()), axis=0), np.mean(list(of_link.values()), axis=0)
        rows, largest = [], max(float(np.nanmax(np.abs(error), initial=0.0)) for error in of_link.values())
        for key, error in of_link.items():
            arm = np.einsum("ijn,j->in", pose.matrix, places[key] - about)
            left = error - shift - np.cross(turns[link], arm, axis=0)
            by = np.nan_to_num(np.nanmedian(np.einsum("jin,jn->in", pose.matrix, left), axis=1))
            name = key.split(".", 1)[1]
            joint = bodies.joints.get(name, {"links": ()})
            seat = bodies.seat(name, joint["links"].index(link)) if link in joint["links"] else places[key]
            rows.append({"at": numbers(seat), "by": numbers(by)})
        stretched = max(peak(np.array(row["by"])) for row in rows) > SLIGHT * largest
        moved[link] = {"about": numbers(about), "shift": _vector(shift), "turn": _vector(turns[link]),
                       "stretch": rows if stretched else []}  # fmt: skip
    return moved

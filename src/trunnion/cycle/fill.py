"""What a walk came to, written into the arrays of a result: every variable, in the plane and in space, what errors
change, and nothing where a status rules it out."""

from __future__ import annotations

import functools
from collections.abc import Collection, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from trunnion.algebra.namespace import Number
from trunnion.algebra.space import moment_at, quaternion
from trunnion.algebra.unwrap import unwrap_row
from trunnion.algebra.vector import cross, dot, plus, scaled
from trunnion.cycle.causes import Causes
from trunnion.errors import Status
from trunnion.joints.clearance import describing
from trunnion.joints.pairs import PAIRS
from trunnion.model.joint_parts import clearance
from trunnion.results import variables as results
from trunnion.solve.backward import Backward
from trunnion.solve.contacts import bearing_ends, bearing_middle, has_pressure, loads_on_ends
from trunnion.solve.end_loads import loads_of
from trunnion.solve.forward import Forward, SpatialWalk
from trunnion.solve.loads import has_useful_work, useful_powers
from trunnion.solve.margin import locking_margin
from trunnion.solve.shifts import GivenSeat, seats
from trunnion.solve.status import status_of
from trunnion.solve.system import System, Values

__all__ = [
    "COMPARED", "CONDITIONS", "Arrays", "Into", "allocate", "blank", "fill_bearing", "fill_chunk", "fill_errors",
    "fill_joint", "fill_lanes", "labels", "pin_area", "put", "unwrap", "write",
]  # fmt: skip

Arrays = dict[str, NDArray[np.float64]]
Into = Mapping[str, Any]  # arrays by name, or what stands for them where a walk is written down
Vector = Sequence[Number]
CONDITIONS = "module_condition"  # (module, …, position), beside the variables of a result where somebody asks for it
POSES = [
    *("point_position", "link_angle", "link_position", "link_rotation", "joint_rotation", "joint_slide"),
    *("spring_elongation", "closure_residual", "condition"),
]
RATES = [name for name in results.VARIABLES if name.endswith(("velocity", "acceleration"))]
# with them what follows from them: of loads that are not known neither the seats are, nor what errors change
APART = {*POSES, *RATES, "locking_margin", "seat_change", "contact_loss_number"}
FORCES = [name for name, own in results.VARIABLES.items() if own.dtype is np.float64 and name not in APART]
AXES = "xyz"
DIFFERENCES = {
    "point_error": "point_position",
    "joint_slide_error": "joint_slide",
    "reaction_force_change": "reaction_force",
    "drive_effort_change": "drive_effort",
    "friction_power_change": "friction_power",
}
# what of the ideal mechanism is read
COMPARED = {*DIFFERENCES.values(), "link_angle", "link_rotation", "joint_rotation", "status"}


def labels(system: System) -> dict[str, list[str]]:
    """Names along the dims."""
    mechanism, spatial = system.mechanism, system.mechanism.space == "spatial"
    ends = max((bearing_ends(mechanism, joint) for joint in system.joints), default=0)
    members = {
        "spring": list(mechanism.springs),
        "gear": list(mechanism.gears),
        "bearing_end": [str(end + 1) for end in range(ends)],
    }
    return {
        **{dim: names for dim, names in members.items() if names},
        "joint": list(system.joints),
        "link": list(mechanism.effective_links if spatial else mechanism.links),
        "point": [f"{link}.{point}" for link, point in system.points],
        "axis": ["x", "y", "z"][: mechanism.coordinates],
        "driver": list(mechanism.drivers),
        **({"component": ["w", "x", "y", "z"]} if spatial else {}),
    }


def allocate(
    system: System, positions: int, parts: Sequence[str] = (), wanted: Collection[str] | None = None
) -> Arrays:
    """Arrays for the variables of a system, see `results.variables.allocate`."""
    names = labels(system) | ({"end": ["1", "2"]} if "seats" in parts else {})
    if "bearing_end" in names or any(has_pressure(system.mechanism, joint) for joint in system.joints):
        parts = [*parts, "bearings"]
    return results.allocate(names, positions, parts, wanted)


# ---- motion ---------------------------------------------------------------------------------------------------


def fill_motion(arrays: Into, walk: Forward, window: slice) -> None:
    """Angles or frames of links, points and joints of one chunk."""
    system = walk.system
    for i, (link, name) in enumerate(system.points):
        for key, numbers in zip(("position", "velocity", "acceleration"), walk.point(link, name), strict=True):
            put(arrays[f"point_{key}"], i, numbers, window)
    if isinstance(walk, SpatialWalk):
        for i, link in enumerate(system.mechanism.effective_links):
            frame, twist, second = walk.motions[link]
            put(arrays["link_rotation"], i, quaternion(frame), window)
            put(arrays["link_position"], i, frame.place, window)
            put(arrays["link_angular_velocity"], i, twist.u, window)
            put(arrays["link_angular_acceleration"], i, second.u, window)
        for i, joint in enumerate(system.joints):
            fill_joint(arrays, walk, i, joint, window)
        return
    for i, link in enumerate(system.mechanism.links):
        if link != system.mechanism.fixed_link:
            motion = walk.motions[link]
            arrays["link_angle"][i, window] = np.arctan2(motion.frame.s, motion.frame.c)
            arrays["link_angle_velocity"][i, window] = motion.twist.w
            arrays["link_angle_acceleration"][i, window] = motion.acceleration.w
    for i, joint in enumerate(system.joints):
        slides = not system.turns(joint)
        name = "joint_slide" if slides else "joint_rotation"
        arrays[f"{name}_velocity"][i, window] = walk.rates(joint)[slides]
        arrays[f"{name}_acceleration"][i, window] = walk.second_rates(joint)[slides]
        if slides:
            arrays[name][i, window] = walk.coordinates(joint)[1]


def put(array: Any, i: int, numbers: Sequence[Number], window: slice) -> None:
    """The components of the i-th vector."""
    for axis, number in enumerate(numbers):
        array[i, axis, window] = number


def fill_joint(arrays: Into, walk: SpatialWalk, i: int, joint: str, window: slice) -> None:
    """Rotation and slide of one joint with their derivatives; of balls and crosses the angle between their elements."""
    pair = walk.pair(joint)
    if pair.one_axis or pair.angle:
        both = zip(walk.coordinates(joint), walk.rates(joint), walk.second_rates(joint), strict=True)
        for name, values in zip(("joint_rotation", "joint_slide"), both, strict=True):
            if pair.one_axis or name == "joint_rotation":
                for suffix, value in zip(("", "_velocity", "_acceleration"), values, strict=True):
                    arrays[name + suffix][i, window] = value
        return
    (first, second), (first_end, two) = walk.system.joints[joint][1], walk.ends(joint)
    turn = scaled(0.5, plus(plus(cross(first_end.x, two.x), cross(first_end.y, two.y)), cross(first_end.z, two.z)))
    cosine = 0.5 * (dot(first_end.x, two.x) + dot(first_end.y, two.y) + dot(first_end.z, two.z) - 1)
    spin = walk.against(joint).u
    change = tuple(
        b - a for a, b in zip(walk.motions[first].acceleration.u, walk.motions[second].acceleration.u, strict=True)
    )
    speed = np.sqrt(dot(spin, spin))
    arrays["joint_rotation"][i, window] = np.arctan2(np.sqrt(dot(turn, turn)), cosine)
    arrays["joint_rotation_velocity"][i, window] = speed
    moves = np.greater(speed, 0)
    rate = (spin[0] * change[0] + spin[1] * change[1] + spin[2] * change[2]) / np.where(moves, speed, 1.0)
    arrays["joint_rotation_acceleration"][i, window] = np.where(moves, rate, 0.0)


# ---- forces ---------------------------------------------------------------------------------------------------


def fill_forces(arrays: Into, back: Backward, window: slice) -> None:
    """Reactions, friction, drive efforts, springs and gear pairs of one chunk; in space about the middles of the
    bearings."""
    walk, mechanism = back.walk, back.walk.system.mechanism
    for i, joint in enumerate(walk.system.joints):
        turns = walk.system.turns(joint)
        fill_bearing(arrays, walk, i, joint, back.reactions[joint], back.friction_wrenches[joint], window)
        if turns:
            arrays["friction_torque"][i, window] = back.friction[joint]
        if isinstance(walk, SpatialWalk):
            middle, friction = bearing_middle(walk, joint), back.friction_wrenches[joint]
            put(arrays["reaction_force"], i, back.reactions[joint].u, window)
            put(arrays["reaction_moment"], i, moment_at(back.reactions[joint], middle), window)
            put(arrays["friction_moment"], i, moment_at(friction, middle), window)
            arrays["friction_force"][i, window] = dot(friction.u, walk.ends(joint)[1].z)
            continue
        *force, moment = back.reactions[joint]
        put(arrays["reaction_force"], i, force, window)
        if not turns:
            arrays["friction_force"][i, window] = back.friction[joint]
            arrays["reaction_moment"][i, window] = moment
    for i, name in enumerate(mechanism.drivers):
        arrays["drive_effort"][i, window] = back.efforts[name]
    for i, name in enumerate(mechanism.springs):
        arrays["spring_force"][i, window], arrays["spring_elongation"][i, window] = back.springs[name][:2]
    for i, name in enumerate(mechanism.gears):
        arrays["gear_torque"][i, window] = back.gears[name].torque
        put(arrays["gear_force"], i, back.gears[name].force, window)


def fill_bearing(arrays: Into, walk: Forward, i: int, joint: str, reaction: Any, friction: Any, window: slice) -> None:
    """Loads on the ends of one joint's bearing or guide, and the pressure of its pin, where somebody reads them."""
    mechanism = walk.system.mechanism
    ends, pressed = bearing_ends(mechanism, joint) > 0, has_pressure(mechanism, joint)
    if not ((ends and _is_read(arrays["end_load"])) or (pressed and _is_read(arrays["pin_pressure"]))):
        return
    loads = loads_on_ends(walk, joint, reaction, friction) if ends else [(0.5 * reaction.x, 0.5 * reaction.y, 0.0)]
    for end, load in enumerate(loads if ends else ()):
        for axis in range(mechanism.coordinates):
            arrays["end_load"][i, end, axis, window] = load[axis]
    if pressed:
        most = functools.reduce(np.maximum, (np.sqrt(dot(load, load)) for load in loads))
        arrays["pin_pressure"][i, window] = 2 * most / pin_area(walk.values, joint)


def pin_area(values: Values, joint: str) -> Number:
    """Projected area of a pin, its diameter times the length of its bearing, m²."""
    return 2 * values[f"joints.{joint}.pin.radius"] * values[f"joints.{joint}.pin.bearing"]


def _is_read(array: Any) -> bool:
    """Whether what is written into an array of `allocate` is read, as is all that stands for one."""
    return bool(getattr(array, "strides", (1,))[-1])


def fill_power(arrays: Into, back: Backward, time: Number, window: slice) -> None:
    """Power of drivers, loads, springs and friction, and what is left over: their sum with inertia and gravity."""
    walk = back.walk
    total: Number = back.body_power + back.gear_power
    for power in back.load_powers.values():
        total = total + power
    for i, name in enumerate(walk.system.joints):
        lost = back.losses[name]
        arrays["friction_power"][i, window] = lost
        total = total - lost
    for i, state in enumerate(back.springs.values()):
        arrays["spring_power"][i, window] = state.power
        arrays["damping_power"][i, window] = state.loss
        total = total + state.power
    driven: Number = 0.0
    for i, name in enumerate(walk.system.mechanism.drivers):
        power = back.efforts[name] * walk.system.drive(walk.values, name, time)[1]
        arrays["drive_power"][i, window] = power
        driven = driven + power
    useful: Number = 0.0
    for power in useful_powers(walk, back.load_powers, back.springs):
        useful = useful - power
    arrays["useful_power"][window] = useful
    defined = np.greater(driven, 0) & has_useful_work(walk.system.mechanism)
    arrays["efficiency_instant"][window] = useful / np.where(defined, driven, np.nan)
    arrays["power_residual"][window] = total + driven


# ---- seats and errors -----------------------------------------------------------------------------------------------


def fill_seats(arrays: Into, back: Backward, window: slice) -> None:
    """Seats, end forces and places of contact of one chunk."""
    walk = back.walk
    joints, axes = list(walk.system.joints), walk.system.mechanism.coordinates
    for seat in seats(walk.system.mechanism, walk.values):
        i = joints.index(seat.joint)
        ends = _ends(seat, seat.play.model.offsets(walk.values, f"seats.{seat.joint}") or [])
        loads = _ends(seat, loads_of(back, seat), shared=True)
        contacts = _contacts(walk, seat, ends)
        for name, vectors in (("seat_offset", ends), ("end_force", loads), ("contact_position", contacts)):
            for end, vector in vectors.items():
                put(arrays[name][i], end, vector[:axes], window)
        _describe(arrays, i, window, walk, seat, ends)


def _ends(seat: GivenSeat, vectors: Sequence[Vector], shared: bool = False) -> dict[int, list[Number]]:
    """Vectors of the ends at end 1 and 2; what is along the axis belongs to both, a force by halves."""
    keys = [key.split(".") for end in seat.play.model.ends for key in end]
    loads: dict[int, list[Number]] = {int(place) - 1: [0.0, 0.0, 0.0] for place, _ in keys if place != "3"}
    for (place, axis), number in zip(keys, (number for vector in vectors for number in vector), strict=True):
        for end in loads if place == "3" else (int(place) - 1,):
            loads[end][AXES.index(axis)] = 0.5 * number if shared and place == "3" else number
    return loads


def _describe(arrays: Into, i: int, window: slice, walk: Forward, seat: GivenSeat, ends: Mapping[int, Vector]) -> None:
    """β and ξ of a pin or guide; of a ball there are none."""
    model = seat.play.model
    if len(model.ends[0]) == 3:
        return
    beta: Number = 0.0
    if len(model.ends) == 1:
        xi = np.arctan2(ends[0][1], ends[0][0])
    else:  # a guide of the plane is told from its normal
        guide = len(model.ends[0]) == 1 and len(model.ends) == 2
        beta, xi = describing(*((ends[end][1], 0.0) if guide else (ends[end][0], ends[end][1]) for end in (0, 1)))
    arrays["seat_beta"][i, window], arrays["seat_xi"][i, window] = beta, xi
    if walk.system.turns(seat.joint):
        first_frame, two = (walk.element(link, seat.joint) for link in walk.system.joints[seat.joint][1])
        turn = walk.coordinate(seat.joint, first_frame, two)
        arrays["seat_xi_pin"][i, window] = wrapped(xi + turn)


def _contacts(walk: Forward, seat: GivenSeat, ends: Mapping[int, Vector]) -> dict[int, Vector]:
    """B₁ and B₂: on the wall of the hole in the direction of the offset; of a guide the ends of its axis."""
    gap, model = clearance(seat.joint, walk.values), seat.play.model
    radius = walk.values.get(f"joints.{seat.joint}.pin.radius", np.nan) + (gap if gap is not None else 0.0)
    guide = model.size is not None and model.size[0] == "guide"
    half = 0.5 * seat.play.length if model.size is not None else 0.0
    places: dict[int, Vector] = {}
    for end, offset in ends.items():
        x, y, z = offset if len(model.ends[0]) == 3 else (offset[0], offset[1], 0.0)
        size = np.sqrt(x * x + y * y + z * z)
        share = np.where(size > 0, radius / np.where(size > 0, size, 1.0), np.nan)
        along = half if end else -half
        if guide:
            local = (0.0, 0.0, along) if isinstance(walk, SpatialWalk) else (along, 0.0, 0.0)
        else:
            local = (share * x, share * y, share * z if len(model.ends[0]) == 3 else along)
        places[end] = walk.algebra.point_of(walk.hole(seat.joint), local[: len(walk.system.axes)])
    return places


def wrapped(angle: Number) -> Number:
    """An angle in (−π, π]."""
    return angle + 2 * np.pi * np.floor((np.pi - angle) / (2 * np.pi))


def fill_errors(arrays: Arrays, ideal: Arrays, system: System, window: slice) -> None:
    """Differences of one chunk to the ideal mechanism's results, which hold that chunk alone; NaN without an answer."""
    for name, of in DIFFERENCES.items():
        np.subtract(arrays[of][..., window], ideal[of], out=arrays[name][..., window])  # no copy: half the time
    if "link_angle" in arrays:
        links, turned = labels(system)["link"], wrapped(arrays["link_angle"][:, window] - ideal["link_angle"])
        arrays["link_error"][:, window] = turned
        for i, (_, (first, second)) in enumerate(system.joints.values()):
            arrays["joint_rotation_error"][i, window] = turned[links.index(second)] - turned[links.index(first)]
    else:
        for i, (built, meant) in enumerate(zip(arrays["link_rotation"], ideal["link_rotation"], strict=True)):
            arrays["link_error"][i, :, window] = _rotation_vector(built[:, window], meant)
        turned = wrapped(arrays["joint_rotation"][:, window] - ideal["joint_rotation"])
        arrays["joint_rotation_error"][:, window] = turned
    blank(arrays, arrays["status"][window].astype(np.int8), window)


def _rotation_vector(built: NDArray[np.float64], meant: NDArray[np.float64]) -> NDArray[np.float64]:
    """Rotation from one quaternion to another, rad, global axes: 2 atan2(|v|, w) along v of q₂ q₁*."""
    w, v = built[0], built[1:]
    scalar = w * meant[0] + np.sum(v * meant[1:], axis=0)
    vector = meant[0] * v - w * meant[1:] - np.cross(v, meant[1:], axis=0)
    sign = np.where(scalar < 0, -1.0, 1.0)
    size = np.sqrt(np.sum(vector**2, axis=0))
    share = np.where(size > 0, 2 * np.arctan2(size, sign * scalar) / np.where(size > 0, size, 1.0), 2.0)
    return np.asarray(sign * share * vector)


# ---- whole walks ----------------------------------------------------------------------------------------------------


def fill_chunk(
    arrays: Arrays,
    back: Backward,
    time: NDArray[np.float64],
    window: slice,
    causes: Causes | None = None,
) -> None:
    """Write one chunk into the result; what a status rules out becomes NaN."""
    status = status_of(back, arrays["status"][window].shape)
    arrays["status"][window] = status
    if causes:
        causes.note(back, status, np.arange(window.start, window.stop))
    with np.errstate(all="ignore"):
        write(arrays, back, time, window)
    blank(arrays, status, window)


def fill_lanes(
    arrays: Arrays,
    back: Backward,
    time: NDArray[np.float64],
    lanes: tuple[NDArray[np.intp], ...],
    causes: Causes | None = None,
) -> None:
    """The same of some positions, wherever they are: their numbers in the last dims of the arrays."""
    place: Any = (..., *lanes)
    varying = {name: array for name, array in arrays.items() if array.strides[-1]}
    window = {name: array[place] for name, array in arrays.items()}
    window |= {name: window[other] for name, other in results.SAME_AS.items() if name in window}
    fill_chunk(window, back, time, slice(0, len(lanes[-1])))
    if causes:
        causes.note(back, window["status"].astype(np.int8), lanes[-1])
    for name, array in varying.items():
        # rows that stay as they are may be zeros that take no memory until they are written
        for row in np.argwhere(np.any(window[name] != array[place], axis=-1)):
            array[(*row, *lanes)] = window[name][tuple(row)]


def write(arrays: Into, back: Backward, time: Number, window: slice) -> None:
    """Every variable but the status, of one walk."""
    fill_motion(arrays, back.walk, window)
    fill_forces(arrays, back, window)
    for figure in ("iterations", "change", "residual", "contraction"):  # of the friction iteration
        worst = functools.reduce(np.maximum, (getattr(settled, figure) for settled in back.settled), 0.0)
        arrays[f"friction_{figure}"][window] = worst
    arrays["locking_margin"][window] = locking_margin(back)
    fill_power(arrays, back, time, window)
    if "seat_offset" in arrays:
        fill_seats(arrays, back, window)
    groups = list(zip(back.walk.system.groups, back.walk.poses, strict=True))
    conditions = [group.condition(pose) for group, pose in groups]
    arrays["condition"][window] = functools.reduce(np.maximum, conditions, 0.0)
    arrays["closure_residual"][window] = functools.reduce(
        np.maximum, (group.closure(pose) for group, pose in groups), 0.0
    )
    if CONDITIONS in arrays:
        for i, condition in enumerate(conditions):
            arrays[CONDITIONS][i, window] = condition


def blank(arrays: Arrays, status: NDArray[np.int8], window: slice) -> None:
    """NaN for every number that a status rules out."""
    if not np.any(status >= Status.NOT_CONVERGED):
        return
    for names, where in (
        (FORCES, status >= Status.NOT_CONVERGED),
        (RATES, status >= Status.SINGULAR),
        (["locking_margin"], status >= Status.LOAD_UNDEFINED),
        # a driver's own link is known where the rest is not; a whole position is either assembled or not
        (POSES, status == Status.NOT_ASSEMBLED),
    ):
        for name in names:
            if name in arrays:
                arrays[name][..., window][..., where] = np.nan


# ---- angles that run on ---------------------------------------------------------------------------------------


def unwrap(arrays: Arrays, system: System, values: Values, time: NDArray[np.float64]) -> None:
    """Angles without jumps of a whole turn along each run of solved positions, and the joints' rotations.

    A driven rotation is the prescribed coordinate itself, whole turns included.
    """
    spatial = system.mechanism.space == "spatial"
    if not arrays["joint_rotation" if spatial else "link_angle"].strides[-1]:  # nobody reads them
        return
    step = float(time[1] - time[0]) if len(time) > 1 else 0.0
    places = {link: i for i, link in enumerate(labels(system)["link"])}
    for link, i in places.items():
        if not spatial and link != system.mechanism.fixed_link:
            unwrap_row(arrays["link_angle"][i], arrays["link_angle_velocity"][i], step)
    for i, (name, (kind, (first, second))) in enumerate(system.joints.items()):
        rotation = arrays["joint_rotation"][i]
        if not spatial:
            np.subtract(arrays["link_angle"][places[second]], arrays["link_angle"][places[first]], out=rotation)
        if name in system.mechanism.drivers:  # known where the rest is not
            arrays["joint_rotation" if system.turns(name) else "joint_slide"][i] = system.drive(values, name, time)[0]
        elif spatial and PAIRS[kind].angle:
            unwrap_row(rotation, arrays["joint_rotation_velocity"][i], step)
        if PAIRS[kind].threaded:  # its slide follows the whole turns
            pitch = float(np.ravel(values[f"joints.{name}.pitch"])[0])
            arrays["joint_slide"][i] = rotation * pitch / (2 * np.pi)

"""What a walk comes to, as the arrays of a result have it: every number of every variable by its place, in the plane
and in space, what errors change, NaN where a status rules a number out, and why positions have no answer."""

from __future__ import annotations

import functools
from collections.abc import Collection, Container, Hashable, Iterable, Iterator, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from trunnion.algebra import plane
from trunnion.algebra.namespace import Number, flat
from trunnion.algebra.space import moment_at, quaternion
from trunnion.algebra.vector import cross, dot, plus, scaled
from trunnion.errors import Status
from trunnion.groups.dyad import DyadPose
from trunnion.joints.clearance import describing
from trunnion.model.joint_parts import clearance
from trunnion.results import variables as results
from trunnion.solve.backward import Backward, status_of
from trunnion.solve.contacts import bearing_ends, bearing_middle, has_pressure, loads_on_ends
from trunnion.solve.forward import Forward, SpatialWalk
from trunnion.solve.loads import has_useful_work, useful_powers
from trunnion.solve.margin import locking_margin
from trunnion.solve.seating import loads_of
from trunnion.solve.shifts import GivenSeat, seats
from trunnion.solve.switches import unwrap_row
from trunnion.solve.system import Positions, System, Values, sticking

Array = NDArray[np.float64]
Arrays = dict[str, Array]
Vector = Sequence[Number]
Cell = tuple[str, tuple[int, ...], Number]  # variable, place in its array but for the position, number
CONDITIONS = "module_condition"  # (module, …, position), beside the variables of a result where somebody asks for it
POSES = [
    *("point_position", "link_angle", "link_position", "link_rotation", "joint_rotation", "joint_slide"),
    *("spring_elongation", "closure_residual", "condition"),
]
RATES = [name for name in results.VARIABLES if name.endswith(("velocity", "acceleration"))]
# with them what follows from them: of loads that are not known neither the seats are, nor what errors change
APART = {*POSES, *RATES, "locking_margin", "seat_change", "contact_loss_number"}
FORCES = [name for name, variable in results.VARIABLES.items() if variable.dtype is np.float64 and name not in APART]
AXES = "xyz"
DERIVATIVES = ("", "_velocity", "_acceleration")
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
    """Arrays to be filled, position last. wanted: the variables, all that the system has if not given.

    parts: of the variables that not every result has, such as "errors".
    """
    names = labels(system) | ({"end": ["1", "2"]} if "seats" in parts else {})
    if "bearing_end" in names or any(has_pressure(system.mechanism, joint) for joint in system.joints):
        parts = [*parts, "bearings"]
    arrays: Arrays = {}
    for name, variable in results.variables(system.mechanism.space).items():
        if (variable.part and variable.part not in parts) or (wanted is not None and name not in wanted):
            continue
        if name in results.SAME_AS or not names.keys() >= set(variable.dims):  # no springs, no spring_force
            continue
        # zeroed pages take no memory until something is written: rows of the ground and slides of pins never are
        arrays[name] = np.zeros((*(len(names[dim]) for dim in variable.dims), positions), variable.dtype)
        if variable.part in results.OF_SOME_JOINTS and variable.dtype is np.float64:
            arrays[name][:] = np.nan  # of joints and ends that have none
    return arrays | {name: arrays[other] for name, other in results.SAME_AS.items() if other in arrays}


def _vector(name: str, place: tuple[int, ...], numbers: Iterable[Number]) -> Iterator[Cell]:
    return ((name, (*place, k), number) for k, number in enumerate(numbers))


# ---- motion ---------------------------------------------------------------------------------------------------


def _motion(walk: Forward) -> Iterator[Cell]:
    """Angles or frames of links, points and joints."""
    system = walk.system
    for i, (link, name) in enumerate(system.points):
        for key, numbers in zip(("position", "velocity", "acceleration"), walk.point(link, name), strict=True):
            yield from _vector(f"point_{key}", (i,), numbers)
    if isinstance(walk, SpatialWalk):
        for i, link in enumerate(system.mechanism.effective_links):
            frame, twist, second = walk.motions[link]
            yield from _vector("link_rotation", (i,), quaternion(frame))
            yield from _vector("link_position", (i,), frame.place)
            yield from _vector("link_angular_velocity", (i,), twist.u)
            yield from _vector("link_angular_acceleration", (i,), second.u)
        for i, joint in enumerate(system.joints):
            yield from _joint_in_space(walk, i, joint)
        return
    for i, link in enumerate(system.mechanism.links):
        if link != system.mechanism.fixed_link:
            motion = walk.motions[link]
            yield "link_angle", (i,), np.arctan2(motion.frame.s, motion.frame.c)
            yield "link_angle_velocity", (i,), motion.twist.w
            yield "link_angle_acceleration", (i,), motion.acceleration.w
    for i, joint in enumerate(system.joints):
        slides = not system.turns(joint)
        name = "joint_slide" if slides else "joint_rotation"
        yield f"{name}_velocity", (i,), walk.rates(joint)[slides]
        yield f"{name}_acceleration", (i,), walk.second_rates(joint)[slides]
        if slides:
            yield name, (i,), walk.coordinates(joint)[1]


def _joint_in_space(walk: SpatialWalk, i: int, joint: str) -> Iterator[Cell]:
    """Rotation and slide of a joint with their derivatives; of balls and crosses the angle between their elements."""
    pair = walk.pair(joint)
    if pair.one_axis or pair.angle:
        both = zip(walk.coordinates(joint), walk.rates(joint), walk.second_rates(joint), strict=True)
        for name, values in zip(("joint_rotation", "joint_slide"), both, strict=True):
            if pair.one_axis or name == "joint_rotation":
                for suffix, value in zip(DERIVATIVES, values, strict=True):
                    yield name + suffix, (i,), value
        return
    (first, second), (first_end, two) = walk.system.joints[joint].links, walk.ends(joint)
    turn = scaled(0.5, plus(plus(cross(first_end.x, two.x), cross(first_end.y, two.y)), cross(first_end.z, two.z)))
    cosine = 0.5 * (dot(first_end.x, two.x) + dot(first_end.y, two.y) + dot(first_end.z, two.z) - 1)
    spin = walk.against(joint).u
    change = tuple(
        b - a for a, b in zip(walk.motions[first].acceleration.u, walk.motions[second].acceleration.u, strict=True)
    )
    speed = np.sqrt(dot(spin, spin))
    yield "joint_rotation", (i,), np.arctan2(np.sqrt(dot(turn, turn)), cosine)
    yield "joint_rotation_velocity", (i,), speed
    moves = np.greater(speed, 0)
    rate = (spin[0] * change[0] + spin[1] * change[1] + spin[2] * change[2]) / np.where(moves, speed, 1.0)
    yield "joint_rotation_acceleration", (i,), np.where(moves, rate, 0.0)


# ---- forces ---------------------------------------------------------------------------------------------------


def _forces(back: Backward, read: Container[str]) -> Iterator[Cell]:
    """Reactions, friction, drive efforts, springs and gear pairs; in space about the middles of the bearings."""
    walk, mechanism = back.walk, back.walk.system.mechanism
    for i, joint in enumerate(walk.system.joints):
        reaction, friction, turns = back.reactions[joint], back.friction_wrenches[joint], walk.system.turns(joint)
        if "end_load" in read or "pin_pressure" in read:
            yield from _bearing(walk, i, joint, reaction, friction)
        if turns:
            yield "friction_torque", (i,), back.friction[joint]
        if isinstance(walk, SpatialWalk):
            middle = bearing_middle(walk, joint)
            yield from _vector("reaction_force", (i,), reaction.u)
            yield from _vector("reaction_moment", (i,), moment_at(reaction, middle))
            yield from _vector("friction_moment", (i,), moment_at(friction, middle))
            yield "friction_force", (i,), dot(friction.u, walk.ends(joint)[1].z)
            continue
        yield from _vector("reaction_force", (i,), reaction[:2])
        if not turns:
            yield "friction_force", (i,), back.friction[joint]
            yield "reaction_moment", (i,), plane.moment_at(reaction, plane.place_of(walk.ends(joint)[1]))
    for i, name in enumerate(mechanism.drivers):
        yield "drive_effort", (i,), back.efforts[name]
    for i, name in enumerate(mechanism.springs):
        yield "spring_force", (i,), back.springs[name].force
        yield "spring_elongation", (i,), back.springs[name].elongation
    for i, name in enumerate(mechanism.gears):
        yield "gear_torque", (i,), back.gears[name].torque
        yield from _vector("gear_force", (i,), back.gears[name].force)


def _bearing(walk: Forward, i: int, joint: str, reaction: Any, friction: Any) -> Iterator[Cell]:
    """Loads on the ends of a joint's bearing or guide, and the pressure of its pin."""
    mechanism = walk.system.mechanism
    ends, pressed = bearing_ends(mechanism, joint) > 0, has_pressure(mechanism, joint)
    if ends:
        loads = loads_on_ends(walk, joint, reaction, friction)
        for end, load in enumerate(loads):
            yield from _vector("end_load", (i, end), load[: mechanism.coordinates])
    elif pressed:
        loads = [(0.5 * reaction.x, 0.5 * reaction.y, 0.0)]
    if pressed:
        most = functools.reduce(np.maximum, (np.sqrt(dot(load, load)) for load in loads))
        yield "pin_pressure", (i,), 2 * most / pin_area(walk.values, joint)


def pin_area(values: Values, joint: str) -> Number:
    """Projected area of a pin, its diameter times the length of its bearing, m²."""
    return 2 * values[f"joints.{joint}.pin.radius"] * values[f"joints.{joint}.pin.bearing"]


def _powers(back: Backward) -> Iterator[Cell]:
    """Power of drivers, loads, springs and friction, and what is left over: their sum with inertia and gravity."""
    walk = back.walk
    total: Number = back.body_power + back.gear_power
    for power in back.load_powers.values():
        total = total + power
    for i, name in enumerate(walk.system.joints):
        yield "friction_power", (i,), back.losses[name]
        total = total - back.losses[name]
    for i, state in enumerate(back.springs.values()):
        yield "spring_power", (i,), state.power
        yield "damping_power", (i,), state.loss
        total = total + state.power
    driven: Number = 0.0
    for i, name in enumerate(walk.system.mechanism.drivers):
        power = back.efforts[name] * walk.system.drive(walk.values, name, walk.time)[1]
        yield "drive_power", (i,), power
        driven = driven + power
    useful: Number = 0.0
    for power in useful_powers(walk, back.load_powers, back.springs):
        useful = useful - power
    defined = np.greater(driven, 0) & has_useful_work(walk.system.mechanism)
    yield "useful_power", (), useful
    yield "efficiency_instant", (), useful / np.where(defined, driven, np.nan)
    yield "power_residual", (), total + driven


def _solution(back: Backward) -> Iterator[Cell]:
    """How near to locking and to a dead centre it is, and how well it is solved."""
    for figure in ("iterations", "change", "residual", "contraction"):  # of the friction iteration
        worst = functools.reduce(np.maximum, (getattr(settled, figure) for settled in back.settled), 0.0)
        yield f"friction_{figure}", (), worst
    yield "locking_margin", (), locking_margin(back)
    groups = list(zip(back.walk.system.groups, back.walk.poses, strict=True))
    conditions = [group.condition(pose) for group, pose in groups]
    yield "condition", (), functools.reduce(np.maximum, conditions, 0.0)
    yield "closure_residual", (), functools.reduce(np.maximum, (group.closure(pose) for group, pose in groups), 0.0)
    for i, condition in enumerate(conditions):
        yield CONDITIONS, (i,), condition


# ---- seats and errors -----------------------------------------------------------------------------------------------


def _seats(back: Backward) -> Iterator[Cell]:
    """Seats, end forces and places of contact."""
    walk = back.walk
    joints, axes = list(walk.system.joints), walk.system.mechanism.coordinates
    for seat in seats(walk.system.mechanism, walk.values):
        i = joints.index(seat.joint)
        ends = _ends(seat, seat.play.model.offsets(walk.values, f"seats.{seat.joint}") or [])
        loads = _ends(seat, loads_of(back, seat), shared=True)
        # B₁ and B₂: on the wall of the hole in the direction of the offset; of a guide the ends of its axis
        gap, model = clearance(seat.joint, walk.values), seat.play.model
        radius = walk.values.get(f"joints.{seat.joint}.pin.radius", np.nan) + (gap if gap is not None else 0.0)
        guide, ball = model.size is not None and model.size[0] == "guide", len(model.ends[0]) == 3
        half = 0.5 * seat.play.length if model.size is not None else 0.0
        contacts: dict[int, Vector] = {}
        for end, offset in ends.items():
            x, y, z = offset if ball else (offset[0], offset[1], 0.0)
            size = np.sqrt(x * x + y * y + z * z)
            share = np.where(size > 0, radius / np.where(size > 0, size, 1.0), np.nan)
            along = half if end else -half
            local: Vector = (share * x, share * y, share * z if ball else along)
            if guide:
                local = (0.0, 0.0, along) if isinstance(walk, SpatialWalk) else (along, 0.0, 0.0)
            contacts[end] = walk.algebra.point_of(walk.hole(seat.joint), local[: len(walk.system.axes)])
        for name, vectors in (("seat_offset", ends), ("end_force", loads), ("contact_position", contacts)):
            for end, vector in vectors.items():
                yield from _vector(name, (i, end), vector[:axes])
        yield from _direction(walk, i, seat, ends)


def _ends(seat: GivenSeat, vectors: Sequence[Vector], shared: bool = False) -> dict[int, list[Number]]:
    """Vectors of the ends at end 1 and 2; what is along the axis belongs to both, a force by halves."""
    keys = [key.split(".") for end in seat.play.model.ends for key in end]
    loads: dict[int, list[Number]] = {int(place) - 1: [0.0, 0.0, 0.0] for place, _ in keys if place != "3"}
    for (place, axis), number in zip(keys, (number for vector in vectors for number in vector), strict=True):
        for end in loads if place == "3" else (int(place) - 1,):
            loads[end][AXES.index(axis)] = 0.5 * number if shared and place == "3" else number
    return loads


def _direction(walk: Forward, i: int, seat: GivenSeat, ends: Mapping[int, Vector]) -> Iterator[Cell]:
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
    yield "seat_beta", (i,), beta
    yield "seat_xi", (i,), xi
    if walk.system.turns(seat.joint):
        first_frame, two = (walk.element(link, seat.joint) for link in walk.system.joints[seat.joint].links)
        yield "seat_xi_pin", (i,), wrapped(xi + walk.coordinate(seat.joint, first_frame, two))


def wrapped(angle: Number) -> Number:
    """An angle in (−π, π]."""
    return angle + 2 * np.pi * np.floor((np.pi - angle) / (2 * np.pi))


def fill_errors(arrays: Arrays, ideal: Arrays, system: System, window: slice) -> None:
    """Differences of one chunk to the ideal mechanism's results, which hold that chunk alone; NaN without an answer."""
    differences: dict[str, Array] = {}
    if system.mechanism.space == "planar":
        links, turned = labels(system)["link"], wrapped(arrays["link_angle"][:, window] - ideal["link_angle"])
        pairs = [[links.index(link) for link in joint.links] for joint in system.joints.values()]
        differences["link_error"] = turned
        differences["joint_rotation_error"] = np.array([turned[second] - turned[first] for first, second in pairs])
    else:
        turned = wrapped(arrays["joint_rotation"][:, window] - ideal["joint_rotation"])
        differences["joint_rotation_error"] = turned
        if "link_error" in arrays:
            frames = zip(arrays["link_rotation"][..., window], ideal["link_rotation"], strict=True)
            differences["link_error"] = np.array([_rotation_vector(built, meant) for built, meant in frames])
    for name, difference in differences.items():
        if name in arrays:
            arrays[name][..., window] = difference
    for name, of in DIFFERENCES.items():
        if name in arrays:
            np.subtract(arrays[of][..., window], ideal[of], out=arrays[name][..., window])  # no copy: half the time
    blank(arrays, arrays["status"][window].astype(np.int8), (window,))


def _rotation_vector(built: NDArray[np.float64], meant: NDArray[np.float64]) -> NDArray[np.float64]:
    """Rotation from one quaternion to another, rad, global axes: 2 atan2(|v|, w) along v of q₂ q₁*."""
    w, v = built[0], built[1:]
    scalar = w * meant[0] + np.sum(v * meant[1:], axis=0)
    vector = meant[0] * v - w * meant[1:] - np.cross(v, meant[1:], axis=0)
    sign = np.where(scalar < 0, -1.0, 1.0)
    size = np.sqrt(np.sum(vector**2, axis=0))
    share = np.where(size > 0, 2 * np.arctan2(size, sign * scalar) / np.where(size > 0, size, 1.0), 2.0)
    return np.asarray(sign * share * vector)


# ---- why positions have no answer --------------------------------------------------------------------------------


class Causes:
    """Places without an answer by kind of cause, and by module, joint or path.

    open: by number of the module and texts of possible reasons, with the length, m, by which each of these holds there;
    locked: by number of the module, with the share of the friction at which it does; singular: by number of the module;
    undefined: by path of a load or spring; rest: by joint, its relative speed is zero; stuck: only the travel of seats
    decides the sense of a friction.
    """

    def __init__(self, system: System) -> None:
        self.system = system
        self._notes: dict[tuple[str, Any], list[tuple[Positions, Array]]] = {}

    def of(self, kind: str) -> dict[Any, tuple[Positions, Array]]:
        """Places and numbers, (…, place), of one kind."""
        return {
            key: (np.concatenate([places for places, _ in notes]), np.concatenate([part for _, part in notes], -1))
            for (what, key), notes in self._notes.items() if what == kind
        }  # fmt: skip

    def keep(self, kind: str, key: Hashable, where: ArrayLike, places: Positions, numbers: ArrayLike = 0.0) -> None:
        """Keep those of some places at which there is a cause. numbers: (…, place)."""
        lanes = np.flatnonzero(np.broadcast_to(where, places.shape))
        if len(lanes):
            numbers = np.asarray(numbers, float)
            every = np.broadcast_to(numbers, (*numbers.shape[:-1], len(places)))
            self._notes.setdefault((kind, key), []).append((places[lanes], every[..., lanes]))

    def note(self, back: Backward, status: NDArray[np.int8], places: Positions) -> None:
        """Look at some positions, by their numbers in the cycle."""
        for name in sticking(self.system):
            self.keep("rest", name, back.resting[name] & (status < Status.NOT_CONVERGED), places)
        if not np.any(status >= Status.LOCKED):
            return
        for path, where in back.undefined.items():
            self.keep("undefined", path, where & (status == Status.LOAD_UNDEFINED), places)
        modules = reversed(range(len(back.settled)))  # settled from the last module to the first
        for number, settled in zip(modules, back.settled, strict=True):
            locked = (np.asarray(settled.share) < 1.0) & (status == Status.LOCKED)
            self.keep("locked", number, locked, places, settled.share)
        if np.any(status == Status.SINGULAR):
            walk = back.walk
            conditions = [
                np.broadcast_to(np.nan_to_num(group.condition(pose), nan=np.inf), status.shape)
                for group, pose in zip(walk.system.groups, walk.poses, strict=True)
            ]
            worst = np.argmax(conditions, axis=0)
            for number in range(len(conditions)):
                self.keep("singular", number, (status == Status.SINGULAR) & (worst == number), places)
        left = status == Status.NOT_ASSEMBLED
        for number, pose in enumerate(back.walk.poses):  # the first module that does not close, and by how much
            if not np.any(left):
                break
            bad = np.zeros(status.shape, bool)
            for frame in pose.frames:
                bad |= ~np.isfinite(np.broadcast_to(sum(flat(frame)), status.shape))
            if np.any(bad & left):
                reasons = _shortfalls(back.walk, number)
                sizes = np.array([np.broadcast_to(size, status.shape) for size in reasons.values()])
                self.keep("open", (number, *reasons), bad & left, places, sizes.reshape(len(reasons), len(places)))
            left = left & ~bad


def _shortfalls(walk: Forward, number: int) -> dict[str, Number]:
    """Why a closed form has no position: each reason with the length by which it holds where it is positive."""
    module, pose = walk.system.plan.modules[number], walk.poses[number]
    if not isinstance(pose, DyadPose):
        return {}
    b, c, d = module.joints
    if module.kind == "RRR":
        (pin_b, b_i), (c_i, c_j), (pin_d, d_j) = walk.pairs(walk.system.places[number])
        gap, bc, cd = (
            np.hypot(two.x - first.x, two.y - first.y) for first, two in ((pin_b, pin_d), (b_i, c_i), (c_j, d_j))
        )
        return {
            f"|{b}{d}| exceeds {b}{c} + {c}{d}": gap - (bc + cd),
            f"|{b}{d}| falls short of |{b}{c} − {c}{d}|": np.abs(bc - cd) - gap,
        }
    if module.kind == "RRP":
        return {f"the path of {c} is farther from {b} than |{b}{c}|": np.abs(pose.lost) - pose.scale}
    if module.kind == "RPR":
        return {f"|{b}{d}| falls short of the offset of the slide {c}": np.abs(pose.lost) - pose.scale}
    return {}


# ---- all of a walk --------------------------------------------------------------------------------------------------


def cells(back: Backward, read: Container[str]) -> Iterator[Cell]:
    """Every number of a walk but its status, by its variable and its place there.

    read: the variables that somebody reads; others may be left out.
    """
    if any(name in read for name in (*POSES, *RATES)):
        yield from _motion(back.walk)
    yield from _forces(back, read)
    yield from _powers(back)
    yield from _solution(back)
    if "seat_offset" in read:
        yield from _seats(back)


def fill_chunk(
    arrays: Arrays,
    back: Backward,
    at: slice | tuple[NDArray[np.intp], ...],
    causes: Causes | None = None,
) -> None:
    """Write a walk into the arrays of a result; what a status rules out becomes NaN.

    Parameters
    ----------
    arrays
        Those of `allocate`, of which there need not be all.
    back
        The walk.
    at
        Where its positions lie along the last dims: a window, or an index for each of these dims.
    causes
        To note why positions have no answer.
    """
    index = (at,) if isinstance(at, slice) else at
    status = status_of(back, arrays["status"][index].shape)
    arrays["status"][index] = status
    if causes:
        causes.note(back, status, np.arange(at.start, at.stop) if isinstance(at, slice) else at[-1])
    with np.errstate(all="ignore"):
        for name, place, number in cells(back, arrays):
            if name in arrays:
                arrays[name][(*place, *index)] = number
    blank(arrays, status, index)


def blank(arrays: Arrays, status: NDArray[np.int8], index: tuple[Any, ...]) -> None:
    """NaN for every number that a status rules out. index: of the positions, along the last dims."""
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
                numbers = arrays[name][(..., *index)]
                numbers[..., where] = np.nan
                arrays[name][(..., *index)] = numbers


# ---- angles that run on ---------------------------------------------------------------------------------------


def unwrap(arrays: Arrays, system: System, values: Values, time: NDArray[np.float64]) -> None:
    """Angles without jumps of a whole turn along each run of solved positions, and the joints' rotations.

    A driven rotation is the prescribed coordinate itself, whole turns included.
    """
    spatial = system.mechanism.space == "spatial"
    if ("joint_rotation" if spatial else "link_angle") not in arrays:  # nobody reads them
        return
    step = float(time[1] - time[0]) if len(time) > 1 else 0.0
    places = {link: i for i, link in enumerate(labels(system)["link"])}
    for link, i in places.items():
        if not spatial and link != system.mechanism.fixed_link:
            unwrap_row(arrays["link_angle"][i], arrays["link_angle_velocity"][i], step)
    for i, (name, joint) in enumerate(system.joints.items()):
        rotation, (first, second) = arrays["joint_rotation"][i], joint.links
        if not spatial:
            np.subtract(arrays["link_angle"][places[second]], arrays["link_angle"][places[first]], out=rotation)
        if name in system.mechanism.drivers:  # known where the rest is not
            arrays["joint_rotation" if system.turns(name) else "joint_slide"][i] = system.drive(values, name, time)[0]
        elif spatial and joint.pair.angle:
            unwrap_row(rotation, arrays["joint_rotation_velocity"][i], step)
        if joint.pair.threaded:  # its slide follows the whole turns
            pitch = float(np.ravel(values[f"joints.{name}.pitch"])[0])
            arrays["joint_slide"][i] = rotation * pitch / (2 * np.pi)

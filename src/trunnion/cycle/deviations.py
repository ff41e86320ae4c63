"""What errors do to a mechanism: where its pins lie, and the difference of every result to the ideal mechanism's."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from trunnion.algebra.namespace import Number
from trunnion.algebra.plane import point
from trunnion.algebra.space import point_of
from trunnion.joints.clearance import describing
from trunnion.joints.pairs import PAIRS
from trunnion.model.contact import clearance
from trunnion.results.figure import Figure
from trunnion.solve.forward import Forward
from trunnion.solve.seating import Seated
from trunnion.solve.seats import GivenSeat

if TYPE_CHECKING:
    from trunnion.solve.run import Run
    from trunnion.solve.system import Dial

__all__ = ["COMPARED", "error_figures", "fill_errors", "fill_seats"]

Arrays = dict[str, NDArray[np.float64]]
Vector = Sequence[Number]
AXES = "xyz"
DIFFERENCES = {
    "point_error": "point_position",
    "joint_slide_error": "joint_slide",
    "reaction_force_change": "reaction_force",
    "drive_effort_change": "drive_effort",
    "friction_power_change": "friction_power",
}
# what of the ideal mechanism is read
COMPARED = {*DIFFERENCES.values(), "link_angle", "link_rotation", "joint_rotation"}


def fill_seats(arrays: Arrays, found: Sequence[GivenSeat], seated: Seated, window: slice) -> None:
    """Seats, end forces and places of contact of one chunk."""
    walk = seated.back.walk
    joints = list(walk.system.joints)
    for seat in found:
        i = joints.index(seat.joint)
        offsets = seat.play.model.offsets(seated.offsets, f"seats.{seat.joint}") or []
        _fill_ends(arrays["seat_offset"][i], seat, offsets, window)
        _fill_ends(arrays["end_force"][i], seat, seated.loads[seat.joint], window, shared=True)
        _describe(arrays, i, window, walk, seat)
        _fill_contacts(arrays, i, window, walk, seat)
    arrays["seat_rounds"][window] = seated.rounds
    arrays["seat_travel"][window] = seated.told
    arrays["seat_change"][window] = seated.change


def _fill_ends(
    array: NDArray[np.float64], seat: GivenSeat, vectors: Sequence[Vector], window: slice, shared: bool = False
) -> None:
    """Vectors of the ends at end 1 and 2; what is along the axis belongs to both, a force by halves."""
    for place in {key[0] for end in seat.play.model.ends for key in end} - {"3"}:
        array[int(place) - 1, :, window] = 0.0
    for end, vector in zip(seat.play.model.ends, vectors, strict=True):
        for key, number in zip(end, vector, strict=True):
            place, axis = key.split(".")
            if place == "3":
                array[:, AXES.index(axis), window] = 0.5 * number if shared else number
            else:
                array[int(place) - 1, AXES.index(axis), window] = number


def _describe(arrays: Arrays, i: int, window: slice, walk: Forward, seat: GivenSeat) -> None:
    """β and ξ of a pin or guide; of a ball there are none."""
    ends = arrays["seat_offset"][i, :, :, window]
    if len(seat.play.model.ends[0]) == 3:
        return
    if len(seat.play.model.ends) == 1:
        beta, xi = np.zeros(()), np.arctan2(ends[0, 1], ends[0, 0])
    elif len(seat.play.model.ends[0]) == 1 and len(seat.play.model.ends) == 2:  # a guide of the plane, from its normal
        beta, xi = describing(*((end[1], np.zeros_like(end[1])) for end in ends))
    else:
        beta, xi = describing(*((end[0], end[1]) for end in ends))
    arrays["seat_beta"][i, window], arrays["seat_xi"][i, window] = beta, xi
    if walk.system.turns(seat.joint):
        one, two = (walk.element(link, seat.joint) for link in walk.system.joints[seat.joint][1])
        turn = walk.coordinate(seat.joint, one, two)
        arrays["seat_xi_pin"][i, window] = wrapped(xi + turn)


def _fill_contacts(arrays: Arrays, i: int, window: slice, walk: Forward, seat: GivenSeat) -> None:
    """B₁ and B₂: on the wall of the hole in the direction of the offset; of a guide the ends of its axis."""
    frame = walk.hole(seat.joint)
    own = clearance(seat.joint, walk.values)
    radius = walk.values.get(f"joints.{seat.joint}.pin.radius", np.nan) + (own if own is not None else 0.0)
    spatial = walk.system.mechanism.space == "spatial"
    guide = seat.play.model.size is not None and seat.play.model.size[0] == "guide"
    half = 0.5 * seat.play.length if seat.play.model.size is not None else 0.0
    for end in range(2):
        offset = arrays["seat_offset"][i, end, :, window]
        across = offset if len(seat.play.model.ends[0]) == 3 else offset[:2]
        size = np.sqrt(np.sum(across**2, axis=0))
        share = np.where(size > 0, radius / np.where(size > 0, size, 1.0), np.nan)
        along = half if end else -half
        local: tuple[Number, Number, Number]
        if guide:
            local = (0.0, 0.0, along) if spatial else (along, 0.0, 0.0)
        elif len(across) == 3:
            local = (share * across[0], share * across[1], share * across[2])
        else:
            local = (share * across[0], share * across[1], along)
        place = point_of(frame, local) if spatial else point(frame, local[0], local[1])
        for axis, number in enumerate(place):
            arrays["contact_position"][i, end, axis, window] = number
        if len(seat.play.model.ends) == 1:  # the other end is the same
            break


def wrapped(angle: Number) -> Number:
    """An angle in (−π, π]."""
    return angle - 2 * np.pi * np.ceil((angle - np.pi) / (2 * np.pi))


def fill_errors(arrays: Arrays, ideal: Arrays, joints: Sequence[tuple[int, int]], window: slice) -> None:
    """Differences of one chunk to the ideal mechanism's results, which hold that chunk alone.

    joints: numbers of the links of every joint.
    """
    for name, of in DIFFERENCES.items():
        arrays[name][..., window] = arrays[of][..., window] - ideal[of]
    if "link_angle" in arrays:
        turned = wrapped(arrays["link_angle"][:, window] - ideal["link_angle"])
        arrays["link_error"][:, window] = turned
        for i, (first, second) in enumerate(joints):
            arrays["joint_rotation_error"][i, window] = turned[second] - turned[first]
        return
    for i, (built, meant) in enumerate(zip(arrays["link_rotation"], ideal["link_rotation"], strict=True)):
        arrays["link_error"][i, :, window] = _rotation_vector(built[:, window], meant)
    arrays["joint_rotation_error"][:, window] = wrapped(arrays["joint_rotation"][:, window] - ideal["joint_rotation"])


def _rotation_vector(built: NDArray[np.float64], meant: NDArray[np.float64]) -> NDArray[np.float64]:
    """Rotation from one quaternion to another, rad, global axes: 2 atan2(|v|, w) along v of q₂ q₁*."""
    w, v = built[0], built[1:]
    scalar = w * meant[0] + np.sum(v * meant[1:], axis=0)
    vector = meant[0] * v - w * meant[1:] - np.cross(v, meant[1:], axis=0)
    sign = np.where(scalar < 0, -1.0, 1.0)
    size = np.sqrt(np.sum(vector**2, axis=0))
    share = np.where(size > 0, 2 * np.arctan2(size, sign * scalar) / np.where(size > 0, size, 1.0), 2.0)
    return np.asarray(sign * share * vector)


def error_figures(
    run: Run, arrays: Mapping[str, NDArray[np.float64]], dial: Dial, valid: NDArray[np.bool_]
) -> Iterator[Figure]:
    """What the errors do, in the figures one looks at first; of valid positions."""
    size = np.where(valid, np.sqrt(np.sum(arrays["point_error"] ** 2, axis=1)), np.nan)
    if np.any(np.isfinite(size)):
        top, at = divmod(int(np.nanargmax(size)), size.shape[1])
        most = f"largest: {'.'.join(run.system.points[top])}"
        yield Figure("point_error_max", "position error", size[top, at], "m", most, f"at {dial.at(at)}")
    for i, (joint, (kind, links)) in enumerate(run.system.joints.items()):
        if run.system.mechanism.fixed_link not in links or joint in run.system.mechanism.drivers:
            continue
        for what, unit in (("rotation", "rad"), ("slide", "m")):
            error = np.where(valid, np.abs(arrays[f"joint_{what}_error"][i]), np.nan)
            if (what == "rotation") == (not PAIRS[kind].guided) and np.any(np.isfinite(error)):
                at, name = int(np.nanargmax(error)), f"{joint}.{what}_error_max"
                yield Figure(
                    name, f"transmission error of {joint}", error[at], unit, "largest magnitude", f"at {dial.at(at)}"
                )
    for i, joint in enumerate(run.system.mechanism.drivers):
        change = np.where(valid, arrays["drive_effort_change"][i], np.nan)
        if np.any(np.isfinite(change)):
            at, name = int(np.nanargmax(np.abs(change))), f"{joint}.effort_change_max"
            kind, unit = ("torque", "N m") if run.system.turns(joint) else ("force", "N")
            subject = f"change of the drive {kind} of {joint} by the errors"
            yield Figure(name, subject, change[at], unit, "largest magnitude", f"at {dial.at(at)}")
    if run.seats:
        yield Figure("seat_rounds", "seat iterations", np.max(arrays["seat_rounds"]), aspect="maximum")

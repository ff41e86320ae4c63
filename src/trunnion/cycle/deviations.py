"""What errors do to a mechanism: where its pins lie, and the difference of every result to the ideal mechanism's."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from trunnion.algebra.namespace import Number
from trunnion.cycle.fill import Into
from trunnion.joints.clearance import describing
from trunnion.model.contact import clearance
from trunnion.solve.backward import Backward
from trunnion.solve.end_loads import loads_of
from trunnion.solve.forward import Forward
from trunnion.solve.seats import GivenSeat, seats

__all__ = ["COMPARED", "fill_errors", "fill_seats"]

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


def fill_seats(arrays: Into, back: Backward, window: slice) -> None:
    """Seats, end forces and places of contact of one chunk."""
    walk = back.walk
    joints, axes = list(walk.system.joints), walk.system.mechanism.coordinates
    for seat in seats(walk.system, walk.values):
        i = joints.index(seat.joint)
        offsets = seat.play.model.offsets(walk.values, f"seats.{seat.joint}") or []
        ends = _ends(seat, offsets)
        for name, vectors in (("seat_offset", ends), ("end_force", _ends(seat, loads_of(back, seat), shared=True))):
            for end, vector in vectors.items():
                for axis, number in enumerate(vector[:axes]):
                    arrays[name][i, end, axis, window] = number
        _describe(arrays, i, window, walk, seat, ends)
        _fill_contacts(arrays, i, window, walk, seat, ends)


def _ends(seat: GivenSeat, vectors: Sequence[Vector], shared: bool = False) -> dict[int, list[Number]]:
    """Vectors of the ends at end 1 and 2; what is along the axis belongs to both, a force by halves."""
    keys = [key.split(".") for end in seat.play.model.ends for key in end]
    found: dict[int, list[Number]] = {int(place) - 1: [0.0, 0.0, 0.0] for place, _ in keys if place != "3"}
    for (place, axis), number in zip(keys, (number for vector in vectors for number in vector), strict=True):
        for end in found if place == "3" else (int(place) - 1,):
            found[end][AXES.index(axis)] = 0.5 * number if shared and place == "3" else number
    return found


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
        one, two = (walk.element(link, seat.joint) for link in walk.system.joints[seat.joint][1])
        turn = walk.coordinate(seat.joint, one, two)
        arrays["seat_xi_pin"][i, window] = wrapped(xi + turn)


def _fill_contacts(
    arrays: Into, i: int, window: slice, walk: Forward, seat: GivenSeat, ends: Mapping[int, Vector]
) -> None:
    """B₁ and B₂: on the wall of the hole in the direction of the offset; of a guide the ends of its axis."""
    frame = walk.hole(seat.joint)
    own = clearance(seat.joint, walk.values)
    radius = walk.values.get(f"joints.{seat.joint}.pin.radius", np.nan) + (own if own is not None else 0.0)
    spatial, model = walk.system.mechanism.space == "spatial", seat.play.model
    guide = model.size is not None and model.size[0] == "guide"
    half = 0.5 * seat.play.length if model.size is not None else 0.0
    for end, offset in ends.items():
        x, y, z = offset if len(model.ends[0]) == 3 else (offset[0], offset[1], 0.0)
        size = np.sqrt(x * x + y * y + z * z)
        share = np.where(size > 0, radius / np.where(size > 0, size, 1.0), np.nan)
        along = half if end else -half
        if guide:
            local = (0.0, 0.0, along) if spatial else (along, 0.0, 0.0)
        elif len(model.ends[0]) == 3:
            local = (share * x, share * y, share * z)
        else:
            local = (share * x, share * y, along)
        place = walk.algebra.point_of(frame, local[: len(walk.system.axes)])
        for axis, number in enumerate(place):
            arrays["contact_position"][i, end, axis, window] = number


def wrapped(angle: Number) -> Number:
    """An angle in (−π, π]."""
    return angle + 2 * np.pi * np.floor((np.pi - angle) / (2 * np.pi))


def fill_errors(arrays: Arrays, ideal: Arrays, joints: Sequence[tuple[int, int]], window: slice) -> None:
    """Differences of one chunk to the ideal mechanism's results, which hold that chunk alone.

    joints: numbers of the links of every joint.
    """
    for name, of in DIFFERENCES.items():
        np.subtract(arrays[of][..., window], ideal[of], out=arrays[name][..., window])  # no copy: half the time
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

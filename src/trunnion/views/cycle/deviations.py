"""What a result tells of errors and seats, for figures and report: worst points, outputs, losses of contact, seats."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from trunnion.errors import Finding, MechanismError
from trunnion.joints.pairs import PAIRS
from trunnion.studies.play import play as play_of
from trunnion.views.common.cycle import Array, column, layout, names

if TYPE_CHECKING:
    import xarray as xr

    from trunnion.model.mechanism import Mechanism

__all__ = [
    "JUMP", "NOWHERE", "Output", "Seats", "broken", "has", "jumps", "losses", "need", "outputs",
    "point_errors", "seated",
    "with_worst_case", "worst_points",
]  # fmt: skip

JUMP = np.pi / 3  # a seat that turns by more from one position to the next is taken to have jumped
SUDDEN = 6.0  # times the step before or after: a jump
LEAST = 0.1  # of the largest error of place: points below it are not among the worst
NOWHERE = np.zeros(0, np.intp)
ALIKE = 1e-3  # of the largest: two curves nearer than this are one
REMEDIES = {
    "errors": "state errors, a misalignment, or a seat: loaded (--set joint_defaults.seat=loaded)",
    "seats": "state a clearance and seat: loaded of a joint (--set joint_defaults.seat=loaded)",
}
LACKS = {
    "errors": "the mechanism has no errors",
    "seats": "no joint of the mechanism has a pin with a seat",
}


def has(result: xr.Dataset, part: str) -> bool:
    """Whether a result has "errors", or "seats" that are known anywhere."""
    return "point_error" in result if part == "errors" else bool(seated(result))


def need(result: xr.Dataset, part: str, figure: str) -> None:
    """MechanismError with the reason if a result lacks the part that a figure shows."""
    if has(result, part):
        return
    if part == "seats" and "seat_offset" in result:
        what, remedy = "no position is solved", "run `trunnion check` to see why"
    else:
        what, remedy = LACKS[part], REMEDIES[part]
    raise MechanismError(Finding(f"{what}, and there is no figure '{figure}'", "--kind", remedy))


# ---- errors ---------------------------------------------------------------------------------------------------


def point_errors(result: xr.Dataset) -> dict[str, Array]:
    """Size of the error of place of every point that has any, (position,) m."""
    found = {}
    for key in names(result, "point"):
        error = column(result, "point_error", point=key)
        if error is not None and np.nanmax(np.abs(error), initial=0.0) > 0:
            found[key] = np.linalg.norm(error, axis=0)
    return found


def worst_points(result: xr.Dataset, most: int = 4) -> dict[str, Array]:
    """The points with the largest errors of place, worst first; of those that err alike one."""
    errors = point_errors(result)
    tops = {key: float(np.nanmax(error)) for key, error in errors.items()}
    picked: dict[str, Array] = {}
    for key in sorted(errors, key=lambda one: (-tops[one], one)):
        worst = max(tops.values())
        alike = any(np.nanmax(np.abs(errors[key] - other)) < ALIKE * worst for other in picked.values())
        if tops[key] >= LEAST * worst and not alike and len(picked) < most:
            picked[key] = errors[key]
    return picked


class Output(NamedTuple):
    """The error of what a joint of the ground does that no driver moves: of its rotation, rad, or of its slide, m."""

    joint: str
    unit: str
    error: Array

    @property
    def label(self) -> str:
        return f"{'slide' if self.unit == 'm' else 'rotation'} of {self.joint}"


def outputs(result: xr.Dataset) -> list[Output]:
    """Transmission errors, as the summary of the result has them."""
    stated, drivers = layout(result), names(result, "driver")
    found = []
    for joint in names(result, "joint"):
        one = stated["joints"].get(joint, {})
        if stated["ground"] not in one.get("links", ()) or joint in drivers:
            continue
        slides = PAIRS[one["type"]].guided
        error = column(result, f"joint_{'slide' if slides else 'rotation'}_error", joint=joint)
        if error is not None and np.isfinite(error).any():
            found.append(Output(joint, "m" if slides else "rad", error))
    return found


def losses(result: xr.Dataset) -> dict[str, NDArray[np.intp]]:
    """Positions at which each joint loses contact, of those that do."""
    found = {}
    for joint in names(result, "joint"):
        lost = column(result, "contact_lost", joint=joint)
        if lost is not None and (lost > 0).any():
            found[joint] = np.flatnonzero(lost > 0)
    return found


def with_worst_case(result: xr.Dataset, mechanism: Mechanism) -> xr.Dataset:
    """The result with the band in which the play of all joints holds the error of each output, if there is any play.

    `transmission_centre` and `transmission_reach` (joint, position), rad or m, NaN of joints that are no outputs: the
    error with every pin in the middle of its hole, and the most that all plays can add to it, to first order.
    """
    found = outputs(result) if has(result, "errors") else []
    if not found:
        return result
    measures = [f"{'slide' if one.unit == 'm' else 'rotation'}:{one.joint}" for one in found]
    try:
        free = play_of(mechanism, measures, result.sizes["position"])
    except MechanismError:  # no joint has a play
        return result
    joints = names(result, "joint")
    centre, reach = (np.full((len(joints), result.sizes["position"]), np.nan) for _ in range(2))
    for one, measure in zip(found, measures, strict=True):
        told = column(result, f"joint_{measure.split(':')[0]}", joint=one.joint)
        middle, most = (column(free, name, measure=measure) for name in ("value", "worst_case_total"))
        if told is None or middle is None or most is None:
            continue
        apart = middle - told
        turns = 2 * np.pi * np.round(apart / (2 * np.pi)) if one.unit == "rad" else 0.0
        centre[joints.index(one.joint)], reach[joints.index(one.joint)] = one.error + apart - turns, most
    if not np.nanmax(reach, initial=0.0) > 0:
        return result
    dims = ("joint", "position")
    return result.assign(transmission_centre=(dims, centre), transmission_reach=(dims, reach))


# ---- seats ----------------------------------------------------------------------------------------------------


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
        return self.kind == "guide" and self.offsets.shape[1] == 2


def seated(result: xr.Dataset) -> list[Seats]:
    """Every joint with a seat that is known anywhere."""
    stated: dict[str, Any] = layout(result)
    found = []
    for joint, play in stated.get("plays", {}).items():
        offsets, forces = (column(result, name, joint=joint) for name in ("seat_offset", "end_force"))
        if offsets is None or forces is None or not np.isfinite(offsets).any():
            continue
        ends = 1 if play["kind"] == "ball" or (play["kind"] == "pin" and offsets.shape[1] == 2) else 2
        first, second = stated["joints"][joint]["links"]
        found.append(
            Seats(joint, play["kind"], play["clearance"], play["float"], play["length"], offsets[:ends], forces[:ends],
                  (first, second))
        )  # fmt: skip
    return found


def continued(beta: Array, xi: Array) -> tuple[Array, Array]:
    """β and ξ without the seam of their description, in which (β, ξ) and (β − 2π, ξ + π) are the same seat.

    β stays as near as it can to the position before, within a turn to either side; ξ in (−π, π].
    """
    turns = np.zeros(beta.size)
    known = np.flatnonzero(np.isfinite(beta))
    turns[known] = np.cumsum(np.append(0.0, -np.round(np.diff(beta[known]) / (2 * np.pi))))
    usual = float(np.median((beta + 2 * np.pi * turns)[known])) if known.size else 0.0
    middle = np.ceil((usual - 1.5 * np.pi) / (2 * np.pi))  # crossed ends, ±π, are shown at π
    turns = turns - middle
    whole = (beta + 2 * np.pi * turns) / (2 * np.pi)  # an end that goes round and round starts anew after each turn
    turns = turns - np.where(np.abs(whole) > 1.0 + 1e-9, np.sign(whole) * np.ceil(np.abs(whole) - 1.0 - 1e-9), 0.0)
    turned = xi - np.pi * turns
    return beta + 2 * np.pi * turns, turned - 2 * np.pi * np.ceil((turned - np.pi) / (2 * np.pi))


def jumps(y: Array, jump: float, lost: NDArray[np.intp] = NOWHERE) -> NDArray[np.intp]:
    """Positions before which a curve jumps: by more than `jump`, by far more than on either side, or where contact is
    lost.
    """
    step = np.abs(np.diff(y))
    beside = np.nan_to_num(np.maximum(np.append(0.0, step[:-1]), np.append(step[1:], 0.0)))
    near = np.isin(np.arange(step.size), [lost - 1, lost])
    return np.flatnonzero((step > jump) | (step > np.where(near, 0.0, SUDDEN * beside) + jump / 20)) + 1


def broken(x: Array, y: Array, jump: float, lost: NDArray[np.intp] = NOWHERE) -> tuple[Array, Array]:
    """A curve with a NaN wherever it jumps, so that no line crosses the jump."""
    after = jumps(y, jump, lost)
    return np.insert(x, after, (x[after - 1] + x[after]) / 2), np.insert(y, after, np.nan)

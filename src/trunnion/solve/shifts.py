"""Errors of a joint as shifts of its hole: misalignment that is stated, and play where a seat is given or known.

The second element of a joint is the hole's frame. An error moves it before the pair does, S → S Â, so modules meet
only another local element. Where the numbers of a seat are among the values (`seats.JOINT.1.x` …, see `clearance`)
the pin lies there, as the link of the hole sees it; with `journals.JOINT.1.x` … as that of the pin sees it. Both say
the same at one position; as the joint turns, the first seat stays on the hole's link, the other on the pin's.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from trunnion.algebra import plane, space
from trunnion.algebra.dual import primal
from trunnion.algebra.namespace import Number, namespace
from trunnion.errors import Finding
from trunnion.joints.clearance import CLEARANCE_MODELS, ClearanceModel, described, leaning, pressed
from trunnion.model.joint_parts import clearance

if TYPE_CHECKING:
    from trunnion.model.mechanism import Mechanism

Values = Mapping[str, Number]
Vector = tuple[Number, ...]
ALGEBRAS: dict[str, Any] = {"planar": plane, "spatial": space}
HOLE, PIN = "seats", "journals"
CARRIERS = (HOLE, PIN)  # under which the numbers of a seat stand: carried by the link of the hole, or of the pin


class Play(NamedTuple):
    """The play of one joint: its model, the radius of each end, m, and the length H, m."""

    model: ClearanceModel
    radii: tuple[Number, ...]
    length: Number


def play_of(space: str, kind: str, values: Values, joint: str) -> Play | None:
    """The play that a joint states; None if it has none, or of a kind that has no model of it."""
    model = CLEARANCE_MODELS[space].get(kind)
    gap = clearance(joint, values)
    path = f"joints.{joint}"
    floats = values.get(f"{path}.pin.end_float", 0.0) if model and model.axial else 0.0
    if model is None or (gap is None and np.all(primal(floats) == 0)):
        return None
    radius = (gap if gap is not None else 0.0) + values.get(f"{path}.pin.cylindricity", 0.0)
    radii = tuple(0.5 * floats if i in model.axial else radius for i in range(len(model.ends)))
    return Play(model, radii, length_of(model, values, joint))


class GivenSeat(NamedTuple):
    """A joint whose pin does not lie in the middle of its hole: its play, and the offsets at its ends if given."""

    joint: str
    play: Play
    given: list[Vector] | None


def seats(mechanism: Mechanism, values: Values) -> list[GivenSeat]:
    """The joints whose seat is given or follows the load."""
    plays = (
        (joint, seat, play_of(mechanism.space, mechanism.effective_joints[joint].type, values, joint))
        for joint, seat in mechanism.seated.items()
    )
    return [
        GivenSeat(joint, play, None if isinstance(seat, str) else given_offsets(values, joint, play))
        for joint, seat, play in plays if play is not None
    ]  # fmt: skip


def given_offsets(values: Values, joint: str, play: Play) -> list[Vector]:
    """Offsets of a seat that is stated: by β and ξ of a pin, of a guide from its normal, by a direction of a ball."""
    path = f"joints.{joint}.seat"
    offsets: list[Vector] = []
    for end, radius in zip(play.model.ends, play.radii, strict=True):
        if len(end) == 3:
            offsets.append(pressed(tuple(values[f"{path}.direction.{axis}"] for axis in "xyz"), radius))
            continue
        both = described(radius, values.get(f"{path}.beta", 0.0), values.get(f"{path}.xi", 0.0))
        place = both[1 if end[0].startswith("2") else 0]
        if len(end) == 2:
            offsets.append(place)
        elif end[0].startswith("3"):  # nothing is said of the end float
            offsets.append((0.0,))
        else:  # the guide of a plane counts ξ from its normal
            offsets.append((place[1 if end[0].endswith("y") and len(play.model.ends) > 2 else 0],))
    return offsets


def carriers_of(mechanism: Mechanism, joint: str) -> tuple[str, ...]:
    """Which of `CARRIERS` a seat may be on as the joint turns: the one that the model says, or both.

    Where nothing turns in a hole, both are the same; where a joint slides, the length of its hole goes with one link.
    """
    joint_entry = mechanism.effective_joints[joint]
    model = CLEARANCE_MODELS[mechanism.space].get(joint_entry.type)
    if joint_entry.seat_on is not None:
        return (CARRIERS[0] if joint_entry.seat_on == joint_entry.links[1] else CARRIERS[1],)
    return CARRIERS if model is not None and model.turns else CARRIERS[:1]


def length_of(model: ClearanceModel, values: Values, joint: str) -> Number:
    """Length H over which the ends of a play lie apart, m; NaN if it is not stated, 1 where it does not matter."""
    if model.size is None:
        return 1.0
    part, keys = model.size
    return next((values[path] for key in keys if (path := f"joints.{joint}.{part}.{key}") in values), np.nan)


def unstated_length(joint: str, play: Play) -> list[Finding]:
    """What there is to say where the length over which the ends of a play lie apart is not known."""
    if not np.any(np.isnan(primal(play.length))):
        return []
    assert play.model.size is not None  # else the length is 1
    part, keys = play.model.size
    what = "the distance between its ends is not stated"
    return [Finding(what, f"joints.{joint}.{part}", f"state joints.{joint}.{part}.{keys[0]}")]


def hole(frame: Any, values: Values, joint: str) -> Any:
    """The frame of the hole: the second element, moved along its axis by the offset of the pin."""
    offset = values.get(f"joints.{joint}.pin.offset")
    return frame if offset is None else space.slid(frame, offset)


def misaligned(of: str, frame: Any, values: Values, joint: str) -> Any:
    """The second element of a joint with the misalignment of its axis, in the plane with its offset alone.

    Leaned by `tilt` towards the direction `towards`, moved by `offset` along `offset_towards`, in the hole's frame. of:
    "planar" or "spatial".
    """
    path = f"joints.{joint}.misalignment"
    tilt, offset = values.get(f"{path}.tilt", 0.0), values.get(f"{path}.offset", 0.0)
    if all(isinstance(number, int | float) and number == 0 for number in (tilt, offset)):
        return frame
    towards = values.get(f"{path}.towards", 0.0)
    aside = values.get(f"{path}.offset_towards", towards)
    xp = namespace(tilt, towards, offset, aside)
    place = (offset * xp.cos(aside), offset * xp.sin(aside))
    if of == "planar":
        return plane.compose(frame, plane.Frame(*place))
    slope = xp.sin(tilt) / xp.cos(tilt)
    local = leaning((slope * xp.cos(towards), slope * xp.sin(towards)), 0.0, place)
    return _in_hole(frame, values, joint, lambda middle: space.compose(middle, local))


def seated(of: str, frame: Any, kind: str, values: Values, joint: str, carrier: str = HOLE) -> Any:
    """An element of a joint where its pin lies in the hole, if the link of that element carries the seat.

    That is the second one if the link of the hole does, the first if that of the pin does: then the hole lies off it
    the other way.
    """
    model = CLEARANCE_MODELS[of].get(kind)
    offsets = model.offsets(values, f"{carrier}.{joint}") if model else None
    if model is None or offsets is None:
        return frame
    local = model.shift(offsets, length_of(model, values, joint))
    lay = ALGEBRAS[of].compose if carrier == HOLE else ALGEBRAS[of].relative
    return _in_hole(frame, values, joint, lambda middle: lay(middle, local))


def _in_hole(frame: Any, values: Values, joint: str, move: Callable[[Any], Any]) -> Any:
    """An element, moved at the middle of the hole; in the plane, where no bearing has an offset, that is its point."""
    offset = values.get(f"joints.{joint}.pin.offset")
    return move(frame) if offset is None else space.slid(move(space.slid(frame, offset)), -offset)

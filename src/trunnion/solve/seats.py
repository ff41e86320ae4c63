"""The joints whose pins do not lie in the middle of their holes, and the seats that are given."""

from __future__ import annotations

from typing import NamedTuple

from trunnion.algebra.namespace import Number
from trunnion.joints.clearance import described, pressed
from trunnion.solve.shifts import Play, play_of
from trunnion.solve.system import System, Values

__all__ = ["GivenSeat", "given_offsets", "seats"]

Vector = tuple[Number, ...]


class GivenSeat(NamedTuple):
    """A joint whose pin does not lie in the middle of its hole: its play, and the offsets at its ends if given."""

    joint: str
    play: Play
    given: list[Vector] | None


def seats(system: System, values: Values) -> list[GivenSeat]:
    """The joints whose seat is given or follows the load."""
    found = []
    space = system.mechanism.space
    for joint, stated in system.mechanism.seated.items():
        play = play_of(space, system.joints[joint][0], values, joint)
        if play is not None:
            found.append(
                GivenSeat(joint, play, given_offsets(values, joint, play) if not isinstance(stated, str) else None)
            )
    return found


def given_offsets(values: Values, joint: str, play: Play) -> list[Vector]:
    """Offsets of a seat that is stated: by β and ξ of a pin, of a guide from its normal, by a direction of a ball."""
    path = f"joints.{joint}.seat"
    found: list[Vector] = []
    for end, radius in zip(play.model.ends, play.radii, strict=True):
        if len(end) == 3:
            direction = tuple(values[f"{path}.direction.{axis}"] for axis in "xyz")
            found.append(pressed(direction, radius))
            continue
        both = described(radius, values.get(f"{path}.beta", 0.0), values.get(f"{path}.xi", 0.0))
        place = both[1 if end[0].startswith("2") else 0]
        if len(end) == 2:
            found.append(place)
        elif end[0].startswith("3"):  # nothing is said of the end float
            found.append((0.0,))
        else:  # the guide of a plane counts ξ from its normal
            across = end[0].endswith("y") and len(play.model.ends) > 2
            found.append((place[1 if across else 0],))
    return found

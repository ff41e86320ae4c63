"""Contacts of pins in play in space: the ends of the hole, and the shoulders of the pin.

The pin's axis may shift and tilt in its hole, whose ends lie half its length before and behind its middle. At each end
the pin touches the wall where the centre of the hole's end is farther from the pin's axis than the clearance,
|c| > ρ = R − r. The force acts there at right angles to the pin's axis, and at the wall there is friction along the
slip of the surfaces, around the axis and along it. Two such forces carry a force across and a moment, their couple. The
pin of a revolute joint also has shoulders: one of them touches where the pin has come along the hole's axis by half the
end float. A shoulder pushes along that axis, without friction: nothing states on which radius it would act.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NoReturn, cast

from trunnion.algebra.dual import primal
from trunnion.algebra.namespace import namespace
from trunnion.algebra.nested import each
from trunnion.algebra.space import ORIGIN, Frame, moment_at
from trunnion.algebra.vector import Vector3, cross, dot, length, minus, plus, scaled
from trunnion.dynamics.touching import CENTRED, Contact, ContactState
from trunnion.solve.forward import Forward

__all__ = ["DiscContact", "ShoulderContact"]


@dataclass(frozen=True)
class SpatialContact(Contact):
    """A contact of a pin in a hole in space. axle: the pin's frame on its link, z its axis; hole: of the hole, at the
    middle or an end, on its own link."""

    axle: Frame = ORIGIN
    hole: Frame = ORIGIN

    def accelerations(self, walk: Forward) -> NoReturn:
        """Impacts of rigid bodies are of planar joints: the model's checks refuse others."""
        raise NotImplementedError

    def _axes(self, walk: Forward) -> tuple[Frame, Frame]:
        """Global frames of pin and hole."""
        found = []
        for link, local in ((self.body, self.axle), (self.other, self.hole)):
            frame = walk.motions[link].frame
            found.append(each(walk.algebra.compose(frame, local), primal))
        return found[0], found[1]

    def _speed(self, walk: Forward, place: Vector3) -> Vector3:
        """Velocity of the pin against the hole, of their materials at a place, m/s."""
        pin, hole = (each(moment_at(walk.motions[link].twist, place), primal) for link in (self.body, self.other))
        return minus(pin, hole)


@dataclass(frozen=True)
class DiscContact(SpatialContact):
    """One end of a pin in its hole. wall: radius of the hole, m."""

    bored = True
    wall: float = 0.0

    def state(self, walk: Forward) -> ContactState:
        """The gap is ρ − |c|, c from the centre of the hole's end to the pin's axis at right angles to that."""
        pin, end = self._axes(walk)
        apart = minus(pin.place, end.place)
        c = minus(apart, scaled(dot(apart, pin.z), pin.z))
        size = length(c)
        xp = namespace(size)
        there = size > CENTRED * self.clearance
        over = 1 / xp.where(there, size, 1.0)
        beside = cross(end.y, pin.z)  # where it lies in no direction
        share = 1 / length(beside)
        normal = cast("Vector3", tuple(
            xp.where(there, part * over, other * share) for part, other in zip(c, beside, strict=True)
        ))  # fmt: skip
        place = plus(end.place, scaled(self.wall, normal))
        speed = self._speed(walk, place)
        away = dot(speed, normal)
        sliding = minus(speed, scaled(away, normal))
        slip = length(sliding)
        slips = slip > 0.0
        share, around = 1 / xp.where(slips, slip, 1.0), cross(pin.z, normal)
        tangent = tuple(xp.where(slips, part * share, other) for part, other in zip(sliding, around, strict=True))
        offset = tuple(dot(c, axis) for axis in (end.x, end.y, end.z))
        return ContactState(self.clearance - size, -away, slip, normal, tangent, place, offset)


@dataclass(frozen=True)
class ShoulderContact(SpatialContact):
    """A shoulder of a pin at one end of its hole. side: −1 or +1, the end by the hole's axis."""

    side: float = 1.0

    def state(self, walk: Forward) -> ContactState:
        """The gap is half the end float less how far the pin has come along the hole's axis, to this side."""
        pin, middle = self._axes(walk)
        apart, normal = minus(pin.place, middle.place), scaled(self.side, middle.z)
        speed = self._speed(walk, pin.place)
        nothing = 0.0 * dot(apart, normal)
        offset = tuple(dot(apart, axis) for axis in (middle.x, middle.y, middle.z))
        tangent = tuple(part + nothing for part in middle.x)
        normal = cast("Vector3", tuple(part + nothing for part in normal))
        return ContactState(
            self.clearance - dot(apart, normal), -dot(speed, normal), nothing, normal, tangent, pin.place, offset
        )

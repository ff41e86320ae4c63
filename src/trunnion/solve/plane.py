"""What a joint does in the plane: its rates, its contact with friction, its wrench; the rest is in `solve.forward`.

Twists and wrenches of a link are about the origin of the global frame, those of a joint about its point on its second
link, where a pin carries no moment.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, ClassVar

import numpy as np

from trunnion.algebra import plane
from trunnion.algebra.dual import primal
from trunnion.algebra.literal import is_zero
from trunnion.algebra.namespace import Number, namespace
from trunnion.algebra.plane import Frame, Twist, Wrench, about, acceleration_at, moment_at, place_of, velocity_at
from trunnion.joints.pairs import PlanarContactLoad, Reaction
from trunnion.solve.forward import Forward, rate_of
from trunnion.solve.friction_problem import Rubbing
from trunnion.solve.system import Place

__all__ = ["PlaneWalk", "contacts"]


class PlaneWalk(Forward):
    """What one walk forward found in the plane."""

    algebra: ClassVar[Any] = plane

    # ---- joints -----------------------------------------------------------------------------------------------

    def coordinates(self, joint: str) -> tuple[Number, Number]:
        """Turn in (−π, π] rad, or slide, m, of a joint."""
        first, second = self.ends(joint)
        if self.system.turns(joint):
            c, s = plane.turned_vector(first.c, -first.s, second.c, second.s)
            return namespace(s, c).arctan2(s, c), 0.0
        return 0.0, first.c * (second.x - first.x) + first.s * (second.y - first.y)

    def coordinate(self, joint: str, first: Frame, second: Frame) -> Number:
        """Slide or turn of a joint from its elements."""
        if self.system.turns(joint):
            return np.arctan2(second.s, second.c) - np.arctan2(first.s, first.c)
        return first.c * (second.x - first.x) + first.s * (second.y - first.y)

    def rates(self, joint: str) -> tuple[Number, Number]:
        """Rate of the turn or of the slide."""
        if self.system.turns(joint):
            first, second = self.system.joints[joint][1]
            return self.motions[second].twist.w - self.motions[first].twist.w, 0.0
        axis, at = self.ends(joint)
        x, y = velocity_at(self.against(joint), place_of(at))
        return 0.0, axis.c * x + axis.s * y

    def second_rates(self, joint: str) -> tuple[Number, Number]:
        """Its derivative; the Coriolis part 2 ω × ṡ lies across the slide."""
        first, second = (self.motions[link] for link in self.system.joints[joint][1])
        if self.system.turns(joint):
            return second.acceleration.w - first.acceleration.w, 0.0
        axis, at = self.ends(joint)
        one, two = (acceleration_at(link.twist, link.acceleration, place_of(at)) for link in (first, second))
        return 0.0, axis.c * (two[0] - one[0]) + axis.s * (two[1] - one[1])

    def slip_motion(self, joint: str) -> tuple[Number, Number]:
        """Slip of a joint's contact, second link against first, and its rate; m/s, m/s²."""
        if not self.system.turns(joint):
            return self.rates(joint)[1], self.second_rates(joint)[1]
        lever = self.values[f"joints.{joint}.pin.radius"]
        return lever * self.rates(joint)[0], lever * self.second_rates(joint)[0]

    # ---- holes ------------------------------------------------------------------------------------------------

    def hole(self, joint: str) -> Frame:
        """Global frame of the hole of a joint: in its second link, axes of the link, of a guide along its slide."""
        second = self.system.joints[joint][1][1]
        return plane.compose(self.motions[second].frame, self.holes[second, joint])

    def hole_spin(self, joint: str) -> tuple[Number, ...]:
        """Angular velocity of the hole of a joint against its pin, rad/s."""
        return (self.against(joint).w,)

    def in_hole(self, joint: str, wrench: Wrench) -> tuple[tuple[Number, ...], tuple[Number, ...]]:
        """Force, N, and moment about its middle, N m, of a joint's wrench, in the frame of its hole."""
        hole, at = self.hole(joint), self.ends(joint)[1]
        x, y, _ = wrench
        moment = moment_at(wrench, (hole.x - at.x, hole.y - at.y))
        return (x * hole.c + y * hole.s, y * hole.c - x * hole.s), (moment,)

    # ---- the walk ---------------------------------------------------------------------------------------------

    def frame_rate(self, frame: Frame) -> Twist:
        """Twist of a link whose frame has the rates of its numbers as ε parts."""
        spin = primal(frame.c) * rate_of(frame.s) - primal(frame.s) * rate_of(frame.c)
        x, y = primal(frame.x), primal(frame.y)
        return Twist(rate_of(frame.x) + spin * y, rate_of(frame.y) - spin * x, spin)

    # ---- forces -----------------------------------------------------------------------------------------------

    def axis(self, joint: str, turns: bool) -> tuple[Twist, Wrench]:
        """A joint's motion at unit rate of its turn or slide, and the wrench of a unit effort in it."""
        if turns:
            return Twist(0.0, 0.0, 1.0), Wrench(0.0, 0.0, 1.0)
        along = self.ends(joint)[0]
        return Twist(along.c, along.s, 0.0), Wrench(along.c, along.s, 0.0)

    def on_link(self, link: str, wrench: Wrench, joint: str) -> Wrench:
        """A joint's wrench about the origin."""
        return about(wrench[:2], wrench.m, place_of(self.ends(joint)[1]))

    def reacting(self, group: Any) -> Any:
        """A module whose reactions are flat tuples."""
        return group

    def wrench(self, place: Place, reaction: Reaction) -> Wrench:
        """The reaction of a joint in the file's sense; its module may see the joint from its second link."""
        found = Wrench(*reaction)
        if not place.reversed_:
            return found
        found = plane.times(-1.0, found)
        if self.system.turns(place.joint):
            return found
        here, there = self.ends(place.joint)  # the module's second point is the file's first
        return Wrench(found.x, found.y, moment_at(found, (there.x - here.x, there.y - here.y)))

    def bare(self, joint: str, wrench: Wrench) -> Wrench:
        """A reaction without what acts along the freedom of its joint: rounding, and of a pin exactly nothing."""
        motion, unit = self.freedom(joint, self.system.turns(joint))
        rest: Wrench = plane.minus(wrench, plane.times(plane.power(wrench, motion), unit))
        return rest

    def inertia_moment(self, link: str) -> Number | None:
        """−J α about the mass centre, N m; None of a link without inertia.  [D 2-5]"""
        about_origin = self.system.mechanism.links[link].inertia_about == "origin"
        mass, inertia = self.values[f"links.{link}.mass"], self.values[f"links.{link}.inertia"]
        if is_zero(inertia) and (not about_origin or is_zero(mass)):
            return None
        if about_origin:
            x, y = self.system.centre(self.values, link)
            inertia = inertia - mass * (x * x + y * y)
        return -inertia * self.motions[link].acceleration.w


def contacts(walk: PlaneWalk, joint: str) -> Iterator[Rubbing]:
    """The one contact of a joint: a pin in its hole, or a guide, whose middle is at its point on the second link."""
    turns, path = walk.system.turns(joint), f"joints.{joint}"
    speed = walk.speed(joint)
    zero = np.abs(primal(speed)) <= walk.noise(joint, turns)
    if turns:
        lever = walk.values[f"{path}.pin.radius"]
        yield Rubbing(PlanarContactLoad(), lever * speed, Wrench(0.0, 0.0, lever), zero, amount=lever, turning=1.0)
        return
    axis, middle = walk.ends(joint)
    at = axis if joint in walk.system.reversed else middle  # what the module's reaction is about
    arm = None if at is middle else (middle.x - at.x, middle.y - at.y)
    load = PlanarContactLoad((-axis.s, axis.c), walk.values[f"{path}.guide.length"], arm)
    yield Rubbing(load, speed, Wrench(axis.c, axis.s, 0.0), zero)

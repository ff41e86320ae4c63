"""Motion in space, forward through the row of modules: frames, twists and their derivatives of all links."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, NamedTuple, cast

import numpy as np

from trunnion.algebra.dual import primal
from trunnion.algebra.namespace import Number, namespace
from trunnion.algebra.nested import each
from trunnion.algebra.space import ORIGIN, ZERO, Frame, Screw, compose, minus, moment_at, point_of, times, vector_minus
from trunnion.algebra.vector import Vector3, cross, dot, plus, scaled
from trunnion.groups.spatial_tree import Element
from trunnion.solve.forward import Forward, Motion, rate_of
from trunnion.solve.shifts import hole
from trunnion.solve.space.system import SpatialSystem
from trunnion.solve.system import Place, Values, driven_coordinates

__all__ = ["SpatialMotion", "SpatialPoint", "SpatialWalk", "on_the_ground"]


class SpatialMotion(NamedTuple):
    """Frame of a link, its twist ω + ε v of the point at the origin, and the derivative of the twist."""

    frame: Frame
    twist: Screw
    acceleration: Screw


class SpatialPoint(NamedTuple):
    """Place, velocity, acceleration of a point of a link."""

    place: Vector3
    velocity: Vector3
    acceleration: Vector3


GROUND = SpatialMotion(ORIGIN, ZERO, ZERO)


@dataclass
class SpatialWalk(Forward):
    """What one walk forward found in space."""

    @property
    def space(self) -> SpatialSystem:
        """The system."""
        return cast(SpatialSystem, self.system)

    @cached_property
    def size(self) -> Number:
        """Length typical of the mechanism, m."""
        return self.space.size(self.values, self.local)

    @cached_property
    def _stated(self) -> dict[tuple[str, str], Frame]:
        """Elements without errors: the points of a loop's links do not move with what lies in them."""
        return self.space.stated_elements(self.values)

    @cached_property
    def spins(self) -> dict[str, Number]:
        """Angular speed of every link, rad/s; real parts."""
        found = {}
        for link, motion in self.motions.items():
            square = primal(dot(motion.twist.u, motion.twist.u))
            found[link] = np.sqrt(square)
        return found

    def element(self, link: str, joint: str) -> Frame:
        """Global frame of a joint's element on a link."""
        key = (link, joint)
        if key not in self._elements:
            self._elements[key] = compose(self.motions[link].frame, self.local[key])
        return cast(Frame, self._elements[key])

    def hole(self, joint: str) -> Frame:
        """Global frame of the hole of a joint: in its second link, z along the axis, in the middle of the bearing."""
        second = self.system.joints[joint][1][1]
        return hole(compose(self.motions[second].frame, self.holes[second, joint]), self.values, joint)

    def hole_spin(self, joint: str) -> Vector3:
        """Angular velocity of the hole of a joint against its pin in the hole's frame, rad/s."""
        spin, frame = self.against(joint).u, self.hole(joint)
        return dot(spin, frame.x), dot(spin, frame.y), dot(spin, frame.z)

    def backward(self) -> SpatialWalk:
        """The same positions passed the other way: velocities turned round, accelerations as they are."""
        turned = {link: motion._replace(twist=times(-1.0, motion.twist)) for link, motion in self.motions.items()}
        return replace(self, motions=turned, direction=-self.direction)

    def point(self, link: str, name: str) -> SpatialPoint:  # type: ignore[override]
        """Motion of a named point of a link, or of its element of a joint."""
        return self.at(link, self._local_place(link, name))

    def at(self, link: str, local: Vector3) -> SpatialPoint:
        """Motion of the point of a link with local coordinates, m: v = v₀ + ω × p, a = a₀ + ω̇ × p + ω × v."""
        frame, twist, second = self.motions[link]
        place = point_of(frame, local)
        velocity = moment_at(twist, place)
        return SpatialPoint(place, velocity, plus(moment_at(second, place), cross(twist.u, velocity)))

    def placed(self, frame: Any, link: str, name: str) -> tuple[Number, ...]:
        """Place of a named point of a link, or of its element of a joint, if the link lies in a frame."""
        return point_of(frame, self._local_place(link, name))

    def composed(self, frame: Any, link: str, joint: str) -> Frame:
        """Element of a joint on a link that lies in a frame."""
        return compose(frame, self.local[link, joint])

    def coordinate(self, joint: str, first: Any, second: Any) -> Number:
        """Turn of a joint from its elements, of a cross that of its first pin, or slide if that is all it does."""
        if self.system.joints[joint][0] == "universal":  # its second pin lies at (sin θ₁, −cos θ₁, 0)
            sine, cosine = dot(second.z, first.x), -dot(second.z, first.y)
            return namespace(sine, cosine).arctan2(sine, cosine)
        return _dual_angle(first, second)[0 if self.system.turns(joint) else 1]

    def _local_place(self, link: str, name: str) -> Vector3:
        path = f"links.{link}.points.{name}"
        if f"{path}.z" not in self.values:
            return self._stated[link, name].place
        return cast(Vector3, tuple(self.values[f"{path}.{axis}"] for axis in "xyz"))

    def against(self, joint: str) -> Screw:
        """Twist of the second link of a joint against the first."""
        first, second = self.system.joints[joint][1]
        return minus(self.motions[second].twist, self.motions[first].twist)

    def coordinates(self, joint: str) -> tuple[Number, Number]:
        """Turn in (−π, π] rad and slide, m, of a joint on one axis: θ and s of its dual angle."""
        first, second = self.system.joints[joint][1]
        turn, slide = _dual_angle(self.element(first, joint), self.element(second, joint))
        path = f"loop.{joint}"  # the constant slide of a revolute row, the constant rotation of a prismatic one
        return turn + self.values.get(f"{path}.rotation", 0.0), slide + self.values.get(f"{path}.slide", 0.0)

    def rates(self, joint: str) -> tuple[Number, Number]:
        """θ̇ and ṡ of a joint on one axis, rad/s and m/s."""
        second = self.element(self.system.joints[joint][1][1], joint)
        twist = self.against(joint)
        return dot(twist.u, second.z), dot(moment_at(twist, second.place), second.z)

    def second_rates(self, joint: str) -> tuple[Number, Number]:
        """θ̈ and s̈ of a joint on one axis: with ẑ carried by the first link, (ẑ · V)˙ = ẑ · V̇ + (Ω × ẑ) · V."""
        (first, second_link), two = self.system.joints[joint][1], self.element(self.system.joints[joint][1][1], joint)
        one, other = self.motions[first], self.motions[second_link]
        base = one.twist
        relative, rate = self.against(joint), minus(other.acceleration, one.acceleration)
        carried = cross(base.u, two.z)
        at = moment_at(relative, two.place)
        speed = moment_at(base, two.place)  # the point of the axis moves along with the first link
        change = plus(moment_at(rate, two.place), cross(relative.u, speed))
        return dot(rate.u, two.z) + dot(relative.u, carried), dot(change, two.z) + dot(at, carried)

    def slip_motion(self, joint: str) -> tuple[Number, Number]:
        """Slip of the contact of a joint that moves one way only, along its thread if it has one; m/s, m/s²."""
        (turn, slide), (turn_rate, slide_rate) = self.rates(joint), self.second_rates(joint)
        if self.system.joints[joint][0] == "prismatic":
            return slide, slide_rate
        lever, lead = self.values[f"joints.{joint}.pin.radius"], self.space.lead(self.values, joint)
        way = namespace(lever, lead).sqrt(lever * lever + lead * lead)
        return way * turn, way * turn_rate

    def frame_rate(self, frame: Any) -> Screw:
        """Twist of a link whose frame has rates as ε parts: ω = ½ Σ e × ė, and the velocity of its origin p."""
        parts = [(each(axis, primal), each(axis, rate_of)) for axis in frame]
        (x, dx), (y, dy), (z, dz), (place, rate) = parts
        spin = scaled(0.5, plus(plus(cross(x, dx), cross(y, dy)), cross(z, dz)))
        return Screw(spin, vector_minus(rate, cross(spin, place)))

    def unspun(self, number: int, pose: Any, twists: Mapping[str, Any]) -> dict[str, Any]:
        """Twists of a module's links with a free spin, without what they spin about the line of their joints."""
        group, found = self.space.groups[number], {}
        for (link, _, _), (_, a, b) in zip(self.space.plan.modules[number].spinning, group.spinning, strict=True):
            elements = each(pose.elements, primal)
            axis = group.spin_axis(elements, a, b)
            line = Screw(axis, cross(elements[a].second.place, axis))
            found[link] = minus(twists[link], times(dot(axis, twists[link].u), line))
        return found

    def _pair(self, place: Place) -> Any:
        return Element(self._side(place, 0), self._side(place, 1), self.space.lead(self.values, place.joint))

    def take(self, number: int, pose: Any, time: Number) -> None:
        """Add the motion of one module, whose pose is known."""
        system = self.space
        module, group, places = system.plan.modules[number], system.groups[number], system.places[number]
        _, rates, seconds = driven_coordinates(system, module, places, self.values, time)
        outside = [
            next((link for link, outer in zip(place.links, place.outer, strict=True) if outer), None)
            for place in places
        ]
        twists_out = [self.motions[link].twist if link else None for link in outside]
        accelerations_out = [self.motions[link].acceleration if link else None for link in outside]
        speeds = group.rates(pose, twists_out, rates)
        twists = group.twists(pose, twists_out, speeds)
        accelerations = group.acceleration(pose, twists, twists_out, accelerations_out, seconds, speeds)
        for link, frame, twist, second in zip(module.links, pose.frames, twists, accelerations, strict=True):
            self.motions[link] = SpatialMotion(frame, twist, second)
        self.poses.append(pose)


def on_the_ground(system: SpatialSystem, values: Values) -> SpatialWalk:
    """A walk in space before its first module: only the ground is known."""
    ground: dict[str, Motion | SpatialMotion] = {system.mechanism.fixed_link: GROUND}
    return SpatialWalk(system, values, system.elements(values), ground)


def _dual_angle(first: Frame, second: Frame) -> tuple[Number, Number]:
    """θ and s from one element of a joint on one axis to the other, rad and m."""
    sine, cosine = dot(second.x, first.y), dot(second.x, first.x)
    slide = dot(vector_minus(second.place, first.place), first.z)
    return namespace(sine, cosine).arctan2(sine, cosine), slide

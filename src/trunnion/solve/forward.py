"""Motion, forward through the row of modules: poses, velocities, accelerations of all links."""

from __future__ import annotations

import operator
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from trunnion.algebra.dual import Dual, primal
from trunnion.algebra.namespace import Number
from trunnion.algebra.nested import zipped
from trunnion.algebra.plane import Acceleration, Frame, Twist, accelerated, compose, moved, point
from trunnion.solve.system import Place, System, Values, driven_coordinates

__all__ = ["Assembly", "Forward", "Motion", "PointMotion", "Travel", "forward", "pose_of", "posed", "rate_of", "start"]

Assembly = Sequence[Any]  # per module: ±1 for a closed form, a `branches.Track` for a general group, None for a driver


class Motion(NamedTuple):
    """Frame of a link with the velocity and acceleration of its origin."""

    frame: Frame
    twist: Twist
    acceleration: Acceleration


class Travel(NamedTuple):
    """What the travel of seats adds to the velocity of a link, and the link's whole acceleration; None: as if held."""

    twist: Any
    acceleration: Any = None


class PointMotion(NamedTuple):
    """Place, velocity, acceleration of a point of a link, each (x, y)."""

    place: tuple[Number, Number]
    velocity: tuple[Number, Number]
    acceleration: tuple[Number, Number]


GROUND = Motion(Frame(0.0, 0.0, 1.0, 0.0), Twist(0.0, 0.0, 0.0), Acceleration(0.0, 0.0, 0.0))


@dataclass
class Forward:
    """What one walk forward found at the times (s) it was asked for; element frames are worked out once and kept.

    In the plane; `solve.space.motion` has the same of space.
    """

    system: System
    values: Values
    local: dict[tuple[str, str], Any]
    motions: dict[str, Any]
    time: Number = 0.0
    direction: float = 1.0  # −1: the same way run backward
    poses: list[Any] = field(default_factory=list)
    assembly: list[Any] = field(default_factory=list)
    _elements: dict[tuple[str, str], Any] = field(default_factory=dict)

    def element(self, link: str, joint: str) -> Any:
        """Global frame of a joint's element on a link."""
        key = (link, joint)
        if key not in self._elements:
            frame, local = self.motions[link].frame, self.local[key]
            if self.system.joints[joint][0] == "revolute":  # its direction is the link's own
                self._elements[key] = Frame(*point(frame, local.x, local.y), frame.c, frame.s)
            else:
                self._elements[key] = compose(frame, local)
        return self._elements[key]

    @cached_property
    def pace(self) -> Number:
        """Angular speed typical of the mechanism, rad/s."""
        return self.system.pace(self.values)

    @cached_property
    def extent(self) -> Number:
        """Length typical of the mechanism, m."""
        return self.system.size(self.values)

    @cached_property
    def holes(self) -> dict[tuple[str, str], Any]:
        """Local frame of every joint's element where its pin lies in the middle of its hole."""
        return self.system.holes(self.values)

    def hole(self, joint: str) -> Any:
        """Global frame of the hole of a joint: in its second link, axes of the link, of a guide along its slide."""
        second = self.system.joints[joint][1][1]
        return compose(self.motions[second].frame, self.holes[second, joint])

    def hole_spin(self, joint: str) -> tuple[Number, ...]:
        """Angular velocity of the hole of a joint against its pin, rad/s."""
        first, second = self.system.joints[joint][1]
        return (self.motions[second].twist.w - self.motions[first].twist.w,)

    def backward(self) -> Forward:
        """The same positions passed the other way: velocities turned round, accelerations as they are."""
        turned = {
            link: motion._replace(twist=Twist(*(-1.0 * n for n in motion.twist)))
            for link, motion in self.motions.items()
        }
        return replace(self, motions=turned, direction=-self.direction)

    def rate(self, driver: str) -> Number:
        """Rate of a driver, rad/s or m/s."""
        return self.direction * self.system.drive(self.values, driver, self.time)[1]

    def arm(self, link: str, joint: str) -> tuple[Number, Number]:
        """From the link's origin to its element of a joint, global axes."""
        frame, element = self.motions[link].frame, self.element(link, joint)
        return element.x - frame.x, element.y - frame.y

    def twist(self, link: str, joint: str) -> Twist:
        """Velocity of the element."""
        return moved(self.motions[link].twist, *self.arm(link, joint))

    def acceleration(self, link: str, joint: str) -> Acceleration:
        """Acceleration of the element."""
        motion = self.motions[link]
        return accelerated(motion.acceleration, motion.twist.w, *self.arm(link, joint))

    def point(self, link: str, name: str) -> PointMotion:
        """Motion of a named point of a link."""
        path = f"links.{link}.points.{name}"
        return self.local_point(link, self.values[f"{path}.x"], self.values[f"{path}.y"])

    def local_point(self, link: str, x: Number, y: Number) -> PointMotion:
        """Motion of the point of a link with the local coordinates x, y (m)."""
        frame, twist, acceleration = self.motions[link]
        place = point(frame, x, y)
        arm = place[0] - frame.x, place[1] - frame.y
        velocity = moved(twist, *arm)
        second = accelerated(acceleration, twist.w, *arm)
        return PointMotion(place, (velocity.x, velocity.y), (second.x, second.y))

    def placed(self, frame: Any, link: str, name: str) -> tuple[Number, ...]:
        """Place of a named point of a link that lies in a frame."""
        path = f"links.{link}.points.{name}"
        return point(frame, self.values[f"{path}.x"], self.values[f"{path}.y"])

    def composed(self, frame: Any, link: str, joint: str) -> Any:
        """Element of a joint on a link that lies in a frame."""
        return compose(frame, self.local[link, joint])

    def coordinate(self, joint: str, first: Any, second: Any) -> Number:
        """Slide or turn of a joint from its elements."""
        if self.system.turns(joint):
            return np.arctan2(second.s, second.c) - np.arctan2(first.s, first.c)
        return first.c * (second.x - first.x) + first.s * (second.y - first.y)

    def slip_motion(self, joint: str) -> tuple[Number, Number]:
        """Slip of a joint's contact, second link against first, and its rate; m/s, m/s²."""
        kind, (first, second) = self.system.joints[joint]
        one, two = self.motions[first], self.motions[second]
        if kind == "revolute":
            lever = self.values[f"joints.{joint}.pin.radius"]
            return lever * (two.twist.w - one.twist.w), lever * (two.acceleration.w - one.acceleration.w)
        a, b = self.element(first, joint), self.element(second, joint)
        dx, dy = b.x - a.x, b.y - a.y
        v1, v2 = moved(self.twist(first, joint), dx, dy), self.twist(second, joint)
        a1, a2 = accelerated(self.acceleration(first, joint), v1.w, dx, dy), self.acceleration(second, joint)
        speed = a.c * (v2.x - v1.x) + a.s * (v2.y - v1.y)
        return speed, a.c * (a2.x - a1.x) + a.s * (a2.y - a1.y)

    def pairs(self, places: Sequence[Place]) -> list[Any]:
        """Elements of a module's joints: global on known links, local on its own."""
        return [self._pair(place) for place in places]

    def _pair(self, place: Place) -> Any:
        return self._side(place, 0), self._side(place, 1)

    def _side(self, place: Place, i: int) -> Any:
        link = place.links[i]
        return self.element(link, place.joint) if place.outer[i] else self.local[link, place.joint]

    def carried(self, travel: Mapping[str, Travel]) -> None:
        """Let the links also move as the seats of their pins travel."""
        for link, own in travel.items():
            motion = self.motions[link]
            twist = zipped(operator.add, motion.twist, own.twist)
            acceleration = motion.acceleration if own.acceleration is None else own.acceleration
            self.motions[link] = motion._replace(twist=twist, acceleration=acceleration)

    def frame_rate(self, frame: Any) -> Any:
        """Twist of a link whose frame has the rates of its numbers as ε parts."""
        spin = primal(frame.c) * rate_of(frame.s) - primal(frame.s) * rate_of(frame.c)
        return Twist(rate_of(frame.x), rate_of(frame.y), spin)

    def unspun(self, number: int, pose: Any, twists: Mapping[str, Any]) -> dict[str, Any]:
        """Twists of a module's links with a free spin, without what they spin: none in the plane."""
        return {}

    def take(self, number: int, pose: Any, time: Number) -> None:
        """Add the motion of one module, whose pose is known."""
        system = self.system
        module, group, places = system.plan.modules[number], system.groups[number], system.places[number]
        drives = driven_coordinates(system, module, places, self.values, time)
        twists_out: list[Twist | None] = []
        accelerations_out: list[Acceleration | None] = []
        for place in places:
            if place.witness:  # its relative motion is what a gear pair sees
                one, two = (self.motions[link] for link in place.links)
                twists_out.append(Twist(0.0, 0.0, two.twist.w - one.twist.w))
                accelerations_out.append(Acceleration(0.0, 0.0, two.acceleration.w - one.acceleration.w))
                continue
            outside = next((link for link, outer in zip(place.links, place.outer, strict=True) if outer), None)
            twists_out.append(self.twist(outside, place.joint) if outside else None)
            accelerations_out.append(self.acceleration(outside, place.joint) if outside else None)
        twists = group.velocity(pose, twists_out, drives[1])
        seconds = group.acceleration(pose, twists, twists_out, accelerations_out, drives[2], drives[1])
        for link, frame, twist, second in zip(module.links, pose.frames, twists, seconds, strict=True):
            self.motions[link] = Motion(frame, twist, second)
        self.poses.append(pose)


def on_the_ground(system: System, values: Values) -> Forward:
    """A walk in the plane before its first module: only the ground is known."""
    return Forward(system, values, system.elements(values), {system.mechanism.fixed_link: GROUND})


def start(system: System, values: Values) -> Forward:
    """A walk before its first module: only the ground is known."""
    walk: Forward = system.geometry.start(system, values)
    return walk


def pose_of(walk: Forward, number: int, assembly: Any, time: Number) -> Any:
    """Pose of one module on the links known so far."""
    system = walk.system
    module, group, places = system.plan.modules[number], system.groups[number], system.places[number]
    drive, _, _ = driven_coordinates(system, module, places, walk.values, time)
    if hasattr(assembly, "pose"):
        return assembly.pose(group, walk.pairs(places), drive, walk, time)
    return group.position(walk.pairs(places), assembly, drive)


def forward(
    system: System, values: Values, assembly: Assembly, time: Number, travel: Mapping[str, Travel] | None = None
) -> Forward:
    """Walk the plan forward at the given times (s).

    NaN from the first module that cannot be assembled onward, lane by lane. travel: how the links also move, since the
    seats of pins travel.
    """
    walk = start(system, values)
    walk.time = time
    with np.errstate(all="ignore"):
        for number in range(len(system.plan.modules)):
            walk.take(number, pose_of(walk, number, assembly[number], time), time)
        if travel:
            walk.carried(travel)
    return walk


def posed(system: System, values: Values, assembly: Assembly, time: Number) -> Forward:
    """The walk of `forward` for what the places alone decide: every link is left at rest."""
    walk = start(system, values)
    walk.time = time
    ground = walk.motions[system.mechanism.fixed_link]
    with np.errstate(all="ignore"):
        for number, module in enumerate(system.plan.modules):
            pose = pose_of(walk, number, assembly[number], time)
            for link, frame in zip(module.links, pose.frames, strict=True):
                walk.motions[link] = ground._replace(frame=frame)
            walk.poses.append(pose)
    return walk


def rate_of(number: Number) -> Number:
    """The ε part of a number, 0 of a plain one."""
    return number.dual if isinstance(number, Dual) else 0.0

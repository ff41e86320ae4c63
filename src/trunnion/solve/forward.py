"""Motion, forward through the row of modules: poses, velocities, accelerations of all links."""

from __future__ import annotations

import operator
from abc import ABC, abstractmethod
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, ClassVar, NamedTuple

import numpy as np

from trunnion.algebra.dual import Dual, primal
from trunnion.algebra.namespace import Number
from trunnion.algebra.nested import zipped
from trunnion.joints.pairs import PAIRS, Pair, Reaction
from trunnion.solve.system import Place, System, Values, driven_coordinates

__all__ = [
    "Assembly",
    "Forward",
    "Motion",
    "PointMotion",
    "Travel",
    "Vector",
    "forward",
    "pose_of",
    "posed",
    "quiet",
    "rate_of",
    "start",
]

ZERO_SLIP = 1e-10  # of the speeds about a joint: below it the sign of a relative speed is rounding noise
Assembly = Sequence[Any]  # per module: ±1 for a closed form, a `branches.Track` for a general group, None for a driver
Vector = tuple[Number, ...]  # of two components in the plane, of three in space


class Motion(NamedTuple):
    """Frame of a link, its twist about the global origin and the derivative of that.

    The types are those of `algebra.plane` or `algebra.space`.
    """

    frame: Any
    twist: Any
    acceleration: Any


class Travel(NamedTuple):
    """What the travel of seats adds to the twist of a link, and to its acceleration."""

    twist: Any
    acceleration: Any


class PointMotion(NamedTuple):
    """Place, velocity, acceleration of a point of a link."""

    place: Any
    velocity: Any
    acceleration: Any


@dataclass
class Forward(ABC):
    """What one walk forward found at the times (s) it was asked for; element frames are worked out once and kept.

    `solve.plane` and `solve.space.motion` say what a joint does there; all else is here. algebra: of the frames, twists
    and wrenches.
    """

    system: System
    values: Values
    local: dict[tuple[str, str], Any]
    motions: dict[str, Motion]
    time: Number = 0.0
    direction: float = 1.0  # −1: the same way run backward
    poses: list[Any] = field(default_factory=list)
    assembly: list[Any] = field(default_factory=list)
    _elements: dict[tuple[str, str], Any] = field(default_factory=dict)
    algebra: ClassVar[Any]

    # ---- what is typical --------------------------------------------------------------------------------------

    @cached_property
    def pace(self) -> Number:
        """Angular speed typical of the mechanism, rad/s."""
        return self.system.pace(self.values)

    @cached_property
    def size(self) -> Number:
        """Length typical of the mechanism, m."""
        return self.system.size(self.values)

    @cached_property
    def spins(self) -> dict[str, Number]:
        """Angular speed of every link, rad/s; real parts."""
        return {link: self.algebra.spin(motion.twist) for link, motion in self.motions.items()}

    # ---- joints -----------------------------------------------------------------------------------------------

    def pair(self, joint: str) -> Pair:
        """The kind of a joint."""
        return PAIRS[self.system.joints[joint][0]]

    def element(self, link: str, joint: str) -> Any:
        """Global frame of a joint's element on a link."""
        key = (link, joint)
        if key not in self._elements:
            self._elements[key] = self.algebra.compose(self.motions[link].frame, self.local[key])
        return self._elements[key]

    def ends(self, joint: str) -> tuple[Any, Any]:
        """Global frames of the two elements of a joint."""
        first, second = self.system.joints[joint][1]
        return self.element(first, joint), self.element(second, joint)

    def composed(self, frame: Any, link: str, joint: str) -> Any:
        """Element of a joint on a link that lies in a frame."""
        return self.algebra.compose(frame, self.local[link, joint])

    def against(self, joint: str) -> Any:
        """Twist of the second link of a joint against the first."""
        first, second = self.system.joints[joint][1]
        return self.algebra.minus(self.motions[second].twist, self.motions[first].twist)

    def speed(self, joint: str) -> Number:
        """Relative speed of a joint, second link against first, along its first freedom; rad/s, m/s."""
        return self.rates(joint)[0 if self.system.turns(joint) else 1]

    def noise(self, joint: str, turns: bool) -> Number:
        """Rate of turn or slide of a joint, rad/s or m/s, below which its sign is rounding noise."""
        first, second = self.system.joints[joint][1]
        turn = ZERO_SLIP * (self.spins[first] + self.spins[second] + self.pace)
        return turn if turns else turn * self.size

    def signed_rates(self, joint: str) -> Iterator[Number]:
        """Rates of a joint that turn round, 0 where they are noise: that of a ball has no sign."""
        pair = self.pair(joint)
        for freedom, rate in zip(("rotation", "slide"), self.rates(joint) if pair.one_axis else (), strict=False):
            if freedom in pair.freedoms:
                yield quiet(rate, self.noise(joint, turns=freedom == "rotation"))

    def still(self, joint: str, turns: bool) -> Number:
        """Where a joint does not turn or slide."""
        return np.abs(primal(self.rates(joint)[0 if turns else 1])) <= self.noise(joint, turns)

    # ---- points -----------------------------------------------------------------------------------------------

    def point(self, link: str, name: str) -> PointMotion:
        """Motion of a named point of a link, in space also of its element of a joint."""
        return self.at(link, self.local_place(link, name))

    def at(self, link: str, local: Vector) -> PointMotion:
        """Motion of the point of a link with local coordinates, m."""
        return PointMotion(*self.algebra.moving(*self.motions[link], local))

    def placed(self, frame: Any, link: str, name: str) -> Vector:
        """Place of a named point of a link that lies in a frame."""
        found: Vector = self.algebra.point_of(frame, self.local_place(link, name))
        return found

    def local_place(self, link: str, name: str) -> Vector:
        """A named point of a link in its own frame, m."""
        return self.system.vector(self.values, f"links.{link}.points.{name}")

    # ---- holes ------------------------------------------------------------------------------------------------

    @cached_property
    def holes(self) -> dict[tuple[str, str], Any]:
        """Local frame of every joint's element where its pin lies in the middle of its hole."""
        return self.system.holes(self.values)

    # ---- the walk ---------------------------------------------------------------------------------------------

    def backward(self) -> Forward:
        """The same positions passed the other way: velocities turned round, accelerations as they are."""
        turned = {
            link: motion._replace(twist=self.algebra.times(-1.0, motion.twist)) for link, motion in self.motions.items()
        }
        return replace(self, motions=turned, direction=-self.direction)

    def rate(self, driver: str) -> Number:
        """Rate of a driver, rad/s or m/s."""
        return self.direction * self.system.drive(self.values, driver, self.time)[1]

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
            twist, acceleration = (zipped(operator.add, *both) for both in zip(motion[1:], own, strict=True))
            self.motions[link] = motion._replace(twist=twist, acceleration=acceleration)

    def outside(self, place: Place) -> tuple[Any, Any]:
        """Motion of the known link of a module's joint; of a witness that of its second link against its first."""
        outer = [self.motions[link] for link, known in zip(place.links, place.outer, strict=True) if known]
        if len(outer) < 2:
            return (outer[0].twist, outer[0].acceleration) if outer else (None, None)
        first, second = outer
        minus = self.algebra.minus
        return minus(second.twist, first.twist), minus(second.acceleration, first.acceleration)

    def unspun(self, number: int, pose: Any, twists: Mapping[str, Any]) -> dict[str, Any]:
        """Twists of a module's links with a free spin, without what they spin; none have one in the plane."""
        return {}

    def take(self, number: int, pose: Any, time: Number) -> None:
        """Add the motion of one module, whose pose is known."""
        system = self.system
        module, places = system.plan.modules[number], system.places[number]
        _, rates, seconds = driven_coordinates(system, module, places, self.values, time)
        outer = [self.outside(place) for place in places]
        known = [twist for twist, _ in outer], [second for _, second in outer]
        twists, accelerations = system.groups[number].moved(pose, *known, rates, seconds)
        for link, frame, twist, second in zip(module.links, pose.frames, twists, accelerations, strict=True):
            self.motions[link] = Motion(frame, twist, second)
        self.poses.append(pose)

    def stand(self, number: int, pose: Any) -> None:
        """Add the places of one module, whose pose is known, and leave its links at rest."""
        ground = self.motions[self.system.mechanism.fixed_link]
        for link, frame in zip(self.system.plan.modules[number].links, pose.frames, strict=True):
            self.motions[link] = ground._replace(frame=frame)
        self.poses.append(pose)

    # ---- what the plane and space say of a joint, a module, a link ---------------------------------------------

    @abstractmethod
    def coordinates(self, joint: str) -> tuple[Number, Number]:
        """Turn in (−π, π] rad and slide, m, of a joint on one axis, as far as it has them."""

    @abstractmethod
    def rates(self, joint: str) -> tuple[Number, Number]:
        """Their rates, rad/s and m/s."""

    @abstractmethod
    def second_rates(self, joint: str) -> tuple[Number, Number]:
        """Their second derivatives, rad/s² and m/s²."""

    @abstractmethod
    def coordinate(self, joint: str, first: Any, second: Any) -> Number:
        """Turn or slide of a joint, whichever a driver moves, from its elements."""

    @abstractmethod
    def slip_motion(self, joint: str) -> tuple[Number, Number]:
        """Slip of the contact of a joint that moves one way only, and its rate; m/s, m/s²."""

    @abstractmethod
    def hole(self, joint: str) -> Any:
        """Global frame of the hole of a joint: in its second link."""

    @abstractmethod
    def hole_spin(self, joint: str) -> Vector:
        """Angular velocity of the hole of a joint against its pin, in the hole's frame, rad/s."""

    @abstractmethod
    def in_hole(self, joint: str, wrench: Any) -> tuple[Vector, Vector]:
        """Force, N, and moment about its middle, N m, of a joint's wrench, in the frame of its hole."""

    @abstractmethod
    def frame_rate(self, frame: Any) -> Any:
        """Twist of a link whose frame has the rates of its numbers as ε parts."""

    @abstractmethod
    def axis(self, joint: str, turns: bool) -> tuple[Any, Any]:
        """A joint's motion at unit rate of its turn or slide, and the wrench of a unit effort in it."""

    def freedom(self, joint: str, turns: bool) -> tuple[Any, Any]:
        """The same of the freedom that a driver moves."""
        return self.axis(joint, turns)

    @abstractmethod
    def on_link(self, link: str, wrench: Any, joint: str) -> Any:
        """A joint's wrench, about what the loads of a link are about."""

    @abstractmethod
    def reacting(self, group: Any) -> Any:
        """A module whose reactions are flat tuples."""

    @abstractmethod
    def wrench(self, place: Place, reaction: Reaction) -> Any:
        """The reaction of a joint on its second link as the file names it, from what its module found."""

    def bare(self, joint: str, wrench: Any) -> Any:
        """The reaction of a joint without a driver, without what is only rounding."""
        return wrench

    @abstractmethod
    def inertia_moment(self, link: str) -> Any:
        """What a link's own inertia does about its mass centre, N m; None of a link without."""


def start(system: System, values: Values) -> Forward:
    """A walk before its first module: only the ground is known."""
    made: type[Forward] = system.geometry.walk
    ground = Motion(made.algebra.ORIGIN, *made.algebra.STILL)
    return made(system, values, system.elements(values), {system.mechanism.fixed_link: ground})


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
    with np.errstate(all="ignore"):
        for number in range(len(system.plan.modules)):
            walk.stand(number, pose_of(walk, number, assembly[number], time))
    return walk


def quiet(rate: Number, noise: Number) -> Number:
    """A rate, its real part, 0 where it is noise."""
    return np.where(np.abs(primal(rate)) <= noise, 0.0, primal(rate))


def rate_of(number: Number) -> Number:
    """The ε part of a number, 0 of a plain one."""
    return number.dual if isinstance(number, Dual) else 0.0

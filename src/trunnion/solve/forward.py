"""Motion, forward through the row of modules: poses, velocities, accelerations of all links.

Twists and wrenches are about the origin of the global frame.
"""

from __future__ import annotations

import functools
import operator
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, ClassVar, NamedTuple

import numpy as np

from trunnion.algebra import plane, space
from trunnion.algebra.dual import Dual, primal
from trunnion.algebra.literal import is_zero
from trunnion.algebra.namespace import Number, cut, each, flat, namespace, zipped
from trunnion.algebra.plane import Twist, Wrench
from trunnion.algebra.space import Screw
from trunnion.algebra.vector import Matrix3, Vector3, apply, cross, dot, minus, plus, scaled, transpose
from trunnion.groups.tree import Element
from trunnion.joints.contact_loads import Reaction
from trunnion.joints.pairs import Pair
from trunnion.model.parts import InertiaTensor
from trunnion.solve import shifts
from trunnion.solve.system import Place, System, Values, driven_coordinates

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
class Forward:
    """What one walk forward found at the times (s) it was asked for; element frames are worked out once and kept.

    The joints are those of the plane; `SpatialWalk` has what they do in space. algebra: of frames, twists and wrenches.
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
    algebra: ClassVar[Any] = plane

    # ---- what is typical --------------------------------------------------------------------------------------

    @cached_property
    def pace(self) -> Number:
        """Angular speed typical of the mechanism, rad/s."""
        return self.system.pace(self.values)

    @cached_property
    def size(self) -> Number:
        """Length typical of the mechanism, m."""
        return self.system.size(self.values, self.local)

    @cached_property
    def spins(self) -> dict[str, Number]:
        """Angular speed of every link, rad/s; real parts."""
        return {link: self.algebra.spin(motion.twist) for link, motion in self.motions.items()}

    @cached_property
    def frames(self) -> dict[str, Any]:
        """Global frame of every link."""
        return {link: motion.frame for link, motion in self.motions.items()}

    # ---- what it is worth ---------------------------------------------------------------------------------------

    @cached_property
    def condition(self) -> Number:
        """Largest condition of a module."""
        parts = (primal(group.condition(pose)) for group, pose in zip(self.system.groups, self.poses, strict=True))
        return functools.reduce(np.maximum, parts, 1.0)

    @cached_property
    def assembled(self) -> Number:
        """Where every module can be assembled."""
        sums = (sum(map(primal, flat(frame)), 0.0) for pose in self.poses for frame in pose.frames)
        return functools.reduce(operator.and_, map(np.isfinite, sums), np.True_)

    # ---- joints -----------------------------------------------------------------------------------------------

    def pair(self, joint: str) -> Pair:
        """The kind of a joint."""
        return self.system.joints[joint].pair

    def element(self, link: str, joint: str) -> Any:
        """Global frame of a joint's element on a link."""
        key = (link, joint)
        if key not in self._elements:
            self._elements[key] = self.algebra.compose(self.motions[link].frame, self.local[key])
        return self._elements[key]

    def ends(self, joint: str) -> tuple[Any, Any]:
        """Global frames of the two elements of a joint."""
        first, second = self.system.joints[joint].links
        return self.element(first, joint), self.element(second, joint)

    def against(self, joint: str) -> Any:
        """Twist of the second link of a joint against the first."""
        first, second = self.system.joints[joint].links
        return self.algebra.minus(self.motions[second].twist, self.motions[first].twist)

    def speed(self, joint: str) -> Number:
        """Relative speed of a joint, second link against first, along its first freedom; rad/s, m/s."""
        return self.rates(joint)[0 if self.system.turns(joint) else 1]

    def noise(self, joint: str, turns: bool) -> Number:
        """Rate of turn or slide of a joint, rad/s or m/s, below which its sign is rounding noise."""
        first, second = self.system.joints[joint].links
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
        place: Vector = self.algebra.point_of(frame, self.local_place(link, name))
        return place

    def local_place(self, link: str, name: str) -> Vector:
        """A named point of a link in its own frame, m."""
        return self.system.vector(self.values, f"links.{link}.points.{name}")

    # ---- holes ------------------------------------------------------------------------------------------------

    @cached_property
    def holes(self) -> dict[tuple[str, str], Any]:
        """Local frame of every joint's element where its pin lies in the middle of its hole."""
        return self.system.holes(self.values)

    # ---- the walk ---------------------------------------------------------------------------------------------

    def backward(self, direction: Number = -1.0) -> Forward:
        """The same positions passed the other way: velocities turned round, accelerations as they are.

        direction: by which they are multiplied; 1 is the way it is.
        """
        turned = {}
        for link, motion in self.motions.items():
            turned[link] = motion._replace(twist=self.algebra.times(direction, motion.twist))
            cut(self.time)
        return replace(self, motions=turned, direction=direction * self.direction)

    def rate(self, driver: str) -> Number:
        """Rate of a driver, rad/s or m/s."""
        return self.direction * self.system.drive(self.values, driver, self.time)[1]

    def pairs(self, places: Sequence[Place]) -> list[Any]:
        """Elements of a module's joints: global on known links, local on its own."""
        return [
            tuple(
                self.element(link, place.joint) if outer else self.local[link, place.joint]
                for link, outer in zip(place.links, place.outer, strict=True)
            )
            for place in places
        ]

    def outside(self, place: Place) -> tuple[Any, Any]:
        """Motion of the known link of a module's joint; of a witness that of its second link against its first."""
        outer = [self.motions[link] for link, is_outer in zip(place.links, place.outer, strict=True) if is_outer]
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
        carried = [twist for twist, _ in outer], [second for _, second in outer]
        twists, accelerations = system.groups[number].moved(pose, *carried, rates, seconds)
        for link, frame, twist, second in zip(module.links, pose.frames, twists, accelerations, strict=True):
            self.motions[link] = Motion(frame, twist, second)
        self.poses.append(pose)

    def stand(self, number: int, pose: Any) -> None:
        """Add the places of one module, whose pose is known, and leave its links at rest."""
        ground = self.motions[self.system.mechanism.fixed_link]
        for link, frame in zip(self.system.plan.modules[number].links, pose.frames, strict=True):
            self.motions[link] = ground._replace(frame=frame)
        self.poses.append(pose)

    # ---- joints of the plane -----------------------------------------------------------------------------------

    def coordinates(self, joint: str) -> tuple[Number, Number]:
        """Turn in (−π, π] rad and slide, m, of a joint on one axis, as far as it has them."""
        number = self.coordinate(joint, *self.ends(joint))
        return (number, 0.0) if self.system.turns(joint) else (0.0, number)

    def coordinate(self, joint: str, first: Any, second: Any) -> Number:
        """Turn or slide of a joint, whichever a driver moves, from its elements."""
        if self.system.turns(joint):
            c, s = plane.turned_vector(first.c, -first.s, second.c, second.s)
            return namespace(s, c).arctan2(s, c)
        return first.c * (second.x - first.x) + first.s * (second.y - first.y)

    def rates(self, joint: str) -> tuple[Number, Number]:
        """Rates of the coordinates, rad/s and m/s."""
        if self.system.turns(joint):
            first, second = self.system.joints[joint].links
            return self.motions[second].twist.w - self.motions[first].twist.w, 0.0
        axis, at = self.ends(joint)
        x, y = plane.velocity_at(self.against(joint), plane.place_of(at))
        return 0.0, axis.c * x + axis.s * y

    def second_rates(self, joint: str) -> tuple[Number, Number]:
        """Their derivatives, rad/s² and m/s²; the Coriolis part 2 ω × ṡ lies across the slide."""
        first, second = (self.motions[link] for link in self.system.joints[joint].links)
        if self.system.turns(joint):
            return second.acceleration.w - first.acceleration.w, 0.0
        axis, at = self.ends(joint)
        (x, y), (to_x, to_y) = (
            plane.acceleration_at(link.twist, link.acceleration, plane.place_of(at)) for link in (first, second)
        )
        return 0.0, axis.c * (to_x - x) + axis.s * (to_y - y)

    def hole(self, joint: str) -> Any:
        """Global frame of the hole of a joint: in its second link, axes of the link, of a guide along its slide; in
        space z along the axis, in the middle of the bearing."""
        second = self.system.joints[joint].links[1]
        hole = self.algebra.compose(self.motions[second].frame, self.holes[second, joint])
        return shifts.hole(hole, self.values, joint)

    def hole_spin(self, joint: str) -> Vector:
        """Angular velocity of the hole of a joint against its pin, in the hole's frame, rad/s."""
        return (self.against(joint).w,)

    def in_hole(self, joint: str, wrench: Any) -> tuple[Vector, Vector]:
        """Force, N, and moment about its middle, N m, of a joint's wrench, in the frame of its hole."""
        hole, (x, y, _) = self.hole(joint), wrench
        moment = plane.moment_at(wrench, plane.place_of(hole))
        return (x * hole.c + y * hole.s, y * hole.c - x * hole.s), (moment,)

    def frame_rate(self, frame: Any) -> Any:
        """Twist of a link whose frame has the rates of its numbers as ε parts."""
        spin = primal(frame.c) * _rate(frame.s) - primal(frame.s) * _rate(frame.c)
        x, y = primal(frame.x), primal(frame.y)
        return Twist(_rate(frame.x) + spin * y, _rate(frame.y) - spin * x, spin)

    def axis(self, joint: str, turns: bool) -> tuple[Any, Any]:
        """A joint's motion at unit rate of its turn or slide, and the wrench of a unit effort in it."""
        along, second = self.ends(joint)
        if turns:
            return plane.line_of(second), Wrench(0.0, 0.0, 1.0)
        return Twist(along.c, along.s, 0.0), plane.about((along.c, along.s), 0.0, plane.place_of(second))

    def freedom(self, joint: str, turns: bool) -> tuple[Any, Any]:
        """The same of what a driver moves, with the slide along its thread."""
        twist, effort = self.axis(joint, turns)
        lead = self.system.lead(self.values, joint)
        return twist if is_zero(lead) else self.algebra.added(twist, self.algebra.times(lead, effort)), effort

    def reactions(self, number: int, loads: Sequence[Any], group: Any = None) -> list[Reaction]:
        """Reactions of a module to loads on its links, flat. group: in place of the module itself."""
        group = self.system.groups[number] if group is None else group
        arguments: list[Any] = [self.poses[number], loads]
        if self.system.plan.modules[number].redundant:
            arguments.append([self.system.support(self.values, place.joint) for place in self.system.places[number]])
        return [tuple(flat(wrench)) for wrench in group.reactions(*arguments)]

    def wrench(self, place: Place, reaction: Reaction) -> Any:
        """The reaction on a joint's second link as the file names it; a module may see it from the other."""
        numbers = iter(reaction)
        wrench = each(self.algebra.ZERO_LOAD, lambda _: next(numbers))
        return self.algebra.times(-1.0, wrench) if place.reversed_ else wrench

    def inertia_moment(self, link: str) -> Any:
        """−J α about the mass centre, N m; None of a link without inertia.  [D 2-5]"""
        about_origin = self.system.mechanism.links[link].inertia_about == "origin"
        mass, inertia = self.values[f"links.{link}.mass"], self.values[f"links.{link}.inertia"]
        if is_zero(inertia) and (not about_origin or is_zero(mass)):
            return None
        if about_origin:
            x, y = self.system.centre(self.values, link)
            inertia = inertia - mass * (x * x + y * y)
        return -inertia * self.motions[link].acceleration.w


class SpatialWalk(Forward):
    """What one walk forward found in space.

    The load of a link's own inertia is minus the derivative of its dual momentum [P 20, 21], taken at the mass centre
    and carried to the origin: −m a_C and −(J ω̇ + ω × J ω), gyroscopic terms included.
    """

    algebra: ClassVar[Any] = space

    @cached_property
    def _stated(self) -> dict[tuple[str, str], Any]:
        """Elements without errors: the points of a loop's links do not move with what lies in them."""
        return self.system.stated_elements(self.values)

    def local_place(self, link: str, name: str) -> Vector:
        """A named point of a link, or its element of a joint, in its own frame, m."""
        if f"links.{link}.points.{name}.z" in self.values:
            return super().local_place(link, name)
        place: Vector3 = self._stated[link, name].place
        return place

    def pairs(self, places: Sequence[Place]) -> list[Any]:
        """Elements of a module's joints with their leads: global on known links, local on its own."""
        leads = (self.system.lead(self.values, place.joint) for place in places)
        return [
            Element(first, second, lead) for (first, second), lead in zip(super().pairs(places), leads, strict=True)
        ]

    def unspun(self, number: int, pose: Any, twists: Mapping[str, Any]) -> dict[str, Any]:
        """Twists of a module's links with a free spin, without what they spin about the line of their joints."""
        group, links, unturned = self.system.groups[number], self.system.plan.modules[number].links, {}
        for link, a, b in group.spinning:
            elements = each(pose.elements, primal)
            axis = group.spin_axis(elements, a, b)
            line = Screw(axis, cross(elements[a if group.joints[a].pair.ball else b].second.place, axis))
            spin = space.times(dot(axis, twists[links[link]].u), line)
            for member in group.spun(link, a, b):
                unturned[links[member]] = space.minus(twists[links[member]], spin)
        return unturned

    # ---- joints -----------------------------------------------------------------------------------------------

    def coordinate(self, joint: str, first: Any, second: Any) -> Number:
        """Turn of a joint from its elements, of a cross that of its first pin, or slide if that is all it does.

        The slide of a screw tells its whole turns.
        """
        if self.pair(joint).crossed:  # its second pin lies at (sin θ₁, −cos θ₁, 0)
            sine, cosine = dot(second.z, first.x), -dot(second.z, first.y)
            return namespace(sine, cosine).arctan2(sine, cosine)
        turn, slide = _dual_angle(first, second)
        if not self.system.turns(joint):
            return slide
        if not self.pair(joint).threaded:
            return turn
        away = primal(slide) / primal(self.system.lead(self.values, joint)) - primal(turn)
        return turn + 2 * np.pi * np.round(away / (2 * np.pi))

    def coordinates(self, joint: str) -> tuple[Number, Number]:
        """Turn in (−π, π] rad and slide, m, of a joint on one axis: θ and s of its dual angle."""
        turn, slide = _dual_angle(*self.ends(joint))
        path = f"loop.{joint}"  # the constant slide of a revolute row, the constant rotation of a prismatic one
        return turn + self.values.get(f"{path}.rotation", 0.0), slide + self.values.get(f"{path}.slide", 0.0)

    def rates(self, joint: str) -> tuple[Number, Number]:
        """θ̇ and ṡ of a joint on one axis, rad/s and m/s."""
        second, twist = self.ends(joint)[1], self.against(joint)
        return dot(twist.u, second.z), dot(space.moment_at(twist, second.place), second.z)

    def speed(self, joint: str) -> Number:
        """Relative speed of a joint along its first freedom, of one that is not on one axis |ω|; rad/s, m/s."""
        return super().speed(joint) if self.pair(joint).one_axis else space.spin(self.against(joint))

    def second_rates(self, joint: str) -> tuple[Number, Number]:
        """θ̈ and s̈ of a joint on one axis: with ẑ carried by the first link, (ẑ · V)˙ = ẑ · V̇ + (Ω × ẑ) · V."""
        first, second = (self.motions[link] for link in self.system.joints[joint].links)
        *_, axis, place = self.ends(joint)[1]
        relative, rate = self.against(joint), space.minus(second.acceleration, first.acceleration)
        carried = cross(first.twist.u, axis)
        at = space.moment_at(relative, place)
        speed = space.moment_at(first.twist, place)  # the point of the axis moves along with the first link
        change = plus(space.moment_at(rate, place), cross(relative.u, speed))
        return dot(rate.u, axis) + dot(relative.u, carried), dot(change, axis) + dot(at, carried)

    def pin_rates(self, joint: str) -> tuple[Number, Number]:
        """Rates about the two pins of a cross, at right angles, rad/s."""
        turn, (first, second) = self.against(joint).u, self.ends(joint)
        return dot(turn, first.z), dot(turn, second.z)

    def signed_rates(self, joint: str) -> Iterator[Number]:
        """Rates of a joint, of a cross of its two pins, that turn round, 0 where they are noise."""
        if self.pair(joint).crossed:
            return (quiet(rate, self.noise(joint, turns=True)) for rate in self.pin_rates(joint))
        return super().signed_rates(joint)

    def hole_spin(self, joint: str) -> Vector:
        """See `Forward.hole_spin`."""
        return apply(self.hole(joint)[:3], self.against(joint).u)

    def in_hole(self, joint: str, wrench: Any) -> tuple[Vector, Vector]:
        """See `Forward.in_hole`."""
        *axes, middle = self.hole(joint)
        return apply(tuple(axes), wrench.u), apply(tuple(axes), space.moment_at(wrench, middle))

    def frame_rate(self, frame: Any) -> Any:
        """Twist of a link whose frame has rates as ε parts: ω = ½ Σ e × ė, and the velocity of its origin p."""
        (x, dx), (y, dy), (z, dz), (place, rate) = ((each(part, primal), each(part, _rate)) for part in frame)
        spin = scaled(0.5, plus(plus(cross(x, dx), cross(y, dy)), cross(z, dz)))
        return Screw(spin, minus(rate, cross(spin, place)))

    def axis(self, joint: str, turns: bool) -> tuple[Any, Any]:
        """A joint's motion at unit rate of its turn or slide, and the wrench of a unit effort in it."""
        line = space.line_of(self.ends(joint)[1])
        along = Screw(space.NULL, line.u)
        return (line, along) if turns else (along, line)

    # ---- forces -----------------------------------------------------------------------------------------------

    def inertia_moment(self, link: str) -> Any:
        """−(J ω̇ + ω × J ω) about the mass centre, N m, J in the link's own axes; None of a link without.  [P 21]"""
        link_entry, values = self.system.mechanism.effective_links[link], self.values
        if not isinstance(link_entry.inertia, InertiaTensor):
            return None
        xx, yy, zz, xy, xz, yz = (values[f"links.{link}.inertia.{key}"] for key in ("xx", "yy", "zz", "xy", "xz", "yz"))
        if link_entry.inertia_about == "origin":  # Steiner: J_C = J_O − m (c² 1 − c cᵀ)
            mass, (x, y, z) = values[f"links.{link}.mass"], self.system.centre(values, link)
            xx, yy, zz = xx - mass * (y * y + z * z), yy - mass * (x * x + z * z), zz - mass * (x * x + y * y)
            xy, xz, yz = xy + mass * x * y, xz + mass * x * z, yz + mass * y * z
        tensor: Matrix3 = ((xx, xy, xz), (xy, yy, yz), (xz, yz, zz))
        frame, twist, second = self.motions[link]
        back = space.Frame(*transpose(frame[:3]), space.NULL)
        w, change = space.rotated(back, twist.u), space.rotated(back, second.u)
        return scaled(-1.0, space.rotated(frame, plus(apply(tensor, change), cross(w, apply(tensor, w)))))


def _dual_angle(first: space.Frame, second: space.Frame) -> tuple[Number, Number]:
    """θ and s from one element of a joint on one axis to the other, rad and m."""
    sine, cosine = dot(second.x, first.y), dot(second.x, first.x)
    slide = dot(minus(second.place, first.place), first.z)
    return namespace(sine, cosine).arctan2(sine, cosine), slide


def start(system: System, values: Values) -> Forward:
    """A walk before its first module: only the ground is known."""
    made = SpatialWalk if system.spatial else Forward
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
    walk = _walked(system, values, assembly, time, lambda walk, number, pose: walk.take(number, pose, time))
    walk.assembly = [] if travel else list(assembly)
    for link, added in (travel or {}).items():
        motion = walk.motions[link]
        walk.motions[link] = Motion(
            motion.frame, *(zipped(operator.add, *b) for b in zip(motion[1:], added, strict=True))
        )
    return walk


def posed(system: System, values: Values, assembly: Assembly, time: Number) -> Forward:
    """The walk of `forward` for what the places alone decide: every link is left at rest.

    assembly: of the first modules at least, which are walked.
    """
    return _walked(system, values, assembly, time, lambda walk, number, pose: walk.stand(number, pose))


def _walked(
    system: System, values: Values, assembly: Assembly, time: Number, add: Callable[[Forward, int, Any], None]
) -> Forward:
    walk = start(system, values)
    walk.time = time
    with np.errstate(all="ignore"):
        for number, placed in enumerate(assembly):
            add(walk, number, pose_of(walk, number, placed, time))
            cut(time)
    return walk


def quiet(rate: Number, noise: Number) -> Number:
    """A rate, its real part, 0 where it is noise."""
    return np.where(np.abs(primal(rate)) <= noise, 0.0, primal(rate))


def _rate(number: Number) -> Number:
    """The ε part of a number, 0 of a plain one."""
    return number.dual if isinstance(number, Dual) else 0.0

"""What a joint does in space: its rates, its wrench; the rest is in `solve.forward`.

The load of a link's own inertia is minus the derivative of its dual momentum [P 20, 21], taken at the mass centre and
carried to the origin: −m a_C and −(J ω̇ + ω × J ω), gyroscopic terms included.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, ClassVar, cast

import numpy as np

from trunnion.algebra import space as algebra
from trunnion.algebra.dual import primal
from trunnion.algebra.namespace import Number, namespace
from trunnion.algebra.nested import each
from trunnion.algebra.space import Frame, Screw, compose, line_of, minus, moment_at, rotated, times, vector_minus
from trunnion.algebra.vector import Matrix3, Vector3, apply, cross, dot, plus, scaled, transpose
from trunnion.groups.spatial import SpatialGroup
from trunnion.groups.tree import Element
from trunnion.joints.pairs import Reaction
from trunnion.joints.spatial_load import halves
from trunnion.model.parts import InertiaTensor
from trunnion.solve.forward import Forward, quiet, rate_of
from trunnion.solve.shifts import hole
from trunnion.solve.space.system import SpatialSystem
from trunnion.solve.system import Place

__all__ = ["SpatialWalk"]


class SpatialWalk(Forward):
    """What one walk forward found in space; twists and wrenches are about the origin of the global frame."""

    algebra: ClassVar[Any] = algebra

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

    def hole(self, joint: str) -> Frame:
        """Global frame of the hole of a joint: in its second link, z along the axis, in the middle of the bearing."""
        second = self.system.joints[joint][1][1]
        return hole(compose(self.motions[second].frame, self.holes[second, joint]), self.values, joint)

    def hole_spin(self, joint: str) -> Vector3:
        """Angular velocity of the hole of a joint against its pin in the hole's frame, rad/s."""
        spin, frame = self.against(joint).u, self.hole(joint)
        return apply((frame.x, frame.y, frame.z), spin)

    def in_hole(self, joint: str, wrench: Screw) -> tuple[Vector3, Vector3]:
        """Force, N, and moment about its middle, N m, of a joint's wrench, in the frame of its hole."""
        frame = self.hole(joint)
        moment = moment_at(wrench, frame.place)
        axes = (frame.x, frame.y, frame.z)
        return apply(axes, wrench.u), apply(axes, moment)

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
        away = primal(slide) / primal(self.space.lead(self.values, joint)) - primal(turn)
        return turn + 2 * np.pi * np.round(away / (2 * np.pi))

    def local_place(self, link: str, name: str) -> Vector3:
        """A named point of a link, or its element of a joint, in its own frame, m."""
        if f"links.{link}.points.{name}.z" not in self.values:
            return self._stated[link, name].place
        return cast(Vector3, super().local_place(link, name))

    def coordinates(self, joint: str) -> tuple[Number, Number]:
        """Turn in (−π, π] rad and slide, m, of a joint on one axis: θ and s of its dual angle."""
        turn, slide = _dual_angle(*self.ends(joint))
        path = f"loop.{joint}"  # the constant slide of a revolute row, the constant rotation of a prismatic one
        return turn + self.values.get(f"{path}.rotation", 0.0), slide + self.values.get(f"{path}.slide", 0.0)

    def rates(self, joint: str) -> tuple[Number, Number]:
        """θ̇ and ṡ of a joint on one axis, rad/s and m/s."""
        second, twist = self.ends(joint)[1], self.against(joint)
        return dot(twist.u, second.z), dot(moment_at(twist, second.place), second.z)

    def speed(self, joint: str) -> Number:
        """Relative speed of a joint along its first freedom, of one that is not on one axis |ω|; rad/s, m/s."""
        return super().speed(joint) if self.pair(joint).one_axis else algebra.spin(self.against(joint))

    def second_rates(self, joint: str) -> tuple[Number, Number]:
        """θ̈ and s̈ of a joint on one axis: with ẑ carried by the first link, (ẑ · V)˙ = ẑ · V̇ + (Ω × ẑ) · V."""
        (first, second_link), two = self.system.joints[joint][1], self.ends(joint)[1]
        one, other = self.motions[first], self.motions[second_link]
        base = one.twist
        relative, rate = self.against(joint), minus(other.acceleration, one.acceleration)
        carried = cross(base.u, two.z)
        at = moment_at(relative, two.place)
        speed = moment_at(base, two.place)  # the point of the axis moves along with the first link
        change = plus(moment_at(rate, two.place), cross(relative.u, speed))
        return dot(rate.u, two.z) + dot(relative.u, carried), dot(change, two.z) + dot(at, carried)

    def pin_rates(self, joint: str) -> tuple[Number, Number]:
        """Rates about the two pins of a cross, at right angles, rad/s."""
        turn, (first, second) = self.against(joint).u, self.ends(joint)
        return dot(turn, first.z), dot(turn, second.z)

    def signed_rates(self, joint: str) -> Iterator[Number]:
        """Rates of a joint, of a cross of its two pins, that turn round, 0 where they are noise."""
        if self.pair(joint).crossed:
            return (quiet(rate, self.noise(joint, turns=True)) for rate in self.pin_rates(joint))
        return super().signed_rates(joint)

    def slip_motion(self, joint: str) -> tuple[Number, Number]:
        """Slip of the contact of a joint that moves one way only, along its thread if it has one; m/s, m/s²."""
        (turn, slide), (turn_rate, slide_rate) = self.rates(joint), self.second_rates(joint)
        if not self.system.turns(joint):
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

    # ---- forces -----------------------------------------------------------------------------------------------

    def axis(self, joint: str, turns: bool) -> tuple[Screw, Screw]:
        """A joint's motion at unit rate of its turn or slide, and the wrench of a unit effort in it."""
        line = line_of(self.ends(joint)[1])
        along = Screw(algebra.NULL, line.u)
        return (line, along) if turns else (along, line)

    def freedom(self, joint: str, turns: bool) -> tuple[Screw, Screw]:
        """What a driver moves: with the slide along the thread, if it has one."""
        twist, effort = self.axis(joint, turns)
        lead = self.space.lead(self.values, joint)
        return Screw(twist.u, plus(twist.m, scaled(lead, twist.u))), effort

    def on_link(self, link: str, wrench: Screw, joint: str) -> Screw:
        """A joint's wrench about the origin: the same."""
        return wrench

    def reacting(self, group: SpatialGroup) -> Any:
        """A module whose reactions are flat tuples."""
        return _Flat(group)

    def wrench(self, place: Place, reaction: Reaction) -> Screw:
        """The reaction of a joint."""
        return Screw(*halves(reaction))

    def inertia_moment(self, link: str) -> Vector3 | None:
        """−(J ω̇ + ω × J ω) about the mass centre, N m; None of a link without inertia.  [P 21]"""
        tensor = self._tensor(link)
        if tensor is None:
            return None
        frame, twist, second = self.motions[link]
        back = Frame(*transpose((frame.x, frame.y, frame.z)), algebra.NULL)
        w, change = rotated(back, twist.u), rotated(back, second.u)
        return scaled(-1.0, rotated(frame, plus(apply(tensor, change), cross(w, apply(tensor, w)))))

    def _tensor(self, link: str) -> Matrix3 | None:
        """Inertia of a link about its mass centre in its own axes, kg m²; None if it has none."""
        stated, values = self.system.mechanism.effective_links[link], self.values
        if not isinstance(stated.inertia, InertiaTensor):
            return None
        xx, yy, zz, xy, xz, yz = (values[f"links.{link}.inertia.{key}"] for key in ("xx", "yy", "zz", "xy", "xz", "yz"))
        if stated.inertia_about == "origin":  # Steiner: J_C = J_O − m (c² 1 − c cᵀ)
            mass, (x, y, z) = values[f"links.{link}.mass"], self.system.centre(values, link)
            xx, yy, zz = xx - mass * (y * y + z * z), yy - mass * (x * x + z * z), zz - mass * (x * x + y * y)
            xy, xz, yz = xy + mass * x * y, xz + mass * x * z, yz + mass * y * z
        return (xx, xy, xz), (xy, yy, yz), (xz, yz, zz)


@dataclass(frozen=True)
class _Flat:
    """A module whose reactions are flat tuples, as `friction` wants them."""

    group: SpatialGroup

    def reactions(self, pose: Any, loads: Sequence[Screw]) -> list[Reaction]:
        return [(*wrench.u, *wrench.m) for wrench in self.group.reactions(pose, loads)]


def _dual_angle(first: Frame, second: Frame) -> tuple[Number, Number]:
    """θ and s from one element of a joint on one axis to the other, rad and m."""
    sine, cosine = dot(second.x, first.y), dot(second.x, first.x)
    slide = dot(vector_minus(second.place, first.place), first.z)
    return namespace(sine, cosine).arctan2(sine, cosine), slide

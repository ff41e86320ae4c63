"""Contacts of joints in play: gaps, the speeds at them, and the forces of the contact laws on the links.

A pin of radius r lies in a hole of radius R at the offset c of its centre from the hole's: it touches the wall where
|c| = ρ = R − r. A slider of a length and a height in a guide touches with its four corners. Normal forces follow the
law of the joint's contact (`joints.contact`), tangential ones its friction law at the slip of the surfaces.

In space the pin's axis may shift and tilt in its hole, whose ends lie half its length before and behind its middle. At
each end the pin touches the wall where the centre of the hole's end is farther from the pin's axis than the clearance,
|c| > ρ. The force acts there at right angles to the pin's axis, and at the wall there is friction along the slip of the
surfaces, around the axis and along it. Two such forces carry a force across and a moment, their couple. The pin of a
revolute joint also has shoulders: one of them touches where the pin has come along the hole's axis by half the end
float. A shoulder pushes along that axis, without friction: nothing states on which radius it would act.
"""

from __future__ import annotations

import itertools
from abc import ABC, abstractmethod
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar, NamedTuple, cast

import numpy as np
from numpy.typing import NDArray

from trunnion.algebra import plane
from trunnion.algebra.dual import Dual, derivative, primal, single
from trunnion.algebra.namespace import Number, each, namespace
from trunnion.algebra.space import ORIGIN, Frame, compose, moment_at, slid
from trunnion.algebra.vector import Vector3, cross, dot, length, minus, plus, scaled
from trunnion.joints.contact import elastic_force, hertz_stiffness, normal_force
from trunnion.joints.friction import FRICTION_LAWS, FrictionLaw
from trunnion.solve import shifts
from trunnion.solve.forward import Forward
from trunnion.solve.loads import LoadAction
from trunnion.solve.run import Run
from trunnion.solve.system import law_parameters

Array = NDArray[np.float64]

Vector = tuple[Number, ...]

SLOWEST = 1e-3  # m/s: a slower onset is taken to be as fast as this, else mere pressing would lose any amount
FIRST = 1e-3  # of the clearance: about how deep the first step of a contact goes
CENTRED = 1e-9  # of the clearance: nearer to the middle of its hole a pin lies in no direction


class ContactState(NamedTuple):
    """Gap, m, its rate and the slip of the surfaces, m/s; normal: unit vector on the pin or slider, from where it
    touches to the other body; tangent: along which it slips; place: of the contact, m; offset: of the pin in its hole,
    m, in the hole's axes, of a corner along and across its guide."""

    gap: Number
    rate: Number
    slip: Number
    normal: Vector
    tangent: Vector
    place: Vector
    offset: Vector


class Closed(NamedTuple):
    """A contact of rigid bodies that stays closed: it slips forward (+1), backward (−1) or sticks (0), under a normal
    force and one along the tangent on the pin or slider, N, that are found with the accelerations."""

    sense: int
    normal: Array | float = 0.0
    friction: Array | float = 0.0


Onset = Number | Closed | None  # speed of approach where a contact began, m/s; None: it does not touch


class Push(NamedTuple):
    """Normal force, force of friction along the tangent on the pin or slider, N, stored energy, J, and loss, W."""

    normal: Number
    friction: Number
    stored: Number
    loss: Number


@dataclass(frozen=True)
class Contact(ABC):
    """One place where two bodies of a joint in play may touch.

    joint: of the file; label: its own name; body: the link of the pin or slider; other: the link of the hole or guide;
    stiffness: N/mⁿ; factor: χ of its law; law, parameters: of friction, None without; clearance: m. bored: whether it
    is a pin in a round hole.
    """

    bored: ClassVar[bool] = False
    joint: str
    label: str
    body: str
    other: str
    clearance: float
    stiffness: float
    exponent: float
    factor: float
    restitution: float
    law: FrictionLaw | None
    parameters: Mapping[str, float]

    @abstractmethod
    def state(self, walk: Forward, in_time: bool = False) -> ContactState:
        """Where the surfaces are. in_time: numbers are dual, with their derivatives by time; in the plane alone."""

    def bodies(self, walk: Forward, in_time: bool = False) -> list[tuple[Any, Any]]:
        """Frame and twist of the pin or slider, and of the hole or guide; in_time: see `state`."""
        pairs = []
        for link in (self.body, self.other):
            frame, twist, second = (each(part, primal) for part in walk.motions[link])
            if in_time:
                speeds = *plane.velocity_at(twist, (frame.x, frame.y)), -twist.w * frame.s, twist.w * frame.c
                frame, twist = plane.Frame(*map(Dual, frame, speeds)), plane.Twist(*map(Dual, twist, second))
            pairs.append((frame, twist))
        return pairs

    def accelerations(self, walk: Forward) -> tuple[Array, Array]:
        """Second derivative of the gap, and derivative of the slip, m/s²."""
        state = self.state(walk, in_time=True)
        return derivative(state.rate), derivative(state.slip)

    @property
    def rigid(self) -> bool:
        """Whether it is one of bodies that do not give."""
        return self.stiffness == 0.0

    @property
    def surface(self) -> str:
        """The wall it touches."""
        return self.label

    @property
    def coefficient(self) -> float:
        """f of Coulomb's friction."""
        return self.parameters["pair_factor"] * self.parameters["coefficient"] if self.law else 0.0

    def push(self, state: ContactState, onset: Onset) -> Push:
        """Forces of a contact that began with a speed of approach, m/s; None: it is not touching."""
        if isinstance(onset, Closed):
            force, friction = onset.normal + 0.0 * state.gap, onset.friction + 0.0 * state.gap
            return Push(force, friction, 0.0 * state.gap, -force * state.rate - friction * state.slip)
        if onset is None:
            nothing = 0.0 * state.gap
            return Push(nothing, nothing, nothing, nothing)
        depth, rate = -state.gap, -state.rate
        normal = normal_force(depth, rate, onset, self.stiffness, self.exponent, self.factor)
        elastic = elastic_force(depth, self.stiffness, self.exponent)
        stored = elastic * namespace(depth).maximum(depth, 0.0) / (self.exponent + 1.0)
        friction = 0.0 * normal
        if self.law is not None:
            friction = self.law.function(normal, state.slip, **self.parameters)
        return Push(normal, friction, stored, (normal - elastic) * rate - friction * state.slip)

    def action(self, walk: Forward, state: ContactState, push: Push) -> LoadAction:
        """What the contact does to the two links; its power into them, W."""
        force = tuple(-push.normal * n + push.friction * t for n, t in zip(state.normal, state.tangent, strict=True))
        on: list[tuple[str, Any]] = []
        for link, sign in ((self.body, 1.0), (self.other, -1.0)):
            action_own = tuple(sign * part for part in force)
            on.append((link, walk.algebra.about(action_own, walk.algebra.NO_MOMENT, state.place)))
        return LoadAction(on, push.normal * state.rate + push.friction * state.slip)


@dataclass(frozen=True)
class PinContact(Contact):
    """A pin in a hole. pin, hole: local places of their centres, m; wall: radius of the hole, m."""

    bored = True
    pin: tuple[float, float] = (0.0, 0.0)
    hole: tuple[float, float] = (0.0, 0.0)
    wall: float = 0.0

    def state(self, walk: Forward, in_time: bool = False) -> ContactState:
        """The gap is ρ − |c|."""
        (body, moving), (other, still) = self.bodies(walk, in_time)
        centre = plane.point_of(other, self.hole)
        cx, cy = _minus(plane.point_of(body, self.pin), centre)
        xp = namespace(cx, cy)
        size = xp.hypot(cx, cy)
        off_centre = size > CENTRED * self.clearance
        over = xp.where(off_centre, size, 1.0)
        nx, ny = xp.where(off_centre, cx / over, 1.0), xp.where(off_centre, cy / over, 0.0)
        place = centre[0] + self.wall * nx, centre[1] + self.wall * ny
        vx, vy = _minus(plane.velocity_at(moving, place), plane.velocity_at(still, place))
        offset = other.c * cx + other.s * cy, other.c * cy - other.s * cx
        rate, slip = -(nx * vx + ny * vy), nx * vy - ny * vx
        return ContactState(self.clearance - size, rate, slip, (nx, ny), (-ny, nx), place, offset)


@dataclass(frozen=True)
class EdgeContact(Contact):
    """A corner of a slider and a side of its guide.

    corner: local place on the slider, m; line: a point of the guide's middle, m, and its direction, in the frame of the
    guide's link; side: +1 or −1, the side on which the wall lies; distance: of the wall from the middle, m.
    """

    corner: tuple[float, float] = (0.0, 0.0)
    line: tuple[float, float, float, float] = (0.0, 0.0, 1.0, 0.0)
    side: float = 1.0
    distance: float = 0.0

    @property
    def surface(self) -> str:
        """Of two corners it is one."""
        return f"{self.joint}{self.side:+.0f}"

    def state(self, walk: Forward, in_time: bool = False) -> ContactState:
        """The gap is the distance of the wall less that of the corner, on its side of the middle."""
        (body, moving), (other, still) = self.bodies(walk, in_time)
        corner, (tx, ty) = plane.point_of(body, self.corner), plane.rotated(other, self.line[2:])
        rx, ry = _minus(corner, plane.point_of(other, self.line[:2]))
        vx, vy = _minus(plane.velocity_at(moving, corner), plane.velocity_at(still, corner))
        nx, ny = -self.side * ty, self.side * tx
        away = rx * nx + ry * ny
        nil = 0.0 * away
        return ContactState(
            self.distance - away, -(vx * nx + vy * ny), vx * tx + vy * ty, (nx + nil, ny + nil), (tx + nil, ty + nil),
            corner, (rx * tx + ry * ty, self.side * away),
        )  # fmt: skip


def _minus(a: Any, b: Any) -> Any:
    """The difference of two vectors."""
    return tuple(first - second for first, second in zip(a, b, strict=True))


@dataclass(frozen=True)
class SpatialContact(Contact):
    """A contact of a pin in a hole in space, of bodies that give. axle: the pin's frame on its link, z its axis; hole:
    of the hole, at the middle or an end, on its own link."""

    axle: Frame = ORIGIN
    hole: Frame = ORIGIN


@dataclass(frozen=True)
class DiscContact(SpatialContact):
    """One end of a pin in its hole. wall: radius of the hole, m."""

    bored = True
    wall: float = 0.0

    def state(self, walk: Forward, in_time: bool = False) -> ContactState:
        """The gap is ρ − |c|, c from the centre of the hole's end to the pin's axis at right angles to that."""
        (body, moving), (other, still) = self.bodies(walk)
        pin, end = compose(body, self.axle), compose(other, self.hole)
        apart = minus(pin.place, end.place)
        c = minus(apart, scaled(dot(apart, pin.z), pin.z))
        size = length(c)
        xp = namespace(size)
        off_centre = size > CENTRED * self.clearance
        over = 1 / xp.where(off_centre, size, 1.0)
        upright = cross(end.y, pin.z)  # where it lies in no direction
        share = 1 / length(upright)
        normal = cast("Vector3", tuple(
            xp.where(off_centre, part * over, other * share) for part, other in zip(c, upright, strict=True)
        ))  # fmt: skip
        place = plus(end.place, scaled(self.wall, normal))
        speed = minus(moment_at(moving, place), moment_at(still, place))
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

    def state(self, walk: Forward, in_time: bool = False) -> ContactState:
        """The gap is half the end float less how far the pin has come along the hole's axis, to this side."""
        (body, moving), (other, still) = self.bodies(walk)
        pin, middle = compose(body, self.axle), compose(other, self.hole)
        apart, normal = minus(pin.place, middle.place), scaled(self.side, middle.z)
        speed = minus(moment_at(moving, pin.place), moment_at(still, pin.place))
        nothing = 0.0 * dot(apart, normal)
        offset = tuple(dot(apart, axis) for axis in (middle.x, middle.y, middle.z))
        tangent = tuple(part + nothing for part in middle.x)
        normal = cast("Vector3", tuple(part + nothing for part in normal))
        return ContactState(
            self.clearance - dot(apart, normal), -dot(speed, normal), nothing, normal, tangent, pin.place, offset
        )


def pushes_of(contacts: Sequence[Contact], walk: Forward, onsets: Sequence[Onset]) -> list[tuple[ContactState, Push]]:
    """Where the surfaces of contacts are, and their forces."""
    states = [contact.state(walk) for contact in contacts]
    return [(state, contact.push(state, onset)) for contact, state, onset in zip(contacts, states, onsets, strict=True)]


def actions_of(contacts: Sequence[Contact], walk: Forward, onsets: Sequence[Onset]) -> Iterator[tuple[str, LoadAction]]:
    """What the contacts that touch do to the links, by label."""
    for contact, onset in zip(contacts, onsets, strict=True):
        if onset is not None:
            state = contact.state(walk)
            yield contact.label, contact.action(walk, state, contact.push(state, onset))


def least_clearance(contacts: Sequence[Contact]) -> float:
    """Of some contacts, m."""
    return min((contact.clearance for contact in contacts), default=0.0)


def contacts_of(run: Run, joints: Sequence[str]) -> tuple[Contact, ...]:
    """The contacts of joints in play of a mechanism as it is stated."""
    return tuple(contact for joint in joints for contact in _of_joint(run, joint))


def _of_joint(run: Run, name: str) -> Iterator[Contact]:
    joint_entry, values = run.system.joints[name], run.values
    contact, play = joint_entry.contact, shifts.play_of(run.system.mechanism.space, joint_entry.type, values, name)
    assert contact is not None  # the model's checks
    assert play is not None
    numbers = {key: single(values[path]) for key in ("restitution", "exponent", "stiffness")
             if (path := f"joints.{name}.contact.{key}") in values}  # fmt: skip
    clearance, radius = single(play.radii[0]), single(values.get(f"joints.{name}.pin.radius", 0.0))
    restitution = numbers.get("restitution", 1.0)
    law = FRICTION_LAWS[joint_entry.friction.law or "coulomb"] if joint_entry.friction else None
    stiffness = 0.0 if contact.of.rigid else numbers.get("stiffness", 0.0)
    if not (contact.of.rigid or "stiffness" in numbers):
        keys = ("modulus", "hole_modulus", "poisson_ratio", "hole_poisson_ratio")
        stated = [single(values[f"joints.{name}.contact.{key}"]) for key in keys]
        stiffness = hertz_stiffness(radius, radius + clearance, *stated)
    common: dict[str, Any] = {
        "joint": name, "clearance": clearance, "stiffness": stiffness, "exponent": numbers.get("exponent", 1.0),
        "factor": contact.of.factor(restitution), "restitution": restitution, "law": law,
        "parameters": {key: single(size) for key, size in law_parameters(law, values, name).items()} if law else {},
    }  # fmt: skip
    if run.system.mechanism.space == "spatial":
        yield from _in_space(run, name, play, radius + clearance, common)
    else:
        yield from _in_plane(run, name, radius + clearance, common)


def _in_plane(run: Run, name: str, wall: float, common: dict[str, Any]) -> Iterator[Contact]:
    """A pin, or the four corners of a slider."""
    first, second = run.system.joints[name].links
    values, holes = run.values, run.system.holes(run.values)
    places: list[Any] = [tuple(single(part) for part in holes[link, name]) for link in (first, second)]
    if not run.system.joints[name].pair.guided:
        pin, hole = places[0][:2], places[1][:2]
        yield PinContact(label=name, body=first, other=second, pin=pin, hole=hole, wall=wall, **common)
        return
    length = single(values[f"joints.{name}.guide.length"])
    height = single(values.get(f"joints.{name}.guide.height", 0.0))
    x, y, c, s = places[1]
    for number, (end, side) in enumerate(((-1, 1.0), (1, 1.0), (-1, -1.0), (1, -1.0)), 1):
        along, across = 0.5 * end * length, 0.5 * side * height
        corner = x + along * c - across * s, y + along * s + across * c
        yield EdgeContact(
            label=f"{name}.{number}", body=second, other=first, corner=corner, line=places[0], side=side,
            distance=0.5 * height + common["clearance"], **common,
        )  # fmt: skip


def _in_space(run: Run, name: str, play: shifts.Play, wall: float, common: dict[str, Any]) -> Iterator[Contact]:
    """The two ends of a hole, each with half the stiffness, and of a pin that does not slide its shoulders."""
    first, second = run.system.joints[name].links
    holes = run.system.holes(run.values)
    axle, middle = (
        each(shifts.hole(holes[link, name], run.values, name), single) for link in (first, second)
    )  # the joint's points lie off both alike
    links: dict[str, Any] = {"joint": name, "body": first, "other": second, "axle": axle}
    half = 0.5 * common["stiffness"]
    for number, side in ((1, -0.5), (2, 0.5)):
        end = slid(middle, side * single(play.length))
        entry = {**common, **links, "stiffness": half, "hole": end}
        yield DiscContact(label=f"{name}.end_{number}", wall=wall, **entry)
    for number, (i, side) in enumerate(itertools.product(play.model.axial, (-1.0, 1.0)), 1):
        entry = {**common, **links, "hole": middle, "clearance": single(play.radii[i]), "law": None, "parameters": {}}
        yield ShoulderContact(label=f"{name}.shoulder_{number}", side=side, **entry)

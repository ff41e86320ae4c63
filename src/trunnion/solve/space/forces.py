"""Forces in space, backward through the row of modules: reactions, friction, drive efforts.

The load of a link's own inertia is minus the derivative of its dual momentum [P 20, 21], taken at the mass centre and
carried to the origin: −m a_C and −(J ω̇ + ω × J ω), gyroscopic terms included.
"""

from __future__ import annotations

import functools
import operator
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from trunnion.algebra.dual import primal
from trunnion.algebra.namespace import Number, namespace
from trunnion.algebra.space import ZERO, Frame, Screw, about, added, minus, moment_at, power, rotated, times
from trunnion.algebra.vector import Vector3, cross, dot, plus, scaled, transpose
from trunnion.groups.spatial import SpatialGroup
from trunnion.joints.pairs import Reaction
from trunnion.joints.spatial_load import halves
from trunnion.model.parts import InertiaTensor
from trunnion.solve.backward import Backward, Given, Sense, held, sense_of
from trunnion.solve.friction import Contact, settle
from trunnion.solve.friction_method import FrictionMethod
from trunnion.solve.loads import Share, Slip
from trunnion.solve.space.contacts import Rubbing, at_rest, bearing_middle, contacts, stillness
from trunnion.solve.space.loads import springs, stated_loads
from trunnion.solve.space.motion import SpatialWalk
from trunnion.solve.system import Place, law_of

__all__ = ["SpatialBackward", "backward", "under"]

NULL: Vector3 = (0.0, 0.0, 0.0)


@dataclass
class SpatialBackward(Backward):
    """What one walk backward found in space; wrenches F + ε M are about the origin of the global frame.

    reactions: on the second link by the first, friction and drive effort not included; friction: torque about the axis,
    N m (R, C, H), about the relative angular velocity (S), of both pins together (U), force along the slide, N (P);
    friction_wrenches: what friction does to the second link; losses: power of friction, W; spins: torque that each link
    with a free spin would need to keep from spinning, N m.
    """

    friction_wrenches: dict[str, Screw] = field(default_factory=dict)
    losses: dict[str, Number] = field(default_factory=dict)
    spins: dict[str, Number] = field(default_factory=dict)

    @property
    def space(self) -> SpatialWalk:
        """The walk forward."""
        assert isinstance(self.walk, SpatialWalk)
        return self.walk

    def friction_power(self, joint: str) -> Number:
        """Power lost in a joint, W."""
        return self.lost(joint) if self.travels else self.losses[joint]

    def on_hole(self, joint: str) -> tuple[tuple[Number, ...], tuple[Number, ...]]:
        """Force, N, and moment about its middle, N m, of the pin on the hole of a joint, in the hole's frame."""
        frame, reaction = self.space.hole(joint), self.reactions[joint]
        moment = moment_at(reaction, frame.place)
        axes = frame[:3]
        return tuple(dot(reaction.u, axis) for axis in axes), tuple(dot(moment, axis) for axis in axes)


def backward(walk: SpatialWalk, method: FrictionMethod, given: Given) -> SpatialBackward:
    """Reactions and friction of every module, last module first."""
    system = walk.system
    loads: dict[str, Any] = dict.fromkeys(system.mechanism.effective_links, ZERO)
    back = SpatialBackward(walk, loads, travels=bool(given.travel))
    for name in system.joints:
        back.slips[name] = _slip(walk, name)
    _add_body_loads(back)
    _add_stated_loads(back, given.zero_slip)
    for number in reversed(range(len(system.plan.modules))):
        _settle_module(back, number, method, given)
    return back


def under(walk: SpatialWalk, loads: Mapping[str, Screw]) -> SpatialBackward:
    """Reactions to these loads alone, about the origin, without friction; the drivers hold still."""
    system = walk.space
    none: dict[str, Any] = dict.fromkeys(system.mechanism.effective_links, ZERO)
    back = SpatialBackward(walk, none | dict(loads))
    for number in reversed(range(len(system.plan.modules))):
        module, places, pose = system.plan.modules[number], system.places[number], walk.poses[number]
        wrenches = system.groups[number].reactions(pose, [back.loads[link] for link in module.links])
        for k, (place, wrench) in enumerate(zip(places, wrenches, strict=True)):
            driven = pose.screws[k][0] if place.joint in module.driven else None
            back.reactions[place.joint] = _without_drive(back, place.joint, wrench, driven)
            _pass_on(back, place, wrench)
    return back


# ---- loads ----------------------------------------------------------------------------------------------------


def _add_body_loads(back: SpatialBackward) -> None:
    """Gravity and inertia of every link."""
    walk, values = back.space, back.walk.values
    gravity: Vector3 = (values["gravity.x"], values["gravity.y"], values["gravity.z"])
    for link in walk.system.mechanism.effective_links:
        mass = values[f"links.{link}.mass"]
        tensor = _tensor(walk, link)
        if link == walk.system.mechanism.fixed_link or (tensor is None and isinstance(mass, float | int) and mass == 0):
            continue
        centre = walk.at(link, walk.space.centre(values, link))
        frame, twist, second = walk.motions[link]
        force = scaled(mass, tuple(g - a for g, a in zip(gravity, centre.acceleration, strict=True)))
        moment = NULL if tensor is None else scaled(-1.0, _spin_rate(frame, tensor, twist.u, second.u))
        load = about(force, moment, centre.place)
        back.body_power = back.body_power + power(load, twist)
        back.loads[link] = added(back.loads[link], load)


def _tensor(walk: SpatialWalk, link: str) -> tuple[Vector3, Vector3, Vector3] | None:
    """Inertia of a link about its mass centre in its own axes, kg m²; None if it has none."""
    stated, values = walk.system.mechanism.effective_links[link], walk.values
    path = f"links.{link}.inertia"
    if not isinstance(stated.inertia, InertiaTensor):
        return None
    xx, yy, zz, xy, xz, yz = (values[f"{path}.{key}"] for key in ("xx", "yy", "zz", "xy", "xz", "yz"))
    if stated.inertia_about == "origin":  # Steiner: J_C = J_O − m (c² 1 − c cᵀ)
        mass, (x, y, z) = values[f"links.{link}.mass"], walk.space.centre(values, link)
        xx, yy, zz = xx - mass * (y * y + z * z), yy - mass * (x * x + z * z), zz - mass * (x * x + y * y)
        xy, xz, yz = xy + mass * x * y, xz + mass * x * z, yz + mass * y * z
    return (xx, xy, xz), (xy, yy, yz), (xz, yz, zz)


def _spin_rate(frame: Frame, tensor: tuple[Vector3, Vector3, Vector3], w: Vector3, second: Vector3) -> Vector3:
    """J ω̇ + ω × J ω about the mass centre, global axes.  [P 21]"""
    rows = transpose((frame.x, frame.y, frame.z))
    back = Frame(*rows, NULL)
    local_w, local_second = rotated(back, w), rotated(back, second)

    def times_tensor(v: Vector3) -> Vector3:
        return dot(tensor[0], v), dot(tensor[1], v), dot(tensor[2], v)

    return rotated(frame, plus(times_tensor(local_second), cross(local_w, times_tensor(local_w))))


def _add_stated_loads(back: SpatialBackward, zero_slip: Mapping[str, Sense]) -> None:
    """The loads and springs of the model, with the power each gives the mechanism."""
    walk = back.space
    senses = {joint: sense_of(zero_slip, joint) for joint in zero_slip}
    for name, action in stated_loads(walk, senses):
        back.load_powers[name] = action.power
        back.undefined[f"loads.{name}"] = action.undefined
        for link, wrench in action.on:
            back.loads[link] = added(back.loads[link], wrench)
    for name, action, state in springs(walk) if walk.system.mechanism.springs else ():
        back.springs[name] = state
        back.undefined[f"springs.{name}"] = action.undefined
        for link, wrench in action.on:
            back.loads[link] = added(back.loads[link], wrench)


def _slip(walk: SpatialWalk, joint: str) -> Slip:
    """Slip of a joint, and where a contact of it, or else its turn, is at rest but for rounding."""
    kind = walk.system.joints[joint][0]
    if kind == "fixed":
        return Slip(0.0, False)
    zero = functools.reduce(operator.or_, at_rest(walk, joint)) if _rubs(walk, joint) else _still(walk, joint, kind)
    if kind in ("spherical", "universal", "planar"):
        spin = walk.against(joint).u
        return Slip(np.sqrt(primal(dot(spin, spin))), zero)
    turn, slide = walk.rates(joint)
    return Slip(slide if kind == "prismatic" else turn, zero)


def _still(walk: SpatialWalk, joint: str, kind: str) -> Number:
    """Where a joint without friction does not move as the loads that resist it see it."""
    if kind not in ("revolute", "cylindrical", "helical", "prismatic"):
        return False
    place = 1 if kind == "prismatic" else 0
    return np.abs(primal(walk.rates(joint)[place])) <= stillness(walk, joint)[place]


def _rubs(walk: SpatialWalk, joint: str) -> bool:
    return walk.system.mechanism.effective_joints[joint].friction is not None


# ---- one module -----------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class _Flat:
    """A module whose reactions are flat tuples, as `friction` wants them."""

    group: SpatialGroup

    def reactions(self, pose: Any, loads: Sequence[Screw]) -> list[Reaction]:
        return [(*wrench.u, *wrench.m) for wrench in self.group.reactions(pose, loads)]


def _settle_module(back: SpatialBackward, number: int, method: FrictionMethod, given: Given) -> None:
    walk = back.space
    module, group, places = walk.space.plan.modules[number], walk.space.groups[number], walk.system.places[number]
    pose = walk.poses[number]
    loads = [back.loads[link] for link in module.links]
    found: list[Contact] = []
    rubbing: list[Rubbing] = []
    for k, place in enumerate(places):
        if _rubs(walk, place.joint):
            for i, one in enumerate(contacts(walk, place.joint)):
                rubbing.append(one)
                sense = sense_of(given.zero_slip, place.joint, i)
                found.append(_contact(back, module.links, k, place, one, given, sense))
                if one.turning is not None:
                    back.turning[place.joint] = found[-1], one.turning
    settled = settle(_Flat(group), pose, loads, found, method)
    back.settled.append(settled)
    for (link, _, _), torque in zip(module.spinning, group.spin_torques(pose, loads), strict=True):
        back.spins[link] = torque
    for k, place in enumerate(places):
        friction, own = ZERO, ZERO
        loss: Number = 0.0
        for contact, one, force in zip(found, rubbing, settled.forces, strict=True):
            if contact.joint == k:
                part = times(force, one.unit)
                friction, loss = added(friction, part), loss - force * contact.slip
                own = added(own, part) if contact.own is not None else own
        wrench = minus(Screw(*halves(settled.reactions[k])), own)
        driven = module.driven.index(place.joint) if place.joint in module.driven else None
        _record(back, place, wrench, friction, loss, None if driven is None else pose.screws[k][0])


def _contact(
    back: SpatialBackward,
    links: tuple[str, ...],
    k: int,
    place: Place,
    one: Rubbing,
    given: Given,
    sense: Share,
) -> Contact:
    """One contact of a joint as `friction` sees it; sense: share of its friction where it rests, signed."""
    walk = back.space
    law = law_of(walk.system, place.joint)
    parameters = {name: walk.values[f"joints.{place.joint}.friction.{name}"] for name in law.parameters}
    law, parameters, speed = held(law, parameters, one.slip, one.zero, sense)
    if place.joint in given.deflections:
        parameters["deflection"] = given.deflections[place.joint]
    first, second = place.links
    units = [one.unit if link == second else times(-1.0, one.unit) if link == first else ZERO for link in links]
    own = (*one.unit.u, *one.unit.m) if one.felt else None
    return Contact(k, units, one.load, law, parameters, speed, own=own)


def _record(
    back: SpatialBackward, place: Place, wrench: Screw, friction: Screw, loss: Number, driven: Screw | None
) -> None:
    """Keep a joint's reaction, friction and drive effort; load its known link with all three."""
    joint = place.joint
    back.reactions[joint] = _without_drive(back, joint, wrench, driven)
    back.friction_wrenches[joint], back.losses[joint] = friction, loss
    back.friction[joint] = _scalar(back, joint, friction, loss)
    whole = added(wrench, friction)
    if back.travels:
        back.passed[joint] = power(whole, back.space.against(joint))
    _pass_on(back, place, whole)


def _without_drive(back: SpatialBackward, joint: str, wrench: Screw, driven: Screw | None) -> Screw:
    """The wrench of a joint less the drive effort, which is kept; driven: the screw of the freedom, None if none is."""
    if driven is None:
        return wrench
    walk, effort = back.space, power(wrench, driven)
    back.efforts[joint] = effort
    axis = walk.element(walk.system.joints[joint][1][1], joint).z
    drive = Screw(NULL, axis) if walk.system.turns(joint) else about(axis, NULL, _place_of(walk, joint))
    return minus(wrench, times(effort, drive))


def _pass_on(back: SpatialBackward, place: Place, whole: Screw) -> None:
    """Load the known link of a joint with all that it does."""
    for i, (link, outer) in enumerate(zip(place.links, place.outer, strict=True)):
        if outer and link != back.walk.system.mechanism.fixed_link:
            back.loads[link] = added(back.loads[link], whole if i == 1 else times(-1.0, whole))


def _place_of(walk: SpatialWalk, joint: str) -> Vector3:
    return walk.element(walk.system.joints[joint][1][1], joint).place


def _scalar(back: SpatialBackward, joint: str, friction: Screw, loss: Number) -> Number:
    """The friction of a joint as one number: about or along its axis; of balls and crosses −loss/|ω|."""
    walk, kind = back.space, back.walk.system.joints[joint][0]
    axis = walk.element(walk.system.joints[joint][1][1], joint).z
    if kind == "prismatic":
        return dot(friction.u, axis)
    if kind in ("spherical", "universal"):
        speed = back.slips[joint].speed
        moves = speed > 0
        return namespace(loss).where(moves, -loss / np.where(moves, speed, 1.0), 0.0)
    return dot(moment_at(friction, bearing_middle(walk, joint)), axis)

"""Forces, backward through the row of modules: reactions, friction, drive efforts, and the power balance."""

from __future__ import annotations

import functools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, NamedTuple

import numpy as np

from trunnion.algebra.dual import primal
from trunnion.algebra.namespace import Number, namespace
from trunnion.algebra.plane import ZERO_LOAD, Wrench, about, added, moved
from trunnion.groups.gear import Action as GearAction
from trunnion.groups.gear import Gear, Mesh, actions, apart, mesh
from trunnion.groups.general import General
from trunnion.groups.protocol import Group
from trunnion.joints.friction import FrictionLaw, LawFunction
from trunnion.joints.pairs import Load
from trunnion.solve.forward import Assembly, Forward, Travel, forward
from trunnion.solve.friction import Contact, Settled, settle
from trunnion.solve.friction_method import FrictionMethod
from trunnion.solve.loads import Action, Share, Slip, SpringState, springs, stated_loads
from trunnion.solve.system import Place, System, Values, law_of

__all__ = ["Backward", "Given", "Sense", "backward", "held", "sense_of", "slip_of", "solve", "under"]

ZERO_SLIP = 1e-10  # of the speeds about the joint: below it the sign of a relative speed is rounding noise


Sense = Share | tuple[Share, ...]


@dataclass(frozen=True)
class Given:
    """What the joints bring along beside their motion, by joint.

    zero_slip: share of what resists the joint to take where the relative speed is zero, with the sign of the slip that
    is about to begin, from −1 to 1; one for each contact of the joint or one for all; 0 if not stated. deflections: of
    the bristles of laws that have them, m, in the sense of the slip; that of steady sliding if not stated. travel: how
    links also move since the seats among the values (`seats.JOINT.1.x` …) change along the way.
    """

    zero_slip: Mapping[str, Sense] = field(default_factory=dict)
    deflections: Mapping[str, Number] = field(default_factory=dict)
    travel: Mapping[str, Travel] = field(default_factory=dict)


def sense_of(zero_slip: Mapping[str, Sense], joint: str, contact: int = 0) -> Share:
    """The share to take for one contact of a joint, with its sign."""
    sense = zero_slip.get(joint, 0.0)
    return sense[contact] if isinstance(sense, tuple) else sense


def held(
    law: FrictionLaw, parameters: dict[str, Number], speed: Number, zero: Number, sense: Share
) -> tuple[FrictionLaw, dict[str, Number], Number]:
    """Law, parameters and slip speed of a contact, of whose friction a share acts where it rests."""
    if not np.any(zero):
        return law, parameters, speed
    forced = np.sign(sense) * np.maximum(np.abs(primal(speed)), 1e-300)
    speed = namespace(speed).where(zero, forced, speed)
    if law.interval_at_rest and np.any(np.abs(sense) < 1.0) and np.any(sense):
        share = np.where(zero, np.abs(sense), 1.0)
        return replace(law, function=functools.partial(_shared, law.function)), {**parameters, "share": share}, speed
    return law, parameters, speed


def _shared(function: LawFunction, normal: Number, slip: Number, *, share: Number, **parameters: Number) -> Number:
    """A share of what the law says."""
    return share * function(normal, slip, **parameters)


class GearLoad(NamedTuple):
    """What a gear pair does: torque in its second joint, on the second link, N m; tooth force on the second gear, N."""

    torque: Number
    force: tuple[Number, Number]


@dataclass
class Backward:
    """What one walk backward found, by joint and driver as the file names them.

    reactions: on the second link by the first, about the joint's point on the second, friction and drive effort
    not included; friction: torque (N m) or force along the slide (N) on the second link; settled: per module;
    undefined: where each load or spring (by path) has no value; turning: of joints that rub and turn, the contact and
    the share of its friction that acts about the axis; travels: whether seats do, so that a joint also loses what its
    load does on the way of its pin; passed: power that each joint passes on to its links in all;
    gear_power: of all gear pairs, whose wheels then move apart.
    """

    walk: Forward
    loads: dict[str, Any]
    slips: dict[str, Slip] = field(default_factory=dict)
    reactions: dict[str, Any] = field(default_factory=dict)
    friction: dict[str, Number] = field(default_factory=dict)
    efforts: dict[str, Number] = field(default_factory=dict)
    settled: list[Settled] = field(default_factory=list)
    load_powers: dict[str, Number] = field(default_factory=dict)
    body_power: Number = 0.0
    springs: dict[str, SpringState] = field(default_factory=dict)
    gears: dict[str, GearLoad] = field(default_factory=dict)
    undefined: dict[str, Number] = field(default_factory=dict)
    turning: dict[str, tuple[Contact, Number]] = field(default_factory=dict)
    travels: bool = False
    passed: dict[str, Number] = field(default_factory=dict)
    gear_power: Number = 0.0

    def friction_power(self, joint: str) -> Number:
        """Power lost in a joint, W."""
        if self.travels:
            return self.lost(joint)
        return -(self.friction[joint] * self.slips[joint].speed)

    def lost(self, joint: str) -> Number:
        """What a joint takes out and its driver does not put in, W: friction, and the load on its seat's way."""
        driven = self.efforts[joint] * self.walk.rate(joint) if joint in self.efforts else 0.0
        return driven - self.passed[joint]

    def on_hole(self, joint: str) -> tuple[tuple[Number, ...], tuple[Number, ...]]:
        """Force, N, and moment about its middle, N m, of the pin on the hole of a joint, in the hole's frame."""
        hole = self.walk.hole(joint)
        at = self.walk.element(self.walk.system.joints[joint][1][1], joint)
        x, y, moment = about(self.reactions[joint], hole.x - at.x, hole.y - at.y)
        return (x * hole.c + y * hole.s, y * hole.c - x * hole.s), (moment,)


def solve(
    system: System,
    values: Values,
    assembly: Assembly,
    time: Number,
    method: FrictionMethod | None = None,
    given: Given | None = None,
) -> Backward:
    """Motion and forces at the given times (s): one walk forward, one back.

    values: every number by path; floats, arrays (sample, 1) or dual numbers. time: (position,).
    given: what is known of the joints beside the motion.
    """
    given = given or Given()
    walk = forward(system, values, assembly, time, given.travel)
    with np.errstate(all="ignore"):
        found: Backward = system.geometry.backward(walk, method or FrictionMethod(), given)
    return found


def backward(walk: Forward, method: FrictionMethod, given: Given) -> Backward:
    """Reactions and friction of every module, last module first."""
    system = walk.system
    back = Backward(walk, dict.fromkeys(system.mechanism.links, ZERO_LOAD), travels=bool(given.travel))
    for name in system.joints:
        back.slips[name] = slip_of(walk, name)
    _add_body_loads(back)
    _add_stated_loads(back, given.zero_slip)
    for number in reversed(range(len(system.plan.modules))):
        _settle_module(back, number, method, given)
    return back


def under(walk: Forward, loads: Mapping[str, Wrench]) -> Backward:
    """Reactions to these loads alone, each about the origin of its link, without friction; the drivers hold still.

    They are what moves with the play of joints, so gear pairs pass torques alone: their ratio holds between rotations,
    which no offset of a pin changes.
    """
    system = walk.system
    back = Backward(walk, dict.fromkeys(system.mechanism.links, ZERO_LOAD) | dict(loads))
    for number in reversed(range(len(system.plan.modules))):
        module, places, group = system.plan.modules[number], system.places[number], system.groups[number]
        pose, gears = walk.poses[number], tuple(gear._replace(carriers=None) for gear in _gears(group))
        if isinstance(group, General):
            group = replace(group, gears=gears)
        reactions = group.reactions(pose, [back.loads[link] for link in module.links])
        for k, place in enumerate(places):
            if not place.witness:
                _record(back, place, Wrench(*reactions[k]), 0.0, driven=place.joint in module.driven)
        for i, gear in enumerate(gears):
            torque = Wrench(*reactions[len(places) + i]).m
            _push(back, number, actions(gear, pose.elements, pose.ratios[i], torque))
    return back


# ---- loads ----------------------------------------------------------------------------------------------------


def _add_body_loads(back: Backward) -> None:
    """Gravity and inertia of every link: d'Alembert, −m a at the mass centre and −J α.  [D 2-5]"""
    walk, values = back.walk, back.walk.values
    gx, gy = values["gravity.x"], values["gravity.y"]
    for link, body in walk.system.mechanism.links.items():
        if link == walk.system.mechanism.fixed_link:
            continue
        mass, inertia = values[f"links.{link}.mass"], values[f"links.{link}.inertia"]
        if _absent(mass) and _absent(inertia):
            continue
        local = walk.system.centre(values, link)
        if body.inertia_about == "origin":
            inertia = inertia - mass * (local[0] * local[0] + local[1] * local[1])
        centre = walk.local_point(link, *local)
        motion = walk.motions[link]
        force = (mass * (gx - centre.acceleration[0]), mass * (gy - centre.acceleration[1]))
        moment = -inertia * motion.acceleration.w
        back.body_power = back.body_power + (
            force[0] * centre.velocity[0] + force[1] * centre.velocity[1] + moment * motion.twist.w
        )
        _add(back, link, Wrench(*force, moment), centre.place)


def _add_stated_loads(back: Backward, zero_slip: Mapping[str, Sense]) -> None:
    """The loads and springs of the model, with the power each gives the mechanism."""
    mechanism = back.walk.system.mechanism
    senses = {joint: sense_of(zero_slip, joint) for joint in zero_slip}
    for name, action in stated_loads(back.walk, back.slips, senses):
        back.load_powers[name] = action.power
        _act(back, f"loads.{name}", action)
    for name, action, state in springs(back.walk, back.slips) if mechanism.springs else ():
        back.springs[name] = state
        _act(back, f"springs.{name}", action)


def _act(back: Backward, path: str, action: Action) -> None:
    back.undefined[path] = action.undefined
    for link, wrench, at in action.on:
        _add(back, link, wrench, at)


def _add(back: Backward, link: str, load: Wrench, at: tuple[Number, Number] | None) -> None:
    """Add a load, about the place `at` (global, m), to a link's total about its origin."""
    frame, total = back.walk.motions[link].frame, back.loads[link]
    x, y, m = load if at is None else about(load, frame.x - at[0], frame.y - at[1])
    back.loads[link] = Wrench(total.x + x, total.y + y, total.m + m)


def _absent(number: Number) -> bool:
    return isinstance(number, (int, float)) and number == 0


# ---- one module -----------------------------------------------------------------------------------------------


def slip_of(walk: Forward, joint: str) -> Slip:
    """Relative speed along the freedom of a joint, and whether it is zero but for rounding."""
    kind, (first, second) = walk.system.joints[joint]
    w1, w2 = walk.motions[first].twist.w, walk.motions[second].twist.w
    if kind == "revolute":
        speed = w2 - w1
        return Slip(speed, np.abs(primal(speed)) <= ZERO_SLIP * (np.abs(primal(w1)) + np.abs(primal(w2)) + walk.pace))
    one, two = walk.element(first, joint), walk.element(second, joint)
    v1, v2 = walk.twist(first, joint), walk.twist(second, joint)
    dx, dy = two.x - one.x, two.y - one.y
    speed = one.c * (v2.x - v1.x + w1 * dy) + one.s * (v2.y - v1.y - w1 * dx)
    scale = walk.pace * walk.extent + np.hypot(primal(v2.x), primal(v2.y))
    return Slip(speed, np.abs(primal(speed)) <= ZERO_SLIP * scale)


def _settle_module(back: Backward, number: int, method: FrictionMethod, given: Given) -> None:
    walk, system = back.walk, back.walk.system
    module, group, places = system.plan.modules[number], system.groups[number], system.places[number]
    loads = [back.loads[link] for link in module.links]
    contacts, levers = [], {}
    for k, place in enumerate(places):
        if system.mechanism.effective_joints[place.joint].friction is not None and not place.witness:
            contact, levers[k] = _contact(back, module.links, k, place, given)
            contacts.append(contact)
            if place.kind == "revolute":
                back.turning[place.joint] = contact, 1.0
    contacts += [_teeth(back, number, i) for i, gear in enumerate(_gears(group)) if gear.carriers]
    settled = settle(group, walk.poses[number], loads, contacts, method)
    back.settled.append(settled)
    forces = {contact.joint: force for contact, force in zip(contacts, settled.forces, strict=True)}
    for k, place in enumerate(places):
        if not place.witness:
            friction = forces[k] * levers[k] if k in forces else 0.0
            _record(back, place, Wrench(*settled.reactions[k]), friction, driven=place.joint in module.driven)
    for i, name in enumerate(module.gears):
        k = len(places) + i
        _record_gear(back, number, i, name, Wrench(*settled.reactions[k]).m, forces.get(k, 0.0))


def _contact(back: Backward, links: tuple[str, ...], k: int, place: Place, given: Given) -> tuple[Contact, Number]:
    """A joint with friction as its module sees it, and its lever arm (radius of a pin, 1 of a slide)."""
    walk, values = back.walk, back.walk.values
    law = law_of(walk.system, place.joint)
    parameters = {name: values[f"joints.{place.joint}.friction.{name}"] for name in law.parameters}
    slip = back.slips[place.joint]
    sign = -1.0 if place.reversed_ else 1.0
    if place.kind == "revolute":
        lever = values[f"joints.{place.joint}.pin.radius"]
        load = Load()
        units = [_signed(link, place.links, Wrench(0.0, 0.0, lever)) for link in links]
    else:
        lever = 1.0
        axis = walk.element(place.links[0], place.joint)
        at = walk.element(place.links[1], place.joint)
        # the guide has its middle at the point of the link that the file names second
        middle = walk.element(walk.system.joints[place.joint][1][1], place.joint)
        arm = (middle.x - at.x, middle.y - at.y) if place.reversed_ else None
        load = Load((-axis.s, axis.c), values[f"joints.{place.joint}.guide.length"], arm)
        units = []
        for link in links:
            frame = walk.motions[link].frame
            push = about(Wrench(axis.c, axis.s, 0.0), frame.x - at.x, frame.y - at.y)
            units.append(_signed(link, place.links, push))
    law, parameters, speed = held(law, parameters, slip.speed, slip.zero, sense_of(given.zero_slip, place.joint))
    speed = sign * lever * speed
    if place.joint in given.deflections:
        parameters["deflection"] = sign * given.deflections[place.joint]
    return Contact(k, units, load, law, parameters, speed), sign * lever


def _signed(link: str, sides: tuple[str, str], load: Wrench) -> Wrench:
    """The load on the second side, its opposite on the first, nothing on other links."""
    if link == sides[1]:
        return load
    return Wrench(*(-n for n in load)) if link == sides[0] else ZERO_LOAD


def _record(back: Backward, place: Place, reaction: Wrench, friction: Number, driven: bool) -> None:
    """Keep a joint's reaction, friction and drive effort in the file's sense; load its outer link with all three."""
    walk = back.walk
    first, second = (place.links[1], place.links[0]) if place.reversed_ else place.links
    if place.reversed_:
        reaction = Wrench(*(-n for n in reaction))
        if place.kind != "revolute":  # the module's second point is the file's first: carry the moment over
            here, there = walk.element(first, place.joint), walk.element(second, place.joint)
            reaction = about(reaction, there.x - here.x, there.y - here.y)
    at = walk.element(second, place.joint)
    if place.kind == "revolute":
        whole = Wrench(reaction.x, reaction.y, reaction.m + friction)
        effort, bare = reaction.m, Wrench(reaction.x, reaction.y, 0.0)
    else:
        axis = walk.element(first, place.joint)
        whole = Wrench(reaction.x + friction * axis.c, reaction.y + friction * axis.s, reaction.m)
        effort = reaction.x * axis.c + reaction.y * axis.s
        bare = Wrench(reaction.x - effort * axis.c, reaction.y - effort * axis.s, reaction.m)
    back.reactions[place.joint] = bare
    back.friction[place.joint] = friction
    if back.travels:
        back.passed[place.joint] = _passed(walk, place.joint, first, second, whole)
    if driven:
        back.efforts[place.joint] = effort
    for link, outer in zip(place.links, place.outer, strict=True):
        if outer and link != walk.system.mechanism.fixed_link:
            sign = 1.0 if link == second else -1.0
            _add(back, link, Wrench(*(sign * n for n in whole)), (at.x, at.y))


def _passed(walk: Forward, joint: str, first: str, second: str, whole: Wrench) -> Number:
    """Power of all that a joint does to its second link and, reversed, to its first, W."""
    at, frame = walk.element(second, joint), walk.motions[first].frame
    one, two = moved(walk.motions[first].twist, at.x - frame.x, at.y - frame.y), walk.twist(second, joint)
    return whole.x * (two.x - one.x) + whole.y * (two.y - one.y) + whole.m * (two.w - one.w)


# ---- gear pairs -----------------------------------------------------------------------------------------------


def _gears(group: Group) -> tuple[Gear, ...]:
    return group.gears if isinstance(group, General) else ()


def _mesh(back: Backward, number: int, i: int) -> tuple[Gear, Mesh]:
    """A gear pair of a module and where its gears touch."""
    pose = back.walk.poses[number]
    gear = _gears(back.walk.system.groups[number])[i]
    return gear, mesh(gear, (pose.elements[gear.first], pose.elements[gear.second]), pose.ratios[i])


def _teeth(back: Backward, number: int, i: int) -> Contact:
    """The force with which inclined flanks push two gears apart: tan α times the tooth force."""
    walk = back.walk
    module, places = walk.system.plan.modules[number], walk.system.places[number]
    gear, touch = _mesh(back, number, i)
    units = dict.fromkeys(module.links, ZERO_LOAD)
    for joint, side, wrench, at in apart(gear, touch, 1.0):
        link = places[joint].links[side]
        if link in units:
            frame = walk.motions[link].frame
            units[link] = added(units[link], about(wrench, frame.x - at.x, frame.y - at.y), 1.0)
    angle = walk.values[f"gears.{module.gears[i]}.pressure_angle"]
    # a guide of length 2/|f/λ| under the moment λ alone presses with |f|
    load = Load((1.0, 0.0), 2 / namespace(touch.factor).abs(touch.factor))
    slope = namespace(angle).sin(angle) / namespace(angle).cos(angle)
    return Contact(len(places) + i, list(units.values()), load, SEPARATION, {"slope": slope}, 0.0, rubs=False)


def _separation(normal: Number, slip: Number, **parameters: Number) -> Number:
    return parameters["slope"] * normal


SEPARATION = FrictionLaw(_separation)


def _record_gear(back: Backward, number: int, i: int, name: str, torque: Number, separation: Number) -> None:
    """Keep what a gear pair does, and load the known links with it."""
    walk = back.walk
    pose = walk.poses[number]
    gear = _gears(walk.system.groups[number])[i]
    done = actions(gear, pose.elements, pose.ratios[i], torque)
    force: tuple[Number, Number] = (0.0, 0.0)
    if gear.carriers:
        pushes = apart(gear, _mesh(back, number, i)[1], separation)
        force = done[0].wrench.x + pushes[0].wrench.x, done[0].wrench.y + pushes[0].wrench.y
        done += pushes
    if name in walk.system.turned_round:  # found in the joint and on the gear that the file names first
        back.gears[name] = GearLoad(-torque * pose.ratios[i], (-force[0], -force[1]))
    else:
        back.gears[name] = GearLoad(torque, force)
    if back.travels:
        back.gear_power = back.gear_power + _power_of(back, number, done)
    _push(back, number, done)


def _power_of(back: Backward, number: int, done: Sequence[GearAction]) -> Number:
    """Power of a gear pair on the way of its wheels' centres, W; without travel of their pins there is none."""
    walk, power = back.walk, 0.0
    for joint, side, wrench, at in done:
        frame, twist, _ = walk.motions[walk.system.places[number][joint].links[side]]
        v = moved(twist, at.x - frame.x, at.y - frame.y)
        power = power + wrench.x * v.x + wrench.y * v.y + wrench.m * v.w
    return power


def _push(back: Backward, number: int, done: Sequence[GearAction]) -> None:
    """Load the known links of a module with what a gear pair does."""
    system = back.walk.system
    for joint, side, wrench, at in done:
        place = system.places[number][joint]
        if place.outer[side] and place.links[side] != system.mechanism.fixed_link:
            _add(back, place.links[side], wrench, (at.x, at.y))

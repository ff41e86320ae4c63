"""Forces, backward through the row of modules: reactions, friction, drive efforts, and the power balance."""

from __future__ import annotations

import functools
import operator
from collections.abc import Callable, Container, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, cast

import numpy as np

from trunnion.algebra import literal
from trunnion.algebra.dual import primal
from trunnion.algebra.namespace import Number, namespace
from trunnion.algebra.nested import flat
from trunnion.groups.spatial import SpatialGroup
from trunnion.solve.contacts import contacts_of
from trunnion.solve.forward import Assembly, Forward, Travel, forward
from trunnion.solve.friction import Contact, Settled, settle
from trunnion.solve.friction_method import FrictionMethod
from trunnion.solve.friction_problem import Rubbing
from trunnion.solve.gears import GearLoad, acting, gear_load, gears_of, power_of, teeth
from trunnion.solve.loads import LoadAction, Share, SpringState, losses, springs, stated_loads
from trunnion.solve.system import Place, System, Values, law_of, rubbing

__all__ = [
    "Backward",
    "Given",
    "Sense",
    "Slip",
    "backward",
    "body_loads",
    "pass_on",
    "sense_of",
    "solve",
    "stated_actions",
    "under",
    "unloaded",
]


Sense = Share | tuple[Share, ...]


@dataclass(frozen=True)
class Given:
    """What the joints bring along beside their motion, by joint.

    zero_slip: share of what resists the joint to take where the relative speed is zero, with the sign of the slip that
    is about to begin, from −1 to 1; one for each contact of the joint or one for all; 0 if not stated. deflections: of
    the bristles of laws that have them, m, in the sense of the slip; that of steady sliding if not stated. travel: how
    links also move since the seats among the values (`seats.JOINT.1.x` …) change along the way. acting: what acts on
    the links of a walk beside the loads and springs of the model, by name. sliding: whether what has no speed has begun
    to slide, so that no law takes its value at rest. rests: of joints of which it is known whatever their speed says
    whether they rest, under the share that zero_slip states, or slide in its sense.
    """

    zero_slip: Mapping[str, Sense] = field(default_factory=dict)
    deflections: Mapping[str, Number] = field(default_factory=dict)
    travel: Mapping[str, Travel] = field(default_factory=dict)
    acting: Callable[[Forward], Iterable[tuple[str, LoadAction]]] | None = None
    sliding: bool = False
    rests: Mapping[str, bool] = field(default_factory=dict)


def sense_of(zero_slip: Mapping[str, Sense], joint: str, contact: int = 0) -> Share:
    """The share to take for one contact of a joint, with its sign."""
    sense = zero_slip.get(joint, 0.0)
    return sense[contact] if isinstance(sense, tuple) else sense


@dataclass(frozen=True)
class Slip:
    """Relative speed of a joint, second link against first (rad/s, m/s), and where what resists it sees it at rest."""

    speed: Number
    zero: Number


@dataclass
class Backward:
    """What one walk backward found, by joint and driver as the file names them.

    loads: on each link, the wrenches of joints passed so far included; reactions: on the second link by the first,
    friction and drive effort not included, in the plane about the joint's point on the second, in space about the
    origin; friction: torque about the axis, N m, of a ball or a cross about the relative angular velocity, or force
    along the slide, N, on the second link; friction_wrenches: all that friction does to it, about what the reaction is;
    losses: power of friction, W; drags: effort and power, W, of losses that do not follow the load, which are part of
    both; contacts: those of each joint that rubs; settled: per module; undefined: where each
    load or spring (by path) has no value; turning: of joints that rub and turn, the contact and the share of its
    friction that acts about the axis; spins: torque that each link with a free spin would need to keep from spinning,
    N m; travels: whether seats do, so that a joint also loses what its load does on the way of its pin; passed: power
    that each joint passes on to its links in all; gear_power: of all gear pairs, whose wheels then move apart;
    module_reactions: reactions as their modules see them, of `under` alone. stated: loads before any joint was passed;
    rubbed: contacts per module as `settled`, those of gear pairs last; margin_up_to: as in the method; margin: that of
    `locking_margin`, once it was asked for.
    """

    walk: Forward
    loads: dict[str, Any]
    slips: dict[str, Slip] = field(default_factory=dict)
    contacts: dict[str, list[Rubbing]] = field(default_factory=dict)
    reactions: dict[str, Any] = field(default_factory=dict)
    friction: dict[str, Number] = field(default_factory=dict)
    friction_wrenches: dict[str, Any] = field(default_factory=dict)
    losses: dict[str, Number] = field(default_factory=dict)
    drags: dict[str, tuple[Number, Number]] = field(default_factory=dict)
    efforts: dict[str, Number] = field(default_factory=dict)
    settled: list[Settled] = field(default_factory=list)
    load_powers: dict[str, Number] = field(default_factory=dict)
    body_power: Number = 0.0
    springs: dict[str, SpringState] = field(default_factory=dict)
    gears: dict[str, GearLoad] = field(default_factory=dict)
    undefined: dict[str, Number] = field(default_factory=dict)
    turning: dict[str, tuple[Contact, Number]] = field(default_factory=dict)
    spins: dict[str, Number] = field(default_factory=dict)
    travels: bool = False
    passed: dict[str, Number] = field(default_factory=dict)
    gear_power: Number = 0.0
    module_reactions: dict[str, Any] = field(default_factory=dict)
    stated: dict[str, Any] = field(default_factory=dict)
    rubbed: list[list[tuple[Contact, Rubbing | None]]] = field(default_factory=list)
    margin_up_to: float = 0.0
    margin: Number | None = None

    def friction_power(self, joint: str) -> Number:
        """Power lost in a joint, W."""
        return self.lost(joint) if self.travels else self.losses[joint]

    def lost(self, joint: str) -> Number:
        """What a joint takes out and its driver does not put in, W: friction, and the load on its seat's way."""
        driven = self.efforts[joint] * self.walk.rate(joint) if joint in self.efforts else 0.0
        dragged = self.drags[joint][1] if joint in self.drags else 0.0
        return driven - self.passed[joint] + dragged

    def on_hole(self, joint: str) -> tuple[tuple[Number, ...], tuple[Number, ...]]:
        """Force, N, and moment about its middle, N m, of the pin on the hole of a joint, in the hole's frame."""
        return self.walk.in_hole(joint, self.reactions[joint])

    def add(self, link: str, load: Any) -> None:
        """Add a load to those of a link; the ground bears any."""
        if link != self.walk.system.mechanism.fixed_link:
            self.loads[link] = self.walk.algebra.added(self.loads[link], load)

    def act(self, action: LoadAction, path: str = "") -> None:
        """Add what a load or spring does to the links; one with a path may have no value."""
        if path:
            self.undefined[path] = action.undefined
        for link, wrench in action.on:
            self.add(link, wrench)


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
        return backward(walk, method or FrictionMethod(), given)


def backward(walk: Forward, method: FrictionMethod, given: Given) -> Backward:
    """Reactions and friction of every module, last module first."""
    system = walk.system
    back = Backward(walk, unloaded(walk), travels=bool(given.travel), margin_up_to=method.margin_up_to)
    back.contacts = {joint: list(contacts_of(walk, joint)) for joint in rubbing(system)}
    back.slips = {joint: _slip(back, joint) for joint in system.joints}
    _add_body_loads(back)
    _add_stated_loads(back, given.zero_slip, given.rests)
    for name, action in given.acting(walk) if given.acting else ():
        back.load_powers[name] = action.power
        back.act(action, name)
    back.stated = dict(back.loads)
    for number in reversed(range(len(system.plan.modules))):
        _settle_module(back, number, method, given)
    return back


def under(walk: Forward, loads: Mapping[str, Any]) -> Backward:
    """Reactions to these loads alone, each about what those of its link are, without friction; the drivers hold still.

    They are what moves with the play of joints, so gear pairs pass torques alone.
    """
    system = walk.system
    back = Backward(walk, unloaded(walk) | dict(loads))
    for number in reversed(range(len(system.plan.modules))):
        module, places, group = system.plan.modules[number], system.places[number], system.groups[number]
        if gears := gears_of(group):
            group = replace(group, gears=tuple(gear._replace(carriers=None) for gear in gears))
        reactions = walk.reacting(group).reactions(walk.poses[number], [back.loads[link] for link in module.links])
        _pass_joints(back, number, reactions, [])
        back.module_reactions.update(
            (place.joint, reaction) for place, reaction in zip(places, reactions, strict=False) if not place.witness
        )
        for i, (*_, torque) in enumerate(reactions[len(places) :]):  # those of gear pairs
            _push(back, number, acting(walk, number, i, torque, parting=False))
    return back


def body_loads(walk: Forward) -> dict[str, Any]:
    """Gravity and inertia of every link."""
    back = Backward(walk, unloaded(walk))
    _add_body_loads(back)
    return back.loads


def stated_actions(walk: Forward, zero_slip: Mapping[str, Sense]) -> tuple[dict[str, Any], Number, Number]:
    """What the stated loads and springs do to every link, and the power of both, W. zero_slip: see `Given`."""
    back = Backward(walk, unloaded(walk))
    _add_stated_loads(back, zero_slip, ())
    powers = sum(back.load_powers.values(), 0.0), sum((state.power for state in back.springs.values()), 0.0)
    return back.loads, *powers


def unloaded(walk: Forward) -> dict[str, Any]:
    return dict.fromkeys(walk.system.mechanism.effective_links, walk.algebra.ZERO_LOAD)


def _slip(back: Backward, joint: str) -> Slip:
    """Slip of a joint, and where a contact of it rests, or the turn or slide that a load resists."""
    walk = back.walk
    if not walk.pair(joint).count:
        return Slip(0.0, False)
    zeros = [rub.zero for rub in back.contacts.get(joint, [])]
    zeros += [walk.still(joint, turns) for turns in walk.system.resisted.get(joint, ())]
    return Slip(walk.speed(joint), functools.reduce(operator.or_, zeros) if zeros else False)


# ---- loads ----------------------------------------------------------------------------------------------------


def _add_body_loads(back: Backward) -> None:
    """Gravity and inertia of every link: d'Alembert, −m a at the mass centre and the moment of its spin.  [D 2-5]"""
    walk, system, algebra = back.walk, back.walk.system, back.walk.algebra
    gravity = system.vector(walk.values, "gravity")
    for link in system.mechanism.effective_links:
        if link == system.mechanism.fixed_link:
            continue
        mass, moment = walk.values[f"links.{link}.mass"], walk.inertia_moment(link)
        if moment is None and literal.is_zero(mass):
            continue
        centre, twist = walk.at(link, system.centre(walk.values, link)), walk.motions[link].twist
        force = tuple(literal.times(mass, g - a) for g, a in zip(gravity, centre.acceleration, strict=True))
        load = algebra.about(force, algebra.NO_MOMENT if moment is None else moment, centre.place)
        back.body_power = back.body_power + algebra.power(load, twist)
        back.add(link, load)


def _add_stated_loads(back: Backward, zero_slip: Mapping[str, Sense], sensed: Container[str]) -> None:
    """The loads and springs of the model, with the power each gives the mechanism."""
    senses = {joint: sense_of(zero_slip, joint) for joint in zero_slip}
    for name, action in stated_loads(back.walk, senses, sensed):
        back.load_powers[name] = action.power
        back.act(action, f"loads.{name}")
    for name, action, effort in losses(back.walk, senses, sensed):
        back.drags[name] = effort, -action.power
        back.act(action)
    for name, action, state in springs(back.walk):
        back.springs[name] = state
        back.act(action, f"springs.{name}")


# ---- one module -----------------------------------------------------------------------------------------------


def _settle_module(back: Backward, number: int, method: FrictionMethod, given: Given) -> None:
    walk, system = back.walk, back.walk.system
    module, group, places = system.plan.modules[number], system.groups[number], system.places[number]
    pose, loads = walk.poses[number], [back.loads[link] for link in module.links]
    rubbed: list[tuple[Contact, Rubbing | None]] = []
    for k, place in enumerate(places):
        joint = place.joint
        for i, rub in enumerate(() if place.witness else back.contacts.get(joint, ())):
            contact = _contact(back, module.links, k, joint, rub, given, i)
            # power goes by the speed itself where the law is told on which side of rest it is
            rubbed.append((contact, rub if joint in given.rests else rub._replace(slip=contact.slip)))
            if rub.turning is not None:
                back.turning[joint] = contact, rub.turning
    rubbed += [(contact, None) for contact in teeth(walk, number)]
    settled = settle(walk.reacting(group), pose, loads, [contact for contact, _ in rubbed], method)
    back.settled.append(settled)
    back.rubbed.append(rubbed)
    if module.spinning:
        torques = cast(SpatialGroup, group).spin_torques(pose, loads)
        back.spins.update((link, torque) for (link, _, _), torque in zip(module.spinning, torques, strict=True))
    pass_on(back, number, settled.reactions, rubbed, settled.forces)


def pass_on(
    back: Backward,
    number: int,
    reactions: Sequence[Any],
    rubbed: Sequence[tuple[Contact, Rubbing | None]],
    forces: Sequence[Number],
) -> None:
    """Keep the reactions of a module and the friction of its contacts, and load the links it hangs on with both."""
    parts = [(*both, force) for both, force in zip(rubbed, forces, strict=True)]
    _pass_joints(back, number, reactions, parts)
    parting, count = {contact.joint: force for contact, _, force in parts}, len(back.walk.system.places[number])
    for i, name in enumerate(back.walk.system.plan.modules[number].gears):
        k = count + i
        back.gears[name], done = gear_load(back.walk, number, i, reactions[k][-1], parting.get(k, 0.0))
        if back.travels:
            back.gear_power = back.gear_power + power_of(back.walk, number, done)
        _push(back, number, done)


def _pass_joints(
    back: Backward, number: int, reactions: Sequence[Any], parts: Sequence[tuple[Contact, Rubbing | None, Number]]
) -> None:
    """The same of the joints of a module. parts: its contacts with their friction forces."""
    system = back.walk.system
    for k, place in enumerate(system.places[number]):
        if not place.witness:
            own = [part for part in parts if part[0].joint == k]
            wrench, driven = back.walk.wrench(place, reactions[k]), place.joint in system.plan.modules[number].driven
            _record(back, place, wrench, own, driven)


def _contact(back: Backward, links: tuple[str, ...], k: int, joint: str, rub: Rubbing, given: Given, i: int) -> Contact:
    """One contact of a joint, its i-th, as `friction` sees it."""
    walk, law = back.walk, law_of(back.walk.system, joint)
    parameters = {name: walk.values[f"joints.{joint}.friction.{name}"] for name in law.parameters}
    if joint in given.deflections:
        parameters["deflection"] = given.deflections[joint]
    sense, slip, zero, sliding = sense_of(given.zero_slip, joint, i), rub.slip, rub.zero, given.sliding
    if joint in given.rests:  # it is known whether it rests or slides in a sense
        zero, sliding = np.bool_(given.rests[joint]), False
        if not zero:
            slip = namespace(slip).where(primal(slip) * sense > 0.0, slip, 1e-300 * sense)
    resting: Number = 0.0
    share: Number = 1.0
    if np.any(zero):
        slip = namespace(slip).where(zero, np.sign(sense) * np.maximum(np.abs(primal(slip)), 1e-300), slip)
        if not sliding:
            resting = np.where(zero, 1.0, 0.0)
        if law.interval_at_rest and np.any(np.abs(sense) != 1.0) and np.any(sense):
            share = np.where(zero, np.abs(sense), 1.0)
    first, second = walk.system.joints[joint][1]
    unit = walk.on_link(second, rub.unit, joint)
    on = {first: walk.algebra.times(-1.0, unit), second: unit}
    felt = tuple(flat(rub.unit)) if rub.felt else None
    units = [on.get(link, walk.algebra.ZERO_LOAD) for link in links]
    return Contact(k, units, rub.load, law, parameters, slip, own=felt, resting=resting, share=share)


def _record(
    back: Backward, place: Place, wrench: Any, parts: Sequence[tuple[Contact, Rubbing | None, Number]], driven: bool
) -> None:
    """Keep a joint's reaction, friction and drive effort; load its known link with all three."""
    walk, algebra, joint = back.walk, back.walk.algebra, place.joint
    turns, second = walk.system.turns(joint), walk.system.joints[joint][1][1]
    friction, amount, loss = algebra.ZERO_LOAD, 0.0, 0.0
    for contact, rub, force in parts:
        if rub is not None:
            part = algebra.times(force, rub.unit)
            friction, amount = algebra.added(friction, part), literal.plus(amount, literal.times(force, rub.amount))
            loss = literal.less(loss, force * rub.slip)
            if contact.own is not None:
                wrench = algebra.minus(wrench, part)
    total = algebra.added(wrench, friction)
    if driven:
        motion, unit = walk.freedom(joint, turns)
        back.efforts[joint] = algebra.power(wrench, motion)
        reaction = algebra.minus(wrench, algebra.times(back.efforts[joint], unit))
    else:
        reaction = walk.bare(joint, wrench)
    if joint in back.drags:  # what it loses whatever its load: the links bear it already
        effort, drag = back.drags[joint]
        friction = algebra.added(friction, algebra.times(effort, walk.axis(joint, turns)[1]))
        amount, loss = amount + effort, loss + drag
    back.reactions[joint], back.friction_wrenches[joint] = reaction, friction
    back.friction[joint], back.losses[joint] = amount, loss
    if back.travels:
        back.passed[joint] = algebra.power(walk.on_link(second, total, joint), walk.against(joint))
    for link, outer in zip(place.links, place.outer, strict=True):
        if outer:
            back.add(link, walk.on_link(link, total if link == second else algebra.times(-1.0, total), joint))


def _push(back: Backward, number: int, done: Sequence[Any]) -> None:
    """Load the known links of a module with what its gear pairs do."""
    for joint, side, wrench in done:
        place = back.walk.system.places[number][joint]
        if place.outer[side]:
            back.add(place.links[side], wrench)

"""Forces, backward through the row of modules: reactions, friction, drive efforts, gear pairs, the power balance."""

from __future__ import annotations

import functools
import operator
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from trunnion.algebra import literal
from trunnion.algebra.dual import primal
from trunnion.algebra.namespace import Number, cut, flat, namespace
from trunnion.algebra.plane import ZERO_LOAD, Wrench, added
from trunnion.errors import Status
from trunnion.groups.gear import GearPair, Mesh, ToothForce, actions, apart, mesh, thread_forces
from trunnion.groups.general import General
from trunnion.joints.contact_loads import GuideLoad
from trunnion.joints.friction import directed
from trunnion.solve.contacts import contacts_of
from trunnion.solve.forward import Assembly, Forward, Travel, forward
from trunnion.solve.friction import Contact, Rubbing, Settled, settle
from trunnion.solve.friction_method import FrictionMethod
from trunnion.solve.loads import LoadAction, Share, SpringState, losses, springs, stated_loads
from trunnion.solve.system import Place, System, Values, law_of, law_parameters, rubbing, sticking

if TYPE_CHECKING:
    from trunnion.solve.row_code import RowCode

MANY_MODULES = 12  # of a row that is solved by machine code: of fewer, loading LLVM takes longer
SINGULAR = 1e6  # condition from which less than about four digits would be left
NEAR_SINGULAR = 100.0  # a transmission angle of about a degree


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


class GearLoad(NamedTuple):
    """What a gear pair does: torque in its second joint, on the second link, N m; tooth force on the second gear, N.

    Of a rack or screw the torque is in the joint that turns, the force on the link that slides.
    """

    torque: Number
    force: tuple[Number, Number]


@dataclass
class Backward:
    """What one walk backward found, by joint and driver as the file names them.

    loads: on each link, the wrenches of joints passed so far included; reactions: on the second link by the first,
    friction and drive effort not included; friction: torque about the axis, N m, of a ball or a cross about the
    relative angular velocity, or force along the slide, N, on the second link; friction_wrenches: all that friction
    does to it; losses: power that each joint loses, W, to friction, and where seats travel to its load on the way of
    its pin; drags: effort and power, W, of losses that do not follow the load, which are part of both; contacts: those
    of each joint that rubs; resting: where what resists each joint sees it at rest; settled: per module; undefined:
    where each load or spring (by path) has no value; turning: of joints that rub and turn, the friction force about the
    axis for each newton of normal load, and the slip; spins: torque that each link with a free spin would need to keep
    from spinning, N m; travels: whether seats do; gear_power: of all gear pairs, whose wheels then move apart; threads:
    friction torque and power lost in the threads of screws, by the joint that turns; module_reactions: reactions as
    their modules see them. stated: loads before any joint was passed; rubbed: contacts per module as `settled`, those
    of gear pairs last; margin_up_to: as in the method; margin: that of `locking_margin`, once it was asked for.
    """

    walk: Forward
    loads: dict[str, Any]
    resting: dict[str, Number] = field(default_factory=dict)
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
    turning: dict[str, tuple[Number, Number]] = field(default_factory=dict)
    spins: dict[str, Number] = field(default_factory=dict)
    travels: bool = False
    gear_power: Number = 0.0
    threads: dict[str, tuple[Number, Number]] = field(default_factory=dict)
    module_reactions: dict[str, Any] = field(default_factory=dict)
    stated: dict[str, Any] = field(default_factory=dict)
    rubbed: list[list[tuple[Contact, Rubbing | None]]] = field(default_factory=list)
    margin_up_to: float = 0.0
    margin: Number | None = None

    @functools.cached_property
    def converged(self) -> Number:
        """Where the friction of every module is settled."""
        return functools.reduce(np.logical_and, [settled.converged for settled in self.settled], np.True_)

    @functools.cached_property
    def share(self) -> Number:
        """Least share of its friction that a module reaches: 1 unless the position is locked."""
        return functools.reduce(np.minimum, [settled.share for settled in self.settled], 1.0)

    @functools.cached_property
    def bound(self) -> Number:
        """Largest bound of the equations of a module, 0 where no friction changes what presses on a contact."""
        return functools.reduce(np.maximum, [settled.bound for settled in self.settled], 0.0)

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
    conditions: Given | None = None,
) -> Backward:
    """Motion and forces at the given times (s): one walk forward, one back.

    values: every number by path; floats, arrays (sample, 1) or dual numbers. time: (position,).
    conditions: what is known of the joints beside the motion.
    """
    method, conditions = method or FrictionMethod(), conditions or Given()
    coded = _by_code(system, values, assembly, time, method, conditions)
    if coded is not None:
        return coded
    with np.errstate(all="ignore"):
        return by_numpy(forward(system, values, assembly, time, conditions.travel), method, conditions)


def backward(walk: Forward, method: FrictionMethod, conditions: Given) -> Backward:
    """Reactions and friction of every module of a walk, in its direction."""
    if walk.direction < 0 and walk.assembly:
        coded = _by_code(walk.system, walk.values, walk.assembly, walk.time, method, conditions, walk.direction)
        if coded is not None:
            return coded
    return by_numpy(walk, method, conditions)


def _by_code(
    system: System,
    values: Values,
    assembly: Assembly,
    time: Number,
    method: FrictionMethod,
    conditions: Given,
    direction: float = 1.0,
) -> Backward | None:
    """The same by machine code, of a long row; None where that is for NumPy."""
    usual = method.name == "newton" and method.limit == FrictionMethod.limit
    if (
        np.ndim(time) != 1
        or np.size(time) == 0
        or any(vars(conditions).values())
        or not (usual and method.criterion is None and method.multiple is None)
    ):
        return None
    code = row_code(system, values, assembly)
    back: Backward | None = None if code is None else code.solved(system, values, np.asarray(time, float), direction)
    if back is not None:
        back.margin_up_to = method.margin_up_to
    return back


def row_code(system: System, values: Values, assembly: Assembly) -> RowCode | None:
    """Machine code that solves a long row, see `row_code.code_of`; None of few modules."""
    if len(system.plan.modules) < MANY_MODULES:
        return None
    from trunnion.solve.row_code import code_of  # LLVM is loaded for long rows alone

    return code_of(system, values, assembly, _passed)


@np.errstate(all="ignore")
def _passed(walk: Forward, direction: Number) -> Backward:
    """What machine code does after a walk, and NumPy at positions which that does not decide."""
    return by_numpy(walk.backward(direction), FrictionMethod(), Given())


def by_numpy(walk: Forward, method: FrictionMethod, conditions: Given) -> Backward:
    """Reactions and friction of every module, last module first."""
    system = walk.system
    back = Backward(walk, unloaded(walk), travels=bool(conditions.travel), margin_up_to=method.margin_up_to)
    rubs = frozenset(rubbing(system))
    for joint in system.joints:
        if joint in rubs:
            back.contacts[joint] = list(contacts_of(walk, joint))
        still = [rub.zero for rub in back.contacts.get(joint, [])]
        still += [walk.still(joint, turns) for turns in system.resisted.get(joint, ())]
        back.resting[joint] = functools.reduce(operator.or_, still) if still else False
        cut(walk.time)
    gravity = system.vector(walk.values, "gravity")
    for link in system.mechanism.effective_links:  # d'Alembert: −m a at the mass centre, the moment of its spin [D 2-5]
        if link == system.mechanism.fixed_link:
            continue
        mass, moment = walk.values[f"links.{link}.mass"], walk.inertia_moment(link)
        if moment is None and literal.is_zero(mass):
            continue
        centre = walk.at(link, system.centre(walk.values, link))
        force = tuple(literal.times(mass, g - a) for g, a in zip(gravity, centre.acceleration, strict=True))
        load = walk.algebra.about(force, walk.algebra.NO_MOMENT if moment is None else moment, centre.place)
        back.body_power = back.body_power + walk.algebra.power(load, walk.motions[link].twist)
        back.add(link, load)
        cut(walk.time)
    senses = {joint: sense_of(conditions.zero_slip, joint) for joint in conditions.zero_slip}
    for name, action in stated_loads(walk, senses, conditions.rests):
        back.load_powers[name] = action.power
        back.act(action, f"loads.{name}")
    for name, action, effort in losses(walk, senses, conditions.rests):
        back.drags[name] = effort, -action.power
        back.act(action)
    for name, action, spring in springs(walk):
        back.springs[name] = spring
        back.act(action, f"springs.{name}")
    for name, action in conditions.acting(walk) if conditions.acting else ():
        back.load_powers[name] = action.power
        back.act(action, name)
    back.stated = dict(back.loads)
    for number in reversed(range(len(system.plan.modules))):
        _settle_module(back, number, method, conditions)
        cut(walk.time)
    return back


def unloaded(walk: Forward) -> dict[str, Any]:
    return dict.fromkeys(walk.system.mechanism.effective_links, walk.algebra.ZERO_LOAD)


# ---- one module -----------------------------------------------------------------------------------------------


def _settle_module(back: Backward, number: int, method: FrictionMethod, conditions: Given) -> None:
    walk, system = back.walk, back.walk.system
    module, group, places = system.plan.modules[number], system.groups[number], system.places[number]
    pose, loads = walk.poses[number], [back.loads[link] for link in module.links]
    rubbed: list[tuple[Contact, Rubbing | None]] = []
    for k, place in enumerate(places):
        joint = place.joint
        for i, rub in enumerate(() if place.witness or joint in system.screws else back.contacts.get(joint, ())):
            slope, slip, felt = _felt(back, joint, rub, conditions, i)
            first, second = system.joints[joint].links
            on = {first: walk.algebra.times(-1.0, rub.unit), second: rub.unit}
            units_ = [on.get(link, walk.algebra.ZERO_LOAD) for link in module.links]
            own = tuple(flat(rub.unit)) if rub.felt else None
            rubbed.append((Contact(k, units_, rub.load, slope, own=own), felt))
            if rub.turning is not None:
                back.turning[joint] = literal.times(slope, rub.turning), slip
    for i, name in enumerate(module.gears):
        joint = system.mechanism.coupled(name)[0]
        if name in system.screws.get(joint, ()) and joint in back.contacts:
            rub = back.contacts[joint][system.screws[joint].index(name)]
            slope, _, felt = _felt(back, joint, rub, conditions, 0)
            unit_loads = units(walk, number, on_thread(walk, number, i, 1.0))
            rubbed.append((Contact(len(places) + i, unit_loads, rub.load, slope), felt))
    rubbed += [(contact, None) for contact in teeth(walk, number)]
    settled = settle(partial(walk.reactions, number), loads, [contact for contact, _ in rubbed], method)
    back.settled.append(settled)
    back.rubbed.append(rubbed)
    if module.spinning:
        torques = group.multipliers(pose, loads)[-len(module.spinning) :]  # that would keep links from spinning, N m
        back.spins.update((link, torque) for (link, _, _), torque in zip(module.spinning, torques, strict=True))
    pass_on(back, number, settled.reactions, rubbed, settled.forces)


def pass_on(
    back: Backward,
    number: int,
    reactions: Sequence[Any],
    rubbed: Sequence[tuple[Contact, Rubbing | None]],
    forces: Sequence[Number],
    toothed: bool = True,
) -> None:
    """Keep the reactions of a module and the friction of its contacts, and load the links it hangs on with both.

    toothed: whether the gears press on each other, or pass torques alone.
    """
    walk, module, places = back.walk, back.walk.system.plan.modules[number], back.walk.system.places[number]
    parts = [(*both, force) for both, force in zip(rubbed, forces, strict=True)]
    along = {contact.joint: force for contact, _, force in parts}
    for contact, rub, force in parts:
        if contact.joint >= len(places) and rub is not None:
            screw = walk.system.rubbing_joint(number, contact.joint)
            amount, loss = back.threads.get(screw, (0.0, 0.0))
            back.threads[screw] = amount + force * rub.amount, loss - force * rub.slip
    for i, name in enumerate(module.gears):
        effort, force = reactions[len(places) + i][-1], along.get(len(places) + i, 0.0)
        if toothed:
            back.gears[name], done = gear_load(walk, number, i, effort, force)
        else:
            done = acting(walk, number, i, effort, force, parting=False)
        for joint, side, wrench in done:
            link = places[joint].links[side]
            if back.travels:  # on the way of the centres of the wheels
                back.gear_power = back.gear_power + walk.algebra.power(wrench, walk.motions[link].twist)
            if places[joint].outer[side]:
                back.add(link, wrench)
    for k, place in enumerate(places):
        if not place.witness:
            back.module_reactions[place.joint] = reactions[k]
            own_parts, driven = [part for part in parts if part[0].joint == k], place.joint in module.driven
            _record(back, place, walk.wrench(place, reactions[k]), own_parts, driven)


def _felt(back: Backward, joint: str, rub: Rubbing, conditions: Given, i: int) -> tuple[Number, Number, Rubbing]:
    """Friction force of the i-th contact of a joint for each newton of its normal load, the slip that goes with it, and
    the contact.

    Where there is no slip it is that which is about to begin. Power goes by the speed itself where the law is told on
    which side of rest it is.
    """
    law = law_of(back.walk.system, joint)
    parameters = law_parameters(law, back.walk.values, joint)
    if joint in conditions.deflections:
        parameters["deflection"] = conditions.deflections[joint]
    sense, slip, zero, sliding = sense_of(conditions.zero_slip, joint, i), rub.slip, rub.zero, conditions.sliding
    stated = joint in conditions.rests  # whether it rests or slides in a sense
    if stated:
        zero, sliding = np.bool_(conditions.rests[joint]), False
        if not zero:
            slip = namespace(slip).where(primal(slip) * sense > 0.0, slip, 1e-300 * sense)
    resting = np.any(zero)
    if resting:
        slip = namespace(slip).where(zero, np.sign(sense) * np.maximum(np.abs(primal(slip)), 1e-300), slip)
    slope = law.function(1.0, slip, **directed(parameters, slip))
    if resting and law.at_rest is not None and not sliding:
        slope = namespace(slope).where(zero, law.at_rest(1.0, slip, **parameters), slope)
    if resting and law.interval_at_rest and np.any(np.abs(sense) != 1.0) and np.any(sense):
        slope = np.where(zero, np.abs(sense), 1.0) * slope
    return slope, slip, rub if stated else rub._replace(slip=slip)


def _record(
    back: Backward, place: Place, wrench: Any, parts: Sequence[tuple[Contact, Rubbing | None, Number]], driven: bool
) -> None:
    """Keep a joint's reaction, friction and drive effort; load its known link with all three."""
    walk, algebra, joint = back.walk, back.walk.algebra, place.joint
    turns, second = walk.system.turns(joint), walk.system.joints[joint].links[1]
    friction, (amount, loss) = algebra.ZERO_LOAD, back.threads.get(joint, (0.0, 0.0))
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
        reaction = wrench
    if joint in back.drags:  # what it loses whatever its load: the links bear it already
        effort, drag = back.drags[joint]
        friction = algebra.added(friction, algebra.times(effort, walk.axis(joint, turns)[1]))
        amount, loss = amount + effort, loss + drag
    if back.travels:  # what the joint takes out and its driver does not put in
        put_in = back.efforts[joint] * walk.rate(joint) if driven else 0.0
        loss = put_in - algebra.power(total, walk.against(joint))
        loss = loss + back.threads[joint][1] if joint in back.threads else loss
        loss = loss + back.drags[joint][1] if joint in back.drags else loss
    back.reactions[joint], back.friction_wrenches[joint] = reaction, friction
    back.friction[joint], back.losses[joint] = amount, loss
    for link, outer in zip(place.links, place.outer, strict=True):
        if outer:
            back.add(link, total if link == second else algebra.times(-1.0, total))


# ---- gear pairs of a module ------------------------------------------------------------------------------------


def gears_of(group: object) -> tuple[GearPair, ...]:
    """The gear pairs of a module."""
    return group.gears if isinstance(group, General) else ()


def _mesh(walk: Forward, number: int, i: int) -> tuple[GearPair, Mesh]:
    """A gear pair of a module and where its gears touch."""
    pose, gear = walk.poses[number], gears_of(walk.system.groups[number])[i]
    return gear, mesh(gear, pose.elements, pose.ratios[i])


def teeth(walk: Forward, number: int) -> Iterator[Contact]:
    """The forces with which inclined flanks push the gears of a module apart: tan α times the tooth force."""
    module, places = walk.system.plan.modules[number], walk.system.places[number]
    for i, name in enumerate(module.gears):
        if not gears_of(walk.system.groups[number])[i].carriers:
            continue
        gear, touch = _mesh(walk, number, i)
        unit_loads = units(walk, number, apart(gear, touch, 1.0))
        angle = walk.values.get(f"gears.{name}.pressure_angle")
        if angle is None:  # a chain or rope
            continue
        # a guide of length 2/|f/λ| under the moment λ alone presses with |f|
        load = GuideLoad((1.0, 0.0), 2 / namespace(touch.factor).abs(touch.factor))
        slope = namespace(angle).sin(angle) / namespace(angle).cos(angle)
        yield Contact(len(places) + i, unit_loads, load, slope, rubs=False)


def units(walk: Forward, number: int, forces: Sequence[ToothForce]) -> list[Wrench]:
    """What forces do to each link of a module."""
    loads = dict.fromkeys(walk.system.plan.modules[number].links, ZERO_LOAD)
    for joint, side, wrench in forces:
        link = walk.system.places[number][joint].links[side]
        if link in loads:
            loads[link] = added(loads[link], wrench)
    return list(loads.values())


def on_thread(walk: Forward, number: int, i: int, friction: Number) -> list[ToothForce]:
    """What friction along the thread of a screw, N, does to the links."""
    gear, name = gears_of(walk.system.groups[number])[i], walk.system.plan.modules[number].gears[i]
    lead = walk.system.ratio(walk.values, name)
    lever = walk.values[f"joints.{walk.system.mechanism.coupled(name)[0]}.pin.radius"]
    helix = namespace(lead, lever).sqrt(lever * lever + lead * lead)
    torque, force = friction * lever * lever / helix, friction * lead / helix
    return thread_forces(gear, walk.poses[number].elements, torque, force)


def acting(
    walk: Forward, number: int, i: int, effort: Number, along: Number = 0.0, parting: bool = True
) -> list[ToothForce]:
    """What a gear pair of a module does with an effort in its second joint, and with friction along its thread, N.

    parting: by tooth forces, not efforts alone. Efforts alone are what moves with the play of joints: the ratio holds
    between coordinates, which no offset of a pin changes.
    """
    pose, gear = walk.poses[number], gears_of(walk.system.groups[number])[i]
    done = actions(gear if parting else gear._replace(carriers=None), pose.elements, pose.ratios[i], effort)
    if gear.slide is not None and not gear.carriers and not literal.is_zero(along):
        done += on_thread(walk, number, i, along)
    return done


def gear_load(walk: Forward, number: int, i: int, effort: Number, along: Number) -> tuple[GearLoad, list[ToothForce]]:
    """What a gear pair does in the file's sense, and to which links.

    along: the force that parts its gears, or friction along its thread, N.
    """
    done, gear = acting(walk, number, i, effort, along), gears_of(walk.system.groups[number])[i]
    turned_round = walk.system.plan.modules[number].gears[i] in walk.system.turned_round
    force: tuple[Number, Number] = (0.0, 0.0)
    if gear.carriers:
        pushes = apart(*_mesh(walk, number, i), along)
        force = done[0].wrench.x + pushes[0].wrench.x, done[0].wrench.y + pushes[0].wrench.y
        done += pushes
        if turned_round:  # on the gear that the file names first
            force = -force[0], -force[1]
    elif gear.slide is not None:
        total = dict.fromkeys((joint for joint, _ in gear.joints), ZERO_LOAD)  # on the second link of each joint
        for joint, side, wrench in done:
            total[joint] = added(total[joint], wrench) if side == 1 else total[joint]
        x, y, _ = total[gear.joints[gear.slide][0]]
        return GearLoad(total[gear.joints[1 - gear.slide][0]].m, (x, y)), done
    in_first = turned_round if gear.slide is None else gear.slide == 1
    return GearLoad(-effort * walk.poses[number].ratios[i] if in_first else effort, force), done


# ---- what a position is worth ----------------------------------------------------------------------------------


def status_of(back: Backward, shape: tuple[int, ...]) -> NDArray[np.int8]:
    """The gravest status of every position."""
    return np.array(np.broadcast_to(status_number(back), shape), np.int8)


def pose_status(walk: Forward, shape: tuple[int, ...]) -> NDArray[np.int8]:
    """The gravest status of every position that its motion alone decides."""
    return np.array(np.broadcast_to(pose_status_number(walk), shape), np.int8)


def status_number(back: Backward) -> Number:
    """The gravest status in whatever shape the numbers of the walk have."""
    status = pose_status_number(back.walk)
    reactions = (number for reaction in back.reactions.values() for number in flat(tuple(reaction)[:2]))
    forces = (*back.efforts.values(), *back.friction.values(), *reactions)
    reasons = {
        Status.ZERO_SLIP: [back.resting[name] for name in sticking(back.walk.system)],
        Status.NOT_CONVERGED: [np.logical_not(back.converged), ~np.isfinite(_sum(forces))],
        Status.LOCKED: [np.less(back.share, 1.0)],
        Status.LOAD_UNDEFINED: back.undefined.values(),
    }
    for code, where in reasons.items():
        reached = functools.reduce(np.logical_or, where, np.False_)
        status = np.maximum(status, np.where(reached, np.int8(code), np.int8(0)))
    return status


def pose_status_number(walk: Forward) -> Number:
    """The gravest status that the motion alone decides, in whatever shape its numbers have."""
    condition = walk.condition
    status = np.where(condition > NEAR_SINGULAR, np.int8(Status.NEAR_SINGULAR), np.int8(Status.SOLVED))
    status = np.where(condition <= SINGULAR, status, np.int8(Status.SINGULAR))
    return np.where(walk.assembled, status, np.int8(Status.NOT_ASSEMBLED))


def _sum(numbers: Iterable[Number]) -> Number:
    """Without derivatives: whether it is finite is what is asked for."""
    return functools.reduce(operator.add, (primal(number) for number in numbers), 0.0)

"""Forces of gear pairs on the links of a module: tooth force, the force that parts the gears, and their power."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import NamedTuple

from trunnion.algebra.literal import is_zero
from trunnion.algebra.namespace import Number, namespace
from trunnion.algebra.plane import ZERO_LOAD, Wrench, added, power
from trunnion.groups.gear import GearPair, Mesh, ToothForce, actions, apart, mesh, thread_forces
from trunnion.groups.general import General
from trunnion.joints.contact_loads import GuideLoad
from trunnion.solve.forward import Forward
from trunnion.solve.friction import Contact

__all__ = ["GearLoad", "acting", "gear_load", "gears_of", "on_thread", "power_of", "teeth", "units"]


class GearLoad(NamedTuple):
    """What a gear pair does: torque in its second joint, on the second link, N m; tooth force on the second gear, N.

    Of a rack or screw the torque is in the joint that turns, the force on the link that slides.
    """

    torque: Number
    force: tuple[Number, Number]


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
    if gear.slide is not None and not gear.carriers and not is_zero(along):
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


def power_of(walk: Forward, number: int, done: Sequence[ToothForce]) -> Number:
    """Power of a gear pair on the way of its wheels' centres, W; without travel of their pins there is none."""
    total: Number = 0.0
    for joint, side, wrench in done:
        total = total + power(wrench, walk.motions[walk.system.places[number][joint].links[side]].twist)
    return total

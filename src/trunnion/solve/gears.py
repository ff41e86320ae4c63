"""Forces of gear pairs on the links of a module: tooth force, the force that parts the gears, and their power."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import NamedTuple

from trunnion.algebra.namespace import Number, namespace
from trunnion.algebra.plane import ZERO_LOAD, added, power
from trunnion.groups.gear import GearPair, Mesh, ToothForce, actions, apart, mesh
from trunnion.groups.general import General
from trunnion.joints.pairs import PlanarContactLoad
from trunnion.solve.forward import Forward
from trunnion.solve.friction_problem import Contact

__all__ = ["GearLoad", "acting", "gear_load", "gears_of", "power_of", "teeth"]


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
        units = dict.fromkeys(module.links, ZERO_LOAD)
        for joint, side, wrench in apart(gear, touch, 1.0):
            link = places[joint].links[side]
            if link in units:
                units[link] = added(units[link], wrench)
        angle = walk.values.get(f"gears.{name}.pressure_angle")
        if angle is None:  # a chain or rope
            continue
        # a guide of length 2/|f/λ| under the moment λ alone presses with |f|
        load = PlanarContactLoad((1.0, 0.0), 2 / namespace(touch.factor).abs(touch.factor))
        slope = namespace(angle).sin(angle) / namespace(angle).cos(angle)
        yield Contact(len(places) + i, list(units.values()), load, slope, rubs=False)


def acting(walk: Forward, number: int, i: int, effort: Number, parting: bool = True) -> list[ToothForce]:
    """What a gear pair of a module does with an effort in its second joint.

    parting: by tooth forces, not efforts alone.
    Efforts alone are what moves with the play of joints: the ratio holds between coordinates, which no offset of a pin
    changes.
    """
    pose, gear = walk.poses[number], gears_of(walk.system.groups[number])[i]
    return actions(gear if parting else gear._replace(carriers=None), pose.elements, pose.ratios[i], effort)


def gear_load(
    walk: Forward, number: int, i: int, effort: Number, separation: Number
) -> tuple[GearLoad, list[ToothForce]]:
    """What a gear pair does in the file's sense, and to which links. separation: the force that parts its gears, N."""
    done, gear = acting(walk, number, i, effort), gears_of(walk.system.groups[number])[i]
    turned_round = walk.system.plan.modules[number].gears[i] in walk.system.turned_round
    force: tuple[Number, Number] = (0.0, 0.0)
    if gear.carriers:
        pushes = apart(*_mesh(walk, number, i), separation)
        force = done[0].wrench.x + pushes[0].wrench.x, done[0].wrench.y + pushes[0].wrench.y
        done += pushes
        if turned_round:  # on the gear that the file names first
            force = -force[0], -force[1]
    elif gear.slide is not None:
        slide = gear.joints[gear.slide][0]
        force = next((part.wrench.x, part.wrench.y) for part in done if (part.joint, part.side) == (slide, 1))
    in_first = turned_round if gear.slide is None else gear.slide == 1
    return GearLoad(-effort * walk.poses[number].ratios[i] if in_first else effort, force), done


def power_of(walk: Forward, number: int, done: Sequence[ToothForce]) -> Number:
    """Power of a gear pair on the way of its wheels' centres, W; without travel of their pins there is none."""
    total: Number = 0.0
    for joint, side, wrench in done:
        total = total + power(wrench, walk.motions[walk.system.places[number][joint].links[side]].twist)
    return total

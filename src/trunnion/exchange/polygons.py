"""Force polygons of the links and Assur groups of a planar mechanism: every force head to tail, as on a drawing board.

The forces are those of d'Alembert: weight and inertia force, loads, springs and teeth, and in each joint the reaction,
the friction along a guide and the force of a driver.  [D 2, 3, 6, 7; Fig. 4 step 5]
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from trunnion.algebra.dual import primal
from trunnion.exchange.draft import Array
from trunnion.exchange.skeleton import Positions
from trunnion.solve.backward import Backward
from trunnion.solve.friction_method import FrictionMethod
from trunnion.solve.gears import gear_load
from trunnion.solve.loads import springs, stated_loads
from trunnion.solve.run import prepare
from trunnion.solve.seating import seating_of

__all__ = ["Polygon", "polygons_of"]

ROUNDS = 3  # of successive approximation, as in the graphical validation of [D]
FELT = 1e-12  # of the largest force: a smaller one is rounding, not a side of a polygon


@dataclass(frozen=True)
class Polygon:
    """Forces that are in equilibrium.

    Parameters
    ----------
    name : the link, or the group as `Plan` labels it.
    labels : what each force is, as "reaction B on coupler".
    forces : N, (force, 2), in the order in which they are drawn.
    """

    name: str
    labels: tuple[str, ...]
    forces: Array

    @property
    def corners(self) -> Array:
        """Where each side begins, and where the last one ends, N, (force + 1, 2)."""
        return np.vstack([np.zeros(2), np.cumsum(self.forces, axis=0)])

    @property
    def gap(self) -> float:
        """Distance between the end of the last force and the start of the first, of the perimeter."""
        perimeter = np.hypot(*self.forces.T).sum()
        return float(np.hypot(*self.forces.sum(axis=0)) / perimeter) if perimeter else 0.0


@np.errstate(all="ignore")  # a position without forces has no polygon
def polygons_of(positions: Positions) -> list[list[Polygon]]:
    """The force polygons of all groups of a planar mechanism, and of their links, at the first of its positions.

    Parameters
    ----------
    positions : where the mechanism is.

    Returns
    -------
    list of list of Polygon : first those with friction and reactions settled, then, if there is friction, those of
        the rounds of successive approximation that lead there, without friction first; an unsolved position has none.
    """
    run = prepare(positions.mechanism)
    time = np.array([float(positions.result["time"].values[0])])
    if run.seats:  # pins that their loads seat have no approximations: seats and reactions settle together
        backs = [seating_of(run, FrictionMethod()).at(time).back]
    else:
        backs = [run.solve(time)]
        if any(contact.rubs for rubbed in backs[0].rubbed for contact, _ in rubbed):
            backs.append(run.solve(time, method=FrictionMethod(multiple=0.0)))
            for limit in range(1, ROUNDS + 1):
                method = FrictionMethod("successive-approximation", criterion=1e-3, limit=limit)
                backs.append(run.solve(time, method=method))
    drawn = [_polygons(back) for back in backs]
    return drawn if all(np.isfinite(polygon.forces).all() for polygon in drawn[0]) else []


def _polygons(back: Backward) -> list[Polygon]:
    """Of every module, and of each of its links if it has several."""
    system = back.walk.system
    applied = _applied(back)
    polygons = []
    for number, module in enumerate(system.plan.modules):
        groups = [module.links] if len(module.links) == 1 else [module.links, *((link,) for link in module.links)]
        for links in groups:
            forces: list[tuple[str, Any]] = []
            for k, link in enumerate(links):
                joints, loads = _in_joints(back, link, links), applied[link]
                forces += joints + loads if k < len(links) - 1 or k == 0 else loads + joints
            name = f"group {number + 1} {module.label}" if links is module.links else links[0]
            polygons.append(_polygon(name, forces))
    return polygons


def _polygon(name: str, forces: Sequence[tuple[str, Any]]) -> Polygon:
    """The polygon of those forces that are not zero."""
    numbers = np.array([[float(np.ravel(primal(part))[0]) for part in force[:2]] for _, force in forces])
    numbers = numbers.reshape(-1, 2)
    sizes = np.hypot(*numbers.T)
    felt = ~(sizes <= FELT * np.max(sizes, initial=0.0))
    return Polygon(name, tuple(label for (label, _), keep in zip(forces, felt, strict=True) if keep), numbers[felt])


def _applied(back: Backward) -> dict[str, list[tuple[str, Any]]]:
    """What acts on each moving link beside the joints: its name and the force."""
    walk, system = back.walk, back.walk.system
    forces: dict[str, list[tuple[str, Any]]] = {link: [] for link in system.mechanism.effective_links}
    gravity = system.vector(walk.values, "gravity")
    for link in forces:
        if link != system.mechanism.fixed_link:
            mass = walk.values[f"links.{link}.mass"]
            acceleration = walk.at(link, system.centre(walk.values, link)).acceleration
            forces[link] += [
                (f"weight of {link}", [mass * part for part in gravity]),
                (f"inertia of {link}", [-mass * part for part in acceleration]),
            ]
    actions = [(name, action) for name, action in stated_loads(walk, {})]
    actions += [(name, action) for name, action, _ in springs(walk)]
    for name, action in actions:
        for link, wrench in action.on:
            forces[link].append((f"{name} on {link}", wrench))
    for link, label, wrench in _teeth(back):
        forces[link].append((label, wrench))
    return forces


def _teeth(back: Backward) -> list[tuple[str, str, Any]]:
    """What the gear pairs do to the links."""
    system, done = back.walk.system, []
    for number, settled, rubbed in zip(
        reversed(range(len(system.plan.modules))), back.settled, back.rubbed, strict=True
    ):
        places = system.places[number]
        along = {contact.joint: force for (contact, _), force in zip(rubbed, settled.forces, strict=True)}
        for i, name in enumerate(system.plan.modules[number].gears):
            effort, force = settled.reactions[len(places) + i][-1], along.get(len(places) + i, 0.0)
            for joint, side, wrench in gear_load(back.walk, number, i, effort, force)[1]:
                link = places[joint].links[side]
                done.append((link, f"{name} on {link}", wrench))
    return done


def _in_joints(back: Backward, link: str, group: Sequence[str]) -> list[tuple[str, Any]]:
    """What the joints of a link with links outside of its group do to it."""
    walk, system = back.walk, back.walk.system
    forces: list[tuple[str, Any]] = []
    for joint, (_, links) in system.joints.items():
        other = links[1 - links.index(link)] if link in links else link
        if other in group:
            continue
        sign = 1.0 if link == links[1] else -1.0
        parts = [("reaction", back.reactions[joint]), ("friction", back.friction_wrenches[joint])]
        if joint in back.efforts and not system.turns(joint):
            drive = walk.algebra.times(back.efforts[joint], walk.freedom(joint, False)[1])
            parts.append(("drive", drive))
        forces += [(f"{what} {joint} on {link}", [sign * part for part in wrench[:2]]) for what, wrench in parts]
    return forces

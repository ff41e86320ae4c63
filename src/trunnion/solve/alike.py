"""Assemblies that move alike: in one of them a plain link, as a leg between two points, is turned half round.

What a plain link does is done by the places of its joints and the lines of their axes: it has no mass, no other points,
and nothing in the model speaks of it.
"""

from __future__ import annotations

import json
import re
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from trunnion.algebra.dual import primal
from trunnion.groups.spatial import SpatialGroup
from trunnion.solve.forward import Forward
from trunnion.solve.track import SAME, Assemblies, extent

__all__ = ["alike"]

Array = NDArray[np.float64]
SPEAKS = ("loads", "springs", "measures", "gears", "errors", "tolerances", "costs")  # sections that may name a link


def alike(walk: Forward, number: int, solved: Assemblies, lanes: Sequence[int]) -> list[list[int]]:
    """Places among some lanes that hold a module's assemblies, those that move alike together, in their order."""
    group = walk.system.groups[number]
    plain = _plain(walk, number) if isinstance(group, SpatialGroup) else set()
    if not plain:
        return [[place] for place in range(len(lanes))]
    outlines = _outline(walk, number, solved.pose, plain, solved.closed.shape)[:, list(lanes)]
    sets: list[list[int]] = []
    for place, outline in enumerate(outlines.T):
        same = [places for places in sets if np.max(np.abs(outlines[:, places[0]] - outline)) <= SAME]
        if same:
            same[0].append(place)
        else:
            sets.append([place])
    return sets


def _plain(walk: Forward, number: int) -> set[int]:
    """The plain links of a module that do not spin freely."""
    mechanism, module, group = walk.system.mechanism, walk.system.plan.modules[number], walk.system.groups[number]
    data = mechanism.data()
    numbers = {name: hint for name, hint in mechanism.assembly.items() if not isinstance(hint, tuple)}
    spoken = set(re.findall(r"[\w-]+", json.dumps([[data.get(name) for name in SPEAKS], list(numbers)], default=str)))
    spun = {member for spin in group.spinning for member in group.spun(*spin)}
    plain = set[int]()
    for i, name in enumerate(module.links):
        link, joints = (
            mechanism.effective_links[name],
            [k for k in walk.system.joints if name in walk.system.joints[k][1]],
        )
        own_joints = {joint: mechanism.effective_joints[joint] for joint in joints}
        bare = link.mass.source == 0 and "inertia" not in link.model_fields_set and set(link.points) <= set(joints)
        inside = set(joints) <= set(module.joints) and spoken.isdisjoint({name, *joints})
        shifted = any(joint.pin is not None and joint.pin.offset is not None for joint in own_joints.values())
        if bare and inside and not shifted and i not in spun and not mechanism.loop:
            plain.add(i)
    return plain


def _outline(walk: Forward, number: int, pose: Any, plain: set[int], shape: tuple[int, ...]) -> Array:
    """(entry, lane): axes and places of the links, of plain ones places of the joints and lines of their axes."""
    group: SpatialGroup = walk.system.groups[number]
    spread, spun = extent(group, pose.elements), {member for spin in group.spinning for member in group.spun(*spin)}
    numbers: list[Any] = [n / spread for n in group.unturned(pose.elements)]
    for link, frame in enumerate(pose.frames):
        if link not in plain and link not in spun:
            numbers += [*frame.x, *frame.y, *frame.z, *(n / spread for n in frame.place)]
    for k, joint in enumerate(group.joints):
        for side in (0, 1):
            if joint.sides[side] in plain:
                element = pose.elements[k][side]
                numbers += [n / spread for n in element.place]
                if not joint.pair.ball:
                    numbers += [element.z[i] * element.z[j] for i in range(3) for j in range(i, 3)]
    return np.array([np.broadcast_to(primal(n), shape) for n in numbers], float)

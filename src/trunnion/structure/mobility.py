"""Mobility by rank: what the joints really leave free."""

from __future__ import annotations

from collections.abc import Sequence

from trunnion.structure.decompose import Module
from trunnion.structure.generic import Gears, Joints, Places, constraints, rank

__all__ = ["mobility_by_rank"]


def mobility_by_rank(
    links: Sequence[str],
    ground: str,
    joints: Joints,
    places: Places,
    gears: Gears | None = None,
    modules: Sequence[Module] = (),
) -> int:
    """Freedoms of the links less the rank of the joints' constraints at one position.

    It exceeds Grübler's count where constraints repeat each other, as in a parallelogram with a third crank. modules:
    all links and joints in the order in which they are determined. One that holds its own links firmly takes from them
    what it should, unless a later one that does not hangs on it: so few constraints of a row are looked at at once.
    """
    gears = gears or {}
    weak: list[Module] = []
    needed: set[str] = set()
    firm = 0
    for module in reversed(modules):
        meshed = {name: gears[name] for name in module.gears}
        spoken = (joint for pair, _ in meshed.values() for joint in pair)
        held = {name: joints[name] for name in dict.fromkeys((*module.joints, *spoken))}
        matrix, _ = constraints(module.links, ground, held, places, module.driven, meshed)
        if needed.isdisjoint(module.links) and rank(matrix) == int(matrix.shape[1]):
            firm += len(module.driven)
        else:
            weak.append(module)
            needed.update(link for _, sides in held.values() for link in sides)
    if modules:
        links = [link for module in weak for link in module.links]
        joints = {name: joints[name] for module in weak for name in module.joints}
        gears = {name: gears[name] for module in weak for name in module.gears}
    matrix, _ = constraints(links, ground, joints, places, gears=gears)
    return firm + int(matrix.shape[1]) - rank(matrix)

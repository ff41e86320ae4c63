"""What a model says of its assembly: the name or the places that its hints state, or the frame it is drawn in.

A hint names an assembly, as `check` lists it, or states where a point is or how far a joint has moved, at the start or
where the first driver is at the coordinate `at`. Links that are all given in one frame, with their joints where they
meet, are meant to be assembled as drawn.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from trunnion.algebra.dual import primal, single
from trunnion.algebra.namespace import Number, each, flat
from trunnion.errors import Finding, MechanismError, agreeing
from trunnion.groups.tree import Element
from trunnion.joints.pairs import Pair
from trunnion.model.names import as_key
from trunnion.model.parts import AT, FOLDS
from trunnion.solve.forward import Forward
from trunnion.solve.system import System
from trunnion.solve.track import lane_of
from trunnion.structure.decompose import Module

Array = NDArray[np.float64]
Rows = dict[str, tuple[bool, list[Array]]]  # of a joint: whether by its turn; its numbers in every assembly
ALIKE = 1e-6  # rad, or of the size, and of how far off: positions as near as the nearest
MEETS = 1e-6  # of the size, and of unit vectors: elements that coincide as drawn


def spun_sets(group: Any) -> list[tuple[tuple[int, ...], tuple[int, int]]]:
    """Links of a module that spin as one, with the two joints between which they do."""
    return [(group.spun(*spin), (spin[1], spin[2])) for spin in getattr(group, "spinning", ())]


# ---- by name --------------------------------------------------------------------------------------------------


def way_name(index: int) -> str:
    """The name of an assembly, as `check` lists it and a hint may choose it."""
    return f"way-{index + 1}"


def _names(system: System, module: Module) -> dict[str, tuple[str, int]]:
    """The hints that name an assembly of a module, by link, with its place from 0 on."""
    stated = {key: hint for key, hint in system.mechanism.assembly.items() if key in module.links}
    return {
        key: (hint, int(hint.partition("-")[2]) - 1)
        for key, hint in stated.items() if isinstance(hint, str) and hint != FOLDS
    }  # fmt: skip


def named_way(system: System, module: Module, count: int) -> int | None:
    """Which of `count` assemblies of a module its hints name, from 0 on; None if none does.

    Raises MechanismError if there is no such assembly.
    """
    if findings := misnamed(system, module, count):
        raise MechanismError(findings)
    return next((number for _, number in _names(system, module).values()), None)


def misnamed(system: System, module: Module, count: int) -> list[Finding]:
    """What is wrong with the hints that name one of `count` assemblies of a module."""
    findings: list[Finding] = []
    named = _names(system, module)
    links = f"the link {module.links[0]} has" if len(module.links) == 1 else f"the links {', '.join(module.links)} have"
    ways = ", ".join(way_name(i) for i in range(count))
    for key, (name, number) in named.items():
        first, (first_name, _) = next(iter(named.items()))
        if module.rank == 1:
            what = f"the link '{key}' follows the driver {module.driven[0]}: it has only one assembly mode"
            findings.append(Finding(what, f"assembly.{key}", "remove it"))
        elif number >= count:
            remedy = f"the modes are {ways}; without this line `check` shows them" if count else "check the lengths"
            findings.append(Finding(f"{links} no assembly mode '{name}'", f"assembly.{key}", remedy))
        elif name != first_name:
            what = f"'{name}' contradicts '{first_name}' of the link '{first}', which is in the same group"
            findings.append(Finding(what, f"assembly.{key}", "state the assembly mode of a group for one of its links"))
    return findings


# ---- by place -------------------------------------------------------------------------------------------------


def hinted_at(walk: Forward, times: Array) -> int:
    """The position of some at which the first driver is nearest to where the hints hold; the start if that is open."""
    stated, drivers = walk.values.get(f"assembly.{AT}"), list(walk.system.mechanism.drivers)
    if stated is None or not drivers or AT in walk.system.joints:
        return 0
    return _nearest(walk, times, {drivers[0]: single(stated)})


def _nearest(walk: Forward, times: Array, driven: Mapping[str, float]) -> int:
    """The first position of some at which drivers are nearest to these coordinates."""
    system, away = walk.system, np.zeros(len(times))
    for name, coordinate in driven.items():
        apart = np.ravel(primal(system.drive(walk.values, name, times)[0])) - coordinate
        size = 1.0 if system.turns(name) else float(np.max(primal(walk.size)))
        away = away + (np.arctan2(np.sin(apart), np.cos(apart)) if system.turns(name) else apart / size) ** 2
    return int(np.argmax(away <= (1 + ALIKE) * np.min(away) + ALIKE**2))  # of the turns of a cycle the first


def hints(walk: Forward, module: Module) -> list[tuple[str, str, tuple[Number, ...]]]:
    """(link, point, place) or ("", joint, (angle or slide,)) of the hints that tell assemblies of a module apart.

    A point counts on the link of the module that carries it, if its place is not known without that.
    """
    rows: list[tuple[str, str, tuple[Number, ...]]] = []
    for key in walk.system.mechanism.assembly:
        path = f"assembly.{key}"
        if f"{path}.x" in walk.values:
            link, _, name = key.partition(".")
            if key in walk.system.joints:
                joint = walk.system.joints[key]
                inside = [other for other in joint.links if other in module.links]
                settled = key in module.joints and joint.pair.meets and len(inside) == 1
                link, name = (inside[-1], key) if inside and not settled else ("", "")
            if link in module.links:
                place = tuple(walk.values[f"{path}.{axis}"] for axis in "xyz" if f"{path}.{axis}" in walk.values)
                rows.append((link, name, place))
        elif key in module.joints:
            rows.append(("", key, (walk.values[path],)))
    return rows


def distance(walk: Forward, module: Module, frames: Sequence[Any], lane: int | None = None) -> Array:
    """Sum of the squared distances of an assembly from the hints, m² and rad².

    frames: of the module's links, at the position `lane` of the walk; None if at all of them. A link that spins freely
    is as near as it comes while it spins.
    """
    group: Any = walk.system.groups[walk.system.plan.modules.index(module)]
    total: Any = 0.0
    for link, name, place in hints(walk, module):
        if not link:
            away = coordinate(walk, module, frames, name, lane) - place[0]
            total = total + (np.arctan2(np.sin(away), np.cos(away)) if walk.system.turns(name) else away) ** 2
            continue
        i = module.links.index(link)
        point: Sequence[Number] = walk.placed(frames[i], link, name)
        if spins := [spin for spin in spun_sets(group) if i in spin[0]]:
            members, ends = min(spins, key=lambda spin: len(spin[0]))
            elements = {}
            for k in ends:
                side = next(side for side in group.joints[k].sides if side in members)
                element = walk.algebra.compose(frames[side], walk.local[module.links[side], module.joints[k]])
                elements[k] = Element(element, element)
            point, place = (group.from_line(elements, *ends, at) for at in (point, place))
        total = total + sum((is_ - hinted) ** 2 for is_, hinted in zip(point, place, strict=True))
    return np.asarray(total, float)


def coordinate(walk: Forward, module: Module, frames: Sequence[Any], joint: str, lane: int | None) -> Number:
    """Turn or slide of a joint of a module whose links lie in these frames."""

    def element(link: str) -> Any:
        if link in module.links:
            return walk.algebra.compose(frames[module.links.index(link)], walk.local[link, joint])
        outer = walk.element(link, joint)
        return outer if lane is None else each(outer, lambda n: lane_of(n, lane))

    first, second = walk.system.joints[joint].links
    return walk.coordinate(joint, element(first), element(second))


def joint_rows(walk: Forward, module: Module, count: int, frames: Sequence[Any], lane: int) -> Rows:
    """The joints of a module, each as a hint can state it: whether that is its turn, and its numbers in every assembly.

    In space a joint that turns about an axis is told by its turn, known links included, others between two links of the
    module by the place of their point, or their slide. Where a spin has taken a joint tells nothing.
    """
    group = walk.system.groups[walk.system.plan.modules.index(module)]
    spins = [({module.links[i] for i in members}, ends) for members, ends in spun_sets(group)]
    rows: Rows = {}
    for name in sorted(set(module.joints).difference(module.driven), key=walk.system.order.__getitem__):
        pair, links = walk.system.joints[name].pair, walk.system.joints[name].links
        number = module.joints.index(name)
        turned = walk.system.spatial and pair.turns and not pair.ball
        if not turned and not set(links).issubset(module.links):
            continue
        turns_with = [members.issuperset(links) and not turned and not pair.guided for members, _ in spins]
        if any(turns_with) or any(number in ends and not pair.ball for _, ends in spins):
            continue
        if turned or pair.guided:
            numbers = [coordinate(walk, module, frames, name, lane)]
        else:
            numbers = list(walk.placed(frames[module.links.index(links[-1])], links[-1], name))
        rows[name] = turned, [np.broadcast_to(primal(n), (count,)) for n in numbers]
    return rows


# ---- as drawn -------------------------------------------------------------------------------------------------


def drawn_at(walk: Forward, times: Array) -> int | None:
    """The position of some at which the drivers are nearest to where they are drawn; None if links are not drawn so:
    in one frame, in which the elements of every joint coincide."""
    system, size = walk.system, float(np.max(primal(walk.size)))
    if system.mechanism.loop or system.mechanism.gears or not system.mechanism.drivers:
        return None
    elements = {key: each(frame, single) for key, frame in system.stated_elements(walk.values).items()}
    ends = {name: [elements[link, name] for link in joint.links] for name, joint in system.joints.items()}
    if not all(_meets(system.spatial, joint.pair, ends[name], size) for name, joint in system.joints.items()):
        return None
    driven = {name: single(walk.coordinate(name, *ends[name])) for name in system.mechanism.drivers}
    return _nearest(walk, times, driven)


def _meets(spatial: bool, pair: Pair, ends: Sequence[Any], size: float) -> bool:
    """Whether two elements of a joint coincide, but for what it lets move."""
    first, second = ends
    if not spatial:
        away, along = np.subtract(second[:2], first[:2]) / size, np.array(first[2:])
        if not pair.guided:
            return bool(np.linalg.norm(away) < MEETS)
        across = abs(float(away @ [-along[1], along[0]]))
        return across < MEETS and bool(np.linalg.norm(along - second[2:]) < MEETS)
    if pair.threaded:
        return False
    away, x, z = (np.subtract(second[k], first[k]) / scale for k, scale in ((3, size), (0, 1.0), (2, 1.0)))
    axis = np.array(first.z)
    if pair.name == "planar":
        return bool(abs(away @ axis) < MEETS and np.linalg.norm(z) < MEETS)
    if pair.slides:
        away = away - (away @ axis) * axis
    turned = [] if pair.ball else [float(axis @ second.z)] if pair.crossed else [*z]
    held = [*x] if pair.name in ("prismatic", "fixed") else []
    return bool(np.linalg.norm([*away, *turned, *held]) < MEETS)


def off_drawing(walk: Forward, number: int, pose: Any, lane: int | NDArray[np.intp]) -> Array:
    """Sum of the squared distances of a module from where it is drawn in a pose at a position, or in lanes of many, m².

    Of links that spin freely only what a spin leaves alone counts.
    """
    group, size, total = walk.system.groups[number], float(np.max(primal(walk.size))), np.zeros(())
    spun = {link for members, _ in spun_sets(group) for link in members}
    scales = [size] * 9 + [1.0] * 3 if walk.system.spatial else [1.0, 1.0, size, size]
    drawn = list(flat(walk.algebra.ORIGIN))
    for link, frame in enumerate(pose.frames):
        for scale, is_, was in zip(scales, flat(frame), drawn, strict=True) if link not in spun else ():
            total = total + (scale * (lane_of(primal(is_), lane) - was)) ** 2
    if spun:
        placed = each(pose.elements, lambda part: lane_of(primal(part), lane))
        places = walk.system.places[number]
        stated = [Element(*(walk.local[link, place.joint] for link in place.links)) for place in places]
        for is_, was in zip(group.unturned(placed), group.unturned(stated), strict=True):
            total = total + (is_ - was) ** 2
    return np.asarray(total, float)


# ---- what there is to say -------------------------------------------------------------------------------------


def remarks(walk: Forward, module: Module, count: int, named: int | None, tied: Sequence[int] = ()) -> list[Finding]:
    """Of an assembly among `count` that is chosen by name, or as the first of those that are nearest the hints, `tied`,
    if there are any: where name and place contradict each other, and where neither decides."""
    system, links = walk.system, list(module.links)
    hinted = list(dict.fromkeys(name for _, name, _ in hints(walk, module)))
    if named is not None:
        if not hinted or len(tied) != 1 or tied[0] == named:
            return []
        key, (name, _) = next(iter(_names(system, module).items()))
        what = f"the assembly mode of the links {', '.join(links)} is stated by name, {name}, and by the place of "
        what += f"{', '.join(hinted)}, which means {way_name(tied[0])}; the name is used"
        figures = {"links": links, "places": hinted, "way": way_name(tied[0]), "name": name}
        return [Finding.warning("assembly.contradiction", f"assembly.{key}", what, "remove one of the two", **figures)]
    if len(tied) == 1:
        return []
    unhinted = [key for key in system.mechanism.assembly if key in module.joints and key not in hinted]
    why, used = "no assembly hint selects one", way_name(tied[0]) if tied else "the first one"
    if names := hinted or unhinted:
        them = "them" if len(tied) in (0, count) else " and ".join(way_name(mode) for mode in tied)
        why = f"the {agreeing(len(names), 'hint', 'hints')} of {' and '.join(names)} "
        why += f"{agreeing(len(names), 'does', 'do')} not distinguish {them}"
    remedy = "give a hint that is nearer to one of them, or one of the names listed by `check`"
    if not hinted:
        free = [joint for joint in module.joints if joint not in unhinted] or list(module.joints)
        joint = module.joints[len(module.joints) // 2]
        joint = joint if joint in free else free[0]
        place, hint = "where a point is", "[x, y]"
        if system.spatial and system.joints[joint].pair.meets and not system.mechanism.loop:
            hint = "[x, y, z]"
        elif system.spatial:
            place, hint = "how far a joint has turned", "60 deg"
        remedy = f"state roughly {place} at the start, e.g. assembly: {{{as_key(joint)}: {hint}}}, or one of the names "
        remedy += "listed by `check`"
    what = f"links {', '.join(links)} have {count} assembly modes and {why}; {used} is used"
    return [Finding.warning("assembly.choice", "assembly", what, remedy, links=links, ways=count)]

"""What a hint says of an assembly: which point it speaks of, and how far an assembly is from it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, TypeGuard

import numpy as np
from numpy.typing import NDArray

from trunnion.algebra.namespace import Number
from trunnion.algebra.nested import each
from trunnion.errors import Finding, MechanismError
from trunnion.joints.pairs import PAIRS
from trunnion.results.sentences import finding_for
from trunnion.solve.forward import Forward
from trunnion.solve.system import System
from trunnion.structure.decompose import Module

__all__ = ["Pick", "distance", "first", "hints", "misnamed", "named_way", "nth", "told_twice", "way_name"]

Array = NDArray[np.float64]
Pick = Callable[[Number], Any]


def way_name(index: int) -> str:
    """The name of an assembly, as `check` lists it and a hint may choose it."""
    return f"way-{index + 1}"


def named_way(system: System, module: Module, count: int) -> int | None:
    """Which of `count` assemblies of a module its hints name, None if none does; MechanismError if there is no such."""
    findings = misnamed(system, module, count)
    if findings:
        raise MechanismError(findings)
    return next((number_of(name) for _, name in _names(system, module)), None)


def number_of(name: str) -> int:
    """The place of an assembly, from 0 on, by its name."""
    return int(name.partition("-")[2]) - 1


def _names(system: System, module: Module) -> list[tuple[str, str]]:
    """(link, name of an assembly) of the hints that choose by name."""
    return [(key, hint) for key, hint in system.mechanism.assembly.items() if key in module.links and _is_name(hint)]


def _is_name(hint: object) -> TypeGuard[str]:
    return isinstance(hint, str)


def misnamed(system: System, module: Module, count: int) -> list[Finding]:
    """What is wrong with the hints that name one of `count` assemblies of a module."""
    found: list[Finding] = []
    named = _names(system, module)
    links = f"the link {module.links[0]} has" if len(module.links) == 1 else f"the links {', '.join(module.links)} have"
    ways = ", ".join(way_name(i) for i in range(count))
    for key, name in named:
        if module.rank == 1:
            what = f"the link '{key}' follows the driver {module.driven[0]}: it has only one assembly mode"
            found.append(Finding(what, f"assembly.{key}", "remove it"))
        elif number_of(name) >= count:
            remedy = f"the modes are {ways}; without this line `check` shows them" if count else "check the lengths"
            found.append(Finding(f"{links} no assembly mode '{name}'", f"assembly.{key}", remedy))
        elif name != named[0][1]:
            what = f"'{name}' contradicts '{named[0][1]}' of the link '{named[0][0]}', which is in the same group"
            found.append(Finding(what, f"assembly.{key}", "state the assembly mode of a group for one of its links"))
    return found


def told_twice(walk: Forward, module: Module, named: int, placed: int | None) -> list[Finding]:
    """What there is to say where an assembly is chosen by name and by place. placed: the one that the place chooses."""
    places = [name for _, name, _ in hints(walk, module)]
    if not places:
        return []
    links, (key, name) = list(module.links), _names(walk.system, module)[0]
    if placed is not None and placed != named:
        way = way_name(placed)
        return [
            finding_for("assembly.contradiction", f"assembly.{key}", links=links, places=places, way=way, name=name)
        ]
    return [finding_for("assembly.told_twice", f"assembly.{key}", links=links, places=places)]


def hints(walk: Forward, module: Module) -> list[tuple[str, str, tuple[Number, ...]]]:
    """(link, point, (x, y)) or ("", joint, (angle,)) of the hints that tell assemblies of this module apart."""
    found: list[tuple[str, str, tuple[Number, ...]]] = []
    values = walk.values
    for key in walk.system.mechanism.assembly:
        path = f"assembly.{key}"
        if f"{path}.x" in values:
            link, name = _point_of(walk.system, module, key)
            if link:
                place = tuple(values[f"{path}.{axis}"] for axis in "xyz" if f"{path}.{axis}" in values)
                found.append((link, name, place))
        elif key in module.joints:
            found.append(("", key, (values[path],)))
    return found


def _point_of(system: System, module: Module, key: str) -> tuple[str, str]:
    """The link of the module that carries the hinted point, if the place of the point is not known without it."""
    if key in system.joints:
        links = system.joints[key][1]
        inside = [link for link in links if link in module.links]
        known = key in module.joints and PAIRS[system.joints[key][0]].meets and len(inside) == 1
        return ("", "") if not inside or known else (inside[-1], key)
    link, _, name = key.partition(".")
    return (link, name) if link in module.links else ("", "")


def distance(walk: Forward, module: Module, frames: Sequence[Any], pick: Pick, known: Pick) -> Array:
    """Sum of the squared distances of an assembly from the hints, m² and rad².

    pick, known: take the position looked at from the numbers of the module's links and of the known ones.
    """
    total: Any = 0.0
    for link, name, place in hints(walk, module):
        if link:
            found = walk.placed(frames[module.links.index(link)], link, name)
            total = total + sum((pick(here) - there) ** 2 for here, there in zip(found, place, strict=True))
            continue
        links = walk.system.joints[name][1]
        first, second = (_element(walk, module, frames, side, name, pick, known) for side in links)
        away = walk.coordinate(name, first, second) - place[0]
        total = total + (np.arctan2(np.sin(away), np.cos(away)) if walk.system.turns(name) else away) ** 2
    return np.asarray(total, float)


def _element(
    walk: Forward, module: Module, frames: Sequence[Any], link: str, joint: str, pick: Pick, known: Pick
) -> Any:
    """Global element of a joint on one of its links, in the module or known, at the position looked at."""
    if link not in module.links:
        return each(walk.element(link, joint), known)
    return each(walk.composed(frames[module.links.index(link)], link, joint), pick)


def nth(lane: int) -> Pick:
    """Picks the value at one position of the cycle."""

    def pick(number: Number) -> Any:
        values = np.ravel(number)
        return values[min(lane, len(values) - 1)]

    return pick


first = nth(0)

"""The ways in which a group can be assembled, and gear pairs, in lines of text as `check` prints them."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from trunnion.results.quantities import prefixed

if TYPE_CHECKING:
    from trunnion.cycle.inspect import GearPair
    from trunnion.solve.assembly_modes import AssemblyMode, GroupModes

__all__ = ["gear_line", "lines", "places", "some"]

MOST_JOINTS = 8  # named in a line
MOST_WAYS = 24  # in lines


def gear_line(pair: GearPair) -> str:
    """'mesh: external, pitch radii 40 mm of crank, 80 mm of wheel'."""
    told = []
    for link, radius in pair.radii:
        factor, unit = prefixed(radius, "m")
        told.append(f"{radius * factor:.5g} {unit} of {link}")
    return f"{pair.name}: {'internal' if pair.internal else 'external'}, pitch radii {', '.join(told)}"


def lines(choice: GroupModes) -> list[str]:
    """The position if it is not the start, each way with its joints, and what to write to take another."""
    wide = max(len(way.name) for way in choice.ways)
    found = [f"at {choice.where}:"] * bool(choice.where)
    told = some(choice, MOST_WAYS)
    found += [f"{way.name:<{wide}}  {places(choice, way)}{'  <- used' * way.taken}" for way in told]
    found += [f"… and {len(choice.ways) - len(told)} more"] * (len(told) < len(choice.ways))
    other = next(way for way in choice.ways if not way.taken)
    return [*found, f"to use another: {choice.line(other)}"]


def some(choice: GroupModes, most: int) -> list[AssemblyMode]:
    """The first ways of a choice, no more than `most`, the one that is taken always among them."""
    first = list(choice.ways[:most])
    taken = [way for way in choice.ways[most:] if way.taken]
    return [*first[: len(first) - len(taken)], *taken]


def places(choice: GroupModes, way: AssemblyMode) -> str:
    """Where the inner joints of a group are in one of its ways: 'C (70, 130) mm'."""
    numbers = [abs(n) for one in choice.ways for joint in one.joints.values() for n in joint]
    largest = max((n for n in numbers if math.isfinite(n)), default=0.0)
    turned = [f"{name} {round(math.degrees(angle), 6):.5g}°" for name, angle in list(way.turns.items())[:MOST_JOINTS]]
    if not largest:
        return ", ".join(turned) or ("at the origin" if numbers else "")
    factor, unit = prefixed(largest, "m")
    decimals = max(0, 3 - math.floor(math.log10(largest * factor)))

    def text(value: float) -> str:
        shown = f"{value * factor:.{decimals}f}"
        shown = shown.rstrip("0").rstrip(".") if decimals else shown
        return "0" if shown == "-0" else shown

    told = [
        f"{name} ({', '.join(map(text, joint))})" if len(joint) > 1 else f"{name} at {text(joint[0])}"
        for name, joint in list(way.joints.items())[:MOST_JOINTS]
    ]
    places_ = ", ".join(told) + ", …" * (len(way.joints) > MOST_JOINTS) + f" {unit}"
    return "; ".join([places_, ", ".join(turned)]) if turned else places_

"""The ways in which a group can be assembled, in lines of text as `check` prints them."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from trunnion.results.quantities import prefixed

if TYPE_CHECKING:
    from trunnion.solve.assembly_modes import AssemblyMode, GroupModes

__all__ = ["lines", "places", "some"]

MOST_JOINTS = 8  # named in a line
MOST_WAYS = 24  # in lines
EQUAL = 1e-7  # of the largest number: nearer ones are one


def lines(choice: GroupModes) -> list[str]:
    """The position if it is not the start, each way with its joints, and what to write to take another."""
    wide = max(len(mode.name) for mode in choice.ways)
    texts = [f"at {choice.where}:"] * bool(choice.where)
    modes = some(choice, MOST_WAYS)
    texts += [f"{mode.name:<{wide}}  {places(choice, mode)}{'  <- used' * mode.taken}" for mode in modes]
    texts += [f"… and {len(choice.ways) - len(modes)} more"] * (len(modes) < len(choice.ways))
    other = next(mode for mode in choice.ways if not mode.taken)
    return [*texts, f"to use another: {choice.line(other)}"]


def some(choice: GroupModes, most: int) -> list[AssemblyMode]:
    """The first ways of a choice, no more than `most`, the one that is taken always among them."""
    first = list(choice.ways[:most])
    used = [mode for mode in choice.ways[most:] if mode.taken]
    return [*first[: len(first) - len(used)], *used]


def places(choice: GroupModes, assembly_mode: AssemblyMode) -> str:
    """Where the inner joints of a group are in one of its ways: 'C (70, 130) mm'.

    With as many digits as tell the ways apart: stated as a hint, it selects this one.
    """
    rows = np.array([[n for joint in mode.joints.values() for n in joint] for mode in choice.ways])
    angles = np.degrees([list(mode.turns.values()) for mode in choice.ways])
    digits = max(5, 3 + _decimals(angles))
    turned = [
        f"{name} {round(math.degrees(angle), 6):.{digits}g}°" for name, angle in list(assembly_mode.turns.items())
    ]
    turned = turned[:MOST_JOINTS]
    largest = float(np.max(np.abs(rows), where=np.isfinite(rows), initial=0.0))
    if not largest:
        return ", ".join(turned) or ("at the origin" if rows.size else "")
    factor, unit = prefixed(largest, "m")
    decimals = max(0, 3 - math.floor(math.log10(largest * factor)), _decimals(rows * factor))

    def text(value: float) -> str:
        number = f"{value * factor:.{decimals}f}"
        number = number.rstrip("0").rstrip(".") if decimals else number
        return "0" if number == "-0" else number

    placed = [
        f"{name} ({', '.join(map(text, joint))})" if len(joint) > 1 else f"{name} at {text(joint[0])}"
        for name, joint in list(assembly_mode.joints.items())[:MOST_JOINTS]
    ]
    listed = ", ".join(placed) + ", …" * (len(assembly_mode.joints) > MOST_JOINTS) + f" {unit}"
    return "; ".join([listed, ", ".join(turned)]) if turned else listed


def _decimals(rows: NDArray[np.float64]) -> int:
    """Decimals with which the two nearest of some rows of numbers differ by ten units of the last; equal ones apart."""
    gaps = np.max(np.abs(rows[:, None] - rows), axis=-1, initial=0.0)
    unequal = gaps[gaps > EQUAL * np.max(np.abs(rows), initial=0.0)]
    return math.ceil(1 - math.log10(np.min(unequal))) if len(unequal) else 0

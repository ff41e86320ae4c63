"""Kinematic pairs: which motions a joint frees, and how its reaction loads its contact.

The table `PAIRS` is the vocabulary of `type:` in a model file. A new pair is one entry.
"""

from __future__ import annotations

from dataclasses import dataclass

from trunnion.algebra.namespace import Number, namespace

__all__ = ["PAIRS", "Pair", "guide_load", "pin_load"]


@dataclass(frozen=True)
class Pair:
    """A kind of lower pair.

    symbol: its letter in a structural formula. freedoms: of the relative motion, a sub-sequence of
    ("rotation", "slide"). needs_axis: whether the points on both links must state an axis.
    """

    name: str
    symbol: str
    freedoms: tuple[str, ...]
    needs_axis: bool = False


def pin_load(force: tuple[Number, Number]) -> Number:
    """Normal load |F| of a planar pin, N.  [D 8]"""
    xp = namespace(*force)
    return xp.hypot(*force)


def guide_load(normal: Number, moment: Number, length: Number) -> Number:
    """Sum of the normal loads |N₁| + |N₂| at the two ends of a guide, N.

    normal: force across the guide, N; moment: about the middle of the guide, N m; length: of the guide, m.
    The ends carry N/2 ∓ M/L: the planar twin of a bearing that carries its load at its two ends.
    """
    xp = namespace(normal, moment, length)
    return xp.abs(normal / 2 + moment / length) + xp.abs(normal / 2 - moment / length)


PAIRS: dict[str, Pair] = {
    "revolute": Pair("revolute", "R", ("rotation",)),
    "prismatic": Pair("prismatic", "P", ("slide",), needs_axis=True),
}

"""Kinematic pairs: which motions a joint frees, and how its reaction loads its contact.

The table `PAIRS` is the vocabulary of `type:` in a model file. A new pair is one entry.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from trunnion.algebra.dual import primal
from trunnion.algebra.namespace import Number, namespace

__all__ = ["PAIRS", "Load", "Pair", "Reaction"]


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


Reaction = tuple[Number, Number, Number]  # force x, y (N) and moment (N m) about the joint's point


class Load(NamedTuple):
    """How a planar joint's reaction presses on its contact: the normal load N, its gradient, and a bound.

    A pin (across is None) presses with N = |F|.  [D 8]
    A guide of the given length (m), loaded off its middle, carries on its two ends:
    N = |F_n/2 + M/length| + |F_n/2 − M/length|, F_n along the unit vector `across`: the planar twin of a bearing
    that carries its load at its two ends. arm: from the point that the moment is about to the middle of the guide, m.
    """

    across: tuple[Number, Number] | None = None
    length: Number = 0.0
    arm: tuple[Number, Number] = (0.0, 0.0)

    def normal(self, reaction: Reaction) -> Number:
        """Normal load N ≥ 0, N."""
        x, y, _ = reaction
        if self.across is None:
            square = x * x + y * y  # hypot guards against overflow and costs four times as much
            xp = namespace(square)
            if xp is np:
                return np.sqrt(square)
            loaded = primal(square) > 0  # |F| has no derivative at 0; an unloaded pin stays unloaded
            return xp.where(loaded, xp.sqrt(xp.where(loaded, square, 1.0)), 0.0)
        one, other = self._ends(reaction)
        xp = namespace(one, other)
        return xp.abs(one) + xp.abs(other)

    def gradient(self, reaction: Reaction, normal: Number) -> Reaction:
        """∂N/∂(F_x, F_y, M); zero where the load is. normal: N of this reaction, to save computing it again."""
        x, y, _ = reaction
        xp = namespace(x, y)
        if self.across is None:
            share = 1 / xp.where(normal > 0, normal, np.inf)
            return x * share, y * share, 0.0
        one, other = (xp.sign(end) for end in self._ends(reaction))
        half, turn = (one + other) / 2, (one - other) / self.length
        return half * self.across[0] + turn * self.arm[1], half * self.across[1] - turn * self.arm[0], turn

    def bound(self, reaction: Reaction) -> Number:
        """At least the most by which this reaction, added to any other, can change N."""
        if self.across is None:
            return np.abs(reaction[0]) + np.abs(reaction[1])
        return self.normal(reaction)

    def mapped(self, change: Callable[[Number], Number]) -> Load:
        """The same with `change` applied to every number."""
        across = None if self.across is None else (change(self.across[0]), change(self.across[1]))
        return Load(across, change(self.length), (change(self.arm[0]), change(self.arm[1])))

    def _ends(self, reaction: Reaction) -> tuple[Number, Number]:
        x, y, m = reaction
        if self.across is None:
            raise ValueError("a pin has no ends")
        half = (x * self.across[0] + y * self.across[1]) / 2
        turn = (m - (self.arm[0] * y - self.arm[1] * x)) / self.length
        return half + turn, half - turn


PAIRS: dict[str, Pair] = {
    "revolute": Pair("revolute", "R", ("rotation",)),
    "prismatic": Pair("prismatic", "P", ("slide",), needs_axis=True),
}

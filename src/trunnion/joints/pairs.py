"""Kinematic pairs: which motions a joint frees, and how its reaction loads its contact.

The table `PAIRS` is the vocabulary of `type:` in a model file. A new pair is one entry.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple, Protocol

import numpy as np

from trunnion.algebra.dual import primal
from trunnion.algebra.namespace import Number, namespace

__all__ = ["GUIDED", "PAIRS", "ContactLoad", "Pair", "PlanarContactLoad", "Reaction"]


@dataclass(frozen=True)
class Pair:
    """A kind of lower pair.

    symbol: its letter in a structural formula. freedoms: which of ("rotation", "slide") it frees: a rotation has a pin,
    a slide alone a guide, and a driver prescribes the first. count: freedoms of the relative motion in space.
    planar: whether it exists in the plane. needs_axis: the spaces in which the points on both links must state an axis.
    one_axis: whether it does nothing but turn about and slide along one axis that both links share; angle: whether its
    turn is one angle, about an axis that has the same direction in both links; crossed: whether it turns about two axes
    at right angles, one in each link; threaded: whether a turn slides it along; body: how it is drawn in space.
    """

    name: str
    symbol: str
    freedoms: tuple[str, ...]
    count: int
    planar: bool = False
    needs_axis: tuple[str, ...] = ("spatial",)
    one_axis: bool = False
    angle: bool = False
    crossed: bool = False
    threaded: bool = False
    body: str = "sleeve"

    @property
    def drivable(self) -> bool:
        """Whether one number says how far it has moved, slides of a cylindrical pair apart."""
        return self.one_axis

    @property
    def turns(self) -> bool:
        """Whether its coordinate, as drivers and loads see it, is an angle: it has a pin, else a guide."""
        return "rotation" in self.freedoms

    @property
    def slides(self) -> bool:
        """Whether it slides along its axis."""
        return self.one_axis and ("slide" in self.freedoms or self.threaded)

    @property
    def guided(self) -> bool:
        """Whether it slides along its axis and does nothing else."""
        return self.one_axis and not self.turns

    @property
    def pivot(self) -> bool:
        """Whether it turns about one axis and does nothing else."""
        return self.motions == ("rotation",)

    @property
    def bored(self) -> bool:
        """Whether a plain pin turns in a hole about one axis, be it that it also slides."""
        return self.one_axis and self.turns and not self.threaded

    @property
    def motions(self) -> tuple[str, ...]:
        """Which of rotation and slide it makes about and along the one axis that both links share."""
        both = (("rotation", self.one_axis and self.turns), ("slide", self.slides))
        return tuple(motion for motion, makes in both if makes)

    @property
    def meets(self) -> bool:
        """Whether the points of its two elements are one."""
        return "slide" not in self.freedoms and not self.threaded

    @property
    def ball(self) -> bool:
        """Whether it turns about any axis through its point."""
        return self.turns and self.count == 3


Reaction = tuple[Number, ...]  # planar: force x, y (N), moment (N m) about the joint's point; in space see `loads`


class ContactLoad(Protocol):
    """How a joint's reaction presses on its contact; all but `felt` take what that makes of the reaction."""

    def felt(self, reaction: Reaction) -> Reaction:
        """The components, linear in the reaction, that the normal load depends on."""

    def normal(self, reaction: Reaction) -> Number:
        """Normal load N ≥ 0, N: a seminorm of the reaction."""

    def gradient(self, reaction: Reaction, normal: Number) -> Reaction:
        """∂N/∂reaction; zero where the load is. normal: N of this reaction."""

    def bound(self, reaction: Reaction) -> Number:
        """At least the most by which this reaction, added to any other, can change N."""

    def feels(self, reaction: Reaction) -> bool:
        """Whether a change of the reaction by this one changes N at all."""

    def mapped(self, change: Callable[[Number], Number]) -> Any:
        """The same with `change` applied to every number."""


class PlanarContactLoad(NamedTuple):
    """How a planar joint's reaction presses on its contact: the normal load N, its gradient, and a bound.

    A pin (across is None) presses with N = |F|.  [D 8]
    A guide of the given length (m), loaded off its middle, carries on its two ends:
    N = |F_n/2 + M/length| + |F_n/2 − M/length| = max(|F_n|, 2 |M|/length), F_n along the unit vector `across`: the
    planar twin of a bearing that carries its load at its two ends. arm: from the point that the moment is about to the
    middle of the guide, m; None if that is the point.
    """

    across: tuple[Number, Number] | None = None
    length: Number = 0.0
    arm: tuple[Number, Number] | None = None

    def felt(self, reaction: Reaction) -> Reaction:
        """All of it."""
        return reaction

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
        across, couple = self._across(reaction), self._couple(reaction)
        xp = namespace(across, couple)
        return xp.maximum(xp.abs(across), xp.abs(couple))

    def gradient(self, reaction: Reaction, normal: Number) -> Reaction:
        """∂N/∂(F_x, F_y, M); zero where the load is. normal: N of this reaction, to save computing it again."""
        x, y, _ = reaction
        xp = namespace(x, y)
        if self.across is None:
            share = 1 / xp.where(normal > 0, normal, np.inf)
            return x * share, y * share, 0.0
        across, couple = self._across(reaction), self._couple(reaction)
        shifted = xp.abs(across) >= xp.abs(couple)
        push, turn = (
            xp.where(shifted, xp.sign(across), 0.0),
            xp.where(shifted, 0.0, xp.sign(couple)) * (2 / self.length),
        )
        gx, gy = push * self.across[0], push * self.across[1]
        if self.arm is None:
            return gx, gy, turn
        return gx + turn * self.arm[1], gy - turn * self.arm[0], turn

    def bound(self, reaction: Reaction) -> Number:
        """At least the most by which this reaction, added to any other, can change N."""
        if self.across is None:
            return np.abs(reaction[0]) + np.abs(reaction[1])
        return self.normal(reaction)

    def feels(self, reaction: Reaction) -> bool:
        """A pin feels no moment."""
        return self.across is not None or not all(isinstance(n, float) and n == 0.0 for n in reaction[:2])

    def mapped(self, change: Callable[[Number], Number]) -> PlanarContactLoad:
        """The same with `change` applied to every number."""
        across = None if self.across is None else (change(self.across[0]), change(self.across[1]))
        arm = None if self.arm is None else (change(self.arm[0]), change(self.arm[1]))
        return PlanarContactLoad(across, change(self.length), arm)

    def _across(self, reaction: Reaction) -> Number:
        """F_n."""
        if self.across is None:
            raise ValueError("a pin has no ends")
        return reaction[0] * self.across[0] + reaction[1] * self.across[1]

    def _couple(self, reaction: Reaction) -> Number:
        """2 M/length."""
        x, y, m = reaction
        moment = m if self.arm is None else m - (self.arm[0] * y - self.arm[1] * x)
        return moment * (2 / self.length)


PAIRS: dict[str, Pair] = {
    "revolute": Pair("revolute", "R", ("rotation",), 1, planar=True, one_axis=True, angle=True),
    "prismatic": Pair(
        "prismatic", "P", ("slide",), 1, planar=True, needs_axis=("planar", "spatial"), one_axis=True, body="rail"
    ),
    "cylindrical": Pair("cylindrical", "C", ("rotation", "slide"), 2, one_axis=True, angle=True),
    "spherical": Pair("spherical", "S", ("rotation",), 3, needs_axis=(), body="ball"),
    "universal": Pair("universal", "U", ("rotation",), 2, crossed=True, body="cross"),
    "helical": Pair("helical", "H", ("rotation",), 1, one_axis=True, angle=True, threaded=True),
    "planar": Pair("planar", "E", ("slide",), 3, angle=True, body="plate"),
    "fixed": Pair("fixed", "F", (), 0, needs_axis=(), body="cube"),
}
GUIDED = tuple(kind for kind, pair in PAIRS.items() if pair.guided)

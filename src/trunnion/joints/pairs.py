"""Kinematic pairs: which motions a joint frees.

The table `PAIRS` is the vocabulary of `type:` in a model file. A new pair is one entry.
"""

from __future__ import annotations

from dataclasses import dataclass

__all__ = ["GUIDED", "PAIRS", "Pair"]


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

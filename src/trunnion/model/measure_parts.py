"""The measure of a model file: a number to watch, taken from the motion or the forces at a position or over a range."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from trunnion.model.limits import LimitText
from trunnion.model.part import Part
from trunnion.model.quantity import AnyQuantity

__all__ = ["REDUCED", "STATISTICS", "SUBJECTS", "Measure", "Statistic"]

# What a measure may be of, in the order of the file's keys.
SUBJECTS = (
    "point",
    "path_error",
    "straightness",
    "angle",
    "rotation",
    "slide",
    "transmission_error",
    "stroke",
    "dead_centre",
    "rate",
    "effort",
    "load",
    "reaction",
    "efficiency",
    "locking_margin",
)
Statistic = Literal[
    "value", "maximum", "minimum", "peak-to-peak", "mean", "rms", "largest", "place-of-maximum", "place-of-minimum"
]
STATISTICS: tuple[str, ...] = Statistic.__args__  # type: ignore[attr-defined]
REDUCED = ("straightness", "stroke", "dead_centre")  # one number of a whole curve already; `efficiency: cycle` too


class Measure(Part):
    """A number to watch, of one subject: a point, a link, a joint, a driver or the whole.

    It is taken `at` a position, as a figure `over` a range, or, if neither is stated, at every position. `limit` is of
    its deviation from nominal, `at_least` and `at_most` are of the number itself.
    """

    point: str | None = Field(default=None, description="link.point whose coordinate is watched")
    axis: Literal["x", "y", "z"] | None = Field(
        default=None,
        description=(
            "which coordinate of a point, or component of a reaction; of an angle in space, the global axis that the "
            "link turns about"
        ),
    )
    path_error: str | None = Field(
        default=None, description="link.point whose distance from its nominal place is watched"
    )
    straightness: str | None = Field(
        default=None,
        description="link.point whose path is watched, how far it is from a straight line",
    )
    angle: str | None = Field(
        default=None,
        description=(
            "link whose angle is watched; in space its turn about a global axis, from where it lies without errors"
        ),
    )
    rotation: str | None = Field(default=None, description="joint whose rotation is watched, second link against first")
    slide: str | None = Field(default=None, description="joint whose slide is watched")
    transmission_error: str | None = Field(
        default=None, description="joint whose motion is watched, less the nominal one"
    )
    stroke: str | None = Field(default=None, description="joint whose stroke is watched, from end to end of its motion")
    dead_centre: str | None = Field(
        default=None,
        description=(
            "joint whose dead centre is watched, as the coordinate of the first driver at which its own is largest; "
            "with `as` place-of-minimum, smallest"
        ),
    )
    rate: str | None = Field(
        default=None, description="joint whose speed is watched: of its rotation, of a prismatic one of its slide"
    )
    effort: str | None = Field(default=None, description="driver whose effort is watched")
    load: str | None = Field(
        default=None, description="load on a joint, whose torque or force against the joint's positive sense is watched"
    )
    reaction: str | None = Field(
        default=None,
        description="joint whose reaction is watched, its magnitude or, with `axis`, a component",
    )
    efficiency: Literal["cycle", "instant"] | None = Field(
        default=None,
        description="that of the whole `cycle`, or at each `instant`",
    )
    locking_margin: Literal["mechanism"] | None = Field(
        default=None,
        description="of the `mechanism`: the multiple of its friction at which it locks",
    )
    at: AnyQuantity | None = Field(
        default=None,
        description=(
            "where it is taken, a coordinate of the first driver or a time; if neither this nor `as` is given, at "
            "every position"
        ),
    )
    statistic: Statistic | None = Field(
        default=None,
        alias="as",
        description=(
            "the figure that is taken of it over the range; `largest` is the largest magnitude. If not given, that of "
            "the subject itself (stroke, dead_centre, ...), else the largest deviation from nominal"
        ),
    )
    over: tuple[AnyQuantity, AnyQuantity] | None = Field(
        default=None,
        description="the range of it, two coordinates of the first driver or two times; the whole motion if not given",
    )
    limit: LimitText | None = Field(
        default=None,
        description=(
            "allowed deviation from nominal, to either side or as +0.2/-0.1 deg: `tolerance` tells how many keep it, "
            "`play` where the worst case is above it"
        ),
    )
    at_least: AnyQuantity | None = Field(default=None, description="least that it may be itself")
    at_most: AnyQuantity | None = Field(default=None, description="most that it may be itself")

    @property
    def subject(self) -> str:
        """Which of SUBJECTS it is of, the first stated; empty if none is."""
        return next((key for key in SUBJECTS if getattr(self, key) is not None), "")

    @property
    def reduced(self) -> bool:
        """Whether its subject is one number of a whole curve."""
        return self.subject in REDUCED or self.efficiency == "cycle"

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
    "effort",
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

    point: str | None = None
    axis: Literal["x", "y", "z"] | None = None
    path_error: str | None = None
    straightness: str | None = None
    angle: str | None = None
    rotation: str | None = None
    slide: str | None = None
    transmission_error: str | None = None
    stroke: str | None = None
    dead_centre: str | None = None
    effort: str | None = None
    reaction: str | None = None
    efficiency: Literal["cycle", "instant"] | None = None
    locking_margin: Literal["mechanism"] | None = None
    at: AnyQuantity | None = None
    statistic: Statistic | None = Field(default=None, alias="as")
    over: tuple[AnyQuantity, AnyQuantity] | None = None
    limit: LimitText | None = None
    at_least: AnyQuantity | None = None
    at_most: AnyQuantity | None = None

    @property
    def subject(self) -> str:
        """Which of SUBJECTS it is of, the first stated; empty if none is."""
        return next((key for key in SUBJECTS if getattr(self, key) is not None), "")

    @property
    def reduced(self) -> bool:
        """Whether its subject is one number of a whole curve."""
        return self.subject in REDUCED or self.efficiency == "cycle"

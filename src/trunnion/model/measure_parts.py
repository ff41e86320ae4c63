"""The measure of a model file: a number to watch, taken from the motion or the forces at a position or over a range."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any, Literal

from pydantic import Field, create_model

from trunnion.model.entry import Direction, Part
from trunnion.model.limits import LimitText
from trunnion.model.measure_table import MEASURES, MeasureKind
from trunnion.model.quantity import AnyQuantity
from trunnion.model.rules import InSpace, Positive

__all__ = ["STATISTICS", "Measure", "Statistic"]

Statistic = Literal[
    "value", "maximum", "minimum", "peak-to-peak", "mean", "rms", "largest", "place-of-maximum", "place-of-minimum",
    "dwell",
]  # fmt: skip
STATISTICS: tuple[str, ...] = Statistic.__args__  # type: ignore[attr-defined]


def _key(kind: MeasureKind) -> Any:
    """The field of a kind: a name, or one of its words."""
    words: Any = str if isinstance(kind.of, str) else Literal[kind.of]
    return words | None, Field(default=None, description=kind.text)


if TYPE_CHECKING:
    _Subject = Part
else:
    _Subject = create_model("_Subject", __base__=Part, **{key: _key(kind) for key, kind in MEASURES.items()})


class Measure(_Subject):
    """A number to watch, of one subject: a point, a link, a joint, a driver or the whole.

    It is taken `at` a position, as a figure `over` a range, or, if neither is stated, at every position. `limit` is of
    its deviation from nominal, `at_least` and `at_most` are of the number itself.
    """

    axis: Literal["x", "y", "z"] | None = Field(
        default=None,
        description=(
            "which coordinate of a point, or component of a velocity, an acceleration or a reaction; of an angle in "
            "space, the global axis that the link turns about"
        ),
    )
    along: Annotated[Direction | None, InSpace()] = Field(
        default=None, description="direction of the component, global axes, any length; instead of `axis`"
    )
    at: AnyQuantity | None = Field(
        default=None,
        description=(
            "position: a coordinate of the first driver or a time; if neither this nor `as` is given, at every position"
        ),
    )
    statistic: Statistic | None = Field(
        default=None,
        alias="as",
        description=(
            "statistic over the range; `largest` is the largest magnitude, `dwell` the share of "
            "the time that it is `within` a band. If not given, that of the subject itself (stroke, dead_centre, ...), "
            "else the largest deviation from nominal"
        ),
    )
    within: tuple[AnyQuantity, AnyQuantity] | None = Field(
        default=None, description="the band of `as: dwell`, from its lower to its upper end"
    )
    over: tuple[AnyQuantity, AnyQuantity] | None = Field(
        default=None,
        description="the range of it, two coordinates of the first driver or two times; the whole motion if not given",
    )
    duration: Annotated[AnyQuantity | None, Positive] = Field(
        default=None,
        description=(
            "of a measure of a motion in time: how long it is followed from its start; ten cycles if not given"
        ),
    )
    limit: LimitText | None = Field(
        default=None,
        description=(
            "allowed deviation from nominal, to either side or as +0.2/-0.1 deg: `tolerance` gives the yield, "
            "`play` the positions at which the worst case exceeds it"
        ),
    )
    at_least: AnyQuantity | None = Field(default=None, description="least that it may be itself")
    at_most: AnyQuantity | None = Field(default=None, description="most that it may be itself")

    @property
    def kinds(self) -> list[str]:
        """Entries of MEASURES that are stated; one is to be."""
        return [key for key in MEASURES if getattr(self, key) is not None]

    @property
    def kind(self) -> str:
        """The entry of MEASURES that it is of, the first stated; empty if none is."""
        return next(iter(self.kinds), "")

    @property
    def subject(self) -> str:
        """What it is of: the name of a point, link, joint, driver or load, or a word such as `cycle`."""
        return str(getattr(self, self.kind)) if self.kind else ""

    @property
    def reduced(self) -> bool:
        """Whether its subject is one number of a whole curve."""
        return bool(self.kind) and (MEASURES[self.kind].reduced or self.subject == "cycle")

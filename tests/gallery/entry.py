"""What the gallery says of an example: one checked fact, and how it is drawn."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from trunnion import Mechanism, analyse

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["STEPS", "Entry", "Outcome"]

STEPS = 72  # positions of the result that a fact is read from


@dataclass(frozen=True)
class Outcome:
    """An example as read, with its result over `STEPS` positions."""

    mechanism: Mechanism
    result: xr.Dataset

    def over(self, steps: int) -> Outcome:
        """The same over another number of positions."""
        return Outcome(self.mechanism, analyse(self.mechanism, steps))

    def track(self, point: str) -> tuple[Any, Any]:
        """x and y of "link.point" at every position, m."""
        x, y = self.result["point_position"].sel(point=point).transpose("axis", "position").values
        return x, y

    def angle(self, link: str) -> Any:
        """Angle of a link at every position, rad."""
        return self.result["link_angle"].sel(link=link).values


@dataclass(frozen=True)
class Entry:
    """One example of the gallery. The pages show it and `test_gallery.py` checks it.

    says: the fact in words that its figure completes ("Stroke of the piston"); unit: SI unit of the figure, `rad` is
    shown in degrees; found: the figure by Trunnion; expected: the same by other means, without Trunnion; source: what
    means and whose, as follows on "By" ("the closed form 2 r"); tolerance: how far apart they may be, in the unit.
    figures: kinds of `views.cycle.PLOTS`, the mechanism first, or `assemble`, the figure of that verb; lost:
    positions of the `STEPS` that may be without forces; errors: parts of findings of severity error that belong to the
    example.
    """

    says: str
    unit: str
    found: Callable[[Outcome], float]
    expected: Callable[[], float]
    source: str
    tolerance: float
    figures: tuple[str, ...] = ("mechanism",)
    lost: int = 0
    errors: tuple[str, ...] = field(default=())

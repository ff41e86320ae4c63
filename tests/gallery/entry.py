"""What the gallery says of an example: one checked fact, and how it is drawn; linkages closed by hand for the facts."""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import xarray as xr

from trunnion import Mechanism, analyse

STEPS = 72  # positions of the result that a fact is read from


@dataclass(frozen=True)
class Outcome:
    """An example as read, with its result over `STEPS` positions."""

    mechanism: Mechanism
    result: xr.Dataset

    def over(self, steps: int) -> "Outcome":
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


# ---- closure by hand: points as complex numbers, m ----


def corner(a: complex, b: complex, ac: float, bc: float, side: int) -> complex:
    """C with |AC| = ac and |BC| = bc, left of the line from A to B if side is +1, right of it if −1. Takes arrays.

    With u = AB/|AB|: C = A + (p + i side q) u, p = (AB² + ac² − bc²)/(2 AB), q² = ac² − p².
    """
    d = np.abs(b - a)
    p = (d**2 + ac**2 - bc**2) / (2 * d)
    return a + (p + 1j * side * np.sqrt(ac**2 - p**2)) * (b - a) / d


def slope(f: Callable[[float], complex], x: float, h: float = 1e-4) -> complex:
    """f'(x) by differences of fourth order."""
    return (8 * (f(x + h) - f(x - h)) - (f(x + 2 * h) - f(x - 2 * h))) / (12 * h)


def bend(f: Callable[[float], complex], x: float, h: float = 1e-3) -> complex:
    """f''(x) by differences of fourth order."""
    return (16 * (f(x + h) + f(x - h)) - (f(x + 2 * h) + f(x - 2 * h)) - 30 * f(x)) / (12 * h * h)

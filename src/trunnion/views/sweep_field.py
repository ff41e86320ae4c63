"""A figure of a sweep as it is drawn: its numbers in order, its panels, its axes."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product
from math import prod
from textwrap import wrap
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from trunnion.results.quantities import prefixed
from trunnion.views.charts import Axis, Line, Look, Mark, outside
from trunnion.views.common.cycle import Array
from trunnion.views.common.peaks import ease_of_status, usual_peak
from trunnion.views.scales import Arrangement, Scale, arrange, grid, meaning, statuses, thinned, written

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["ALIKE", "NOTHING", "Field", "axis_of", "columns_of", "ends", "field_of", "field_room", "on_scale",
           "panel_title", "rings"]  # fmt: skip

MOST_PANELS = 12
NOTHING = -1  # beside the statuses: sound, and yet without a number
ALIKE = 1e-9  # of the largest: numbers that differ by less are taken as one


@dataclass(frozen=True)
class Field:
    """A figure of a sweep as it is drawn: numbers in SI, (axis, curve, panel), the axis rising.

    scope: the magnitude that is shown; factor, shown: what brings it to the unit of the drawing, and that unit.
    panels: their titles; hidden: how many more there are; columns: how many belong side by side, 0 if that is the same.
    nothing: what a sound point without a number has: "∞" or "no value".
    """

    plan: Arrangement
    x: Array
    values: Array
    ideal: Array | None
    status: NDArray[np.int8]
    unit: str
    title: str
    scope: float
    factor: float
    shown: str
    panels: list[str]
    hidden: int
    columns: int
    nothing: str

    @property
    def label(self) -> str:
        """The figure with its unit."""
        return f"{self.title} [{self.shown}]" if self.shown else self.title

    def beyond(self, panel: int) -> list[Mark]:
        """What a panel says of its peak, where that is outside the frame."""
        peak = float(np.nanmax(np.abs(self.values[:, :, panel]), initial=0.0))
        return [outside(peak, self.unit)] if peak > self.scope else []


def field_of(result: xr.Dataset, measure: str, x: str, family: str) -> Field:
    """The numbers of a figure, brought into order; of too many panels some."""
    plan = arrange(result, x, family)
    unit, values = grid(result, plan, measure)
    nothing = "∞" if np.isinf(values).any() else "no value"  # a margin beyond the last that is looked for
    values = np.where(np.isfinite(values), values, np.nan)
    ideal = grid(result, plan, f"{measure}_ideal")[1] if f"{measure}_ideal" in result else None
    order = np.argsort(plan.x.values, kind="stable")
    sizes = [len(scale.values) for scale in plan.facets]
    total = prod(sizes)
    while prod(sizes) > MOST_PANELS:
        sizes[int(np.argmax(sizes))] -= 1
    picked = (thinned(len(scale.values), size) for scale, size in zip(plan.facets, sizes, strict=True))
    places = list(product(*picked))

    def panelled(array: NDArray[Any]) -> NDArray[Any]:
        rows: list[Any] = [(order, slice(None), *place) for place in places]
        return np.stack([array[row] for row in rows], axis=-1)

    values, status = panelled(values), panelled(statuses(result, plan))
    ideal = None if ideal is None else panelled(ideal)
    scope = usual_peak(ease_of_status(result, status), values, ideal)
    factor, shown = prefixed(scope, unit)
    titles = [", ".join(s.told(i) for s, i in zip(plan.facets, place, strict=True)) for place in places]
    columns = len({place[-1] for place in places}) if len(plan.facets) == 2 else 0
    return Field(
        plan, plan.x.values[order], values, ideal, status, unit, meaning(measure, unit), scope, factor, shown,
        titles, total - len(places), columns, nothing,
    )  # fmt: skip


def columns_of(field: Field) -> int:
    """How many panels stand side by side: all values of the last of two names, or a block nearly square."""
    count = len(field.panels)
    if 1 < field.columns <= 4:
        return field.columns
    return count if count <= 3 else 2 if count == 4 else 3 if count <= 6 or count == 9 else 4


def panel_title(text: str, room: int) -> str:
    """A title of a panel in lines of so many characters, broken after commas, too long names by their ends."""
    lines: list[str] = []
    for part in text.split(", "):
        while len(part) > room and "." in part.split(" = ")[0].lstrip("…"):
            part = f"…{part.lstrip('…').partition('.')[2]}"
        part = part if len(part) <= room else f"…{part[1 - room :]}"
        if lines and len(lines[-1]) + len(part) + 2 <= room:
            lines[-1] += f", {part}"
        else:
            lines[-1:] = [f"{line}," for line in lines[-1:]]
            lines.append(part)
    return "\n".join(lines)


def field_room(count: int, columns: int) -> int:
    """Characters along a panel of so many, by how many stand side by side."""
    return {1: 70, 2: 40, 3: 28, 4: 24}[columns if count > 1 else 1]


# ---- axes ---------------------------------------------------------------------------------------------------------


def on_scale(scale: Scale) -> str:
    """ "log" if the values of a name are positive, span ten times or more and are spaced by ratios; else "linear"."""
    values = np.unique(scale.values)
    if values.size < 3 or values[0] <= 0 or values[-1] < 10 * values[0]:
        return "linear"
    ratios, steps = np.diff(np.log(values)), np.diff(values)
    return "log" if ratios.max() / ratios.min() < min(4.0, steps.max() / steps.min()) else "linear"


def ends(scale: Scale, margin: float = 0.015) -> tuple[float, float]:
    """Ends of an axis: a little beyond the first and the last value."""
    low, high = float(scale.values.min()), float(scale.values.max())
    if on_scale(scale) == "log":
        more = (high / low) ** margin
        return low / more, high * more
    more = margin * (high - low) if high > low else 0.5 * abs(low) or 0.5
    return low - more, high + more


def axis_of(scale: Scale, room: int, margin: float = 0.015) -> Axis:
    """The axis along which a swept name runs; few values stand there as they were given. room: characters of a line."""
    values, log = np.unique(scale.values), on_scale(scale) == "log"
    few = values.size == 1 or (log and values.size <= 7)
    title = "\n".join(wrap(scale.label, room, break_long_words=False))
    places = [(float(value), written(value)) for value in values] if few else None
    return Axis(title, ends(scale, margin), places, log, powers=not log and not few)


def rings(x: Array, y: Array, size: float, beyond: bool = False) -> list[Mark]:
    """Rings of a size around points at which contact is lost; in the legend one that is seen. beyond: the frame, too"""
    look = Look("limit", dash="none", mark="o", size=7, hollow=True, order=4)
    empty = np.empty(0)
    seen = Line(empty, empty, "contact lost at some position", look)
    return [seen, Line(x, y, None, look.but(size=size, unclipped=beyond))]

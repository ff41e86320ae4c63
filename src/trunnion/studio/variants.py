"""Variants of a model beside each other: the figures one looks at first, and a scene to lay over that of the present.

A variant is another text, or the same without friction.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from trunnion.errors import MechanismError, Status
from trunnion.model.units import unit
from trunnion.results.dataset import units_along
from trunnion.results.quantities import number, quantity
from trunnion.results.scales import without_noise
from trunnion.studio.loaded import Asked
from trunnion.studio.margin import margin_of
from trunnion.views.common.cycle import Abscissa, abscissa, column, names
from trunnion.views.cycle.scene import scene

if TYPE_CHECKING:
    import xarray as xr

    from trunnion.studio.ways import Way

__all__ = ["Figure", "compared", "figures", "overlaid"]

Moves = Callable[["xr.Dataset"], "dict[str, Any] | None"]


@dataclass(frozen=True)
class Figure:
    """A figure of a cycle: what it is, SI value (NaN where there is none), SI unit; `beyond`: it is more than that."""

    label: str
    value: float
    unit: str
    beyond: bool = False

    @property
    def text(self) -> str:
        """With its unit."""
        if self.unit == "%":
            return f"{number(100 * self.value)} %" if np.isfinite(self.value) else "—"
        return f"{'> ' if self.beyond else ''}{quantity(self.value, self.unit)}"

    def since(self, before: Figure) -> str:
        """Its change against a figure before: a share of efforts, a difference of what is a share itself."""
        change = self.value - before.value
        if not np.isfinite(change) or self.beyond or before.beyond:
            return "—"
        if self.unit == "1":
            return f"{'+' if change >= 0.0005 else ''}{number(change, 3) if abs(change) >= 0.0005 else '0'}"
        if self.unit != "%" and before.value == 0:
            return f"{'+' if change > 0 else ''}{quantity(change, self.unit)}"
        percent = 100 * (change if self.unit == "%" else change / abs(before.value))
        text = f"{percent:+.0f}" if abs(percent) >= 100 else f"{percent:+.1f}"
        text = "0" if float(text) == 0 else text.replace("-", "−")
        return f"{text} {'points' if self.unit == '%' else '%'}"


def figures(result: xr.Dataset, rubs: bool, ways: Sequence[Way] = ()) -> Iterator[Figure]:
    """Peak effort of each driver, efficiency, least locking margin, largest reaction, mean friction power, strokes."""
    result = without_noise(result)
    units = units_along(result["drive_effort"], "driver")
    for driver, of in zip(names(result, "driver"), units, strict=False):
        effort = result["drive_effort"].sel(driver=driver).values
        yield Figure(f"peak {'force' if of == 'N' else 'torque'}, drive {driver}", _most(np.abs(effort)), of)
    efficiency = column(result, "efficiency")
    works = efficiency is not None and efficiency != 0  # where useful loads do no net work there is nothing to share
    yield Figure("efficiency", float(efficiency) if works and efficiency is not None else float("nan"), "%")
    least = margin_of(result, rubs)["margin_least"] or {"value": float("nan"), "beyond": False}
    yield Figure("least locking margin", least["value"], "1", least["beyond"])
    force = np.asarray(result["reaction_force"].transpose("axis", ...))
    yield Figure("largest reaction", _most(np.linalg.norm(force, axis=0)), "N")
    yield Figure("mean friction power", float(result["friction_power_mean"].sum()), "W")
    for one in ways:
        yield Figure(f"stroke of {one.joint}", one.stroke, one.unit)
        if np.isfinite(one.ratio):
            yield Figure(f"time ratio of {one.joint}", one.ratio, "1")
    known = np.count_nonzero(result["status"].values < Status.NOT_CONVERGED)
    yield Figure("positions solved", float(known), "")


def _most(values: Any) -> float:
    return float(np.nanmax(values)) if np.any(np.isfinite(values)) else float("nan")


def compared(
    before: xr.Dataset, rubbed: bool, after: xr.Dataset, rubs: bool, were: Sequence[Way] = (), ways: Sequence[Way] = ()
) -> list[dict[str, Any]]:
    """Rows of the table: label, SI values a and b, their texts and that of the change; None of a figure one lacks.

    Positions solved are told only where they are not all.
    """
    was = {one.label: one for one in figures(before, rubbed, were)}
    rows = []
    for one in figures(after, rubs, ways):
        other = was.get(one.label, Figure(one.label, float("nan"), one.unit))
        if not one.unit and one.value == after.sizes["position"] and other.value == before.sizes["position"]:
            continue
        change = "" if not one.unit else one.since(other)
        rows.append({"label": one.label, "unit": one.unit, "a": other.value, "b": one.value,
                     "texts": [other.text, one.text, change]})  # fmt: skip
    return rows


def overlaid(variant: Asked, present: Asked, moves: Moves = lambda _: None) -> dict[str, Any]:
    """A variant to lay over the present result: its scene at the positions of that, its margin, the table, and as
    `point` what `moves` tells of its result: the motion of a point.

    `shifted`: its drive runs over another range, and each position shows the nearest of its own; `why`: it has no
    cycle, or none that runs over the same drive.
    """
    shown = present.result
    try:
        result = variant.result
    except MechanismError as error:
        first = error.findings[0]
        return {"scene": None, "why": f"cannot be solved: {first.where} {first.what}".strip(), "rows": []}
    were, ways = (asked.state.ways(asked.steps) for asked in (variant, present))
    were, ways = ((), ()) if were is ways else (were, ways)  # of the same mechanism
    rows = compared(result, variant.rubs, shown, present.rubs, were, ways)
    own, over = abscissa(result), abscissa(shown)
    if (own.label, own.closed) != (over.label, over.closed):
        why = f"runs over {own.label}, the present one over {over.label}: its curves cannot be laid over"
        return {"scene": None, "why": why, "rows": rows}
    index, inside = _nearest(own, over)
    shifted = not (np.array_equal(index, np.arange(len(own.values))) and np.all(inside))
    if shifted:
        result = _picked(result, index, inside)
    return {
        "scene": scene(result, None, max_positions=result.sizes["position"]),
        "margin": margin_of(result, variant.rubs)["margin"],
        "point": moves(result),
        "why": None,
        "shifted": shifted,
        "rows": rows,
    }


def _picked(result: xr.Dataset, index: Any, inside: Any) -> xr.Dataset:
    """A result at some of its positions; no numbers where it has no position inside."""
    picked = result.isel(position=index)
    within = picked["status"].copy(data=inside)
    return picked.assign({
        name: row.where(within)
        for name, row in picked.data_vars.items()
        if "position" in row.dims and row.dtype.kind == "f"
    })  # fmt: skip


def _nearest(own: Abscissa, over: Abscissa) -> tuple[Any, Any]:
    """For each position the index of the nearest of another drive, and whether it lies within that one's range."""
    sizes = (float(unit(one.unit)[0]) if one.unit not in ("", "°") else 1.0 for one in (own, over))  # SI; of counts 1
    known = own.values * next(sizes) / next(sizes)
    order = np.argsort(known)
    ranked = known[order]
    above = np.clip(np.searchsorted(ranked, over.values), 1, max(len(ranked) - 1, 1))
    above = np.minimum(above, len(ranked) - 1)
    below = np.maximum(above - 1, 0)
    nearer = np.abs(ranked[below] - over.values) <= np.abs(ranked[above] - over.values)
    index = order[np.where(nearer, below, above)]
    step = float(np.max(np.diff(ranked))) if len(ranked) > 1 else 0.0
    return index, np.abs(known[index] - over.values) <= 0.5 * step + 1e-9 * float(np.max(np.abs(ranked)))

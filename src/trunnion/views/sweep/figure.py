"""Figures of a sweep: families of curves, or maps, of one number of the cycle over the swept names.

Names beyond two are told by panels, names with a single value by the title.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from trunnion.results.scales import without_noise
from trunnion.views.scales import KINDS, check_kind
from trunnion.views.sweep import curves as sweep_curves
from trunnion.views.sweep import map as sweep_map
from trunnion.views.sweep.panels import board, field

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

__all__ = ["KINDS", "check_kind", "figure"]


def figure(
    result: xr.Dataset, measure: str = "efficiency", x: str = "", family: str = "", kind: str = "curves"
) -> Figure:
    """A number of the cycle over the name `x`, one curve for each value of the name `family`; or a map over both.

    Unless they are given, the first two names with more than one value. Where there is no answer it is grey or hatched,
    with the cause; the curves of a mechanism with errors stand beside those of the ideal one, if the sweep has them.
    Raises MechanismError for names that are not swept, and for a map of fewer than two names that vary.
    """
    check_kind(kind)
    result = without_noise(result)
    told = field(result, measure, x, family)
    plan = told.plan
    mapped = kind == "map"
    if mapped:
        sweep_map.need_two(told)
    over = f"{plan.x.name} and {plan.other.name}" if mapped and plan.other else plan.x.name
    upward = plan.other.label if mapped and plan.other else told.label
    shown = board(result, told, f"{told.title} over {over}", upward)
    (sweep_map.draw if mapped else sweep_curves.draw)(shown, told)
    return shown.sheet

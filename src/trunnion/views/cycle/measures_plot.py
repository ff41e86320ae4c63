"""The model's measures over the drive, one panel each."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from trunnion.errors import Finding, MechanismError
from trunnion.results.dataset import units_along
from trunnion.results.quantities import prefixed
from trunnion.views.common.cycle import abscissa, column
from trunnion.views.common.figures import PALETTE, along, curve, frame_peak, new, shade
from trunnion.views.common.lettering import plain
from trunnion.views.common.peaks import ease, peak, usual_peak

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

__all__ = ["drawn", "measures"]


def drawn(result: xr.Dataset) -> list[int]:
    """Numbers of the measures of a result that have one number at every position."""
    if "measure_value" not in result:
        return []
    return [i for i, row in enumerate(result["measure_value"].values) if np.any(np.isfinite(row))]


def measures(result: xr.Dataset, ideal: xr.Dataset | None = None) -> Figure:
    """The model's measures over the drive, one panel each."""
    rows, over = drawn(result), abscissa(result)
    if not rows:
        what = "there is no measure with one number at every position"
        raise MechanismError(Finding(what, "measures", "state measures: in the model"))
    units = units_along(result["measure_value"], "measure")
    figure = new("Measures", result, 2.0 + 2.0 * len(rows))
    panels = figure.subplots(len(rows), 1, sharex=True, squeeze=False)[:, 0]
    for axes, i in zip(panels, rows, strict=True):
        name = str(result["measure"].values[i])
        values = column(result, "measure_value", measure=name)
        assert values is not None
        scope = usual_peak(ease(result), values)
        factor, shown = prefixed(scope, units[i])
        along(axes, over, f"{plain(name)} [{shown}]" if shown else plain(name))
        shade(axes, result, over)
        curve(axes, over, values * factor, plain(name), color=PALETTE[0], linewidth=2.0)
        frame_peak(axes, peak(values), scope, factor, units[i])
    for axes in panels[:-1]:
        axes.set_xlabel("")
    return figure

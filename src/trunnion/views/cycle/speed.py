"""Speed of the drivers over the cycle, where it varies: of a stated motion law, or of a steady cycle."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from trunnion.errors import Finding, MechanismError
from trunnion.joints.pairs import GUIDED
from trunnion.views.common.cycle import Array, abscissa, column, layout, names
from trunnion.views.common.figures import PALETTE, along, curve, new, shade
from trunnion.views.common.lettering import plain

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

__all__ = ["speed", "varying"]

STEADY = 1e-6  # of the largest speed: variations that are none


def varying(result: xr.Dataset) -> dict[str, tuple[Array, str]]:
    """Speed and unit of every driver whose speed varies."""
    found, joints = {}, layout(result)["joints"]
    for driver in names(result, "driver"):
        slides = joints.get(driver, {}).get("type") in GUIDED
        values = column(result, f"joint_{'slide' if slides else 'rotation'}_velocity", joint=driver)
        known = np.empty(0) if values is None else values[np.isfinite(values)]
        if values is not None and known.size and np.ptp(known) > STEADY * np.abs(known).max():
            found[driver] = values, "m/s" if slides else "rad/s"
    return found


def speed(result: xr.Dataset, ideal: xr.Dataset | None = None) -> Figure:
    """Speed of the drivers over the cycle, one panel each."""
    drivers, over = varying(result), abscissa(result)
    if not drivers:
        what, remedy = "the speed of no driver varies", "use `trunnion simulate --steady`, or a motion law"
        raise MechanismError(Finding(what, "speed", remedy))
    figure = new("Speed", result, 2.0 + 2.3 * len(drivers))
    panels = figure.subplots(len(drivers), 1, sharex=True, squeeze=False)[:, 0]
    for axes, (driver, (values, unit)) in zip(panels, drivers.items(), strict=True):
        along(axes, over, f"speed {plain(driver)} [{unit}]")
        shade(axes, result, over)
        curve(axes, over, values, plain(driver), color=PALETTE[0], linewidth=2.0)
    for axes in panels[:-1]:
        axes.set_xlabel("")
    return figure

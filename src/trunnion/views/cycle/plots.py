"""The figures an engineer expects of a linkage: each a function of the result, and if wanted of the ideal one.

`PLOTS` is the list; `save` writes a figure as PNG, SVG or PDF. `ideal` is the same run without friction.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from trunnion.errors import Finding, MechanismError
from trunnion.model.quantity import Quantity
from trunnion.model.units import ANY, UnitError
from trunnion.model.units import KINDS as UNITS
from trunnion.results.scales import without_noise
from trunnion.views import draw as drawn
from trunnion.views.axis import is_spatial
from trunnion.views.charts import Plot, check_kind
from trunnion.views.common.drawing import bare, draw, facts, picture
from trunnion.views.cycle import courses, seats
from trunnion.views.cycle.deviations import has, seated
from trunnion.views.draw import Labels, new
from trunnion.views.space import figure as space_figure

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

__all__ = ["PLOTS", "drawable", "figure", "mechanism", "position_at"]

LONGEST = 1.5  # steps: a place further from every position is not one of the cycle
KIND_OF = {"°": UNITS["angle"], "mm": UNITS["length"], "s": UNITS["time"]}


def mechanism(result: xr.Dataset, ideal: xr.Dataset | None = None, index: int | None = None) -> Figure:
    """The mechanism at a position, with coupler curves, joints named.

    If the position is not told: in the plane a telling one, with ghosts; in space that of the largest reaction.
    """
    count = result.sizes["position"]
    if index is not None and not 0 <= index < count:
        remedy = f"name one from 0 to {count - 1}"
        raise MechanismError(Finding(f"there is no position {index} among the {count}", "index", remedy))
    if is_spatial(result):
        return space_figure.mechanism(result, index)
    drawing = picture(result)
    if index is None:  # an eighth into the longest of what can be drawn, so that links do not lie in one line
        drawable = np.flatnonzero(np.all([np.isfinite(track).all(axis=0) for track in drawing.tracks.values()], axis=0))
        index = int(drawable[drawable.size // 8]) if drawable.size else 0
    low, high = np.array(drawing.box[:2]) - 0.09 * drawing.size, np.array(drawing.box[2:]) + 0.09 * drawing.size
    width, height = high - low
    figure = new("Mechanism", result, min(max(7.0 * height / width, 2.6), 8.0) + 0.5)
    axes = bare(figure.subplots(), low, high, facts(result, index))
    labels = Labels(figure)
    draw(axes, drawing, index, labels)
    labels.place()
    return figure


PLOTS: dict[str, Callable[[xr.Dataset, xr.Dataset | None], Plot | Figure]] = {
    "torque": courses.torque,
    "speed": courses.speed,
    "friction-power": courses.friction_power,
    "reactions": courses.reactions,
    "polar": courses.polar,
    "power": courses.power,
    "mechanism": mechanism,
    "motion": courses.motion,
    "error": courses.error,
    "seat": seats.seat,
    "beta": seats.beta,
    "locking": courses.locking,
    "measures": courses.measures,
}
KINDS = tuple(PLOTS)
# whether a result has what a figure needs that not all results have
READY: dict[str, Callable[[xr.Dataset], bool]] = {
    "speed": lambda result: bool(courses.varying(result)),
    "error": lambda result: has(result, "errors"),
    "seat": lambda result: any(not seat.planar_guide for seat in seated(result)),
    "beta": seats.described,
    "locking": courses.has_friction,
    "measures": lambda result: bool(courses.drawn_measures(result)),
}


def figure(
    result: xr.Dataset, kind: str = "torque", ideal: xr.Dataset | None = None, at: str | float | None = None
) -> Figure:
    """One figure. kind: of PLOTS; ideal: the same run without friction, to compare with.

    at: a place such as "60deg", at which the mechanism is drawn.
    """
    check_kind(kind, PLOTS)
    index = None if at is None else position_at(result, at)
    result, ideal = without_noise(result), None if ideal is None else without_noise(ideal)
    if kind == "mechanism":
        return mechanism(result, ideal, index)
    plot = PLOTS[kind](result, ideal)
    assert isinstance(plot, Plot)  # all but the mechanism
    return drawn.figure(result, plot)


def position_at(result: xr.Dataset, place: str | float) -> int:
    """The number of the position nearest to a place: a coordinate of the drive, or a time with its unit.

    A number without unit is SI. MechanismError of a text that names no place, or of one beyond the cycle.
    """
    try:
        quantity = Quantity.read(place, ANY)
        if quantity.names:
            raise UnitError(f"'{place}' is no place", "write 60deg, 20mm or 0.1s")
        timed = isinstance(place, str) and quantity.check({}) == UNITS["time"].dimensions[0]
        unit = str(result["drive"].attrs["units"]) if "drive" in result.coords and not timed else "s"
        kind = KIND_OF.get(unit, UNITS["time"])
        value = float(np.asarray(Quantity.read(place, kind).evaluate()))
    except UnitError as error:
        raise MechanismError(Finding(error.what, "--at", error.remedy or "write 60deg, 20mm or 0.1s")) from None
    values = np.asarray(result["time" if unit == "s" else "drive"].values, dtype=float)
    sought = value * {"°": 180 / np.pi, "mm": 1e3}.get(unit, 1.0)
    away = np.abs(values - sought)
    if unit == "°" and result.attrs.get("periodic"):  # the same place after each turn
        away = np.abs((values - sought + 180) % 360 - 180)
    step = abs(float(values[1] - values[0])) if values.size > 1 else np.inf
    if not np.min(away) <= LONGEST * step:
        low, high = float(np.min(values)), float(np.max(values))
        what = f"{sought:.4g}{unit} is not in the cycle"
        raise MechanismError(Finding(what, "--at", f"name a place from {low:.4g}{unit} to {high:.4g}{unit}"))
    return int(np.argmin(away))


def drawable(result: xr.Dataset) -> list[str]:
    """The kinds of figures that a result has something for."""
    return [name for name in PLOTS if name not in READY or READY[name](result)]

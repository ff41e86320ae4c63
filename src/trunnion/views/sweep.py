"""The figure of a sweep: one number of the cycle over the first name, a curve for each value of the second."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib import colormaps
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize

from trunnion.errors import Status
from trunnion.views.as_built import angle_scale
from trunnion.views.cycle import Array, usual_peak
from trunnion.views.error_plot import LOST
from trunnion.views.figures import INK, MUTED, SHADE, dress, frame_peak, legend, new, style_of
from trunnion.views.lettering import plain
from trunnion.views.quantities import prefixed
from trunnion.views.swept import Scale, cause, grid, meaning, scales, statuses

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

__all__ = ["figure"]

# of the mechanism without errors
IDEAL: dict[str, Any] = {"color": INK, "linestyle": (0, (4, 2)), "linewidth": 1.0, "markersize": 2.2}
SIGNS = {"um": "µm", "deg": "°"}
MOST_NAMED = 8  # curves that are told apart by a legend; more by a scale of colours


def figure(result: xr.Dataset, measure: str = "efficiency") -> Figure:
    """A figure of the cycle over the first name, one curve for each value of the second; no answer in grey.

    Of a mechanism with errors beside that of the ideal one, if the sweep has it.
    """
    over, *others = scales(result)
    unit, values = grid(result, measure)
    values = np.where(np.isfinite(values), values, np.nan)  # a margin beyond the last that is looked for
    order = np.argsort(over.values, kind="stable")
    x, y, status = over.values[order], values[order], statuses(result)[order]
    ideal = grid(result, f"{measure}_ideal")[1][order] if f"{measure}_ideal" in result else None
    scope = usual_peak(y, ideal)
    factor, shown = angle_scale(scope) if unit == "rad" else prefixed(scope, unit)
    title = meaning(measure, unit)
    sheet = new(f"{title[:1].upper()}{title[1:]} over {over.name}", result)
    axes = sheet.subplots()
    dress(axes, plain(_axis(over)), plain(f"{title} [{shown}]" if shown else title))
    _shade(axes, x, status)
    other = others[0] if others else None
    count = y.shape[1]
    for k in range(count):
        look = style_of(k) if count <= MOST_NAMED else {"color": _colour(other, k)}
        label = "as built" if ideal is not None else None
        if other is not None:  # many are told apart by the scale of colours
            label = plain(f"{other.name} = {other.say(k)}") if count <= MOST_NAMED else None
        _curve(axes, x, y[:, k] * factor, label, look)
        if ideal is not None:
            name = "ideal" if other is None else "ideal, dashed"
            _curve(axes, x, ideal[:, k] * factor, None if k else name, {**look, **IDEAL})
    _lost(axes, x, y * factor, status)
    both = y if ideal is None else np.append(y, ideal)
    known = both[np.isfinite(both)]
    frame_peak(axes, float(np.abs(known).max(initial=0.0)), scope, factor, unit)
    axes.set_xlim(*_ends(x))
    if not known.size:
        axes.set_yticks([])
    legend(axes, least=1)
    if count > MOST_NAMED and other is not None:
        bar = sheet.colorbar(_colours(other), ax=axes, pad=0.02, aspect=30)
        bar.set_label(plain(_axis(other)), fontsize=9, color=INK)
        bar.ax.tick_params(labelsize=8.5, colors=MUTED, labelcolor=INK)
    return sheet


def _axis(scale: Scale) -> str:
    """The swept name with its unit as it is read: µm for um, ° for deg."""
    return scale._replace(unit=SIGNS.get(scale.unit, scale.unit)).title


def _colours(other: Scale) -> ScalarMappable:
    return ScalarMappable(Normalize(other.values.min(), other.values.max()), colormaps["viridis"])


def _colour(other: Scale | None, index: int) -> Any:
    assert other is not None  # there are many curves only over a second name
    return _colours(other).to_rgba(other.values[index])


def _curve(axes: Axes, x: Array, y: Array, label: str | None, look: dict[str, Any]) -> None:
    """One curve; few points are marked, and those beside a gap with a cross."""
    marks: dict[str, Any] = {"marker": "o", "markersize": 3.5} if x.size <= 40 else {}
    axes.plot(x, y, label=label, **{"linewidth": 1.6, **marks, **look})
    known = np.isfinite(y)
    ends = known & (np.append(False, ~known[:-1]) | np.append(~known[1:], False))
    if ends.any():
        axes.plot(x[ends], y[ends], "x", markersize=7, color=look["color"], markeredgewidth=1.6, zorder=4)


def _lost(axes: Axes, x: Array, y: Array, status: Array) -> None:
    """Rings around points of whose cycle a position loses contact: what stands there is not to be built on."""
    rows, columns = np.nonzero((status == Status.CONTACT_LOST) & np.isfinite(y))
    if rows.size:
        axes.plot(x[rows], y[rows, columns], "o", markersize=8, color=LOST, markerfacecolor="none", markeredgewidth=1.2,
                  label="contact lost at some position", zorder=4)  # fmt: skip


def _ends(x: Array) -> tuple[float, float]:
    """Ends of the axis: a little beyond the first and the last point."""
    margin = 0.015 * float(x[-1] - x[0]) or 0.5 * abs(float(x[0])) or 0.5
    return float(x[0]) - margin, float(x[-1]) + margin


def _shade(axes: Axes, x: Array, status: Array) -> None:
    """Grey where no curve has an answer, hatched where some have none, with the cause."""
    missing = status >= Status.NOT_CONVERGED
    low, high = _ends(x)
    edges = np.concatenate([[low], (x[:-1] + x[1:]) / 2, [high]])
    kind = np.where(missing.all(axis=1), 2, np.where(missing.any(axis=1), 1, 0))
    starts = np.flatnonzero(np.diff(np.append(0, kind)) != 0)
    for start in (one for one in starts if kind[one]):
        stop = next((i for i in range(start, len(kind)) if kind[i] != kind[start]), len(kind))
        low, high = edges[start], edges[stop]
        look: dict[str, Any] = (
            {"color": SHADE} if kind[start] == 2 else {"facecolor": "none", "edgecolor": SHADE, "hatch": "///"}
        )
        axes.axvspan(low, high, linewidth=0, zorder=0.5, **look)
        gravest = int(status[start:stop][missing[start:stop]].max())
        text = cause(gravest) if kind[start] == 2 else f"{cause(gravest)} for some"
        axes.text(
            (low + high) / 2, 0.5, text, transform=axes.get_xaxis_transform(), rotation=90, ha="center",
            va="center", fontsize=8, color=MUTED, zorder=3, clip_on=True,
        )  # fmt: skip

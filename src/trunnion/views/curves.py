"""Curves of a result over its drive, with where it has no answer, and which peaks of them are cut.

A peak is cut only next to a dead centre or to locking, where forces have no bound and a curve would flatten all else.
The peak of a working load is never cut, however short the stroke.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from trunnion.errors import Finding, MechanismError, Status
from trunnion.model.names import nearest
from trunnion.results.quantities import prefixed, quantity
from trunnion.views.axis import Abscissa, Array, abscissa, column, intervals
from trunnion.views.charts import Axis, Band, Chart, Line, Look, Mark, Note, Rule, Stripe

if TYPE_CHECKING:
    import xarray as xr

RIPPLE = 0.1  # of the largest value: curves that vary by less are shown without 0
COLOURS, DASHES = 6, ("solid", "long", "short", "dash-dot")  # colours of the palette, then the next dash
FREE = Look("ink", 0.9, "dashed")  # without friction, among many curves


def nth(index: int) -> Look:
    """Colour and dash of the n-th of several curves; colours repeat with another dash."""
    return Look(index, dash=DASHES[index // COLOURS % len(DASHES)])  # type: ignore[arg-type]  # one of the dashes


def check_kind(kind: str, kinds: Iterable[str]) -> None:
    """MechanismError if there is no such kind of figure."""
    if kind not in kinds:
        hint = nearest(kind, kinds)
        remedy = hint if hint.startswith("did") else f"use one of {', '.join(kinds)}"
        raise MechanismError(Finding(f"there is no figure '{kind}'", "--kind", remedy))


def outside(most: float, unit: str) -> Note:
    """What stands in a chart whose peak is cut off."""
    text = f"peak {quantity(most, unit)} is outside the frame,\nnear a dead centre; --uncut shows it"
    return Note(text, 0.99, 0.97, "right", "top", boxed=True)


def over_drive(
    result: xr.Dataset, title: str, unit: str, curves: Sequence[Line] | Mapping[str, Array], *,
    bands: Sequence[Band] = (), marks: Sequence[Mark] = (), rate: str = "", scale: tuple[float, str] | None = None,
    **chart: Any,
) -> Chart:  # fmt: skip
    """Curves of one unit over the drive, in the unit in which they read best.

    Where positions next to a dead centre tower over all others, the axis ends at what is usual; where all curves stay
    near one value far from 0, it shows how they vary.

    Parameters
    ----------
    result : whose positions without an answer are shaded
    title : of the axis, without the unit
    curves : in SI; values by their names get the colours of their order
    bands : in SI
    marks : beside, in the unit of the chart
    rate : what follows the unit, as "/s"
    scale : factor and unit, instead of those that fit
    chart : more of the chart
    """
    over = abscissa(result)
    lines = [Line(over.values, values, name, nth(k), close=True) for k, (name, values) in enumerate(curves.items())] \
        if isinstance(curves, Mapping) else curves  # fmt: skip
    rows = [*(line.y for line in lines), *(edge for band in bands for edge in (band.low, band.high))]
    usual, most = usual_peak(ease(result), *rows), peak(*rows)
    factor, label = scale or prefixed(usual, unit)
    values = np.concatenate([row.ravel() for row in rows]) * factor if rows else np.empty(0)
    values = values[np.isfinite(values)]
    low, high = float(values.min(initial=0.0)), float(values.max(initial=0.0))
    varies = float(np.ptp(values)) if values.size else 0.0
    y, zero, cut = Axis(f"{title} [{label}{rate}]" if label else title), True, list[Mark]()
    if usual < most:
        y = replace(y, limits=(1.05 * max(low, -usual * factor), 1.05 * min(high, usual * factor)))
        cut.append(outside(most, unit + rate))
    elif 1e-9 * most * factor < varies < RIPPLE * most * factor:
        y, zero = replace(y, margin=0.1, count=5), False
    areas = [band._replace(low=band.low * factor, high=band.high * factor) for band in bands]
    drawn = [line.times(factor) for line in lines]
    return Chart(over, y, [*silent(result, over), *areas, *drawn, *marks, *cut], zero, **chart)


def silent(result: xr.Dataset, over: Abscissa, written: bool = True) -> list[Mark]:
    """Stripes where positions have no answer, each cause written once; hatched where a pin loses contact."""
    x, half, marks, causes = over.values, over.half_step, list[Mark](), set[str]()
    lost = [run for run in intervals(result, Status.CONTACT_LOST) if run.status == Status.CONTACT_LOST]
    for run in [*lost, *intervals(result)]:
        low, high = sorted((float(x[run.start]), float(x[run.stop - 1])))
        hatched = run in lost
        text = "not valid" if hatched else run.text.split(":")[0]
        look = Look("shade", hatch="////" if hatched else "", order=0.5)
        marks.append(Stripe(low - half, high + half, text if written and text not in causes else "", look))
        causes.add(text)
        if not hatched:
            marks += [Rule(end, None, Look("muted", 0.6, "short", order=0.6)) for end in (low - half, high + half)]
    return marks


# ---- which peaks are cut --------------------------------------------------------------------------------------------

UNCUT = "uncut"  # attribute of a result whose views cut nothing
UNBOUNDED = [int(status) for status in (Status.LOCKED, Status.SINGULAR, Status.NOT_ASSEMBLED)]
BESIDE = [int(Status.NEAR_SINGULAR), *UNBOUNDED]

GROWN = 5.0  # times what is usual: from here on a position may be next to one that has no bound
CLOSE = 50.0  # so much more friction than without it is close to locking, as a degree of transmission angle is
FASTEST = 4  # power of 1/distance that efforts grow with at most: those of masses, driven at constant speed
TOWERS = 4.0  # times the rest: lower peaks are shown whole
MARGIN = 1.25  # of the rest is shown of those that tower


def ease(result: xr.Dataset) -> Array:
    """(position,): 1, but next to a dead centre or to locking less, by as much as what forces grow with has grown.

    Next to it are positions at which the condition or the friction is GROWN times the usual one, in one run with a
    position that is near singular, or right beside one that is singular, locked or cannot be assembled.
    """
    status = column(result, "status")
    if status is None or UNCUT in result.attrs:
        return np.ones(result.sizes["position"])
    if "condition" not in result:
        return ease_of_status(result, status)
    condition, margin = np.asarray(result["condition"].values, float), column(result, "locking_margin")
    finite = condition[np.isfinite(condition)]
    friction = np.ones(status.size)  # how it feeds on its own reactions raises them: ∞ where it locks
    if margin is not None:
        more = 1.0 / np.maximum(margin - 1.0, 1e-300)
        friction = np.where(np.isinf(margin), 1.0, np.where(margin > 1.0, 1.0 + more, 1.0))
    grown = np.fmax(condition / float(np.median(finite)) if finite.size else 1.0, friction)
    grown = np.where(np.isfinite(grown), grown, 1.0)
    unbounded, core = np.isin(status, UNBOUNDED), np.isin(status, BESIDE) | (friction > CLOSE)
    within = (grown > GROWN) | unbounded
    # runs of positions within, each from one that is not: after the last of a closed turn comes the first
    first = int(np.argmin(within)) if abscissa(result).closed else 0
    runs = np.cumsum(np.diff(np.roll(within, -first), prepend=0) != 0)
    touched = np.isin(runs, np.unique(runs[np.roll(core & within, -first)]))
    near = np.roll(touched, first) & within & ~unbounded
    return np.where(near, GROWN / grown, 1.0)


def ease_of_status(result: xr.Dataset, status: NDArray[np.generic]) -> Array:
    """Where only the status is known: 0 where it is near singular or unbounded, else 1."""
    return np.where(np.isin(status, BESIDE) & (UNCUT not in result.attrs), 0.0, 1.0)


def whole_peaks(result: xr.Dataset, uncut: bool = True) -> xr.Dataset:
    """The result whose views cut no peak, if that is wanted."""
    return result.assign_attrs({UNCUT: 1}) if uncut else result


def peak(*columns: Array | None) -> float:
    """The greatest magnitude in all columns; 0 if none is finite."""
    sizes = [np.abs(values[np.isfinite(values)]).max(initial=0.0) for values in columns if values is not None]
    return float(max(sizes, default=0.0))


def usual_peak(easy: Array, *columns: Array | None) -> float:
    """The magnitude a view should show: the greatest, unless it is next to a dead centre and towers over all others.

    easy: of `ease`, (position,); columns: (…, position). What does not grow towards the dead centre as forces do is a
    load that works there, and all is shown.
    """
    rows = [np.abs(values) for values in columns if values is not None]
    if not rows:
        return 0.0
    shares = np.concatenate([np.broadcast_to(easy, row.shape).ravel() for row in rows])
    sizes = np.concatenate([row.ravel() for row in rows])
    finite = np.isfinite(sizes)
    shares, sizes = shares[finite], sizes[finite]
    most, rest = float(sizes.max(initial=0.0)), float(sizes[shares == 1.0].max(initial=0.0))
    works = float((sizes * shares**FASTEST).max(initial=0.0)) > 2.0 * rest
    return most if works or most <= TOWERS * rest or rest == 0.0 else MARGIN * rest

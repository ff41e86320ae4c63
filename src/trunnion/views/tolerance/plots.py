"""Panels of what tolerances do to a measure: its distribution, its envelope over the drive, how it converges."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.patches import Rectangle
from matplotlib.ticker import FuncFormatter, LogLocator, MaxNLocator, NullFormatter

from trunnion.statistics import intervals
from trunnion.views.common.cycle import Abscissa, Array
from trunnion.views.common.figures import INK, MUTED, PALETTE, SHADE, along, curve, dress, legend
from trunnion.views.common.lettering import plain
from trunnion.views.tolerance.readings import (
    OUTER,
    MeasureReading,
    failures,
    outer,
    rss_label,
    share,
    share_interval,
    share_parts,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import FigureBase

__all__ = ["convergence", "envelope", "histogram"]

WITHIN, BEYOND, LIMIT = PALETTE[0], PALETTE[1], "#a1260d"
LIMITED: dict[str, Any] = {"color": LIMIT, "linewidth": 1.3, "linestyle": (0, (1, 1.5))}
FEWEST, BARS = 20, 60  # of a histogram
CORE = 0.01  # share of the samples at either end beyond those
FAR = 1.5  # of their width, beyond which none decides how far the picture goes
READABLE = 0.02  # of nominal: a spread below it is drawn as a deviation
MEANINGS = {"mean": "mean", "deviation": "deviation σ"}


# ---- distribution -------------------------------------------------------------------------------------------------


def histogram(parent: FigureBase, read: MeasureReading) -> None:
    """Counts of the samples within and beyond the limits, with nominal, mean and the range of 99.73 %."""
    axes = parent.subplots()
    counts, edges = read.row("histogram"), read.row("edge")
    low, high = _core(counts, edges)
    shift, title = _zero(read, high - low)
    low, high = _window(read, low, high)
    counts, edges = _bars(counts, edges, low, high)
    x = (edges - shift) * read.factor
    dress(axes, plain(title), "samples")
    told = read.interval
    lower, upper = (read.nominal + end - shift for end in read.room)
    if read.limited:
        inside = axes.stairs(counts, x, fill=True, color=WITHIN, zorder=2.1, label=f"within {share_interval(*told)}")
        label = None if told[0] == 1.0 else f"{_lost(read)} {_beyond(*told)}"
        axes.stairs(counts, x, fill=True, color=BEYOND, zorder=2, label=label)
        left = max(lower * read.factor, x[0]) if math.isfinite(lower) else x[0]
        right = min(upper * read.factor, x[-1]) if math.isfinite(upper) else x[-1]
        window = Rectangle((left, 0), max(right - left, 0.0), 2 * float(counts.max()), transform=axes.transData)
        inside.set_clip_path(window)
    else:
        axes.stairs(counts, x, fill=True, color=WITHIN, label="samples", zorder=2)
    axes.set_xlim((low - shift) * read.factor, (high - shift) * read.factor)
    axes.set_ylim(0, 1.06 * max(float(counts.max(initial=0.0)), 1.0))
    axes.yaxis.set_major_locator(MaxNLocator(integer=True, nbins=6))
    _lines(axes, read, shift)
    _left_out(axes, read, low, high)
    legend(axes, most=3)


def _lost(read: MeasureReading) -> str:
    """What the yield leaves out."""
    return "beyond, or failed," if any(count for _, count in failures(read.result)) else "beyond"


def _beyond(passed: float, low: float, high: float) -> str:
    """The share that the limits leave out, with the digits of the yield."""
    return share(1 - passed, share_parts(passed, low, high)[2])


def _core(counts: Array, edges: Array) -> tuple[float, float]:
    """Where the samples lie, without what lies far beyond nearly all of them."""
    filled = np.flatnonzero(counts)
    if not filled.size:
        return float(edges[0]), float(edges[-1])
    ends, total = edges[[filled[0], filled[-1] + 1]], np.append(0.0, np.cumsum(counts))
    low, high = np.interp([CORE * total[-1], (1 - CORE) * total[-1]], total, edges)
    room = FAR * (high - low)
    return max(float(ends[0]), low - room), min(float(ends[1]), high + room)


def _window(read: MeasureReading, low: float, high: float) -> tuple[float, float]:
    """Ends of the axis: the core, and what lies within one more width of it to either side: limits, nominal."""
    width = high - low or abs(high) or 1.0
    marks = [read.nominal, *(read.nominal + end for end in read.room)]
    near = [one for one in marks if low - width < one < high + width]
    low, high = min([low, *near]), max([high, *near])
    margin = 0.04 * (high - low)
    return (low if read.is_size and low <= 0 else low - margin), high + margin


def _zero(read: MeasureReading, width: float) -> tuple[float, str]:
    """What is subtracted from the figures, and the title of the axis: a narrow spread is told as a deviation."""
    if not abs(read.nominal) > 0 or width > READABLE * abs(read.nominal):
        return 0.0, read.titled
    unit = f" [{read.label}]" if read.label else ""
    return read.nominal, f"deviation of {read.name} from nominal {read.say(read.nominal)}{unit}"


def _bars(counts: Array, edges: Array, low: float, high: float) -> tuple[Array, Array]:
    """The counts over some 20 to 60 even bars in the picture, the more the more samples there are."""
    seen = np.flatnonzero((edges[1:] > low) & (edges[:-1] < high))
    widths = np.diff(edges)[seen]
    wanted = int(np.clip(np.sqrt(counts.sum()), FEWEST, BARS))
    if not widths.size or seen.size <= 1.5 * wanted:
        return counts, edges
    if np.ptp(widths) <= 0.01 * widths.max():  # even: some of them together
        some = max(round(seen.size / wanted), 1)
        starts = np.arange(seen[0] % some, len(counts) - some + 1, some)
        return np.add.reduceat(counts[: starts[-1] + some], starts), edges[np.append(starts, starts[-1] + some)]
    even = np.linspace(low, high, wanted + 1)
    total = np.interp(even, edges, np.append(0.0, np.cumsum(counts)))
    return np.diff(total), even


def _lines(axes: Axes, read: MeasureReading, shift: float) -> None:
    """Upright lines: limits, nominal, mean, ends of the range of 99.73 %."""

    def upright(value: float, label: str | None, **look: Any) -> None:
        place = (value - shift) * read.factor
        if axes.get_xlim()[0] <= place <= axes.get_xlim()[1]:
            axes.axvline(place, label=label, zorder=3, **look)

    limits = [read.nominal + end for end in read.room if math.isfinite(end)]
    for k, end in enumerate(limits):
        upright(end, None if k else f"limit{'s' if len(limits) > 1 else ''} {read.told_limits}", **LIMITED)
    if read.has("nominal") and not read.is_size:
        upright(read.nominal, f"nominal {read.say(read.nominal)}", color=INK, linewidth=1.3)
    mean = read.value("mean")
    upright(mean, f"mean {read.say(mean)}", color=INK, linewidth=1.3, linestyle=(0, (5, 2)))
    ends = outer(read) or ()
    if ends:
        text = f"99.73 %: {read.say(ends[0])} to {read.say(ends[1])}"
        for k, end in enumerate(ends):
            upright(end, None if k else text, color=MUTED, linewidth=1.0, linestyle=(0, (2, 1.5)))


def _left_out(axes: Axes, read: MeasureReading, low: float, high: float) -> None:
    """How many samples lie outside the picture."""
    counts, edges = read.row("histogram"), read.row("edge")
    outside = int(counts[(edges[1:] <= low) | (edges[:-1] >= high)].sum())
    if not outside:
        return
    least, most = read.value("least"), read.value("most")
    ends = [f"down to {read.say(least)}"] if least < low else []
    ends += [f"up to {read.say(most)}"] if most > high else []
    text = f"{outside:,} sample{'s' if outside > 1 else ''} outside, {' and '.join(ends)}"
    box = {"boxstyle": "round,pad=0.2", "facecolor": "white", "edgecolor": "none", "alpha": 0.85}
    axes.text(0.99, 0.97, text, transform=axes.transAxes, ha="right", va="top", fontsize=8, color=MUTED, bbox=box,
              zorder=4)  # fmt: skip


# ---- envelope -----------------------------------------------------------------------------------------------------


def envelope(parent: FigureBase, read: MeasureReading) -> None:
    """Deviation of the course from nominal over the drive: worst case, bands of the samples, RSS, limits."""
    assert read.places is not None
    axes, over = parent.subplots(), read.places[0]
    unit = f" [{read.label}]" if read.label else ""
    along(axes, over, plain(f"deviation of {read.course or read.name}{unit}"))
    _holes(axes, over, read)
    if read.has("curve_worst_case_upper"):
        ends = [read.along(read.row(f"curve_worst_case_{end}")) for end in ("lower", "upper")]
        _band(axes, over, ends, "worst case, linear", color=PALETTE[4], alpha=0.16, zorder=1)
        for end in ends:
            curve(axes, over, end, None, color=MUTED, linewidth=0.9)
    _bands(axes, over, read)
    if read.has("curve_rss"):
        rss = read.along(read.row("curve_rss"))
        middle = read.along(read.row("curve_shift")) if read.has("curve_shift") else 0.0
        for k, sign in enumerate((1, -1)):
            curve(
                axes,
                over,
                middle + sign * rss,
                None if k else rss_label(read),
                color=INK,
                linewidth=1.1,
                linestyle=(0, (5, 2)),
            )
    _corner(axes, over, read)
    limits = [one for one in read.limits if math.isfinite(one)] if read.limits_course else []
    for k, one in enumerate(limits):
        axes.axhline(one * read.factor, label=None if k else f"limits {read.told_limits}", **LIMITED)
    axes.margins(y=0.07)
    # beside two other figures "RSS, uncorrelated" is cut off at the end of one row
    legend(axes, most=4, room=75 if read.correlated else 90)


def _closed(over: Abscissa, values: Array, more: float = 0.0) -> Array:
    return np.append(values, values[0] + more) if over.closed else values


def _band(axes: Axes, over: Abscissa, ends: list[Array], label: str | None, **look: Any) -> None:
    x = _closed(over, over.values, over.period)
    low, high = (_closed(over, end) for end in ends)
    axes.fill_between(x, low, high, label=label, linewidth=0, **look)


def _bands(axes: Axes, over: Abscissa, read: MeasureReading) -> None:
    """Ranges that hold 99.73 % and 90 % of the samples at each position."""
    if not read.has("band"):
        return
    levels = np.asarray(read.result["quantile"].values, float)
    band = read.row("band")
    if str(read.result["band"].attrs.get("of", "deviation")) == "value":
        band = band - read.row("curve")
    for (low, high), alpha, text in ((OUTER, 0.28, "99.73 % of the samples"), ((0.05, 0.95), 0.45, "90 %")):
        rows = [int(np.argmin(np.abs(levels - one))) for one in (low, high)]
        _band(axes, over, [read.along(band[row]) for row in rows], text, color=WITHIN, alpha=alpha, zorder=1.2)
    middle = int(np.argmin(np.abs(levels - 0.5)))
    curve(axes, over, read.along(band[middle]), None, color=WITHIN, linewidth=1.0)


def _corner(axes: Axes, over: Abscissa, read: MeasureReading) -> None:
    """The worst corner of the nonlinear model, where the figure is the largest deviation over the drive."""
    ends = [read.value(f"searched_{end}") for end in ("lower", "upper")]
    found = max(ends, key=abs)
    if read.nominal != 0.0 or not math.isfinite(sum(ends) + read.place) or found == 0.0:
        return
    label = f"worst corner, searched: {read.say(found, sign=True)} at {read.told_place}"
    axes.plot([read.place], [found * read.factor], "D", color=INK, markersize=5, label=label, zorder=5,
              markerfacecolor="white", markeredgewidth=1.3)  # fmt: skip


def _holes(axes: Axes, over: Abscissa, read: MeasureReading) -> None:
    """Grey where the nominal mechanism has no answer."""
    assert read.places is not None
    x, picked = over.values, read.places[1]
    for k in (k for k, index in enumerate(picked) if index < 0):
        axes.axvspan(x[k - 1], x[k + 1], color=SHADE, linewidth=0, zorder=0.5)
        axes.text(
            x[k], 0.5, "not solved", transform=axes.get_xaxis_transform(), rotation=90, ha="center", va="center",
            fontsize=8, color=MUTED, zorder=3, clip_on=True,
        )  # fmt: skip


# ---- convergence --------------------------------------------------------------------------------------------------


def convergence(parent: FigureBase, read: MeasureReading) -> None:
    """Mean, standard deviation and yield of the first samples, 2ᵏ of them, with their 95 % intervals."""
    size, told = read.row("convergence_samples"), ["mean", "deviation", *(["yield"] if read.limited else [])]
    panels = list(parent.subplots(len(told), 1, sharex=True, squeeze=False)[:, 0])
    unit = f" [{read.label}]" if read.label else ""
    for axes, key in zip(panels, told, strict=True):
        title, factor = (f"{MEANINGS[key]}{unit}", read.factor) if key != "yield" else ("yield [%]", 100.0)
        values = read.row(f"convergence_{key}")
        low, high = _intervals(read, key, values, size)
        dress(axes, "", plain(title))
        _running(axes, size, values * factor, low * factor, high * factor)
    for axes in panels:
        axes.set_xscale("log")
        axes.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0) if size[-1] < 50 * size[0] else (1.0,)))
        axes.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:,.0f}".replace(",", "\u202f")))
        axes.xaxis.set_minor_formatter(NullFormatter())
        axes.yaxis.set_major_locator(MaxNLocator(nbins=4))
        axes.ticklabel_format(axis="y", useOffset=False)
    panels[-1].set_xlabel("samples", fontsize=9, color=INK)
    legend(panels[0])


def _is_plain(read: MeasureReading) -> bool:
    """Whether the samples are independent, so that an interval shrinks with the root of their number."""
    return str(read.result.attrs.get("sampling", "monte-carlo")) == "monte-carlo"


def _intervals(read: MeasureReading, key: str, values: Array, size: Array) -> tuple[Array, Array]:
    """95 % intervals at every number of samples; of other than independent ones only of the last, as it is told."""
    low, high = read.value(f"{key}_low"), read.value(f"{key}_high")
    if not _is_plain(read):
        last = np.arange(len(size)) == len(size) - 1
        return np.where(last, low, np.nan), np.where(last, high, np.nan)
    if key == "yield":
        found = intervals.share(np.rint(values * size), size)
        return np.asarray(found[0], float), np.asarray(found[1], float)
    half = 0.5 * (high - low) * np.sqrt(size[-1] / size)
    return values - half, values + half


def _running(axes: Axes, size: Array, values: Array, low: Array, high: Array) -> None:
    axes.plot(size, values, color=WITHIN, linewidth=1.6, marker="o", markersize=3.2, label="of the first samples")
    known = np.isfinite(low)
    if known.sum() > 1:
        axes.fill_between(size, low, high, color=WITHIN, alpha=0.18, linewidth=0, label="95 % interval")
    elif known.any():
        middle, half = 0.5 * (low + high)[known], 0.5 * (high - low)[known]
        axes.errorbar(size[known], middle, yerr=half, color=WITHIN, capsize=4, linewidth=1.3, fmt="none",
                      label="95 % interval")  # fmt: skip
    last = values[np.isfinite(values)]
    if last.size:
        axes.axhline(last[-1], color=MUTED, linewidth=0.8, linestyle=(0, (3, 2)), zorder=1.5)

"""What tolerances do to measures, as tables of texts for the terminal and the report."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from trunnion.results.quantities import drawn_in, joined, number
from trunnion.views.common.cycle import names
from trunnion.views.common.table import TextTable
from trunnion.views.tolerance.readings import (
    ContributionRow,
    MeasureReading,
    failures,
    fixed,
    outer,
    readings,
    rss_label,
    share,
    share_interval,
    share_parts,
)
from trunnion.views.tolerance.readings import with_unit as limits_of

if TYPE_CHECKING:
    import xarray as xr

__all__ = [
    "TextTable",
    "contributions",
    "corners",
    "failed",
    "figures",
    "headline",
    "indices",
    "inputs",
    "overall",
    "overview",
    "tables",
]

MOST_HEADS = 6
LEAST, LEAST_INDEX = 1e-3, 5e-3  # shares below which a number has no row of its own in the terminal
MOST = 20  # rows of contributions there


Cells = dict[str, str]  # text by column; a column without any text is left out
COLUMNS = {"linear": "linear", "searched": "searched", "sampled": "samples", "interval": "95 % interval"}


def tables(result: xr.Dataset) -> list[TextTable]:
    """Of each measure its figures and contributions; then the samples that failed, and the yield of all limits."""
    found = []
    for read in readings(result):
        found.append(figures(read))
        if read.contributions and read.has("contribution_worst_case"):
            found.append(contributions(read, short=True))
        if read.has("total_order"):
            found.append(indices(read, short=True))
    return [*found, *failed(result), *overall(result)]


# ---- figures of a measure -------------------------------------------------------------------------------------------


def figures(read: MeasureReading) -> TextTable:
    """Nominal, worst case, RSS, deviation, range, yield and capability, a column for each method."""
    told = [(_label(read, label), tell(read)) for label, tell in FIGURES]
    rows = [(label, cells) for label, cells in told if any(cells.values())]
    if not rows:  # findings say why
        return TextTable(heading(read), ["", "linear"], [["nominal", "undefined"]])
    shown = [key for key in COLUMNS if any(cells.get(key) for _, cells in rows)]
    head = ["", *(_sampling(read) if key == "sampled" else COLUMNS[key] for key in shown)]
    return TextTable(heading(read), head, [[label, *(cells.get(key, "") for key in shown)] for label, cells in rows])


def _label(read: MeasureReading, label: str) -> str:
    """The label of a row; RSS says that it leaves correlation out."""
    return rss_label(read) if label == "RSS" else label


def heading(read: MeasureReading) -> str:
    """Name, what it is, and its limits."""
    about = f"{read.name}: {read.text}" if read.text else read.name
    return f"{about}; limits {read.told_limits}" if read.limited else about


def _sampling(read: MeasureReading) -> str:
    plain = str(read.result.attrs.get("sampling", "monte-carlo")) == "monte-carlo"
    return "Monte Carlo" if plain else "quasi-Monte Carlo"


def _interval(read: MeasureReading, key: str) -> str:
    low, high = read.value(f"{key}_low"), read.value(f"{key}_high")
    if math.isnan(low) or math.isnan(high):
        return ""
    return _between(read, low, high)


def _told(read: MeasureReading, key: str) -> str:
    value = read.value(key)
    return "" if math.isnan(value) else read.say(value)


def _nominal(read: MeasureReading) -> Cells:
    at = f" at {read.told_place}" if read.is_extreme and read.nominal != 0.0 and read.told_place else ""
    return {"linear": f"{_told(read, 'nominal')}{at}"}


def _mean(read: MeasureReading) -> Cells:
    shift = read.value("shift_linear")
    linear = "" if math.isnan(shift) or read.is_size else read.say(read.nominal + shift)
    return {"linear": linear, "sampled": _told(read, "mean"), "interval": _interval(read, "mean")}


def _deviation(read: MeasureReading) -> Cells:
    linear = "" if read.is_size else _told(read, "deviation_linear")
    return {"linear": linear, "sampled": _told(read, "deviation"), "interval": _interval(read, "deviation")}


def _range(read: MeasureReading, low: float, high: float) -> str:
    """Deviations from nominal as limits are told: "±0.2375°", "−0.1732 to +0.1599°"; one end if there is but one."""
    if math.isnan(low) and math.isnan(high):
        return ""
    upper = read.say(high, sign=True)
    if low == 0.0 and read.nominal == 0.0:
        return read.say(high)
    if upper.startswith("+") and read.say(-low, sign=True) == upper:
        return f"±{upper[1:]}"
    sign = "+" if low > 0 else ""
    return f"{sign}{fixed(low * read.factor, read.decimals)} to {upper}"


def _between(read: MeasureReading, low: float, high: float) -> str:
    """Two values with their unit once."""
    return f"{fixed(low * read.factor, read.decimals)} to {read.say(high)}"


def _worst(read: MeasureReading) -> Cells:
    found = {
        column: _range(read, read.value(f"{key}_lower"), read.value(f"{key}_upper"))
        for column, key in (("linear", "worst_case"), ("searched", "searched"))
    }
    return found


def _extremes(read: MeasureReading) -> Cells:
    """Of the samples, as deviations from nominal."""
    least, most = read.value("least"), read.value("most")
    if read.is_size:
        return {"sampled": "" if math.isnan(most) else read.say(most)}
    return {"sampled": _range(read, least - read.nominal, most - read.nominal)}


def _rss(read: MeasureReading) -> Cells:
    value = read.value("rss")
    return {"linear": "" if math.isnan(value) else f"±{read.say(value)}"}


def _outer(read: MeasureReading) -> Cells:
    """The range of 99.73 %, of the measure itself."""
    ends = outer(read)
    text = "" if ends is None else _between(read, *ends)
    shift, sigma = read.value("shift_linear"), read.value("deviation_linear")
    if math.isnan(shift + sigma) or read.is_size:
        return {"sampled": text}
    middle = read.nominal + shift
    return {"linear": _between(read, middle - 3 * sigma, middle + 3 * sigma), "sampled": text}


def _yield(read: MeasureReading) -> Cells:
    value, low, high = read.interval
    if math.isnan(value) or not read.limited:
        return {}
    told, ends, _ = share_parts(value, low, high)
    return {"sampled": told, "interval": ends}


def _capability(key: str) -> Callable[[MeasureReading], Cells]:
    return lambda read: {"sampled": "" if math.isnan(read.value(key)) else number(read.value(key), 3)}


FIGURES: tuple[tuple[str, Callable[[MeasureReading], Cells]], ...] = (
    ("nominal", _nominal),
    ("mean", _mean),
    ("deviation σ", _deviation),
    ("worst case", _worst),
    ("RSS", _rss),
    ("extremes", _extremes),
    ("99.73 % range", _outer),
    ("yield", _yield),
    ("Cp", _capability("cp")),
    ("Cpk", _capability("cpk")),
)


# ---- contributions ----------------------------------------------------------------------------------------------


def contributions(read: MeasureReading, short: bool = False) -> TextTable:
    """Each toleranced number: its limits, sensitivity, worst case and shares, the largest first.

    short: without those that matter little, which are counted; names without their section.
    """
    found = read.contributions
    kept = [one for one in found if one.largest_share >= LEAST][:MOST] or found[:1]
    kept = kept if short and len(kept) < len(found) - 1 else found
    apart = read.shares_apart
    shares = {"share": "worst_share", "of RSS²": "rss_share"} | ({"of variance": "variance_share"} if apart else {})
    head = ["contribution", "tolerance", "sensitivity", "worst ±", *shares]
    rows = [
        [
            one.short if short else one.name, one.limits, _sensitivity(read, one), read.say(one.worst),
            *(share(getattr(one, key), 1) for key in shares.values()),
        ]
        for one in kept
    ]  # fmt: skip
    rest = [one for one in found if one not in kept]
    if rest:
        sums = (float(np.nansum([getattr(one, key) for one in rest])) for key in shares.values())
        scatters = any(abs(read.value(key)) > 0 for key in ("deviation", "searched_lower", "searched_upper"))
        none = "no effect to first order" if scatters and not any(one.worst for one in found) else "no effect"
        alike = none if all(one.worst == 0 for one in rest) else "small"
        rows.append([f"{len(rest)} others, {alike}", "", "", "", *(share(part, 1) for part in sums)])
    at = f" at {read.told_place}" if read.told_place else ""
    return TextTable(f"contributions to {read.name}{at}", head, rows)


def indices(read: MeasureReading, short: bool = False) -> TextTable:
    """Sobol indices with their 95 % intervals, the largest total first; short: without those below half a per cent."""
    rows = {key: [read.row(f"{key}{end}") for end in ("", "_low", "_high")] for key in ("first_order", "total_order")}
    total = np.where(np.isfinite(rows["total_order"][0]), rows["total_order"][0], -1.0)
    about = {one.name: one.short for one in read.contributions}
    paths = names(read.result, "parameter")
    order = [int(j) for j in np.argsort(-total, kind="stable") if not short or total[j] >= LEAST_INDEX]
    told = [
        [about[paths[j]] if short else paths[j], *(_share_of(*(row[j] for row in parts)) for parts in rows.values())]
        for j in order
    ]
    if len(order) < len(paths):
        told.append([f"{len(paths) - len(order)} others", "", ""])
    return TextTable(f"Sobol indices of {read.name}", ["share of the variance", "alone", "with interactions"], told)


def _share_of(value: float, low: float, high: float) -> str:
    text = share_interval(float(value), float(low), float(high))
    return text.replace("-", "−")


def _sensitivity(read: MeasureReading, one: ContributionRow) -> str:
    """Change of the measure by the number, in the units in which both are told: "0.01365 °/mm"."""
    if math.isnan(one.sensitivity):
        return "—"
    half = one.worst / abs(one.sensitivity) if one.sensitivity else math.nan  # so that the unit is that of the limits
    factor, shown = drawn_in(half if half > 0 else 1.0, one.unit)
    shown = shown.replace(" ", "\u00a0")
    unit = f"{read.label or '1'}/{shown}" if shown else read.label
    return f"{number(one.sensitivity * read.factor / factor)}\u00a0{unit}".rstrip("\u00a0")


def corners(read: MeasureReading) -> TextTable | None:
    """The numbers at which the searched worst case stands; None if it was not searched."""
    ends = [end for end in ("lower", "upper") if read.has(f"corner_{end}") and math.isfinite(_searched(read, end))]
    ends = [end for end in ends if _searched(read, end) != 0.0]
    if not ends:
        return None
    about = {one.name: one for one in read.contributions}
    head = ["worst corner", *(read.say(read.nominal + _searched(read, end)) for end in ends)]
    rows = [
        [path, *(value_text(float(read.row(f"corner_{end}")[j]), about[path].unit) for end in ends)]
        for j, path in enumerate(names(read.result, "parameter"))
        if about[path].worst != 0
    ]
    return TextTable(f"worst corners of {read.name}, of the nonlinear model", head, rows)


def _searched(read: MeasureReading, end: str) -> float:
    return read.value(f"searched_{end}")


def value_text(value: float, unit: str, digits: int = 8) -> str:
    """A toleranced number with its unit, lengths in mm, with all digits that a drawing would show."""
    if not math.isfinite(value):
        return "—"
    factor, shown = drawn_in(abs(value), unit)
    return joined(f"{value * factor + 0.0:.{digits}g}".replace("-", "−"), shown.replace(" ", "\u00a0"))


# ---- of the whole result --------------------------------------------------------------------------------------------


def overview(result: xr.Dataset) -> TextTable:
    """One row for each measure: what is asked and what comes out."""
    head = ["measure", "limits", "nominal", "worst case", "RSS", "mean", "deviation σ", "yield", "Cpk"]
    rows = []
    for read in readings(result):
        cells = {label: tell(read) for label, tell in FIGURES}
        worst = cells["worst case"].get("searched") or cells["worst case"].get("linear", "")
        told = [cells[label].get("sampled") or cells[label].get("linear", "") for label in head[5:]]
        rows.append([read.name, read.told_limits, cells["nominal"]["linear"], worst, cells["RSS"]["linear"], *told])
    head = [_label(read, label) for label in head for read in readings(result)[:1]]
    kept = [k for k in range(len(head)) if k == 0 or any(row[k] for row in rows)]
    return TextTable("measures", [head[k] for k in kept], [[row[k] for k in kept] for row in rows])


def headline(result: xr.Dataset) -> list[tuple[str, list[tuple[str, str]]]]:
    """What is read first: of each measure, at most MOST_HEADS, the yield, the nominal value and the worst case; then of
    all limits."""
    found = []
    reads = sorted(readings(result), key=lambda read: not read.limited)[:MOST_HEADS]
    for read in reads:
        cells = {label: tell(read) for label, tell in FIGURES}
        worst = cells["worst case"].get("searched") or cells["worst case"].get("linear", "")
        told = [(cells["yield"].get("sampled", ""), f"yield, {cells['yield'].get('interval', '')}")]
        order = "" if cells["worst case"].get("searched") else ", first order"
        told += [
            ("" if read.is_size else cells["nominal"]["linear"], "nominal"),
            (worst, f"worst case{order}" if read.is_size else f"worst-case deviation{order}"),
            (cells["Cpk"].get("sampled", ""), "Cpk"),
        ]
        kept = [pair for pair in told if pair[0]]
        found += [(read.name, kept)] if kept else []
    whole = _overall(result)
    return [*found, *([("All limits together", [(share_parts(*whole)[0], "yield")])] if whole else [])]


def failed(result: xr.Dataset) -> list[TextTable]:
    """Samples without figures, by cause; no table if there are none."""
    found = failures(result)
    if not found or not found[0][1]:
        return []
    count = int(result["samples"].values) if "samples" in result else 0
    rows = [[cause, f"{n:,}", share(n / count, 2) if count else ""] for cause, n in found]
    return [
        TextTable("failed samples: outside every limit, excluded from mean and quantiles", ["", "samples", ""], rows)
    ]


def overall(result: xr.Dataset) -> list[TextTable]:
    """The yield of all limits together, where there is more than one measure with limits."""
    whole = _overall(result)
    return [TextTable("all limits together", ["", "yield"], [["kept", share_interval(*whole)]])] if whole else []


def _overall(result: xr.Dataset) -> tuple[float, float, float] | None:
    """The yield of all limits and its interval."""
    if "yield_all" not in result or sum(read.limited for read in readings(result)) < 2:
        return None
    value, low, high = (float(result[f"yield_all{end}"].values) for end in ("", "_low", "_high"))
    return None if math.isnan(value) else (value, low, high)


def inputs(result: xr.Dataset) -> TextTable:
    """Every toleranced number: nominal, limits, standard deviation, shift of its mean."""
    read = readings(result)[0]
    about = {one.name: one for one in read.contributions}
    keys = ("parameter_nominal", "parameter_lower", "parameter_upper", "parameter_deviation", "parameter_shift")
    nominal, lower, upper, deviation, shift = (read.row(key) for key in keys)
    rows = []
    for j, path in enumerate(names(result, "parameter")):
        unit = about[path].unit
        told = [value_text(float(nominal[j]), unit), limits_of(float(lower[j]), float(upper[j]), unit, path)]
        told += [value_text(float(row[j]), unit, 4) if row.size else "" for row in (deviation, shift)]
        rows.append([path, *told])
    return TextTable(
        "toleranced parameters", ["number", "nominal", "limits", "standard deviation", "shift of mean"], rows
    )

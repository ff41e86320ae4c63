"""Views of a tolerance analysis: what a result holds of each measure, as tables, charts, figures and the page."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from itertools import product
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from trunnion.errors import Finding, MechanismError
from trunnion.results.attributes import attribute
from trunnion.results.quantities import number
from trunnion.views.axis import names
from trunnion.views.charts import Axis, Band, Bars, Chart, Legend, Line, Look, Mark, Note, Panel, Plot, Rule
from trunnion.views.curves import check_kind, silent
from trunnion.views.page import Section, Table, counts, page
from trunnion.views.readings import OUTER, MeasureReading, readings, share, share_interval, share_parts, value_text

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr

EXTREMES = ("maximum", "minimum", "largest")  # rules of figures that are taken where the course is extreme
APART = 5e-4  # two shares that differ by more are written each
LEAST, LEAST_INDEX = 1e-3, 5e-3  # shares below which a number has no row or bar, and no index of its own
MOST_ROWS, MOST_BARS, FEW_BARS = 20, 16, 4  # contributions with a row, a bar, a bar beside other measures


# ---- tables -------------------------------------------------------------------------------------------------------

COLUMNS = {"linear": "linear", "searched": "searched", "sampled": "samples", "interval": "95 % interval"}


def tables(result: xr.Dataset) -> list[Table]:
    """Of each measure its figures and contributions; then the samples that failed, and the yield of all limits."""
    reads = readings(result)
    parts = [table for read in reads for table in of_measure(read)]
    yields = _overall(result, reads)
    together = [Table("all limits together", ["", "yield"], [["kept", share_interval(*yields)]])] if yields else []
    return [*parts, *failed(result), *together]


def of_measure(read: MeasureReading) -> list[Table]:
    """Figures, contributions and Sobol indices, as there are."""
    title = read.heading + (f"; limits {read.limits_said}" if read.limits_said else "")
    parts = [figures(read).titled(title)]
    if not read.contributions.empty and read.has("contribution_worst_case"):
        parts.append(contributions(read))
    return [*parts, indices(read)] if read.has("total_order") else parts


def cells_of(read: MeasureReading) -> dict[str, dict[str, str]]:
    """Nominal, mean, deviation, worst case, RSS, extremes, range, yield and capability: a dict of the texts by column
    for each row."""
    shift, sigma = read.value("shift_linear"), read.value("deviation_linear")
    middle, rss = read.nominal + shift, read.written("rss")
    at = read.at_place if read.rule in EXTREMES and read.nominal != 0.0 else ""
    passed = share_parts(*read.interval("yield")) if read.limits_said and read.has("yield") else ("", "")
    rows = {
        "nominal": {"linear": f"{read.written('nominal')}{at}"},
        "mean": {"sampled": read.written("mean"), "interval": read.between(*read.interval("mean")[1:])},
        "deviation σ": {
            "sampled": read.written("deviation"), "interval": read.between(*read.interval("deviation")[1:])},
        "worst case": {
            column: read.deviations(read.value(f"{key}_lower"), read.value(f"{key}_upper"))
            for column, key in (("linear", "worst_case"), ("searched", "searched"))},
        read.rss_label: {"linear": f"±{rss}" if rss else ""},
        "extremes": {"sampled": read.deviations(*(read.value(key) - read.nominal for key in ("least", "most")))},
        "99.73 % range": {"sampled": read.between(*read.outer) if read.outer else ""},
        "yield": {"sampled": passed[0], "interval": passed[1]},
        **{label: {"sampled": number(read.value(key), 3) if read.has(key) else ""}
           for label, key in (("Cp", "cp"), ("Cpk", "cpk"))},
    }  # fmt: skip
    if read.is_size:  # not normally distributed about its nominal 0
        rows["extremes"] = {"sampled": read.written("most")}
    else:
        rows["mean"]["linear"] = "" if math.isnan(shift) else read.say(middle)
        rows["deviation σ"]["linear"] = read.written("deviation_linear")
        rows["99.73 % range"]["linear"] = read.between(middle - 3 * sigma, middle + 3 * sigma)
    return rows


def figures(read: MeasureReading) -> Table:
    """The figures of a measure, a column for each method; "undefined" where there are none, of which findings speak."""
    rows = {label: cells for label, cells in cells_of(read).items() if any(cells.values())}
    if not rows:
        return Table("results", ["", "linear"], [["nominal", "undefined"]])
    independent = read.result.attrs.get("sampling", "monte-carlo") == "monte-carlo"
    heads = COLUMNS | {"sampled": "Monte Carlo" if independent else "quasi-Monte Carlo"}
    texts = [[label, *(cells.get(key, "") for key in heads)] for label, cells in rows.items()]
    return Table("results", ["", *heads.values()], texts).without_empty()


def largest(read: MeasureReading, most: int) -> tuple[pd.DataFrame, pd.DataFrame]:
    """At most so many contributions that have a row or bar of their own, and the rest."""
    rows = read.contributions
    sizes = rows[["worst_share", "rss_share", "variance_share"]].abs().max(axis=1).fillna(0.0)
    count = max(min(int((sizes >= LEAST).sum()), most), 1)
    return rows[:count], rows[count:]


def contributions(read: MeasureReading) -> Table:
    """Each toleranced number: its limits, sensitivity, worst case and shares, the largest first; the small ones are
    counted."""
    large, rest = largest(read, MOST_ROWS)
    shares = {"share": "worst_share", "of RSS²": "rss_share"}
    if ((read.contributions["variance_share"] - read.contributions["rss_share"]).abs() > APART).any():
        shares["of variance"] = "variance_share"
    rows = [[row.short, row.limits, row.slope, read.say(row.worst), *(share(row[key], 1) for key in shares.values())]
            for _, row in large.iterrows()]  # fmt: skip
    if len(rest):
        effect = "no effect" if (rest["worst"] == 0).all() else "small"
        rows.append([f"{len(rest)} others, {effect}", "", "", "",
                     *(share(rest[key].sum(), 1) for key in shares.values())])  # fmt: skip
    head = ["contribution", "tolerance", "sensitivity", "worst ±", *shares]
    return Table(f"contributions to {read.name}{read.at_place}", head, rows)


def indices(read: MeasureReading) -> Table:
    """Sobol indices with their 95 % intervals, the largest total first; those below half a per cent are counted."""
    paths = names(read.result, "parameter")
    total = np.where(np.isfinite(read.row("total_order")), read.row("total_order"), -1.0)
    every = np.argsort(-total, kind="stable").tolist()
    order = [j for j in every if total[j] >= LEAST_INDEX] or every[:1]
    ends = [[read.row(f"{key}{end}") for end in ("", "_low", "_high")] for key in ("first_order", "total_order")]
    rows = [[read.contributions["short"][paths[j]], *(share_interval(*(float(row[j]) for row in key)) for key in ends)]
            for j in order]  # fmt: skip
    rows += [[f"{len(paths) - len(order)} others", "", ""]] if len(order) < len(paths) else []
    return Table(f"Sobol indices of {read.name}", ["share of the variance", "alone", "with interactions"], rows)


def corners(read: MeasureReading) -> list[Table]:
    """The numbers at which the searched worst case stands; no table if it was not searched."""
    searched = {end: read.value(f"searched_{end}") for end in ("lower", "upper") if read.has(f"corner_{end}")}
    searched = {end: value for end, value in searched.items() if math.isfinite(value) and value != 0.0}
    about = read.contributions.loc[names(read.result, "parameter")]
    rows = [
        [path, *(value_text(float(read.row(f"corner_{end}")[j]), row.unit) for end in searched)]
        for j, (path, row) in enumerate(about.iterrows())
        if row.worst != 0
    ]
    head = ["worst corner", *(read.say(read.nominal + value) for value in searched.values())]
    return [Table(f"worst corners of {read.name}, of the nonlinear model", head, rows)] if searched else []


def overview(reads: Sequence[MeasureReading]) -> Table:
    """A row for each measure: what is asked and what comes out."""
    rows, label = [], ""
    for read in reads:
        cells, label = cells_of(read), read.rss_label
        worst = cells["worst case"].get("searched") or cells["worst case"].get("linear", "")
        sampled = [cells[key].get("sampled") or cells[key].get("linear", "")
                   for key in ("mean", "deviation σ", "yield", "Cpk")]  # fmt: skip
        rows.append([read.name, read.limits_said, cells["nominal"]["linear"], worst, cells[label]["linear"],
                     *sampled])  # fmt: skip
    head = ["measure", "limits", "nominal", "worst case", label, "mean", "deviation σ", "yield", "Cpk"]
    return Table("measures", head, rows).without_empty()


def failed(result: xr.Dataset) -> list[Table]:
    """Samples without figures, by cause, all together first; no table if there are none."""
    if "failed" not in result or not result["failed"].any():
        return []
    tally = dict(zip(names(result, "cause"), np.asarray(result["failed"].values).astype(int).tolist(), strict=True))
    tally = {"all": tally.pop("all", sum(tally.values())), **tally}
    count = int(result["samples"].values) if "samples" in result else 0
    rows = [[cause.replace("_", " ").split(":")[0], f"{n:,}", share(n / count, 2) if count else ""]
            for cause, n in tally.items() if n]  # fmt: skip
    return [Table("failed samples: outside every limit, excluded from mean and quantiles", ["", "samples", ""], rows)]


def _overall(result: xr.Dataset, reads: Sequence[MeasureReading]) -> tuple[float, float, float] | None:
    """The yield of all limits and its interval, where more than one measure has limits."""
    if "yield_all" not in result or sum(bool(read.limits_said) for read in reads) < 2:
        return None
    value, low, high = (float(result[f"yield_all{end}"].values) for end in ("", "_low", "_high"))
    return None if math.isnan(value) else (value, low, high)


def inputs(read: MeasureReading) -> Table:
    """Every toleranced number: nominal, limits, standard deviation, shift of its mean."""
    keys = ("parameter_nominal", "parameter_deviation", "parameter_shift")
    nominal, *others = (read.row(key) for key in keys)
    about = read.contributions.loc[names(read.result, "parameter")]
    rows = [
        [path, value_text(float(nominal[j]), row.unit), row.limits,
         *(value_text(float(values[j]), row.unit, 4) if values.size else "" for values in others)]
        for j, (path, row) in enumerate(about.iterrows())
    ]  # fmt: skip
    return Table("toleranced parameters", ["number", "nominal", "limits", "standard deviation", "shift of mean"], rows)


# ---- charts -------------------------------------------------------------------------------------------------------

WITHIN, BEYOND = 0, 1
LIMIT = Look("limit", 1.3, "dotted", order=3)
FEWEST, MOST = 20, 60  # bars of a histogram
READABLE = 0.02  # of nominal: a spread below it is drawn as a deviation
INSIDE = 0.14  # share of a bar that holds its number
NAME = 34  # characters of a name beside a bar: the end of a longer one, by which those of one folder differ


def histogram(read: MeasureReading) -> Panel:
    """Counts of the samples within and beyond the limits, with nominal, mean and the range of 99.73 %."""
    tally, edges = read.row("histogram"), read.row("edge")
    starts = np.arange(0, len(tally), max(round(len(tally) / np.clip(np.sqrt(tally.sum()), FEWEST, MOST)), 1))
    heights, bins = np.add.reduceat(tally, starts), np.append(edges[starts], edges[-1])
    low, high = float(bins[0]), float(bins[-1])
    shift, title = 0.0, f"{read.name}{read.in_unit}"
    if 0 < high - low <= READABLE * abs(read.nominal) or (low == high and read.nominal):
        shift, title = read.nominal, f"deviation of {read.name} from nominal {read.say(read.nominal)}{read.in_unit}"
    limits = [read.nominal + end for end in read.room]
    x = np.unique([*bins, *np.clip(limits, low, high)])  # the bars, cut at the limits
    sizes = heights[np.clip(np.searchsorted(bins, x, side="right") - 1, 0, len(heights) - 1)]
    inside = np.ones(len(x), bool)
    if len(x) > 1:
        middles = (x[:-1] + x[1:]) / 2
        inside = np.append((middles >= limits[0]) & (middles <= limits[1]), False)
        inside[-1] = inside[-2]
    passed, zero = read.interval("yield"), np.zeros(len(x))
    name = f"within {share_interval(*passed)}" if read.limits_said else "samples"
    places = (x - shift) * read.factor
    marks: list[Mark] = [Band(places, zero, np.where(inside, sizes, 0.0), name, Look(WITHIN, order=2.1), steps=True)]
    if read.limits_said:
        lost = "beyond, or failed," if failed(read.result) else "beyond"
        text = None if passed[0] == 1.0 else f"{lost} {share(1 - passed[0])}"
        marks.append(Band(places, zero, np.where(inside, 0.0, sizes), text, Look(BEYOND), steps=True))
    ends, finite = read.outer or (), [limit for limit in limits if math.isfinite(limit)]
    lines = [(limit, f"limit{'s' * (len(finite) > 1)} {read.limits_said}", LIMIT) for limit in finite]
    if read.has("nominal") and not read.is_size:
        lines.append((read.nominal, f"nominal {read.say(read.nominal)}", Look("ink", 1.3, order=3)))
    lines.append((read.value("mean"), f"mean {read.say(read.value('mean'))}", Look("ink", 1.3, "long", order=3)))
    lines += [(end, f"99.73 %: {' to '.join(map(read.say, ends))}", Look("muted", 1.0, "short", order=3))
              for end in ends]  # fmt: skip
    before = [text for _, text, _ in lines]
    marks += [Rule((at - shift) * read.factor, text if text not in before[:k] else None, look)
              for k, (at, text, look) in enumerate(lines)]  # fmt: skip
    width = high - low or abs(high) or 1.0
    near = [end for end in (low, high, read.nominal, *limits) if low - width < end < high + width]  # no limit far away
    margin = 0.04 * (max(near) - min(near))
    across = Axis(title, ((min(near) - margin - shift) * read.factor, (max(near) + margin - shift) * read.factor))
    upward = Axis("samples", (0, 1.06 * max(float(heights.max(initial=0.0)), 1.0)))
    return Panel("", [Chart(across, upward, marks)])


def contribution_bars(read: MeasureReading, most: int = MOST_BARS) -> Panel:
    """Share of each number in the sum of squares, sorted, with the running total, and beside it in the worst case."""
    large, rest = largest(read, most)
    labels = [f"{row.short if len(row.short) <= NAME else f'…{row.short[1 - NAME :]}'}  {row.limits}".rstrip()
              for _, row in large.iterrows()]  # fmt: skip
    labels += [f"{len(rest)} others"] if len(rest) else []
    rss, worst = (100 * np.array([*large[key], *([rest[key].sum()] if len(rest) else [])], float)
                  for key in ("rss_share", "worst_share"))  # fmt: skip
    at, running = np.arange(float(len(labels))), np.nancumsum(rss)
    marks: list[Mark] = [Bars(at - 0.17, rss, 0.4, read.rss_label.replace("RSS", "RSS²"), Look(0)),
                         Bars(at + 0.23, worst, 0.28, "worst case", Look("pale")),
                         Line(running, at - 0.17, "RSS², added up", Look("ink", 1.2, mark="o", size=3.5, order=3)),
                         Rule(0.0, None, Look("muted", 0.8))]  # fmt: skip
    for y, part in zip(at, rss, strict=True):
        inside = part > 100 * INSIDE
        if math.isfinite(part):
            marks.append(Note(f"{part:.1f}", float(part), y - 0.17, "right" if inside else "left", data=True, size=7.5,
                              colour="white" if inside else "ink", shift=(-6 if inside else 4, 0)))  # fmt: skip
    across = Axis("share [%]", (0.0, 1.04 * max([100.0, *running])))
    side = Axis("", (len(labels) - 0.4, -0.6), list(enumerate(labels)))  # names down the side, the largest on top
    chart = Chart(across, side, marks, legend=Legend(room=44), bare=True)
    return Panel("", [chart], max(1.4 + 0.34 * len(labels), 2.6))


def envelope(read: MeasureReading) -> Panel:
    """Deviation of the course from nominal over the drive: worst case, bands of the samples, RSS, limits."""
    assert read.over is not None
    over, x, factor = read.over, read.over.values, read.factor
    marks: list[Mark] = silent(read.result, over)
    if read.has("curve_worst_case_upper"):
        ends = [factor * read.row(f"curve_worst_case_{end}") for end in ("lower", "upper")]
        marks.append(Band(x, ends[0], ends[1], "worst case, linear", Look(4, alpha=0.16, order=1), close=True))
        marks += [Line(x, end, None, Look("muted", 0.9), close=True) for end in ends]
    if read.has("band"):
        levels, band = np.asarray(read.result["quantile"].values, float), factor * read.row("band")
        low, p5, median, p95, high = (band[int(np.argmin(np.abs(levels - level)))]
                                      for level in (OUTER[0], 0.05, 0.5, 0.95, OUTER[1]))  # fmt: skip
        wide, narrow = (Look(WITHIN, alpha=alpha, order=1.2) for alpha in (0.28, 0.45))
        marks += [Band(x, low, high, "99.73 % of the samples", wide, close=True),
                  Band(x, p5, p95, "90 %", narrow, close=True),
                  Line(x, median, None, Look(WITHIN, 1.0), close=True)]  # fmt: skip
    if read.has("curve_rss"):
        rss, middle = (factor * read.row(f"curve_{key}") for key in ("rss", "shift"))
        marks += [Line(x, (middle if middle.size else 0.0) + sign * rss, name, Look("ink", 1.1, "long"), close=True)
                  for sign, name in ((1, read.rss_label), (-1, None))]  # fmt: skip
    if read.nominal == 0.0 and read.rule in ("", "deviation", *EXTREMES):  # limits of the course, too
        limits = [limit for limit in read.limits if math.isfinite(limit)]
        marks += [Rule(limit * factor, None if k else f"limits {read.limits_said}", LIMIT, upright=False)
                  for k, limit in enumerate(limits)]  # fmt: skip
    title = f"deviation of {read.course or read.name}{read.in_unit}"
    return Panel("", [Chart(over, Axis(title, margin=0.07), marks, zero=True)], 3.8)


# ---- figures ------------------------------------------------------------------------------------------------------

MOST_PANELS = 6  # measures of a figure
TALL, SHORT = 16.0, 2.5  # heights of a whole sheet and of a panel on it, inches


class Kind(NamedTuple):
    """A kind of figure: its title, what draws it, whether a measure has it, and what to do if not."""

    title: str
    panel: Callable[[MeasureReading], Panel]
    ready: Callable[[MeasureReading], bool]
    remedy: str


KINDS: dict[str, Kind] = {
    "histogram": Kind("Distribution", histogram, lambda read: read.has("histogram"),
                      "add samples: --method monte-carlo"),
    "contributions": Kind("Contributions", contribution_bars, lambda read: read.has("contribution_rss"),
                          "add --method linear"),
    "envelope": Kind("Envelope over the drive", envelope, lambda read: read.over is not None,
                     "use a measure at every position instead of one position"),
}  # fmt: skip


def drawable(read: MeasureReading) -> list[str]:
    """The kinds of figures that a measure has something for."""
    return [name for name, kind in KINDS.items() if kind.ready(read)]


def figure(result: xr.Dataset, kind: str | None = None, measures: Sequence[str] | None = None) -> Plot:
    """One kind of figure, a panel for each measure that has it; all kinds, a row for each measure, if none is named.

    measures: at most MOST_PANELS, all if none is named. MechanismError if there is no such kind, or no measure has it.
    """
    if kind is not None:
        check_kind(kind, KINDS)
    reads = [read for read in readings(result) if (measures is None or read.name in measures)
             and (KINDS[kind].ready(read) if kind else drawable(read))]  # fmt: skip
    if len(reads) > MOST_PANELS:
        what = f"{len(reads)} measures do not fit one figure"
        raise MechanismError(Finding(what, "--out", f"name at most {MOST_PANELS} by --measure"))
    if not reads:
        what, remedy = (f" '{kind}'", KINDS[kind].remedy) if kind else ("", "add --method linear")
        raise MechanismError(Finding(f"no measure has a figure{what}", "--kind", remedy))
    if kind is not None:
        return _of_kind(kind, reads)
    if len(reads) == 1:
        panels = [replace(KINDS[name].panel(reads[0]), title=KINDS[name].title) for name in drawable(reads[0])]
        return Plot(reads[0].heading, panels, 2)
    kinds = [name for name, about in KINDS.items() if any(about.ready(read) for read in reads)]
    height, panels = max(min(3.3, TALL / len(reads)), SHORT), []
    for read, name in product(reads, kinds):
        panel = Panel("", [])
        if KINDS[name].ready(read):
            panel = contribution_bars(read, FEW_BARS) if name == "contributions" else KINDS[name].panel(read)
        panels.append(replace(panel, title=f"{read.name}: {KINDS[name].title.lower()}", height=height))
    return Plot("Effect of the tolerances", panels, len(kinds))


def _of_kind(kind: str, reads: Sequence[MeasureReading]) -> Plot:
    """One kind of figure of some measures, a panel for each."""
    title = KINDS[kind].title if len(reads) > 1 else f"{KINDS[kind].title}: {reads[0].name}"
    return Plot(title, [replace(KINDS[kind].panel(read), title=read.heading) for read in reads])


# ---- report -------------------------------------------------------------------------------------------------------


def report(result: xr.Dataset, first: Sequence[Section] = (), kicker: str = "Tolerance analysis of a linkage") -> str:
    """The whole report as HTML; first: parts that stand before those of the measures, as an allocation has them."""
    methods = [str(name) for name in attribute(result, "methods")]
    facts = counts((result.sizes["measure"], "measure"), (result.sizes["parameter"], "toleranced parameter"))
    if any("monte-carlo" in name for name in methods):
        count = int(result["samples"].values) if "samples" in result else int(result.attrs.get("samples", 0))
        facts += [*counts((count, "sample")), (f"seed {result.attrs.get('seed', '')}", "")]
    facts.append(("", ", ".join(method.replace("-", " ") for method in methods)))
    missed = [row for row in attribute(result, "findings") if row["severity"] == "error"]  # they stand first
    reads = readings(result)
    yields = _overall(result, reads)
    about = f"All limits together: yield {share_interval(*yields)}" if yields else ""
    parts = [Section("Measures", about, tables=[overview(reads), *failed(result)]), *first]
    for read in reads:
        about = f"{read.text}; limits {read.limits_said}" if read.limits_said else read.text
        pictures = [(f"{KINDS[kind].title} of {read.name}", _of_kind(kind, [read])) for kind in drawable(read)]
        first_two, after = (all_tables := [figures(read), *of_measure(read)[1:]])[:2], all_tables[2:]
        parts.append(Section(read.name, about, pictures, first_two, [*after, *corners(read)]))
    end = [Section("Toleranced parameters", tables=[inputs(reads[0])])]
    return page(result, kicker, facts, parts, missed=missed, end=end)

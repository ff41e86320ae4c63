"""Views of measured data: the tables of a measurement, and its comparison with a model, per condition and channel.

What was measured is drawn with its expanded uncertainty U, the model as a curve. Gaps stay gaps.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from pathlib import Path
from textwrap import wrap
from typing import TYPE_CHECKING

import numpy as np

from trunnion.errors import Finding, MechanismError, Status
from trunnion.model.names import nearest
from trunnion.results.attributes import attribute
from trunnion.results.quantities import joined, number, prefixed, with_uncertainty
from trunnion.rig.comparison import CAUSES, Verdict
from trunnion.rig.reading.measurement import Measurement, rms
from trunnion.views import sweep
from trunnion.views.axis import Abscissa, Array, names, over_turn
from trunnion.views.charts import Axis, Band, Chart, Legend, Line, Look, Mark, Panel, Plot, Stripe
from trunnion.views.curves import check_kind, nth, silent
from trunnion.views.page import NONE, Section, Summary, Table, counts, page
from trunnion.views.readings import plain, rounded
from trunnion.views.sweep import SIGNS, Scale

if TYPE_CHECKING:
    import xarray as xr

APART = 0.05  # of the range of a number: values nearer to each other are the same setting, each time a little off
TRIFLE = 0.005  # of a number: less is no change of a setting
KINDS = {"efficiency": "measured and modelled efficiency", "overlay": "signals with residuals"}
MOST_CONDITIONS = 40  # of the table of a measurement
MOST_PANELS = 6
MOST_NAMED = 8  # curves that a legend tells apart, conditions that an axis has room for
WIDE = 70  # characters along an axis
MOST_DRAWN = 6  # conditions of a channel in the report
MEASURED, MODEL = 0, 1
RESIDUAL = ["RMS", "largest", "at", "bias", "within ±U", "required", "correlation", "verdict"]


# ---- a measurement ------------------------------------------------------------------------------------------------


def measurement_tables(measurement: Measurement) -> list[Table]:
    """The conditions with the mean of each channel, then the channels with scatter and uncertainty over all of them."""
    conditions, channels = measurement.conditions, list(measurement.channels)
    units = {name: item.shown for name, item in measurement.channels.items()}  # of all files, whatever a file is in
    speeds = np.isfinite([item.speed for item in conditions]).any()
    head, short = shortened([item.name for item in conditions])
    settings_of = [head] if head == "condition" else head.split(", ")
    rows = []
    for item, name in list(zip(conditions, short, strict=True))[:MOST_CONDITIONS]:
        turns = max(course.turns.shape[0] for course in item.courses.values())
        means = (plain(_mean(item.courses[key].mean / units[key][1]), ".5g") if key in item.courses else ""
                 for key in channels)  # fmt: skip
        rows.append([*([name] if head == "condition" else name.split(", ")), f"{turns:,}",
                     *([f"{item.speed * 30 / np.pi:.5g}"] if speeds else []), *means])  # fmt: skip
    heads = [*settings_of, "turns", *(["speed rpm"] if speeds else []),
             *(f"{name} {_unit(units[name][0])}".strip() for name in channels)]  # fmt: skip
    if len(conditions) > MOST_CONDITIONS:
        rows.append([f"{len(conditions) - MOST_CONDITIONS} more", *[""] * (len(heads) - 1)])
    made = [Table(f"{measurement.name}\nconditions: mean over turns and positions", heads, rows)]
    rows = []
    for name in channels:
        courses = [item.courses[name] for item in conditions if name in item.courses]
        unit, factor = courses[0].shown
        every = np.concatenate([course.mean for course in courses]) / factor
        finite = every[np.isfinite(every)]
        extremes = [plain(float(finite.min()), ".5g"), plain(float(finite.max()), ".5g")] if finite.size else [NONE] * 2
        spreads = (rms(np.concatenate([getattr(course, figure) for course in courses])) / factor
                   for figure in ("scatter", "uncertainty"))  # fmt: skip
        rows.append([name, courses[0].measures, _unit(unit), *extremes,
                     *(plain(float(spread), ".3g") for spread in spreads)])  # fmt: skip
    title = "channels: mean signal, scatter of turns, standard uncertainty of the mean"
    return [*made, Table(title, ["channel", "measures", "unit", "least", "largest", "scatter", "uncertainty"], rows)]


def shortened(conditions: Sequence[str]) -> tuple[str, list[str]]:
    """Head of a column and its entries: "misalignment, input.speed" and "0 deg, 250 rpm", …

    A number keeps to its unit. Names that do not set the same numbers in the same order stay as they are, under
    "condition".
    """
    rows = [[part.partition(" ") for part in name.split(", ")] for name in conditions]
    keys = [[key for key, _, _ in row] for row in rows]
    if not rows or any(row != keys[0] for row in keys) or not all(value for row in rows for _, _, value in row):
        return "condition", list(conditions)
    return ", ".join(keys[0]), [", ".join(value.replace(" ", "\u00a0") for _, _, value in row) for row in rows]


def _mean(values: Array) -> float:
    finite = values[np.isfinite(values)]
    with np.errstate(over="ignore"):
        return float(finite.mean()) if finite.size else np.nan


def _unit(unit: str) -> str:
    """A unit that is not broken between lines."""
    return "" if unit == "1" else unit.replace(" ", "\u00a0")


# ---- settings and units -------------------------------------------------------------------------------------------


def verdict(result: xr.Dataset, channel: int, condition: int) -> str:
    """What the comparison of a channel in a condition came to."""
    code = int(result["verdict"].values[channel, condition])
    return next(member for member in Verdict if member == code).text


def settings(result: xr.Dataset) -> list[Scale]:
    """The numbers that were set, over the conditions, in the units that the model states them in."""
    rows = zip(names(result, "set"), attribute(result, "set_written"), result["value"].values, strict=True)
    return [Scale(name, SIGNS.get(unit, "" if unit == "1" else unit), values / factor + 0.0)
            for name, (unit, factor), values in rows]  # fmt: skip


def levels(values: Array) -> Array:
    """The settings among values that were measured and so are never quite the same: to each the mean of its own."""
    rising, means = np.sort(values[np.isfinite(values)]), np.full(values.shape, np.nan)
    if rising.size:
        step = max(APART * float(np.ptp(rising)), TRIFLE * float(np.abs(rising).max()))
        group = np.searchsorted(rising[1:][np.diff(rising) > step], values, side="right")
        for k in np.unique(group):
            alike = (group == k) & np.isfinite(values)
            means[alike] = values[alike].mean() if alike.any() else np.nan
    return means


def varied(result: xr.Dataset) -> list[Scale]:
    """The numbers that were set to several values, that with the most first."""
    sizes = [(len(np.unique(levels(scale.values)[np.isfinite(scale.values)])), scale) for scale in settings(result)]
    return [scale for count, scale in sorted(sizes, key=lambda pair: -pair[0]) if count > 1]


def label(result: xr.Dataset, condition: int) -> str:
    """The name of a condition, and what was set in it that is not in its name."""
    name = names(result, "condition")[condition]
    values = [f"{scale.name} {setting(scale.values[condition], scale.unit)}" for scale in varied(result)
              if scale.name not in name and np.isfinite(scale.values[condition])]  # fmt: skip
    return f"{name}: {', '.join(values)}" if values else name


def setting(value: float, unit: str) -> str:
    """What was set, with its unit: "15°", "62.83 rad/s"."""
    return joined(rounded(float(f"{value:.4g}")), _unit(unit))


def text(value: float, unit: str) -> str:
    """A number with three digits and its unit."""
    return joined(number(float(value), 3), _unit(unit))


def coverage_of(result: xr.Dataset) -> str:
    """The probability that ±U covers, in words: "95 %"."""
    return f"{100 * float(result.attrs['probability']):.3g}".replace("95.4", "95") + "\u00a0%"


def scale_of(result: xr.Dataset, channel: int, condition: int) -> tuple[float, str]:
    """Factor and unit that a channel is read in, in a condition; a speed in the unit of its file."""
    display_unit = str(attribute(result, "channel_units")[channel])
    unit, size = (attribute(result, "channel_read_in") or [["", 1.0]] * (channel + 1))[channel]
    if unit and display_unit == "rad/s":
        return 1 / size, str(unit)
    values = np.concatenate([result[name].values[channel, condition] for name in ("measured", "model")])
    return prefixed(float(np.nanmax(np.abs(values[np.isfinite(values)]), initial=0.0)), display_unit)


def drive(result: xr.Dataset, condition: int) -> Abscissa:
    """What the courses of a condition are drawn over, and whether they close."""
    values = np.asarray(result["drive"].values[condition], float)
    values = values[np.isfinite(values)]
    unit, name = str(result.attrs["drive_unit"]), str(result.attrs["drive_name"])
    factor, display_unit = prefixed(float(np.abs(values).max(initial=0.0)), unit)
    title = {"rad": f"drive angle {name}", "m": f"drive slide {name}", "s": "time"}[unit]
    even = values.size > 2 and np.ptp(np.diff(values)) <= 1e-6 * abs(values[1] - values[0])
    return over_turn(title, display_unit, values * factor, bool(even and int(result.attrs["periodic"])))


# ---- tables -------------------------------------------------------------------------------------------------------


def tables(result: xr.Dataset) -> list[Table]:
    """Results, what would explain the residuals, and efficiencies, as there are."""
    first = results(result).titled(f"{result.attrs['comparing']}: measured minus model")
    return [first, *explained(result), *efficiencies(result)]


def _by_condition(
    title: str, head: list[str], result: xr.Dataset, channel: int | None, cells: Callable[[int, int], list[str]]
) -> Table:
    """A row for each condition of all channels with their names, or of one; none where it has no cells."""
    channels, (first, short) = names(result, "channel"), shortened(names(result, "condition"))
    rows = [
        [name, *([channels[i]] if channel is None else []), *row]
        for k, name in enumerate(short)
        for i in (range(len(channels)) if channel is None else [channel])
        if (row := cells(i, k))
    ]
    return Table(title, [first, *(["channel"] if channel is None else []), *head], rows)


def results(result: xr.Dataset, channel: int | None = None) -> Table:
    """Residual and verdict of every channel in every condition, or of one channel."""
    keys = ("rms", "largest", "bias", "bias_expanded", "within", "within_least", "correlation", "largest_at")

    def cells(i: int, k: int) -> list[str]:
        if not result["turns"].values[i, k]:
            return []
        *sizes, wide, within, least, alike, at = (float(result[key].values[i, k]) for key in keys)
        factor, unit = scale_of(result, i, k)
        errors, largest, bias = (text(value * factor, unit) if np.isfinite(value) else NONE for value in sizes)
        if np.isfinite(sizes[2] + wide):
            bias = with_uncertainty(sizes[2] * factor, wide * factor, unit).replace("-", "−").replace(" ", "\u00a0")
        turned, display_unit = prefixed(at, str(result.attrs["drive_unit"]))
        place = setting(at * turned, display_unit) if np.isfinite(at) else NONE
        shares = (plain(100 * part, ".1f", "%") for part in (within, least))
        return [errors, largest, place, bias, *shares, plain(alike, ".4f"), verdict(result, i, k)]

    return _by_condition("results", RESIDUAL, result, channel, cells)


def explained(result: xr.Dataset, channel: int | None = None) -> list[Table]:
    """What would explain each residual beyond U: size and share, of all channels or of one; no table if nothing."""

    def cells(i: int, k: int) -> list[str]:
        causes = []
        for kind in CAUSES:  # errors that would explain it, with the share that they explain
            size, part = (float(result[f"{kind}_{what}"].values[i, k]) for what in ("error", "explains"))
            factor, unit = {"zero": scale_of(result, i, k), "angle": (180 / math.pi, "°")}.get(kind, (100.0, "%"))
            sized = f"{'+' if size > 0 else ''}{text(size * factor, unit)} ({100 * part:.1f}\u00a0%)"
            causes.append(sized if np.isfinite(size) else NONE)
        return causes if any(cause != NONE for cause in causes) else []

    table = _by_condition("what would explain the residual, each by itself", [*CAUSES], result, channel, cells)
    return [table] if table.rows else []


def verdicts(result: xr.Dataset) -> Table:
    """The verdict of every channel in every condition."""
    channels, (head, short) = names(result, "channel"), shortened(names(result, "condition"))
    rows = [[name, *(verdict(result, i, k) if result["turns"].values[i, k] else NONE for i in range(len(channels)))]
            for k, name in enumerate(short)]  # fmt: skip
    return Table("verdicts", [head, *channels], rows)


def efficiencies(result: xr.Dataset) -> list[Table]:
    """Measured efficiency with U beside the model's; no table if it was not measured."""
    if "efficiency" not in result:
        return []
    words = {1: "within", 0: "not within", -1: "unknown"}
    first, short = shortened(names(result, "condition"))
    keys = ("efficiency", "efficiency_expanded", "efficiency_model", "efficiency_within")
    rows = [[name, *(plain(value, ".4f") for value in (m, u, c, m - c)), words[int(within)]]
            for name, m, u, c, within in zip(short, *(result[key].values for key in keys), strict=True)]  # fmt: skip
    head = [first, "η measured", f"U ({coverage_of(result)})", "η model", "difference", "model within ±U"]
    return [Table("efficiency", head, rows)]


def conditions(result: xr.Dataset) -> Table:
    """What was set in every condition, in how many turns it was measured, and where the data are."""
    scales, sources, rows = settings(result), attribute(result, "condition_files"), []
    for k, name in enumerate(names(result, "condition")):
        values = [setting(s.values[k], s.unit) if np.isfinite(s.values[k]) else NONE for s in scales]
        turns = result["turns"].values[:, k]
        ends = dict.fromkeys([str(int(turns.min())), str(int(turns.max()))])
        files_of = [file.replace("\\", "/").rsplit("/", 1)[-1] for file in sources[k]] if sources else []
        rows.append([name, *values, " to ".join(ends), ", ".join(files_of) or NONE])
    return Table("conditions", ["condition", *(scale.name for scale in scales), "turns", "file"], rows)


def sensors(result: xr.Dataset) -> Table:
    """What each channel measures, with the standard uncertainties of its zero and gain."""
    units, measures = attribute(result, "channel_units"), attribute(result, "channel_measures")
    read_in = attribute(result, "channel_read_in") or [("", 1.0)] * len(units)
    rows = []
    for i, (name, unit, (read, size)) in enumerate(zip(names(result, "channel"), units, read_in, strict=True)):
        cells = []
        for what in ("zero", "gain"):
            values = result[f"accuracy_{what}"].values[i]
            texts = []
            for end in [np.nanmin(values), np.nanmax(values)] if np.isfinite(values).any() else []:
                factor, sign = (100.0, "%") if what == "gain" else prefixed(float(end), unit)
                if what == "zero" and read and size != 1:
                    factor, sign = 1 / size, read
                texts.append(text(end * factor, sign) if end else "0")
            cells.append(" to ".join(dict.fromkeys(texts)) or NONE)
        rows.append([name, measures[i], "" if (read or unit) == "1" else read or unit, *cells])
    return Table("sensors", ["channel", "measures", "unit", "u of the zero", "u of the gain"], rows)


# ---- figures ------------------------------------------------------------------------------------------------------


def figure(
    result: xr.Dataset, kind: str | None = None, channel: str | None = None, condition: str | None = None
) -> Plot:
    """One figure.

    Parameters
    ----------
    result : of a comparison
    kind : of KINDS; the efficiency if it was measured and no channel is named, else the courses
    channel, condition : which courses; the first MOST_PANELS of them if there are more

    Raises
    ------
    MechanismError : for a name or kind that there is not, and where there is nothing to draw
    """
    kind = kind or ("efficiency" if "efficiency" in result and channel is None and condition is None else "overlay")
    check_kind(kind, KINDS)
    if kind == "efficiency":
        if "efficiency" not in result:
            remedy = "measure effort: and rate: of the driver, load: and rate: of a load's joint"
            raise MechanismError(Finding("the efficiency was not measured", "--kind efficiency", remedy))
        return Plot("Efficiency, measured and model", [Panel("", [efficiency(result)], 3.75)])
    charts = measured_courses(result, channel, condition)
    if not charts:
        remedy = "see the findings of `trunnion data`"
        raise MechanismError(Finding("there is no signal to draw", "--kind overlay", remedy))
    more = f", {MOST_PANELS} of {len(charts)} signals" if len(charts) > MOST_PANELS else ""
    return Plot(f"Measured and model{more}", [course(result, i, k, 80) for i, k in charts[:MOST_PANELS]], 2)


def measured_courses(
    result: xr.Dataset, channel: str | None = None, condition: str | None = None
) -> list[tuple[int, int]]:
    """(channel, condition) of the courses that there are, of one channel or condition only if it is named."""
    picked = []
    for dim, name in (("channel", channel), ("condition", condition)):
        every = names(result, dim)
        if name is not None and name not in every:
            raise MechanismError(Finding(f"there is no {dim} '{name}'", f"--{dim}", nearest(name, every)))
        picked.append(range(len(every)) if name is None else [every.index(name)])
    any_value = np.isfinite(result["measured"].values).any(axis=2) | np.isfinite(result["model"].values).any(axis=2)
    return [(i, k) for k in picked[1] for i in picked[0] if any_value[i, k]]


def efficiency(result: xr.Dataset) -> Chart:
    """Measured efficiency with bars of ±U beside the model's, over what was varied; a curve for each combination of
    further numbers, over the conditions if there are too many."""
    count, by_number = result.sizes["condition"], Scale("condition", "", np.arange(1.0, result.sizes["condition"] + 1))
    over, *others = varied(result) or [by_number]
    keys = np.array([np.nan_to_num(levels(scale.values), nan=np.inf) for scale in others]).reshape(-1, count)
    combined = np.unique(keys, axis=1).T if others else np.empty((1, 0))
    if len(combined) > MOST_NAMED:
        over, others, keys, combined = by_number, [], keys[:0], np.empty((1, 0))
    x, marks = over.values, list[Mark]()
    model, measured, wide = (result[f"efficiency{part}"].values for part in ("_model", "", "_expanded"))
    for k, at in enumerate(combined):
        where = np.flatnonzero((keys == at[:, None]).all(axis=0) & np.isfinite(x))
        where = where[np.argsort(x[where], kind="stable")]
        settings_at = (f"{scale.name} = {setting(value, scale.unit)}" for scale, value in zip(others, at, strict=True))
        look, half = nth(k) if others else Look(MODEL), np.nan_to_num(wide[where])
        dash = look.dash if over is not by_number else "none"  # conditions are in no order
        marks += [
            Line(x[where], model[where], ", ".join(["model", *settings_at]),
                 look._replace(dash=dash, mark="_", size=13.0)),
            Line(x[where], measured[where], None if k else f"measured, ±U ({coverage_of(result)})",
                 Look(look.colour if others else MEASURED, dash="none", mark="o", order=3), half, half),
        ]  # fmt: skip
    at, sampled = levels(x), np.isfinite(result["phase"].values)
    places = np.unique(at[np.isfinite(at)])
    sides = Scale("", "", places).edges(places, 0.05) if places.size else np.empty(0)
    for k, place in enumerate(places):  # grey where no condition has an answer of the model, with the cause
        if not np.isfinite(model[here := at == place]).any():
            gravest = int(result["status"].values[here][sampled[here]].max())
            why = sweep.CAUSES[gravest] if gravest >= Status.NOT_CONVERGED else "no efficiency"
            marks.append(Stripe(sides[k], sides[k + 1], f"model: {why}"))
    titles = names(result, "condition")
    named = over is by_number and count <= MOST_NAMED and sum(map(len, titles)) <= WIDE
    marked = list(zip(by_number.values.tolist(), titles, strict=True)) if named else None
    across = Axis(over.title, (sides[0], sides[-1]) if places.size else (None, None), marked)
    return Chart(across, Axis("efficiency"), marks, legend=Legend(1))


def course(result: xr.Dataset, channel: int, condition: int, room: int) -> Panel:
    """Measured with ±U and model; below, the residual in ±U. room: characters of the title in a line."""
    over, (factor, unit) = drive(result, condition), scale_of(result, channel, condition)
    x, count, name = over.values, over.values.size, names(result, "channel")[channel]
    measured, wide, model, residual, compared = (
        np.asarray(result[key].values[channel, condition, :count], float)
        for key in ("measured", "expanded", "model", "residual", "compared")
    )
    measured, wide, model, residual = (values * factor for values in (measured, wide, model, residual))
    residual = np.where(compared > 0, residual, np.nan)
    close, band = unit != "°", Look(MEASURED, alpha=0.22, order=1.8)
    cycle = result.isel(condition=condition, position=slice(0, count))
    above = [
        Band(x, measured - wide, measured + wide, f"±U ({coverage_of(result)})", band, close),
        Line(x, measured, "measured", Look(MEASURED, 1.3), close=close),
        Line(x, model, "model", Look(MODEL, 1.5, "long"), close=close),
        *silent(cycle, over),
    ]
    below = [
        Band(x, -wide, wide, None, band, True),
        Line(x, residual, None, Look(MEASURED, 1.1), close=True),
        *silent(cycle, over, written=False),
    ]
    error, part = (float(result[key].values[channel, condition]) for key in ("rms", "within"))
    words = [f"RMS {text(error * factor, unit)}"] if np.isfinite(error) else []
    words += [f"{number(100 * part, 3)}\u00a0% within ±U"] if np.isfinite(part) else []
    aside = ": ".join(filter(None, [", ".join(words), verdict(result, channel, condition)]))
    charts = [
        Chart(over, Axis(f"{name} [{unit}]" if unit else name), above, legend=Legend(1, 70)),
        Chart(over, Axis(f"residual\n[{unit}]" if unit else "residual"), below, True, None, aside=aside),
    ]
    return Panel("\n".join(wrap(label(result, condition), room)[:2]), charts, 3.3, (2.6, 1.0))


# ---- report -------------------------------------------------------------------------------------------------------


def report(result: xr.Dataset) -> str:
    """The whole report as HTML, to be filed."""
    parts = [Section("Efficiency", pictures=[(KINDS["efficiency"], figure(result, "efficiency"))], after=[table])
             for table in efficiencies(result)]  # fmt: skip
    about = f"Expanded uncertainty U of the mean over the turns, {coverage_of(result)} coverage (JCGM 100:2008); the " \
            "model counts as exact."  # fmt: skip
    parts += [Section("Verdicts", about, tables=[verdicts(result)]), Section("Conditions", tables=[conditions(result)]),
              Section("Sensors", tables=[sensors(result)])]  # fmt: skip
    for i, name in enumerate(names(result, "channel")):
        compared = [k for _, k in measured_courses(result, name)]
        within = np.nan_to_num(result["within"].values[i], nan=2.0)
        drawn = sorted(sorted(compared, key=within.__getitem__)[:MOST_DRAWN])
        unit = str(attribute(result, "channel_units")[i])
        about = f"measures {attribute(result, 'channel_measures')[i]}{f', {unit}' if unit != '1' else ''}"
        if len(drawn) < len(compared):
            about += f"; {len(drawn)} of {len(compared)} conditions are drawn, those with the least within ±U"
        pictures = [(f"{name}, {label(result, k)}", Plot("", [course(result, i, k, 62)], width=5.2)) for k in drawn]
        parts.append(Section(name, about, pictures, [results(result, i), *explained(result, i)], small=True,
                             calm="" if pictures else "No signal."))  # fmt: skip
    sizes = counts(*((result.sizes[dim], dim) for dim in ("condition", "channel", "position")))
    return page(
        result, "Comparison of a model with a measurement", [of_model(result), *sizes], parts,
        summary=headline(result), signed=True, end=[data_section(result)],
        name=str(result.attrs["comparing"]) or "Measurement", about_data=about_data(result),
    )  # fmt: skip


def headline(result: xr.Dataset) -> Summary:
    """The figures at the head: how many courses are within, and how far the efficiencies are apart."""
    codes = result["verdict"].values[result["turns"].values > 0]
    count = f"{int(np.count_nonzero(codes == Verdict.WITHIN))} of {len(codes)}"
    summary = [("signals within ±U", [(count, f"channels in conditions, {coverage_of(result)} coverage")])]
    if "efficiency" in result:
        within = result["efficiency_within"].values
        count = f"{int(np.count_nonzero(within == 1))} of {int(np.count_nonzero(within >= 0))}"
        summary.append(("efficiencies within ±U", [(count, "conditions")]))
        gap = np.abs(result["efficiency"].values - result["efficiency_model"].values)
        if np.isfinite(gap).any():
            most = number(float(np.nanmax(gap)), 3)
            summary.append(("largest difference of efficiency", [(most, "measured minus model, magnitude")]))
    return summary


def of_model(result: xr.Dataset) -> tuple[str, str]:
    """The model among the facts of a page."""
    return str(result.attrs["name"]) or "model", f"model {result.attrs.get('model_hash', '')}"


def about_data(result: xr.Dataset) -> int:
    """How many findings there are about the data, but for notes."""
    return sum(row["severity"] != "note" for row in attribute(result, "data_findings"))


def data_section(result: xr.Dataset) -> Section:
    """What was done with the data, their files and the findings about them."""
    files = [
        [row["file"], NONE if row["bytes"] is None else f"{row['bytes']:,}".replace(",", "\u202f"),
         row["sha256"] or NONE]
        for row in attribute(result, "data_files")
    ]  # fmt: skip
    table = [Table("files", ["file", "bytes", "SHA-256"], files)] if files else []
    rows = [{**row, "where": " ".join(part for part in (Path(row["file"]).name, row["where"]) if part)}
            for row in attribute(result, "data_findings")]  # fmt: skip
    return Section("Data", lines=attribute(result, "done"), tables=table, findings=rows,
                   calm="No findings about the data.", anchor="data")  # fmt: skip

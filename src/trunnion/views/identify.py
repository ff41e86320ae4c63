"""Views of an identification: estimates, what they are worth, and how the model fits the data."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from trunnion.errors import Finding, MechanismError, Severity
from trunnion.results.attributes import attribute, findings_of
from trunnion.results.quantities import decimals, number, prefixed, read_in, with_uncertainty
from trunnion.rig.identification.uncertainty import quantile
from trunnion.views.axis import names
from trunnion.views.charts import Axis, Band, Chart, Legend, Line, Look, Mark, Note, Panel, Plot
from trunnion.views.compare import about_data, data_section, of_model, shortened
from trunnion.views.curves import check_kind
from trunnion.views.page import NONE, Section, Table, counts, page
from trunnion.views.readings import plain
from trunnion.views.sweep import thinned

if TYPE_CHECKING:
    import xarray as xr

KINDS = ("intervals", "residuals")  # of figures
MOST_PANELS = 8  # curves of residuals
MOST_TILES = 8  # estimates that are read first
MANY = 1e4  # degrees of freedom: Student's t is the normal distribution to four digits
LEAST = 0.005  # of a variance: a smaller share of all is no row of the budget
COVERED = 2.0  # standard uncertainties of the band
BEFORE, AFTER = 4, 0


# ---- estimates ----------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Estimate:
    """One unknown as it is read: in degrees, mm or SI.

    short: its name without the section that all numbers of joints have; half: expanded uncertainty, NaN where the data
    do not tell it; places: decimals that this leaves; limit: −1 or 1 where it is on its lower or upper limit;
    shares: of each source in its variance; lacking: why there is no estimate.
    """

    name: str
    short: str
    paths: tuple[str, ...]
    unit: str
    start: float
    value: float
    half: float
    places: int
    lower: float
    upper: float
    freedom: float
    limit: int
    identifiable: bool
    shares: dict[str, float]
    lacking: str = "not identifiable"

    @property
    def start_text(self) -> str:
        """Where the search began, with its unit."""
        return plain(self.start, ".4g", self.unit)

    def say(self, value: float, unit: bool = True) -> str:
        """A value with the digits of the uncertainty."""
        if not math.isfinite(value):
            return number(value)
        return plain(value + 0.0, f".{self.places}f" if self.places <= 7 else ".4g", self.unit if unit else "")

    def cells(self) -> list[str]:
        """Estimate ± U, its interval, degrees of freedom, and what most of its variance is due to."""
        if not self.identifiable:
            return [self.lacking, NONE, "", ""]
        source = max(self.shares, key=self.shares.__getitem__, default="")
        tail = [f"{self.freedom:.0f}" if self.freedom < MANY else "∞",
                f"{source} {plain(100 * self.shares[source], '.0f', '%')}" if source else ""]  # fmt: skip
        if self.limit:
            interval = f"up to {self.say(self.upper)}" if self.limit < 0 else f"from {self.say(self.lower)}"
            return [f"{self.say(self.value)} (limit)", interval, *tail]
        interval = f"{self.say(self.lower, unit=False)}\u00a0to\u00a0{self.say(self.upper)}"
        return [f"{self.say(self.value, unit=False)}\u00a0±\u00a0{self.say(self.half)}", interval, *tail]


def estimates(result: xr.Dataset) -> list[Estimate]:
    """Every unknown of a result."""
    units, paths, rows = attribute(result, "parameter_units"), attribute(result, "parameter_paths"), []
    errors = {finding.code for finding in findings_of(result) if finding.severity is Severity.ERROR}
    gross = bool(errors & {"fit.misfit", "sensor.off"})  # then an interval means nothing, however narrow
    lacking = "model does not fit" if gross else "not identifiable"
    for p, name in enumerate(names(result, "parameter")):
        factor, unit = read_in(units[p])
        keys = ("start", "estimate", "standard_uncertainty", "lower", "upper")
        start, value, deviation, lower, upper = (float(result[key].values[p]) * factor for key in keys)
        freedom, identifiable = (
            float(result["degrees_of_freedom"].values[p]),
            bool(result["told"].values[p]) and not gross,
        )
        half = float(quantile(freedom)) * deviation if identifiable else math.nan
        shares = dict(zip(names(result, "source"), map(float, result["share"].values[p]), strict=True))
        rows.append(Estimate(
            name, name.removeprefix("joints.").removeprefix("dimensions."), tuple(paths[p]), unit, start, value, half,
            max(decimals(half), 0) if identifiable else 4, lower, upper, freedom, int(result["limit"].values[p]),
            identifiable, shares, lacking,
        ))  # fmt: skip
    return rows


# ---- tables -------------------------------------------------------------------------------------------------------


def tables(result: xr.Dataset) -> list[Table]:
    """The estimates, how they go together, how the model fits, and what was held out."""
    fit = [table for fitted in (True, False) for table in residuals(result, fitted)]
    return [estimated(result), *correlations(result), *fit, *sensors(result)]


def estimated(result: xr.Dataset) -> Table:
    """A row for each parameter: start, estimate ± expanded uncertainty, interval, and what most of that is due to."""
    rows = [[row.short, row.start_text, *row.cells()] for row in estimates(result)]
    head = ["parameter", "start", "estimate ± U", "95\u00a0% interval", "dof", "main source"]
    return Table(f"{result.attrs['identified']}: estimates", head, rows)


def correlations(result: xr.Dataset) -> list[Table]:
    """Between the estimates, of several; columns are numbered as the rows are, for names would be too wide."""
    every, values = estimates(result), result["correlation"].values
    identified = [p for p, row in enumerate(every) if row.identifiable]
    rows = [
        [f"{k} {every[p].short}", *(plain(values[p, q], ".2f") if q <= p else "" for q in identified)]
        for k, p in enumerate(identified, 1)
    ]
    head = ["", *(str(k) for k in range(1, len(rows) + 1))]
    return [Table("correlation", head, rows)] if len(rows) > 1 else []


def residuals(result: xr.Dataset, fitted: bool) -> list[Table]:
    """A row for each channel and condition: RMS before and after, and what the scatter explains of it.

    fitted: of what was fitted, else of what was held out and predicted.
    """
    rows, (head, short), stem = [], shortened(names(result, "condition")), "rms" if fitted else "held_out"
    turns_of, keys = (
        "turns" if fitted else "held_out_turns",
        [f"{stem}_{key}" for key in ("before", "after", "expected")],
    )
    for i, (name, unit) in enumerate(zip(names(result, "channel"), attribute(result, "channel_units"), strict=True)):
        turns = result[turns_of].values[i]
        conditions = np.flatnonzero(turns > 0)
        values = np.array([result[key].values[i, conditions] for key in keys], float)
        factor, display_unit = prefixed(float(np.max(np.nan_to_num(values[:2]), initial=0.0)), str(unit))
        for k, rms in zip(conditions, values.T, strict=True):
            cells = [f"{value * factor:.3g}" if math.isfinite(value) else NONE for value in rms]
            positions = [f"{int(result['used'].values[i, k]):,}"] if fitted else []
            rows.append([name, short[k], *cells, display_unit, f"{int(turns[k])}", *positions])
    columns = ["channel", head, "RMS before", "RMS after", "expected", "unit", "turns", *(["positions"] * fitted)]
    return [Table("residuals of the fit" if fitted else "held-out data", columns, rows)] if rows else []


def sensors(result: xr.Dataset) -> list[Table]:
    """Estimated errors of the sensors, in what is stated of them."""
    units = dict(zip(names(result, "channel"), attribute(result, "channel_units"), strict=True))
    columns = (result[key].values for key in ("sensor_error", "sensor_uncertainty", "sensor_size"))
    rows = []
    for name, error, u, size in zip(names(result, "sensor"), *columns, strict=True):
        if name.startswith(("zero of each file", "angle of each condition")):  # as many as there are files
            continue
        kind, _, channel = name.partition(" of ")
        zero = units.get(channel.partition(" in ")[0], "")
        unit = {"zero": zero, "gain": "%", "angle in steps": "rad"}.get(kind, "")
        factor = size * (100.0 if unit == "%" else 1.0)
        sized = math.isfinite(error) and math.isfinite(factor) and bool(unit)
        rows.append([
            name,
            with_uncertainty(error * factor, 2 * u * factor, unit).replace("-", "−") if sized else NONE,
            f"{error:.2f} ± {2 * u:.2f}".replace("-", "−") if math.isfinite(error) else "not identifiable",
        ])  # fmt: skip
    head = ["", "estimate ± 2 u", "in units of its stated standard uncertainty"]
    return [Table("errors of the sensors", head, rows)] if rows else []


# ---- figures ------------------------------------------------------------------------------------------------------


def figure(result: xr.Dataset, kind: str | None = None) -> Plot:
    """One figure. kind: of KINDS; the intervals if not given. MechanismError if there is no such kind."""
    check_kind(kind or "intervals", KINDS)
    if kind == "residuals":
        every = courses(result)
        if not every:
            what = "no signal was fitted over the cycle: there is no figure 'residuals'"
            raise MechanismError(Finding(what, "--kind", "see the table of residuals"))
        picked = [every[k] for k in thinned(len(every), MOST_PANELS)]
        more = f", {len(picked)} of {len(every)} curves" if len(picked) < len(every) else ""
        panels = [panel for n, (i, k) in enumerate(picked)
                  for panel in _residual_panels(result, i, k, n == 0, n == len(picked) - 1)]  # fmt: skip
        return Plot(f"Residuals, before and after{more}", panels, 2)
    panels = [_interval(row, Legend(1) if k == 0 else None) for k, row in enumerate(estimates(result))]
    return Plot("Estimates with their 95 % intervals", panels)


def _interval(row: Estimate, legend: Legend | None) -> Panel:
    """A parameter on a scale of its own: where it started, where it is, and its 95 % interval."""
    zero, points, marks = np.zeros(1), [row.start], list[Mark]()
    if row.identifiable:
        ends = [end if np.isfinite(end) else row.value for end in (row.lower, row.upper)]
        points += ends
        marks = [Line(np.array(ends), np.zeros(2), "95 % interval", Look(AFTER, 6.0, alpha=0.35)),
                 Line(np.array([row.value]), zero, "estimate", Look(AFTER, dash="none", mark="o", size=6))]  # fmt: skip
    else:
        marks.append(Note(row.lacking, 0.5, 0.75, size=8.5))
    start = Look(BEFORE, dash="none", mark="D", size=5, hollow=True)
    marks.append(Line(np.array([row.start]), zero, "start", start))
    low, high = min(points), max(points)
    margin = 0.08 * (high - low) or 0.1 * abs(high) or 0.1
    across = Axis(row.unit, (low - margin, high + margin), count=7)
    chart = Chart(across, Axis("", (-1, 1), [(0, row.short)]), marks, legend=legend, bare=True)
    return Panel("", [chart], 0.95 if legend is None else 1.25)


def courses(result: xr.Dataset) -> list[tuple[int, int]]:
    """(channel, condition) with courses over the cycle that were fitted or held out."""
    after = np.isfinite(result["residual_after"].values).sum(axis=2) > 1
    turns = result["turns"].values + result["held_out_turns"].values
    return [(int(i), int(k)) for i, k in np.argwhere(after & (turns > 0))]


def _residual_panels(result: xr.Dataset, channel: int, condition: int, first: bool, last: bool) -> list[Panel]:
    """Measured less model over the cycle: before, with that after in front of it, beside after, on its own scale with
    the band that the scatter leaves the mean."""
    ranges, name = attribute(result, "drive_range"), names(result, "channel")[channel]
    unit, x = str(attribute(result, "channel_units")[channel]), np.asarray(result["phase"].values[condition], float)
    title = "share of the cycle"
    if condition < len(ranges) and ranges[condition] is not None:
        low, high = ranges[condition]
        title, x = f"drive angle {result.attrs.get('drive', '')} [°]", np.degrees(low + (high - low) * x)
    across, panels = Axis(title if last else "", (float(np.nanmin(x)), float(np.nanmax(x)))), []
    before, after, spread = (np.asarray(result[f"residual_{key}"].values[channel, condition], float)
                             for key in ("before", "after", "uncertainty"))  # fmt: skip
    for both in (True, False):
        sizes = np.concatenate([before, after] if both else [after, COVERED * spread])
        factor, display_unit = prefixed(float(np.nanmax(np.abs(sizes), initial=0.0)), unit)
        half, marks = COVERED * spread * factor, list[Mark]()
        if both:
            marks.append(Line(x, before * factor, "before", Look(BEFORE, 1.1, mark="o", size=2)))
        elif np.isfinite(spread).any():
            marks.append(Band(x, -half, half, f"±{COVERED:g} u of the mean, by scatter", Look("shade", order=1)))
        marks.append(Line(x, after * factor, "after", Look(AFTER, 1.1, mark="o", size=2)))
        upward = Axis(f"{name} [{display_unit}]" if display_unit else name)
        chart = Chart(across, upward, marks, True, Legend(1) if first else None)
        panels.append(Panel(names(result, "condition")[condition] if both else " ", [chart], 2.5 if first else 2.1))
    return panels


# ---- report -------------------------------------------------------------------------------------------------------


def report(result: xr.Dataset) -> str:
    """The whole report as HTML, to be filed."""
    rows = estimates(result)
    identified = [row for row in rows if row.identifiable]
    sources = [name for name in names(result, "source") if any(row.shares[name] >= LEAST for row in identified)]
    budget = Table("uncertainty budget", ["share of the variance", *(row.short for row in identified)],
                   [[name, *(plain(100 * row.shares[name], ".0f", "%") for row in identified)]
                    for name in sources])  # fmt: skip
    after = [estimated(result).titled(""), *([budget] if identified else []), *sensors(result)]
    parts = [Section("Estimates", pictures=[("Estimates", figure(result, "intervals"))], after=after)]
    parts += [Section("Correlation", after=[table]) for table in correlations(result)]
    about = "Measured minus model over the cycle, before and after the fit."
    pictures = [("Residuals", figure(result, "residuals"))] if courses(result) else []
    parts.append(Section("Residuals", about, pictures, after=residuals(result, True)))
    about = "Data not used in the fit, and the error of their prediction."
    parts += [Section("Held out", about, after=[table]) for table in residuals(result, False)]
    paths = [[row.name, ", ".join(row.paths), row.start_text] for row in rows]
    end = [
        data_section(result),
        Section("Parameters", tables=[Table("parameters", ["parameter", "paths in the model", "start"], paths)]),
    ]
    summary = []
    for row in rows[:MOST_TILES]:
        pair = (row.say(row.value), "at its bound" if row.limit else f"± {row.say(row.half)}, 95 %")
        summary.append((row.short, [pair if row.identifiable else (row.lacking, "from these data")]))
    chi = float(result["reduced_chi_squared"])
    summary += [("reduced χ²", [(number(chi, 3), "near 1 if the model fits")])] if np.isfinite(chi) else []
    sizes = [(result.sizes[dim], dim) for dim in ("parameter", "channel", "condition")]
    facts = [of_model(result), *counts(*sizes, (int(result["used"].sum()), "position"))]
    return page(
        result, "Parameter identification from a measurement", facts, parts, summary=summary, end=end,
        name=str(result.attrs["identified"]) or "Measurement", about_data=about_data(result), signed=True,
    )  # fmt: skip

"""Views of an identification: estimates, what they are worth, and how the model fits the data."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from trunnion.errors import Finding, MechanismError, Severity
from trunnion.results.attributes import attribute, findings_of
from trunnion.results.quantities import decimals, number, prefixed, read_in, with_uncertainty
from trunnion.rig.identification.uncertainty import quantile
from trunnion.views.charts import Axis, Band, Chart, Legend, Line, Look, Mark, Note, Panel, check_kind
from trunnion.views.common.cycle import names
from trunnion.views.compare import about_data, data_section
from trunnion.views.measured import shortened
from trunnion.views.page import NONE, Section, Table, counts, page
from trunnion.views.scales import thinned

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

__all__ = ["KINDS", "MOST_PANELS", "Estimate", "estimates", "figure", "report", "sensors", "tables"]

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

    limit: −1 or 1 where it is on its lower or upper limit; identifiable: whether the data tell it; shares: of each
    source in its variance; lacking: why there is no estimate.
    """

    name: str
    paths: tuple[str, ...]
    unit: str
    start: float
    value: float
    deviation: float
    lower: float
    upper: float
    freedom: float
    limit: int
    identifiable: bool
    shares: dict[str, float]
    lacking: str = "not identifiable"

    @cached_property
    def half(self) -> float:
        """Expanded uncertainty, half of the two-sided interval."""
        return float(quantile(self.freedom)) * self.deviation if self.identifiable else math.nan

    @cached_property
    def places(self) -> int:
        """Decimals that its uncertainty leaves."""
        return max(decimals(self.half), 0) if self.identifiable else 4

    @property
    def short(self) -> str:
        """Its name without the section that all numbers of joints have."""
        return self.name.removeprefix("joints.").removeprefix("dimensions.")

    def say(self, value: float, unit: bool = True) -> str:
        """A value with the digits of the uncertainty."""
        if not math.isfinite(value):
            return number(value)
        digits = f"{value + 0.0:.{self.places}f}" if self.places <= 7 else f"{value:.4g}"
        return (digits + self.tail if unit else digits).replace("-", "−")

    @property
    def tail(self) -> str:
        """The unit behind a number."""
        return self.unit if self.unit in ("", "°") else f"\u00a0{self.unit}"

    @property
    def start_text(self) -> str:
        """Where the search began, with its unit."""
        return f"{self.start:.4g}{self.tail}".replace("-", "−")

    def cells(self) -> tuple[str, str, str, str]:
        """Estimate ± U, its interval, degrees of freedom, and what most of its variance is due to."""
        if not self.identifiable:
            return self.lacking, NONE, "", ""
        freedom, source = f"{self.freedom:.0f}" if self.freedom < MANY else "∞", ""
        if self.shares:
            name = max(self.shares, key=self.shares.__getitem__)
            source = f"{name} {_percent(self.shares[name])}"
        if self.limit:
            interval = f"up to {self.say(self.upper)}" if self.limit < 0 else f"from {self.say(self.lower)}"
            return f"{self.say(self.value)} (limit)", interval, freedom, source
        interval = f"{self.say(self.lower, unit=False)}\u00a0to\u00a0{self.say(self.upper)}"
        return f"{self.say(self.value, unit=False)}\u00a0±\u00a0{self.say(self.half)}", interval, freedom, source


def _percent(part: float) -> str:
    """A share in whole percent."""
    return NONE if not math.isfinite(part) else f"{100 * part:.0f}\u00a0%"


def estimates(result: xr.Dataset) -> list[Estimate]:
    """Every unknown of a result."""
    rows = []
    units, paths = attribute(result, "parameter_units"), attribute(result, "parameter_paths")
    sources = names(result, "source")
    errors = {finding.code for finding in findings_of(result) if finding.severity is Severity.ERROR}
    gross = bool(errors & {"fit.misfit", "sensor.off"})  # then an interval means nothing, however narrow
    lacking = "model does not fit" if gross else "not identifiable"
    for p, name in enumerate(names(result, "parameter")):
        factor, display_unit = read_in(units[p])
        keys = ("start", "estimate", "standard_uncertainty", "lower", "upper")
        start, value, deviation, lower, upper = (float(result[key].values[p]) * factor for key in keys)
        shares = dict(zip(sources, map(float, result["share"].values[p]), strict=True))
        rows.append(
            Estimate(name, tuple(paths[p]), display_unit, start, value, deviation, lower, upper,
                     float(result["degrees_of_freedom"].values[p]), int(result["limit"].values[p]),
                     bool(result["told"].values[p]) and not gross, shares, lacking)
        )  # fmt: skip
    return rows


def _channels(result: xr.Dataset) -> list[tuple[int, str, str, list[int]]]:
    """Number, name, SI unit of every channel, and the conditions in which it was fitted or held out."""
    units = attribute(result, "channel_units")
    turns = result["turns"].values + result["held_out_turns"].values
    return [(i, name, str(units[i]), np.flatnonzero(turns[i] > 0).tolist())
            for i, name in enumerate(names(result, "channel"))]  # fmt: skip


# ---- tables -------------------------------------------------------------------------------------------------------


def tables(result: xr.Dataset) -> list[Table]:
    """The estimates, how they go together, how the model fits, and what was held out."""
    every = [estimated(result), correlations(result), fits(result), held_out(result), sensors(result)]
    return [table for table in every if table is not None]


def estimated(result: xr.Dataset) -> Table:
    """A row for each parameter: start, estimate ± expanded uncertainty, interval, and what most of that is due to."""
    rows = [[row.short, row.start_text, *row.cells()] for row in estimates(result)]
    head = ["parameter", "start", "estimate ± U", "95\u00a0% interval", "dof", "main source"]
    return Table(f"{result.attrs['identified']}: estimates", head, rows)


def correlations(result: xr.Dataset) -> Table | None:
    """Between the estimates, of several; columns are numbered as the rows are, for names would be too wide."""
    every, values = estimates(result), result["correlation"].values
    members = [p for p, row in enumerate(every) if row.identifiable]
    rows = [
        [f"{k} {every[p].short}", *(f"{values[p, q]:.2f}".replace("-", "−") if q <= p else "" for q in members)]
        for k, p in enumerate(members, 1)
    ]
    return Table("correlation", ["", *map(str, range(1, len(members) + 1))], rows) if len(members) > 1 else None


def fits(result: xr.Dataset) -> Table | None:
    """A row for each channel and condition: RMS before and after, and what the scatter explains of it."""
    return _residuals(result, "residuals of the fit", "turns", ("rms_before", "rms_after", "rms_expected"))


def held_out(result: xr.Dataset) -> Table | None:
    """What was not fitted but predicted."""
    keys = ("held_out_before", "held_out_after", "held_out_expected")
    return _residuals(result, "held-out data", "held_out_turns", keys)


def _residuals(result: xr.Dataset, title: str, turns_of: str, keys: tuple[str, ...]) -> Table | None:
    """RMS before and after, the expected one, and the data that they are of."""
    rows = []
    head, short = shortened(names(result, "condition"))
    used = turns_of == "turns"
    for i, name, unit, _ in _channels(result):
        turns = result[turns_of].values[i]
        fitted = np.flatnonzero(turns > 0)
        values = np.array([result[key].values[i, fitted] for key in keys], float)
        factor, display_unit = prefixed(float(np.max(np.nan_to_num(values[:2]), initial=0.0)), unit)
        for k, rms in zip(fitted, values.T, strict=True):
            cells = [f"{value * factor:.3g}" if math.isfinite(value) else NONE for value in rms]
            positions = [f"{int(result['used'].values[i, k]):,}"] if used else []
            rows.append([name, short[k], *cells, display_unit, f"{int(turns[k])}", *positions])
    columns = ["channel", head, "RMS before", "RMS after", "expected", "unit", "turns", *(["positions"] * used)]
    return Table(title, columns, rows) if rows else None


def sensors(result: xr.Dataset) -> Table | None:
    """Estimated errors of the sensors, in what is stated of them."""
    units = {name: unit for _, name, unit, _ in _channels(result)}
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
    return Table("errors of the sensors", head, rows) if rows else None


def budget(result: xr.Dataset) -> Table | None:
    """Share of each source in the variance of each estimate; of sources that are anything."""
    members = [row for row in estimates(result) if row.identifiable]
    sources = [name for name in names(result, "source") if any(row.shares[name] >= LEAST for row in members)]
    rows = [[name, *(_percent(row.shares[name]) for row in members)] for name in sources]
    return (
        Table("uncertainty budget", ["share of the variance", *(m.short for m in members)], rows) if members else None
    )


# ---- figures ------------------------------------------------------------------------------------------------------


def figure(result: xr.Dataset, kind: str | None = None) -> Figure:
    """One figure. kind: of KINDS; the intervals if not given. MechanismError if there is no such kind."""
    from trunnion.views.draw import figure as draw

    check_kind(kind or "intervals", KINDS)
    if kind == "residuals":
        every = courses(result)
        if not every:
            what = "no signal was fitted over the cycle: there is no figure 'residuals'"
            raise MechanismError(Finding(what, "--kind", "see the table of residuals"))
        picked = [every[k] for k in thinned(len(every), MOST_PANELS)]
        more = f", {len(picked)} of {len(every)} curves" if len(picked) < len(every) else ""
        return draw(f"Residuals, before and after{more}", result, _residual_panels(result, picked), columns=2)
    panels = [_interval(row, Legend(least=1) if k == 0 else None) for k, row in enumerate(estimates(result))]
    return draw("Estimates with their 95 % intervals", result, panels)


def _interval(row: Estimate, legend: Legend | None) -> Panel:
    """A parameter on a scale of its own: where it started, where it is, and its 95 % interval."""
    zero, points = np.zeros(1), [row.start]
    marks: list[Mark] = [Note(row.lacking, 0.5, 0.75, size=8.5)]
    if row.identifiable:
        ends = [end if np.isfinite(end) else row.value for end in (row.lower, row.upper)]
        points += ends
        marks = [Line(np.array(ends), np.zeros(2), "95 % interval", Look(AFTER, 6.0, alpha=0.35)),
                 Line(np.array([row.value]), zero, "estimate", Look(AFTER, dash="none", mark="o", size=6))]  # fmt: skip
    start = Look(BEFORE, dash="none", mark="D", size=5, hollow=True)
    marks.append(Line(np.array([row.start]), zero, "start", start))
    low, high = min(points), max(points)
    margin = 0.08 * (high - low) or 0.1 * abs(high) or 0.1
    across = Axis(row.unit, (low - margin, high + margin), count=7)
    chart = Chart(across, Axis("", (-1, 1), [(0, row.short)]), marks, legend=legend, bare=True)
    return Panel("", [chart], 0.95 if legend is None else 1.25)


def courses(result: xr.Dataset) -> list[tuple[int, int]]:
    """(channel, condition) with courses over the cycle that were fitted."""
    after = np.isfinite(result["residual_after"].values).sum(axis=2)
    return [(i, k) for i, _, _, conditions in _channels(result) for k in conditions if after[i, k] > 1]


def _residual_panels(result: xr.Dataset, pairs: list[tuple[int, int]]) -> list[Panel]:
    """Measured less model over the cycle: before, with that after in front of it, beside after, on its own scale with
    the band that the scatter leaves the mean."""
    ranges, channels = attribute(result, "drive_range"), _channels(result)
    turned = all(k < len(ranges) and ranges[k] is not None for _, k in pairs)
    title = f"drive angle {result.attrs.get('drive', '')} [°]" if turned else "share of the cycle"
    panels = []
    for n, (channel, condition) in enumerate(pairs):
        x, (_, name, unit, _) = np.asarray(result["phase"].values[condition], float), channels[channel]
        if turned:
            first, last = ranges[condition]
            x = np.degrees(first + (last - first) * x)
        across = Axis(title if n == len(pairs) - 1 else "", (float(np.nanmin(x)), float(np.nanmax(x))))
        start, end, spread = (np.asarray(result[f"residual_{key}"].values[channel, condition], float)
                              for key in ("before", "after", "uncertainty"))  # fmt: skip
        for before in (True, False):
            sizes = np.concatenate([start, end] if before else [end, COVERED * spread])
            factor, display_unit = prefixed(float(np.nanmax(np.abs(sizes), initial=0.0)), unit)
            half, marks = COVERED * spread * factor, list[Mark]()
            if before:
                marks.append(Line(x, start * factor, "before", Look(BEFORE, 1.1, mark="o", size=2)))
            elif np.isfinite(spread).any():
                marks.append(Band(x, -half, half, f"±{COVERED:g} u of the mean, by scatter", Look("shade", order=1)))
            marks.append(Line(x, end * factor, "after", Look(AFTER, 1.1, mark="o", size=2)))
            upward = Axis(f"{name} [{display_unit}]" if display_unit else name)
            chart = Chart(across, upward, marks, True, Legend(least=1) if n == 0 else None)
            where = names(result, "condition")[condition] if before else " "
            panels.append(Panel(where, [chart], 2.3 if n == 0 else 1.9))
    return panels


# ---- report -------------------------------------------------------------------------------------------------------


def report(result: xr.Dataset) -> str:
    """The whole report as HTML, to be filed."""
    several, holdout = correlations(result), held_out(result)
    numbers = [table for table in (estimated(result).titled(""), budget(result), sensors(result)) if table is not None]
    parts = [Section("Estimates", pictures=[("Estimates", figure(result, "intervals"))], after=numbers)]
    if several:
        parts.append(Section("Correlation", after=[several]))
    fit = fits(result)
    about = "Measured minus model over the cycle, before and after the fit."
    pictures = [("Residuals", figure(result, "residuals"))] if courses(result) else []
    parts.append(Section("Residuals", about, pictures, after=[fit] if fit else []))
    if holdout:
        about = "Data not used in the fit, and the error of their prediction."
        parts.append(Section("Held out", about, after=[holdout]))
    end = [data_section(result, "data_files"), Section("Parameters", tables=[Table(
        "parameters", ["parameter", "paths in the model", "start"],
        [[row.name, ", ".join(row.paths), row.start_text] for row in estimates(result)],
    )])]  # fmt: skip
    summary: list[tuple[str, list[tuple[str, str]]]] = []
    for row in estimates(result)[:MOST_TILES]:
        pair = (row.say(row.value), "at its bound" if row.limit else f"± {row.say(row.half)}, 95 %")
        summary.append((row.short, [pair if row.identifiable else (row.lacking, "from these data")]))
    chi = float(result["reduced_chi_squared"])
    summary += [("reduced χ²", [(number(chi, 3), "near 1 if the model fits")])] if np.isfinite(chi) else []
    model = str(result.attrs["name"]) or "model"
    sizes = [(result.sizes[dim], dim) for dim in ("parameter", "channel", "condition")]
    facts = [(model, f"model {result.attrs.get('model_hash', '')}"),
             *counts(*sizes, (int(result["used"].sum()), "position"))]  # fmt: skip
    return page(
        result, "Parameter identification from a measurement", facts, parts, summary=summary, end=end,
        name=str(result.attrs["identified"]) or "Measurement", about_data=about_data(result), signed=True,
    )  # fmt: skip

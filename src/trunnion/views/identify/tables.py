"""An identification as tables of texts, for the terminal and the report."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from trunnion.results.quantities import prefixed
from trunnion.rig.identification.number_text import amount
from trunnion.views.common.cycle import names
from trunnion.views.identify.identification import Estimate, channels, conditions, estimates, percent
from trunnion.views.rig.conditions import shortened
from trunnion.views.table import Table

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["budget", "correlations", "estimated", "fits", "held_out", "sensors", "stated", "tables"]


def tables(result: xr.Dataset) -> list[Table]:
    """What was found, how it hangs together, how the model fits, and what was held out."""
    found = [estimated(result), correlations(result), fits(result), held_out(result), sensors(result)]
    return [one for one in found if one is not None]


def estimated(result: xr.Dataset) -> Table:
    """A row for each parameter: start, estimate ± expanded uncertainty, interval, and what most of that is due to."""
    rows = [
        [
            one.short,
            f"{one.start:.4g}{one.tail}".replace("-", "−"),
            _value(one),
            _interval(one),
            _freedom(one),
            one.source,
        ]
        for one in estimates(result)
    ]
    head = ["parameter", "start", "estimate ± U", "95\u00a0% interval", "dof", "main source"]
    return Table(f"{result.attrs['identified']}: estimates", head, rows)


def stated(result: xr.Dataset) -> Table:
    """What of the model each parameter is: all its paths, and its value at the start."""
    rows = [
        [one.name, ", ".join(one.paths), f"{one.start:.4g}{one.tail}".replace("-", "−")] for one in estimates(result)
    ]
    return Table("parameters", ["parameter", "paths in the model", "start"], rows)


def _freedom(one: Estimate) -> str:
    if not one.told:
        return ""
    return f"{one.freedom:.0f}" if one.freedom < MANY else "∞"


MANY = 1e4  # degrees of freedom: Student's t is the normal distribution to four digits


def _value(one: Estimate) -> str:
    if not one.told:
        return "not identifiable"
    if one.limit:
        return f"{one.say(one.value)} (limit)"
    return f"{one.say(one.value, unit=False)}\u00a0±\u00a0{one.say(one.half)}"


def _interval(one: Estimate) -> str:
    if not one.told:
        return "—"
    if one.limit:
        return f"up to {one.say(one.upper)}" if one.limit < 0 else f"from {one.say(one.lower)}"
    return f"{one.say(one.lower, unit=False)}\u00a0to\u00a0{one.say(one.upper)}"


def correlations(result: xr.Dataset) -> Table | None:
    """Between the estimates, of several; columns are numbered as the rows are, for names would be too wide."""
    told = [p for p, one in enumerate(estimates(result)) if one.told]
    if len(told) < 2:
        return None
    short = [one.short for one in estimates(result)]
    values = result["correlation"].values
    rows = [
        [f"{k} {short[p]}", *(f"{values[p, q]:.2f}".replace("-", "−") if q <= p else "" for q in told)]
        for k, p in enumerate(told, 1)
    ]
    return Table("correlation", ["", *(f"{k}" for k in range(1, len(told) + 1))], rows)


def fits(result: xr.Dataset) -> Table | None:
    """A row for each channel and condition: rms before and after, and what the scatter explains of it."""
    rows = []
    title, names_of = shortened(names(result, "condition"))
    for i, name, unit in channels(result):
        values = {key: result[key].values[i] for key in ("rms_before", "rms_after", "rms_expected", "used", "turns")}
        own = [k for k in conditions(result, i) if values["turns"][k] > 0]
        peak = float(np.nanmax(np.concatenate([values["rms_before"][own], values["rms_after"][own]]), initial=0.0))
        factor, shown = prefixed(peak, unit)
        for k in own:
            numbers = [_figure(values[key][k], factor) for key in ("rms_before", "rms_after", "rms_expected")]
            counts = [f"{int(values['turns'][k])}", f"{int(values['used'][k]):,}"]
            rows.append([name, names_of[k], *numbers, shown, *counts])
    if not rows:
        return None
    head = ["channel", title, "RMS before", "RMS after", "expected", "unit", "turns", "positions"]
    return Table("residuals of the fit", head, rows)


def held_out(result: xr.Dataset) -> Table | None:
    """What was not fitted but predicted."""
    rows = []
    title, names_of = shortened(names(result, "condition"))
    for i, name, unit in channels(result):
        turns = result["held_out_turns"].values[i]
        for k in np.flatnonzero(turns > 0):
            keys = ("held_out_before", "held_out_after", "held_out_expected")
            values = [float(result[key].values[i, k]) for key in keys]
            factor, shown = prefixed(float(np.nanmax(np.nan_to_num(values))), unit)
            rows.append([name, names_of[k], f"{int(turns[k])}", *(_figure(one, factor) for one in values), shown])
    if not rows:
        return None
    head = ["channel", title, "turns", "RMS before", "RMS after", "expected", "unit"]
    return Table("held-out data", head, rows)


def sensors(result: xr.Dataset) -> Table | None:
    """Estimated errors of the sensors, in what is stated of them."""
    units = {name: unit for _, name, unit in channels(result)}
    columns = (result[key].values for key in ("sensor_error", "sensor_uncertainty", "sensor_size"))
    rows = []
    for name, error, u, size in zip(names(result, "sensor"), *columns, strict=True):
        if name.startswith(("zero of each file", "angle of each condition")):  # as many as there are files
            continue
        kind, _, channel = name.partition(" of ")
        of_channel = units.get(channel.partition(" in ")[0], "")
        unit = {"zero": of_channel, "gain": "%", "angle in steps": "rad"}.get(kind, "")
        factor = size * (100.0 if unit == "%" else 1.0)
        known = math.isfinite(error) and math.isfinite(factor) and bool(unit)
        rows.append([
            name,
            amount(error * factor, 2 * u * factor, unit).replace("-", "−") if known else "—",
            f"{error:.2f} ± {2 * u:.2f}".replace("-", "−") if math.isfinite(error) else "not identifiable",
        ])  # fmt: skip
    head = ["", "estimate ± 2 u", "in units of its stated standard uncertainty"]
    return Table("errors of the sensors", head, rows) if rows else None


def budget(result: xr.Dataset) -> Table | None:
    """Share of each source in the variance of each estimate; of sources that are anything."""
    told = [one for one in estimates(result) if one.told]
    sources = [name for name in names(result, "source") if any(one.shares[name] >= LEAST for one in told)]
    if not told:
        return None
    rows = [[name, *(percent(one.shares[name]) for one in told)] for name in sources]
    return Table("uncertainty budget", ["share of the variance", *(one.short for one in told)], rows)


LEAST = 0.005


def _figure(value: float, factor: float) -> str:
    return "—" if not math.isfinite(value) else f"{value * factor:.3g}"

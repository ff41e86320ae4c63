"""Tables of a measurement for the command line: its conditions, by names short enough for a table, its channels."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from trunnion.rig.reading.measurement import Measurement, Signal, rms
from trunnion.views.page import Table

__all__ = ["shortened", "tables"]

MOST = 40  # conditions shown


def shortened(names: Sequence[str]) -> tuple[str, list[str]]:
    """Head of a column and its entries: "misalignment, input.speed" and "0 deg, 250 rpm", …

    A number keeps to its unit. Names that do not set the same numbers in the same order stay whole, under "condition".
    """
    rows = [[part.partition(" ") for part in name.split(", ")] for name in names]
    keys = [[key for key, _, _ in row] for row in rows]
    if not rows or any(one != keys[0] for one in keys) or not all(value for row in rows for _, _, value in row):
        return "condition", list(names)
    return ", ".join(keys[0]), [", ".join(value.replace(" ", "\u00a0") for _, _, value in row) for row in rows]


def tables(measurement: Measurement) -> list[Table]:
    """The conditions with the mean of each channel, then the channels with scatter and uncertainty over all of them."""
    conditions = measurement.conditions
    channels = list(measurement.channels)
    units = {name: item.shown for name, item in measurement.channels.items()}  # of all files, whatever a file is in
    speeds = np.isfinite([item.speed for item in conditions]).any()
    named, short = shortened([item.name for item in conditions])
    settings = [named] if named == "condition" else named.split(", ")
    head = [*settings, "turns", *(["speed rpm"] if speeds else [])]
    head += [f"{name} {_unit(units[name][0])}".strip() for name in channels]
    rows = []
    for item, name in list(zip(conditions, short, strict=True))[:MOST]:
        turns = max(course.turns.shape[0] for course in item.courses.values())
        speed = [f"{item.speed * 30 / np.pi:.5g}"] if speeds else []
        labels = [name] if named == "condition" else [part.replace(" ", "\u00a0") for part in name.split(", ")]
        means = (_figure(_overall(item.courses[key], units[key][1])) if key in item.courses else "" for key in channels)
        rows.append([*labels, f"{turns:,}", *speed, *means])
    if len(conditions) > MOST:
        rows.append([f"{len(conditions) - MOST} more", *[""] * (len(head) - 1)])
    made = [Table(f"{measurement.name}\nconditions: mean over turns and positions", head, rows)]
    head = ["channel", "measures", "unit", "least", "largest", "scatter", "uncertainty"]
    rows = []
    for name in channels:
        courses = [item.courses[name] for item in conditions if name in item.courses]
        unit, factor = courses[0].shown
        every = np.concatenate([course.mean for course in courses]) / factor
        finite = every[np.isfinite(every)]
        extremes = [_figure(float(finite.min())), _figure(float(finite.max()))] if finite.size else ["none", "none"]
        spreads = (np.concatenate([getattr(course, figure) for course in courses])
                   for figure in ("scatter", "uncertainty"))  # fmt: skip
        rows.append([name, courses[0].measures, _unit(unit), *extremes,
                     *(_figure(rms(spread) / factor, 3) for spread in spreads)])  # fmt: skip
    title = "channels: mean signal, scatter of turns, standard uncertainty of the mean"
    return [*made, Table(title, head, rows)]


def _overall(course: Signal, size: float) -> float:
    """Mean over the positions, in a unit of a size in SI."""
    finite = course.mean[np.isfinite(course.mean)]
    with np.errstate(over="ignore"):
        return float(finite.mean()) / size if finite.size else np.nan


def _figure(value: float, digits: int = 5) -> str:
    return "unknown" if not np.isfinite(value) else f"{value + 0.0:.{digits}g}"


def _unit(unit: str) -> str:
    """A unit that is not broken between lines."""
    return "" if unit == "1" else unit.replace(" ", "\u00a0")

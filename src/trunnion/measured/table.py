"""A measurement as a Dataset, and as the tables that the command line shows."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING

import numpy as np

from trunnion.measured.measurement import Course, Measurement

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["Rows", "dataset", "tables"]

Rows = tuple[str, list[str], list[list[str]]]
MOST = 40  # conditions shown


def dataset(measurement: Measurement) -> xr.Dataset:
    """Means over the turns with scatter and standard uncertainty, by condition, channel and position; SI.

    `set` has what was set, by the names of the model's values; NaN where a condition has none.
    """
    import xarray as xr

    conditions = measurement.conditions
    first = conditions[0]
    channels = list(first.courses)
    names = list(dict.fromkeys(name for one in conditions for name in one.values))

    def every(figure: str) -> np.ndarray:
        return np.array([[getattr(one.courses[name], figure) for name in channels] for one in conditions])

    dims = ("condition", "channel", "position")
    units = [first.courses[name].unit for name in channels]
    own = {"units": "of the channel", "member_units": json.dumps(units)}
    count = "turns with a value at the position"
    values = np.array([[one.values.get(name, np.nan) for name in names] for one in conditions])
    return xr.Dataset(
        {
            "mean": (dims, every("mean"), {**own, "long_name": "mean over the turns"}),
            "scatter": (dims, every("scatter"), {**own, "long_name": "standard deviation between turns"}),
            "uncertainty": (dims, every("uncertainty"), {**own, "long_name": "its standard uncertainty"}),
            "turns": (dims, every("count"), {"units": "1", "long_name": count}),
            "set": (
                ("condition", "setting"),
                values.reshape(-1, len(names)),
                {"units": "SI", "long_name": "what was set"},
            ),
            "speed": (
                "condition",
                np.array([one.speed for one in conditions]),
                {"units": "rad/s", "long_name": "mean speed of the driver"},
            ),
        },
        {
            "condition": [one.name for one in conditions],
            "channel": channels,
            "setting": np.array(names, dtype=np.str_),
            "phase": ("position", first.phase, {"units": "1", "long_name": "share of the cycle"}),
        },
        {
            "name": measurement.name,
            "measured": json.dumps([first.courses[name].measures for name in channels]),
            "done": json.dumps(list(measurement.done), ensure_ascii=False),
            "findings": json.dumps(
                [{"what": one.what, "where": one.where, "remedy": one.remedy, "severity": str(one.severity)}
                 for one in measurement.findings], ensure_ascii=False,
            ),
        },
    )  # fmt: skip


def tables(measurement: Measurement) -> list[Rows]:
    """The conditions with the mean of each channel, then the channels with scatter and uncertainty over all of them."""
    conditions = measurement.conditions
    channels = list(conditions[0].courses)
    speeds = np.isfinite([one.speed for one in conditions]).any()
    head = ["condition", "turns", *(["speed rpm"] if speeds else [])]
    head += [f"{name} {_unit(conditions[0].courses[name].unit)}".strip() for name in channels]
    rows = []
    for one in conditions[:MOST]:
        turns = max(course.turns.shape[0] for course in one.courses.values())
        speed = [f"{one.speed * 30 / np.pi:.5g}"] if speeds else []
        rows.append([one.name, f"{turns:,}", *speed, *(_figure(_overall(one.courses[name])) for name in channels)])
    if len(conditions) > MOST:
        rows.append([f"{len(conditions) - MOST} more", *[""] * (len(head) - 1)])
    shown: list[Rows] = [(f"{measurement.name}\nconditions: mean over turns and positions", head, rows)]
    head = ["channel", "measures", "unit", "least", "largest", "scatter", "uncertainty"]
    rows = [[name, *_channel([one.courses[name] for one in conditions])] for name in channels]
    shown.append(("channels: mean courses, what turns scatter, standard uncertainty of the mean", head, rows))
    return shown


def _channel(courses: list[Course]) -> list[str]:
    """Measure and unit of a channel; extremes of its mean courses; RMS of scatter and of uncertainty."""
    means = np.concatenate([one.mean for one in courses])
    known = means[np.isfinite(means)]
    extremes = [_figure(float(known.min())), _figure(float(known.max()))] if known.size else ["none", "none"]
    spreads = [np.concatenate([getattr(one, figure) for one in courses]) for figure in ("scatter", "uncertainty")]
    return [courses[0].measures, _unit(courses[0].unit), *extremes, *(_figure(_rms(one), 3) for one in spreads)]


def _overall(course: Course) -> float:
    known = course.mean[np.isfinite(course.mean)]
    return float(known.mean()) if known.size else np.nan


def _rms(values: np.ndarray) -> float:
    known = values[np.isfinite(values)]
    return float(np.sqrt(np.mean(known**2))) if known.size else np.nan


def _figure(value: float, digits: int = 5) -> str:
    return "not known" if not np.isfinite(value) else f"{value + 0.0:.{digits}g}"


def _unit(unit: str) -> str:
    """A unit that is not broken between lines."""
    return "" if unit == "1" else unit.replace(" ", "\u00a0")

"""A measurement as a Dataset."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from trunnion.results.attributes import encoded, finding_rows
from trunnion.results.dataset import Variable, dataset_of, described
from trunnion.rig.reading.measurement import Measurement

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["dataset"]

COURSE = ("condition", "channel", "position")
VARIABLES = {
    "mean": Variable(COURSE, "of the channel", "mean over the turns"),
    "scatter": Variable(COURSE, "of the channel", "standard deviation between turns"),
    "uncertainty": Variable(COURSE, "of the channel", "its standard uncertainty"),
    "turns": Variable(COURSE, "1", "turns with a value at the position"),
    "set": Variable(("condition", "setting"), "SI", "what was set"),
    "speed": Variable(("condition",), "rad/s", "mean speed of the driver"),
    "phase": Variable(("position",), "1", "share of the cycle"),
}


def dataset(measurement: Measurement) -> xr.Dataset:
    """Means over the turns with scatter and standard uncertainty, by condition, channel and position; SI.

    `set` has what was set, by the names of the model's values; NaN where a condition has none.
    """
    conditions = measurement.conditions
    first = conditions[0]
    channels = list(first.courses)
    names = list(dict.fromkeys(name for one in conditions for name in one.values))
    figures = {"mean": "mean", "scatter": "scatter", "uncertainty": "uncertainty", "turns": "count"}
    courses = {
        name: np.array([[getattr(one.courses[channel], figure) for channel in channels] for one in conditions])
        for name, figure in figures.items()
    }
    values = np.array([[one.values.get(name, np.nan) for name in names] for one in conditions])
    speeds = np.array([one.speed for one in conditions])
    arrays = {**courses, "set": values.reshape(len(conditions), len(names)), "speed": speeds}
    variables = described(arrays, VARIABLES)
    units = encoded({"member_units": [first.courses[name].unit for name in channels]})
    for name in ("mean", "scatter", "uncertainty"):
        variables[name].attrs |= units
    labels = {"condition": [one.name for one in conditions], "channel": channels, "setting": names}
    attributes = {
        "name": measurement.name,
        "measured": [first.courses[name].measures for name in channels],
        "done": list(measurement.done),
        "findings": finding_rows(measurement.findings),
    }
    return dataset_of("measurement", variables, labels, attributes, described({"phase": first.phase}, VARIABLES))

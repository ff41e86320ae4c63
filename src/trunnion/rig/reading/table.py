"""A measurement as a Dataset."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING

import numpy as np

from trunnion.rig.reading.measurement import Measurement

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["dataset"]


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
                values.reshape(len(conditions), len(names)),
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

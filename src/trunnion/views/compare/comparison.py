"""A comparison in words and scales: what was varied, the units it is read in, verdicts, the drive of a condition."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from trunnion.errors import Finding, MechanismError
from trunnion.model.names import nearest
from trunnion.results.attributes import attribute
from trunnion.results.quantities import number, prefixed
from trunnion.rig.judge import Verdict
from trunnion.views.common.cycle import Abscissa, Array, names
from trunnion.views.sweep.scales import Scale

if TYPE_CHECKING:
    import xarray as xr

__all__ = [
    "coverage_of",
    "drive",
    "index_of",
    "label",
    "levels",
    "scale_of",
    "sets",
    "setting",
    "text",
    "units",
    "varied",
    "verdict",
]

SIGNS = {"um": "µm", "deg": "°"}
APART = 0.05  # of the range of a number: values nearer to each other are the same setting, each time a little off
TRIFLE = 0.005  # of a number: less is no change of a setting


def units(result: xr.Dataset) -> list[str]:
    """SI unit of every channel."""
    return [str(unit) for unit in attribute(result, "channel_units")]


def verdict(result: xr.Dataset, channel: int, condition: int) -> Verdict:
    """What the comparison of a channel in a condition came to."""
    code = int(result["verdict"].values[channel, condition])
    return next(one for one in Verdict if one == code)


def sets(result: xr.Dataset) -> list[Scale]:
    """The numbers that were set, over the conditions, in the units that the model states them in."""
    written = attribute(result, "set_written")
    found = []
    for i, name in enumerate(names(result, "set")):
        unit, factor = written[i]
        found.append(
            Scale(name, SIGNS.get(unit, "" if unit == "1" else unit), result["value"].values[i] / factor + 0.0)
        )
    return found


def levels(values: Array) -> Array:
    """The settings among values that were measured and so are never quite the same: to each the mean of its own."""
    known = values[np.isfinite(values)]
    found = np.full(values.shape, np.nan)
    if not known.size:
        return found
    rising = np.sort(known)
    step = max(APART * float(np.ptp(rising)), TRIFLE * float(np.abs(rising).max()))
    edges = rising[1:][np.diff(rising) > step]
    group = np.searchsorted(edges, values, side="right")
    for one in range(len(edges) + 1):
        mine = (group == one) & np.isfinite(values)
        found[mine] = values[mine].mean()
    return found


def varied(result: xr.Dataset) -> list[Scale]:
    """The numbers that were set to several values, that with the most first."""
    found = [(one, len(np.unique(at[np.isfinite(at)]))) for one in sets(result) for at in [levels(one.values)]]
    several = [(one, count) for one, count in found if count > 1]
    return [one for one, _ in sorted(several, key=lambda pair: -pair[1])]


def label(result: xr.Dataset, condition: int) -> str:
    """The name of a condition and what was set in it."""
    told = [f"{one.name} {setting(one.values[condition], one.unit)}" for one in varied(result) or sets(result)[:2]
            if np.isfinite(one.values[condition])]  # fmt: skip
    name = names(result, "condition")[condition]
    named = all(one.name in name for one in varied(result))  # as a name made of the settings has them
    return name if named or not told else f"{name}: {', '.join(told)}"


def setting(value: float, unit: str) -> str:
    """What was set, with its unit: "15°", "62.83 rad/s"."""
    space = "" if unit in ("°", "") else "\u00a0"
    return f"{float(f'{value:.4g}'):g}{space}{unit}".replace("-", "−").replace(" ", "\u00a0")


def coverage_of(result: xr.Dataset) -> str:
    """The probability that ±U covers, in words: "95 %"."""
    return f"{100 * float(result.attrs['probability']):.3g}".replace("95.4", "95") + "\u00a0%"


def text(value: float, unit: str, digits: int = 3) -> str:
    """A number with its unit, which is not scaled any more."""
    space = "" if unit in ("°", "") else "\u00a0"
    return f"{number(float(value), digits)}{space}{unit}".replace(" ", "\u00a0")


def scale_of(result: xr.Dataset, channel: int, condition: int | None = None) -> tuple[float, str]:
    """Factor and unit that a channel is read in, of one condition or of all; a speed in the unit of its file."""
    unit, size = (attribute(result, "channel_read_in") or [["", 1.0]] * (channel + 1))[channel]
    if unit and units(result)[channel] == "rad/s":
        return 1 / size, str(unit)
    where = slice(None) if condition is None else condition
    rows = [result[name].values[channel, where] for name in ("measured", "model")]
    sizes = np.abs(np.concatenate([row[np.isfinite(row)].ravel() for row in rows]))
    return prefixed(float(sizes.max(initial=0.0)), units(result)[channel])


def drive(result: xr.Dataset, condition: int) -> Abscissa:
    """What the courses of a condition are drawn over, and whether they close."""
    values = np.asarray(result["drive"].values[condition], float)
    values = values[np.isfinite(values)]
    unit, name = str(result.attrs["drive_unit"]), str(result.attrs["drive_name"])
    factor, shown = prefixed(float(np.abs(values).max(initial=0.0)), unit) if unit != "rad" else (180 / math.pi, "°")
    told = {"rad": f"drive angle {name}", "m": f"drive slide {name}", "s": "time"}[unit]
    closed = bool(int(result.attrs["periodic"])) and values.size > 2
    even = closed and np.ptp(np.diff(values)) <= 1e-6 * abs(values[1] - values[0])
    period = float(values[1] - values[0]) * values.size * factor if even else 0.0
    return Abscissa(told, shown, values * factor, bool(even and period), period)


def index_of(result: xr.Dataset, dim: str, name: str) -> int:
    """Where a channel or a condition of that name is; MechanismError with the nearest if there is none."""
    known = names(result, dim)
    if name not in known:
        raise MechanismError(Finding(f"there is no {dim} '{name}'", f"--{dim}", nearest(name, known)))
    return known.index(name)

"""What the figures, tables and report of an identification read from its Dataset."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from trunnion.results.attributes import attribute
from trunnion.rig.identification.number_text import decimals, scaled
from trunnion.views.common.cycle import Array, names

if TYPE_CHECKING:
    import xarray as xr

from trunnion.rig.identification.uncertainty import quantile

__all__ = ["Estimate", "channels", "conditions", "curve_of", "estimates", "percent"]


@dataclass(frozen=True)
class Estimate:
    """One unknown as it is read: in degrees, mm or SI.

    limit: −1 or 1 where it is on its lower or upper limit; told: whether the data tell it.
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
    told: bool
    shares: dict[str, float]

    @cached_property
    def half(self) -> float:
        """Expanded uncertainty, half of the two-sided interval."""
        return float(quantile(self.freedom)) * self.deviation if self.told else math.nan

    @cached_property
    def places(self) -> int:
        """Decimals that its uncertainty leaves."""
        return max(decimals(self.half), 0) if self.told else 4

    @property
    def short(self) -> str:
        """Its name as short as it can be read: without the section that all numbers of joints have."""
        return self.name.removeprefix("joints.").removeprefix("dimensions.")

    def say(self, value: float, unit: bool = True) -> str:
        """A value with the digits of the uncertainty."""
        if not math.isfinite(value):
            return "—" if math.isnan(value) else ("∞" if value > 0 else "−∞")
        text = f"{value + 0.0:.{self.places}f}" if self.places <= 7 else f"{value:.4g}"
        return (text + self.tail if unit else text).replace("-", "−")

    @property
    def tail(self) -> str:
        """The unit behind a number."""
        return "" if not self.unit else self.unit if self.unit == "°" else f"\u00a0{self.unit}"

    @property
    def source(self) -> str:
        """What most of its variance is."""
        if not self.told or not self.shares:
            return ""
        name = max(self.shares, key=self.shares.__getitem__)
        return f"{name} {percent(self.shares[name])}"


def percent(part: float) -> str:
    """A share in whole percent."""
    return "—" if not math.isfinite(part) else f"{100 * part:.0f}\u00a0%"


def estimates(result: xr.Dataset) -> list[Estimate]:
    """Every unknown of a result."""
    found = []
    units, paths = attribute(result, "parameter_units"), attribute(result, "parameter_paths")
    sources = names(result, "source")
    for p, name in enumerate(names(result, "parameter")):
        factor, shown = scaled(units[p])

        def number(key: str, p: int = p, factor: float = factor) -> float:
            return float(result[key].values[p]) * factor

        found.append(
            Estimate(
                name, tuple(paths[p]), shown, number("start"), number("estimate"), number("standard_uncertainty"),
                number("lower"), number("upper"), float(result["degrees_of_freedom"].values[p]),
                int(result["limit"].values[p]), bool(result["told"].values[p]),
                dict(zip(sources, map(float, result["share"].values[p]), strict=True)),
            )
        )  # fmt: skip
    return found


def channels(result: xr.Dataset) -> list[tuple[int, str, str]]:
    """Number, name and SI unit of every channel."""
    units = attribute(result, "channel_units")
    return [(i, name, str(units[i])) for i, name in enumerate(names(result, "channel"))]


def conditions(result: xr.Dataset, channel: int) -> list[int]:
    """Conditions in which anything of a channel was fitted or held out."""
    there = result["turns"].values[channel] + result["held_out_turns"].values[channel] > 0
    return [int(i) for i in np.flatnonzero(there)]


def curve_of(result: xr.Dataset, key: str, channel: int, condition: int) -> Array:
    """A course of one channel in one condition."""
    return np.asarray(result[key].values[channel, condition], float)

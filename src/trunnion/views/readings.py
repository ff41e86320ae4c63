"""What a tolerance analysis or an allocation holds of a measure, in numbers and words: a `MeasureReading` for each."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
import pandas as pd

from trunnion.errors import Status
from trunnion.results.attributes import attribute
from trunnion.results.dataset import units_along, without_noise
from trunnion.results.quantities import decimals_of, drawn_in, joined, number, scale_of
from trunnion.views.axis import Abscissa, Array, abscissa, names
from trunnion.views.page import NONE

if TYPE_CHECKING:
    import xarray as xr

OUTER = (0.00135, 0.99865)  # quantiles of the 99.73 % range


# ---- numbers in words -----------------------------------------------------------------------------------------------


def fixed(value: float, decimals: int) -> str:
    """A number with so many decimals, thin spaces between thousands, a true minus, and no minus before a 0."""
    if not math.isfinite(value):
        return number(value)
    text = f"{value:,.{decimals}f}"
    return text.replace(",", "\u202f").replace("-", "−" if float(text.replace(",", "")) else "")


def plain(value: float, form: str, unit: str = "") -> str:
    """A number in a format of Python with a true minus and its unit; "—" for what is not finite."""
    return joined(f"{value:{form}}".replace("-", "−"), unit) if math.isfinite(value) else NONE


def rounded(value: float, digits: int = 6) -> str:
    """A number with at most so many significant digits, a true minus and a sign for what has no end."""
    return f"{value + 0.0:.{digits}g}".replace("inf", "∞").replace("-", "−")


def limits_text(lower: float, upper: float) -> str:
    """Limits of a deviation as a drawing has them: "±0.05", "+0.02/−0.01", "—" for what has no limit."""
    if lower == -upper:
        return f"±{rounded(upper)}"
    ends = (NONE if math.isinf(end) else f"{'+' if end > 0 else ''}{rounded(end)}" for end in (upper, lower))
    return "/".join(ends)


def is_play(path: str) -> bool:
    """Whether a parameter is the play of a joint: how far its pin may be from the middle, to any side."""
    return path.startswith("joints.") and path.endswith(".clearance") and path.count(".") == 2


def value_text(value: float, unit: str, digits: int = 8) -> str:
    """A toleranced number with its unit, lengths in mm, with all digits that a drawing would show."""
    if not math.isfinite(value):
        return NONE
    factor, display_unit = drawn_in(abs(value), unit)
    return joined(rounded(value * factor, digits), display_unit.replace(" ", "\u00a0"))


def share(value: float, decimals: int | None = None) -> str:
    """A share in per cent, near 1 with the digits that tell how near: "99.62 %", "99.998 %", "−3.1 %"."""
    if math.isnan(value):
        return NONE
    if decimals is None:
        decimals = decimals_of(min(value, 1 - value))
    return f"{fixed(100 * value, 0 if value in (0.0, 1.0) else decimals)}\u00a0%"


def share_parts(value: float, low: float, high: float) -> tuple[str, str]:
    """A share and its interval with the digits that this bears: "99.62 %" and "99.41 to 99.76 %", "" without one."""
    if math.isnan(low) or math.isnan(high):
        return share(value), ""
    text, least, most = (share(part, decimals_of(high - low)) for part in (value, low, high))
    return text, f"{least[:-2]} to {most}"


def share_interval(value: float, low: float, high: float) -> str:
    """A share with its interval: "99.62 % (99.41 to 99.76 %)"."""
    text, ends = share_parts(value, low, high)
    return f"{text} ({ends})" if ends else text


# ---- measures -------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class MeasureReading:
    """One measure of a result, (parameter, position, quantile, …), with all its numbers in one unit.

    name, text: of the measure, and what it is; course: what its course is, in words; rule: what makes the figure of
    it, empty if it is not stated. factor: from SI to the unit that is shown, label: that unit; decimals: as many as
    its spread needs: 112.3000° beside 0.0486°. limits: (lower, upper) of the deviation from nominal, bounds: of the
    measure itself; SI, infinite without. nominal: 0 if not known; is_size: whether the figure is the size of a
    deviation, nominally 0 and never below. over: what its course is drawn over, None if it is known at less than two
    positions or if the figure is a place itself.
    """

    result: xr.Dataset
    name: str
    text: str
    course: str
    rule: str
    factor: float
    label: str
    decimals: int
    limits: tuple[float, float]
    bounds: tuple[float, float]
    nominal: float
    is_size: bool
    over: Abscissa | None

    def value(self, key: str) -> float:
        """One number, NaN if the result lacks it."""
        return float(self.result[key].values) if key in self.result else math.nan

    def interval(self, key: str) -> tuple[float, float, float]:
        """One number with the ends of its 95 % interval."""
        return self.value(key), self.value(f"{key}_low"), self.value(f"{key}_high")

    def row(self, key: str) -> Array:
        """A row of numbers, empty if the result lacks it."""
        return np.asarray(self.result[key].values, float) if key in self.result else np.empty(0)

    def has(self, key: str) -> bool:
        """Whether a number, or any of a row, is known."""
        return bool(np.any(np.isfinite(self.row(key))))

    @property
    def room(self) -> tuple[float, float]:
        """Lower and upper end of the deviation that limits and bounds leave, SI; a size has no lower one."""
        low, high = (bound - self.nominal for bound in self.bounds)
        return -math.inf if self.is_size else max(self.limits[0], low), min(self.limits[1], high)

    @property
    def rss_label(self) -> str:
        """RSS, with what it leaves out: that numbers go with each other."""
        return "RSS, uncorrelated" if self.result.attrs.get("correlated", 0) else "RSS"

    @property
    def heading(self) -> str:
        """Name, and what it is."""
        return f"{self.name}: {self.text}" if self.text else self.name

    @property
    def in_unit(self) -> str:
        """The unit behind a title: " [°]"; empty for a pure number."""
        return f" [{self.label}]" if self.label else ""

    def say(self, value: float) -> str:
        """A value of the measure with its unit."""
        text = fixed(value * self.factor, self.decimals)
        return joined(text, self.label) if math.isfinite(value) else text

    def written(self, key: str) -> str:
        """A number of the result with its unit; empty if it is not known."""
        return "" if math.isnan(value := self.value(key)) else self.say(value)

    def between(self, low: float, high: float) -> str:
        """Two values with their unit once; empty if one is not known."""
        return "" if math.isnan(low + high) else f"{fixed(low * self.factor, self.decimals)} to {self.say(high)}"

    def deviations(self, low: float, high: float) -> str:
        """Deviations from nominal as limits are written: "±0.2375°", "−0.1732 to +0.1599°"; the end of a size."""
        least, most = (fixed(end * self.factor, self.decimals) for end in (low, high))
        if math.isnan(low) and math.isnan(high):
            return ""
        if low == 0.0 and self.nominal == 0.0:
            return joined(most, self.label)
        if least == f"−{most}":
            return joined(f"±{most}", self.label)
        return joined(f"{'+' if low > 0 else ''}{least} to {'+' if high > 0 else ''}{most}", self.label)

    @property
    def limits_said(self) -> str:
        """The limits in words; empty if there are none."""
        lower, upper = (limit * self.factor for limit in self.limits)
        texts = [joined(limits_text(lower, upper), self.label)] if math.isfinite(lower) or math.isfinite(upper) else []
        for word, bound in zip(("at least", "at most"), self.bounds, strict=True):
            texts += [f"{word} {joined(rounded(bound * self.factor), self.label)}"] if math.isfinite(bound) else []
        return ", ".join(texts)

    @property
    def at_place(self) -> str:
        """The place of the drive at which the figure is taken: " at 212°"; empty if there is no such one."""
        turned = str(self.result["place"].attrs.get("units", "")) if "place" in self.result else ""
        place = self.value("place") * {"rad": 180 / math.pi, "m": 1e3}.get(turned, 1.0)
        unit = str(self.result.attrs.get("drive_unit", ""))
        if not math.isfinite(place) or self.over is None:
            return ""
        return f" at {place:.4g}°" if unit in ("°", "deg") else f" at {place:.4g}\u00a0{unit}".rstrip()

    @property
    def outer(self) -> tuple[float, float] | None:
        """Ends of the range of 99.73 % of the samples."""
        if not self.has("quantile_value"):
            return None
        levels, values = np.asarray(self.result["quantile"].values, float), self.row("quantile_value")
        ends = [float(values[np.argmin(np.abs(levels - end))]) for end in OUTER if np.isclose(levels, end).any()]
        return (ends[0], ends[1]) if len(ends) == 2 else None

    @cached_property
    def contributions(self) -> pd.DataFrame:
        """Of every toleranced number what it has in the measure, SI, by its path, the largest share first.

        short: without the section, where that names one number only; limits: as in a drawing, of a play how far its
        pin may be from the middle; slope: change of the measure by it, in the units in which both are written; worst:
        of the worst case; shares, NaN where they are not known: of the worst case, of RSS², and of the variance, below
        0 where a correlated number takes away from what the others do.
        """
        paths, units = names(self.result, "parameter"), units_along(self.result["parameter_nominal"], "parameter")
        keys = ("parameter_lower", "parameter_upper", "sensitivity", "contribution_worst_case", "contribution_rss",
                "contribution_variance")  # fmt: skip
        columns = [self.row(key) if key in self.result else np.full(len(paths), np.nan) for key in keys]
        total, ends, rows = np.nansum(columns[3]), [path.partition(".")[2] or path for path in paths], []
        for path, end, unit, *numbers in zip(paths, ends, units, *columns, strict=True):
            lower, upper, sensitivity, worst, rss, variance = map(float, numbers)
            limits, slope = "", NONE
            if not math.isnan(lower + upper):
                factor, display_unit = drawn_in(max(abs(lower), abs(upper)), unit)
                within = f"within\u00a0{rounded(upper * factor)}"
                limits = joined(within if is_play(path) else limits_text(lower * factor, upper * factor),
                                display_unit.replace(" ", "\u00a0"))  # fmt: skip
            if not math.isnan(sensitivity):
                half = worst / abs(sensitivity) if sensitivity else 0.0  # whose unit is that of the limits
                factor, display_unit = drawn_in(half if half > 0 else 1.0, unit)
                ratio = f"{self.label or '1'}/{display_unit}" if display_unit else self.label
                slope = f"{number(sensitivity * self.factor / factor)}\u00a0{ratio}".replace(" ", "\u00a0").rstrip()
            short = end if ends.count(end) == 1 else path
            rows.append((short, unit, limits, slope, worst, worst / (total or np.nan), rss, variance))
        heads = ["short", "unit", "limits", "slope", "worst", "worst_share", "rss_share", "variance_share"]
        table = pd.DataFrame(rows, index=paths, columns=heads)
        return table.sort_values(["rss_share", "worst_share"], ascending=False, kind="stable")


def readings(result: xr.Dataset) -> list[MeasureReading]:
    """Every measure of a result."""
    result = without_noise(result)
    units, reads = units_along(result["nominal"], "measure"), []
    stated = ("limits", "bounds", "measure_texts", "measure_rules", "curve_texts")
    limits, bounds, *words = (attribute(result, key) for key in stated)
    for i, name in enumerate(names(result, "measure")):
        alone, over = result.isel(measure=i), None
        text, rule, course = (str(row[i]) if i < len(row) else "" for row in words)
        if "curve" in alone and "drive" in alone.coords:  # the positions of its course, rising
            unsolved = np.asarray(alone["status"].values) >= Status.NOT_CONVERGED
            picked = np.flatnonzero(np.isfinite(alone["curve"].values) | unsolved)
            alone = alone.isel(position=picked[np.argsort(alone["drive"].values[picked], kind="stable")])
            if not rule.startswith(("place", "dead")) and np.isfinite(alone["curve"].values).sum() > 1:
                over = abscissa(alone)
        deviation, figure_bounds = (
            (-math.inf if low is None else float(low), math.inf if high is None else float(high))
            for low, high in ((row[i] if i < len(row) else None) or (None, None) for row in (limits, bounds))
        )
        keys = ("nominal", "least", "worst_case_lower", "worst_case_upper", "rss", "deviation")
        known = {key: float(alone[key].values) if key in alone else math.nan for key in keys}
        nominal = known["nominal"] if math.isfinite(known["nominal"]) else 0.0
        least = known["least"] if math.isfinite(known["least"]) else known["worst_case_lower"]
        sizes = [abs(known[key]) for key in ("worst_case_lower", "worst_case_upper", "rss")]
        sizes += [3 * known["deviation"], *map(abs, deviation)]
        spread = max((size for size in sizes if math.isfinite(size) and size > 0), default=abs(nominal))
        factor, label = scale_of(nominal, [spread], str(units[i]))
        size = spread * factor
        decimals = min(max(3 - math.floor(math.log10(size)), 0), 9) if size > 0 and math.isfinite(size) else 4
        reads.append(MeasureReading(
            alone, name, text, course, rule, factor, label.replace(" ", "\u00a0"), decimals, deviation, figure_bounds,
            nominal, nominal == 0.0 and not least < 0.0, over if over is not None and over.span > 0 else None,
        ))  # fmt: skip
    return reads

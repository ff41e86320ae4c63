"""What tolerances do to a measure, in words and numbers: a `MeasureReading` for each measure of a result.

All numbers of a measure are told in one unit, with as many decimals as its spread needs: 112.3000° beside 0.0486°.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from trunnion.errors import Status
from trunnion.results.attributes import attribute
from trunnion.results.dataset import units_along
from trunnion.results.quantities import decimals_of, drawn_in, joined, number, scale_of
from trunnion.results.scales import without_noise
from trunnion.views.common.cycle import Abscissa, Array, names

if TYPE_CHECKING:
    import xarray as xr

__all__ = [
    "OUTER",
    "ContributionRow",
    "MeasureReading",
    "failures",
    "fixed",
    "is_play",
    "limits_text",
    "methods",
    "outer",
    "readings",
    "rss_label",
    "share",
    "share_interval",
    "share_parts",
    "with_unit",
]

APART = 5e-4  # two shares that differ by more are told each
OUTER = (0.00135, 0.99865)  # quantiles of the 99.73 % range
DEGREE = ("°", "deg")


@dataclass(frozen=True)
class ContributionRow:
    """What one toleranced number has in a measure, in SI; shares from 0 to 1, NaN where they are not known.

    name: its path; short: without the section, where that names one number only; limits: as in a drawing;
    sensitivity: of the measure by the number; rss_share: of the square of RSS, variance_share: of the variance, below
    0 where a correlated number takes away from what the others do.
    """

    name: str
    short: str
    unit: str
    limits: str
    sensitivity: float
    worst: float
    worst_share: float
    rss_share: float
    variance_share: float

    @property
    def largest_share(self) -> float:
        """The largest of its shares, whatever its sign; 0 where none is known."""
        return max(
            abs(one) if math.isfinite(one) else 0.0 for one in (self.worst_share, self.rss_share, self.variance_share)
        )


@dataclass(frozen=True)
class MeasureReading:
    """One measure of a result, (parameter, position, quantile, …), its unit and its limits.

    limits: (lower, upper) of the deviation from nominal, bounds: of the measure itself; SI, infinite without.
    rule: what makes the figure of the course, empty if it is not told; course: what the course is, in words.
    """

    result: xr.Dataset
    name: str
    text: str
    unit: str
    limits: tuple[float, float]
    bounds: tuple[float, float]
    rule: str = ""
    course: str = ""

    def value(self, key: str) -> float:
        """One number, NaN if the result lacks it."""
        return float(self.result[key].values) if key in self.result else math.nan

    def row(self, key: str) -> Array:
        """Numbers over a dimension; none if the result lacks them."""
        return np.asarray(self.result[key].values, float) if key in self.result else np.empty(0)

    def has(self, key: str) -> bool:
        """Whether there is any such number."""
        return key in self.result and bool(np.isfinite(np.asarray(self.result[key].values, float)).any())

    @cached_property
    def nominal(self) -> float:
        """The figure of the mechanism without deviations; 0 if it is not known."""
        value = self.value("nominal")
        return value if math.isfinite(value) else 0.0

    @cached_property
    def is_size(self) -> bool:
        """Whether the figure is the size of a deviation: nominally 0 and never below."""
        least = self.value("least") if self.has("least") else self.value("worst_case_lower")
        return self.nominal == 0.0 and not least < 0.0

    @cached_property
    def room(self) -> tuple[float, float]:
        """(lower, upper) that the figure may deviate from nominal; the size of a deviation has no lower limit."""
        lower = max(self.limits[0], self.bounds[0] - self.nominal)
        upper = min(self.limits[1], self.bounds[1] - self.nominal)
        return (-math.inf if self.is_size else lower), upper

    @property
    def limited(self) -> bool:
        """Whether the measure has any limit."""
        return any(math.isfinite(one) for one in (*self.limits, *self.bounds))

    # ---- unit ---------------------------------------------------------------------------------------------------

    @cached_property
    def spread(self) -> float:
        """The size of what is told of the measure beside its nominal."""
        known = [abs(self.value(key)) for key in ("worst_case_lower", "worst_case_upper", "rss")]
        known += [3 * self.value("deviation"), *(abs(one) for one in self.limits)]
        known = [one for one in known if math.isfinite(one) and one > 0]
        return max(known, default=abs(self.nominal))

    @cached_property
    def scale(self) -> tuple[float, str]:
        """Factor and unit for all numbers of the measure."""
        return scale_of(self.nominal, [self.spread], self.unit)

    @property
    def factor(self) -> float:
        """From SI to the unit that is shown."""
        return self.scale[0]

    @property
    def label(self) -> str:
        """The unit that is shown, not to be broken; empty for a pure number."""
        return self.scale[1].replace(" ", "\u00a0")

    @cached_property
    def decimals(self) -> int:
        """As many as give the spread four digits."""
        size = self.spread * self.factor
        return min(max(3 - math.floor(math.log10(size)), 0), 9) if size > 0 and math.isfinite(size) else 4

    def say(self, value: float, sign: bool = False) -> str:
        """A value of the measure with its unit; sign: a plus before what is above 0."""
        text = fixed(value * self.factor, self.decimals)
        return joined(f"{'+' if sign and value > 0 else ''}{text}", self.label) if math.isfinite(value) else text

    @property
    def titled(self) -> str:
        """Name with unit, for an axis."""
        return f"{self.name} [{self.label}]" if self.label else self.name

    @property
    def told_limits(self) -> str:
        """The limits in words; empty if there are none."""
        found = []
        lower, upper = self.limits
        if math.isfinite(lower) or math.isfinite(upper):
            found.append(joined(limits_text(lower * self.factor, upper * self.factor), self.label))
        for word, bound in zip(("at least", "at most"), self.bounds, strict=True):
            if math.isfinite(bound):
                found.append(f"{word} {joined(_short(bound * self.factor), self.label)}")
        return ", ".join(found)

    # ---- over the drive -------------------------------------------------------------------------------------------

    @cached_property
    def places(self) -> tuple[Abscissa, list[int]] | None:
        """What its curve is drawn over, and which positions (−1: a gap).

        None if it is known at less than two, or if the figure is a place itself, another quantity than its course.
        """
        if self.is_place or "drive" not in self.result.coords or not self.has("curve"):
            return None
        drive = np.asarray(self.result["drive"].values, float)
        known = np.flatnonzero(np.isfinite(self.row("curve")) & np.isfinite(drive))
        order = known[np.argsort(drive[known], kind="stable")]
        if len(order) < 2 or not np.ptp(drive[order]) > 0:
            return None
        unit = str(self.result.attrs.get("drive_unit", ""))
        unit, driver = "°" if unit in DEGREE else unit, str(self.result.attrs.get("drive", ""))
        x, step = drive[order], float(np.median(np.diff(drive[order])))
        unsolved = np.asarray(self.result["status"].values) >= Status.NOT_CONVERGED
        holes = np.unique(np.searchsorted(x, drive[unsolved & ~np.isfinite(self.row("curve"))]))
        holes = holes[(holes > 0) & (holes < len(x))]
        picked = np.insert(order, holes, -1).tolist()
        over = np.insert(x, holes, 0.5 * (x[holes - 1] + x[holes]))
        round_trip = unit == "°" and bool(self.result.attrs.get("periodic", 0))
        closed = round_trip and abs(float(np.ptp(x)) + step - 360.0) < 0.5 * step
        label = f"drive {'angle' if unit == '°' else 'slide'} {driver}" if driver else "time"
        return Abscissa(label, unit, over, closed, 360.0 * closed), picked

    def along(self, values: Array) -> Array:
        """Numbers over all positions as `places` has them, (…, place), in the unit that is shown."""
        assert self.places is not None
        picked = np.array(self.places[1])
        return np.where(picked < 0, np.nan, values[..., picked]) * self.factor

    @cached_property
    def place(self) -> float:
        """Coordinate of the drive, in its shown unit, at which the figure is taken; NaN if there is no one such."""
        value = self.value("place")
        turned = str(self.result["place"].attrs.get("units", "")) if "place" in self.result else ""
        return value * {"rad": 180 / math.pi, "m": 1e3}.get(turned, 1.0)

    @property
    def told_place(self) -> str:
        """The place with its unit: "212°"."""
        unit = str(self.result.attrs.get("drive_unit", ""))
        if not math.isfinite(self.place) or self.places is None:
            return ""
        return f"{self.place:.4g}°" if unit in DEGREE else f"{self.place:.4g}\u00a0{unit}".rstrip()

    @property
    def is_place(self) -> bool:
        """Whether the figure is a place in the cycle, as a dead centre is."""
        return self.rule.startswith(("place", "dead"))

    @property
    def is_extreme(self) -> bool:
        """Whether the figure is that of the position where the course is largest or least."""
        return self.rule in ("maximum", "minimum", "largest")

    @property
    def limits_course(self) -> bool:
        """Whether its limits are those of the course, too: of a largest deviation, 0 of the nominal mechanism."""
        return self.nominal == 0.0 and (self.rule in ("", "deviation") or self.is_extreme)

    # ---- shares ---------------------------------------------------------------------------------------------------

    @property
    def interval(self) -> tuple[float, float, float]:
        """Yield with the ends of its 95 % interval; NaN if it is not known."""
        return self.value("yield"), self.value("yield_low"), self.value("yield_high")

    @property
    def correlated(self) -> bool:
        """Whether numbers go with each other, of which RSS does not know."""
        return bool(self.result.attrs.get("correlated", 0))

    @property
    def shares_apart(self) -> bool:
        """Whether the shares in the variance are others than those in RSS²."""
        return any(abs(one.variance_share - one.rss_share) > APART for one in self.contributions)

    @cached_property
    def contributions(self) -> list[ContributionRow]:
        """Of every toleranced number, the largest share first."""
        units = units_along(self.result["parameter_nominal"], "parameter")
        paths = names(self.result, "parameter")
        empty = np.full(len(paths), np.nan)
        worst, rss, variance, slope, lower, upper = (
            self.row(key) if key in self.result else empty
            for key in ("contribution_worst_case", "contribution_rss", "contribution_variance", "sensitivity",
                        "parameter_lower", "parameter_upper")
        )  # fmt: skip
        total = float(np.nansum(worst))
        short = _without_section(paths)
        found = [
            ContributionRow(
                path, short[j], unit, with_unit(lower[j], upper[j], unit, path), float(slope[j]), float(worst[j]),
                float(worst[j]) / total if total > 0 else math.nan, float(rss[j]), float(variance[j]),
            )
            for j, (path, unit) in enumerate(zip(paths, units, strict=True))
        ]  # fmt: skip
        return sorted(found, key=lambda one: (-_known(one.rss_share), -_known(one.worst_share)))


def readings(result: xr.Dataset) -> list[MeasureReading]:
    """Every measure of a result."""
    keys = ("limits", "bounds", "measure_texts", "measure_rules", "curve_texts")
    result = without_noise(result)
    units = units_along(result["nominal"], "measure")
    limits, bounds, texts, rules, courses = (attribute(result, key) for key in keys)
    found = []
    for i, name in enumerate(names(result, "measure")):
        about = [(one[i] if i < len(one) else None) or (None, None) for one in (limits, bounds)]
        text, rule, course = (str(one[i]) if i < len(one) else "" for one in (texts, rules, courses))
        lows, highs = ([-math.inf if one[0] is None else float(one[0]) for one in about],
                       [math.inf if one[1] is None else float(one[1]) for one in about])  # fmt: skip
        ends = list(zip(lows, highs, strict=True))
        found.append(MeasureReading(result.isel(measure=i), name, text, str(units[i]), ends[0], ends[1], rule, course))
    return found


def _without_section(paths: Sequence[str]) -> list[str]:
    """`links.crank.length` as `crank.length`, unless another number is called so too."""
    ends = [path.partition(".")[2] or path for path in paths]
    return [end if ends.count(end) == 1 else path for path, end in zip(paths, ends, strict=True)]


def fixed(value: float, decimals: int) -> str:
    """A number with so many decimals, thin spaces between thousands, a true minus, and no minus before a 0."""
    if not math.isfinite(value):
        return number(value)
    text = f"{value:,.{decimals}f}"
    return text.replace(",", "\u202f").replace("-", "−" if float(text.replace(",", "")) else "")


def limits_text(lower: float, upper: float) -> str:
    """Limits of a deviation as a drawing has them: "±0.05", "+0.02/−0.01"."""
    if lower == -upper:
        return f"±{_short(upper)}"
    return f"{_signed(upper)}/{_signed(lower)}"


def _short(value: float) -> str:
    return f"{value:.6g}".replace("inf", "∞").replace("-", "−")


def _signed(value: float) -> str:
    if math.isinf(value):
        return "—"
    return f"+{_short(value)}" if value > 0 else _short(value + 0.0)


def is_play(path: str) -> bool:
    """Whether a parameter is the play of a joint: how far its pin may be from the middle, to any side."""
    return path.startswith("joints.") and path.endswith(".clearance") and path.count(".") == 2


def with_unit(lower: float, upper: float, unit: str, path: str) -> str:
    """Limits of a toleranced number with their unit."""
    if math.isnan(lower) or math.isnan(upper):
        return ""
    size = max(abs(lower), abs(upper))
    factor, shown = drawn_in(size, unit)
    told = f"within\u00a0{_short(upper * factor)}" if is_play(path) else limits_text(lower * factor, upper * factor)
    return joined(told, shown.replace(" ", "\u00a0"))


def _known(value: float) -> float:
    return value if math.isfinite(value) else -1.0


# ---- shares -------------------------------------------------------------------------------------------------------


def share(value: float, decimals: int | None = None) -> str:
    """A share in per cent, near 1 with the digits that tell how near: "99.62 %", "99.998 %", "−3.1 %"."""
    if math.isnan(value):
        return "—"
    if decimals is None:
        decimals = decimals_of(min(value, 1 - value))
    return f"{fixed(100 * value, 0 if value in (0.0, 1.0) else decimals)}\u00a0%"


def share_interval(value: float, low: float, high: float) -> str:
    """A share with its interval: "99.62 % (99.41 to 99.76 %)"."""
    told, ends, _ = share_parts(value, low, high)
    return f"{told} ({ends})" if ends else told


def share_parts(value: float, low: float, high: float) -> tuple[str, str, int | None]:
    """A share, its interval, empty if there is none, and to how many decimals of a per cent they are told."""
    if math.isnan(low) or math.isnan(high):
        return share(value), "", None
    decimals = decimals_of(high - low)
    least = share(low, decimals).removesuffix("\u00a0%")
    return share(value, decimals), f"{least} to {share(high, decimals)}", decimals


def failures(result: xr.Dataset) -> list[tuple[str, int]]:
    """Why samples have no figures, and how many; all together first."""
    if "failed" not in result:
        return []
    counts = dict(zip(names(result, "cause"), np.asarray(result["failed"].values).astype(int).tolist(), strict=True))
    rest = [
        (cause.replace("_", " ").split(":")[0], count) for cause, count in counts.items() if cause != "all" and count
    ]
    return [("all", counts.get("all", sum(count for _, count in rest))), *rest]


def methods(result: xr.Dataset) -> Sequence[str]:
    """Names of the methods that were run."""
    found: Any = attribute(result, "methods")
    return [str(one) for one in found]


def outer(read: MeasureReading) -> tuple[float, float] | None:
    """Ends of the range of 99.73 %."""
    if not read.has("quantile_value"):
        return None
    known = np.asarray(read.result["quantile"].values, float)
    row = read.row("quantile_value")
    found = [float(row[np.argmin(np.abs(known - one))]) for one in OUTER if np.abs(known - one).min() < 1e-9]
    return (found[0], found[1]) if len(found) == 2 else None


def rss_label(read: MeasureReading) -> str:
    """RSS, with what it leaves out."""
    return "RSS, uncorrelated" if read.correlated else "RSS"

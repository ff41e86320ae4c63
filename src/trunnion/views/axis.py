"""What every view asks of a result first: what to draw it over, where it has no answer, which peaks it may cut.

A peak is cut only next to a dead centre or to locking, where forces have no bound and a curve would flatten all else.
The peak of a working load is never cut, however short the stroke.
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from functools import lru_cache
from itertools import pairwise
from math import isfinite
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from trunnion.errors import Status
from trunnion.results.quantities import prefixed

if TYPE_CHECKING:
    import xarray as xr

Array = NDArray[np.float64]
ROUNDING = 1e-9  # of the largest value of the abscissa: what is nearer to zero is zero
TEXTS = {int(status): status.text for status in Status}


# ---- what a result is drawn over ------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Abscissa:
    """What the curves are drawn over: the drive's angle (°) or slide, else time, else the count of positions.

    values: (position,) in `unit`; closed: a whole turn whose end is not repeated, so that after the last
    position comes the first; period: the length of the turn in `unit`, 0 if not closed.
    """

    label: str
    unit: str
    values: Array
    closed: bool = False
    period: float = 0.0

    @property
    def title(self) -> str:
        """Label with unit, for an axis."""
        return f"{self.label} [{self.unit}]" if self.unit else self.label

    @property
    def span(self) -> float:
        """How long the run is, in `unit`."""
        return abs(self.period) if self.closed else float(np.ptp(self.values)) if self.values.size else 0.0

    @property
    def half_step(self) -> float:
        """Half of the distance between two positions, in `unit`."""
        return abs(float(self.values[1] - self.values[0])) / 2 if self.values.size > 1 else 0.5

    def say(self, index: int) -> str:
        """The place of a position in words: "132°", "12.5 mm"."""
        value = float(self.values[index])
        if abs(value) < ROUNDING * float(np.abs(self.values).max(initial=0.0)):
            value = 0.0
        return f"{value:.4g}{'' if self.unit in ('°', '') else ' '}{self.unit}".replace("-", "−")


def abscissa(result: xr.Dataset) -> Abscissa:
    """The drive of the only driver, if it runs one way; otherwise, or of a motion in time, time, or the positions."""
    drive = result.coords.get("drive")
    if drive is not None and drive.attrs["units"] in ("°", "mm"):
        moves, _, driver = str(drive.attrs["long_name"]).partition(" of ")
        values, unit = np.asarray(drive.values, dtype=float), str(drive.attrs["units"])
        return over_turn(f"drive {moves} {driver}", unit, values, bool(result.attrs.get("periodic", 1)))
    time = column(result, "time")
    if time is not None and np.isfinite(time).all():
        factor, unit = prefixed(float(np.abs(time).max(initial=0)), "s")
        return Abscissa("time", unit, time * factor)
    return Abscissa("position", "", np.arange(result.sizes["position"], dtype=float))


def over_turn(label: str, unit: str, values: Array, periodic: bool = True) -> Abscissa:
    """An abscissa that is closed where its values, degrees, come round evenly in a cycle that is periodic."""
    turn = float(values[1] - values[0]) * values.size if values.size > 2 else 0.0
    closed = periodic and unit == "°" and abs(abs(turn) - 360.0) < 1e-6 * 360.0
    return Abscissa(label, unit, values, closed, turn if closed else 0.0)


# ---- what a result holds --------------------------------------------------------------------------------------------


def layout(result: xr.Dataset) -> dict[str, Any]:
    """The mechanism as a small dict: ground, links with points, joints with links, loads. It is read, never changed."""
    return _layout(result.attrs.get("scene") or "{}")


@lru_cache(maxsize=4)  # every part of a view asks for it
def _layout(text: str) -> dict[str, Any]:
    empty: dict[str, Any] = {"ground": "", "links": {}, "joints": {}, "loads": {}, "springs": {}, "gears": {}}
    facts: dict[str, Any] = json.loads(text)
    return empty | facts


def is_spatial(result: xr.Dataset) -> bool:
    """Whether a result is of a mechanism in space."""
    return layout(result).get("space") == "spatial"


def names(result: xr.Dataset, dim: str) -> list[str]:
    """The names along a dimension as plain text; none if the result lacks it."""
    return [str(name) for name in result[dim].values] if dim in result.coords else []


def column(result: xr.Dataset, name: str, **where: str) -> Array | None:
    """One variable as an array, picked by names along its dimensions; None if the result lacks it."""
    if name not in result:
        return None
    variable = result[name]
    place = tuple(variable.indexes[dim].get_loc(where[dim]) if dim in where else slice(None) for dim in variable.dims)
    return np.asarray(variable.values[place], dtype=float)


def members(result: xr.Dataset, name: str, dim: str) -> dict[str, Array]:
    """One variable of every member of a dimension, by their names; none if the result lacks it."""
    if name not in result:
        return {}
    rows = result[name].transpose(dim, ...).values
    return {member: np.asarray(row, dtype=float) for member, row in zip(names(result, dim), rows, strict=True)}


def larger_end(result: xr.Dataset, joint: str) -> Array | None:
    """The larger load on the ends of a joint's bearing or guide, N; None where it has none."""
    ends = column(result, "end_load", joint=joint)
    size = None if ends is None else np.fmax.reduce(np.linalg.norm(ends, axis=1))
    return size if size is not None and np.any(np.isfinite(size)) else None


def mean_friction(result: xr.Dataset, joint: str, of: str = "") -> float:
    """Mean friction power of a joint, W; of: "_ideal" of the mechanism without errors. NaN where there is no answer."""
    mean = column(result, f"friction_power_mean{of}", joint=joint)
    return float("nan") if mean is None else float(mean)


def numbers(values: Array) -> list[float | None]:
    """Numbers with seven digits, None for what is not finite."""
    values = np.asarray(values, float)
    with np.errstate(all="ignore"):
        places = 6.0 - np.floor(np.log10(np.abs(values)))
        scale = 10.0 ** np.abs(places)  # a power of ten that is exact, so that the nearest float of each decimal comes
        rounded = np.where(places < 0, np.rint(values / scale) * scale, np.rint(values * scale) / scale)
    rounded = np.where(np.isfinite(rounded), rounded, values)  # of 0, and of what is too small to be scaled
    return [value if isfinite(value) else None for value in rounded.tolist()]


def series(values: Array | None) -> list[float | None]:
    """A series for JSON; a single number if it never changes, nothing if there is none."""
    if values is None:
        return []
    constant = values.size > 0 and bool(np.all(values == values[0]))
    return numbers(values[:1] if constant else values)


# ---- where it has no answer -----------------------------------------------------------------------------------------


class Interval(NamedTuple):
    """A run of positions start ≤ i < stop with one status."""

    start: int
    stop: int
    status: int

    @property
    def text(self) -> str:
        """The status in a sentence."""
        return status_text(self.status)


def status_text(code: int) -> str:
    """The sentence of a status code."""
    return TEXTS.get(code, f"not solved (status {code})")


def intervals(result: xr.Dataset, lowest: int = Status.NOT_CONVERGED) -> list[Interval]:
    """Runs of positions with one status of at least `lowest`; those without an answer by default."""
    status = column(result, "status")
    if status is None or not status.size:
        return []
    edges = [0, *(np.flatnonzero(np.diff(status)) + 1).tolist(), status.size]
    runs = (Interval(start, stop, int(status[start])) for start, stop in pairwise(edges))
    return [run for run in runs if run.status >= lowest]


def valid(result: xr.Dataset, values: Array) -> Array:
    """A column, NaN at positions that are not valid, for a pin loses contact there."""
    status = column(result, "status")
    return values if status is None else np.where(status == Status.CONTACT_LOST, np.nan, values)


# ---- which peaks are cut --------------------------------------------------------------------------------------------

UNCUT = "uncut"  # attribute of a result whose views cut nothing
UNBOUNDED = [int(status) for status in (Status.LOCKED, Status.SINGULAR, Status.NOT_ASSEMBLED)]
BESIDE = [int(Status.NEAR_SINGULAR), *UNBOUNDED]

GROWN = 5.0  # times what is usual: from here on a position may be next to one that has no bound
CLOSE = 50.0  # so much more friction than without it is close to locking, as a degree of transmission angle is
FASTEST = 4  # power of 1/distance that efforts grow with at most: those of masses, driven at constant speed
TOWERS = 4.0  # times the rest: lower peaks are shown whole
MARGIN = 1.25  # of the rest is shown of those that tower


def ease(result: xr.Dataset) -> Array:
    """(position,): 1, but next to a dead centre or to locking less, by as much as what forces grow with has grown.

    Next to it are positions at which the condition or the friction is GROWN times the usual one, in one run with a
    position that is near singular, or right beside one that is singular, locked or cannot be assembled.
    """
    status = column(result, "status")
    if status is None or UNCUT in result.attrs:
        return np.ones(result.sizes["position"])
    if "condition" not in result:
        return ease_of_status(result, status)
    condition, margin = np.asarray(result["condition"].values, float), column(result, "locking_margin")
    finite = condition[np.isfinite(condition)]
    friction = np.ones(
        status.size
    )  # by how much friction that feeds on its own reactions raises them: ∞ where it locks
    if margin is not None:
        more = 1.0 / np.maximum(margin - 1.0, 1e-300)
        friction = np.where(np.isinf(margin), 1.0, np.where(margin > 1.0, 1.0 + more, 1.0))
    grown = np.fmax(condition / float(np.median(finite)) if finite.size else 1.0, friction)
    grown = np.where(np.isfinite(grown), grown, 1.0)
    unbounded, core = np.isin(status, UNBOUNDED), np.isin(status, BESIDE) | (friction > CLOSE)
    near = _touched((grown > GROWN) | unbounded, core, abscissa(result).closed) & ~unbounded
    return np.where(near, GROWN / grown, 1.0)


def ease_of_status(result: xr.Dataset, status: NDArray[np.generic]) -> Array:
    """Where only the status is known: 0 where it is near singular or unbounded, else 1."""
    return np.where(np.isin(status, BESIDE) & (UNCUT not in result.attrs), 0.0, 1.0)


def whole_peaks(result: xr.Dataset, uncut: bool = True) -> xr.Dataset:
    """The result whose views cut no peak, if that is wanted."""
    return result.assign_attrs({UNCUT: 1}) if uncut else result


def _touched(within: NDArray[np.bool_], core: NDArray[np.bool_], closed: bool) -> NDArray[np.bool_]:
    """The runs of `within` that hold one of `core`; closed: after the last comes the first."""
    if within.all():
        return within & core.any()
    first = int(np.flatnonzero(~within)[0]) if closed else 0
    inside, at, marks = np.roll(within, -first), np.roll(core, -first), np.zeros_like(within)
    edges = np.flatnonzero(np.diff(np.concatenate([[False], inside, [False]]).astype(int)))
    for start, stop in zip(edges[::2], edges[1::2], strict=True):
        marks[start:stop] = at[start:stop].any()
    return np.roll(marks, first)


def peak(*columns: Array | None) -> float:
    """The greatest magnitude in all columns; 0 if none is finite."""
    sizes = [np.abs(values[np.isfinite(values)]).max(initial=0.0) for values in columns if values is not None]
    return float(max(sizes, default=0.0))


def usual_peak(easy: Array, *columns: Array | None) -> float:
    """The magnitude a view should show: the greatest, unless it is next to a dead centre and towers over all others.

    easy: of `ease`, (position,); columns: (…, position). What does not grow towards the dead centre as forces do is a
    load that works there, and all is shown.
    """
    rows = [np.abs(values) for values in columns if values is not None]
    if not rows:
        return 0.0
    shares = np.concatenate([np.broadcast_to(easy, row.shape).ravel() for row in rows])
    sizes = np.concatenate([row.ravel() for row in rows])
    finite = np.isfinite(sizes)
    shares, sizes = shares[finite], sizes[finite]
    most, rest = float(sizes.max(initial=0.0)), float(sizes[shares == 1.0].max(initial=0.0))
    works = float((sizes * shares**FASTEST).max(initial=0.0)) > 2.0 * rest
    return most if works or most <= TOWERS * rest or rest == 0.0 else MARGIN * rest

"""What every view asks of a result first: what to draw it over, what it holds, where it has no answer."""

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


@dataclass(frozen=True)
class Drawn:
    """What a drawing is of. stated: its layout, see `layout`."""

    stated: dict[str, Any]

    @property
    def ground(self) -> str:
        """The name of the fixed link."""
        return str(self.stated["ground"])

    @property
    def moving(self) -> list[str]:
        """The names of the other links."""
        return [link for link in self.stated["links"] if link != self.ground]


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
    """A run of positions start ≤ i < stop with one status, and that in a sentence."""

    start: int
    stop: int
    status: int
    text: str


def status_text(code: int) -> str:
    """The sentence of a status code."""
    return TEXTS.get(code, f"not solved (status {code})")


def intervals(result: xr.Dataset, lowest: int = Status.NOT_CONVERGED) -> list[Interval]:
    """Runs of positions with one status of at least `lowest`; those without an answer by default."""
    status = column(result, "status")
    if status is None or not status.size:
        return []
    edges = [0, *(np.flatnonzero(np.diff(status)) + 1).tolist(), status.size]
    return [Interval(start, stop, int(status[start]), status_text(int(status[start])))
            for start, stop in pairwise(edges) if status[start] >= lowest]  # fmt: skip

"""What a result must obey, from its published numbers and the model's plain data alone: friction laws and verdicts.

Nothing of Trunnion is used here but the names of its results. The laws are those of docs/theory/friction.md, written
once more from their sources.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Data = dict[str, Any]
# largest residuals of a solved position: of the largest friction, force or moment, length or rate, power there
CHECKS = {"law": 1e-10, "balance": 1e-10, "motion": 1e-10, "power": 1e-10}

__all__ = ["CHECKS", "Results", "Verdict", "friction_of", "prescribed", "relative", "slope"]


def friction_of(joint: Data, defaults: Data | None = None) -> Data | None:
    """Friction of a joint as a group; None without any."""
    stated = joint.get("friction", (defaults or {}).get("friction"))
    if stated is None or stated == 0.0:
        return None
    return dict(stated) if isinstance(stated, Mapping) else {"coefficient": float(stated)}


def slope(friction: Data, slip: Array) -> Array:
    """Friction force of a contact along its slip for each newton of normal load: odd in the slip, m/s."""
    f, c = float(friction.get("coefficient", 0.0015)), float(friction.get("viscous", 0.0))
    law, factor = friction.get("law", "coulomb"), float(friction.get("pair_factor", 1.0))
    sense = np.sign(slip)
    if law == "stribeck":
        ratio = slip / friction["stribeck_speed"]
        return -(sense * (f + (friction["static"] - f) * np.exp(-(ratio**2))) + c * slip)
    if law == "brown-mcphee":
        ratio = slip / friction["transition_speed"]
        bell = (friction["static"] - f) * ratio / (ratio**2 / 4 + 3 / 4) ** 2
        return -(f * np.tanh(4 * ratio) + bell + c * slip)
    return {
        "coulomb": lambda: -sense * f * factor,
        "viscous": lambda: -(sense * f * factor + c * slip),
        "rolling-bearing": lambda: -sense * f,
    }[law]()


def prescribed(driver: Data, time: Array) -> tuple[Array, Array, Array]:
    """Coordinate of a driver, rate and second derivative."""
    if driver.get("law") == "harmonic":
        w = 2 * np.pi / driver["period"]
        angle = w * time + driver.get("phase", 0.0)
        swing, lean = driver["amplitude"] * np.sin(angle), driver["amplitude"] * np.cos(angle)
        return driver["mean"] + swing, w * lean, -(w**2) * swing
    first = driver["range"][0] if "range" in driver else driver.get("start", 0.0)
    return first + driver["speed"] * time, driver["speed"] + 0 * time, 0 * time


class Results:
    """The numbers of a result by name and label, position last."""

    def __init__(self, dataset: Any) -> None:
        """Of a Dataset as `trunnion.analyse` returns it."""
        labels = {str(name): list(one.values) for name, one in dataset.coords.items() if one.dtype.kind in "UO"}
        arrays = {str(name): one.values for name, one in dataset.data_vars.items()}
        self._keep(
            arrays, {str(name): one.dims for name, one in dataset.data_vars.items()}, labels, dataset.time.values
        )

    @classmethod
    def of(cls, arrays: Mapping[str, Any], dims: Mapping[str, Any], labels: Mapping[str, Any], time: Any) -> Results:
        """Of the arrays that a Dataset would have."""
        found = cls.__new__(cls)
        found._keep(arrays, dims, labels, time)
        return found

    def _keep(self, arrays: Mapping[str, Any], dims: Mapping[str, Any], labels: Mapping[str, Any], time: Any) -> None:
        self.arrays, self.dims = dict(arrays), dict(dims)
        self.places = {name: {str(label): k for k, label in enumerate(every)} for name, every in labels.items()}
        self.time = np.asarray(time, float)
        self.status = np.asarray(arrays["status"])

    def __call__(self, name: str, label: str | None = None) -> Array:
        """An array, of one label along its first dimension if one is given."""
        array = self.arrays[name]
        if label is None:
            return np.asarray(array, float)
        return np.asarray(array[self.places[str(self.dims[name][0])][label]], float)

    def has(self, name: str) -> bool:
        return name in self.arrays


def relative(residual: Array, scale: Array) -> Array:
    """Residual over scale; 0 where both are, ∞ where only the scale is."""
    with np.errstate(all="ignore"):
        found = np.abs(residual) / scale
    return np.where(np.abs(residual) == 0, 0.0, found)


@dataclass
class Verdict:
    """What one mechanism came to.

    status: of every position; residuals: by check, relative, of every position; worst: what is behind the largest of
    each position (a joint or link); refused: why there is no result.
    """

    status: NDArray[np.int8]
    residuals: dict[str, Array] = field(default_factory=dict)
    where: dict[str, list[str]] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)

    def note(self, check: str, what: str, residual: Array, scale: Array | float = 1.0) -> None:
        """Take over a residual where it is larger than what there is."""
        found = relative(residual, np.broadcast_to(np.asarray(scale, float), np.shape(residual)))
        found = np.where(np.isfinite(found), found, np.inf)
        if check not in self.residuals:
            self.residuals[check] = np.zeros(len(self.status))
            self.where[check] = [""] * len(self.status)
        larger = found > self.residuals[check]
        self.residuals[check] = np.where(larger, found, self.residuals[check])
        for i in np.flatnonzero(larger):
            self.where[check][i] = what

    def note_published(self, result: Results, largest: Array) -> None:
        """The residual that the result tells of itself keeps the limit too; largest: friction at a contact, N."""
        if result.has("friction_residual"):
            self.note("law", "friction_residual", result("friction_residual"), largest)

    def solved(self) -> NDArray[np.bool_]:
        return self.status == 0

    def broken(self, check: str) -> NDArray[np.bool_]:
        """Solved positions beyond the limit."""
        return self.solved() & (self.residuals.get(check, np.zeros(len(self.status))) > CHECKS[check])

    def worst(self, check: str) -> tuple[float, int, str]:
        """Largest residual of a solved position, where it is and of what."""
        if check not in self.residuals or not np.any(self.solved()):
            return 0.0, -1, ""
        found = np.where(self.solved(), self.residuals[check], -1.0)
        i = int(np.argmax(found))
        return float(found[i]), i, self.where[check][i]


Judge = Callable[[Data, Results], Verdict]

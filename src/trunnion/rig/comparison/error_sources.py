"""What one mistake of a sensor, or of the crank angle, would explain of a residual."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

__all__ = ["ENOUGH", "KINDS", "STATED", "Cause", "best", "beyond_stated", "causes", "drive_angle"]

Array = NDArray[np.float64]
ENOUGH = 0.8  # of the mean square of the residual that a cause has to explain
MOST = 0.94  # from this an offset and a gain together are not looked for
ALIKE = 2.0  # explanations that leave no more than this times what the best leaves are not told apart
ROUGH, NEAR = (
    0.003,
    0.03,
)  # where the best leaves more, as of a wrong model, those explain it too that explain nearly as much
BOTH = 4.0  # an offset and a gain together are to leave so much less than one of them
FLAT = 0.05  # of the variation of the model: a reading that varies less, and not like it, is flat
STATED = 3.0  # standard uncertainties: an error of zero or gain beyond so many of those stated is hardly the sensor's
ACTS = 1e-6  # of the model, that its friction has to amount to
OTHER = np.radians(5.0)  # standard deviation from the angle of the drive, from which an angle is another one
FEWEST = 12  # positions from which a shift is looked for
GRID = 180

# The simplest first: it is named where others explain no more.
KINDS = {
    "flat": "a reading that does not change",
    "sign": "a wrong sign",
    "zero": "a constant offset",
    "gain": "a wrong gain",
    "shift": "a shift of the crank angle",
    "mirror": "a crank angle with the wrong sign",
    "drive": "the angle of the drive in its place",
    "friction": "other friction than the model's",
    "zero and gain": "an offset and a wrong gain",
}


class Cause(NamedTuple):
    """One explanation. size: of a zero in the unit of the course, of a gain the relative error, of a shift the share of
    the cycle by which the measured course is ahead, of a mirror too, run backwards, of what is flat the reading, of the
    angle of the drive by how much the readings are ahead of it, rad, of friction how many times that of the model;
    gain: that of a zero and gain; explains: share of the mean square.
    """

    kind: str
    size: float
    explains: float
    gain: float = 0.0


@dataclass(frozen=True, eq=False)
class _Pair:
    """What was measured and what the model has, at the same phases."""

    measured: Array
    model: Array

    @property
    def flat(self) -> bool:
        """Whether the reading stands while the model varies: a small gain would have the model's shape."""
        own, theirs = self.measured - np.mean(self.measured), self.model - np.mean(self.model)
        varies, most = float(np.sum(own**2)), float(np.sum(theirs**2))
        if varies > FLAT**2 * most or most <= 1e-6 * float(np.sum(self.model**2)):
            return False
        return bool(varies <= 1e-18 * most or np.sum(own * theirs) ** 2 < 0.5 * varies * most)

    def explained(self, model: Array) -> float:
        """Share of the mean square of the residual that goes away with another model."""
        before = float(np.mean((self.measured - self.model) ** 2))
        return 1.0 - float(np.mean((self.measured - model) ** 2)) / before if before > 0 else 0.0


def causes(
    measured: Array,
    model: Array,
    phase: Array,
    *,
    closed: bool,
    turning: bool = False,
    without: Array | None = None,
    drive: Array | None = None,
    datum: float = 0.0,
) -> list[Cause]:
    """Every explanation that can be fitted, in the order of KINDS; finite values only.

    closed: the cycle ends where it starts; turning: the course is an angle, of which neither sign nor gain is tried,
    nor a shift if it turns right round; without: the model without its friction, if that is to be among them; drive:
    its angle, rad, which may have been read in place of another; datum: where the sensor reads 0, from which gains act.
    """
    pair, found = _Pair(measured, model), []
    read = model - datum
    square = float(np.sum(read**2))
    if not turning and pair.flat:
        level = float(np.mean(measured))
        return [Cause("flat", level, pair.explained(np.full_like(model, level)))]
    if not turning:
        found.append(Cause("sign", -1.0, pair.explained(-model)))
    zero = float(np.mean(measured - model))
    found.append(Cause("zero", zero, pair.explained(model + zero)))
    if square == 0:
        return found
    gain = float(np.sum((measured - datum) * read)) / square
    if gain > 0 and not turning:
        found.append(Cause("gain", gain - 1.0, pair.explained(gain * read + datum)))
    if closed and len(phase) >= FEWEST:
        found += [*_shift(pair, phase, 1), *_shift(pair, phase, -1)]
    if turning:
        return found + drive_angle(measured, model, drive)
    found += _friction(pair, without)
    around = model - np.mean(model)
    if float(np.sum(around**2)) > 1e-6 * square:  # of a flat course the two cannot be told apart
        slope = float(np.sum(measured * around) / np.sum(around**2))
        offset = float(np.mean(measured - datum) - slope * np.mean(read))
        if slope > 0:
            found.append(Cause("zero and gain", offset, pair.explained(slope * read + datum + offset), slope - 1.0))
    return found


def _friction(pair: _Pair, without: Array | None) -> list[Cause]:
    """How many times the friction of the model fits best: measured = without + size · (model − without).

    To first order: friction changes the reactions that it depends on.
    """
    if without is None or not np.isfinite(without).all():
        return []
    part = pair.model - without
    square = float(np.sum(part**2))
    if square <= (ACTS**2) * float(np.sum(pair.model**2)) or square == 0:
        return []
    size = float(np.sum((pair.measured - without) * part)) / square
    return [Cause("friction", size, pair.explained(without + size * part))] if size > 0 else []


def drive_angle(measured: Array, model: Array, drive: Array | None) -> list[Cause]:
    """That an angle is the drive's, but for its zero; none where the model's is that too. In rad, to whole turns."""
    if drive is None or not drive.size:
        return []

    def apart(angle: Array) -> tuple[float, Array]:
        ahead = float(np.angle(np.mean(np.exp(1j * (angle - drive)))))
        return ahead, np.asarray((angle - drive - ahead + np.pi) % (2 * np.pi) - np.pi)

    before = float(np.mean(((measured - model + np.pi) % (2 * np.pi) - np.pi) ** 2))
    if before == 0 or float(np.std(apart(model)[1])) < OTHER:
        return []
    ahead, gap = apart(measured)
    return [Cause("drive", ahead, 1 - float(np.mean(gap**2)) / before)]


def beyond_stated(one: Cause, zero: float, gain: float) -> float:
    """How many standard uncertainties an error of zero or gain is off; NaN of others, and where none is stated."""
    known = {"zero": zero, "gain": gain}.get(one.kind, 0.0)
    return abs(one.size) / known if known > 0 else float("nan")


def best(found: list[Cause], noise: float = 0.0) -> tuple[Cause | None, list[Cause]]:
    """The simplest cause that explains enough and leaves as little as any, and the others that leave as little.

    noise: share of the mean square that scatter alone leaves. What is left is compared, not what is explained: of a
    large residual an offset may explain 99 % and leave a thousand times what the gain does, which is the cause.
    """

    def left(one: Cause) -> float:
        return max(1.0 - one.explains, noise, 1e-9)

    single = [one for one in found if one.kind != "zero and gain"]
    both = next((one for one in found if one.kind == "zero and gain"), None)
    first = min(single, key=left, default=None)
    if first is not None and first.explains >= ENOUGH:
        most = max(ALIKE * left(first), left(first) + NEAR if left(first) > ROUGH else 0.0)
        alike = [one for one in single if one.explains >= ENOUGH and left(one) <= most]
        if both is None or first.explains >= MOST or BOTH * left(both) > left(first):
            return alike[0], alike[1:]
        return both, []
    return both if both is not None and both.explains >= MOST else None, []


def _shift(pair: _Pair, phase: Array, way: int) -> list[Cause]:
    """The shift of the phase at which the model fits best: measured(φ) = model(way · φ + shift); none of a flat course.

    way: −1 for a model that is gone through backwards."""
    from scipy.interpolate import CubicSpline
    from scipy.optimize import minimize_scalar

    order = np.argsort(phase)
    at, model = phase[order], pair.model[order]
    seam, steps = abs(float(model[0] - model[-1])), np.abs(np.diff(model))
    gap = np.diff(np.append(at, at[0] + 1.0))
    if np.ptp(model) <= 1e-9 * np.max(np.abs(model)) or np.min(gap) <= 0 or np.max(gap) > 0.1:
        return []
    if seam > 5 * np.max(steps, initial=0.0):  # it does not close
        return []
    spline = CubicSpline(np.append(at, at[0] + 1.0), np.append(model, model[0]), bc_type="periodic")

    def left(shift: float) -> float:
        return float(np.mean((pair.measured - spline(way * phase + shift)) ** 2))

    shifts = np.arange(GRID) / GRID - 0.5
    coarse = float(shifts[int(np.argmin([left(one) for one in shifts]))])
    found = minimize_scalar(left, bounds=(coarse - 1 / GRID, coarse + 1 / GRID), method="bounded",
                            options={"xatol": 1e-7})  # fmt: skip
    shift = float(found.x)
    kind = "shift" if way > 0 else "mirror"
    return [Cause(kind, shift, pair.explained(np.asarray(spline(way * phase + shift))))]

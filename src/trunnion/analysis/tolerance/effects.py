"""First-order effects of everything that varies: exact derivatives by dual numbers, all in one walk.

Each row of a batch moves one number: a toleranced number, or one component of a pin's offset in its hole. A run-out
takes two rows, its size towards 0° and towards 90°; a direction that is uniform over a turn takes four, at every
quarter, from which the amplitude of its first harmonic follows without a derivative.

What varies is then one of two kinds. A number moves a measure by S·d, d between the limits. A zone, a disc or a ball of
radius r, moves it by Q·c, |c| ≤ r: worst case r |Q|, variance E|c|² |Q|²/n, n components. Of a clearance, Q is the load
of the pin under the measure's unit load (virtual work), and E|c|² = ρ² n/(n + 2).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from trunnion.algebra.dual import Dual, derivative, primal
from trunnion.algebra.namespace import Number, namespace
from trunnion.analysis.tolerance.inputs import Inputs
from trunnion.model.tolerances import Tolerance

__all__ = ["Effects", "Spread", "effects_of"]

Array = NDArray[np.float64]
SHARE = "share."  # of the radius at which a pin lies in its hole: before joint and component, at a corner
NOBODY = -1
NOISE = 1e-11
QUARTERS = (0.0, 0.5 * np.pi, np.pi, 1.5 * np.pi)


class Row(NamedTuple):
    """One row of the batch: whose it is, which numbers are set and which move, by path."""

    owner: int
    end: int
    real: Mapping[str, float]
    seed: str


class Spread(NamedTuple):
    """What first order makes of every varying number, (parameter, …): of the deviation of a measure from nominal.

    lower, upper: least and largest; half: of the classical sum of squares; shift: of the mean; deviation: standard.
    """

    lower: Array
    upper: Array
    half: Array
    shift: Array
    deviation: Array


@dataclass(frozen=True)
class Effects:
    """The rows of the batch for some inputs, and what their results mean."""

    inputs: Inputs
    rows: tuple[Row, ...]

    def values(self, at: Mapping[str, float] | None = None) -> dict[str, Number]:
        """Numbers of the mechanism: duals (row, 1) where a row sets or moves them, about a point.

        at: what is not nominal there, as `corner` gives it.
        """
        at = at or {}
        about = {path: value for path, value in at.items() if not path.startswith(SHARE)}
        moved = dict.fromkeys([*about, *(path for row in self.rows for path in (*row.real, row.seed) if path)])
        deviations: dict[str, Number] = {}  # a number that follows from others goes on to do so
        seats: dict[str, Number] = {}
        for path in moved:
            nominal = float(np.ravel(primal(self.inputs.run.values.get(path, 0.0)))[0])
            start = about.get(path, nominal)
            real = np.array([[row.real.get(path, start) - nominal] for row in self.rows])
            number = Dual(real, np.array([[1.0 if row.seed == path else 0.0] for row in self.rows]))
            (seats if path.startswith("seats.") else deviations)[path] = number
        values = self.inputs.run.system.mechanism.parameters(deviations=deviations)
        for joint in self.inputs.held:
            values.update(self.inputs.seat(joint, values))
        for path, offset in self._rims(values, at).items():
            seats[path] = seats.get(path, 0.0) + offset
        return {**values, **seats}

    def _rims(self, values: Mapping[str, Number], at: Mapping[str, float]) -> dict[str, Number]:
        """Offsets of pins of which `at` says where in their holes they lie, as shares of the radius."""
        found: dict[str, Number] = {}
        for joint in self.inputs.loose if any(path.startswith(SHARE) for path in at) else ():
            play = self.inputs.play(joint, values)
            assert play is not None
            for end, radius in zip(play.model.ends, play.radii, strict=True):
                room = namespace(radius).maximum(radius, 0.0)
                for key in end:
                    found[f"seats.{joint}.{key}"] = room * at.get(f"{SHARE}{joint}.{key}", 0.0)
        return found

    def slopes(self, number: Number, shape: tuple[int, ...]) -> tuple[Array, Array]:
        """Primal and derivative of a result, (row, …)."""
        full = (len(self.rows), *shape)
        real = np.broadcast_to(np.asarray(primal(number), float), full)
        slope = np.broadcast_to(np.asarray(derivative(number), float), full)
        return real, slope

    def without_noise(self, slope: Array) -> Array:
        """Derivatives, 0 where what the whole tolerance makes of them is rounding beside what others do anywhere."""
        weights = self.weights.reshape(-1, *(1,) * (slope.ndim - 1))
        size = np.nan_to_num(np.abs(slope) * weights)
        return np.where((weights > 0) & (size <= NOISE * np.max(size, initial=0.0)), 0.0 * slope, slope)

    def sensitivity(self, real: Array, slope: Array) -> Array:
        """∂y/∂p of every parameter, (parameter, …); of a zone |Q| summed over its ends; NaN of a direction."""
        return np.array([self._sensitivity(i, real, slope) for i in range(len(self.inputs.names))])

    def _sensitivity(self, i: int, real: Array, slope: Array) -> Array:
        if not self._is_zone(i):
            found: Array = slope[self._own(i)[0]]
            return found
        if i < len(self.inputs.tolerances) and self._tolerance(i).distribution == "direction":
            return np.full(slope.shape[1:], np.nan)
        sizes: Array = np.sum([_size(load) for load in self._loads(i, real, slope)], axis=0)
        return sizes

    def spread(self, real: Array, slope: Array) -> Spread:
        """What first order makes of every parameter."""
        parts = [
            self._zone(i, real, slope) if self._is_zone(i) else self._number(i, slope[self._own(i)[0]])
            for i in range(len(self.inputs.names))
        ]
        return Spread(*(np.array(part) for part in zip(*parts, strict=True)))

    def total(self, spread: Spread, slope: Array) -> tuple[Array, Array, Array, Array, Array]:
        """Least and largest deviation of a measure, RSS half width, shift of the mean and standard deviation.

        Correlated tolerances make the standard deviation √(Sᵀ C S), C the covariance; the worst case does not know of
        them.
        """
        variance = np.sum(spread.deviation**2, axis=0)
        off = self._covariance
        if np.any(off):
            slopes = [0.0 * slope[0] if self._is_zone(i) else slope[self._own(i)[0]] for i in range(len(off))]
            variance = variance + np.einsum("i...,ij,j...->...", np.array(slopes), off, np.array(slopes))
        return (
            np.sum(spread.lower, axis=0),
            np.sum(spread.upper, axis=0),
            np.sqrt(np.sum(spread.half**2, axis=0)),
            np.sum(spread.shift, axis=0),
            np.sqrt(np.maximum(variance, 0.0)),
        )

    @cached_property
    def _covariance(self) -> Array:
        """Covariance of the toleranced numbers, without their variances."""
        covariance: Array = self.inputs.population.covariance()
        return covariance - np.diag(np.diag(covariance))

    def corner(self, real: Array, slope: Array, sign: float) -> dict[str, float]:
        """Numbers that make a measure largest (sign 1) or least (−1), to first order; zones at their rim."""
        found: dict[str, float] = {}
        for i, tolerance in enumerate(self.inputs.tolerances):
            loads = self._loads(i, real, slope) if self._is_zone(i) else []
            if tolerance.direction or tolerance.distribution == "direction":
                x, y = (sign * float(part) for part in loads[0])
                path = tolerance.direction or tolerance.path
                found[path] = float(np.arctan2(y, x))
                if tolerance.direction:
                    found[tolerance.path] = self.nominal(i) + tolerance.upper
            else:
                rises = sign * float(slope[self._own(i)[0]]) >= 0
                found[tolerance.path] = self.nominal(i) + (tolerance.upper if rises else tolerance.lower)
        for k, joint in enumerate(self.inputs.loose):
            i = len(self.inputs.tolerances) + k
            for end, load in zip(self.inputs.ends(joint), self._loads(i, real, slope), strict=True):
                size = float(_size(load))
                for key, part in zip(end, load, strict=True):
                    found[f"{SHARE}{joint}.{key}"] = sign * float(part) / size if size > 0 else 0.0
        return found

    def nominal(self, i: int) -> float:
        """Nominal value of a toleranced number."""
        return float(np.ravel(primal(self.inputs.run.values[self._tolerance(i).path]))[0])

    @cached_property
    def deviations(self) -> tuple[Array, Array]:
        """Standard deviation and mean deviation of every toleranced number, SI."""
        return self.inputs.population.deviations, self.inputs.population.means

    def gradient(self, slope: Array) -> Array:
        """Derivatives of a figure by the normal scores of the toleranced numbers, to first order; 0 of directions."""
        return np.array([
            0.0 if self._is_zone(i) else slope[self._own(i)[0]] * self.deviations[0][i]
            for i in range(len(self.inputs.tolerances))
        ])  # fmt: skip

    def numbers(self) -> dict[str, Array]:
        """Of every parameter: nominal value, limits of its deviation, standard deviation and mean; of a clearance the
        radius, 0 and the play, and the standard deviation of an offset along one axis."""
        rows = [
            (self.nominal(i), one.lower, one.upper, self.deviations[0][i], self.deviations[1][i])
            for i, one in enumerate(self.inputs.tolerances)
        ]
        for joint in self.inputs.loose:
            most, square = self._rooms[joint][0]
            count = len(self.inputs.ends(joint)[0])
            rows.append((most, 0.0, most, float(np.sqrt(square / (count + 2))), 0.0))
        keys = ("nominal", "lower", "upper", "deviation", "shift")
        return dict(zip(keys, np.array(rows).reshape(-1, len(keys)).T, strict=True))

    @cached_property
    def weights(self) -> Array:
        """How far each row's number may go, (row,): half widths, and radii of zones; 0 of rows without a derivative."""
        found = np.zeros(len(self.rows))
        for k, row in enumerate(self.rows):
            if row.seed and self._is_zone(row.owner):
                found[k] = self._radii(row.owner)[row.end][0]
            elif row.seed:
                found[k] = self._tolerance(row.owner).half_width
        return found

    # ---- one parameter ------------------------------------------------------------------------------------

    def _tolerance(self, i: int) -> Tolerance:
        return self.inputs.tolerances[i]

    def _own(self, i: int) -> list[int]:
        return [k for k, row in enumerate(self.rows) if row.owner == i]

    def _is_zone(self, i: int) -> bool:
        if i >= len(self.inputs.tolerances):
            return True
        tolerance = self._tolerance(i)
        return bool(tolerance.direction) or tolerance.distribution == "direction"

    def _loads(self, i: int, real: Array, slope: Array) -> list[list[Array]]:
        """Q of every end of a zone, by components."""
        own = self._own(i)
        if i < len(self.inputs.tolerances):
            if self._tolerance(i).direction:
                return [[slope[k] for k in own]]
            first, second, third, fourth = (real[k] for k in own)
            return [[0.5 * (first - third), 0.5 * (second - fourth)]]
        ends = dict.fromkeys(self.rows[k].end for k in own)
        return [[slope[k] for k in own if self.rows[k].end == end] for end in ends]

    def _number(self, i: int, slope: Array) -> tuple[Array, Array, Array, Array, Array]:
        one, (deviations, means) = self._tolerance(i), self.deviations
        ends = slope * one.lower, slope * one.upper
        half = np.abs(slope) * 0.5 * (one.upper - one.lower)
        return np.minimum(*ends), np.maximum(*ends), half, slope * means[i], np.abs(slope) * deviations[i]

    def _zone(self, i: int, real: Array, slope: Array) -> tuple[Array, Array, Array, Array, Array]:
        worst, variance = np.zeros(slope.shape[1:]), np.zeros(slope.shape[1:])
        for load, (most, square) in zip(self._loads(i, real, slope), self._radii(i), strict=True):
            size = _size(load)
            worst = worst + most * size
            variance = variance + square * size * size / len(load)
        return -worst, worst, worst, np.zeros_like(worst), np.sqrt(variance)

    def _radii(self, i: int) -> list[tuple[float, float]]:
        """Largest radius of each end of a zone, and E|c|² of what lies in it."""
        if i < len(self.inputs.tolerances):
            one = self._tolerance(i)
            if not one.direction:
                return [(1.0, 1.0)]
            mean, deviation, nominal = self.deviations[1][i], self.deviations[0][i], self.nominal(i)
            return [(max(abs(nominal + one.lower), abs(nominal + one.upper)), (nominal + mean) ** 2 + deviation**2)]
        joint = self.inputs.loose[i - len(self.inputs.tolerances)]
        return [
            (most, square * len(end) / (len(end) + 2))
            for (most, square), end in zip(self._rooms[joint], self.inputs.ends(joint), strict=True)
        ]

    @cached_property
    def _rooms(self) -> dict[str, list[tuple[float, float]]]:
        """Of every end of every play: largest radius within the tolerances, and E ρ², m²."""
        tolerances = self.inputs.tolerances
        seeds = np.eye(len(tolerances))[:, :, None] if tolerances else np.zeros((0, 1, 1))
        values = self.inputs.run.system.mechanism.parameters(
            deviations={one.path: Dual(0.0, seeds[i]) for i, one in enumerate(tolerances)}
        )
        deviations, means = self.deviations
        found: dict[str, list[tuple[float, float]]] = {}
        for joint in self.inputs.loose:
            play = self.inputs.play(joint, values)
            assert play is not None
            found[joint] = []
            for radius in play.radii:
                start = float(np.ravel(primal(radius))[0])
                slope = np.ravel(derivative(radius)) * np.ones(len(tolerances))
                gain = [max(s * one.lower, s * one.upper) for s, one in zip(slope, tolerances, strict=True)]
                mean, variance = start + float(slope @ means), float(np.sum((slope * deviations) ** 2))
                found[joint].append((max(start + sum(gain), 0.0), max(mean, 0.0) ** 2 + variance))
        return found


def effects_of(inputs: Inputs) -> Effects:
    """The rows of the batch of all inputs."""
    found: list[Row] = [Row(NOBODY, 0, {}, "")]  # the mechanism itself
    for i, one in enumerate(inputs.tolerances):
        if one.direction:
            found += [Row(i, 0, {one.direction: angle}, one.path) for angle in QUARTERS[:2]]
        elif one.distribution == "direction":
            found += [Row(i, 0, {one.path: angle}, "") for angle in QUARTERS]
        else:
            found.append(Row(i, 0, {}, one.path))
    for k, joint in enumerate(inputs.loose, len(inputs.tolerances)):
        for end, keys in enumerate(inputs.ends(joint)):
            found += [Row(k, end, {}, f"seats.{joint}.{key}") for key in keys]
    return Effects(inputs, tuple(found))


def _size(load: Sequence[Array]) -> Array:
    square: Array = np.sum([np.asarray(part) ** 2 for part in load], axis=0)
    return np.sqrt(square)

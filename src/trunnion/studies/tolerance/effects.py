"""First-order effects of everything that varies: exact derivatives by dual numbers, all in one walk.

Each row of a batch moves one number: a toleranced number, an angle, or one component of a pin's offset in its hole.
What turns over the whole circle, the direction of a run-out or of a seat, is moved at every quarter: its first harmonic
follows from the derivatives there.

What varies is then one of two kinds. A number moves a measure by S·d, d between the limits. A zone moves it by
Q·(c − c₀): c lies in a disc or ball about the middle, on a circle, or in a ring, and c₀ is where it lies nominally,
which of a direction is on the circle and of a play in the middle (`zones`). Of a clearance, Q is the load of the pin
under the measure's unit load (virtual work).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from trunnion.algebra.dual import Dual, derivative, primal
from trunnion.algebra.namespace import Number, namespace
from trunnion.model.tolerances import FULL_TURN, Tolerance
from trunnion.solve.shifts import CARRIERS
from trunnion.studies.tolerance import zones
from trunnion.studies.tolerance.inputs import Inputs
from trunnion.studies.tolerance.zones import Spread, Vector

__all__ = ["Effects", "FirstOrder", "effects_of"]

Array = NDArray[np.float64]
SHARE = "share."  # of the radius at which a pin lies in its hole: before the path of its offset, at a corner
NOBODY = -1
NOISE = 1e-11
OFFSETS = tuple(f"{carrier}." for carrier in CARRIERS)
QUARTERS = (0.0, 0.5 * np.pi, np.pi, 1.5 * np.pi)
NUMBER, SIZE, ANGLE = "number", "size", "angle"  # what of its owner a row moves; of a play it is the carrier


class EffectRow(NamedTuple):
    """One row of the batch: whose it is, which numbers are set and which move, by path.

    part: what of its owner moves: the number, a size or an angle in a direction that is set; of a play its carrier.
    """

    owner: int
    end: int
    real: Mapping[str, float]
    seed: str
    part: str = NUMBER


@dataclass(frozen=True)
class Effects:
    """The rows of the batch for some inputs, and what their results mean."""

    inputs: Inputs
    rows: tuple[EffectRow, ...]

    def values(self, at: Mapping[str, float] | None = None) -> dict[str, Number]:
        """Numbers of the mechanism, (row, 1) where a row sets or moves them, about a point: duals if any row moves one.

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
            number: Number = real
            if any(row.seed for row in self.rows):
                number = Dual(real, np.array([[1.0 if row.seed == path else 0.0] for row in self.rows]))
            (seats if path.startswith(OFFSETS) else deviations)[path] = number
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
            for path in (f"{carrier}.{joint}" for carrier in self.inputs.carriers(joint)):
                for end, radius in zip(play.model.ends, play.radii, strict=True):
                    room = namespace(radius).maximum(radius, 0.0)
                    for key in end:
                        found[f"{path}.{key}"] = room * at.get(f"{SHARE}{path}.{key}", 0.0)
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

    @property
    def correlated(self) -> bool:
        """Whether any two numbers that vary go with each other."""
        return bool(np.any(self.covariance))

    @cached_property
    def covariance(self) -> Array:
        """Covariance of the toleranced numbers, without their variances."""
        covariance: Array = self.inputs.population.covariance()
        return covariance - np.diag(np.diag(covariance))

    def nominal(self, i: int) -> float:
        """Nominal value of a toleranced number."""
        return float(np.ravel(primal(self.inputs.run.values[self.tolerance(i).path]))[0])

    def nominal_angle(self, path: str) -> float:
        """Nominal value of an angle."""
        return float(np.ravel(primal(self.inputs.run.values[path]))[0])

    @cached_property
    def deviations(self) -> tuple[Array, Array]:
        """Standard deviation and mean deviation of every toleranced number, SI."""
        return self.inputs.population.deviations, self.inputs.population.means

    def numbers(self) -> dict[str, Array]:
        """Of every parameter: nominal value, limits of its deviation, standard deviation and mean; of a clearance the
        radius, 0 and the play, and the standard deviation of an offset along one axis."""
        rows = [
            (self.nominal(i), one.lower, one.upper, self.deviations[0][i], self.deviations[1][i])
            for i, one in enumerate(self.inputs.tolerances)
        ]
        for joint in self.inputs.loose:
            most, square = self.rooms[joint][0]
            count = len(self.inputs.ends(joint)[0])
            rows.append((most, 0.0, most, float(np.sqrt(square / (count + 2))), 0.0))
        keys = ("nominal", "lower", "upper", "deviation", "shift")
        return dict(zip(keys, np.array(rows).reshape(-1, len(keys)).T, strict=True))

    @cached_property
    def weights(self) -> Array:
        """How far each row's number may go, (row,): half widths, and radii of zones; 0 of rows without a derivative.

        A circle is told by four rows for its two axes: each counts half.
        """
        found = np.zeros(len(self.rows))
        for k, row in enumerate(self.rows):
            if not row.seed:
                continue
            if row.part == ANGLE:
                found[k] = np.sqrt(0.5)
            elif row.part == SIZE:
                found[k] = np.sqrt(0.5) * max(
                    abs(self.tolerance(row.owner).lower), abs(self.tolerance(row.owner).upper)
                )
            elif row.part == NUMBER:
                found[k] = self.tolerance(row.owner).half_width
            else:
                found[k] = self.rooms[self.joint(row.owner)][row.end][0]
        return found

    def tolerance(self, i: int) -> Tolerance:
        return self.inputs.tolerances[i]

    def joint(self, i: int) -> str:
        """The joint of a play."""
        return self.inputs.loose[i - len(self.inputs.tolerances)]

    @cached_property
    def places(self) -> dict[tuple[int, str], list[int]]:
        """Rows by owner and part."""
        found: dict[tuple[int, str], list[int]] = {}
        for k, row in enumerate(self.rows):
            found.setdefault((row.owner, row.part), []).append(k)
        return found

    def turns(self, i: int) -> bool:
        """Whether it is a direction over the whole turn."""
        return i < len(self.inputs.tolerances) and self.tolerance(i).distribution == FULL_TURN

    def is_zone(self, i: int) -> bool:
        return i >= len(self.inputs.tolerances) or bool(self.tolerance(i).direction) or self.turns(i)

    def sizes(self, angle: int) -> list[int]:
        """Toleranced numbers that point in a direction."""
        return [i for i, other in self.inputs.turned.items() if other == angle]

    @cached_property
    def rooms(self) -> dict[str, list[tuple[float, float]]]:
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


@dataclass(frozen=True, eq=False)
class FirstOrder:
    """What the derivatives of a measure by the rows, (row, …), make of every parameter and of all together."""

    effects: Effects
    slope: Array

    @property
    def inputs(self) -> Inputs:
        """What varies."""
        return self.effects.inputs

    @cached_property
    def sensitivity(self) -> Array:
        """∂y/∂p of every parameter, (parameter, …); of a zone |Q| summed over its ends; NaN of a direction."""
        return np.array([self._sensitivity(i) for i in range(len(self.inputs.names))])

    def _sensitivity(self, i: int) -> Array:
        if i >= len(self.inputs.tolerances):
            reach: Array = np.max([zones.reach(loads) for loads, _ in self.plays(i)], axis=0)
            return reach
        if self.effects.tolerance(i).direction:
            return zones.size(self._harmonic(i, SIZE))
        return np.full(self.slope.shape[1:], np.nan) if self.effects.turns(i) else self._slope(i)

    @cached_property
    def spread(self) -> Spread:
        """What first order makes of every parameter."""
        parts = [self._spread(i) for i in range(len(self.inputs.names))]
        return Spread(*(np.array(part) for part in zip(*parts, strict=True)))

    def _spread(self, i: int) -> Spread:
        if i >= len(self.inputs.tolerances):
            return zones.play(self.plays(i))
        one, mean, deviation = self.effects.tolerance(i), self.effects.deviations[1][i], self.effects.deviations[0][i]
        if one.direction:
            circle, ring = (self._harmonic(i, part) for part in (ANGLE, SIZE))
            limits = one.lower, one.upper
            return zones.run_out(circle, ring, limits, mean, deviation, self.effects.nominal_angle(one.direction))
        if self.effects.turns(i):
            wider = [self.effects.deviations[1][j] * self._harmonic(j, SIZE) for j in self.effects.sizes(i)]
            return zones.direction(self._harmonic(i, ANGLE), wider, self.effects.nominal_angle(one.path))
        alone = zones.number(self._steady(i), one, mean, deviation)
        if i not in self.inputs.turned:
            return alone
        circle = self._harmonic(self.inputs.turned[i], ANGLE)
        return zones.added(alone, circle, self._harmonic(i, SIZE), one, deviation)

    @cached_property
    def total(self) -> Spread:
        """Least and largest deviation of a measure, RSS half width, shift of the mean and standard deviation.

        Correlated tolerances make the standard deviation √(Sᵀ C S), C the covariance; worst case and RSS do not know
        of them.
        """
        spread = self.spread
        return Spread(
            np.sum(spread.lower, axis=0),
            np.sum(spread.upper, axis=0),
            np.sqrt(np.sum(spread.half**2, axis=0)),
            np.sum(spread.shift, axis=0),
            np.sqrt(np.maximum(np.sum(self.covariances, axis=0), 0.0)),
        )

    @cached_property
    def covariances(self) -> Array:
        """Covariance of what every parameter does with the measure itself, (parameter, …): together its variance.

        Of an independent one its own variance; of correlated ones S_i (C S)_i, which may be negative.
        """
        found = np.array(self.spread.deviation**2, float)
        if not self.effects.correlated:
            return found
        off = self.effects.covariance
        for parts in self._linear_parts():
            found[: len(off)] += parts * np.einsum("ij,j...->i...", off, parts)
        return found

    def _linear_parts(self) -> list[Array]:
        """What the toleranced numbers do, (number, …): of the same in every direction, and of each harmonic.

        Two sizes that point the same way over a full turn go with each other, each harmonic half of the square.
        """
        count = len(self.inputs.tolerances)
        nothing = 0.0 * self.slope[0]
        found = [np.array([nothing if self.effects.is_zone(i) else self._steady(i) for i in range(count)])]
        for angle in sorted(set(self.inputs.turned.values())):
            own = {i: self._harmonic(i, SIZE) for i in self.effects.sizes(angle)}
            found += [
                np.sqrt(0.5) * np.array([own[i][k] if i in own else nothing for i in range(count)]) for k in (0, 1)
            ]
        return found

    def corner(self, sign: float, at: Mapping[str, float] | None = None) -> dict[str, float]:
        """Numbers that make a measure largest (sign 1) or least (−1), to first order; zones at their rim.

        at: the corner about which the derivatives are.
        """
        found: dict[str, float] = {}
        widened: dict[int, list[Vector]] = {}  # by direction: what sizes in it add at their ends
        for i, tolerance in enumerate(self.inputs.tolerances):
            if self.effects.is_zone(i):
                continue
            steady = sign * float(self._steady(i, at))
            far = zones.Far(tolerance.upper if steady >= 0 else tolerance.lower)
            if (angle := self.inputs.turned.get(i)) is not None:
                ring = self._harmonic(i, SIZE)
                far = zones.farthest(self._circle(angle, at), ring, tolerance, steady)
                widened.setdefault(angle, []).append(far.more)
            found[tolerance.path] = self.effects.nominal(i) + far.deviation
        for i, tolerance in enumerate(self.inputs.tolerances):
            if not self.effects.is_zone(i):
                continue
            circle = np.sum([self._circle(i, at), *widened.get(i, [])], axis=0)
            if tolerance.direction:
                far = zones.farthest(circle, self._harmonic(i, SIZE), tolerance)
                found[tolerance.path], circle = self.effects.nominal(i) + far.deviation, far.place
            found[tolerance.direction or tolerance.path] = zones.angle(circle, sign)
        for k, joint in enumerate(self.inputs.loose):
            i = len(self.inputs.tolerances) + k
            carriers = self.plays(i)
            best = int(np.argmax([float(zones.worst(*one)) for one in carriers]))
            for c, (carrier, (loads, _)) in enumerate(zip(self.inputs.carriers(joint), carriers, strict=True)):
                for end, load in zip(self.inputs.ends(joint), loads, strict=True):
                    length = float(zones.size(load)) if c == best else 0.0
                    for key, part in zip(end, load, strict=True):
                        share = sign * float(part) / length if length > 0 else 0.0
                        found[f"{SHARE}{carrier}.{joint}.{key}"] = share
        return found

    def gradient(self) -> Array:
        """Derivatives of a figure by the normal scores of the toleranced numbers, to first order; 0 of directions."""
        return np.array([
            0.0 if self.effects.is_zone(i) else self._steady(i) * self.effects.deviations[0][i]
            for i in range(len(self.inputs.tolerances))
        ])  # fmt: skip

    def _slope(self, i: int) -> Array:
        found: Array = self.slope[self.effects.places[i, NUMBER][0]]
        return found

    def _harmonic(self, i: int, part: str) -> Vector:
        """First harmonic over the direction, (2, …): of the measure itself (ANGLE), or of its derivative (SIZE)."""
        places = self.effects.places.get((i, part))
        if places is None:
            return np.zeros((2, *self.slope.shape[1:]))
        east, north, west, south = (self.slope[k] for k in places)
        if part == SIZE:
            return np.array([0.5 * (east - west), 0.5 * (north - south)])
        return np.array([0.5 * (south - north), 0.5 * (east - west)])  # of its derivative by the angle

    def _circle(self, angle: int, at: Mapping[str, float] | None) -> Vector:
        """Harmonic of a direction with all sizes that point there nominal; the derivatives are about a corner."""
        circle = self._harmonic(angle, ANGLE)
        for j in [*self.effects.sizes(angle), *([angle] if self.effects.tolerance(angle).direction else [])]:
            circle = circle - self._moved(j, at) * self._harmonic(j, SIZE)
        return circle

    def _moved(self, i: int, at: Mapping[str, float] | None) -> float:
        """How far a number is from nominal at a corner."""
        path = self.effects.tolerance(i).path
        return (at or {}).get(path, self.effects.nominal(i)) - self.effects.nominal(i)

    def _steady(self, i: int, at: Mapping[str, float] | None = None) -> Array:
        """∂y/∂p, of a size in a direction over the whole turn what of it is the same in all directions."""
        found = self._slope(i)
        if i in self.inputs.turned:
            path = self.inputs.angle(self.inputs.turned[i])
            found = found - zones.along(self._harmonic(i, SIZE), (at or {}).get(path, self.effects.nominal_angle(path)))
        return found

    def plays(self, i: int) -> list[tuple[list[Vector], list[tuple[float, float]]]]:
        """For each link that may carry the seat: Q at every end, (component, …); largest radius and E|c|² of each."""
        joint = self.effects.joint(i)
        ends = self.inputs.ends(joint)
        radii = [
            (most, square * len(end) / (len(end) + 2))
            for (most, square), end in zip(self.effects.rooms[joint], ends, strict=True)
        ]
        found = []
        for carrier in self.inputs.carriers(joint):
            own = iter(self.effects.places[i, carrier])
            found.append(([np.array([self.slope[next(own)] for _ in end]) for end in ends], radii))
        return found


def effects_of(inputs: Inputs) -> Effects:
    """The rows of the batch of all inputs."""
    found: list[EffectRow] = [EffectRow(NOBODY, 0, {}, "")]  # the mechanism itself
    drawn = {one.direction for one in inputs.tolerances}  # these directions are those of run-outs
    for i, one in enumerate(inputs.tolerances):
        if one.direction:
            found += [EffectRow(i, 0, {one.direction: angle}, one.path, SIZE) for angle in QUARTERS]
            found += [EffectRow(i, 0, {one.direction: angle}, one.direction, ANGLE) for angle in QUARTERS]
        elif one.distribution == FULL_TURN:
            if one.path not in drawn:
                found += [EffectRow(i, 0, {one.path: angle}, one.path, ANGLE) for angle in QUARTERS]
        else:
            found.append(EffectRow(i, 0, {}, one.path))
            if i in inputs.turned:
                turned = inputs.angle(inputs.turned[i])
                found += [EffectRow(i, 0, {turned: angle}, one.path, SIZE) for angle in QUARTERS]
    for k, joint in enumerate(inputs.loose, len(inputs.tolerances)):
        for carrier in inputs.carriers(joint):
            for end, keys in enumerate(inputs.ends(joint)):
                found += [EffectRow(k, end, {}, f"{carrier}.{joint}.{key}", carrier) for key in keys]
    return Effects(inputs, tuple(found))

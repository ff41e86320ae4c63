"""First-order effects of everything that varies: exact derivatives by dual numbers, all in one walk.

Each row of a batch moves one number: a toleranced number, an angle, or one component of a pin's offset in its hole.
What turns over the whole circle, the direction of a run-out or of a seat, is moved at every quarter: its first harmonic
follows from the derivatives there.

What varies is then one of two kinds. A number moves a measure by S·d, d between the limits. A zone moves it by
Q·(c − c₀), c₀ where it lies nominally. On a circle, over all directions, the first harmonic of the measure is H = Q r:
the deviation lies within −H·u₀ ± |H| and has the mean −H·u₀ and the variance |H|²/2, u₀ being the nominal direction. In
a ring the size varies too, by d: H + d G instead of H. In a hole, a disc or ball, the middle is nominal: worst case
ϱ |Q|, variance E|c|² |Q|²/n of n components; Q is the load of the pin under the measure's unit load (virtual work).

The worst case on the mechanism itself is searched from the corner of the tolerance box that first order names.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from trunnion.algebra.dual import Dual, derivative, primal, single
from trunnion.algebra.namespace import Number, namespace
from trunnion.model.tolerances import FULL_TURN
from trunnion.solve.shifts import CARRIERS
from trunnion.studies.tolerance.inputs import Inputs

Array = NDArray[np.float64]
Vector = NDArray[np.float64]  # (component, …)
SHARE = "share."  # of the radius at which a pin lies in its hole: before the path of its offset, at a corner
NOBODY = -1
NOISE = 1e-11
OFFSETS = tuple(f"{carrier}." for carrier in CARRIERS)
QUARTERS = (0.0, 0.5 * np.pi, np.pi, 1.5 * np.pi)
NUMBER, SIZE, ANGLE = "number", "size", "angle"  # what of its owner a row moves; of a play it is the carrier


class Spread(NamedTuple):
    """What first order makes of every varying number, (parameter, …), or of all: deviation of a measure from nominal.

    lower, upper: least and largest; half: of the classical sum of squares; shift: of the mean; deviation: standard.
    """

    lower: Array
    upper: Array
    half: Array
    shift: Array
    deviation: Array

    @property
    def worst(self) -> Array:
        """The largest deviation to either side."""
        return np.maximum(-self.lower, self.upper)


def length(vector: Vector) -> Array:
    """|Q|."""
    return np.asarray(np.sqrt(np.sum(vector**2, axis=0)), float)


def _along(vector: Vector, direction: float) -> Array:
    """Q·u of a direction."""
    component: Array = vector[0] * np.cos(direction) + vector[1] * np.sin(direction)
    return component


class Pin(NamedTuple):
    """A pin anywhere in its hole: its load Q at every end, (component, …), its worst case and standard deviation."""

    loads: Sequence[Vector]
    worst: Array
    deviation: Array


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
            nominal = single(self.inputs.run.values.get(path, 0.0))
            start = about.get(path, nominal)
            real = np.array([[row.real.get(path, start) - nominal] for row in self.rows])
            number: Number = real
            if any(row.seed for row in self.rows):
                number = Dual(real, np.array([[1.0 if row.seed == path else 0.0] for row in self.rows]))
            (seats if path.startswith(OFFSETS) else deviations)[path] = number
        values = self.inputs.run.system.mechanism.parameters(deviations=deviations)
        for joint in self.inputs.held:
            values.update(self.inputs.seat(joint, values))
        # pins of which `at` says where in their holes they lie, as shares of the radius
        for joint in self.inputs.loose if any(path.startswith(SHARE) for path in at) else ():
            play = self.inputs.play(joint, values)
            for path in (f"{carrier}.{joint}" for carrier in self.inputs.carriers(joint)):
                for end, radius in zip(play.model.ends, play.radii, strict=True):
                    room = namespace(radius).maximum(radius, 0.0)
                    for key in (f"{path}.{part}" for part in end):
                        seats[key] = seats.get(key, 0.0) + room * at.get(f"{SHARE}{key}", 0.0)
        return {**values, **seats}

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

    def nominal(self, number: int | str) -> float:
        """Nominal value of a toleranced number, or of a number by its path."""
        path = number if isinstance(number, str) else self.inputs.tolerances[number].path
        return single(self.inputs.run.values[path])

    def numbers(self) -> dict[str, Array]:
        """Of every parameter: nominal value, limits of its deviation, standard deviation and mean; of a clearance the
        radius, 0 and the play, and the standard deviation of an offset along one axis."""
        population = self.inputs.population
        rows = [
            (self.nominal(i), tolerance.lower, tolerance.upper, population.deviations[i], population.means[i])
            for i, tolerance in enumerate(self.inputs.tolerances)
        ]
        for joint in self.inputs.loose:
            most, square = self.rooms[joint][0]
            rows.append((most, 0.0, most, float(np.sqrt(square / (len(self.inputs.ends(joint)[0]) + 2))), 0.0))
        keys = ("nominal", "lower", "upper", "deviation", "shift")
        return dict(zip(keys, np.array(rows).reshape(-1, len(keys)).T, strict=True))

    @cached_property
    def weights(self) -> Array:
        """How far each row's number may go, (row,): half widths, and radii of zones; 0 of rows without a derivative.

        A circle is told by four rows for its two axes: each counts half.
        """
        weights, count = np.zeros(len(self.rows)), len(self.inputs.tolerances)
        for k, row in enumerate(self.rows):
            if row.seed and row.owner >= count:
                weights[k] = self.rooms[self.joint(row.owner)][row.end][0]
            elif row.seed:
                tolerance = self.inputs.tolerances[row.owner]
                widest = {NUMBER: tolerance.half_width, ANGLE: np.sqrt(0.5)}
                weights[k] = widest.get(row.part, np.sqrt(0.5) * max(abs(tolerance.lower), abs(tolerance.upper)))
        return weights

    def joint(self, i: int) -> str:
        """The joint of a play."""
        return self.inputs.loose[i - len(self.inputs.tolerances)]

    @cached_property
    def places(self) -> dict[tuple[int, str], list[int]]:
        """Rows by owner and part."""
        places: dict[tuple[int, str], list[int]] = {}
        for k, row in enumerate(self.rows):
            places.setdefault((row.owner, row.part), []).append(k)
        return places

    def turns(self, i: int) -> bool:
        """Whether it is a direction over the whole turn."""
        return i < len(self.inputs.tolerances) and self.inputs.tolerances[i].distribution == FULL_TURN

    def is_zone(self, i: int) -> bool:
        """Whether it is a place in a disc, on a circle or in a ring, and no number between limits."""
        return i >= len(self.inputs.tolerances) or bool(self.inputs.tolerances[i].direction) or self.turns(i)

    def sizes(self, angle: int) -> list[int]:
        """Toleranced numbers that point in a direction."""
        return [i for i, other in self.inputs.turned.items() if other == angle]

    @cached_property
    def rooms(self) -> dict[str, list[tuple[float, float]]]:
        """Of every end of every play: largest radius within the tolerances, and E ρ², m²."""
        tolerances, count = self.inputs.tolerances, len(self.inputs.tolerances)
        population, rooms = self.inputs.population, dict[str, list[tuple[float, float]]]()
        lower, upper = (np.array([getattr(each, end) for each in tolerances]) for end in ("lower", "upper"))
        for joint in self.inputs.loose:
            rooms[joint] = []
            for radius in self.inputs.play(joint, self.inputs.duals).radii:
                start = single(radius)
                slope = self.inputs.derivatives(radius)[:count]
                most = start + float(np.sum(np.maximum(slope * lower, slope * upper)))
                mean = start + float(slope @ population.means)
                variance = float(np.sum((slope * population.deviations) ** 2))
                rooms[joint].append((max(most, 0.0), max(mean, 0.0) ** 2 + variance))
        return rooms


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
        rows = []
        for i in range(len(self.inputs.names)):
            if i >= len(self.inputs.tolerances):
                rows.append(np.max([np.sum([length(q) for q in pin.loads], axis=0) for pin in self.plays(i)], axis=0))
            elif self.inputs.tolerances[i].direction:
                rows.append(length(self._harmonic(i, SIZE)))
            else:
                slope = self.slope[self.effects.places[i, NUMBER][0]] if not self.effects.turns(i) else np.nan
                rows.append(np.full(self.slope.shape[1:], slope))
        return np.array(rows)

    @cached_property
    def spread(self) -> Spread:
        """What first order makes of every parameter."""
        parts = [self._spread(i) for i in range(len(self.inputs.names))]
        return Spread(*(np.array(part) for part in zip(*parts, strict=True)))

    def _spread(self, i: int) -> Spread:
        if i >= len(self.inputs.tolerances):  # the worst of all links that may carry a seat, the scatter of the first
            pins = self.plays(i)
            most = np.max([pin.worst for pin in pins], axis=0)
            return Spread(-most, most, most, np.zeros_like(most), pins[0].deviation)
        tolerance, means = self.inputs.tolerances[i], self.inputs.population.means
        deviation, mean = self.inputs.population.deviations[i], means[i]
        ring = self._harmonic(i, SIZE)
        if self.effects.is_zone(i):
            circle = self._harmonic(i, ANGLE)
            most = np.maximum(*(length(circle + end * ring) for end in (tolerance.lower, tolerance.upper)))
            middle = -_along(circle, self.effects.nominal(self.inputs.angle(i)))
            sizes = self.effects.sizes(i) if self.effects.turns(i) else ()  # a run-out has its own size
            wider = [means[j] * self._harmonic(j, SIZE) for j in sizes]
            center = np.sum([circle + mean * ring, *wider], axis=0)
            scatter = np.sqrt(0.5 * (length(center) ** 2 + (deviation * length(ring)) ** 2))
            return Spread(middle - most, middle + most, most, middle, scatter)
        slope = self._steady(i)
        half, scatter = np.abs(slope) * tolerance.half_width, np.abs(slope) * deviation
        ends = slope * tolerance.lower, slope * tolerance.upper
        lower, upper = np.minimum(*ends), np.maximum(*ends)
        if i in self.inputs.turned:  # what it adds to the circle of a direction over the whole turn
            circle = self._harmonic(self.inputs.turned[i], ANGLE)
            most = np.maximum(*(length(circle + end * ring) for end in (tolerance.lower, tolerance.upper)))
            more = most - length(circle)
            lower, upper, half = lower - more, upper + more, half + np.abs(more)
            scatter = np.sqrt(scatter**2 + 0.5 * (deviation * length(ring)) ** 2)
        return Spread(lower, upper, half, slope * mean, scatter)

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

        Of an independent one its own variance; of correlated ones S_i (C S)_i, which may be negative. Two sizes that
        point the same way over a full turn go with each other, each harmonic half of the square.
        """
        covariances = np.array(self.spread.deviation**2, float)
        if not self.effects.correlated:
            return covariances
        off, count, nothing = self.effects.covariance, len(self.inputs.tolerances), 0.0 * self.slope[0]
        linear = [np.array([nothing if self.effects.is_zone(i) else self._steady(i) for i in range(count)])]
        for angle in sorted(set(self.inputs.turned.values())):
            rings = {i: np.sqrt(0.5) * self._harmonic(i, SIZE) for i in self.effects.sizes(angle)}
            linear += [np.array([rings[i][k] if i in rings else nothing for i in range(count)]) for k in (0, 1)]
        for parts in linear:
            covariances[:count] += parts * np.einsum("ij,j...->i...", off, parts)
        return covariances

    def corner(self, sign: float, at: Mapping[str, float] | None = None) -> dict[str, float]:
        """Numbers that make a measure largest (sign 1) or least (−1), to first order; zones at their rim.

        at: the corner about which the derivatives are.
        """
        corner: dict[str, float] = {}
        widened: dict[int, list[Vector]] = {}  # by direction: what sizes in it add at their ends
        numbers = range(len(self.inputs.tolerances))
        for i in sorted(numbers, key=self.effects.is_zone):  # numbers first: they widen zones
            tolerance, zone, ring = self.inputs.tolerances[i], self.effects.is_zone(i), self._harmonic(i, SIZE)
            steady = 0.0 if zone else sign * float(self._steady(i, at))
            angle = i if zone else self.inputs.turned.get(i)
            circle = np.zeros(2) if angle is None else self._circle(angle, at)
            if zone:
                circle = np.sum([circle, *widened.get(i, [])], axis=0)
            ends = (tolerance.upper, tolerance.lower) if steady >= 0 else (tolerance.lower, tolerance.upper)
            end = ends[int(np.argmax([steady * end + float(length(circle + end * ring)) for end in ends]))]
            if not zone or tolerance.direction:
                corner[tolerance.path] = self.effects.nominal(i) + end
            if not zone and angle is not None:
                widened.setdefault(angle, []).append(end * ring)
            if zone:
                x, y = sign * (circle + end * ring if tolerance.direction else circle)
                corner[tolerance.direction or tolerance.path] = float(np.arctan2(y, x))
        for k, joint in enumerate(self.inputs.loose, len(numbers)):
            pins = self.plays(k)
            best = int(np.argmax([float(pin.worst) for pin in pins]))
            for c, (carrier, pin) in enumerate(zip(self.inputs.carriers(joint), pins, strict=True)):
                for end_keys, load in zip(self.inputs.ends(joint), pin.loads, strict=True):
                    size = float(length(load)) if c == best else 0.0
                    for key, part in zip(end_keys, load, strict=True):
                        corner[f"{SHARE}{carrier}.{joint}.{key}"] = sign * float(part) / size if size > 0 else 0.0
        return corner

    def gradient(self) -> Array:
        """Derivatives of a figure by the normal scores of the toleranced numbers, to first order; 0 of directions."""
        return np.array([
            0.0 if self.effects.is_zone(i) else self._steady(i) * self.inputs.population.deviations[i]
            for i in range(len(self.inputs.tolerances))
        ])  # fmt: skip

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
        for j in [*self.effects.sizes(angle), *([angle] if self.inputs.tolerances[angle].direction else [])]:
            path, nominal = self.inputs.tolerances[j].path, self.effects.nominal(j)
            circle = circle - ((at or {}).get(path, nominal) - nominal) * self._harmonic(j, SIZE)
        return circle

    def _steady(self, i: int, at: Mapping[str, float] | None = None) -> Array:
        """∂y/∂p, of a size in a direction over the whole turn what of it is the same in all directions."""
        slope: Array = self.slope[self.effects.places[i, NUMBER][0]]
        if i not in self.inputs.turned:
            return slope
        path = self.inputs.angle(self.inputs.turned[i])
        return slope - _along(self._harmonic(i, SIZE), (at or {}).get(path, self.effects.nominal(path)))

    def plays(self, i: int) -> list[Pin]:
        """A pin in its hole, for each link that may carry its seat."""
        joint = self.effects.joint(i)
        pins, rooms = [], self.effects.rooms[joint]
        for carrier in self.inputs.carriers(joint):
            rows = iter(self.effects.places[i, carrier])
            loads = [np.array([self.slope[next(rows)] for _ in end]) for end in self.inputs.ends(joint)]
            worst = np.sum([most * length(q) for q, (most, _) in zip(loads, rooms, strict=True)], axis=0)
            # every place in each end as likely as any other: E|c|² = E ρ² n/(n + 2), n components
            parts = [square / (len(q) + 2) * length(q) ** 2 for q, (_, square) in zip(loads, rooms, strict=True)]
            pins.append(Pin(loads, np.asarray(worst, float), np.sqrt(np.sum(parts, axis=0))))
        return pins


def effects_of(inputs: Inputs) -> Effects:
    """The rows of the batch of all inputs."""
    rows: list[EffectRow] = [EffectRow(NOBODY, 0, {}, "")]  # the mechanism itself
    drawn = {tolerance.direction for tolerance in inputs.tolerances}  # these directions are those of run-outs
    for i, tolerance in enumerate(inputs.tolerances):
        if tolerance.direction:
            rows += [EffectRow(i, 0, {tolerance.direction: angle}, tolerance.path, SIZE) for angle in QUARTERS]
            rows += [EffectRow(i, 0, {tolerance.direction: angle}, tolerance.direction, ANGLE) for angle in QUARTERS]
        elif tolerance.distribution == FULL_TURN:
            if tolerance.path not in drawn:
                rows += [EffectRow(i, 0, {tolerance.path: angle}, tolerance.path, ANGLE) for angle in QUARTERS]
        else:
            rows.append(EffectRow(i, 0, {}, tolerance.path))
            if i in inputs.turned:
                turned = inputs.angle(inputs.turned[i])
                rows += [EffectRow(i, 0, {turned: angle}, tolerance.path, SIZE) for angle in QUARTERS]
    for k, joint in enumerate(inputs.loose, len(inputs.tolerances)):
        for carrier in inputs.carriers(joint):
            for end, keys in enumerate(inputs.ends(joint)):
                rows += [EffectRow(k, end, {}, f"{carrier}.{joint}.{key}", carrier) for key in keys]
    return Effects(inputs, tuple(rows))


# ---- the worst case on the mechanism itself --------------------------------------------------------------------

MOST_ROUNDS = 12
SETTLED = 1e-7  # of the figure: a step that gains less is the last

# (real, slope) of the figure for a batch of values, (row,): what is made as large as can be
Objective = Callable[[Mapping[str, Number], Effects], tuple[Array, Array]]


class Corner(NamedTuple):
    """The largest (least) figure found, the numbers there by path, and how many batches it took.

    assembles: whether the corner that first order names has an answer.
    """

    value: float
    at: dict[str, float]
    rounds: int
    assembles: bool = True


def search(effects: Effects, objective: Objective, start: Mapping[str, float], sign: float, is_finite: bool) -> Corner:
    """The corner with the largest figure (sign 1) or the least (−1), from that of first order.

    From the linear corner, derivatives are taken again at the corner until it stays the same or gains nothing; then
    every number is moved to its other limit alone, and to nominal, and the best of these is kept as long as it is
    better. Pins lie at the rims of their holes, turned as the loads at the corner say. It finds the worst corner of a
    measure that is monotone in each number over its tolerance, and of others the best that such steps reach.

    is_finite: whether the nominal mechanism has the figure. NaN if none is found.
    """
    among = is_finite and all(tolerance.lower <= 0.0 <= tolerance.upper for tolerance in effects.inputs.tolerances)
    at, best, assembles = dict(start), Corner(0.0 if among else np.nan, {}, 0), True  # the nominal mechanism
    for rounds in range(1, MOST_ROUNDS + 1):
        real, slope = objective(effects.values(at), effects)
        before, best = best, _better(best, Corner(float(real[0]), at, rounds), sign)
        assembles = assembles and (rounds > 1 or bool(np.isfinite(real[0])))
        settled = rounds > 1 and abs(best.value - before.value) <= SETTLED * abs(best.value)
        if settled or not np.all(np.isfinite(slope)):
            break
        turned = FirstOrder(effects, slope).corner(sign, at)
        if all(abs(value - at[path]) <= 1e-9 * max(1.0, abs(value)) for path, value in turned.items()):
            break
        at = turned
    for rounds in range(best.rounds + 1, best.rounds + 1 + MOST_ROUNDS):
        flips: list[dict[str, float]] = []  # each number alone at its other limit, or nominal if its limits let it
        for i, tolerance in enumerate(effects.inputs.tolerances):
            if not (tolerance.direction or tolerance.distribution == "direction"):
                nominal = effects.nominal(i)
                places = {nominal + tolerance.lower, nominal + tolerance.upper}
                places |= {nominal} if tolerance.lower <= 0.0 <= tolerance.upper else set()
                flips += [{tolerance.path: to} for to in sorted(places - {best.at.get(tolerance.path, nominal)})]
        if not flips:
            break
        batch = replace(effects, rows=tuple(EffectRow(NOBODY, 0, flip, "") for flip in flips))
        real, _ = objective(batch.values(best.at), batch)
        if not np.any(np.isfinite(real)):
            break
        top = int(np.nanargmax(sign * real))
        trial = _better(best, Corner(float(real[top]), {**best.at, **flips[top]}, rounds), sign)
        if trial is best:
            break
        best = trial
    return best._replace(assembles=assembles)


def _better(best: Corner, trial: Corner, sign: float) -> Corner:
    """The trial if it is better by more than rounding."""
    gain = sign * (trial.value - best.value)
    least = 1e-12 * abs(best.value) if np.isfinite(best.value) else 0.0
    return trial if np.isfinite(trial.value) and (not np.isfinite(best.value) or gain > least) else best

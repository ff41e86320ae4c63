"""Accelerations of one free coordinate from its tables."""

from __future__ import annotations

import math
import operator
from dataclasses import dataclass, field
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from trunnion.dynamics.motor import Drive
from trunnion.dynamics.rates import Dynamics, Rates
from trunnion.dynamics.state import Moment
from trunnion.dynamics.tables import FIXED, Rub, Tables
from trunnion.joints.pairs import PlanarContactLoad
from trunnion.solve.system import law_of

__all__ = ["TabulatedRates", "spectral_radius"]

Array = NDArray[np.float64]

ROUNDS = 60
SETTLED = 1e-13  # of the largest friction
STALE = 4  # rounds after which the derivative is taken anew
CONTRACTION = 0.9  # a bound of it from which the walks are asked
SLOW, FAST = 1e-3, 1e3  # m/s: a law that is the same there depends on the sign of the slip alone


class Forces(NamedTuple):
    """What does not depend on the accelerations: effort and components without friction, by friction, and the motor.

    matrix: (E and components, column); known: of the terms without q̈ and friction; per: friction of each contact per
    normal load; shaft: effort of the motor; brake: with the sign of the motion; through: sign of the motion; drive:
    what drives, the motor itself unless a clutch slips.
    """

    matrix: Array
    known: Array
    per: Array
    shaft: float
    brake: float
    through: float
    drive: Drive


@dataclass
class TabulatedRates:
    """The rates of one free coordinate from its tables, and from walks where one solution is not certain.

    The friction forces obey φ = f N(r₀ + R φ), with q̈ eliminated from r by E = T; where the bound of the derivative of
    that map is below CONTRACTION, it has one fixed point, and successive approximation finds it.
    """

    tables: Tables
    walks: Dynamics
    _last: Array = field(default_factory=lambda: np.zeros(0))
    _inverse: Array = field(default_factory=lambda: np.zeros((0, 0)))

    def __post_init__(self) -> None:
        self._last = np.zeros(len(self.tables.rubs))

    @cached_property
    def drive(self) -> Drive:
        (one,) = self.tables.motion.drives.values()
        return one

    @cached_property
    def _size(self) -> int:
        """E and the components of all contacts."""
        rubs = self.tables.rubs
        return 1 + (rubs[-1].rows.stop if rubs else 0)

    @cached_property
    def _planar(self) -> bool:
        return all(isinstance(rub.load, PlanarContactLoad) for rub in self.tables.rubs)

    @cached_property
    def _pins(self) -> NDArray[np.bool_]:
        return np.array([getattr(rub.load, "across", 0) is None for rub in self.tables.rubs])

    @cached_property
    def _round(self) -> list[bool]:
        return [bool(one) for one in self._pins]

    @cached_property
    def _only_pins(self) -> bool:
        return bool(self._pins.all())

    @cached_property
    def _steady(self) -> list[float | None]:
        """Friction per normal load of a contact that slips forward, if it does not depend on the speed."""
        found: list[float | None] = []
        for rub in self.tables.rubs:
            tried = {_per(rub, speed, 0.0) for speed in (1e-300, SLOW, 1.0, FAST)} if rub.bristle < 0 else set()
            found.append(tried.pop() if len(tried) == 1 else None)
        return found

    # ---- one moment -------------------------------------------------------------------------------------------

    def __call__(self, at: Moment) -> Rates:
        """The rates; one lane."""
        speed, count = float(at.rate[0, 0]), len(self.tables.rubs)
        numbers, wide = self.tables.numbers(float(at.q[0, 0])), FIXED + count
        matrix = numbers[: self._size * wide].reshape(self._size, wide)
        slips = numbers[self._size * wide : self._size * wide + count]
        forces = self._forces(at, speed, matrix, slips)
        solved = self._solved(forces)
        if solved is None:
            return self.walks(at)
        second, friction = solved
        forward, backward, static, damped, dragged, greased = numbers[self._size * wide + count :]
        effort = matrix[0, 0] * second + forces.known[0] + matrix[0, FIXED:] @ friction
        loads = forward if forces.through > 0 else -backward
        lost = (dragged if speed >= 0 else -dragged) + greased * speed - friction @ slips
        works = np.array([effort, loads, static - damped * speed, lost]) * speed
        remembering = [(rub, slip) for rub, slip in zip(self.tables.rubs, slips, strict=True) if rub.bristle >= 0]
        memory = [_relaxed(self.tables, rub, float(slip) * speed, at) for rub, slip in remembering]
        error = self.drive.error(at.time, at.rate[0], at.integral[0], at.now) if self.drive.controlled else [0.0]
        return Rates(np.array([second]), np.asarray(error, float), np.array(memory), works, True, unique=True)

    def _forces(self, at: Moment, speed: float, matrix: Array, slips: Array) -> Forces:
        through = at.sense or (1.0 if speed >= 0.0 else -1.0)
        known = matrix[:, 1] * (speed * speed) + matrix[:, 2] * speed + matrix[:, 3 if through > 0 else 4]
        drive = self.drive.seen(at.now, at.slips)
        shaft = float(drive.shaft(at.time, at.rate[0], at.integral[0], at.now)[0])
        brake = (np.sign(speed) if speed != 0.0 else at.sense) * drive.braking(at.now)
        per = np.array([
            self._friction(k, rub, float(slips[k]), speed, at) for k, rub in enumerate(self.tables.rubs)
        ])  # fmt: skip
        return Forces(matrix, known, per, shaft, float(brake), through, drive)

    def _friction(self, k: int, rub: Rub, slip: float, speed: float, at: Moment) -> float:
        """Friction of a contact for a normal load of 1 N; at rest that of the motion about to begin."""
        steady, sense = self._steady[k], speed if speed != 0.0 or not rub.interval else at.sense
        if steady is not None:
            way = slip * sense
            return steady if way > 0.0 else -steady if way < 0.0 else 0.0
        moves = slip * speed if speed != 0.0 or not rub.interval else float(np.sign(slip * sense)) * 1e-300
        return _per(rub, moves, float(at.bristles[rub.bristle, 0]) if rub.bristle >= 0 else 0.0)

    def _solved(self, forces: Forces) -> tuple[float, Array] | None:
        """q̈ and the friction forces; None where walks are to be asked. The gear's loss goes by where power flows."""
        matrix, drive, driving = forces.matrix, forces.drive, True
        for _ in range(3):
            gear = drive.ratio * (drive.efficiency if driving else 1.0 / drive.efficiency)
            mass = float(matrix[0, 0]) + gear * drive.inertia * drive.ratio
            if not mass > 0.0:
                return None
            start = (gear * forces.shaft - forces.brake - float(forces.known[0])) / mass
            friction = self._settled(forces, mass, start)
            if friction is None:
                return None
            second = start - float(matrix[0, FIXED:] @ friction) / mass
            flow = (forces.shaft - drive.inertia * drive.ratio * second) * drive.ratio * forces.through
            if drive.efficiency == 1.0 or (flow >= 0.0) == driving:
                return (second, friction) if np.isfinite(second) else None
            driving = not driving
        return None

    def _settled(self, forces: Forces, mass: float, start: float) -> Array | None:
        """Friction forces that obey their laws."""
        matrix, per = forces.matrix, forces.per
        if not len(per):
            return per
        influence = matrix[1:, FIXED:] - matrix[1:, :1] * (matrix[0, FIXED:] / mass)
        first = matrix[1:, 0] * start + forces.known[1:]
        if not self._bound(per, influence) < CONTRACTION:
            return None
        return (self._chord if self._planar else self._approximated)(per, first, influence)

    def _approximated(self, per: Array, first: Array, influence: Array) -> Array | None:
        """By successive approximation, of any kind of contact."""
        found = self._last
        for _ in range(ROUNDS):
            new = per * self._normals(first + influence @ found)
            change, found = float(np.abs(new - found).max()), new
            if change <= SETTLED * float(np.abs(new).max()):
                self._last = found
                return found
        return None

    def _chord(self, per: Array, first: Array, influence: Array) -> Array | None:
        """By Newton's method with the derivative of an earlier moment, renewed where it is slow; in the plane."""
        found, inverse = self._last.tolist(), self._inverse.tolist()
        pairs = list(zip(influence[0::2].tolist(), influence[1::2].tolist(), strict=True))
        starts, factors = first.reshape(-1, 2).tolist(), per.tolist()
        for round_ in range(ROUNDS):
            # plain numbers: of the few contacts of a linkage that is faster than arrays
            miss = []
            for one, (x, y), rows, pin, old in zip(factors, starts, pairs, self._round, found, strict=True):
                x, y = x + _times(rows[0], found), y + _times(rows[1], found)
                normal = math.sqrt(x * x + y * y) if pin else max(abs(x), abs(y))
                miss.append(one * normal - old)
            size = max(map(abs, miss))
            if size <= SETTLED * max(map(abs, found)):
                self._last = np.array(found)
                return self._last
            if not math.isfinite(size):
                return None
            if len(inverse) != len(factors) or round_ % STALE == STALE - 1:
                reaction = first + influence @ np.array(found)
                slopes = self._slopes(per, reaction, self._normals(reaction), influence)
                self._inverse = np.asarray(np.linalg.inv(np.eye(len(per)) - slopes), float)
                inverse = self._inverse.tolist()
            found = [old + _times(row, miss) for old, row in zip(found, inverse, strict=True)]
        return None

    def _slopes(self, per: Array, reaction: Array, normals: Array, influence: Array) -> Array:
        """Derivative of the map of the friction forces."""
        x, y = reaction.reshape(-1, 2).T
        across = np.abs(x) >= np.abs(y)
        size = np.where(normals > 0.0, normals, np.inf)
        gx = np.where(self._pins, x / size, np.sign(x) * across)
        gy = np.where(self._pins, y / size, np.sign(y) * ~across)
        return np.asarray(per[:, None] * (gx[:, None] * influence[0::2] + gy[:, None] * influence[1::2]))

    def _normals(self, reaction: Array) -> Array:
        """Normal load of every contact, N."""
        if self._planar:
            x, y = reaction.reshape(-1, 2).T
            lengths = np.sqrt(x * x + y * y)
            return lengths if self._only_pins else np.where(self._pins, lengths, np.maximum(np.abs(x), np.abs(y)))
        return np.array([float(rub.load.normal(tuple(reaction[rub.rows]))) for rub in self.tables.rubs])

    def _bound(self, per: Array, influence: Array) -> float:
        """At least the largest derivative of the map of the friction forces, in the norm in which it is least.

        Where |F_i(φ) − F_i(ψ)| ≤ Σ_j L_ij |φ_j − ψ_j| there is one fixed point if the spectral radius of L is below 1
        (J. M. Ortega, W. C. Rheinboldt, Iterative Solution of Nonlinear Equations in Several Variables, 1970, 13.1).
        """
        count = len(per)
        if self._planar:
            x, y = np.abs(influence[0::2]), np.abs(influence[1::2])
            if (rough := float((np.abs(per) * (x + y).sum(axis=1)).max())) < CONTRACTION:
                return rough  # |x| + |y| is above both hypot and max
            each = np.abs(per)[:, None] * np.where(self._pins[:, None], np.hypot(x, y), np.maximum(x, y))
            return spectral_radius(each)
        rubs = self.tables.rubs
        sums = [sum(float(rub.load.bound(tuple(influence[rub.rows, k]))) for k in range(count)) for rub in rubs]
        return float((np.abs(per) * np.array(sums)).max())


def spectral_radius(matrix: Array) -> float:
    """Largest |eigenvalue| of a matrix of bounds; infinite where one has no value."""
    return float(np.abs(np.linalg.eigvals(matrix)).max()) if np.all(np.isfinite(matrix)) else np.inf


def _times(row: list[float], numbers: list[float]) -> float:
    return float(sum(map(operator.mul, row, numbers)))


def _per(rub: Rub, slip: float, deflection: float) -> float:
    """Friction force for a normal load of 1 N."""
    memory = {"deflection": deflection} if rub.bristle >= 0 else {}
    return float(rub.function(1.0, slip, **rub.parameters, **memory))


def _relaxed(tables: Tables, rub: Rub, slip: float, at: Moment) -> float:
    """ż = v − d(v) z."""
    relaxation = law_of(tables.motion.system, rub.joint).relaxation
    assert relaxation is not None  # or it would have no bristles
    return slip - float(relaxation(slip, **rub.parameters)) * float(at.bristles[rub.bristle, 0])

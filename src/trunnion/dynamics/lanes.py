"""Accelerations of many mechanisms at once, one free coordinate each, from their tables.

The equations are those of `tabulated`: friction forces φ = f N(r₀ + R φ) with q̈ eliminated by E = T, settled in every
lane by Newton's method from its last ones. Each lane is worked out by itself, whatever lanes are beside it: one that is
settled is left as it is.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from trunnion.dynamics.compiled_lanes import CompiledLanes, Settled
from trunnion.dynamics.motor import Drive
from trunnion.dynamics.sampled import SampledTables
from trunnion.dynamics.tables import FIXED
from trunnion.dynamics.tabulated import spectral_radius

__all__ = ["LaneState", "Lanes", "picked_drive"]

Array = NDArray[np.float64]
Rows = NDArray[np.intp]
Flags = NDArray[np.bool_]

ROUNDS = 40
CLOSE = 1e-6  # of the largest friction: a step of which the next is below rounding, for it converges to the square
CONTRACTION = 0.9  # a bound of the map's derivative from which a lane is left to others
BRINK = 1e-300  # m/s: a slip about to begin


class LaneState(NamedTuple):
    """Where lanes are: time, coordinate, speed, controller's integral; stretch of the way and whole turns before it;
    sense of the motion about to begin where the speed is 0; whether the motor is off, and the brake on."""

    time: Array
    q: Array
    speed: Array
    integral: Array
    stretch: Rows
    lap: Array
    sense: Array
    off: Flags
    braked: Flags


def _of(value: Any, rows: Rows) -> Any:
    return value[rows] if np.ndim(value) == 1 else value


def picked_drive(drive: Drive, rows: Rows) -> Drive:
    """The drive of some lanes: numbers that vary are (lane,)."""
    kept = ("points.place", "points.effort")
    parameters = {key: value if key in kept else _of(value, rows) for key, value in drive.parameters.items()}
    numbers = (drive.ratio, drive.efficiency, drive.inertia, drive.off_from, drive.brake, drive.brake_from)
    return Drive(drive.motor, parameters, *(_of(one, rows) for one in numbers))


@dataclass
class Lanes:
    """Some lanes of a table, to be asked again and again.

    rows: of the tables; drive: of these lanes; friction: of each contact, where the next settling begins, (lane,
    contact), kept up to date; compiled: machine code of the equations, if there is any.
    """

    tables: SampledTables
    rows: Rows
    drive: Drive
    friction: Array
    compiled: CompiledLanes | None = None

    def __post_init__(self) -> None:
        rubs = self.tables.rubs
        self.wide = FIXED + len(rubs)
        self.size = 1 + (rubs[-1].rows.stop if rubs else 0)
        self.pins = np.array([rub.load.across is None for rub in rubs], bool)
        self.laws = [{key: _of(value, self.rows) for key, value in one.items()} for one in self.tables.parameters]
        self.period = None if self.tables.period is None else self.tables.period[self.rows]

    # ---- one moment -------------------------------------------------------------------------------------------

    def rates(self, at: LaneState) -> tuple[Array, Array]:
        """q̈ and the rate of the controller's integral, (lane,); NaN where no one solution is certain."""
        matrix, slips = self._numbers(at)
        through = np.where(at.sense != 0.0, at.sense, np.where(at.speed >= 0.0, 1.0, -1.0))
        per = self._per(slips, at.speed, np.where(at.speed != 0.0, at.speed, at.sense))
        return self._solved(matrix, per, at, through), self._error(at)

    def beyond(self, at: LaneState) -> Array:
        """By how much what drives lanes at rest exceeds the effort at which they break away in their sense, (lane,).

        NaN where that is not certain.
        """
        matrix, slips = self._numbers(at)
        known = self._known(matrix, 0.0 * at.speed, at.sense)
        per = self._per(slips, 0.0 * at.speed, at.sense, resting=True)
        influence, first = matrix[:, 1:, FIXED:], known[:, 1:]
        friction, settled = self._settled(per, first, influence, 0.0 * self.friction)
        demanded = known[:, 0] + np.sum(matrix[:, 0, FIXED:] * friction, axis=1)
        given = self.given(at, 0.0 * at.q) - at.sense * np.where(at.braked, self.drive.brake, 0.0)
        return np.where(settled, at.sense * (given - demanded), np.nan)

    def given(self, at: LaneState, second: Array) -> Array:
        """Effort of the motor on the coordinate through its gear, less what the rotor takes; the brake left out."""
        drive = self.drive
        free = self.shaft(at) - drive.inertia * drive.ratio * second
        through = np.where(at.speed != 0.0, at.speed, at.sense)
        joint = drive.ratio * free
        found: Array = np.where(joint * through >= 0.0, joint * drive.efficiency, joint / drive.efficiency)
        return found

    def shaft(self, at: LaneState) -> Array:
        """Effort at the motor's shaft."""
        if self.drive.motor is None:
            return 0.0 * at.speed
        own = self.drive.motor.of.function(self.drive.ratio * at.speed, at.time, self.drive.parameters, at.integral)
        return np.where(at.off, 0.0, own)

    def _error(self, at: LaneState) -> Array:
        motor = self.drive.motor
        if motor is None or motor.of.error is None:
            return 0.0 * at.speed
        error = motor.of.error(self.drive.ratio * at.speed, at.time, self.drive.parameters, at.integral)
        return np.where(at.off, 0.0, error)

    def _numbers(self, at: LaneState) -> tuple[Array, Array]:
        """The columns (lane, E and components, column) and the slips (lane, contact)."""
        tables, q = self.tables, at.q
        if self.period is not None:
            q = q - at.lap * self.period if tables.parted else np.mod(q, self.period)
        found = tables.numbers(self.rows, at.stretch, q)
        whole = self.size * self.wide
        return found[:, :whole].reshape(-1, self.size, self.wide), found[:, whole:]

    def _known(self, matrix: Array, speed: Array, through: Array) -> Array:
        """E and components of what depends on neither q̈ nor friction."""
        still = np.where(through[:, None] > 0.0, matrix[:, :, 3], matrix[:, :, 4])
        found: Array = matrix[:, :, 1] * (speed * speed)[:, None] + matrix[:, :, 2] * speed[:, None] + still
        return found

    def _per(self, slips: Array, speed: Array, way: Array, resting: bool = False) -> Array:
        """Friction of every contact for a normal load of 1 N; at rest that of the motion about to begin.

        resting: whether it has not begun, so that a law that jumps there has its value at rest.
        """
        found = np.empty_like(slips)
        for k, (rub, law) in enumerate(zip(self.tables.rubs, self.laws, strict=True)):
            moves = slips[:, k] * speed
            if rub.interval:
                moves = np.where(speed != 0.0, moves, np.sign(slips[:, k] * way) * BRINK)
            function = rub.at_rest if resting and rub.at_rest is not None else rub.function
            found[:, k] = function(1.0, moves, **law)
        return found

    # ---- the equations ----------------------------------------------------------------------------------------

    def _solved(self, matrix: Array, per: Array, at: LaneState, through: Array) -> Array:
        """q̈; the loss of the gear goes by where the power flows."""
        drive, shaft = self.drive, self.shaft(at)
        way = np.where(at.speed != 0.0, np.sign(at.speed), at.sense)
        brake = np.where(at.braked, way * drive.brake, 0.0)
        rotor, lossless = drive.inertia * drive.ratio, np.broadcast_to(drive.efficiency == 1.0, shaft.shape)
        found, driving = np.full(shaft.shape, np.nan), np.ones(shaft.shape, bool)
        left = np.arange(len(shaft))
        for _ in range(2):
            share = drive.ratio * np.where(driving, drive.efficiency, 1.0 / drive.efficiency)
            given = [at.speed, through, share, shaft, brake, rotor]
            one = self._accelerated(matrix, per, [_at(number, left) for number in given], left)
            flow = (shaft[left] - _at(rotor, left) * one.second) * through[left]
            flow = flow * np.sign(_at(drive.ratio, left))
            sound = one.settled & (one.mass > 0.0)
            kept = sound & (lossless[left] | ((flow >= 0.0) == driving[left]))
            self.friction[left[kept]], found[left[kept]] = one.friction[kept], one.second[kept]
            left = left[sound & ~kept]
            if not len(left):
                break
            driving[left] = False
        return found

    def _accelerated(self, matrix: Array, per: Array, given: Sequence[Any], left: Rows) -> Settled:
        """q̈ of some lanes; by machine code where there is any, and by NumPy what that leaves."""
        if len(left) < len(matrix):
            matrix, per = matrix[left], per[left]
        if self.compiled is None:
            return self._by_numpy(matrix, per, given, self.friction[left])
        found = self.compiled(matrix, per, self.friction[left], given)
        rest = np.flatnonzero(~found.settled)
        if len(rest):
            own = self._by_numpy(matrix[rest], per[rest], [_at(one, rest) for one in given], self.friction[left[rest]])
            for whole, part in zip(found, own, strict=True):
                whole[rest] = part
        return found

    def _by_numpy(self, matrix: Array, per: Array, given: Sequence[Any], begin: Array) -> Settled:
        """q̈ with the friction that goes with it. given: see `compiled_lanes.GIVEN`."""
        speed, through, share, free, brake, rotor = given
        known = self._known(matrix, speed, through)
        mass = matrix[:, 0, 0] + share * rotor
        start = (share * free - brake - known[:, 0]) / mass
        influence = matrix[:, 1:, FIXED:] - matrix[:, 1:, :1] * (matrix[:, :1, FIXED:] / mass[:, None, None])
        friction, settled = self._settled(per, matrix[:, 1:, 0] * start[:, None] + known[:, 1:], influence, begin)
        second = start - np.sum(matrix[:, 0, FIXED:] * friction, axis=1) / mass
        return Settled(friction, second, mass, settled)

    def _settled(self, per: Array, first: Array, influence: Array, begin: Array) -> tuple[Array, Flags]:
        """Friction forces that obey their laws, and where they are certain to be the only ones."""
        count = per.shape[1]
        if not count:
            return per, np.ones(len(per), bool)
        sound = self._certain(per, influence)
        found, left = begin.copy(), np.flatnonzero(sound)
        if len(left) < len(per):
            per, first, influence = per[left], first[left], influence[left]
        for _ in range(ROUNDS):
            reaction = first + np.matmul(influence, found[left][..., None])[..., 0]
            normals, x, y = self._normals(reaction)
            miss = per * normals - found[left]
            slopes = np.eye(count) - self._slopes(per, influence, normals, x, y)
            found[left] += np.linalg.solve(slopes, miss[..., None])[..., 0]
            far = ~(np.abs(miss).max(axis=1) <= CLOSE * np.abs(found[left]).max(axis=1))
            if not np.any(far):
                left = left[:0]
                break
            if not np.all(far):
                left, per, first, influence = left[far], per[far], first[far], influence[far]
        sound[left] = False
        return found, sound & np.all(np.isfinite(found), axis=1)

    def _certain(self, per: Array, influence: Array) -> Flags:
        """Whether the map of the friction forces has one fixed point, by the bounds of `tabulated`."""
        x, y = np.abs(influence[:, 0::2]), np.abs(influence[:, 1::2])
        found = np.asarray((np.abs(per) * (x + y).sum(axis=2)).max(axis=1) < CONTRACTION)
        for lane in np.flatnonzero(~found):
            pins = self.pins[:, None]
            each = np.where(pins, np.hypot(x[lane], y[lane]), np.maximum(x[lane], y[lane]))
            found[lane] = spectral_radius(np.abs(per[lane])[:, None] * each) < CONTRACTION
        return found

    def _normals(self, reaction: Array) -> tuple[Array, Array, Array]:
        """Normal load of every contact, N, and its two components."""
        x, y = reaction[:, 0::2], reaction[:, 1::2]
        pins = np.sqrt(x * x + y * y)
        return (pins if self.pins.all() else np.where(self.pins, pins, np.maximum(np.abs(x), np.abs(y)))), x, y

    def _slopes(self, per: Array, influence: Array, normals: Array, x: Array, y: Array) -> Array:
        """Derivative of the map of the friction forces, (lane, contact, contact)."""
        across, size = np.abs(x) >= np.abs(y), np.where(normals > 0.0, normals, np.inf)
        gx = np.where(self.pins, x / size, np.sign(x) * across)
        gy = np.where(self.pins, y / size, np.sign(y) * ~across)
        found: Array = (per * gx)[..., None] * influence[:, 0::2] + (per * gy)[..., None] * influence[:, 1::2]
        return found


def _at(value: Any, rows: Rows) -> Any:
    return value[rows] if np.ndim(value) else value

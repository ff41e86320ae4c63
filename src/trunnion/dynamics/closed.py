"""Accelerations while contacts of rigid bodies stay closed: their forces are found with them.

A closed contact keeps its gap at 0, g̈ = 0 under a normal force; it slips under f times that force, or keeps its slip at
0 under a force along the tangent. Efforts and gaps are taken together, and solved as those of free coordinates are.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from trunnion.algebra.dual import primal
from trunnion.dynamics.rates import Layout, Rates, Seeing, Seen, Walks, seen_of
from trunnion.dynamics.state import (
    CLOSE,
    DIFFERENCE,
    ROUNDS,
    SETTLED,
    Accelerated,
    FreeMotion,
    Moment,
)
from trunnion.dynamics.touching import Closed, ContactState, Onset

__all__ = ["ClosedMotion", "ClosedRates", "Linear", "rates_of"]

Array = NDArray[np.float64]


class Linear(NamedTuple):
    """At one moment: masses M (coordinate, coordinate), how rates of gaps and slips follow from those of the
    coordinates, W (2 contacts, coordinate), gaps first, what they are without, (2 contacts,), m/s, and the gaps, m,
    (contact,)."""

    mass: Array
    ways: Array
    driven: Array
    gaps: Array


@dataclass(frozen=True)
class ClosedMotion(FreeMotion):
    """A free motion of rigid bodies that touch."""

    @cached_property
    def force(self) -> float:
        """A typical force, N."""
        size, found = float(np.ravel(self.system.size(self.values))[0]), 0.0
        pace = float(np.ravel(primal(self.system.pace(self.values)))[0])
        for link in self.system.mechanism.effective_links:
            mass, inertia = (
                float(np.ravel(primal(self.values.get(f"links.{link}.{key}", 0.0)))[0]) for key in ("mass", "inertia")
            )
            found += mass + inertia / size**2
        return max(found * size * pace * pace, 1e-300)

    def accelerate(self, at: Moment, guess: Array | None = None) -> Accelerated:
        """Accelerations with the forces of the closed contacts; NaN where there are none."""
        closed, sticks = self.closed(at)
        if not closed:
            return super().accelerate(at, guess)
        count, lanes = at.q.shape
        size = count + len(closed) + len(sticks)
        unit = np.concatenate([self.unit, np.full(size - count, self.force)])
        numbers, turned = np.zeros((size, lanes)), np.zeros(lanes, bool)
        if guess is not None:
            numbers[:count] = guess
        step = np.full((size, lanes), np.inf)
        for _ in range(ROUNDS):
            steps = np.maximum(unit[:, None], np.abs(numbers)) * (1.0 if self.affine else DIFFERENCE)
            tried = [numbers, *(numbers + np.where(np.arange(size)[:, None] == i, steps, 0.0) for i in range(size))]
            found = self._missed(at, np.concatenate(tried, axis=1), closed, sticks).reshape(size, size + 1, lanes)
            slopes = (found[:, 1:] - found[:, :1]) / steps[None] * unit[None, :, None]
            step, turned = _step(slopes, found[:, 0])
            step = step * unit[:, None]
            numbers = numbers - step
            largest = np.maximum(np.abs(numbers), np.max(np.abs(numbers / unit[:, None]), axis=0) * unit[:, None])
            if np.all(~np.isfinite(step) | (np.abs(step) <= (CLOSE if self.affine else SETTLED) * largest)):
                break
            if self.affine:
                step = 0.0 * step
                break
        numbers = np.where(turned, np.nan, numbers)
        converged = np.all(
            np.isfinite(numbers) & (np.abs(step) <= 1e-8 * np.maximum(np.abs(numbers), unit[:, None])), axis=0
        )
        second, onsets = self._unpacked(at, numbers, closed, sticks)
        onsets = self.shared(onsets, sticks)
        return Accelerated(second, self.solve(at._replace(onsets=onsets), second), turned, converged, onsets)

    def closed(self, at: Moment) -> tuple[list[int], list[int]]:
        """The closed contacts whose forces are to be found, and those that stick: on every wall the first."""
        closed = [k for k in range(len(at.onsets)) if _sense(at, k) is not None]
        still = {self.contacts.each[k].surface: k for k in reversed(closed) if _sticks(at.onsets[k])}
        return closed, list(still.values())

    def _unpacked(
        self, at: Moment, numbers: Array, closed: Sequence[int], sticks: Sequence[int]
    ) -> tuple[Array, tuple[Onset, ...]]:
        """Accelerations, and the contacts with their forces."""
        count = len(self.names)
        return numbers[:count], self.forced(at.onsets, numbers[count:], closed, sticks)

    def forced(
        self, onsets: Sequence[Onset], forces: Sequence[Any] | Array, closed: Sequence[int], sticks: Sequence[int]
    ) -> tuple[Onset, ...]:
        """The contacts with their forces: normal ones, then along the tangent of those that stick."""
        found = list(onsets)
        for row, k in enumerate(closed):
            onset = found[k]
            assert isinstance(onset, Closed)
            if k in sticks:
                friction = forces[len(closed) + sticks.index(k)]
            elif _sticks(onset):  # of those that stick on one wall the first is given all
                friction = 0.0 * forces[row]
            else:
                friction = (
                    -self.contacts.each[k].coefficient * forces[row] * (1 if onset.sense is None else onset.sense)
                )
            found[k] = Closed(onset.sense, forces[row], friction)
        return tuple(found)

    def shared(self, onsets: Sequence[Onset], sticks: Sequence[int]) -> tuple[Onset, ...]:
        """What holds on one wall, shared out by the normal forces."""
        found = list(onsets)
        for first in sticks:
            on = [k for k, one in enumerate(onsets) if _sticks(one)
                  and self.contacts.each[k].surface == self.contacts.each[first].surface]  # fmt: skip
            forces = {k: onsets[k] for k in on}
            whole = sum(one.normal for one in forces.values() if isinstance(one, Closed))
            held = sum(one.friction for one in forces.values() if isinstance(one, Closed))
            for k, one in forces.items():
                if isinstance(one, Closed) and len(on) > 1:
                    found[k] = Closed(0, one.normal, held * one.normal / whole)
        return tuple(found)

    def _missed(self, at: Moment, numbers: Array, closed: Sequence[int], sticks: Sequence[int]) -> Array:
        """E − T, and the accelerations of gaps and of slips that are to be 0."""
        second, onsets = self._unpacked(at, numbers, closed, sticks)
        times = second.shape[1] // at.q.shape[1]
        q, rate, integral, bristles = (np.tile(part, (1, times)) for part in (at.q, at.rate, at.integral, at.bristles))
        many = at._replace(
            time=np.tile(at.time, times),
            q=q,
            rate=rate,
            integral=integral,
            bristles=bristles,
            onsets=onsets,
        )
        back = self.solve(many, second)
        moved = {k: self.contacts.each[k].accelerations(back.walk) for k in closed}
        efforts = self.demanded(back, q.shape) - self.given(many, second)
        return np.vstack([efforts, *(moved[k][0] for k in closed), *(moved[k][1] for k in sticks)])

    # ---- rates ------------------------------------------------------------------------------------------------

    def linear(self, at: Moment) -> Linear:
        """What impulses come to, at one moment: friction in other joints takes no impulses."""
        free = at._replace(onsets=(None,) * len(self.contacts.each), rate=0.0 * at.rate)
        count = len(self.names)
        q, integral, bristles = (np.tile(part, (1, count + 1)) for part in (at.q, at.integral, at.bristles))
        many = free._replace(
            time=np.tile(at.time, count + 1), q=q, rate=np.eye(count, count + 1, 1), integral=integral,
            bristles=bristles,
        )  # fmt: skip
        states = self.contacts.states(self.walk(many, np.zeros_like(q)))
        found, gaps = rates_of(states), np.array([state.gap[0] for state in states], float)
        return Linear(self.inertia(free)[:, :, 0], found[:, 1:] - found[:, :1], found[:, 0], gaps)


def _sticks(onset: Onset) -> bool:
    """Whether a closed contact does; a sense that is recorded is that of a slip."""
    return isinstance(onset, Closed) and isinstance(onset.sense, int) and onset.sense == 0


def _sense(at: Moment, k: int) -> int | None:
    """Of a contact that stays closed under forces that are to be found; else None."""
    onset = at.onsets[k]
    return onset.sense if isinstance(onset, Closed) else None


class Swift(Seeing, Protocol):
    """What tells the rates with closed contacts without walks; None where it is in doubt."""

    def derivative(self, time: float, row: Array, onsets: Sequence[Onset], now: float) -> Array: ...

    def touches(self, at: Moment) -> Seen | None: ...

    def linear(self, at: Moment) -> Linear | None: ...


class ClosedRates:
    """The rates of rigid bodies that fly or touch, by machine code where there is any, else by walks."""

    def __init__(self, motion: ClosedMotion, swift: Swift | None) -> None:
        self.motion, self.swift, self.layout = motion, swift, Layout.of(motion)
        self.walks = Walks(motion)

    def __call__(self, at: Moment) -> Rates:
        return (self.swift or self.walks)(at)

    def derivative(
        self, time: float, row: Array, onsets: Sequence[Onset], now: float, senses: tuple[int, ...] = ()
    ) -> Array:
        """The derivative of a row; NaN for no answer. senses: none, as no joint sticks."""
        if self.swift is not None:
            return self.swift.derivative(time, row, onsets, now)
        n = self.layout.coordinates
        at = self.layout.moment(np.array([time]), row[:, None], now=now)._replace(onsets=tuple(onsets))
        with np.errstate(all="ignore"):
            told = self(at)
        return self.layout.row(row[n : 2 * n], told) if told.sound else np.full(len(row), np.nan)

    def look(self, at: Moment) -> Seen:
        """See `rates.Seeing`; without forces."""
        return (self.swift or self.walks).look(at._replace(onsets=(None,) * len(at.onsets)))

    def touches(self, at: Moment) -> Seen:
        """The contacts with their forces, in many lanes; some are closed."""
        found = self.swift.touches(at) if self.swift else None
        if found is not None:
            return found
        solved = self.motion.accelerate(at)
        return seen_of(self.motion.contacts.pushes(solved.back.walk, solved.onsets), at.q.shape[1])

    def linear(self, at: Moment) -> Linear:
        """What impulses come to, at one moment."""
        found = self.swift.linear(at) if self.swift else None
        return self.motion.linear(at) if found is None else found


def rates_of(states: Sequence[ContactState]) -> Array:
    """Rates of gaps, then slips, (2 contacts, lane), m/s."""
    return np.array([state.rate for state in states] + [state.slip for state in states], float)


def _step(slopes: Array, missed: Array) -> tuple[Array, NDArray[np.bool_]]:
    """x of A x = b, (equation, unknown, lane), and lanes in which the determinant of A is not positive."""
    step, turned = np.full(missed.shape, np.nan), np.ones(missed.shape[1], bool)
    sound = np.all(np.isfinite(slopes), axis=(0, 1)) & np.all(np.isfinite(missed), axis=0)
    stack = np.moveaxis(slopes[..., sound], -1, 0)
    size = np.max(np.abs(stack), axis=2, keepdims=True)
    sound[sound] = np.all(size[..., 0] > 0.0, axis=1)
    stack, size = np.moveaxis(slopes[..., sound], -1, 0), np.max(np.abs(slopes[..., sound]), axis=1)
    stack = stack / np.moveaxis(size, -1, 0)[..., None]
    signs = np.linalg.det(stack)
    good = np.flatnonzero(sound)[signs != 0.0]
    turned[sound] = signs <= 0.0
    if len(good):
        step[:, good] = np.linalg.solve(stack[signs != 0.0], (missed[:, good] / size[:, signs != 0.0]).T[..., None])[
            ..., 0
        ].T
    return step, turned

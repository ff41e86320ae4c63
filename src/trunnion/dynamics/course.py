"""The courses of motions in time, lane by lane, and the figures that are asked of them.

A course is a row of steps, each known at the nodes of a polynomial: so are the steps of an integrator with its dense
output, and a time is found from a coordinate, or a largest speed, as exactly as the motion itself is known.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.polynomial import chebyshev
from numpy.typing import NDArray

from trunnion.algebra.roots import root

if TYPE_CHECKING:
    from trunnion.dynamics.solution import Solution
    from trunnion.dynamics.state import FreeMotion

__all__ = ["FEWEST", "NODES", "OVER_TIME", "STARTED", "STEADY", "Courses"]

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

TURN = 2 * np.pi
STEADY = 0.02  # of the mean speed: by how much the turn before the last may differ where it runs steadily
STARTED = 0.95  # of the mean speed of the last turn: from then on it has started
BEGUN = 0.5  # of that: a motion that begins faster does not start
FEWEST = 3  # whole turns of which one speaks of a steady one

DEGREE = 7  # of the dense output of DOP853
NODES = 0.5 - 0.5 * np.cos(np.pi * np.arange(DEGREE + 1) / DEGREE)  # of a step, from its begin 0 to its end 1
FINE = 32  # parts of a step in which its largest number is looked for
# coefficients of the polynomial, by the nodes
_COEFFICIENTS: Array = np.asarray(np.linalg.inv(chebyshev.chebvander(2 * NODES - 1, DEGREE)), np.float64)
_DERIVED: Array = 2 * chebyshev.chebvander(2 * NODES - 1, DEGREE - 1) @ chebyshev.chebder(_COEFFICIENTS)
_FINER: Array = chebyshev.chebvander(np.linspace(-1.0, 1.0, FINE + 1), DEGREE) @ _COEFFICIENTS
ROUNDS, EXACT = 60, 1e-15  # to the place of a number in a step
BACKWARD = 1e-9  # of a turn, by which one that goes round and round may seem to go back


def _by(matrix: Array, numbers: Array) -> Array:
    """Σ_j m_ij n_j over the last axis, summed in one order for every lane."""
    total = np.zeros((*numbers.shape[:-1], len(matrix)))
    for j, column in enumerate(matrix.T):
        total += numbers[..., j, None] * column
    return total


@dataclass(frozen=True)
class Courses:
    """Time, coordinate, speed and effort of the drive, (4, lane, step, node); after its last step a lane stays."""

    numbers: Array

    @classmethod
    def of(cls, count: int, found: Sequence[tuple[NDArray[np.intp], Array]]) -> Courses:
        """From steps as they were taken: lanes, and (number, lane, node) of each."""
        taken = np.zeros(count, np.intp)
        places = []
        for lanes, _ in found:
            places.append(taken[lanes].copy())
            taken[lanes] += 1
        numbers = np.zeros((4, count, max(1, int(taken.max(initial=0))), len(NODES)))
        for (lanes, own), place in zip(found, places, strict=True):
            numbers[:, lanes, place] = own
        after = np.arange(numbers.shape[2]) >= taken[:, None]
        last = numbers[:, np.arange(count), np.maximum(taken - 1, 0), -1]
        return cls(np.where(after[None, :, :, None], last[:, :, None, None], numbers))

    @classmethod
    def of_solution(cls, motion: FreeMotion, solution: Solution, i: int = 0) -> Courses:
        """That of one free coordinate of one motion."""
        found, n = [], solution.layout.coordinates
        for stretch in solution.stretches:
            if not stretch.end > stretch.begin:
                continue
            time = stretch.begin + (stretch.end - stretch.begin) * NODES
            rows = stretch.state(time)
            second = cls.slopes(rows[n : 2 * n]) / (stretch.end - stretch.begin)
            at = solution.layout.moment(time, rows, stretch.sense, stretch.now, stretch.slips)
            effort = motion.given(at, 0.0 * second if stretch.resting else second)[i]
            found.append((np.zeros(1, np.intp), np.array([time, rows[i], rows[n + i], effort])[:, None]))
        return cls.of(1, found)

    @staticmethod
    def slopes(numbers: Array) -> Array:
        """Derivatives by the share of the step, of numbers at the nodes."""
        return _by(_DERIVED, numbers)

    def figures(self, times: Array | None = None) -> dict[str, Array]:
        """Every figure of `FIGURES`, (lane,); NaN where a motion has none. times: for `over` beside them, if given."""
        with np.errstate(all="ignore"):
            found = {name: figure(self) for name, figure in FIGURES.items()}
            return found if times is None else found | self.over(times)

    # ---- turns ------------------------------------------------------------------------------------------------

    @cached_property
    def turned(self) -> Array:
        """How far the coordinate has gone from where it began, in the sense in which it goes, (lane, step, node)."""
        gone = self.numbers[1] - self.numbers[1, :, :1, :1]
        found: Array = gone * np.where(gone[:, -1:, -1:] < 0.0, -1.0, 1.0)
        return found

    @cached_property
    def runs(self) -> Flags:
        """Whether a lane goes round and round, one way, to the end, (lane,)."""
        gone = self.turned.reshape(len(self.turned), -1)
        onward = np.all(np.diff(gone, axis=1) >= -BACKWARD, axis=1)
        found: Flags = onward & (gone[:, -1] >= FEWEST * TURN) & (self.numbers[2, :, -1, -1] != 0.0)
        return found

    def at(self, gone: Array, number: int) -> Array:
        """A number where the coordinate has gone so far, (lane,)."""
        lane = np.arange(len(gone))
        step = np.minimum(np.sum(self.turned[:, :, -1] < gone[:, None], axis=1), self.turned.shape[1] - 1)
        basis = _basis_where(self.turned[lane, step], gone)
        found: Array = np.sum(basis * _by(_COEFFICIENTS, self.numbers[number, lane, step]), axis=1)
        return found

    def over(self, times: Array) -> dict[str, Array]:
        """Every number of `OVER_TIME` at times, (lane, time)."""
        shape = self.numbers.shape[1], len(times)
        step = np.array([np.searchsorted(ends, times) for ends in self.numbers[0, :, :, -1]])
        step = np.minimum(step, self.numbers.shape[2] - 1).ravel()
        lane = np.repeat(np.arange(shape[0]), shape[1])
        basis = _basis_where(self.numbers[0, lane, step], np.tile(times, shape[0]))
        return {
            name: np.sum(basis * _by(_COEFFICIENTS, self.numbers[number, lane, step]), axis=1).reshape(shape)
            for name, number in OVER_TIME.items()
        }

    @cached_property
    def end(self) -> Array:
        """The time at the end, s, (lane,)."""
        return self.numbers[0, :, -1, -1]

    @cached_property
    def gone(self) -> Array:
        """How far the coordinate has gone at the end, (lane,)."""
        return self.turned[:, -1, -1]

    @cached_property
    def last_turn(self) -> Array:
        """The time at which the last whole turn begins, s, (lane,); NaN where it does not run steadily."""
        begins = np.where(self.runs, self.at(self.gone - TURN, 0), np.nan)
        before = self.at(self.gone - 2 * TURN, 0)
        speed, earlier = TURN / (self.end - begins), TURN / (begins - before)
        found: Array = np.where(np.abs(earlier - speed) <= STEADY * speed, begins, np.nan)
        return found

    def largest(self, numbers: Array, counts: Flags | None = None) -> Array:
        """The largest of a number at the nodes, (lane,). counts: at which of the FINE parts of a step."""
        fine = _by(_FINER, numbers)
        seen = np.where(np.isfinite(fine) & (True if counts is None else counts), fine, -np.inf)
        lane = np.arange(len(seen))
        step, part = np.divmod(np.argmax(seen.reshape(len(seen), -1), axis=1), FINE + 1)
        most, inner = seen[lane, step, part], np.clip(part, 1, FINE - 1)
        before, here, after = (fine[lane, step, inner + k] for k in (-1, 0, 1))
        bend = before - 2.0 * here + after
        top = here - (after - before) ** 2 / (8.0 * bend)
        inside = (part == inner) & (here >= before) & (here >= after) & (bend < 0.0)
        found: Array = np.where(inside, top, most)
        return found


def _basis_where(own: Array, wanted: Array) -> Array:
    """The basis at the share of a step where a rising number is as wanted, (lane, coefficient). own: (lane, node)."""
    coefficients, slopes = _by(_COEFFICIENTS, own), _by(_COEFFICIENTS, Courses.slopes(own))
    low, high = np.zeros(len(wanted)), np.ones(len(wanted))
    place = np.clip((wanted - own[:, 0]) / (own[:, -1] - own[:, 0]), 0.0, 1.0)
    left = np.isfinite(place)
    place = np.where(left, place, 1.0)
    for _ in range(ROUNDS):
        basis = _basis(place)
        off, steep = np.sum(basis * coefficients, axis=1) - wanted, np.sum(basis * slopes, axis=1)
        low, high = np.where(off < 0.0, place, low), np.where(off < 0.0, high, place)
        better = place - off / steep
        better = np.where((better > low) & (better < high), better, np.where(off == 0.0, place, 0.5 * (low + high)))
        changed = np.abs(better - place) > EXACT
        place = np.where(left, better, place)
        left = left & changed
        if not np.any(left):
            break
    return _basis(place)


def _basis(place: Array) -> Array:
    found: Array = np.cos(np.arange(DEGREE + 1) * np.arccos(np.clip(2 * place - 1, -1.0, 1.0))[:, None])
    return found


# ---- the figures ----------------------------------------------------------------------------------------------


def steady_speed(course: Courses) -> Array:
    """Mean speed of the last whole turn, rad/s: 2π over the time that it takes."""
    return TURN / (course.end - course.last_turn)


def fluctuation(course: Courses) -> Array:
    """Coefficient of fluctuation of the last whole turn: (ω_max − ω_min)/ω_mean."""
    speed, begins = np.abs(course.numbers[2]), course.gone - TURN
    inside = _by(_FINER, course.turned) >= begins[:, None, None]
    first = np.abs(course.at(begins, 2))
    most = np.maximum(course.largest(speed, inside), first)
    least = np.minimum(-course.largest(-speed, inside), first)
    return (most - least) / steady_speed(course)


def starting_time(course: Courses) -> Array:
    """The first time, s, at which the mean speed of the turn that ends there is STARTED of that of the last turn."""
    limit = TURN / (STARTED * steady_speed(course))
    slow = np.abs(course.numbers[2, :, 0, 0]) < BEGUN * steady_speed(course)

    def longer(gone: Array) -> Array:
        """By how much the turn that ends here takes longer."""
        return course.at(gone, 0) - course.at(gone - TURN, 0) - limit

    low, high = np.full(len(limit), np.nan), np.full(len(limit), np.nan)
    for lane in np.flatnonzero(np.isfinite(limit) & slow):
        gone, time = course.turned[lane].ravel(), course.numbers[0, lane].ravel()
        takes = np.where(gone >= TURN, time - np.interp(gone - TURN, gone, time), np.inf)
        first = int(np.argmax(takes <= limit[lane]))
        low[lane], high[lane] = (
            max(TURN, gone[max(first - len(NODES), 0)]),
            gone[min(first + len(NODES), len(gone) - 1)],
        )
    ends = longer(low), longer(high)
    started = np.where(ends[0] <= 0.0, low, root(longer, low, high, *ends, EXACT * np.abs(high)))
    return np.where(slow, course.at(started, 0), np.nan)


def peak_effort(course: Courses) -> Array:
    """The largest |effort| of the drive, N m or N."""
    effort = course.numbers[3]
    return np.maximum(course.largest(effort), course.largest(-effort))


FIGURES: dict[str, Callable[[Courses], Array]] = {
    "starting_time": starting_time,
    "steady_speed": steady_speed,
    "fluctuation": fluctuation,
    "peak_effort": peak_effort,
}

OVER_TIME = {"coordinate": 1, "rate": 2, "effort": 3}  # rows of `Courses.numbers`

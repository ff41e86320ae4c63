"""What is said of a motion that goes round and round: how it starts, how evenly it then runs, how it runs down."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.polynomial import chebyshev
from numpy.typing import NDArray
from scipy.optimize import brentq

from trunnion.dynamics.solution import Solution
from trunnion.dynamics.state import FreeMotion
from trunnion.results.figure import Figure

__all__ = ["FIGURES", "NODES", "DriveCourse", "steady_figures"]

Array = NDArray[np.float64]

TURN = 2 * np.pi
STEADY = 0.02  # of the mean speed: by how much the turn before the last may differ where it runs steadily
STARTED = 0.95  # of the mean speed of the last turn: from then on it has started
BEGUN = 0.5  # of that: a motion that begins faster does not start
FEWEST = 3  # whole turns of which one speaks of a steady one
BACKWARD = 1e-9  # of a turn, by which one that goes round and round may seem to go back

DEGREE = 7  # of the dense output of DOP853
NODES: Array = -np.cos(np.pi * np.arange(DEGREE + 1) / DEGREE)  # of a step, from its begin −1 to its end 1
FINE: Array = np.linspace(-1.0, 1.0, 33)  # places in a step at which its largest number is looked for
_COEFFICIENTS: Array = np.asarray(np.linalg.inv(chebyshev.chebvander(NODES, DEGREE)), np.float64)
_DERIVED: Array = chebyshev.chebvander(NODES, DEGREE - 1) @ chebyshev.chebder(_COEFFICIENTS)
_FINER: Array = chebyshev.chebvander(FINE, DEGREE) @ _COEFFICIENTS


@dataclass(frozen=True)
class DriveCourse:
    """Time, coordinate, speed and effort of a drive at the nodes of every step, (step, node).

    Each step is a polynomial, as it is with its dense output: a time is found from a coordinate, or a largest speed, as
    exactly as the motion itself is known.
    """

    time: Array
    coordinate: Array
    speed: Array
    effort: Array

    @classmethod
    def of(cls, motion: FreeMotion, solution: Solution, i: int) -> DriveCourse:
        """That of one free coordinate."""
        steps, n = list[Array](), solution.layout.coordinates
        for stretch in solution.stretches:
            half = 0.5 * (stretch.end - stretch.begin)
            if not half > 0.0:
                continue
            time = stretch.begin + half * (1.0 + NODES)
            rows = stretch.state(time)
            second = rows[n : 2 * n] @ _DERIVED.T / half
            at = solution.layout.moment(time, rows, stretch.sense, stretch.now, stretch.slips)
            effort = motion.given(at, 0.0 * second if stretch.resting else second)[i]
            steps.append(np.array([time, rows[i], rows[n + i], effort]))
        return cls(*np.stack(steps or [np.zeros((4, len(NODES)))], axis=1))

    def figures(self) -> dict[str, float]:
        """Every figure of `FIGURES`; NaN where the motion has none."""
        with np.errstate(all="ignore"):
            return {name: figure(self) for name, figure in FIGURES.items()}

    @cached_property
    def gone(self) -> Array:
        """How far the coordinate has gone from where it began, in the sense in which it goes, (step, node)."""
        gone = self.coordinate - self.coordinate[0, 0]
        return np.asarray(-gone if gone[-1, -1] < 0.0 else gone)

    @property
    def travel(self) -> float:
        """How far it has gone at the end."""
        return float(self.gone[-1, -1])

    @cached_property
    def runs(self) -> bool:
        """Whether it goes round and round, one way, to the end."""
        onward = bool(np.all(np.diff(self.gone.ravel()) >= -BACKWARD))
        return onward and self.travel >= FEWEST * TURN and bool(self.speed[-1, -1] != 0.0)

    def at(self, gone: float, numbers: Array) -> float:
        """A number, (step, node), where the coordinate has gone so far."""
        step = min(int(np.searchsorted(self.gone[:, -1], gone)), len(self.gone) - 1)
        motion_gone = _COEFFICIENTS @ self.gone[step]

        def ahead(place: float) -> float:
            return float(chebyshev.chebval(place, motion_gone)) - gone

        inside = ahead(-1.0) < 0.0 < ahead(1.0)
        place = brentq(ahead, -1.0, 1.0, xtol=1e-15) if inside else (-1.0 if ahead(-1.0) >= 0.0 else 1.0)
        return float(chebyshev.chebval(place, _COEFFICIENTS @ numbers[step]))

    @cached_property
    def last_turn(self) -> float:
        """The time at which the last whole turn begins, s; NaN where it does not run steadily, round and round."""
        if not self.runs:
            return np.nan
        begin, before = (self.at(self.travel - turns * TURN, self.time) for turns in (1, 2))
        speed, earlier = TURN / (self.time[-1, -1] - begin), TURN / (begin - before)
        return begin if abs(earlier - speed) <= STEADY * speed else np.nan

    def largest(self, numbers: Array, since: float = -np.inf) -> float:
        """The largest of a number, (step, node), since the coordinate has gone so far: between three places of a step
        the vertex of their parabola."""
        fine = numbers @ _FINER.T
        fine[~(np.isfinite(fine) & (self.gone @ _FINER.T >= since))] = -np.inf
        step, place = np.unravel_index(np.argmax(fine), fine.shape)
        most = float(fine[step, place])
        if 0 < place < len(FINE) - 1:
            before, here, after = fine[step, place - 1 : place + 2]
            bend = before - 2.0 * here + after
            if np.isfinite(bend) and bend < 0.0:
                most = float(here - (after - before) ** 2 / (8.0 * bend))
        return most


# ---- the figures ----------------------------------------------------------------------------------------------


def steady_speed(course: DriveCourse) -> float:
    """Mean speed of the last whole turn, rad/s: 2π over the time that it takes."""
    return float(TURN / (course.time[-1, -1] - course.last_turn))


def fluctuation(course: DriveCourse) -> float:
    """Coefficient of fluctuation of the last whole turn: (ω_max − ω_min)/ω_mean."""
    if np.isnan(course.last_turn):
        return np.nan
    speed, since = np.abs(course.speed), course.travel - TURN
    first = course.at(since, speed)
    most, least = max(course.largest(speed, since), first), min(-course.largest(-speed, since), first)
    return (most - least) / steady_speed(course)


def starting_time(course: DriveCourse) -> float:
    """The first time, s, at which the mean speed of the turn that ends there is STARTED of that of the last turn."""
    steady = steady_speed(course)
    if not abs(course.speed[0, 0]) < BEGUN * steady:
        return np.nan
    limit, gone, time = TURN / (STARTED * steady), course.gone.ravel(), course.time.ravel()

    def longer(place: float) -> float:
        """By how much the turn that ends here takes longer."""
        return course.at(place, course.time) - course.at(place - TURN, course.time) - limit

    takes = np.where(gone >= TURN, time - np.interp(gone - TURN, gone, time), np.inf)
    first = int(np.argmax(takes <= limit))
    low = max(TURN, float(gone[max(first - len(NODES), 0)]))
    high = float(gone[min(first + len(NODES), len(gone) - 1)])
    inside = longer(high) < 0.0 < longer(low)
    started = brentq(longer, low, high, rtol=1e-15) if inside else low if longer(low) <= 0.0 else high
    return course.at(started, course.time)


def peak_effort(course: DriveCourse) -> float:
    """The largest |effort| of the drive, N m or N."""
    return max(course.largest(course.effort), course.largest(-course.effort))


FIGURES: dict[str, Callable[[DriveCourse], float]] = {
    "starting_time": starting_time,
    "steady_speed": steady_speed,
    "fluctuation": fluctuation,
    "peak_effort": peak_effort,
}


# ---- in a summary ---------------------------------------------------------------------------------------------


def steady_figures(motion: FreeMotion, solution: Solution, i: int) -> list[Figure]:
    """Mean speed, starting time and coefficient of fluctuation of a free coordinate, see `FIGURES`; or its run-down.

    None of a slide, of less than three turns, or where it does not run steadily; run-down where it rests at the end.
    """
    name = motion.names[i]
    if not solution.stretches:
        return []
    if solution.stretches[-1].resting:
        return _run_down(motion, solution, i)
    if not motion.system.turns(name):
        return []
    figures = DriveCourse.of(motion, solution, i).figures()
    steady, started = figures["steady_speed"], figures["starting_time"]
    if not np.isfinite(steady):
        return []
    start = Figure(f"{name}.starting_time", f"starting time of {name}", started, "s", f"to {STARTED:.0%} of that speed")
    return [
        Figure(f"{name}.speed_mean", f"speed of {name}", steady, "rad/s", "mean of the last turn"),
        *([start] if np.isfinite(started) else []),
        Figure(
            f"{name}.fluctuation", f"coefficient of fluctuation of {name}", figures["fluctuation"], "1", "last turn"
        ),
    ]


def _run_down(motion: FreeMotion, solution: Solution, i: int) -> list[Figure]:
    """How long, and how far, a free coordinate still moves after its motor is switched off, or from the start if it has
    none, until all rest; nothing if it did not move then."""
    name, drive = list(motion.drives.items())[i]
    off = 0.0 if drive.motor is None else drive.off_from
    rest = next((event.time for event in reversed(solution.events) if event.kind == "rest"), np.nan)
    if not off < rest:
        return []
    (begin, end), unit = solution.at(np.array([off, rest]))[0][i], "rad" if motion.system.turns(name) else "m"
    return [
        Figure(f"{name}.run_down", f"run-down of {name}", rest - off, "s", "until it rests"),
        Figure(f"{name}.run_down_way", f"run-down of {name}", end - begin, unit, "on its way"),
    ]

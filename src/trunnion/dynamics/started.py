"""What is said of a motion that goes round and round: how it starts, how evenly it then runs, how it runs down."""

from __future__ import annotations

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

FIGURES = ("starting_time", "steady_speed", "fluctuation", "peak_effort")
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
        steps = list[Array]()
        for stretch in solution.stretches:
            half = 0.5 * (stretch.end - stretch.begin)
            if not half > 0.0:
                continue
            time = stretch.begin + half * (1.0 + NODES)
            at = stretch.at(solution.layout, time)
            second = at.rate @ _DERIVED.T / half
            senses = {} if motion.rests(at) else motion.senses(at)
            effort = motion.given(at, 0.0 * second if stretch.resting else second, senses)[i]
            steps.append(np.array([time, at.q[i], at.rate[i], effort]))
        return cls(*np.stack(steps or [np.zeros((4, len(NODES)))], axis=1))

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

    @np.errstate(all="ignore")
    def figures(self) -> dict[str, float]:
        """Every figure of `FIGURES`; NaN where the motion has none.

        starting_time: the first time, s, at which the mean speed of the turn that ends there is STARTED of that of the
        last one; steady_speed: of the last whole turn, 2π over the time that it takes, rad/s; fluctuation: its
        coefficient, (ω_max − ω_min)/ω_mean; peak_effort: the largest |effort|, N m or N.
        """
        figures = dict.fromkeys(FIGURES, np.nan)
        figures["peak_effort"] = max(self.largest(self.effort), self.largest(-self.effort))
        if np.isfinite(self.last_turn):
            steady = float(TURN / (self.time[-1, -1] - self.last_turn))
            speed, since = np.abs(self.speed), self.travel - TURN
            first = self.at(since, speed)
            most, least = max(self.largest(speed, since), first), min(-self.largest(-speed, since), first)
            figures |= {"steady_speed": steady, "fluctuation": (most - least) / steady}
            if abs(self.speed[0, 0]) < BEGUN * steady:
                figures["starting_time"] = self._started(TURN / (STARTED * steady))
        return figures

    def _started(self, limit: float) -> float:
        """The first time, s, at which the turn that ends there has taken no longer than a limit, s."""
        gone, time = self.gone.ravel(), self.time.ravel()

        def longer(place: float) -> float:
            """By how much the turn that ends here takes longer."""
            return self.at(place, self.time) - self.at(place - TURN, self.time) - limit

        takes = np.where(gone >= TURN, time - np.interp(gone - TURN, gone, time), np.inf)
        first = int(np.argmax(takes <= limit))
        low = max(TURN, float(gone[max(first - len(NODES), 0)]))
        high = float(gone[min(first + len(NODES), len(gone) - 1)])
        inside = longer(high) < 0.0 < longer(low)
        started = brentq(longer, low, high, rtol=1e-15) if inside else low if longer(low) <= 0.0 else high
        return self.at(started, self.time)


def steady_figures(motion: FreeMotion, solution: Solution, i: int) -> list[Figure]:
    """Mean speed, starting time and coefficient of fluctuation of a free coordinate, see `FIGURES`; where it rests at
    the end its run-down: how long, and how far, it still moves after its motor is switched off, or from the start if it
    has none, until all rest. None of a slide, of less than three turns, or where it does not run steadily."""
    name, drive = list(motion.drives.items())[i]
    turns = motion.system.turns(name)
    if solution.stretches and solution.stretches[-1].resting:
        off = 0.0 if drive.motor is None else drive.off_from
        rest = next((event.time for event in reversed(solution.events) if event.kind == "rest"), np.nan)
        if not off < rest:
            return []
        (begin, end), subject = solution.at(np.array([off, rest]))[0][i], f"run-down of {name}"
        return [
            Figure(f"{name}.run_down", subject, rest - off, "s", "until it rests"),
            Figure(f"{name}.run_down_way", subject, end - begin, "rad" if turns else "m", "on its way"),
        ]
    figures = DriveCourse.of(motion, solution, i).figures() if turns and solution.stretches else {}
    told = [
        ("steady_speed", "speed_mean", f"speed of {name}", "rad/s", "mean of the last turn"),
        ("starting_time", "starting_time", f"starting time of {name}", "s", f"to {STARTED:.0%} of that speed"),
        ("fluctuation", "fluctuation", f"coefficient of fluctuation of {name}", "1", "last turn"),
    ]
    return [
        Figure(f"{name}.{short}", subject, figures[key], unit, which)
        for key, short, subject, unit, which in told
        if np.isfinite(figures.get(key, np.nan))
    ]

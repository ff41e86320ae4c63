"""What is said of a motion that goes round and round: how long it takes to start, and how evenly it then runs."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from trunnion.dynamics.integrate import Solution
from trunnion.dynamics.state import FreeMotion
from trunnion.results.figure import Figure

__all__ = ["steady_figures"]

Array = NDArray[np.float64]

LOOKED, LAST = 2000, 720  # times at which the motion is looked at, and its last turn
STEADY = 0.02  # of the mean speed: by how much the turn before the last may differ where it runs steadily
STARTED = 0.95  # of the mean speed of the last turn: from then on it has started
FEWEST = 3  # whole turns of which one speaks of a steady one


def steady_figures(motion: FreeMotion, solution: Solution, i: int) -> list[Figure]:
    """Mean speed, starting time and coefficient of fluctuation of a free coordinate, by its whole turns.

    The mean speed of a turn is 2π over the time it takes; started is where the mean over the turn that ends there first
    is STARTED of that of the last; fluctuation: (ω_max − ω_min)/ω_mean of the last whole turn. None of a slide, or of
    less than FEWEST turns.
    """
    name = motion.names[i]
    if not motion.system.turns(name) or not solution.stretches:
        return []
    time = np.linspace(0.0, solution.end, LOOKED)
    turned = _turned(solution, time, i)
    if turned[-1] < FEWEST * 2 * np.pi or np.any(np.diff(turned) < 0) or solution.stretches[-1].resting:
        return []
    before = np.interp(turned - 2 * np.pi, turned, time, left=np.nan)
    mean = 2 * np.pi / (time - before)
    fine = np.linspace(before[-1], time[-1], LAST)
    rate = np.abs(solution.at(fine)[0][solution.layout.coordinates + i])
    steady = float(turned[-1] - _turned(solution, fine[:1], i)[0]) / (time[-1] - before[-1])
    last = np.interp(time[-1] - 2 * np.pi / steady, time, np.nan_to_num(mean))
    if not abs(last - steady) <= STEADY * steady:
        return []
    first = int(np.argmax(np.nan_to_num(mean) >= STARTED * steady))
    near = np.linspace(time[max(first - 1, 0)], time[first], LAST)
    ends = _turned(solution, near, i)
    means = 2 * np.pi / (near - np.interp(ends - 2 * np.pi, turned, time, left=np.nan))
    started = float(near[int(np.argmax(np.nan_to_num(means) >= STARTED * steady))])
    begun = abs(float(solution.at(np.zeros(1))[0][solution.layout.coordinates + i, 0])) < 0.5 * steady
    fluctuation = (np.max(rate) - np.min(rate)) / steady
    start = Figure(f"{name}.starting_time", f"starting time of {name}", started, "s", f"to {STARTED:.0%} of that speed")
    return [
        Figure(f"{name}.speed_mean", f"speed of {name}", steady, "rad/s", "mean of the last turn"),
        *([start] if begun else []),
        Figure(f"{name}.fluctuation", f"coefficient of fluctuation of {name}", fluctuation, "1", "last turn"),
    ]


def _turned(solution: Solution, time: Array, i: int) -> Array:
    """How far a coordinate has turned, rad."""
    found: Array = np.abs(solution.at(time)[0][i] - solution.at(np.zeros(1))[0][i])
    return found

"""What is said of a motion that goes round and round: how long it takes to start, and how evenly it then runs."""

from __future__ import annotations

import numpy as np

from trunnion.dynamics.course import STARTED, Courses
from trunnion.dynamics.integrate import Solution
from trunnion.dynamics.state import FreeMotion
from trunnion.results.figure import Figure

__all__ = ["steady_figures"]


def steady_figures(motion: FreeMotion, solution: Solution, i: int) -> list[Figure]:
    """Mean speed, starting time and coefficient of fluctuation of a free coordinate, see `course.FIGURES`.

    None of a slide, of less than three turns, or where it does not run steadily.
    """
    name = motion.names[i]
    if not motion.system.turns(name) or not solution.stretches:
        return []
    figures = {key: float(value[0]) for key, value in Courses.of_solution(motion, solution, i).figures().items()}
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

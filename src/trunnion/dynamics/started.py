"""What is said of a motion that goes round and round: how it starts, how evenly it then runs, how it runs down."""

from __future__ import annotations

import numpy as np

from trunnion.dynamics.course import STARTED, Courses
from trunnion.dynamics.solution import Solution
from trunnion.dynamics.state import FreeMotion
from trunnion.results.figure import Figure

__all__ = ["steady_figures"]


def steady_figures(motion: FreeMotion, solution: Solution, i: int, course: Courses) -> list[Figure]:
    """Mean speed, starting time and coefficient of fluctuation of a free coordinate, see `course.FIGURES`; or its
    run-down.

    None of a slide, of less than three turns, or where it does not run steadily; run-down where it rests at the end.
    """
    name = motion.names[i]
    if not solution.stretches:
        return []
    if solution.stretches[-1].resting:
        return _run_down(motion, solution, i)
    if not motion.system.turns(name):
        return []
    figures = {key: float(value[0]) for key, value in course.figures().items()}
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
    rest = next((one.time for one in reversed(solution.events) if one.kind == "rest"), np.nan)
    if not off < rest:
        return []
    (begin, end), unit = solution.at(np.array([off, rest]))[0][i], "rad" if motion.system.turns(name) else "m"
    return [
        Figure(f"{name}.run_down", f"run-down of {name}", rest - off, "s", "until it rests"),
        Figure(f"{name}.run_down_way", f"run-down of {name}", end - begin, unit, "on its way"),
    ]
